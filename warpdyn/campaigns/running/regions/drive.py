"""A run of a scene of one structure, region by region: what workers are asked, and what becomes of the answers."""

from __future__ import annotations

import time
from collections.abc import Callable, Iterable, Iterator, Sequence
from dataclasses import replace
from pathlib import Path
from typing import Any

import numpy as np
import xarray as xr

from warpdyn.campaigns.accuracy.error_estimate import ErrorEstimate
from warpdyn.campaigns.integration.dynamics import Arrays
from warpdyn.campaigns.integration.settings import Integration
from warpdyn.campaigns.integration.stability_guard import Reruns, StabilityFindings
from warpdyn.campaigns.integration.time_grid import warn_of_short_tail
from warpdyn.campaigns.running.blocks import check_room
from warpdyn.campaigns.running.journal import FINGERPRINT, Journal
from warpdyn.campaigns.running.regions.job import Job, Layout, Where, lay_out_run, versions
from warpdyn.campaigns.running.regions.report import Report, include
from warpdyn.campaigns.running.regions.rerun_budget import stand
from warpdyn.campaigns.running.regions.tasks import choose, find_limits, integrate_histories, run_region
from warpdyn.campaigns.running.regions.workers import Workers
from warpdyn.campaigns.running.run_scene import Kept, fingerprint_of_run
from warpdyn.foundations.core.checks import whole_number
from warpdyn.foundations.core.description import fingerprint
from warpdyn.foundations.core.messages import tell, warn_caller
from warpdyn.foundations.core.progress import counted_histories
from warpdyn.foundations.files.unfinished import Unfinished
from warpdyn.foundations.files.zarr_stores import complete, damaged_regions, is_laid_out, lay_out
from warpdyn.model.scene.scene import Scene

CHOSEN = ("method", "dtype", "longest_step")  # what a pilot chooses for a target error


class RegionRun:
    """A run that is divided into regions.

    Args:
        scene, structures, integration, kept, seed: As of `SceneRun`.
        workers: The workers.
        where: Devices, threads and memory of each of them.
        unfinished: Where the Zarr store is written that the samples go to; None to return them in memory.
    """

    def __init__(
        self,
        scene: Scene,
        structures: int,
        integration: Integration,
        kept: Kept,
        seed: int,
        workers: Workers,
        where: Where,
        unfinished: Unfinished | None,
    ) -> None:
        self._started = time.perf_counter()
        structures, seed = whole_number("structures", structures, 1), whole_number("seed", seed, 0)
        self.digest = fingerprint_of_run(scene, structures, integration, workers.machines, kept, seed)
        self.workers, self.unfinished = workers, unfinished
        job = Job(
            scene=scene,
            structures=structures,
            integration=integration,
            kept=replace(kept, statistics=()),  # which travel once for all groups of a portfolio
            seed=seed,
            where=where,
            versions=versions(),
            is_reduced=bool(kept.statistics),
        )
        layout = self._laid_out(job)  # what cannot run leaves what stands there
        journal = None if unfinished is None else Journal(unfinished, self.digest, kept.overwrite)
        settled: dict[str, Any] = {} if journal is None else journal.settled
        if integration.target_error is not None:
            chosen: dict[str, Any] = {name: settled[name] for name in CHOSEN if name in settled}
            chosen = chosen or workers.ask(choose, _keyed(job))
            job = replace(job, integration=replace(integration, **chosen))
            layout = self._laid_out(job)
        for text in layout.messages:
            warn_caller(text)
        if unfinished is not None and not job.is_reduced:
            job = replace(job, store=unfinished.kept / f"{self.digest[:16]}.zarr")
        self.job, self.layout = _keyed(job), layout
        size = int(settled.get("structures_per_region", layout.structures_per_region))
        self.regions = [range(first, min(first + size, structures)) for first in range(0, structures, size)]
        self.reports: dict[int, Report] = {}
        self.rows: Arrays = {}
        if journal is not None:
            self._go_on(journal, size)
        elif not self.job.is_reduced:
            check_room(self.samples, layout.bytes_per_sample, "run.zarr")
            along = {str(name): v for name, v in layout.template.variables.items() if "sample" in v.dims}
            self.rows = {name: np.empty((self.samples, *v.shape[1:]), v.dtype) for name, v in along.items()}

    @property
    def samples(self) -> int:
        """Number of samples."""
        return self.layout.samples_by_event[-1]

    @property
    def histories(self) -> int:
        """Number of histories, over all events."""
        return sum(self.layout.samples_by_event)

    @property
    def chosen(self) -> dict[str, Any]:
        """What a pilot has chosen, whose timings may choose otherwise next time."""
        how = self.job.integration
        return {} if how.target_error is None else {name: getattr(how, name) for name in CHOSEN}

    def calls(self) -> Iterator[tuple[Any, ...]]:
        """Yield the calls of the regions that are not done, with the run and the region's number as key."""
        for place, structures in enumerate(self.regions):
            if place not in self.reports:
                yield (self, place), run_region, self.job, structures, None

    def take(self, place: int, report: Report) -> None:
        """Take what a region tells, and its samples where they are handed back."""
        rows, report.rows = report.rows, {}
        if rows:
            first = report.structures[0] * (self.samples // self.job.structures)
            for name, values in rows.items():
                self.rows[name][first : first + len(values)] = values
        self.reports[place] = report

    def check_limits(self) -> None:
        """With on_unstable="raise", raise an error if a step of any sample is beyond its limit."""
        if self.job.integration.on_unstable == "raise":
            calls = ((place, find_limits, self.job, region) for place, region in enumerate(self.regions))
            found = dict(self.workers.each(calls))
            for event, findings in enumerate(self._findings()):
                include(findings, [found[place][event] for place in range(len(self.regions))])
                findings.refuse(any_step=True)

    def result(self) -> xr.Dataset:
        """Return the dataset, after all regions are done."""
        rest = self.rest()
        if self.unfinished is None or self.job.store is None:
            return self._in_memory(rest)
        with self.unfinished.named_errors():
            complete(self.job.store, rest)
            self.unfinished.move_in_store(self.job.store)
        return xr.open_zarr(self.unfinished.path)

    def rest(self) -> xr.Dataset:
        """Return the variables and attributes that are known when all regions are done, without the samples."""
        self._settle_reruns()
        reports = [self.reports[place] for place in range(len(self.regions))]
        for text in dict.fromkeys(text for report in reports for text in report.messages):
            warn_caller(text)
        for event, findings in enumerate(self._findings()):
            include(findings, [report.findings[event] for report in reports])
            findings.warn(self.job.integration.on_unstable)
        warn_of_short_tail(self.job.scene, max(report.longest_period for report in reports))
        rest = xr.Dataset()
        if self.job.kept.histories is not None:
            rest = self.workers.ask(integrate_histories, self.job, [report.outcomes for report in reports])
        if self.job.kept.checked_share is not None:
            rest = rest.merge(self._estimates(reports, self.job.kept.checked_share))
        seconds = {name: sum(report.seconds[name] for report in reports) for name in reports[0].seconds}
        attributes = self.layout.template.attrs | self.layout.attributes | {FINGERPRINT: self.digest}
        rest.attrs = attributes | {f"seconds_{name}": value for name, value in seconds.items()}
        return rest

    def _laid_out(self, job: Job) -> Layout:
        return self.workers.ask(lay_out_run, _keyed(job), *self.workers.layout)

    def _go_on(self, journal: Journal, size: int) -> None:
        """Lay out the store, or take what an earlier run has done of it."""
        assert self.unfinished is not None
        assert self.job.store is not None
        laid_out = is_laid_out(self.job.store, journal.settled.get("store"))
        if not laid_out:
            region = size * (self.samples // self.job.structures)
            with self.unfinished.named_errors():
                files = lay_out(self.job.store, self.layout.template, self.samples, region)
            journal.settle(structures_per_region=size, store=files, **self.chosen)
        self.workers.check_store(self.job)
        if laid_out:
            self._take_finished(self.job.report_of)

    def _take_finished(self, path_of: Callable[[range], Path]) -> None:
        """Take the reports of the regions that an earlier run has done, from their files, and say how many."""
        assert self.unfinished is not None
        for place, structures in enumerate(self.regions):
            report = Report.load(path_of(structures))
            if report is not None and report.structures == (structures.start, structures.stop):
                self.reports[place] = report
        if self.job.store is not None:  # whose chunks may have been damaged since they were written
            places = list(self.reports)
            for damaged in damaged_regions(self.job.store, [self.reports[place].chunks for place in places]):
                del self.reports[places[damaged]]
        done = sum(len(self.regions[place]) for place in self.reports)
        if done:
            tell(
                f"{self.unfinished.path}: goes on from the {done} of {self.job.structures} structures that an earlier "
                "run has finished"
            )

    def _settle_reruns(self) -> None:
        """Run those regions again of which samples before them decide otherwise which failed samples are run again."""
        states = [Reruns().state for _ in self.reports[0].decisions]
        for place, structures in enumerate(self.regions):
            after = after_region(states, self.reports[place])
            if after is None:
                self.take(place, self.workers.ask(run_region, self.job, structures, states))
                after = after_region(states, self.reports[place])
                if after is None:
                    raise RuntimeError(f"structures {structures.start} to {structures.stop - 1} failed in another way")
            states = after

    def _findings(self) -> list[StabilityFindings]:
        pairs = zip(self.layout.samples_by_event, self.layout.events, strict=True)
        return [StabilityFindings(count, str(self.layout.attributes["method"]), name) for count, name in pairs]

    def _estimates(self, reports: list[Report], share: float) -> xr.Dataset:
        """Return the error estimates of all regions."""
        found = []
        for event, count in enumerate(self.layout.samples_by_event):
            estimate = ErrorEstimate(count, share, self.job.seed, 1, np.arange(0))
            for report in reports:
                estimate.include(report.errors[event])
            found.append(estimate.result(self.layout.demands))
        return found[0] if len(found) == 1 else xr.concat(found, "event", combine_attrs="override")

    def _in_memory(self, rest: xr.Dataset) -> xr.Dataset:
        template = self.layout.template
        filled = {
            str(name): variable if name not in self.rows else (variable.dims, self.rows[str(name)], variable.attrs)
            for name, variable in template.variables.items()
        }
        coordinates = {name: filled.pop(name) for name in list(filled) if name in template.coords}
        dataset = xr.Dataset(filled, coordinates)
        return (dataset.merge(rest) if rest.variables else dataset).assign_attrs(rest.attrs)


def run_in_regions(runs: Sequence[RegionRun], workers: Workers) -> None:
    """Run all regions of runs that are not done, those of several runs side by side."""
    for run in runs:
        run.check_limits()
    with counted_histories(sum(run.histories for run in runs)) as progress:
        for run in runs:
            progress.update(sum(report.histories for report in run.reports.values()))
        for (run, place), report in workers.each(_all_calls(runs)):
            run.take(place, report)
            progress.update(report.histories)


def _all_calls(runs: Iterable[RegionRun]) -> Iterator[tuple[Any, ...]]:
    for run in runs:
        yield from run.calls()


def after_region(states: list[dict[str, Any]], report: Report) -> list[dict[str, Any]] | None:
    """Return the states of reruns after a region, or None if it was run from others that decided otherwise."""
    after = [stand(state, made) for state, made in zip(states, report.decisions, strict=True)]
    return None if None in after else [each for each in after if each is not None]


def _keyed(job: Job) -> Job:
    """Return a job with its name."""
    job = replace(job, key="")
    what = job.scene, job.structures, job.integration, vars(job.kept), job.seed
    store = None if job.store is None else str(job.store)
    return replace(job, key=fingerprint(*what, vars(job.where), store))
