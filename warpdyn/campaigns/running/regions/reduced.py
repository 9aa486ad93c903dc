"""Runs in regions of which statistics alone are kept: on a cluster, or journaled on one machine.

Each region hands back what its samples add to the statistics, of its own cells. With a path it is kept in a small file,
written by the process that asked for the run, so that nothing is counted twice however often a run is stopped.
"""

from __future__ import annotations

import time
from collections.abc import Iterator
from contextlib import ExitStack
from pathlib import Path
from typing import Any

import numpy as np
import xarray as xr

from warpdyn.campaigns.integration.settings import Execution, Integration
from warpdyn.campaigns.integration.stability_guard import Reruns
from warpdyn.campaigns.portfolio.labels import common_attributes, largest_estimate
from warpdyn.campaigns.reductions.population import Population
from warpdyn.campaigns.reductions.reduction import Reduction
from warpdyn.campaigns.running.journal import FINGERPRINT, Journal
from warpdyn.campaigns.running.regions.drive import RegionRun, after_region, run_in_regions
from warpdyn.campaigns.running.regions.job import Where
from warpdyn.campaigns.running.regions.report import Report
from warpdyn.campaigns.running.regions.statistics import Asked
from warpdyn.campaigns.running.regions.tasks import run_region
from warpdyn.campaigns.running.regions.workers import Here, Workers
from warpdyn.campaigns.running.run_portfolio import divided, how_of, plans_of_group
from warpdyn.campaigns.running.run_scene import Kept, fingerprint_of_run
from warpdyn.engine.kernels.compilation import compile_side_by_side
from warpdyn.foundations.core.checks import whole_number
from warpdyn.foundations.files.netcdf import write_at_once
from warpdyn.foundations.files.removal import remove_tree
from warpdyn.foundations.files.unfinished import STORE_SUFFIX, Unfinished
from warpdyn.foundations.files.zarr_stores import complete
from warpdyn.model.scene.portfolio import Portfolio
from warpdyn.model.scene.scene import Scene


class ReducedRun(RegionRun):
    """A run in regions whose samples are reduced to statistics.

    A region is added when it is known how often its failed samples are run again, which depends on all regions before
    it: so each is added once, and nothing of it is held any longer.

    Args:
        arguments: As of RegionRun; with a path, reports of regions are kept there.
        reduction: The statistics, of all groups of a portfolio.
        asked: The same as they travel.
        numbers: Numbers of the structures among those of the statistics.
    """

    def __init__(self, *arguments: Any, reduction: Reduction, asked: Asked, numbers: np.ndarray) -> None:
        self.reduction, self.asked, self.numbers = reduction, asked, numbers
        self._added = 0  # regions
        self._states: list[dict[str, Any]] | None = None  # of reruns, after these
        super().__init__(*arguments)

    def calls(self) -> Iterator[tuple[Any, ...]]:
        """Yield the calls of the regions that are not done, with the run and the region's number as key."""
        for key, *call in super().calls():
            yield key, *call, *self._reduced_to(key[1])

    def take(self, place: int, report: Report) -> None:
        """Take what a region tells, and keep it if the run has a path."""
        if self.unfinished is not None:
            with self.unfinished.named_errors():
                report.save(self._report_of(self.regions[place]))
        super().take(place, report)
        self._add()

    def _go_on(self, journal: Journal, size: int) -> None:
        """Take what an earlier run has done."""
        journal.settle(structures_per_region=size, **self.chosen)
        self._take_finished(self._report_of)
        self._add()

    def _report_of(self, structures: range) -> Path:
        assert self.unfinished is not None
        return self.unfinished.kept / f"{structures.start}-{structures.stop}.npz"

    def _reduced_to(self, place: int) -> tuple[Asked, np.ndarray]:
        """Return the arguments of a region that say what it is reduced to."""
        return self.asked, self.numbers[self.regions[place].start : self.regions[place].stop]

    def _add(self) -> None:
        """Add the regions of which all before them are added, up to one that has to be run again."""
        while (report := self.reports.get(self._added)) is not None:
            states = [Reruns().state for _ in report.decisions] if self._states is None else self._states
            after = after_region(states, report)
            if after is None:
                return
            self.reduction.include(report.statistics)
            report.statistics = {}
            self._states, self._added = after, self._added + 1

    def _settle_reruns(self) -> None:
        """Run those regions again of which samples before them decide otherwise which failed samples are run again."""
        while self._added < len(self.regions):
            place, structures = self._added, self.regions[self._added]
            call = run_region, self.job, structures, self._states, *self._reduced_to(place)
            self.take(place, self.workers.ask(*call))
            if self._added == place:
                raise RuntimeError(f"structures {structures.start} to {structures.stop - 1} failed in another way")


def simulate_statistics(
    scene: Scene,
    structures: int,
    integration: Integration,
    kept: Kept,
    seed: int,
    where: Where,
    execution: Execution,
    workers: Workers,
    unfinished: Unfinished | None,
) -> xr.Dataset:
    """Return the statistics of a run in regions, and write them if it has a path.

    Args:
        scene, structures, integration, kept, seed: As of `SceneRun`.
        where, execution: As of `simulate_in_regions`.
        workers: The processes that run regions.
        unfinished: Where the file or the Zarr store is written; None to return the statistics alone.
    """
    started, seed = time.perf_counter(), whole_number("seed", seed, 0)
    many = scene.structure.buildings if isinstance(scene.structure, Portfolio) else None
    count = whole_number("structures", structures, 1) if many is None else many
    digest = fingerprint_of_run(scene, structures, integration, workers.machines, kept, seed)
    with Reduction(kept.statistics, Population(scene, count), execution.cores) as reduction, ExitStack() as places:
        of_all: dict[str, Any] = {
            "reduction": reduction,
            "asked": Asked(kept.statistics, scene, count, f"statistics of {digest}"),
        }
        how = kept, seed, workers, where
        if many is None:
            run = ReducedRun(scene, count, integration, *how, unfinished, numbers=np.arange(count), **of_all)
            run_in_regions([run], workers)
            rest = run.rest()
        else:
            _, groups = divided(scene, structures, integration, execution, kept, seed)
            if unfinished is not None:
                Journal(unfinished, digest, kept.overwrite)
            if isinstance(workers, Here):
                plans = (plan for group in groups for plan in plans_of_group(group, integration, execution, kept, seed))
                compile_side_by_side(plans, execution.devices[0], execution.cores)
            runs = []
            for number, group in enumerate(groups):
                place = None if unfinished is None else places.enter_context(_place_of(unfinished, number))
                arguments = group.scene, group.buildings.size, how_of(group, integration), *how, place
                with group.named_in_messages():
                    runs.append(ReducedRun(*arguments, numbers=group.buildings, **of_all))
            seconds = time.perf_counter() - started
            run_in_regions(runs, workers)
            rests = []
            for group, run in zip(groups, runs, strict=True):
                with group.named_in_messages():
                    rests.append(run.rest())
            attributes = {"scene": scene.to_json(), "title": scene.title, "seed": seed, FINGERPRINT: digest}
            rest = largest_estimate(rests).assign_attrs(attributes | common_attributes(rests, seconds))
        result = reduction.dataset(rest)
        if unfinished is not None:
            _write(result, unfinished)
    return result


def _place_of(unfinished: Unfinished, number: int) -> Unfinished:
    """Return where the regions of a group of a portfolio are kept."""
    return Unfinished(unfinished.kept / f"{number}{STORE_SUFFIX}", STORE_SUFFIX)


def _write(result: xr.Dataset, unfinished: Unfinished) -> None:
    """Write statistics to their netCDF file or Zarr store."""
    if unfinished.path.suffix != STORE_SUFFIX:
        write_at_once(result, unfinished)
        return
    store = unfinished.kept / f"statistics{STORE_SUFFIX}"
    with unfinished.named_errors():
        if store.is_dir():  # of a process that was killed before it was complete
            remove_tree(store)
        complete(store, result)
        unfinished.move_in_store(store)
