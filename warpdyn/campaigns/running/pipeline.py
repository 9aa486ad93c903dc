"""Pipeline of a run: blocks of structures are prepared while earlier blocks are integrated."""

from __future__ import annotations

import sys
import time
from collections import deque
from collections.abc import Callable, Generator, Iterator
from concurrent.futures import ThreadPoolExecutor
from contextlib import ExitStack, contextmanager
from dataclasses import dataclass, field, replace
from typing import Any

import numpy as np

from warpdyn.campaigns.accuracy.error_estimate import ErrorEstimate
from warpdyn.campaigns.accuracy.precision import beyond_float32, may_need_float64, rerun_in_float64
from warpdyn.campaigns.accuracy.reliability import (
    NOT_CHECKED,
    UNRELIABLE,
    checked_share,
    is_checked,
    reliability,
    sensitive_samples,
    with_earlier,
)
from warpdyn.campaigns.accuracy.sample_errors import ERROR, SENSITIVE, fill_sample_errors
from warpdyn.campaigns.accuracy.scattered_steps import shorten_steps
from warpdyn.campaigns.integration.dynamics import Arrays
from warpdyn.campaigns.integration.ensemble import Ensemble, MapFunction
from warpdyn.campaigns.integration.run import Run
from warpdyn.campaigns.integration.stability_guard import Reruns, StabilityFindings, blank_failed, guard
from warpdyn.campaigns.preparation.preparation import Preparation
from warpdyn.campaigns.preparation.prepared_ensemble import PreparedEnsemble
from warpdyn.campaigns.running.blocks import blocks_ahead
from warpdyn.campaigns.running.cost import tell_cost
from warpdyn.campaigns.running.histories import Histories, outcomes_of
from warpdyn.campaigns.running.labels import fill_inputs, fill_outcomes
from warpdyn.campaigns.running.tables import Table, blank_rows
from warpdyn.engine.kernels.queues import CudaQueue, Queue
from warpdyn.foundations.core.interruption import stop_if_asked
from warpdyn.foundations.core.output_variables import DIVERGED, OK, UNSTABLE_STEP
from warpdyn.foundations.core.thread_pool import Ahead

MOST_COPYING_THREADS = 8  # more threads do not copy faster
SECONDS_OF_A_TURN = (
    2e-4  # switch interval of Python's threads in a GPU run: a city takes 14 % less time than with the default, 5e-3
)


@dataclass
class Block:
    """A block: structures that are integrated together, with the state of their integration.

    Args:
        parts: For each event, the ensemble of all samples of the block.
        unstable: For each event, which samples have a step beyond the stability limit, shape [sample].
        findings: For each event, findings on the stability of the samples before they are integrated.
        longest_period: Longest first period of the structures [s].
        rows: Arrays of the dataset's variables for the samples of the block, shape [sample, ...].
        event: Index of the present event.
        own: Arrays of the variables for the samples of the present event, shape [sample, ...].
        standing: Indices of the samples that are integrated in the present event: all except samples that failed
            or collapsed in an earlier event.
        started: Ensemble of the samples `standing`; None if there is no such sample.
        found: Outputs of the samples `standing`, shape [sample, ...].
        outputs: Outputs of all samples of the last finished event; the sample is the last dimension.
        flags: Flags `unreliable` of the samples of the last finished event.
        staying: Outputs that stay on the GPU to be reduced there, shape [sample, ...].
        sensitive: Result of `sensitive_samples` for the integrated samples; None if it is unknown or outdated.
    """

    parts: list[Ensemble]
    unstable: list[np.ndarray]
    findings: list[StabilityFindings]
    longest_period: float
    rows: Arrays = field(default_factory=dict)
    event: int = 0
    own: Arrays = field(default_factory=dict)
    standing: np.ndarray = field(default_factory=lambda: np.arange(0))
    started: Ensemble | None = None
    found: Arrays = field(default_factory=dict)
    outputs: Arrays = field(default_factory=dict)
    flags: np.ndarray = field(default_factory=lambda: np.zeros(0, dtype=np.int8))
    staying: dict[str, Any] = field(default_factory=dict)
    sensitive: np.ndarray | None = None

    @property
    def whole(self) -> Ensemble:
        """Ensemble of all samples of the present event."""
        return self.parts[self.event]

    def of_standing(self, values: np.ndarray) -> np.ndarray:
        """Return the values of the samples `standing` from those of all samples of the event, shape [sample]."""
        # Indexing by sample takes ten times as long as returning the array.
        return values if self.standing.size == values.size else values[self.standing]

    @property
    def samples(self) -> int:
        """Number of samples of the block in the dataset (those of the last event)."""
        return self.parts[-1].size


class Pipeline:
    """Pipeline of a run: launches blocks of structures while the next ones are prepared, and completes finished blocks.

    On a CPU, kernels use all threads, so blocks follow one another. During a GPU run, some threads prepare the next
    blocks and other threads write known values. Only the calling thread launches response histories; another thread
    launches their reductions on a separate stream. Samples that fail or collapse in an event are not integrated in
    later events.

    Args:
        run: The prepared run.
        findings: Findings on the stability of each event, which collect the warnings of the run.
        table: Table that receives the finished samples.
        histories: Samples whose whole histories are returned; None: no samples.
        estimates: Error estimates of each event; empty if `checked_share` is not given.
        preparation: Preparation kernels, by which a device prepares its blocks; None: the host prepares them.
        sample_error: Relative error [1] that is required of every sample; None: no requirement.
        tells_cost: Whether the expected time of the run is reported before the first block.

    Attributes:
        outcomes: Result of `outcomes_of` for each block.
    """

    def __init__(
        self,
        run: Run,
        findings: list[StabilityFindings],
        table: Table,
        histories: Histories | None,
        estimates: list[ErrorEstimate],
        *,
        preparation: Preparation | None = None,
        sample_error: float | None = None,
        tells_cost: bool = True,
    ) -> None:
        self.sample_error, self._is_told = sample_error, not tells_cost
        self.preparation = preparation
        self.run, self.findings, self.table = run, findings, table
        self.histories, self.estimates = histories, estimates
        self.outcomes: list[tuple[np.ndarray, ...]] = []
        self.advance: Callable[[int], object] = lambda done: None
        self.reruns = [Reruns() for _ in findings]
        self._error_reruns = [(Reruns(), Reruns()) for _ in findings]
        self.longest_period = 0.0
        self.seconds_sampling = self.seconds_integrating = 0.0
        self._checks = sample_error is None and is_checked(run.model)
        # If the GPU computes the statistics, copy back only the outputs that decide a sample's status.
        self._arriving: set[str] | None = None
        if table.reduces:
            judges = may_need_float64(run.model) or self._checks
            judging = {run.model.dynamics.peak[0]} if judges else set()
            self._arriving = {"status", "energy_balance_error", *judging}
        # Columns of the dataset with the dimension `event`, here without this dimension: one event is filled at a time.
        self.several = len(findings) > 1
        of_event = {name: column for name, column in table.columns.items() if "event" in column.dims}
        self._of_event = {name: replace(column, dims=column.dims[1:]) for name, column in of_event.items()}

    def begin(self, blocks: list[range], queues: list[Queue]) -> None:
        """Begin to prepare blocks; block i is later integrated on queue i modulo the number of queues.

        Other threads prepare blocks for a GPU from this call on. Blocks for a CPU are prepared by `process`.

        Args:
            blocks: Range of structures of each block.
            queues: Device queues.
        """
        items = [(structures, queues[number % len(queues)]) for number, structures in enumerate(blocks)]
        self._blocks, self._most = len(blocks), len(queues)
        if self.preparation is None:
            self._upcoming: Ahead[Block] | Generator[Block] = Ahead(self._prepare, items, blocks_ahead(self.run))
        else:
            self._upcoming = self._prepared(self.preparation, items)
            self._most = max(1, len(queues) - len(self.run.execution.devices))  # the others prepare blocks

    def close(self) -> None:
        """Stop the preparation of further blocks."""
        self._upcoming.close()

    def process(self, advance: Callable[[int], object]) -> None:
        """Integrate all blocks that `begin` was called with, and add their samples to the table (in memory or reduced).

        Args:
            advance: Called with the number of histories done since its last call.
        """
        self.advance = advance
        under_way: deque[Block] = deque()
        with ExitStack() as stack:
            stack.callback(self.close)
            map_function: MapFunction = map
            if self.run.execution.is_gpu:
                stack.enter_context(_quick_turns())
                copying = ThreadPoolExecutor(min(self.run.model.threads, MOST_COPYING_THREADS))
                map_function = stack.enter_context(copying).map
            started = 0
            while started < self._blocks or under_way:
                stop_if_asked()
                if started < self._blocks and len(under_way) < self._most:
                    under_way.append(self._next(self._upcoming, map_function))
                    started += 1
                    continue
                block = under_way.popleft()
                self._finish(block, map_function)
                if block.event + 1 < len(block.parts):
                    block.event += 1
                    self._start(block, map_function)
                    under_way.append(block)
                else:
                    self._complete(block)

    def _prepared(self, preparation: Preparation, items: list[tuple[range, Queue]]) -> Generator[Block]:
        """Yield blocks that their devices have prepared; queue the next preparation on every device before that.

        Otherwise, a device would be idle while the host waits for the preparation on another device.
        """
        begun = deque[PreparedEnsemble]()
        for structures, queue in items:
            begun.append(PreparedEnsemble(self.run, preparation, structures, queue))
            if len(begun) > len(self.run.execution.devices):
                yield self._settled(begun.popleft())
        while begun:
            yield self._settled(begun.popleft())

    def _settled(self, whole: PreparedEnsemble) -> Block:
        """Wait until the device has prepared a block, and return it; if that failed, the host prepares the block."""
        findings = [each.of_no_samples() for each in self.findings]
        if not whole.finish_preparation(findings[0]):
            return self._prepare((whole.range, whole.queue))
        return Block([whole], [np.zeros(whole.size, dtype=bool)], findings, whole.longest_period)

    def _prepare(self, item: tuple[range, Queue]) -> Block:
        """Return a block with drawn structures, stable steps in all events, and packed inputs of the first event.

        Several threads call this method at the same time, so it does not change any attribute of the pipeline.
        """
        structures, queue = item
        unstable, findings = [], [each.of_no_samples() for each in self.findings]
        parts = self.run.events(np.asarray(structures), queue)
        for part, found in zip(parts, findings, strict=True):
            shorten_steps(*part, found, divides=self.run.integration.divides_steps)
            unstable.append(guard(*part, self.run.integration.on_unstable, found))
        parts[0][0].pack()
        return Block([ensemble for ensemble, _ in parts], unstable, findings, float(parts[0][1].period.max()))

    def _next(self, upcoming: Iterator[Block], map_function: MapFunction) -> Block:
        """Take the next prepared block, start its first event, and return it."""
        began = time.perf_counter()
        block = next(upcoming)
        for findings, found in zip(self.findings, block.findings, strict=True):
            findings.include(found)
        self.longest_period = max(self.longest_period, block.longest_period)
        block.rows = self.table.rows_for(block.samples)
        self.seconds_sampling += time.perf_counter() - began
        if not self._is_told:
            self._is_told = True
            tell_cost(self.run, block.parts)
        self._start(block, map_function)
        return block

    def _start(self, block: Block, map_function: MapFunction) -> None:
        """Start the integration of the present event of a block, from the final states of the previous event."""
        began = time.perf_counter()
        whole, block.standing = block.whole, np.arange(block.whole.size)
        if self.several:
            rows = whole.model.blank_outputs(whole.size)
            block.own = blank_rows(whole.model, self._of_event, whole.size) | rows
        else:
            beside = whole.model.shapes.keys() - block.rows.keys()  # outputs that are not in the dataset
            block.own = block.rows | whole.model.blank_outputs(block.samples, beside)
        block.started, block.found = whole, block.own
        if whole.before is not None:
            whole.resume(block.outputs)
            status = block.outputs["status"][whole.row]
            if (status != OK).any():
                block.standing = np.flatnonzero(status == OK)
                block.started = whole.select(block.standing) if block.standing.size else None
                block.found = whole.model.blank_outputs(block.standing.size)
                self._mark_fallen(block, status)
        if block.started is not None:
            block.started.start(block.found, self.advance, self._arriving)
        fill_inputs(whole, block.own, map_function)
        self.seconds_integrating += time.perf_counter() - began

    def _mark_fallen(self, block: Block, status: np.ndarray) -> None:
        """Give samples that are not integrated in this event their earlier status; set their other outputs to NaN."""
        fallen = status != OK
        for name in block.whole.model.shapes:
            values = block.own[name]
            values[fallen] = np.nan if np.issubdtype(values.dtype, np.floating) else -1
        block.own["status"][fallen] = status[fallen]
        self.advance(int(np.count_nonzero(fallen)))

    def _finish(self, block: Block, map_function: MapFunction) -> None:
        """Wait for the present event of a block, rerun failed samples and complete all values, in the launch order."""
        whole, unstable, event = block.whole, block.unstable[block.event], block.event
        outputs = {name: block.own[name].T for name in whole.model.shapes}
        is_mended = False
        if block.started is not None:
            began = time.perf_counter()
            found = {name: block.found[name].T for name in whole.model.shapes}
            block.started.finish(block.found, map_function)
            is_mended = self._bring_back(block, found)
            if self.run.integration.on_unstable == "substep":
                self.reruns[event].settle(whole, block.standing, found)
            self.findings[event].in_float64 += rerun_in_float64(whole, block.standing, found)
            self._flag(block, found, unstable)
            self.seconds_integrating += time.perf_counter() - began
            self.findings[event].add_outcomes(found, ~block.of_standing(unstable))
            if block.found is not block.own:
                for name, values in found.items():
                    outputs[name][..., block.standing] = values
        everything = block.standing.size == whole.size
        stands = np.full(whole.size, everything)
        if not everything:
            stands[block.standing] = True
        outputs["status"][unstable & stands] = UNSTABLE_STEP
        blank_failed(outputs, outputs["status"] >= DIVERGED)
        if is_mended and isinstance(whole.queue, CudaQueue):
            whole.queue.put_back(block.staying, block.own)
        fill_outcomes(whole, block.own, map_function)
        if self.histories is not None:
            self.outcomes.append(outcomes_of(self.histories, whole, outputs["status"]))
        if self.sample_error is not None:
            counts = fill_sample_errors(whole, outputs, block.own, self.sample_error, self._error_reruns[event])
            self.findings[event].add_sample_errors(self.sample_error, *counts)
            is_off = (block.own[ERROR] > self.sample_error) | (block.own[SENSITIVE] == 1)
            block.own[UNRELIABLE][is_off] = 1
        if self.estimates:
            # Samples that were not run are excluded from the estimate.
            self.estimates[event].add(whole, outputs | {"status": np.where(stands, outputs["status"], DIVERGED)})
        if self.several:
            for name in self._of_event:
                copies = block.samples // whole.size
                block.rows[name][:, event] = np.repeat(block.own[name], copies, axis=0)
        block.outputs = outputs

    def _flag(self, block: Block, found: Arrays, unstable: np.ndarray) -> None:
        """Flag the unreliable samples of the present event of a block, and count them in the findings.

        Args:
            block: The block.
            found: Outputs of the integrated samples; the sample is the last dimension.
            unstable: Which samples have a step beyond the stability limit, shape [sample].
        """
        flags = np.full(block.whole.size, NOT_CHECKED, dtype=np.int8)
        is_stable = ~block.of_standing(unstable)
        if self._checks:
            stable = block.standing[is_stable]
            outputs = {name: values[..., is_stable] for name, values in found.items()}
            share = checked_share(self.run, block.event)
            flags[stable] = reliability(block.whole, stable, outputs, share, block.sensitive)
            if block.whole.before is not None:
                flags = with_earlier(flags, block.flags[block.whole.row])
            self.findings[block.event].add_flags(flags[stable], outputs["status"])
        else:
            is_good = is_stable & (found["status"] < DIVERGED)
            if is_good.all() and is_good.size == flags.size:
                flags[:] = 0  # fast path: indexing by sample takes ten times as long
            else:
                flags[block.standing[is_good]] = 0
        block.flags = flags
        if UNRELIABLE in block.own:
            block.own[UNRELIABLE][:] = flags

    def _bring_back(self, block: Block, found: Arrays) -> bool:
        """Copy outputs that stayed on a GPU to the host if samples may be rerun; return whether they were copied."""
        queue = block.whole.queue
        if self._arriving is None or not isinstance(queue, CudaQueue):
            return False
        block.staying = dict(queue.staying)
        block.sensitive = None
        may_change = block.unstable[0].any() or block.own["status"].max() >= DIVERGED
        may_change |= beyond_float32(block.whole, block.standing, found).any()
        if not may_change and self._checks:
            block.sensitive = sensitive_samples(block.whole, block.standing, found)
            may_change = block.sensitive.any()
        if not may_change:
            return False
        for name, array in block.staying.items():
            np.copyto(block.own[name], array.numpy())
        return True

    def _complete(self, block: Block) -> None:
        """Add the samples of a block, whose events are all finished, to the table (in memory or reduced)."""
        if self.several:
            fill_inputs(block.whole, {name: rows for name, rows in block.rows.items() if name not in self._of_event})
        self.table.add(block.rows, block.whole, block.staying)


@contextmanager
def _quick_turns() -> Iterator[None]:
    """Switch between Python threads every SECONDS_OF_A_TURN, so that the launching thread waits less."""
    before = sys.getswitchinterval()
    sys.setswitchinterval(SECONDS_OF_A_TURN)
    try:
        yield
    finally:
        sys.setswitchinterval(before)
