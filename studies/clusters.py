"""The five-storey fragility study on a cluster of local processes, compared with one process.

    python studies/clusters.py --out results [--structures 64] [--device cpu]

The study compares speed, bytes on disk and results, which must be identical. It runs the five-storey building of
studies/p695_fragility.py into a Zarr store: in this process on one thread, and on clusters of one and of two workers
with one thread each. After a first run that compiles the kernels, each is timed three times, alternately. The shortest
time counts, because other load on the machine only adds to it. If the other load is constant, compare the processor
times of all workers: without loss, two workers together need as much processor time as one. The study needs pip install
"warpdyn[cluster,records]".
"""

from __future__ import annotations

import shutil
import time
from collections.abc import Callable
from pathlib import Path

import numpy as np
import xarray as xr
from distributed import Client, LocalCluster
from p695_fragility import build_scene
from parts.command_line import read_arguments

import warpdyn as wd

TIMES, WORKERS = 3, (0, 1, 2)  # number of timed runs; numbers of workers, where 0 means this process


def bytes_of(folder: Path) -> int:
    """Return the size of all files in a folder on disk [bytes]."""
    return sum(path.stat().st_size for path in folder.rglob("*") if path.is_file())


def main() -> None:
    """Run the study from the command line."""
    arguments = read_arguments(__doc__, 64, meaning="structures under each record at each level", counted="structures")
    arguments.out.mkdir(parents=True, exist_ok=True)
    path, scene = arguments.out / "cluster.zarr", build_scene()
    settings = {"structures": arguments.structures, "seed": arguments.seed, "overwrite": True, "threads": 1}
    found: dict[int, list[tuple[float, float]]] = {count: [] for count in WORKERS}
    whole: xr.Dataset | None = None
    for number in range(1 + TIMES):
        for count in WORKERS:
            if not count:
                run, *taken = timed(scene, path, settings | {"device": arguments.device}, time.process_time)
            else:
                with (
                    LocalCluster(n_workers=count, threads_per_worker=1, dashboard_address=None) as cluster,
                    Client(cluster) as client,
                ):
                    client.wait_for_workers(count)
                    # In their first run, the worker processes import warpdyn and load their kernels; this run is not
                    # timed.
                    how = settings | {"device": arguments.device, "cluster": client}
                    timed(scene, path, how | {"structures": 8}, time.process_time)
                    run, *taken = timed(scene, path, how, lambda: sum(client.run(time.process_time).values()))
            if number:
                found[count].append(tuple(taken))
            whole = run if whole is None else whole
            for name in whole.data_vars:
                if not np.array_equal(whole[name].values, run[name].values, equal_nan=whole[name].dtype.kind == "f"):
                    raise SystemExit(
                        f"{name} of a run with {count} workers differs from the run in this process: results must not "
                        "depend on workers. Please report this with your versions of warpdyn and dask"
                    )
    assert whole is not None
    samples, size = whole.sizes["sample"], bytes_of(path)
    print(f"{samples:,} histories, {size / samples:.0f} bytes each on disk; the same bits in all runs")
    for count, taken_by in found.items():
        least, processor = (min(each) for each in zip(*taken_by, strict=True))
        name = f"{count} workers" if count else "this process"
        print(
            f"{name:<13} {least:6.2f} s, {samples / least:8,.0f} histories/s; {processor:6.2f} s of processors, "
            f"{samples / processor:8,.0f} histories/s of each"
        )


def timed(scene: wd.Scene, path: Path, how: dict, processor: Callable[[], float]) -> tuple[xr.Dataset, float, float]:
    """Run a scene into a store; return the run in memory, the elapsed time [s] and the processor time [s]."""
    shutil.rmtree(path, ignore_errors=True)
    began, processor_began = time.perf_counter(), processor()
    run = wd.simulate(scene, path=path, **how)
    taken = time.perf_counter() - began, processor() - processor_began
    return run.load(), *taken


if __name__ == "__main__":
    main()
