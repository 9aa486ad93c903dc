"""Time of the fragility study studies/p695_fragility.py (the main job), from its scene to a file, by parts."""

from __future__ import annotations

import tempfile
import time
from pathlib import Path
from typing import Any

from p695_fragility import DRIFT_LIMITS, build_scene

import warpdyn as wd
from parts.benchmark.kernels import seconds_in_kernels
from warpdyn.foundations.files import netcdf

TIMED_RUNS = 2  # number of timed runs after a warm-up; the times are those of the faster run
PARTS = {
    "sampling": "drawing the structures and laying out their steps",
    "kernels": "in kernels",
    "packing and transfer": "around the kernels, to and from the device",
    "labelling": "from arrays to the dataset",
    "statistics": "fragility curves with their intervals",
    "writing": "the dataset to netCDF",
}


def measure_job(device: str | list[str], histories: int) -> dict[str, Any]:
    """Return the times of the main job (the fragility study of p695_fragility.py) with at least `histories` histories.

    Returns:
        The time of each part and of `simulate` [s], and the ratios of the times to the dataset and to the file to the
        time in kernels.
    """
    scene = build_scene()
    of_a_structure = len(scene.excitation.motions) * len(scene.excitation.levels)
    structures = -(-histories // of_a_structure)
    wd.simulate(scene, structures=structures, device=device)
    with tempfile.TemporaryDirectory() as folder:
        runs = [_run(scene, structures, device, Path(folder) / "job.nc") for _ in range(TIMED_RUNS)]
    return min(runs, key=lambda row: row["simulate"]) | {"device": device, "histories": structures * of_a_structure}


def _run(scene: wd.Scene, structures: int, device: str | list[str], path: Path) -> dict[str, Any]:
    started = time.perf_counter()
    run = wd.simulate(scene, structures=structures, device=device)
    simulated = time.perf_counter()
    curves = wd.fragility(run, DRIFT_LIMITS)
    fitted = time.perf_counter()
    netcdf.write(run.merge(curves, combine_attrs="no_conflicts"), path)
    written = time.perf_counter()
    kernels = seconds_in_kernels(run)
    sampling, integrating = (run.attrs[f"seconds_{part}"] for part in ("sampling", "integrating"))
    whole, writing = simulated - started, written - fitted
    # Sampling and packing may overlap with kernels, so the sum of the parts may exceed the total time.
    parts = {
        "sampling": sampling,
        "kernels": kernels,
        "packing and transfer": max(integrating - kernels, 0.0),
        "labelling": max(whole - sampling - integrating, 0.0),
        "statistics": fitted - simulated,
        "writing": writing,
    }
    ratios = {"to_dataset": whole / kernels, "to_netcdf": (whole + writing) / kernels}
    return {"parts": parts, "simulate": whole, **ratios}
