"""Fragility of a five-storey concrete frame: unprotected, on isolators, and with a tuned mass damper.

    python studies/isolation.py --out results

The Hazus C1M high-code building of studies/p695_fragility.py is analysed in three variants: with a fixed base, on
lead-rubber bearings, and with a tuned mass damper on its roof. In all variants the inherent damping is proportional to
the stiffness, for a fair comparison. The motions are the 44 far-field components of FEMA P-695. They are scaled to the
same stripes of Sa at the period of the fixed-base building. Damage states refer to the five storeys of the building; a
failure of the isolators counts as collapse. The study writes isolation.nc and a figure.
"""

from __future__ import annotations

import time

import numpy as np
import xarray as xr
from matplotlib.figure import Figure
from parts.command_line import file_in, read_arguments, save_figures

import warpdyn as wd
from warpdyn import plots
from warpdyn.foundations.core.units import STANDARD_GRAVITY
from warpdyn.foundations.files import netcdf
from warpdyn.model.ground_motions.records import far_field

BUILDING = wd.ShearBuilding.from_hazus("C1M", "high", storeys=5, damped_storeys=(1, 5))
DRIFT_LIMITS = wd.hazus_drift_limits("C1M", "high")
COLLAPSE_DRIFT_RATIO = 0.10
LEVELS_IN_G = (0.1, 0.2, 0.3, 0.4, 0.6, 0.8, 1.0, 1.25, 1.5, 2.0, 2.5, 3.0, 4.0, 5.0)

# The base slab has the mass of a floor. The bearings yield at 5 % of the weight. After yield the isolated building has
# a period of 2.5 s; before yield the bearings are ten times stiffer. They fail at 0.5 m. The tuned mass damper has 5 %
# of the first-mode mass, and its period and damping are those of Den Hartog.
BASE_MASS = float(BUILDING.parameters["mass"][0])
ISOLATED_MASS = BASE_MASS + float(BUILDING.parameters["mass"].sum())
AFTER_YIELD = ISOLATED_MASS * (2 * np.pi / 2.5) ** 2
BUILDINGS = {
    "without devices": BUILDING,
    "tuned mass damper": BUILDING.with_tuned_mass_damper(0.05),
    "lead-rubber bearings": BUILDING.on_isolators(
        "lead_rubber_bearing",
        BASE_MASS,
        displacement_capacity=0.5,
        stiffness=10 * AFTER_YIELD,
        yield_force=0.05 * ISOLATED_MASS * STANDARD_GRAVITY,
        post_yield_stiffness=AFTER_YIELD,
    ),
}
FIRST_STOREY = {"lead-rubber bearings": 2}  # number of the lowest storey above isolators; 1 in other variants
SCATTER = {
    "mass": wd.RandomFactor(wd.Lognormal(median=1.0, dispersion=0.10)),
    "stiffness": wd.RandomFactor(wd.Lognormal(median=1.0, dispersion=0.20)),
    "yield_force": wd.RandomFactor(wd.Lognormal(median=1.0, dispersion=0.25)),
    "damping_ratio": wd.RandomFactor(wd.Lognormal(median=1.0, dispersion=0.30)),
}
KEPT = ("peak_storey_drift_ratio", "peak_floor_acceleration", "status")


def build_scene(name: str) -> wd.Scene:
    """Return the scene of one of the buildings; the scatter also applies to its isolators or its mass damper."""
    return wd.Scene(
        structure=BUILDINGS[name],
        excitation=wd.Stripes(far_field(), LEVELS_IN_G, wd.SpectralAcceleration(BUILDING.fundamental_period)),
        scatter=SCATTER,
        correlation={("stiffness", "yield_force"): 0.6},
        sampling="sobol",
        recorders=("drift", "acceleration", "energy"),
        collapse_drift_ratio=COLLAPSE_DRIFT_RATIO,
        tail=0.0,
        title=f"Fragility of a five-storey HAZUS C1M high-code building: {name}",
    )


def curves_of(name: str, structures: int, seed: int, device: str | None) -> tuple[xr.Dataset, xr.Dataset]:
    """Return the demands and the fragility curves of a building, by its name.

    Returns:
        The demands with the scene, and the fragility curves, both with a dimension `building` of length 1.
    """
    run = wd.simulate(build_scene(name), structures=structures, seed=seed, device=device)
    first = FIRST_STOREY.get(name, 1)
    own = wd.select_storeys(run, first, first + BUILDING.storeys - 1)
    curves = wd.fragility(own, DRIFT_LIMITS, seed=seed)
    print(f"\n{name}: {BUILDINGS[name]}")
    print(wd.summary(run))
    demands = own[list(KEPT)].assign(scene=((), run.attrs["scene"], {"long_name": "scene, as JSON"}))
    return demands.expand_dims(building=[name]), curves.expand_dims(building=[name])


def draw(curves: xr.Dataset) -> Figure:
    """Return a figure of the fragility curves of the buildings, with one panel per damage state."""
    return plots.fragility_comparison({name: curves.sel(building=name) for name in curves["building"].values})


def print_medians(curves: xr.Dataset) -> None:
    """Print the median [g] of each fragility curve with its confidence interval."""
    print(f"\n{'median Sa [g]':<22}" + "".join(f"{state:>26}" for state in curves["damage_state"].values))
    for name in curves["building"].values:
        row = curves.sel(building=name)
        values = zip(
            *(row[f"fragility_median{end}"].values for end in ("", "_lower", "_upper")),
            strict=True,
        )
        print(f"{name:<22}" + "".join(f"{m:>10.3f} [{low:6.3f},{high:6.3f}]" for m, low, high in values))


def main() -> None:
    """Run the study from the command line."""
    arguments = read_arguments(__doc__, 16, meaning="structures under each record at each level", counted="structures")
    target = file_in(arguments.out, "isolation.nc")
    started = time.perf_counter()
    found = [curves_of(name, arguments.structures, arguments.seed, arguments.device) for name in BUILDINGS]
    demands, curves = (
        xr.concat(parts, "building", combine_attrs="drop_conflicts") for parts in zip(*found, strict=True)
    )
    result = demands.merge(curves, combine_attrs="drop_conflicts")
    result["building"].attrs = {"long_name": "building"}
    title = "Fragility of a five-storey building without devices, on isolators and with a tuned mass damper"
    result.attrs |= netcdf.trace(title, "simulate, warpdyn.fragility")
    netcdf.write(result, target)
    save_figures({"isolation": draw(result)}, arguments.out)
    print_medians(result)
    print(f"\n{time.perf_counter() - started:.1f} s; wrote {target} and isolation.png")


if __name__ == "__main__":
    main()
