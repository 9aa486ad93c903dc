"""Functions that a process executes for a run: integrate a region, find limits, integrate histories, run a pilot."""

from __future__ import annotations

from collections.abc import Callable
from contextlib import closing
from typing import Any

import numpy as np
import xarray as xr

from warpdyn.campaigns.accuracy.pilot import choose_method
from warpdyn.campaigns.integration.dynamics import Arrays
from warpdyn.campaigns.running.blocks import divide
from warpdyn.campaigns.running.histories import KeptHistories
from warpdyn.campaigns.running.pipeline import Pipeline
from warpdyn.campaigns.running.regions.checkpoint import region_file
from warpdyn.campaigns.running.regions.job import Asked, Host, Job
from warpdyn.campaigns.running.regions.report import Report, state_of
from warpdyn.campaigns.running.tables import InMemory, Reduced, Table, blank_rows
from warpdyn.engine.device.running_time import seconds_in_kernels
from warpdyn.foundations.files.disk_errors import disk_error
from warpdyn.foundations.files.zarr_stores import write_region


class Region:
    """A region (range of structures that one process integrates) whose integration has begun.

    On a GPU, the first blocks of the region are prepared from the construction on, while an earlier region may run.

    Args:
        host: State of this process: prepared jobs, device queues and statistics.
        job: The job (all settings that the process needs).
        structures: Numbers of the region's structures.
        asked: Statistics that the samples are reduced to; None: the samples are kept.
        numbers: Number of each structure in the statistics, shape [structure].
        rows: Arrays for the samples by variable name, shape [sample, ...]; None: the region allocates them.
        is_partial: Whether the report contains the region's contribution to the statistics. False: the region adds its
            samples directly to the statistics of this process.
    """

    def __init__(
        self,
        host: Host,
        job: Job,
        structures: range,
        asked: Asked | None = None,
        numbers: np.ndarray | None = None,
        rows: Arrays | None = None,
        *,
        is_partial: bool = True,
    ) -> None:
        self.job, self.structures, self.prepared = job, structures, host.prepared(job)
        self.run, self.queues = self.prepared.run, host.queues(self.prepared)
        run, outputs, memory = self.run, job.outputs, job.execution.memory
        self.first = structures.start * (run.samples // run.structures)
        self.is_returned, self.reduction = rows is None and asked is None, None
        if asked is not None and numbers is not None:
            reduction = host.reduction(asked, run.execution.cores)
            if is_partial:
                self.reduction = reduction = reduction.of_structures(numbers)
            is_estimated = outputs.checked_share is not None
            self.table: Table = Reduced(run, self.prepared.columns, reduction, numbers, is_estimated=is_estimated)
        else:
            if rows is None:
                samples = len(structures) * (run.samples // run.structures)
                rows = blank_rows(run.model, self.prepared.columns, samples)
            self.table = InMemory(self.prepared.columns, rows)
        blocks = divide(run, self.table.columns, memory, structures, is_reduced=self.table.reduces)
        self.findings = run.findings
        self.estimates = self.prepared.estimates(len(blocks[0]))
        self.pipeline = Pipeline(
            run,
            self.findings,
            self.table,
            outputs.histories,
            self.estimates,
            preparation=self.prepared.preparation,
            sample_error=outputs.sample_error,
            tells_cost=structures.start == 0,
        )
        self.pipeline.begin(blocks, self.queues)

    def close(self) -> None:
        """Stop the preparation of further blocks."""
        self.pipeline.close()

    def finish(self, advance: Callable[[int], object] = lambda done: None) -> Report:
        """Integrate the samples, write them to the file or store of the job if it has one, and return the report.

        Args:
            advance: Called with the number of histories done since its last call.
        """
        pipeline, job = self.pipeline, self.job
        for queue in self.queues:
            queue.spans.clear()  # the memory is not freed: a GPU may still reduce blocks of an earlier region
        with closing(self), closing(self.table):
            pipeline.process(advance)
            self.table.finish()
        if self.reduction is not None:
            self.reduction.finish()
        outcomes = [np.concatenate(each) for each in zip(*pipeline.outcomes, strict=True)]
        report = Report(
            structures=(self.structures.start, self.structures.stop),
            findings=[state_of(each) for each in self.findings],
            errors=[estimate.found() for estimate in self.estimates],
            outcomes=tuple(outcomes),
            longest_period=pipeline.longest_period,
            seconds={
                "sampling": pipeline.seconds_sampling,
                "integrating": pipeline.seconds_integrating,
                "in_kernels": seconds_in_kernels(self.queues),
            },
            statistics={} if self.reduction is None else self.reduction.partial(),
            rows=self.table.rows if self.is_returned and isinstance(self.table, InMemory) else {},
        )
        if job.folder is not None and job.path is not None:
            try:
                if job.store is not None:
                    report.chunks, report.rows = write_region(job.store, self.first, report.rows), {}
                report.save(region_file(job.folder, job.group, self.structures))
            except OSError as error:
                raise disk_error(error, job.path) from error
            report.rows = {}
        return report


def run_region(
    host: Host, job: Job, structures: range, asked: Asked | None = None, numbers: np.ndarray | None = None
) -> Report:
    """Integrate a whole region on a worker of a cluster and return its report; arguments: see `Region`."""
    with host.collected() as messages:
        report = Region(host, job, structures, asked, numbers).finish()
    report.messages = messages
    return report


def find_limits(host: Host, job: Job, structures: range) -> list[dict[str, Any]]:
    """Return the stability limits of a region's structures, for each event, as dictionaries from `state_of`."""
    prepared = host.prepared(job)
    findings, queue = prepared.run.findings, host.queues(prepared)[0]
    for block in divide(prepared.run, prepared.columns, job.execution.memory, structures):
        for found, part in zip(findings, prepared.run.events(np.asarray(block), queue), strict=True):
            found.add_limits(*part)
    return [state_of(each) for each in findings]


def integrate_histories(host: Host, job: Job, outcomes: list[tuple[np.ndarray, ...]]) -> xr.Dataset:
    """Return the whole histories that a job requests, as a dataset.

    Args:
        host: State of this process.
        job: The job.
        outcomes: Outcomes of the samples from each region's report: the histories use their final steps.
    """
    assert job.outputs.histories is not None
    prepared = host.prepared(job)
    histories = KeptHistories(job.outputs.histories, prepared.run, host.queues(prepared)[0])
    for own, substeps, status in outcomes:
        histories.take(own, substeps, status)
    return histories.result()


def choose(host: Host, job: Job) -> dict[str, Any]:
    """Return the method, dtype and longest step [s] that a pilot run chooses for a job's target error, by name."""
    integration = job.integration
    assert integration.target_error is not None
    choice = choose_method(
        job.scene,
        integration.target_error,
        structures=job.structures,
        method=integration.method,
        dtype=integration.dtype,
        seed=job.seed,
        device=job.execution.device,
        threads=host.prepared(job).run.execution.cores,
    )
    return {"method": choice.method, "dtype": choice.dtype, "longest_step": choice.longest_step}
