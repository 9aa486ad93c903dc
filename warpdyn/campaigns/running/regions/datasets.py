"""Datasets of runs that are divided into regions: of one structure, and of the groups of a portfolio."""

from __future__ import annotations

import os
import time
from contextlib import ExitStack, nullcontext
from pathlib import Path
from typing import TYPE_CHECKING

import xarray as xr

from warpdyn.campaigns.integration.settings import Execution, Integration
from warpdyn.campaigns.portfolio.labels import Joined
from warpdyn.campaigns.running.journal import FINGERPRINT, Journal, is_finished
from warpdyn.campaigns.running.regions.drive import RegionRun, run_in_regions
from warpdyn.campaigns.running.regions.job import Where
from warpdyn.campaigns.running.regions.reduced import simulate_statistics
from warpdyn.campaigns.running.regions.workers import Here, Workers, workers_of
from warpdyn.campaigns.running.run_portfolio import divided, how_of
from warpdyn.campaigns.running.run_scene import Kept, fingerprint_of_run
from warpdyn.foundations.core.checks import whole_number
from warpdyn.foundations.core.messages import tell
from warpdyn.foundations.files.unfinished import STORE_SUFFIX, SUFFIX, Unfinished
from warpdyn.foundations.files.zarr_stores import check_zarr
from warpdyn.model.scene.scene import Scene

if TYPE_CHECKING:
    from distributed import Client


def simulate_in_regions(
    scene: Scene,
    structures: int,
    integration: Integration,
    kept: Kept,
    seed: int,
    where: Where,
    execution: Execution,
    cluster: Client | None,
    path: str | os.PathLike | None,
) -> xr.Dataset:
    """Return what `simulate` returns of a run on a cluster, of one whose samples go to a Zarr store, or of statistics.

    Args:
        scene, structures, integration, kept, seed: As of `SceneRun`.
        where: Devices, threads and memory of each process that runs regions.
        execution: Devices and threads of this process; of its CPU, where there is a cluster.
        cluster, path: As of `simulate`.
    """
    is_store = isinstance(path, str | os.PathLike) and os.fspath(path).endswith(STORE_SUFFIX)
    if is_store:
        check_zarr()
    with nullcontext() if path is None else Unfinished(path, STORE_SUFFIX if is_store else SUFFIX) as unfinished:
        workers: Workers = Here(execution) if cluster is None else workers_of(cluster, where.device, where.threads)
        if kept.statistics:
            run_of = scene, structures, integration, kept, seed
            return simulate_statistics(*run_of, where, execution, workers, unfinished)
        if scene.structure.is_many:
            return _portfolio(scene, structures, integration, kept, seed, workers, where, execution, unfinished)
        run = RegionRun(scene, structures, integration, kept, seed, workers, where, unfinished)
        run_in_regions([run], workers)
        return run.result()


def _portfolio(
    scene: Scene,
    structures: int,
    integration: Integration,
    kept: Kept,
    seed: int,
    workers: Workers,
    where: Where,
    execution: Execution,
    unfinished: Unfinished | None,
) -> xr.Dataset:
    """Return what `run_portfolio` returns; regions of all groups run side by side."""
    started = time.perf_counter()
    seed = whole_number("seed", seed, 0)
    portfolio, groups = divided(scene, structures, integration, execution, kept, seed)
    digest = fingerprint_of_run(scene, structures, integration, workers.machines, kept, seed)
    attributes = {"scene": scene.to_json(), "title": scene.title, "seed": seed, FINGERPRINT: digest}
    if unfinished is not None:
        Journal(unfinished, digest, kept.overwrite)
    results: dict[int, xr.Dataset] = {}
    runs: dict[int, RegionRun] = {}
    with ExitStack() as places:
        for number, group in enumerate(groups):
            arguments = group.scene, group.buildings.size, how_of(group, integration)
            digest_of_group = fingerprint_of_run(*arguments, workers.machines, kept, seed)
            found = _finished(unfinished, number, digest_of_group)
            if found is not None:
                results[number] = found
                continue
            place = None
            if unfinished is not None:
                store = Unfinished(_store_of(unfinished, number), STORE_SUFFIX, is_group=True)
                place = places.enter_context(store)
            with group.named_in_messages():
                runs[number] = RegionRun(*arguments, kept, seed, workers, where, place)
        seconds = time.perf_counter() - started
        run_in_regions(list(runs.values()), workers)
        for number, run in runs.items():
            with groups[number].named_in_messages():
                results[number] = run.result()
    of_groups = [results[number] for number in range(len(groups))]
    buildings = [group.buildings for group in groups]
    joined = Joined(portfolio, buildings, of_groups, scene.excitation.samples_per_structure, attributes, seconds)
    return joined.in_memory() if unfinished is None else joined.in_store(unfinished)


def _store_of(unfinished: Unfinished, number: int) -> Path:
    return unfinished.kept / f"{number}{STORE_SUFFIX}"


def _finished(unfinished: Unfinished | None, number: int, digest: str) -> xr.Dataset | None:
    """Return the dataset of a group that an earlier run has finished, and say so; None if there is none."""
    path = None if unfinished is None else _store_of(unfinished, number)
    if unfinished is None or path is None or not is_finished(path, digest):
        return None
    tell(f"{unfinished.path}: group {number + 1} has been finished by an earlier run")
    return xr.open_zarr(path)
