"""Errors, intervals and times of crossed and nested designs; run by hand, copied to docs/explanation/intervals.md.

    python tests/errors_of_designs.py [seeds] [device]

The first study and one yielding storey, each with 44 records that are the same for all seeds. Errors are differences
from the curves of many structures per record. The last lines are the shares of 95 % intervals of `simulate(scene)` with
its default design that cover the truth, for the storey, with other records and structures in each of 300 replications.
"""

from __future__ import annotations

import sys
import time
import warnings
from collections.abc import Mapping, Sequence
from dataclasses import replace
from pathlib import Path

import numpy as np
import xarray as xr
from coverage_of_intervals import one_storey, population

import warpdyn as wd

sys.path.insert(0, str(Path(__file__).parents[1] / "studies"))
from p695_fragility import DRIFT_LIMITS, build_scene

DESIGNS = (("crossed", 3), ("nested", 1), ("nested", 3), ("nested", 4), ("crossed", 16), ("crossed", 64))
MANY, WITH_INTERVALS, REPLICATIONS, RECORDS = 128, 6, 300, 44
ESTIMATES = ("fragility_median", "fragility_dispersion")


def storey_under(motions: Sequence[wd.GroundMotion], structures_per_motion: int | None = None) -> wd.Scene:
    """Return the yielding storey under some motions."""
    case = one_storey()
    scatter = {name: wd.RandomFactor(wd.Lognormal(1.0, spread)) for name, spread in case.dispersions.items()}
    stripes = wd.Stripes(motions, case.levels, wd.SpectralAcceleration(0.5), structures_per_motion)
    return wd.Scene(case.building, stripes, scatter, recorders=("drift",), tail=0.0, sampling="sobol")


def run(scene: wd.Scene, design: str, count: int, seed: int, device: str) -> tuple[xr.Dataset, float]:
    """Return a run with a number of structures, or of structures per record, and its wall time [s]."""
    structures = count if design == "crossed" else None
    if structures is None:
        scene = replace(scene, excitation=replace(scene.excitation, structures_per_motion=count))
    began = time.perf_counter()
    found = wd.simulate(scene, structures=structures, seed=seed, device=device, keep_inputs=False, sample_error=None)
    return found, time.perf_counter() - began


def logarithms(curves: xr.Dataset) -> np.ndarray:
    """Return the logarithms of median and dispersion, shape [estimate, damage_state]."""
    return np.log([curves[name].values for name in ESTIMATES])


def half_widths(curves: xr.Dataset) -> np.ndarray:
    """Return half the widths of the intervals of the logarithms, mean over the damage states, shape [estimate]."""
    return np.array([float(np.log(curves[f"{n}_upper"] / curves[f"{n}_lower"]).mean()) / 2 for n in ESTIMATES])


def print_errors(name: str, scene: wd.Scene, limits: Mapping[str, float], seeds: int, device: str) -> None:
    """Print a row for each design."""
    many = [wd.fragility(run(scene, "nested", MANY, 900 + each, device)[0], limits) for each in range(2)]
    truth = np.mean([logarithms(curves) for curves in many], axis=0)
    for design, count in DESIGNS:
        errors, widths, seconds = [], [], []
        for seed in range(10, 10 + seeds):
            found, wall = run(scene, design, count, seed, device)
            curves = wd.fragility(found, limits)
            errors.append(logarithms(curves) - truth)
            seconds.append(wall)
            if len(widths) < WITH_INTERVALS:
                widths.append(half_widths(curves))
        error = np.sqrt(np.mean(np.square(errors), axis=(0, 2)))
        numbers = " | ".join(", ".join(f"{value:.3f}" for value in row) for row in (error, np.nanmean(widths, axis=0)))
        print(f"| {name} | {count} {design} | {found.sizes['sample']:,} | {min(seconds):.2f} | {numbers} |", flush=True)


def print_coverage(device: str) -> None:
    """Print how often the intervals of the default design cover the truth."""
    limits, motions, generator = one_storey().limits, population(7), np.random.default_rng(3)
    terms = {"device": device, "keep_inputs": False, "sample_error": None}
    truth = wd.fragility(wd.simulate(storey_under(motions, 2), seed=99, **terms), limits, intervals_over="records")
    covered = []
    for seed in range(REPLICATIONS):
        some = [motions[index] for index in generator.permutation(len(motions))[:RECORDS]]
        curves = wd.fragility(wd.simulate(storey_under(some), seed=seed, **terms), limits)
        covered.append([(curves[f"{n}_lower"] <= truth[n]) & (truth[n] <= curves[f"{n}_upper"]) for n in ESTIMATES])
    for name, shares in zip(ESTIMATES, np.mean(covered, axis=0), strict=True):
        print(name, ", ".join(f"{share:.3f}" for share in shares))


def main() -> None:
    """Print the table and the coverage."""
    warnings.simplefilter("ignore")
    seeds = int(sys.argv[1]) if len(sys.argv) > 1 else 20
    device = sys.argv[2] if len(sys.argv) > 2 else "cpu"
    print("| scene | design | histories | seconds | error: median, dispersion | half width |\n|-|-|-|-|-|-|")
    print_errors("one storey", storey_under(population(5)[:RECORDS]), one_storey().limits, seeds, device)
    print_errors("first study", replace(build_scene(), recorders=("drift",)), DRIFT_LIMITS, seeds, device)
    print_coverage(device)


if __name__ == "__main__":
    main()
