"""Run times of warpdyn in the study benchmark, and peak drifts compared with a reference run in float64."""

from __future__ import annotations

import functools
import os
import time
import warnings
from collections.abc import Sequence
from concurrent.futures import ThreadPoolExecutor
from typing import Any

import numpy as np
import xarray as xr
from tqdm import tqdm

import warpdyn as wd
from parts.benchmark.cases import KERNEL_METHODS, STEP, build_scene, draw_ensemble, spread_out
from warpdyn.campaigns.integration.run import build_run
from warpdyn.campaigns.integration.settings import Execution, Integration
from warpdyn.engine.kernels.build import load_kernel

# After a warm-up there are at least LEAST_RUNS runs, until the time in kernels or the total time reaches these limits
# [s]. The shortest run counts. The clock of a GPU needs about 0.2 s of work to speed up.
LEAST_RUNS, IN_KERNELS_FOR, TIMED_FOR = 2, 0.25, 1.0
COMMON_SAMPLES = 64  # number of samples whose drifts are compared between warpdyn and a peer
LARGEST_DIFFERENCE = 0.01  # relative difference of peak drifts above which a peer counts as wrong


def seconds_in_kernels(run: xr.Dataset) -> float:
    """Return the time of a run in kernels [s]; if the run does not contain it, the integration time."""
    return run.attrs.get("seconds_in_kernels", run.attrs["seconds_integrating"])


def run_quietly(scene: wd.Scene, **terms: Any) -> xr.Dataset:
    """Return the result of `simulate`, without the warning that residual drifts need a longer tail."""
    with warnings.catch_warnings():
        warnings.filterwarnings("ignore", "a tail of")
        return wd.simulate(scene, **terms)


def kernel_seconds(case: dict[str, Any], device: str | list[str] | None = None) -> tuple[float, float, xr.Dataset]:
    """Return the shortest time in kernels and of `simulate` [s] of several runs of a case, and the last dataset."""
    ensemble = draw_ensemble(case["storeys"], case["samples"], case["steps"])
    scene = build_scene(ensemble, case["law"], case["recorders"])
    terms = {
        "structures": len(ensemble.mass),
        "step": STEP / case["substeps"],
        "dtype": case["dtype"],
        "method": case["method"],
        "device": case["device"] if device is None else device,
        "threads": case["threads"] or None,
    }
    run = run_quietly(scene, **terms)
    # The samples of the peers are in the same order.
    if not np.array_equal(run["structure"], ensemble.structure):
        raise RuntimeError(
            "the samples of Stripes are not ordered by structure, then level, as those of draw_ensemble() are: adapt "
            "draw_ensemble() to the order of warpdyn"
        )
    in_kernels, whole = [], []
    while len(whole) < LEAST_RUNS or (sum(in_kernels) < IN_KERNELS_FOR and sum(whole) < TIMED_FOR):
        started = time.perf_counter()
        run = run_quietly(scene, **terms)
        whole.append(time.perf_counter() - started)
        in_kernels.append(seconds_in_kernels(run))
    return min(in_kernels), min(whole), run


@functools.cache
def reference_drifts(
    law: str, storeys: int, samples: int, steps: int, substeps: int, of: int, method: str
) -> np.ndarray:
    """Return the reference peak drifts [m] of the common samples, in float64 on the CPU, shape [sample, storey].

    Args:
        law, storeys, samples, steps, substeps: Values of the case that is compared.
        of: Number of samples that the compared program runs; the common samples are some of them.
        method: Integration method of the reference run.
    """
    ensemble = draw_ensemble(storeys, samples, steps)
    chosen = common_samples(samples, of)
    scene = build_scene(ensemble, law, "drift", chosen)
    terms = {"step": STEP / substeps, "dtype": "float64", "device": "cpu", "method": method}
    run = run_quietly(scene, structures=chosen.size, **terms)
    return run["peak_storey_drift"].values


def common_samples(samples: int, of: int) -> np.ndarray:
    """Return the indices of the samples that are compared, if `of` of the `samples` samples are run."""
    chosen = spread_out(samples, of)
    return chosen[spread_out(chosen.size, COMMON_SAMPLES)]


def reference_method(case: dict[str, Any]) -> str:
    """Return the method of a case's reference run: the method of the case if warpdyn has it, otherwise RK4."""
    return case["method"] if case["method"] in KERNEL_METHODS else "rk4"


def difference(case: dict[str, Any], drifts: np.ndarray) -> float:
    """Return the largest relative difference of the peak drifts of the common samples from those of the reference run.

    The difference of a sample is divided by its largest drift.
    """
    names = ("law", "storeys", "samples", "steps", "substeps")
    of, method = case["run_samples"], reference_method(case)
    reference = reference_drifts(*(case[name] for name in names), of=of, method=method)
    return float((np.abs(drifts - reference).max(axis=1) / reference.max(axis=1)).max())


def measured(case: dict[str, Any], seconds: float, drifts: np.ndarray, note: str = "") -> dict[str, Any]:
    """Return a measured case as a row of the dataset, with speed, difference of the drifts, and status."""
    steps, off = case["steps"] * case["substeps"], difference(case, drifts)
    return case | {
        "seconds": seconds,
        "dof_steps_per_second": case["run_samples"] * case["storeys"] * steps / seconds,
        "peak_drift_difference": off,
        "status": "measured" if off <= LARGEST_DIFFERENCE else "disagrees",
        "note": note,
    }


def compile_kernels(cases: Sequence[dict[str, Any]]) -> None:
    """Compile the kernels of all cases and of their reference runs in advance, several at the same time.

    A reference run is the accurate run (float64, on the CPU) with which the peak drifts of a case are compared.
    """
    jobs = {(c["law"], c["storeys"], c["dtype"], c["device"], c["recorders"], c["method"]) for c in cases}
    jobs |= {(c["law"], c["storeys"], "float64", "cpu", "drift", reference_method(c)) for c in cases}

    def load(job: tuple[str, int, str, str, str, str]) -> None:
        law, storeys, dtype, device, recorders, method = job
        scene = build_scene(draw_ensemble(storeys, 2, 2), law, recorders)
        with warnings.catch_warnings():
            warnings.filterwarnings("ignore", "a tail of")
            integration = Integration(method=method, dtype=dtype, step=STEP)
            run = build_run(scene, 2, integration, Execution(device=device))
        load_kernel(run.model.plan, device)

    # Kernels of the tallest buildings come first, because they may take longest.
    ordered = sorted(jobs, key=lambda job: (-job[1], job))
    with ThreadPoolExecutor(len(os.sched_getaffinity(0))) as pool:
        list(tqdm(pool.map(load, ordered), total=len(ordered), desc="compiling", unit="kernel", disable=None))


def measure_kernels(cases: Sequence[dict[str, Any]]) -> list[dict[str, Any]]:
    """Measure the run times of warpdyn's cases, and return one row per case."""
    rows = []
    for case in tqdm(cases, desc="warpdyn", unit="case", disable=None):
        seconds, whole, run = kernel_seconds(case)
        drifts = run["peak_storey_drift"].values[common_samples(case["samples"], case["run_samples"])]
        rows.append(measured(case, seconds, drifts) | {"seconds_in_simulate": whole})
    return rows
