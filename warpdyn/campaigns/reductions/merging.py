"""Contributions of some structures to a statistic, which one process returns and another process adds."""

from __future__ import annotations

from collections.abc import Sequence
from copy import copy
from typing import Self

import numpy as np

from warpdyn.campaigns.integration.dynamics import Arrays
from warpdyn.campaigns.reductions.cells import Cells
from warpdyn.campaigns.reductions.tally import Sums, Tally
from warpdyn.engine.kernels.reductions.exact_sums import ExactSums


class Mergeable:
    """A reducer of samples by cell, of all or some structures of a run.

    Counts are added as whole numbers, and sums exactly, so that neither the parts nor their order change a bit.

    Attributes:
        cells: The cells.
        tally: Counts by cell, in which every sample is counted that is in a sum.
    """

    cells: Cells
    tally: Tally

    def begin(self, cells: Cells) -> None:
        """Begin to count in these cells."""
        raise NotImplementedError

    @property
    def sums_by_cell(self) -> Sequence[Sums]:
        """All sums by cell, besides the counts."""
        return ()

    def of_structures(self, structures: np.ndarray) -> Self:
        """Return what counts the samples of some structures alone, given by their numbers, which increase."""
        part = copy(self)
        part.begin(self.cells.of_structures(structures))
        return part

    def partial(self) -> Arrays:
        """Return what has been counted, of the cells that samples were counted in."""
        counts = self.tally.counts
        cells = np.flatnonzero(counts.any(axis=(0, 2)))
        own = counts[:, cells]
        # Most counts of a region's cells are small: they travel as the least integers that hold them.
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
