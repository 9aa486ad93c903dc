"""A program that writes, runs or compiles, to be interrupted: `python interrupted.py <what> <path> <structures>`.

It prints "begun" when what is to be interrupted begins, and "done" at its end.
"""

from __future__ import annotations

import gc
import os
import sys
from dataclasses import replace
from pathlib import Path
from typing import Any

import numpy as np
import xarray as xr

import warpdyn as wd

MOTIONS = [wd.GroundMotion(np.sin(np.arange(1000.0) * pace), 0.01, name=str(pace)) for pace in (0.2, 0.05)]
MEMORY = 67_500_000  # bytes, so that there are several blocks
SCATTER = {"mass": wd.RandomFactor(wd.Lognormal(1, 0.2))}
IN_REGIONS = ("zarr", "statistics", "cluster", "city")  # which are small here, so that there are several


def dataset(samples: int) -> xr.Dataset:
    """Return a dataset that is written in parts if it has more samples than a chunk."""
    random = np.random.default_rng(0)
    variables = {f"demand_{i}": (("sample", "storey"), random.random((samples, 3))) for i in range(6)}
    return xr.Dataset(variables, {"sample": np.arange(samples)}, {"title": "to be interrupted"})


def scene(is_many: bool, structures: int) -> wd.Scene:
    """Return a scene of one building under stripes, or of buildings of two heights."""

    def building(storeys: int) -> wd.ShearBuilding:
        return wd.ShearBuilding([2e5] * storeys, 1e8, 3.0, law="bouc_wen", yield_force=4e5, hardening_ratio=0.1)

    design = wd.Stripes(MOTIONS, [0.1, 0.3], wd.PeakGroundAcceleration())
    recorded = {"recorders": ("drift", "acceleration"), "tail": 0.5}
    if not is_many:
        return wd.Scene(building(3), design, SCATTER, **recorded)
    city = {str(n): wd.Archetype(building(n), count=structures, scatter=SCATTER) for n in (1, 3)}
    return wd.Scene(wd.Portfolio(city), design, **recorded)


def compile_kernels(kernels: int) -> None:
    """Compile kernels that differ in their recorders, in processes side by side."""
    from warpdyn.campaigns.integration.model import dynamics_of, plan_of
    from warpdyn.engine.kernels import compilation

    compilation.MOST_KERNELS_OF_THREADS = 0
    bare = replace(scene(False, 1), recorders=("drift",))
    plan = replace(plan_of(bare, dynamics_of(bare), "heun", "float32", is_gpu=False), lanes=1, max_unroll=1)
    plans = [replace(plan, dofs=dofs) for dofs in range(1, kernels + 1)]
    print("begun", flush=True)
    compilation.compile_side_by_side(plans, "cpu", threads=2)
    assert all(compilation.is_compiled(plan, "cpu") for plan in plans)


def run(what: str, path: str, structures: int) -> None:
    """Do what is to be interrupted."""
    if what in ("write", "table"):
        held = dataset(4000 * structures)
        print("begun", flush=True)
        if what == "write":
            wd.write(held, path)
        else:
            wd.write_table(held, path, rows=("sample", "storey"))
        return
    if what == "compile":
        compile_kernels(structures)
        return
    is_many = what in ("portfolio", "city")
    given, more = scene(is_many, structures), {} if is_many else {"structures": structures}
    settings: dict[str, Any] = {"seed": 7, "path": path, "device": "cpu", **more}
    if what in IN_REGIONS:
        from warpdyn.campaigns.integration import stability_guard
        from warpdyn.campaigns.running.regions import job

        stability_guard.SAMPLES_OF_A_RANGE = 1
        job.LEAST_CPU_REGION, job.CPU_BLOCK = 1, max(4, structures // 2)
    else:
        settings["memory"] = MEMORY
    if what == "statistics":
        settings["statistics"] = [wd.DemandMoments("peak_storey_drift_ratio"), wd.LargestDemand("peak_storey_drift")]
    if what != "cluster":
        print("begun", flush=True)
        wd.simulate(given, **settings).close()
        return
    from distributed import Client, LocalCluster

    print("begun", flush=True)
    with LocalCluster(2, threads_per_worker=1, dashboard_address=None) as cluster, Client(cluster) as client:
        wd.simulate(given, cluster=client, **settings | {"device": None}).close()


def serve() -> None:
    """Run what each line of the input names, in a forked process and session of its own: nothing is imported again.

    A line is what is run, the path and the number of structures, divided by tabs. The answers are the number of the
    process, when it has begun, and its exit status. What it prints is in the files `out` and `err` beside the path.
    """
    import warp  # noqa: F401  (before processes are forked, which takes most of their time)
    import zarr  # noqa: F401

    import warpdyn.campaigns.running.simulate  # noqa: F401

    dataset(1)  # imports what xarray asks for
    gc.freeze()  # a forked process that collects garbage at its end copies the memory of the server
    for line in sys.stdin:
        what, path, structures = line.rstrip("\n").split("\t")
        child = os.fork()
        if not child:
            os.setsid()
            for name, number in (("out", 1), ("err", 2)):
                os.dup2(os.open(Path(path).with_name(name), os.O_WRONLY | os.O_CREAT | os.O_TRUNC, 0o644), number)
            if what == "compile":
                os.environ["WARP_CACHE_PATH"] = path
            run(what, path, int(structures))
            print("done", flush=True)
            return  # from the child, as a program ends
        print(child, flush=True)
        print(os.waitstatus_to_exitcode(os.waitpid(child, 0)[1]), flush=True)


if __name__ == "__main__":
    if sys.argv[1] == "serve":
        serve()
    else:
        run(sys.argv[1], sys.argv[2], int(sys.argv[3]))
        print("done", flush=True)
