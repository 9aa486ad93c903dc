"""Base class of the reducers of statistics."""

from __future__ import annotations

from abc import ABC, abstractmethod
from collections.abc import Sequence
from copy import copy
from typing import Self

import numpy as np

from warpdyn.campaigns.integration.dynamics import Arrays
from warpdyn.campaigns.reductions.cells import Cells, Coordinates, Variables
from warpdyn.campaigns.reductions.tally import Block, Sums, Tally
from warpdyn.campaigns.reductions.workers import Workers
from warpdyn.engine.kernels.reductions.exact_sums import ExactSums


class Reducer(ABC):
    """Adds the blocks of a run, in any order, to a statistic by cell, for all or some structures of the run.

    Counts are added as whole numbers, and sums exactly, so that the bits do not depend on the parts or on their order.

    Attributes:
        cells: The cells.
        needs: Names of the variables of the samples that are read, in addition to the status.
        tally: Counts by cell; they include every sample of the sums.
    """

    cells: Cells
    needs: frozenset[str]
    tally: Tally

    @abstractmethod
    def begin(self, cells: Cells) -> None:
        """Start with empty counts and sums of these cells."""

    @abstractmethod
    def add(self, block: Block, workers: Workers) -> None:
        """Add the samples of a block."""

    @abstractmethod
    def variables(self) -> tuple[Variables, Coordinates]:
        """Return the variables of the statistic and the coordinates of their dimensions."""

    @property
    def sums_by_cell(self) -> Sequence[Sums]:
        """All sums by cell, in addition to the counts."""
        return ()

    def of_structures(self, structures: np.ndarray) -> Self:
        """Return a reducer for only some structures, given by their increasing numbers."""
        part = copy(self)
        part.begin(self.cells.of_structures(structures))
        return part

    def partial(self) -> Arrays:
        """Return the counts and sums of all cells that contain samples."""
        counts = self.tally.counts
        cells = np.flatnonzero(counts.any(axis=(0, 2)))
        own = counts[:, cells]
        # Most counts of a region are small: return them in the smallest sufficient integer type.
        numbers = self.cells.of_run(cells).astype(np.int32)
        found = {"cells": numbers, "counts": own.astype(np.min_scalar_type(own.max(initial=0)))}
        for place, sums in enumerate(self.sums_by_cell):
            own_sums = sums.exact.of_cells(cells)
            found |= {f"bins_{place}": own_sums.bins, f"largest_{place}": own_sums.largest}
        return found

    def include(self, part: Arrays) -> None:
        """Add a result of `partial` for structures that are not counted yet."""
        self.tally.include(part["cells"], part["counts"])
        self.include_sums(part)

    def include_sums(self, part: Arrays) -> None:
        """Add the sums by cell in a result of `partial`."""
        for place, sums in enumerate(self.sums_by_cell):
            sums.include(part["cells"], ExactSums(part[f"bins_{place}"], part[f"largest_{place}"]))
