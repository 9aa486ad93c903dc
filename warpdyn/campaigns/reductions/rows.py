"""Rows of samples: the samples of a structure (or of one draw), which are assigned to cells of a statistic together."""

from __future__ import annotations

from dataclasses import dataclass
from functools import cache, cached_property

import numpy as np


@dataclass(frozen=True, eq=False)
class Places:
    """Cell and unit of each sample of a row by its position (place) in the row; they are the same in all rows.

    A row contains the samples of a structure or of one draw. A unit contains one or several samples; only the worst of
    them counts.

    Args:
        cell: Number of the cell of each place, minus the number of the cell of the row, shape [place].
        unit: Number of the unit of each place, shape [place]. Only the worst sample of a unit counts, for example of
            the two components of a record.
    """

    cell: np.ndarray
    unit: np.ndarray

    @cached_property
    def units(self) -> tuple[np.ndarray, np.ndarray, np.ndarray]:
        """Three arrays: positions sorted by unit, start of each unit among them (and the end), cell of each unit."""
        order, start, _ = in_order_of(self.unit)
        return order, start, self.cell[order[start[:-1]]].astype(np.int32)

    @cached_property
    def of_units(self) -> Places:
        """The Places of a row that has one position for each unit instead of each sample."""
        cell = self.units[-1]
        return Places(cell, np.arange(cell.size))

    @cached_property
    def cells(self) -> tuple[np.ndarray, np.ndarray, np.ndarray]:
        """Three arrays: positions sorted by cell, start of each cell among them (and the end), and the cells."""
        order, start, which = in_order_of(self.cell)
        return order, start, which.astype(np.int32)


def in_order_of(numbers: np.ndarray) -> tuple[np.ndarray, np.ndarray, np.ndarray]:
    """Return three arrays: indices that sort numbers, starts of equal numbers in this order, distinct numbers.

    Returns:
        Indices that sort the numbers; start of each distinct number in this order, and the end of the last one; the
        distinct numbers.
    """
    order = np.argsort(numbers, kind="stable").astype(np.int32)
    which, start = np.unique(numbers[order], return_index=True)
    return order, np.append(start, numbers.size).astype(np.int32), which


@cache
def one_unit(count: int) -> Places:
    """Return the Places of a row of `count` samples that count as one unit: one sample, or all components of a draw."""
    none = np.zeros(count, dtype=np.int64)
    return Places(none, none)


@dataclass(frozen=True, eq=False)
class Rows:
    """Assignment of the samples of a block to the cells of a statistic.

    The number of a sample's cell is the number of its row's cell plus the offset of its position in the row.

    Args:
        rows_per_structure: Number of rows of a structure. A row contains all samples of a structure. If samples differ
            in their motions, a row contains one sample, or one draw of MotionsAtSites.
        structure: Number of each row's structure in the run, shape [row].
        cell: Number of each row's cell, shape [row].
        places: Places of the samples within a row.
    """

    rows_per_structure: int
    structure: np.ndarray
    cell: np.ndarray
    places: Places

    @property
    def samples(self) -> int:
        """Number of samples in a row."""
        return self.places.cell.size
