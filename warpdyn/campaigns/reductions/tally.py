"""Counts of samples by cell and outcome, and sums of their demands, which are added up block by block.

A cell is one combination of indices along the dimensions of a statistic, such as (archetype, motion).
"""

from __future__ import annotations

import functools
import math
from collections.abc import Callable, Hashable, Mapping
from dataclasses import dataclass, field
from threading import RLock
from typing import Any

import numpy as np
import warp as wp

from warpdyn.campaigns.reductions.cells import Cells
from warpdyn.campaigns.reductions.limits import is_peak
from warpdyn.campaigns.reductions.rows import Rows
from warpdyn.campaigns.reductions.workers import LEAST_SAMPLES, Workers
from warpdyn.engine.kernels.queues import free_memory
from warpdyn.engine.kernels.reductions.exact_sums import BYTES_PER_CELL, ExactSums
from warpdyn.engine.kernels.reductions.sums import SUMS
from warpdyn.engine.kernels.reductions.table import reductions
from warpdyn.foundations.core.output_variables import DIVERGED, STATUS_MEANINGS

FAILURES = STATUS_MEANINGS[DIVERGED:]
ENOUGH_CELLS = 2**16  # number of cells of sums, including copies, that keeps all threads of a GPU busy
MEMORY_OF_COUNTS = 2**28  # bytes that the separate tables of counts of the threads may use


@dataclass(frozen=True, eq=False)
class Block:
    """Finished samples of some structures in one event, which are added to statistics.

    Args:
        structures: Numbers of the structures in the run.
        event: Number of the event.
        values: Variables of the samples by name, shape [sample, ...], sorted by structure. They are in the memory of
            the threads or the GPU that reduce them; only the motion index is on the host.
    """

    structures: np.ndarray
    event: int
    values: Mapping[str, Any]
    _shared: dict[Hashable, Any] = field(default_factory=dict)
    _lock: RLock = field(default_factory=RLock)

    def shared(self, name: Hashable, find: Callable[[], Any]) -> Any:
        """Return a value that several statistics need: the first call computes it by `find`, later calls reuse it."""
        with self._lock:
            if name not in self._shared:
                self._shared[name] = find()
            return self._shared[name]

    @property
    def status(self) -> Any:
        """Outcome (status code) of each sample, shape [sample]."""
        return self.values["status"]

    @property
    def samples(self) -> int:
        """Number of samples of the block."""
        return int(self.status.shape[0])

    def array_of_structures(self, workers: Workers, structures: np.ndarray) -> Any:
        """Return the structure number of each row of samples as an array that CPU threads or the GPU can read."""
        return self.shared(("structures", structures.size), lambda: workers.array(structures.astype(np.int32)))

    def demand(self, name: str) -> Any:
        """Return a demand of all samples, shape [sample, place]; places are storeys, floors, or a single one.

        The places of a floor spectrum are all pairs of a floor and a period, in this order.
        """
        values = self.values[name]
        return values if values.ndim == 2 else values.reshape((values.shape[0], math.prod(values.shape[1:])))

    def type_of(self, name: str) -> str:
        """Return the number type of a demand as text, such as "float32"."""
        dtype = self.values[name].dtype
        return str(np.dtype(dtype if isinstance(dtype, np.dtype) else wp.dtype_to_numpy(dtype)))

    def rows(self, cells: Cells) -> Rows:
        """Return the assignment of the block's samples to the cells of a statistic."""
        return cells.rows(self.structures, self.values["motion_index"] if cells.needs_motions else None, self.event)


def has_own_cells(cells: Cells) -> bool:
    """Return whether each structure has separate cells, i.e. "structure" or "building" is a dimension."""
    return cells.population.structure_dim in cells.dims


class Tally:
    """Numbers of samples by place (storey or floor), cell (such as archetype and motion) and outcome (such as a state).

    The outcomes are the states of a demand, such as damage states or bins, followed by the kinds of failures.

    Args:
        cells: Cells of the statistic.
        columns: Number of storeys or floors that are counted separately, plus 1 for the worst of all.
        states: Number of states; a sample below every bound is in the first state.

    Raises:
        MemoryError: If the counts do not fit in memory.
    """

    def __init__(self, cells: Cells, columns: int, states: int) -> None:
        self.cells, shape = cells, (columns, cells.count, states + len(FAILURES))
        size = 8.0 * np.prod(np.array(shape, dtype=float))
        check_fits_memory(cells, size)
        self._tables: dict[Workers, list[Any]] = {}
        self._size, self._shape = size, shape
        self._included: np.ndarray | None = None

    def add(self, block: Block, states: Any, workers: Workers) -> None:
        """Add the samples of a block to the counts.

        Args:
            block: The block.
            states: State of each sample that is ok, shape [place, sample]; the last place is the worst of all.
            workers: The CPU threads or the GPU that count.
        """
        rows = block.rows(self.cells)
        order, start, cell_of_unit = rows.places.units
        places = (workers.constant(values) for values in (cell_of_unit, order, start))
        given = workers.array(rows.cell.astype(np.int32)), *places
        tables, each = self._tables_of(workers), workers.units_of_part(cell_of_unit.size)

        def arguments(thread: int) -> tuple:
            return each, rows.samples, block.status, states, *given, tables[thread % len(tables)]

        # Each thread counts other structures. If each structure has separate cells, the threads share one table.
        most, least = 0 if has_own_cells(self.cells) else len(tables), LEAST_SAMPLES // rows.samples + 1
        parts = rows.structure.size * -(-cell_of_unit.size // each)
        workers.run(reductions().counts, 0, parts, arguments, least, most, rows.rows_per_structure)

    def _tables_of(self, workers: Workers) -> list[Any]:
        """Return the tables of counts: one shared table if each structure has separate cells, else several."""
        if workers not in self._tables:
            count = (
                1 if has_own_cells(self.cells) else int(max(1, min(workers.threads, MEMORY_OF_COUNTS // self._size)))
            )
            self._tables[workers] = [workers.kept(np.zeros(self._shape, dtype=np.int64)) for _ in range(count)]
        return self._tables[workers]

    def include(self, cells: np.ndarray, counts: np.ndarray) -> None:
        """Add counts from another reducer, shape [place, cell, outcome]; `cells` are the numbers of their cells."""
        if self._included is None:
            self._included = np.zeros(self._shape, dtype=np.int64)
        self._included[:, cells] += counts

    @property
    def counts(self) -> np.ndarray:
        """Number of samples of all blocks, shape [place, cell, outcome]."""
        found = [workers.read(table) for workers, tables in self._tables.items() for table in tables]
        found += [] if self._included is None else [self._included]
        return functools.reduce(np.add, found) if found else np.zeros(self._shape, dtype=np.int64)


class Sums:
    """Sum of a demand, sum of its squares and its largest value, by cell of a statistic.

    The samples of a row are added in their order, and a second sum contains the rounding errors of these additions.
    Rows are added exactly. Results are therefore bit-identical for any order of rows, and any division into blocks,
    threads and regions.

    Args:
        cells: Cells of the statistic.
    """

    def __init__(self, cells: Cells) -> None:
        self.cells = cells
        check_fits_memory(cells, float(cells.count) * BYTES_PER_CELL)
        self._sums: dict[Workers, tuple[Any, Any]] = {}
        self._included: ExactSums | None = None

    def add(
        self,
        block: Block,
        demand: str,
        is_signed: bool,
        place: int,
        workers: Workers,
        rows: Rows | None = None,
        counted: tuple[int, int] | None = None,
    ) -> None:
        """Add the demands of a block's samples to the sums, for samples with the status ok.

        Args:
            block: The block.
            demand: Name of the demand.
            is_signed: Whether values keep their sign; False: the largest absolute value over the places is used.
            place: Number of the storey or floor; -1: the worst of all.
            workers: The CPU threads or the GPU that add.
            rows: Assignment of the samples to cells; None: the assignment from `block.rows`.
            counted: Range (first, last + 1) of the places among which the worst is searched; None: all places.
        """
        rows = block.rows(self.cells) if rows is None else rows
        if workers not in self._sums:
            nothing = ExactSums.of_nothing(self.cells.count * self._copies(workers))
            self._sums[workers] = workers.kept(nothing.bins), workers.kept(nothing.largest)
        bad = workers.bad(demand)
        *by_cell, cell_of_unit = rows.places.cells
        units, cell_of_row = cell_of_unit.size, rows.cell.astype(np.int32)
        order, start, cell_of_unit = (workers.constant(values) for values in (*by_cell, cell_of_unit))
        structure = block.array_of_structures(workers, rows.structure)
        values = block.demand(demand)
        counted = counted or (0, int(values.shape[1]))
        how = rows.samples, int(is_signed), place, *counted, structure, block.status, values, order, start
        each, copies = workers.units_of_part(units), self._copies(workers)
        parts_of_row = -(-units // each)
        kernel, least_rows = reductions().sums[block.type_of(demand)], LEAST_SAMPLES // rows.samples + 1
        together = min(cell_of_row.size, max(1, workers.memory_of_sums // (8 * SUMS * units)))
        sums = workers.empty((together, units, SUMS), np.float64)
        for begin in range(0, cell_of_row.size, together):
            end = min(begin + together, cell_of_row.size)
            cells = cell_of_row[begin:end]
            rows_of_cells, first_of_cell, units_of_part = workers.groups(cells, units)
            given = [workers.array(values) for values in (rows_of_cells, first_of_cell)]
            into = units_of_part, copies, *given, sums, workers.array(cells), cell_of_unit, *self._sums[workers]
            parts = (first_of_cell.size - 1) * copies * -(-units // units_of_part)

            def of_samples(thread: int, begin: int = begin) -> tuple:
                return each, begin, *how, sums, bad, thread

            def of_rows(thread: int, into: tuple = into) -> tuple:
                return into

            workers.run(kernel, begin * parts_of_row, end * parts_of_row, of_samples, least_rows)
            least = max(1, LEAST_SAMPLES // ((end - begin) * units_of_part))
            workers.run(reductions().totals, 0, parts, of_rows, least)
        workers.refuse(demand, bad)

    def include(self, cells: np.ndarray, other: ExactSums) -> None:
        """Add sums from another reducer; `cells` are the (distinct) numbers of their cells."""
        if self._included is None:
            self._included = ExactSums.of_nothing(self.cells.count)
        self._included.include(cells, other)

    def _copies(self, workers: Workers) -> int:
        """Return the number of copies of the cells: several copies of few cells, so that all GPU threads can add."""
        if has_own_cells(self.cells):
            return 1
        return max(1, min(workers.copies_of_cells, ENOUGH_CELLS // self.cells.count))

    @property
    def exact(self) -> ExactSums:
        """The exact sums of all blocks, by cell."""
        found = [] if self._included is None else [self._included]
        for workers, arrays in self._sums.items():
            copies = (np.split(workers.read(array), self._copies(workers)) for array in arrays)
            found += [ExactSums(*copy) for copy in zip(*copies, strict=True)]
        if len(found) == 1:
            return found[0]
        total = ExactSums.of_nothing(self.cells.count)
        for each in found:
            total.include(slice(None), each)
        return total

    @property
    def totals(self) -> np.ndarray:
        """Shape [cell, 5]: sum, its rounding error, sum of squares, its rounding error, and largest value."""
        if not self._sums and self._included is None:
            return np.array([[0.0] * 4 + [-np.inf]]).repeat(self.cells.count, axis=0)
        return self.exact.totals


def searched(bounds: np.ndarray) -> np.ndarray:
    """Return bounds, shape [kind, bound], padded with infinity to 2^k - 1 bounds, as the binary search needs them."""
    padded = np.full((len(bounds), 2 * 2 ** int(np.log2(bounds.shape[1])) - 1), np.inf)
    padded[:, : bounds.shape[1]] = bounds
    return padded


def find_states(
    block: Block,
    demand: str,
    bounds: np.ndarray,
    kind: np.ndarray,
    states: Any,
    workers: Workers,
    *,
    counted: tuple[int, int] | None = None,
    each_place: bool = False,
    is_absolute: bool = False,
) -> None:
    """Set the state of each sample to the number of bounds that its demand exceeds, unless the state is already higher.

    Args:
        block: The samples.
        demand: Name of the demand.
        bounds: Bounds of the states, from `searched`, shape [kind, bound].
        kind: Row of `bounds` that applies to each structure of the block, shape [structure].
        states: The states, which are changed, shape [place, sample]; the last place is the worst of all.
        workers: The CPU threads or the GPU that compute the states.
        counted: Range (first, last + 1) of the places among which the worst is searched; None: all places.
        each_place: Whether the states of every place (storey or floor) are set, in addition to the worst.
        is_absolute: Whether absolute values of a peak are compared; False: a negative peak is an error. For demands
            that are not peaks, absolute values are always compared.

    Raises:
        ValueError: If a sample with the status ok has a demand that is not finite, or a negative peak.
    """
    values, bad = block.demand(demand), workers.bad(demand)
    structures = len(block.structures)
    samples, places = block.samples // structures, int(values.shape[1])
    half = (bounds.shape[1] + 1) // 2
    rows = samples // workers.units_of_part(samples)  # number of rows of a structure; a thread processes one row
    counted = counted or (0, places)
    how = samples // rows, rows, places, *counted, int(is_absolute or not is_peak(demand)), int(each_place)
    structure, kind = block.array_of_structures(workers, block.structures), workers.array(kind.astype(np.int32))
    flat = values.reshape((block.samples * places,))
    given = (
        *how,
        structure,
        block.status,
        flat,
        half,
        workers.constant(bounds).reshape((bounds.size,)),
        kind,
        states,
        bad,
    )

    def arguments(thread: int) -> tuple:
        return *given, thread

    kernel = reductions().states[block.type_of(demand)]
    workers.run(kernel, 0, structures * rows, arguments, LEAST_SAMPLES // samples + 1)
    workers.refuse(demand, bad)


def check_fits_memory(cells: Cells, size: float) -> None:
    """Raise a MemoryError if `size` bytes for the cells of a statistic do not fit in the free memory of the host."""
    if size > free_memory("cpu"):
        each: Any = " x ".join(f"{count:,} {name}s" for name, count in zip(cells.dims, cells.shape, strict=True))
        raise MemoryError(
            f"a statistic over {each} takes {size / 1e9:.3g} GB, but {free_memory('cpu') / 1e9:.3g} GB of memory are "
            "free: name fewer dimensions in over="
        )
