"""Speed of warpdyn on this machine, compared with hand-written code and installed programs.

    python studies/benchmark.py --out results [--device cpu] [--quick] [--method stoermer]

The study measures: the kernels (laws x storeys x number types x recorders x devices); other programs ("peers") with the
same task, whose peak drifts must agree with those of warpdyn; the main job (the fragility study of
studies/p695_fragility.py), from its scene to a file, split into its parts; the scaling over samples, CPU threads and
GPUs; and the first compilation. It writes benchmark.nc and three figures. The code of the peers is in studies/peers;
peers that are not installed are listed. If --method is given, the study measures only the kernels of this method and
the peers compared with them, and writes benchmark_METHOD.nc.
"""

from __future__ import annotations

import argparse
import datetime
import time
from collections.abc import Callable
from pathlib import Path
from typing import Any

import numpy as np
import xarray as xr
from p695_fragility import build_scene
from parts.benchmark import cases
from parts.benchmark.figure import draw
from parts.benchmark.job import PARTS, measure_job
from parts.benchmark.kernels import compile_kernels, measure_kernels
from parts.benchmark.machine import available_devices, gpus, processor, versions
from parts.benchmark.peers import measure_peers
from parts.benchmark.report import print_kernels, print_report
from parts.benchmark.scaling import measure_starts, scale_gpus, scale_samples, scale_threads
from parts.command_line import file_in, save_figures

from warpdyn.foundations.files import netcdf

# Columns of the table of measurements. Each has a long name, a unit, and the value of rows without this quantity.
COLUMNS: dict[str, tuple[str, str, Any]] = {
    "part": ("part of the benchmark: kernels, every law, or scaling over samples, threads or gpus", "1", ""),
    "peer": ("who integrates", "1", ""),
    "device": ("device", "1", ""),
    "threads": ("CPU threads, 0 on a GPU", "1", 0),
    "gpus": ("GPUs", "1", 0),
    "law": ("storey law", "1", ""),
    "storeys": ("storeys", "1", 0),
    "dtype": ("number type", "1", ""),
    "method": ("time integration method, of warpdyn, and of the peer for every law", "1", ""),
    "recorders": ("what is recorded: peak drifts, or all that is by default", "1", ""),
    "steps": ("steps of the base motion", "1", 0),
    "substeps": ("integration steps in each of them", "1", 1),
    "run_samples": ("samples integrated", "1", 0),
    "seconds": ("time of the integration alone, least of several runs", "s", np.nan),
    "seconds_in_simulate": ("time of the whole of simulate, least of several runs", "s", np.nan),
    "dof_steps_per_second": ("samples x storeys x integration steps, over the time of the integration", "s-1", np.nan),
    "peak_drift_difference": (
        "largest difference of a sample's peak drifts from warpdyn's in float64 on the CPU, over the largest of them",
        "1",
        np.nan,
    ),
    "status": ("measured, disagrees (by more than 1 %), missing or failed", "1", ""),
    "note": ("why it is missing, or what else is known of it", "1", ""),
}


def label_rows(rows: list[dict[str, Any]]) -> xr.Dataset:
    """Return the rows of the measurements as a dataset: one variable per column, with the dimension `measurement`."""
    return xr.Dataset(
        {
            name: (
                "measurement",
                np.array([row.get(name, blank) for row in rows], dtype=str if blank == "" else None),
                {"long_name": text, "units": units},
            )
            for name, (text, units, blank) in COLUMNS.items()
        }
    )


def label_jobs(jobs: list[dict[str, Any]]) -> xr.Dataset:
    """Return the times [s] of the main job (fragility study) and its parts, with dimensions `job` and `job_part`."""
    parts = np.array([[job["parts"][part] for part in PARTS] for job in jobs])
    whole, histories = ([job[name] for job in jobs] for name in ("simulate", "histories"))
    ratios = {name: [job[name] for job in jobs] for name in ("to_dataset", "to_netcdf")}
    one = {"units": "1"}
    return xr.Dataset(
        {
            "seconds_of_part": (
                ("job", "job_part"),
                parts,
                {"long_name": "time of a part of the main job", "units": "s"},
            ),
            "seconds_of_simulate": ("job", whole, {"long_name": "time of simulate in the main job", "units": "s"}),
            "ratio_to_dataset": ("job", ratios["to_dataset"], one | {"long_name": "time of simulate over kernel time"}),
            "ratio_to_netcdf": (
                "job",
                ratios["to_netcdf"],
                one | {"long_name": "time of simulate and of writing over kernel time"},
            ),
        },
        coords={
            "job_part": ("job_part", list(PARTS), one | {"long_name": "part of the main job"}),
            "job_device": ("job", [job["device"] for job in jobs], one | {"long_name": "device of the main job"}),
            "job_histories": ("job", histories, one | {"long_name": "histories of the main job"}),
        },
    )


def label_starts(starts: list[dict[str, Any]]) -> xr.Dataset:
    """Return the times [s] of new processes (import, first and second run), with the dimension `start`."""
    texts = {
        "process": "time of a process that runs one structure of the main job twice",
        "importing": "time of importing warpdyn in it",
        "first_run": "time of its first run, which compiles or loads its kernel",
        "second_run": "time of its second run",
    }
    columns = {
        f"start_{name}": ("start", [row[name] for row in starts], {"long_name": text, "units": "s"})
        for name, text in texts.items()
    }
    one = {"units": "1"}
    coordinates = {
        "start_device": ("start", [row["device"] for row in starts], one | {"long_name": "device of a start"}),
        "start_cache": ("start", [row["start"] for row in starts], one | {"long_name": "kernel cache of a start"}),
    }
    return xr.Dataset(columns, coords=coordinates)


def measure_method(devices: list[str], size: dict[str, Any], method: str) -> xr.Dataset:
    """Return a dataset of the run times of one method in warpdyn's kernels and in the compared programs (peers)."""
    first = first_of_each_kind(devices)
    kernels = [case for case in cases.kernel_cases(first, size) if case["method"] == method]
    peers = [case for case in cases.peer_cases(first, size) if (case["method"] or "rk4") == method]
    compile_kernels(kernels)
    rows = measure_kernels(kernels) + measure_peers(peers, size["peer_seconds"])
    return label_rows(rows).assign_attrs(describe(devices))


def first_of_each_kind(devices: list[str]) -> list[str]:
    """Return the CPU and the first GPU, if they are among the devices; otherwise the first device."""
    return [device for device in devices if device in ("cpu", "cuda:0")] or devices[:1]


def describe(devices: list[str]) -> dict[str, Any]:
    """Return the attributes of a dataset of measurements: title, versions of the programs, processor and GPU."""
    return {
        "Conventions": "CF-1.11",
        "title": "Speed of warpdyn and of its peers on one machine",
        "history": f"{datetime.datetime.now(datetime.UTC):%Y-%m-%dT%H:%M:%SZ} studies/benchmark.py",
        "source": versions(),
        "processor": processor(),
        "gpu": gpus(devices),
    }


def build_dataset(devices: list[str], size: dict[str, Any]) -> xr.Dataset:
    """Run all measurements on the devices, and return them as one dataset with the time of each group [s]."""
    seconds: dict[str, float] = {}

    def timed(name: str, measure: Callable[[], Any]) -> Any:
        started = time.perf_counter()
        found = measure()
        seconds[f"seconds_{name}"] = time.perf_counter() - started
        return found

    first = first_of_each_kind(devices)
    kernels, peers = cases.kernel_cases(first, size), cases.peer_cases(first, size)
    for case in (case for device in first for case in cases.law_cases(device, size)):
        (kernels if case["peer"] == "warpdyn" else peers).append(case)
    scaled = [cases.scaling_case(device, 256, size) for device in devices]
    timed("compiling", lambda: compile_kernels([*kernels, *scaled]))
    rows = timed("kernels", lambda: measure_kernels(kernels))
    rows += timed("peers", lambda: measure_peers(peers, size["peer_seconds"]))
    rows += timed("samples", lambda: scale_samples(first, size))
    rows += timed("threads", lambda: scale_threads(size) if "cpu" in devices else [])
    rows += timed("gpus", lambda: scale_gpus(devices, size))
    histories = [(device, count) for device in first for count in size["histories"][device.split(":")[0]]]
    jobs = timed("jobs", lambda: [measure_job(*job) for job in histories])
    starts = timed("starts", lambda: measure_starts(first))
    dataset = xr.merge([label_rows(rows), label_jobs(jobs), label_starts(starts)])
    return dataset.assign_attrs(describe(devices) | seconds)


def main() -> None:
    """Run the study from the command line."""
    parser = argparse.ArgumentParser(description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter)
    parser.add_argument("--out", type=Path, default=Path("results"), help="folder for the results [%(default)s]")
    parser.add_argument("--device", nargs="+", help="devices, such as cpu or cuda:0 [the CPU and all GPUs]")
    parser.add_argument("--quick", action="store_true", help="a few small cases: to see that all of it runs")
    parser.add_argument("--method", choices=cases.KERNEL_METHODS, help="measure only kernels by this method")
    arguments = parser.parse_args()
    available = available_devices()
    devices = arguments.device or available
    for device in devices:
        if device not in available:
            parser.error(f"no device {device!r} here; available: {', '.join(available)}")
    size = cases.QUICK if arguments.quick else cases.FULL
    if arguments.method:
        target = file_in(arguments.out, f"benchmark_{arguments.method}.nc")
        result = measure_method(devices, size, arguments.method)
        netcdf.write(result, target)
        print_kernels(result)
        print(f"wrote {target}")
        return
    target = file_in(arguments.out, "benchmark.nc")
    build_scene()  # reports missing records now, not after minutes of measurements
    result = build_dataset(devices, size)
    netcdf.write(result, target)
    figures = draw(result)
    save_figures(figures, arguments.out)
    print_report(result)
    print(f"wrote {target}, {', '.join(f'{name}.png' for name in figures)}")


if __name__ == "__main__":
    main()
