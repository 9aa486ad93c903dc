"""Measurements of scaling with samples, CPU threads and GPUs, and of start times, for the study benchmark."""

from __future__ import annotations

import json
import os
import subprocess
import sys
import tempfile
import time
from pathlib import Path
from typing import Any

from tqdm import tqdm

from parts.benchmark.cases import scaling_case
from parts.benchmark.kernels import common_samples, kernel_seconds, measured

LONGEST = 6.0  # expected time in kernels above which no larger ensemble is run [s]
STARTS = ("empty cache", "later")  # first process, which compiles the kernels, and a second process, which loads them
STUDIES = Path(__file__).parents[2]  # folder of the studies


def scale_samples(devices: list[str], size: dict[str, Any]) -> list[dict[str, Any]]:
    """Return one row per number of samples: five storeys, Bouc-Wen, float32, all threads of the CPU or one GPU."""
    rows = []
    for device in devices:
        expected = 0.0
        for samples in tqdm(size["scaling_samples"], desc=f"samples on {device}", unit="case", disable=None):
            if expected > LONGEST:
                break
            row = _row(scaling_case(device, samples, size) | {"part": "samples", "threads": _threads(device)})
            rows.append(row)
            expected = 2 * row["seconds"]
    return rows


def scale_threads(size: dict[str, Any]) -> list[dict[str, Any]]:
    """Return one row per number of CPU threads: powers of two, and all threads."""
    cores = _threads("cpu")
    counts = sorted({*(2**k for k in range(cores.bit_length())), cores})
    case = scaling_case("cpu", size["thread_samples"], size) | {"part": "threads"}
    return [_row(case | {"threads": count}) for count in tqdm(counts, desc="threads", unit="case", disable=None)]


def scale_gpus(devices: list[str], size: dict[str, Any]) -> list[dict[str, Any]]:
    """Return one row per number of GPUs; a number that cannot be run has the status "missing"."""
    gpus = [device for device in devices if device != "cpu"]
    rows = []
    for count in range(1, len(gpus) + 1):
        case = scaling_case(gpus[0], size["scaling_samples"][-1], size) | {"part": "gpus", "gpus": count, "threads": 0}
        try:
            rows.append(_row(case, gpus[:count]) if count > 1 else _row(case))
        except Exception as error:  # such as a version of warpdyn that accepts only one device
            rows.append(case | {"status": "missing", "note": f"{type(error).__name__}: {error}"})
    return rows


def _threads(device: str) -> int:
    return len(os.sched_getaffinity(0)) if device == "cpu" else 0


def _row(case: dict[str, Any], device: list[str] | None = None) -> dict[str, Any]:
    seconds, whole, run = kernel_seconds(case, device)
    drifts = run["peak_storey_drift"].values[common_samples(case["samples"], case["run_samples"])]
    return measured(case, seconds, drifts) | {"seconds_in_simulate": whole}


def measure_starts(devices: list[str]) -> list[dict[str, Any]]:
    """Return the times [s] of a new process that runs the fragility study: imports, first and second run, per device.

    The first process starts with an empty kernel cache, the second with the kernels that the first compiled.
    """
    rows = []
    for device in {device.split(":")[0]: device for device in reversed(devices)}.values():
        with tempfile.TemporaryDirectory(prefix="kernels") as cache:
            environment = os.environ | {"WARP_CACHE_PATH": cache}
            for start in STARTS:
                command = [sys.executable, "-m", "parts.benchmark.start", device]
                begun = time.perf_counter()
                done = subprocess.run(
                    command, cwd=STUDIES, env=environment, stdout=subprocess.PIPE, text=True, check=True
                )
                seconds = time.perf_counter() - begun
                told = json.loads(done.stdout.splitlines()[-1])
                rows.append({"device": device, "start": start, "process": seconds, **told})
    return rows
