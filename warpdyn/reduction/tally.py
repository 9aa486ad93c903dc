"""Counts of samples by cell and outcome, and sums of their demands, that threads make of a run's blocks."""

from __future__ import annotations

from collections.abc import Callable, Mapping
from concurrent.futures import ThreadPoolExecutor
from dataclasses import dataclass
from typing import Any

import numpy as np

from warpdyn.core.output_variables import DIVERGED, STATUS_MEANINGS
from warpdyn.kernels.auxiliary import reductions
from warpdyn.kernels.auxiliary.exact_sums import BYTES_PER_CELL, ExactSums, exact_totals_kernel
from warpdyn.kernels.queues import free_memory
from warpdyn.reduction.cells import Cells, Rows
from warpdyn.reduction.limits import magnitudes

FAILURES = STATUS_MEANINGS[DIVERGED:]
LEAST_SAMPLES = (
    2**15
)  # that a thread takes: a launch takes Python a tenth of a millisecond, in which no other thread runs
MEMORY_OF_COUNTS = 2**28  # bytes that threads may take for counts of their own
MEMORY_OF_SUMS = 2**23  # bytes of the sums of rows, which should stay in the cache
NONE = np.zeros(0, dtype=np.int32)


@dataclass(frozen=True, eq=False)
class Block:
    """Finished samples of some structures, in one event.

    Args:
        structures: Numbers of the structures in the run.
        event: The event.
        values: Variables of the samples by name, sample first and ordered by structure.
    """

    structures: np.ndarray
    event: int
    values: Mapping[str, np.ndarray]

    @property
    def status(self) -> np.ndarray:
        """Outcome of each sample."""
        return self.values["status"]

    def demand(self, name: str) -> np.ndarray:
        """Return a demand by sample and place."""
        values = self.values[name]
        return values.reshape(len(values), -1)

    def rows(self, cells: Cells) -> Rows:
        """Return how the samples go to cells."""
        return cells.rows(self.structures, self.values["motion_index"] if cells.needs_motions else None, self.event)


class Workers:
    """Threads that share the rows of a block.

    Args:
        threads: How many there are.
    """

    def __init__(self, threads: int) -> None:
        self.threads = threads
        self._pool = ThreadPoolExecutor(threads)

    def close(self) -> None:
        """End the threads."""
        self._pool.shutdown()

    def share(self, work: Callable[[int, int, int], object], first: int, last: int, least: int, most: int = 0) -> None:
        """Call work(first, last, thread) for parts of a range.

        Args:
            work: The work.
            first, last: The range.
            least: Least length of a part.
            most: Most parts; 0 for as many as there are threads.
        """
        parts = max(1, min(most or self.threads, self.threads, (last - first) // max(1, least)))
        edges = np.linspace(first, last, parts + 1).astype(int).tolist()
        if parts == 1:
            work(first, last, 0)
            return
        list(self._pool.map(work, edges[:-1], edges[1:], range(parts)))


class Tally:
    """Counts of samples by place, cell and outcome: each state of a demand, and after them failures by status.

    Args:
        cells: The cells.
        columns: Places that are counted by themselves, and the worst of all.
        states: Number of states, the first of which is that of samples below every bound.
        threads: Threads that count.

    Raises:
        MemoryError: If the counts do not fit in memory.
    """

    def __init__(self, cells: Cells, columns: int, states: int, threads: int) -> None:
        self.cells, shape = cells, (columns, cells.count, states + len(FAILURES))
        size = 8.0 * np.prod(np.array(shape, dtype=float))
        check_fits_memory(cells, size)
        # Threads take different structures, whose cells are different ones where a cell is of one structure.
        is_own = cells.population.structure_dim in cells.dims
        tables = 1 if is_own else int(max(1, min(threads, MEMORY_OF_COUNTS // size)))
        self._most = threads if is_own else tables
        self._tables = [np.zeros(shape, dtype=np.int64) for _ in range(tables)]
        self._included: np.ndarray | None = None

    def add(self, block: Block, states: np.ndarray, workers: Workers) -> None:
        """Count the samples of a block.

        Args:
            block: The block.
            states: State of each sample, shape [place, sample], the worst place last; of samples that are ok.
            workers: The threads.
        """
        rows = block.rows(self.cells)
        order, start, cell_of_unit = rows.units()
        cell_of_row = rows.cell_of_row.astype(np.int32)
        kernel, each = reductions.counts_kernel(), rows.rows_per_structure

        def count(first: int, last: int, thread: int) -> None:
            counts = self._tables[thread % len(self._tables)]
            block_arrays = block.status, states, cell_of_row, cell_of_unit, order, start, counts
            reductions.launch(kernel, first * each, last * each, rows.samples, *block_arrays)

        least = LEAST_SAMPLES // (rows.samples * each) + 1
        workers.share(count, 0, len(block.structures), least, self._most)

    def include(self, cells: np.ndarray, counts: np.ndarray) -> None:
        """Add counts of samples of some cells, each of which is named once, to those of samples that were added."""
        if self._included is None:
            self._included = np.zeros_like(self._tables[0])
        self._included[:, cells] += counts

    @property
    def counts(self) -> np.ndarray:
        """The counts, shape [place, cell, outcome]."""
        first, *others = self._tables
        while others:
            first += others.pop()
        self._tables = [first]
        return first if self._included is None else first + self._included


class Sums:
    """Sums of a demand and of its squares, and its largest value, by cell.

    The samples of a row are added in their order, with what rounding leaves out of each addition in a sum of its own;
    rows are added exactly, so that their order, blocks, threads and regions change nothing.

    Args:
        cells: The cells.
    """

    def __init__(self, cells: Cells) -> None:
        self.cells = cells
        check_fits_memory(cells, float(cells.count) * BYTES_PER_CELL)
        self.exact = ExactSums(cells.count)

    @property
    def totals(self) -> np.ndarray:
        """The sums as `ExactSums.totals` returns them."""
        return self.exact.totals

    def add(
        self, block: Block, demand: str, is_signed: bool, place: int, workers: Workers, rows: Rows | None = None
    ) -> None:
        """Add the samples of a block that are ok.

        Args:
            block: The block.
            demand: The demand.
            is_signed: Whether values are taken as they are; else the largest absolute one of all places.
            place: The place; -1 for the worst.
            workers: The threads.
            rows: How the samples go to cells; None for as the block's do.
        """
        rows = block.rows(self.cells) if rows is None else rows
        values, bad = block.demand(demand), np.full(workers.threads, -1, np.int32)
        cell_of_unit, unit = np.unique(rows.cell_of_place, return_inverse=True)
        cell_of_unit, unit = cell_of_unit.astype(np.int32), unit.astype(np.int32)
        cell_of_row = rows.cell_of_row.astype(np.int32)
        together = max(1, MEMORY_OF_SUMS // (8 * reductions.SUMS * cell_of_unit.size))
        sums = np.empty((min(together, cell_of_row.size), cell_of_unit.size, reductions.SUMS))
        of_samples, of_rows = reductions.sums_kernel(str(values.dtype)), exact_totals_kernel()
        for begin in range(0, cell_of_row.size, together):
            end = min(begin + together, cell_of_row.size)

            def add_samples(first: int, last: int, thread: int, begin: int = begin) -> None:
                how = first, last, begin, rows.samples, int(is_signed), place
                reductions.launch(of_samples, *how, block.status, values, unit, sums, bad, thread)

            def add_rows(first: int, last: int, thread: int, begin: int = begin, end: int = end) -> None:
                into = cell_of_row[begin:end], cell_of_unit, self.exact.bins, self.exact.largest
                reductions.launch(of_rows, first, last, sums[: end - begin], *into)

            workers.share(add_samples, begin, end, LEAST_SAMPLES // rows.samples + 1)
            workers.share(add_rows, 0, cell_of_unit.size, max(1, LEAST_SAMPLES // (end - begin)))
        refuse_bad(block, demand, bad)


def find_states(
    block: Block,
    demand: str,
    bounds: np.ndarray,
    kind: np.ndarray,
    states: np.ndarray,
    workers: Workers,
    *,
    each_place: bool = False,
    is_absolute: bool = False,
) -> None:
    """Raise the states of samples to the number of bounds that a demand, without its sign, is above.

    Args:
        block: The samples.
        demand: The demand.
        bounds: Its bounds, shape [kind, bound].
        kind: Which of them are those of each structure of the block.
        states: The states, shape [place, sample], the worst place last.
        workers: The threads.
        each_place: Whether states of every place are kept, besides the worst.
        is_absolute: Whether absolute values are taken; else a negative value is an error.

    Raises:
        ValueError: If a sample is ok and a demand of it is not finite, or a peak that is negative.
    """
    values, bad = magnitudes(demand, block.demand(demand)), np.full(workers.threads, -1, np.int32)
    samples = len(values) // len(block.structures)
    kernel, kind = reductions.states_kernel(str(values.dtype)), kind.astype(np.int32)

    half = 2 ** int(np.log2(bounds.shape[1]))  # the search is among 2^k - 1 bounds
    padded = np.full((len(bounds), 2 * half - 1), np.inf)
    padded[:, : bounds.shape[1]] = bounds
    flat = np.ascontiguousarray(values).ravel(), half, padded.ravel(), kind, states, bad

    def find(first: int, last: int, thread: int) -> None:
        how = samples, values.shape[1], int(is_absolute), int(each_place), block.status
        reductions.launch(kernel, first, last, *how, *flat, thread)

    workers.share(find, 0, len(block.structures), LEAST_SAMPLES // samples + 1)
    refuse_bad(block, demand, bad)


def refuse_bad(block: Block, demand: str, bad: np.ndarray) -> None:
    """Raise a ValueError if a sample that is ok has no valid demand, by the places of such samples; -1 is none."""
    if (bad < 0).all():
        return
    place = int(bad[bad >= 0][0])
    structure = int(block.structures[place // (len(block.status) // len(block.structures))])
    raise ValueError(
        f"a sample of structure {structure} is 'ok' but its {demand} is {block.demand(demand)[place].tolist()}; it "
        "must be finite, and a peak not negative"
    )


def check_fits_memory(cells: Cells, size: float) -> None:
    """Raise a MemoryError if the cells of a statistic do not fit in memory."""
    if size > free_memory("cpu"):
        each: Any = " x ".join(f"{count:,} {name}s" for name, count in zip(cells.dims, cells.shape, strict=True))
        raise MemoryError(
            f"a statistic over {each} takes {size / 1e9:.3g} GB, and {free_memory('cpu') / 1e9:.3g} GB of memory are "
            "free: take it over less"
        )
