"""Fragility of a five-storey concrete frame under the FEMA P-695 far-field records.

    python studies/p695_fragility.py --out results

A Hazus C1M high-code building with scatter on mass, stiffness, strength and damping is analysed under the 44 far-field
components, each scaled to stripes of Sa(T1, 5 %). The study writes p695_fragility.nc and six figures.
"""

from __future__ import annotations

import time

import numpy as np
import xarray as xr
from parts.command_line import file_in, read_arguments, save_figures

import warpdyn as wd
from warpdyn.foundations.files import netcdf
from warpdyn.model.ground_motions.records import far_field

# Hazus C1M, high code: a concrete frame with a first period of 0.75 s. The drift ratio limit of complete damage is 5.3
# %. At a drift ratio of 10 % the frame is assumed to collapse.
BUILDING = wd.ShearBuilding.from_hazus("C1M", "high", storeys=5, damping_modes=(1, 3))
DRIFT_LIMITS = wd.hazus_drift_limits("C1M", "high")
COLLAPSE_DRIFT_RATIO = 0.10
LEVELS_IN_G = (0.05, 0.1, 0.15, 0.2, 0.3, 0.4, 0.6, 0.8, 1.0, 1.25, 1.5, 2.0, 2.5, 3.0, 4.0, 5.0, 6.5)
CHECKED_SHARE = 0.01  # fraction of the histories that are run again with half the step, to estimate errors
SCATTER = {
    "mass": wd.RandomFactor(wd.Lognormal(median=1.0, dispersion=0.10)),
    "stiffness": wd.RandomFactor(wd.Lognormal(median=1.0, dispersion=0.20)),
    "yield_force": wd.RandomFactor(wd.Lognormal(median=1.0, dispersion=0.25), per="storey", storey_correlation=0.8),
    "damping_ratio": wd.RandomFactor(wd.Lognormal(median=1.0, dispersion=0.30)),
}


def build_scene() -> wd.Scene:
    """Return the scene of the study: the building with its scatter, and the records scaled to the stripes."""
    return wd.Scene(
        structure=BUILDING,
        excitation=wd.Stripes(far_field(), LEVELS_IN_G, wd.SpectralAcceleration(BUILDING.fundamental_period)),
        scatter=SCATTER,
        correlation={("stiffness", "yield_force"): 0.6},
        sampling="sobol",
        collapse_drift_ratio=COLLAPSE_DRIFT_RATIO,
        title="Fragility of a five-storey HAZUS C1M high-code building under the FEMA P-695 far-field records",
    )


def loop_sample(scene: wd.Scene) -> int:
    """Return the index of the sample whose hysteresis loop is drawn: first structure, first record, 1 g."""
    first = scene.excitation.assign(structures=[0], seed=0)
    return int(np.flatnonzero((first.motion == 0) & np.isclose(first.im_level, 1.0))[0])


def print_table(result: xr.Dataset) -> None:
    """Print medians [g] and dispersions of the fragility curves with their confidence intervals."""
    confidence = 100 * result.attrs["confidence"]
    print(f"\n{'damage state':<12} {'drift limit':>11}   median Sa(T1) [g]         dispersion")
    for state in result["damage_state"].values:
        row = result.sel(damage_state=state)
        median, dispersion = (
            f"{float(row[name]):6.3f} [{float(row[f'{name}_lower']):6.3f}, {float(row[f'{name}_upper']):6.3f}]"
            for name in ("fragility_median", "fragility_dispersion")
        )
        print(f"{state:<12} {float(row['damage_limit']):>11.4f}   {median}   {dispersion}")
    print(f"brackets: {confidence:.0f} % intervals over records and structures")


def main() -> None:
    """Run the study from the command line."""
    arguments = read_arguments(__doc__, 64, meaning="structures under each record at each level", counted="structures")
    target = file_in(arguments.out, "p695_fragility.nc")

    started = time.perf_counter()
    scene = build_scene()
    loop = wd.Histories((loop_sample(scene),))
    print(
        f"{scene.structure}: T1 = {scene.structure.fundamental_period:.3f} s, {len(scene.excitation.motions)} records"
    )
    run = wd.simulate(
        scene,
        structures=arguments.structures,
        device=arguments.device,
        seed=arguments.seed,
        histories=loop,
        checked_share=CHECKED_SHARE,
    )
    simulated = time.perf_counter()
    result = run.merge(wd.fragility(run, DRIFT_LIMITS, seed=arguments.seed), combine_attrs="no_conflicts")
    fitted = time.perf_counter()
    netcdf.write(result, target)
    written = time.perf_counter()
    figures = {
        "p695_fragility": wd.plots.fragility_curves(result),
        "p695_drift_over_height": wd.plots.drift_over_height(result),
        "p695_drift_against_intensity": wd.plots.drift_against_intensity(result),
        "p695_ida_curves": wd.plots.ida_curves(result),
        "p695_residual_drifts": wd.plots.residual_drifts(result),
        "p695_hysteresis": wd.plots.hysteresis(result),
    }
    save_figures(figures, arguments.out)
    drawn = time.perf_counter()

    print(wd.summary(run))
    print_table(result)
    sampling, integrating = (run.attrs[f"seconds_{part}"] for part in ("sampling", "integrating"))
    parts = {
        "sampling": sampling,
        "integrating": integrating,
        "labels, one history, check": simulated - started - sampling - integrating,
        "statistics": fitted - simulated,
        "writing": written - fitted,
        "figures": drawn - written,
    }
    print(f"\n{drawn - started:.1f} s: " + ", ".join(f"{name} {value:.2f}" for name, value in parts.items()))
    print(f"wrote {target} and " + ", ".join(f"{name}.png" for name in figures))


if __name__ == "__main__":
    main()
