"""The run of a scene: regions (ranges of structures) are integrated, and a sink (memory, file) gets their results.

A group contains the structures that share a kernel and a default step: a scene of one structure is one group, and a
portfolio has a group for each kernel and default step. A region is a contiguous range of the structures of a group,
which one process integrates. A sink receives the results of regions: memory, a file, a Zarr store, or statistics.
"""

from __future__ import annotations

import time
from contextlib import AbstractContextManager, ExitStack, nullcontext
from dataclasses import replace
from operator import itemgetter
from pathlib import Path
from typing import Any

import numpy as np
import xarray as xr

from warpdyn.campaigns.accuracy.error_estimate import ErrorEstimate
from warpdyn.campaigns.integration.run import MOST_SAMPLES, build_run
from warpdyn.campaigns.integration.settings import Execution, Integration
from warpdyn.campaigns.integration.time_grid import warn_of_short_tail
from warpdyn.campaigns.portfolio.groups import Group, checked_archetypes, groups_of, portfolio_of
from warpdyn.campaigns.portfolio.labels import common_attributes, largest_estimate
from warpdyn.campaigns.reductions.population import Population
from warpdyn.campaigns.reductions.reduction import Reduction
from warpdyn.campaigns.running.outputs import Outputs
from warpdyn.campaigns.running.regions.checkpoint import FINGERPRINT, Checkpoint, fingerprint_of, versions
from warpdyn.campaigns.running.regions.cluster import OnCluster, workers_of
from warpdyn.campaigns.running.regions.job import Asked, Job, Layout, lay_out_run
from warpdyn.campaigns.running.regions.region import choose, find_limits, integrate_histories
from warpdyn.campaigns.running.regions.report import Report, merged
from warpdyn.campaigns.running.regions.workers import Here, Part
from warpdyn.campaigns.running.sinks import Files, Memory, Sink, Statistics, Store
from warpdyn.foundations.core.checks import whole_number
from warpdyn.foundations.core.messages import no_warnings, tell, warn_caller
from warpdyn.foundations.core.progress import counted_histories
from warpdyn.foundations.files.unfinished import STORE_SUFFIX, SUFFIX, Unfinished
from warpdyn.model.scene.portfolio import Portfolio
from warpdyn.model.scene.scene import Scene


class Run:
    """The run of a scene, for one call of `simulate`; the constructor checks the arguments.

    Args:
        scene: The scene.
        structures: Number of structures to draw; 1 for a portfolio.
        integration: How the structures are integrated (method, step, number type).
        execution: Devices, threads, memory and cluster.
        outputs: Results, and the file that they are written to.
        seed: Seed of every random draw.
    """

    def __init__(
        self,
        scene: Scene,
        structures: int,
        integration: Integration,
        execution: Execution,
        outputs: Outputs,
        seed: int,
    ) -> None:
        self._started = time.perf_counter()
        self.scene, self.integration, self.outputs = scene, integration, outputs
        self.seed, count = whole_number("seed", seed, 0), whole_number("structures", structures, 1)
        self.portfolio = scene.structure if isinstance(scene.structure, Portfolio) else None
        self.execution = replace(execution, cluster=None)
        # With a cluster, devices belong to its workers, so this process plans for its CPU.
        self.here = self.execution if execution.cluster is None else replace(self.execution, device="cpu")
        self.workers: Here | OnCluster = (
            Here(self.here)
            if execution.cluster is None
            else workers_of(execution.cluster, execution.device, execution.threads)
        )
        self.digest = fingerprint_of(scene, count, integration, self.workers.machines, outputs.identity, self.seed)
        self.groups: list[Group | None] = [None]
        if self.portfolio is not None:
            self.groups = list(divided(scene, count, integration, self.here, outputs, self.seed))
        self.structures = count if self.portfolio is None else self.portfolio.buildings
        self.jobs = [self._job(number, group) for number, group in enumerate(self.groups)]

    def result(self) -> xr.Dataset:
        """Integrate all samples; return the dataset of the run (samples or statistics) with its attributes."""
        outputs = self.outputs
        with ExitStack() as stack:
            unfinished = reduction = checkpoint = None
            if outputs.path is not None:
                suffix = STORE_SUFFIX if outputs.is_store else SUFFIX
                unfinished = stack.enter_context(Unfinished(outputs.path, suffix))
            if outputs.reduced:
                population = Population(self.scene, self.structures)
                reduction = stack.enter_context(Reduction(outputs.reduced, population, self.here.cores))
            # Check the whole run before opening the checkpoint, so that a run which cannot start does not touch an
            # existing result.
            layouts = [self._laid_out(job) for job in self.jobs]
            if unfinished is not None:
                checkpoint = Checkpoint(unfinished, self.digest, outputs.overwrite)
            parts = [self._part(*each, checkpoint) for each in zip(self.groups, self.jobs, layouts, strict=True)]
            sink = self._sink(reduction, checkpoint)
            sink.begin(parts)
            if checkpoint is not None:
                if isinstance(self.workers, OnCluster) and not outputs.reduced:
                    self.workers.check_store(parts[0].job)
                self._report_finished(parts, checkpoint.path)
            self._check_limits(parts)
            seconds = time.perf_counter() - self._started
            self._run(parts, sink)
            rests = []
            for part in parts:
                with part.named():
                    rests.append(self._rest(part))
            rest = rests[0]
            if self.portfolio is not None:
                attributes = {"scene": self.scene.to_json(), "title": self.scene.title, "seed": self.seed}
                attributes |= {FINGERPRINT: self.digest} | common_attributes(rests, seconds)
                rest = largest_estimate(rests).assign_attrs(attributes)
            result = sink.finish(parts, rest, self.portfolio)
        if isinstance(self.workers, Here):
            self.workers.host.keep_queues()
        return result

    def take(self, sink: Sink, part: Part, place: int, report: Report) -> None:
        """Deliver the report of region number `place` of the group `part` to the sink; tests stop runs by it."""
        sink.take(part, place, report)

    def _job(self, number: int, group: Group | None) -> Job:
        """Return the job of a group (all that a process needs to run it); None: a scene of one structure."""
        outputs = self.outputs
        chosen = {} if group is None or group.longest_step is None else {"longest_step": group.longest_step}
        where = self.execution.device, self.execution.threads, self.execution.memory
        return Job(
            scene=self.scene if group is None else group.scene,
            structures=self.structures if group is None else group.buildings.size,
            integration=self.integration,
            chosen=chosen,
            execution=self.execution,
            outputs=replace(outputs, statistics=None, path=None, overwrite=False),
            seed=self.seed,
            key=f"{self.digest} {number} {where}",
            group=number,
            versions=versions(),
            is_divided=isinstance(self.workers, OnCluster) or outputs.path is not None,
            is_reduced=bool(outputs.reduced),
        )

    def _laid_out(self, job: Job) -> Layout:
        with _named(self.groups[job.group]):
            return self.workers.ask(lay_out_run, job, *self.workers.layout)

    def _part(self, group: Group | None, job: Job, layout: Layout, checkpoint: Checkpoint | None) -> Part:
        """Return a group with its regions; with a target error, a pilot run first chooses the settings not given."""
        settled: dict[str, Any] = {} if checkpoint is None else checkpoint.settled.get(str(job.group), {})
        if job.integration.target_error is not None:
            with _named(group):
                chosen = settled.get("chosen") or self.workers.ask(choose, job)
            job = replace(job, chosen=job.chosen | chosen, key=f"{job.key} {chosen}")
            layout = self._laid_out(job)
            settled = settled | {"chosen": chosen}
        with _named(group):
            for text in layout.messages:
                warn_caller(text)
        size = int(settled.get("structures_per_region", layout.structures_per_region))
        if checkpoint is not None:
            checkpoint.settle({str(job.group): settled | {"structures_per_region": size}})
            store = checkpoint.folder / f"samples{STORE_SUFFIX}" if self._is_store else None
            folder = None if job.is_reduced else checkpoint.folder
            job = replace(job, folder=folder, store=store, path=checkpoint.path)
        count = job.structures
        return Part(
            number=job.group,
            job=job,
            layout=layout,
            regions=[range(first, min(first + size, count)) for first in range(0, count, size)],
            named=lambda: _named(group),
            buildings=None if group is None else group.buildings,
        )

    @property
    def _is_store(self) -> bool:
        """Whether the processes that integrate regions write their samples directly to chunks of a Zarr store."""
        return self.outputs.is_store and self.portfolio is None and not self.outputs.reduced

    def _sink(self, reduction: Reduction | None, checkpoint: Checkpoint | None) -> Sink:
        host = self.workers.host if isinstance(self.workers, Here) else None
        if reduction is not None:
            asked = Asked(self.outputs.reduced, self.scene, self.structures, f"statistics of {self.digest}")
            if host is not None:
                host.reductions[asked.key] = reduction
            return Statistics(reduction, asked, checkpoint, is_partial=host is None or checkpoint is not None)
        if checkpoint is None:
            return Memory(host)
        return Store(checkpoint) if self._is_store else Files(checkpoint)

    def _report_finished(self, parts: list[Part], path: Path) -> None:
        """Report how many structures an earlier, interrupted call has finished in the checkpoint at `path`."""
        done = sum(len(part.regions[place]) for part in parts for place in part.reports)
        if done:
            tell(
                f"{path}: resumes after the {done} of {self.structures} structures that an earlier run has finished. "
                "To start again, give overwrite=True"
            )

    def _check_limits(self, parts: list[Part]) -> None:
        """With on_unstable="raise", raise an error if the step of any sample is beyond its stability limit."""
        if self.integration.on_unstable != "raise":
            return
        for part in parts:
            with part.named():
                calls = ((place, find_limits, part.job, region) for place, region in enumerate(part.regions))
                found = [states for _, states in sorted(self.workers.each(calls), key=itemgetter(0))]
                for empty, *states in zip(part.layout.findings, *found, strict=True):
                    merged(empty, states).refuse(any_step=True)

    def _run(self, parts: list[Part], sink: Sink) -> None:
        """Integrate all regions that have no report yet, and deliver each report to the sink."""
        with counted_histories(sum(part.histories for part in parts)) as progress:
            for part in parts:
                done = sum(len(part.regions[place]) for place in part.reports)
                progress.update(part.histories * done // part.job.structures)
            missing = (
                (part, place) for part in parts for place in range(len(part.regions)) if place not in part.reports
            )
            orders = ((*each, sink.given_to(*each)) for each in missing)
            begun = [part for part in parts if len(part.reports) < len(part.regions)]
            for part, place, report in self.workers.regions(begun, orders, progress.update):
                self.take(sink, part, place, report)

    def _rest(self, part: Part) -> xr.Dataset:
        """Issue the warnings of a group's regions; return the variables and attributes of the group's dataset.

        The returned dataset contains everything except the samples: whole histories, estimated errors and attributes.
        """
        job, layout, outputs = part.job, part.layout, self.outputs
        reports = [part.reports[place] for place in range(len(part.regions))]
        for text in dict.fromkeys(text for report in reports for text in report.messages):
            warn_caller(text)
        for empty, *states in zip(layout.findings, *(report.findings for report in reports), strict=True):
            merged(empty, states).warn(job.integration.on_unstable)
        warn_of_short_tail(job.scene, max(report.longest_period for report in reports))
        rest = xr.Dataset()
        if outputs.histories is not None:
            outcomes = [report.outcomes for report in reports]
            rest = self.workers.ask(integrate_histories, job, outcomes)
        if outputs.checked_share is not None:
            rest = rest.merge(_estimates(part, reports, outputs.checked_share))
        seconds = {f"seconds_{name}": sum(report.seconds[name] for report in reports) for name in reports[0].seconds}
        return rest.assign_attrs(layout.template.attrs | layout.attributes | {FINGERPRINT: self.digest} | seconds)


def divided(
    scene: Scene, structures: int, integration: Integration, execution: Execution, outputs: Outputs, seed: int
) -> list[Group]:
    """Return the groups of a portfolio: buildings with the same number of storeys, law and damping run together.

    All checks that concern the whole portfolio come first. Arguments: see `Run`. A group may contain buildings of
    several archetypes. The step of a building is the default step of its archetype in a separate run, rounded down to
    10 ms divided by a power of 2, so that the results of a building do not depend on the rest of the portfolio.
    """
    portfolio, excitation = portfolio_of(scene), scene.excitation
    if structures != 1:
        raise ValueError(
            "structures= does not apply to a portfolio: remove structures, and give each Archetype its `count`"
        )
    if outputs.histories is not None:
        raise ValueError(
            "histories of a portfolio are not kept: remove histories, or run a scene of one archetype with them"
        )
    if portfolio.buildings * excitation.samples_per_structure > MOST_SAMPLES:
        raise ValueError(f"{portfolio!r} has more than {MOST_SAMPLES} samples: divide it into several portfolios")
    excitation.check_structures(portfolio.buildings)
    archetypes = checked_archetypes(scene, integration.nominal_method)
    first = next(iter(portfolio.archetypes.values())).building
    with no_warnings():  # the groups repeat these warnings
        # Settings are checked before anything is drawn, because their errors concern no archetype.
        build_run(replace(scene, structure=first), portfolio.buildings, integration, execution, seed)
    return groups_of(portfolio, archetypes, integration, seed)


def _named(group: Group | None) -> AbstractContextManager[object]:
    """Return a context in which messages contain the name of a portfolio's group; None: messages are unchanged."""
    return nullcontext() if group is None else group.named_in_messages()


def _estimates(part: Part, reports: list[Report], share: float) -> xr.Dataset:
    """Return the estimated relative errors [1] of a group's demands, merged from the reports of all its regions."""
    found = []
    for event, count in enumerate(part.layout.samples_by_event):
        estimate = ErrorEstimate(count, share, part.job.seed, 1, np.arange(0))
        for report in reports:
            estimate.include(report.errors[event])
        found.append(estimate.result(part.layout.demands))
    return found[0] if len(found) == 1 else xr.concat(found, "event", combine_attrs="override")
