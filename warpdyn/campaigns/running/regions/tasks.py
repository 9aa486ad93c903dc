"""What a process does of a run: the limits, the samples or the whole histories of some structures, or the pilot."""

from __future__ import annotations

from typing import Any

import numpy as np
import xarray as xr

from warpdyn.campaigns.accuracy.pilot import choose_method
from warpdyn.campaigns.integration.ensemble import Ensemble
from warpdyn.campaigns.integration.stability_guard import Reruns, StabilityFindings
from warpdyn.campaigns.running.blocks import divide
from warpdyn.campaigns.running.histories import Histories, KeptHistories, outcomes_of
from warpdyn.campaigns.running.pipeline import Pipeline
from warpdyn.campaigns.running.regions.job import Job, Prepared, messages_caught, one_at_a_time, prepared_for
from warpdyn.campaigns.running.regions.report import Report, state_of
from warpdyn.campaigns.running.regions.rerun_budget import decisions
from warpdyn.campaigns.running.regions.statistics import Asked, reduction_for
from warpdyn.campaigns.running.sinks import InMemory, Reduced
from warpdyn.engine.kernels.queues import seconds_in_kernels
from warpdyn.foundations.files.zarr_stores import write_region


class Outcomes:
    """The outcomes of the samples of a region whose histories are kept, as `outcomes_of` returns them."""

    def __init__(self, histories: Histories) -> None:
        self.histories, self.found = histories, [(np.arange(0), np.arange(0), np.arange(0, dtype=np.int8))]

    def add(self, run: Ensemble, status: np.ndarray) -> None:
        """Take those of a block."""
        self.found.append(outcomes_of(self.histories, run, status))

    @property
    def arrays(self) -> tuple[np.ndarray, ...]:
        """Those of all blocks."""
        return tuple(np.concatenate(each) for each in zip(*self.found, strict=True))


def run_region(
    job: Job,
    structures: range,
    states: list[dict[str, Any]] | None,
    asked: Asked | None = None,
    numbers: np.ndarray | None = None,
) -> Report:
    """Draw and integrate the structures of a region; write their samples to the job's store, reduce or return them.

    Args:
        job: The job.
        structures: The structures.
        states: `Reruns.state` after all samples before them, for each event and then for the error estimates of each;
            None where it is not known.
        asked: Statistics that the samples are reduced to, if they are.
        numbers: Numbers of the structures among those of the statistics.
    """
    with one_at_a_time, messages_caught() as messages:
        prepared = prepared_for(job)
        run, kept, integration = prepared.run, job.kept, job.integration
        findings = _findings(prepared, job)
        table: InMemory | Reduced
        if asked is None or numbers is None:
            table = InMemory(run.model, prepared.columns, len(structures) * (run.samples // run.structures))
        else:
            reduction = reduction_for(asked, run.execution.cores).of_structures(numbers)
            is_estimated = kept.checked_share is not None
            table = Reduced(run, prepared.columns, reduction, numbers, is_estimated=is_estimated)
        estimates = prepared.estimates(kept.checked_share, len(structures))
        outcomes = None if kept.histories is None else Outcomes(kept.histories)
        pipeline = Pipeline(
            run,
            integration.on_unstable,
            findings,
            table,
            outcomes,
            estimates,
            divides_steps=integration.divides_steps,
            sample_error=kept.sample_error,
            tells_cost=structures.start == 0,
        )
        reruns = pipeline.reruns + [estimate.reruns for estimate in estimates]
        for one, state in zip(reruns, states or [Reruns().state] * len(reruns), strict=True):
            one.state, one.seen = state, []
        for queue in prepared.queues:
            queue.begin()
        first, last, memory = structures.start, structures.stop, job.where.memory
        blocks = divide(run, table.columns, memory, first=first, last=last, is_reduced=table.reduces)
        with table:
            pipeline.begin(blocks, prepared.queues)
            pipeline.process(lambda done: None)
            if isinstance(table, Reduced):
                table.finish(xr.Dataset())
                reduction.finish()
        errors = [estimate.found() for estimate in estimates]
        report = Report(
            structures=(structures.start, structures.stop),
            histories=len(structures) * sum(run.samples_by_event) // run.structures,
            findings=[state_of(each) for each in findings],
            decisions=[decisions(each, run.model.plan.dofs) for each in reruns],
            errors=errors,
            outcomes=() if outcomes is None else outcomes.arrays,
            longest_period=pipeline.longest_period,
            seconds={
                "sampling": pipeline.seconds_sampling,
                "integrating": pipeline.seconds_integrating,
                "in_kernels": seconds_in_kernels(prepared.queues),
            },
            messages=messages,
            statistics=reduction.partial() if isinstance(table, Reduced) else {},
        )
    if isinstance(table, Reduced):
        return report
    if job.store is None:
        report.rows = table.rows
    else:  # where a worker has several threads, another of its tasks integrates meanwhile
        report.chunks = write_region(job.store, structures.start * (run.samples // run.structures), table.rows)
        report.save(job.report_of(structures))
    return report


def find_limits(job: Job, structures: range) -> list[dict[str, Any]]:
    """Return what `state_of` returns of each event's stability limits, of the structures of a region."""
    with one_at_a_time:
        prepared = prepared_for(job)
        findings = _findings(prepared, job)
        blocks = divide(prepared.run, prepared.columns, job.where.memory, first=structures.start, last=structures.stop)
        for block in blocks:
            parts = prepared.run.events(np.asarray(block), prepared.queues[0])
            for found, part in zip(findings, parts, strict=True):
                found.add_limits(*part)
        return [state_of(each) for each in findings]


def integrate_histories(job: Job, outcomes: list[tuple[np.ndarray, ...]]) -> xr.Dataset:
    """Return the whole histories that a job asks for, after the outcomes of its samples are known."""
    assert job.kept.histories is not None
    with one_at_a_time:
        prepared = prepared_for(job)
        histories = KeptHistories(job.kept.histories, prepared.run, prepared.queues[0], job.integration)
        for own, substeps, status in outcomes:
            histories.take(own, substeps, status)
        return histories.result()


def choose(job: Job) -> dict[str, Any]:
    """Return the method, dtype and longest step that `plan` chooses for a job's target error."""
    with one_at_a_time:
        integration = job.integration
        assert integration.target_error is not None
        choice = choose_method(
            job.scene,
            integration.target_error,
            structures=job.structures,
            method=None if "method" in integration.left_open else integration.method,
            dtype=None if "dtype" in integration.left_open else integration.dtype,
            seed=job.seed,
            device=job.where.device,
            threads=prepared_for(job).run.execution.cores,
        )
        return {"method": choice.method, "dtype": choice.dtype, "longest_step": choice.longest_step}


def _findings(prepared: Prepared, job: Job) -> list[StabilityFindings]:
    """Return findings of each event, of all samples of the run as far as messages say of how many they are."""
    events = prepared.run.model.scene.excitation.event_names
    counts = zip(prepared.run.samples_by_event, events, strict=True)
    return [StabilityFindings(count, prepared.run.integration.method, name) for count, name in counts]
