"""Fragility with motions selected for a conditional spectrum, compared with unselected records and synthetic motions.

    python studies/hazard_consistent.py --out results

The building of studies/p695_fragility.py is analysed at seven levels of Sa(T1) with three sets of motions: 30 motions
that are selected for the conditional spectrum of each level, the 44 far-field records of FEMA P-695, and 44 synthetic
motions of the same scenario (M 7.5, 10 km); both are scaled to all levels. The selection is from 100 recorded
components and 900 synthetic motions. The study writes hazard_consistent.nc and two figures.
"""

from __future__ import annotations

import time

import numpy as np
import pandas as pd
import xarray as xr
from p695_fragility import BUILDING, COLLAPSE_DRIFT_RATIO, DRIFT_LIMITS, SCATTER
from parts.command_line import file_in, read_arguments, save_figures

import warpdyn as wd
from warpdyn.foundations.files import netcdf
from warpdyn.model.ground_motions.records import far_field, near_field

FIRST = BUILDING.fundamental_period
MEASURE = wd.SpectralAcceleration(FIRST)
LEVELS_IN_G = (0.1, 0.2, 0.4, 0.7, 1.1, 1.6, 2.4)
SELECTED = 30  # motions per level
# Median [g] and dispersion of Sa for M 7.5, Rjb 10 km, Vs30 400 m/s, reverse: Boore et al. (2014), computed with
# wd.ground_motion_model("BooreEtAl2014", PERIODS, {"mag": 7.5, "rjb": 10, "vs30": 400, "rake": 90}), OpenQuake 3.26.
PERIODS = np.array([0.1, 0.15, 0.2, 0.3, 0.4, 0.5, 0.75, 1.0, 1.5, 2.0])
MEDIANS = np.array([0.5679, 0.7017, 0.7611, 0.7798, 0.7234, 0.652, 0.4846, 0.3856, 0.2587, 0.1848])
SIGMAS = np.array([0.7088, 0.6625, 0.6213, 0.6059, 0.6168, 0.6395, 0.6765, 0.6924, 0.6945, 0.7001])
SCENARIOS = [
    (magnitude, distance, vs30) for magnitude in (6.5, 7.0, 7.5) for distance in (10.0, 20.0, 30.0) for vs30 in (400.0,)
]


def targets() -> list[wd.TargetSpectrum]:
    """Return the conditional spectrum of each level; the model is interpolated at the period of the building."""
    periods = np.unique(np.append(PERIODS[np.abs(PERIODS - FIRST) > 0.01], FIRST))
    median = np.exp(np.interp(np.log(periods), np.log(PERIODS), np.log(MEDIANS)))
    sigma = np.interp(np.log(periods), np.log(PERIODS), SIGMAS)
    return [wd.conditional_spectrum(periods, median, sigma, MEASURE, level=level) for level in LEVELS_IN_G]


def library(synthetic: int, periods: np.ndarray, seed: int) -> wd.RecordSpectra:
    """Return the spectra of the recorded components and of synthetic motions of nine scenarios."""
    motions = [*far_field(), *near_field()]
    sources = ["recorded"] * len(motions)
    each = -(-synthetic // len(SCENARIOS))
    for place, scenario in enumerate(SCENARIOS):
        motions += wd.RezaeianDerKiureghian(*scenario).motions(each, seed, first=place * each)
    sources += ["synthetic"] * (len(motions) - len(sources))
    events = [motion.record or f"synthetic {i}" for i, motion in enumerate(motions)]
    table = pd.DataFrame({"name": [motion.name for motion in motions], "event": events, "source": sources})
    with wd.meant_as_given("weakest_motions"):  # distant synthetic motions are weak
        return wd.RecordSpectra.from_motions(motions, periods, table)


def curves_of(design: wd.Stripes, structures: int, seed: int, device: str | None) -> xr.Dataset:
    """Return the fragility curves of the building under a design; each motion acts on the same structures."""
    scene = wd.Scene(
        structure=BUILDING,
        excitation=design,
        scatter=SCATTER,
        correlation={("stiffness", "yield_force"): 0.6},
        sampling="sobol",
        recorders=("drift",),
        collapse_drift_ratio=COLLAPSE_DRIFT_RATIO,
        title="Fragility of a five-storey HAZUS C1M high-code building",
    )
    run = wd.simulate(scene, structures=structures, seed=seed, device=device)
    return wd.fragility(run, DRIFT_LIMITS, seed=seed)


def main() -> None:
    """Run the study from the command line."""
    arguments = read_arguments(__doc__, 16, meaning="structures under each motion at each level", counted="structures")
    target = file_in(arguments.out, "hazard_consistent.nc")
    started = time.perf_counter()
    wanted = targets()
    spectra = library(900 if arguments.structures > 4 else 90, np.asarray(wanted[0].periods), arguments.seed)
    generated = time.perf_counter()
    selection = wd.select_records(spectra, wanted, SELECTED, most_per_event=3, seed=arguments.seed)
    selected = time.perf_counter()
    for level, (median, deviation) in zip(LEVELS_IN_G, selection.largest_errors, strict=True):
        print(f"{level:4.1f} g: median within {100 * median:.1f} %, standard deviation within {100 * deviation:.1f} %")
    print(selection.table().groupby("level")["source"].value_counts().unstack(fill_value=0))

    with wd.meant_as_given("weakest_motions"):
        designs = {
            "selected for each level": selection.stripes(),
            "far-field records": wd.Stripes(far_field(), LEVELS_IN_G, MEASURE),
            "synthetic motions": wd.Stripes(
                wd.RezaeianDerKiureghian(7.5, 10.0, 400.0, "reverse").motions(44, arguments.seed + 1),
                LEVELS_IN_G,
                MEASURE,
            ),
        }
        curves = {
            name: curves_of(design, arguments.structures, arguments.seed, arguments.device)
            for name, design in designs.items()
        }
    result = xr.concat([each.expand_dims(motions=[name]) for name, each in curves.items()], "motions", join="outer")
    result["motions"].attrs = {"long_name": "set of ground motions"}
    result.attrs |= netcdf.trace("Fragility with motions selected for a conditional spectrum", "warpdyn.fragility")
    netcdf.write(result, target)
    figures = {
        "hazard_consistent": wd.plots.fragility_comparison(curves),
        "hazard_consistent_selection": wd.plots.record_selection(selection, level=4),
    }
    save_figures(figures, arguments.out)
    print(f"\n{'median Sa(T1) [g]':<24}" + "".join(f"{state:>26}" for state in result["damage_state"].values))
    for name, each in curves.items():
        ends = (each[f"fragility_median{end}"].values for end in ("", "_lower", "_upper"))
        rows = zip(*ends, strict=True)
        print(f"{name:<24}" + "".join(f"{m:>10.3f} [{low:6.3f},{high:6.3f}]" for m, low, high in rows))
    done = time.perf_counter()
    parts = f"library {generated - started:.1f}, selection {selected - generated:.1f}"
    print(f"\n{done - started:.1f} s ({parts}); wrote {target} and {', '.join(f'{name}.png' for name in figures)}")


if __name__ == "__main__":
    main()
