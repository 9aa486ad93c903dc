"""The course of a run: what happens to each block, and what happens to others meanwhile."""

from __future__ import annotations

import time
from collections import deque
from collections.abc import Callable, Iterable, Iterator
from concurrent.futures import ThreadPoolExecutor
from contextlib import closing, nullcontext

import numpy as np

from warpdyn.accuracy.error_estimate import ErrorEstimate
from warpdyn.core.output_variables import DIVERGED, UNSTABLE_STEP
from warpdyn.integration.ensemble import Ensemble, MapFunction
from warpdyn.integration.run import Run
from warpdyn.integration.stability_guard import Findings, Reruns, blank_failed, guard
from warpdyn.kernels.queues import Queue
from warpdyn.running.blocks import blocks_ahead
from warpdyn.running.histories import KeptHistories
from warpdyn.running.labels import Arrays, fill_inputs, fill_outcomes
from warpdyn.running.sinks import InFile, InMemory

MOST_COPYING_THREADS = 8  # more do not copy faster


class Pipeline:
    """Every block is drawn, guarded and packed; started; and, once a device is done with it, completed.

    The threads of a CPU are all for its kernels, so that one block follows the other. While GPUs work, a thread
    prepares the next blocks and others fill in what is known, but only this one launches.

    Args:
        run: The run.
        on_unstable: What is done about steps beyond the stability limit.
        findings: Where it is kept what there is to tell of the run's stability.
        table: Where the samples go.
        kept: Samples whose histories are kept.
        estimate: What is run again to estimate errors.
        advance: Called with the number of samples done since its last call.
    """

    def __init__(
        self,
        run: Run,
        on_unstable: str,
        findings: Findings,
        table: InMemory | InFile,
        kept: KeptHistories | None,
        estimate: ErrorEstimate | None,
        advance: Callable[[int], object],
    ) -> None:
        self.run, self.on_unstable, self.findings, self.table = run, on_unstable, findings, table
        self.kept, self.estimate, self.advance = kept, estimate, advance
        self.reruns = Reruns()
        self.longest_period = 0.0
        self.seconds_sampling = self.seconds_integrating = 0.0

    def process(self, blocks: list[np.ndarray], queues: list[Queue]) -> None:
        """Take all blocks, given by their structures, through the queues in turn."""
        items = [(structures, queues[number % len(queues)]) for number, structures in enumerate(blocks)]
        upcoming = _prepared_ahead(self._prepare, items, blocks_ahead(self.run))
        is_gpu = self.run.devices[0] != "cpu"
        under_way: deque[tuple[Ensemble, np.ndarray, Arrays]] = deque()
        copying = ThreadPoolExecutor(min(self.run.terms.threads, MOST_COPYING_THREADS)) if is_gpu else nullcontext()
        with closing(upcoming), copying as pool:
            map_function = pool.map if is_gpu else map
            for _ in blocks:
                if len(under_way) == len(queues):
                    self._finish(*under_way.popleft(), map_function)
                under_way.append(self._start(upcoming, map_function))
            while under_way:
                self._finish(*under_way.popleft(), map_function)

    def _prepare(self, item: tuple[np.ndarray, Queue]) -> tuple[Ensemble, np.ndarray]:
        """Draw a block, guard its steps and pack it; return it and which of its samples are unstable."""
        block, vibration = self.run.ensemble(*item)
        unstable = guard(block, vibration, self.on_unstable, self.findings)
        self.longest_period = max(self.longest_period, float(vibration.period.max()))
        block.pack()
        return block, unstable

    def _start(
        self, upcoming: Iterator[tuple[Ensemble, np.ndarray]], map_function: MapFunction
    ) -> tuple[Ensemble, np.ndarray, Arrays]:
        """Start the next block; return it, which of its samples are unstable, and its rows."""
        began = time.perf_counter()
        block, unstable = next(upcoming)
        rows = self.table.rows_for(block.sample.size)
        prepared = time.perf_counter()
        block.start(rows, self.advance)
        fill_inputs(block, rows, map_function)
        self.seconds_sampling += prepared - began
        self.seconds_integrating += time.perf_counter() - prepared
        return block, unstable, rows

    def _finish(self, block: Ensemble, unstable: np.ndarray, rows: Arrays, map_function: MapFunction) -> None:
        """Wait for a block, and complete and hand over its rows; blocks come in the order in which they began."""
        began = time.perf_counter()
        block.finish(rows, map_function)
        outputs = {name: rows[name].T for name in self.run.terms.shapes}
        if self.on_unstable == "substep":
            self.reruns.settle(block, np.arange(block.sample.size), outputs)
        self.seconds_integrating += time.perf_counter() - began
        self.findings.add_outcomes(outputs, ~unstable)
        outputs["status"][unstable] = UNSTABLE_STEP
        blank_failed(outputs, outputs["status"] >= DIVERGED)
        fill_outcomes(block, rows)
        if self.kept is not None:
            self.kept.add(block, outputs["status"])
        if self.estimate is not None:
            self.estimate.add(block, outputs)
        self.table.add(rows)


def _prepared_ahead(work: Callable, items: Iterable, depth: int) -> Iterator:
    """Yield the work on each item; that on so many of the next is begun before, in another thread, in their order."""
    if depth == 0:
        yield from map(work, items)
        return
    with ThreadPoolExecutor(1) as worker:
        waiting: deque = deque()
        try:
            for item in items:
                waiting.append(worker.submit(work, item))
                if len(waiting) > depth:
                    yield waiting.popleft().result()
            while waiting:
                yield waiting.popleft().result()
        finally:
            for result in waiting:
                result.cancel()
