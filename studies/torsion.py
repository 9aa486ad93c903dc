"""Fragility of a torsional building under pairs of records, compared with its symmetric chain.

    python studies/torsion.py --out results

A building of three storeys has equal stiffness and strength in both directions, but its walls are off centre. It is
analysed under the 22 far-field pairs of FEMA P-695 at stripes of RotD50 Sa, with a random angle of incidence, random
(accidental) eccentricities of the mass and random strength. Three models are compared under the same pairs at the same
levels:

- the torsional building, with the drift of the edges of its plan;
- the symmetric building, whose frames have the same stiffness and strength but are placed symmetrically, without
  eccentricities, under the same pairs with a random angle;
- the symmetric chain of storeys under each recorded component separately, with the larger of both demands.

The study writes torsion.nc and one figure.
"""

from __future__ import annotations

import time

import numpy as np
import xarray as xr
from matplotlib.figure import Figure
from parts.command_line import file_in, read_arguments, save_figures

import warpdyn as wd
from warpdyn import plots
from warpdyn.foundations.files import netcdf
from warpdyn.model.ground_motions.records import far_field

HEIGHT = 3.0  # m, of a storey
PLAN = [[-10.0, 10.0], [-6.0, 6.0]]  # m
MASS = np.array([250e3, 250e3, 200e3])  # kg
STIFFNESS = 120e6 * np.array([1.0, 0.85, 0.6])  # N/m, of a storey in each direction
YIELD_DRIFT_RATIO = 0.006
CAPACITY = 0.05 * HEIGHT  # m, drift of a frame at collapse
LAW = {"hardening_ratio": 0.03}
DAMPED = {"damping": "rayleigh", "damping_ratio": 0.05}
PLACES = {"torsional": (-9.0, 9.0, 0.68), "symmetric": (-9.0, 9.0, 0.5)}  # of both walls in y: x, x, share of the first
STATES = {"light": 0.007, "moderate": 0.015, "extensive": 0.03, "collapse": np.inf}
SHOWN = "moderate"
LEVELS_IN_G = (0.1, 0.2, 0.3, 0.4, 0.55, 0.7, 0.9, 1.2, 1.6, 2.1, 2.8)
STRENGTH = {"yield_force": wd.RandomFactor(wd.Lognormal(1.0, 0.25))}  # one factor for all frames and storeys
ANGLE = {"incidence_angle": wd.RandomValue(wd.Uniform(0.0, 2 * np.pi))}
ACCIDENTAL = {  # 5 % of the dimension of the plan to either side
    f"eccentricity_{axis}": wd.RandomValue(wd.Uniform(-0.05 * np.ptp(ends), 0.05 * np.ptp(ends)))
    for axis, ends in zip("xy", PLAN, strict=True)
}
MODELS = {  # name of the curve: model, demand
    "torsional building": ("torsional", "edges of the plan, in x or y"),
    "torsional building, corners": ("torsional", "resultant of x and y (SRSS) of the corners"),
    "symmetric building": ("symmetric", "edges of the plan, in x or y"),
    "symmetric chain": ("chain", "larger of two components analysed separately"),
}
OTHERS = "torsional building, corners"  # in the table, but not in the figure


def building(kind: str) -> wd.TorsionalBuilding:
    """Return the torsional or the symmetric building; both have the same storey stiffness and strength in x and y."""
    west, east, share = PLACES[kind]
    frames = []
    for name, position, direction, part in (
        ("south", (0.0, -5.0), "x", 0.5),
        ("north", (0.0, 5.0), "x", 0.5),
        ("west", (west, 0.0), "y", share),
        ("east", (east, 0.0), "y", 1.0 - share),
    ):
        of_frame = part * STIFFNESS
        law = wd.laws.Bilinear(yield_force=YIELD_DRIFT_RATIO * HEIGHT * of_frame, **LAW)
        frames.append(wd.PlanFrame(name, position, direction, of_frame, law=law, deformation_capacity=CAPACITY))
    return wd.TorsionalBuilding(MASS, PLAN, frames, corner_drifts=True, damping_modes=(1, 6), **DAMPED)


def chain() -> wd.ShearBuilding:
    """Return the chain of storeys of one direction."""
    law = wd.laws.Bilinear(yield_force=YIELD_DRIFT_RATIO * HEIGHT * STIFFNESS, **LAW)
    return wd.ShearBuilding(MASS, STIFFNESS, HEIGHT, law=law, damping_modes=(1, 2), **DAMPED)


def drift_ratios(kind: str, structures: int, seed: int, device: str | None) -> dict[str, xr.Dataset]:
    """Return the status and the variable `drift_ratio` of each sample of a model, for its curves by name."""
    measure = wd.RotatedSpectralAcceleration(chain().fundamental_period)
    settings = {"structures": structures, "seed": seed, "device": device}
    if kind == "chain":
        motions = far_field()
        stripes = wd.Stripes(motions, LEVELS_IN_G, measure)
        scene = wd.Scene(chain(), stripes, STRENGTH, recorders=("drift",), collapse_drift_ratio=CAPACITY / HEIGHT)
        run = wd.larger_of_components(wd.simulate(scene, **settings), motions)
        demands = {"symmetric chain": run["peak_storey_drift_ratio"].max("storey")}
    else:
        scatter = STRENGTH | ANGLE | (ACCIDENTAL if kind == "torsional" else {})
        stripes = wd.Stripes(wd.PairOfMotions.from_records(far_field()), LEVELS_IN_G, measure)
        run = wd.simulate(wd.Scene(building(kind), stripes, scatter, recorders=("output",)), **settings)
        peaks = run["peak_output"]  # "x1 at y=-6" is the drift of an edge, "1 at x=-10, y=-6" that of a corner
        is_edge = np.array([name[0] in "xy" for name in peaks["output"].values])
        demands = {f"{kind} building": peaks[:, is_edge].max("output") / HEIGHT}
        if kind == "torsional":
            demands[OTHERS] = peaks[:, ~is_edge].max("output") / HEIGHT
    label = {"long_name": "largest peak storey drift ratio", "units": "1"}
    return {name: run[["status"]].assign(drift_ratio=each.assign_attrs(label)) for name, each in demands.items()}


def draw(curves: xr.Dataset) -> Figure:
    """Return a figure of the fragility curves of the models for one damage state."""
    shown = curves.sel(damage_state=[SHOWN])
    names = [name for name in MODELS if name != OTHERS]
    figure = plots.fragility_comparison({name: shown.sel(model=name) for name in names})
    torsional, symmetric = (
        float(shown["fragility_median"].sel(model=name).item()) for name in ("torsional building", "symmetric chain")
    )
    limit = f"{100 * STATES[SHOWN]:g} % drift"
    figure.axes[0].set_title(f"Torsion reduces the median Sa at {limit} from {symmetric:.2f} g to {torsional:.2f} g")
    return figure


def print_medians(curves: xr.Dataset) -> None:
    """Print the median [g] of each fragility curve with its confidence interval, and the dispersion."""
    for state in curves["damage_state"].values:
        print(f"\n{state}")
        for name in curves["model"].values:
            row = curves.sel(model=name, damage_state=state)
            ends = "fragility_median_lower", "fragility_median_upper"
            low, high = (float(row[end]) for end in ends)
            median, dispersion = float(row["fragility_median"]), float(row["fragility_dispersion"])
            print(f"  {name:<28}{median:7.3f} g [{low:.3f}, {high:.3f}], dispersion {dispersion:.2f}")


def main() -> None:
    """Run the study from the command line."""
    arguments = read_arguments(__doc__, 16, meaning="structures under each pair at each level", counted="structures")
    target = file_in(arguments.out, "torsion.nc")
    started = time.perf_counter()
    samples: dict[str, xr.Dataset] = {}
    for kind in dict.fromkeys(kind for kind, _ in MODELS.values()):
        samples |= drift_ratios(kind, arguments.structures, arguments.seed, arguments.device)
        print(f"{kind}: {time.perf_counter() - started:.1f} s")
    parts = []
    for name in MODELS:
        curves = wd.fragility(samples[name], STATES, demand="drift_ratio", seed=arguments.seed)
        kept = samples[name].drop_vars([each for each in samples[name].coords if each != "sample"])
        parts.append(kept.merge(curves, combine_attrs="drop_conflicts").expand_dims(model=[name]))
    result = xr.concat(parts, "model", combine_attrs="drop_conflicts")
    result["model"].attrs = {"long_name": "model"}
    title = "Fragility of a torsional building under pairs of records, compared with its symmetric chain"
    result.attrs |= netcdf.trace(title, "simulate, warpdyn.fragility")
    netcdf.write(result, target)
    save_figures({"torsion": draw(result)}, arguments.out)
    print_medians(result)
    print(f"\n{time.perf_counter() - started:.1f} s; wrote {target} and torsion.png")


if __name__ == "__main__":
    main()
