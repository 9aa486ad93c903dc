"""Rows of samples, which are assigned to cells together."""

from __future__ import annotations

from dataclasses import dataclass
from functools import cache, cached_property

import numpy as np


@dataclass(frozen=True, eq=False)
class Places:
    """The places of samples in a row, which are the same in all rows.

    Args:
        cell: Offset of each place's cell from the cell of the row, shape [place].
        unit: Unit of each place, shape [place]; only the worst sample of a unit counts.
    """

    cell: np.ndarray
    unit: np.ndarray

    @cached_property
    def units(self) -> tuple[np.ndarray, np.ndarray, np.ndarray]:
        """The places unit by unit, where each unit starts among them, and the cell of each unit."""
        order, start, _ = in_order_of(self.unit)
        return order, start, self.cell[order[start[:-1]]].astype(np.int32)

    @cached_property
    def of_units(self) -> Places:
        """The units of a row as places."""
        cell = self.units[-1]
        return Places(cell, np.arange(cell.size))

    @cached_property
    def cells(self) -> tuple[np.ndarray, np.ndarray, np.ndarray]:
        """The places cell by cell, where each cell starts among them, and the cells."""
        order, start, which = in_order_of(self.cell)
        return order, start, which.astype(np.int32)


def in_order_of(numbers: np.ndarray) -> tuple[np.ndarray, np.ndarray, np.ndarray]:
    """Return the order that sorts numbers, the start of each distinct number in it (and its end), and these numbers."""
    order = np.argsort(numbers, kind="stable").astype(np.int32)
    which, start = np.unique(numbers[order], return_index=True)
    return order, np.append(start, numbers.size).astype(np.int32), which


@cache
def one_unit(count: int) -> Places:
    """Return a row of `count` samples that are counted as one: a single sample, or the components of a draw."""
    none = np.zeros(count, dtype=np.int64)
    return Places(none, none)


@dataclass(frozen=True, eq=False)
class Rows:
    """The assignment of the samples of a block to cells.

    The cell of a sample is the cell of its row plus the offset of its place in the row.

    Args:
        rows_per_structure: Number of rows of a structure. A row contains all samples of a structure or, if motions
            differ from sample to sample, one sample or one draw.
        structure: Number of each row's structure in the run.
        cell: Cell of each row, shape [row].
        places: The places of samples in a row.
    """

    rows_per_structure: int
    structure: np.ndarray
    cell: np.ndarray
    places: Places

    @property
    def samples(self) -> int:
        """Samples of a row."""
        return self.places.cell.size
