"""The course of a run of a sequence: block by block, one event after the other on what the one before has left."""

from __future__ import annotations

import time
from collections.abc import Callable
from dataclasses import replace

import numpy as np

from warpdyn.accuracy.error_estimate import ErrorEstimate
from warpdyn.core.output_variables import DIVERGED, OK, UNSTABLE_STEP
from warpdyn.integration.ensemble import Ensemble
from warpdyn.integration.run import Run
from warpdyn.integration.stability_guard import Findings, Reruns, blank_failed, guard, integrate_guarded
from warpdyn.kernels.arguments import output_dtype
from warpdyn.kernels.queues import Queue
from warpdyn.running.labels import Arrays, fill_inputs, fill_outcomes
from warpdyn.running.sinks import InFile, InMemory, blank_rows


class EventPipeline:
    """Every block goes through all events; what has not stood one of them is not run in the next.

    Args:
        run: The run.
        on_unstable: What is done about steps beyond the stability limit.
        findings: Where it is kept what there is to tell of each event's stability.
        table: Where the samples go.
        estimates: What is run again to estimate the errors of each event; none where they are not asked for.
        advance: Called with the number of samples done since its last call.
    """

    def __init__(
        self,
        run: Run,
        on_unstable: str,
        findings: list[Findings],
        table: InMemory | InFile,
        estimates: list[ErrorEstimate],
        advance: Callable[[int], object],
    ) -> None:
        self.run, self.on_unstable, self.findings, self.table = run, on_unstable, findings, table
        self.estimates, self.advance = estimates, advance
        self.reruns = [Reruns() for _ in findings]
        self.longest_period = 0.0
        self.seconds_sampling = self.seconds_integrating = 0.0

    def process(self, blocks: list[np.ndarray], queues: list[Queue]) -> None:
        """Take all blocks, given by their structures, through the queues in turn."""
        for number, structures in enumerate(blocks):
            self._process_block(structures, queues[number % len(queues)])

    def _process_block(self, structures: np.ndarray, queue: Queue) -> None:
        """Take a block through all events and hand over its rows."""
        began = time.perf_counter()
        parts = self.run.events(structures, queue)
        unstable = [
            guard(*part, self.on_unstable, findings) for part, findings in zip(parts, self.findings, strict=True)
        ]
        self.longest_period = max(self.longest_period, float(parts[0][1].period.max()))
        samples = parts[-1][0].sample.size
        rows = self.table.rows_for(samples)
        prepared = time.perf_counter()
        outputs: Arrays = {}
        for event, (block, _) in enumerate(parts):
            outputs = self._integrate(event, block, unstable[event], outputs)
            own = self._labelled_rows(block, outputs)
            for name in own:
                rows[name][:, event] = np.repeat(own[name], samples // block.sample.size, axis=0)
        fill_inputs(block, {name: values for name, values in rows.items() if name not in own})
        self.table.add(rows)
        self.advance(samples)
        self.seconds_sampling += prepared - began
        self.seconds_integrating += time.perf_counter() - prepared

    def _integrate(self, event: int, block: Ensemble, unstable: np.ndarray, before: Arrays) -> Arrays:
        """Return what a block's samples record in an event, after what they recorded in the one before, sample last."""
        status = np.full(block.sample.size, OK, dtype=np.int8)
        if block.before is not None:
            block.resume(before)
            status = before["status"][block.row]
        standing = np.flatnonzero(status == OK)
        outputs = {
            name: np.full((*shape, status.size), *_blank(name, block)) for name, shape in block.terms.shapes.items()
        }
        if standing.size:
            if self.on_unstable == "substep":
                found = integrate_guarded(block, standing, self.reruns[event])
            else:
                found = block.integrate(standing)
            self.findings[event].add_outcomes(found, ~unstable[standing])
            for name, values in found.items():
                outputs[name][..., standing] = values
        fallen = status != OK
        outputs["status"][fallen] = status[fallen]
        outputs["status"][unstable & ~fallen] = UNSTABLE_STEP
        blank_failed(outputs, outputs["status"] >= DIVERGED)
        if self.estimates:
            # What was not run has no errors to be estimated.
            self.estimates[event].add(block, outputs | {"status": np.where(fallen, DIVERGED, outputs["status"])})
        return outputs

    def _labelled_rows(self, block: Ensemble, outputs: Arrays) -> Arrays:
        """Return what the dataset holds of a block's samples in one event, sample first."""
        event_columns = {
            name: replace(column, dims=column.dims[1:])
            for name, column in self.table.columns.items()
            if "event" in column.dims
        }
        own = blank_rows(block.terms, event_columns, block.sample.size)
        for name in own.keys() & outputs.keys():
            own[name][...] = outputs[name].T
        fill_inputs(block, own)
        fill_outcomes(block, own)
        return own


def _blank(name: str, block: Ensemble) -> tuple[float, np.dtype]:
    """Return what an output is where nothing was run, and its type."""
    dtype = output_dtype(name, block.plan.dtype)
    return (np.nan if np.issubdtype(dtype, np.floating) else -1), dtype
