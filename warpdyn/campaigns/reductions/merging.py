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
    """A reducer that counts and adds samples by cell, for all or some structures of a run.

    Counts are added as whole numbers, and sums exactly, so that the bits do not depend on the parts or on their order.

    Attributes:
        cells: The cells.
        tally: Counts by cell; they include every sample of the sums.
    """

    cells: Cells
    tally: Tally

    def begin(self, cells: Cells) -> None:
        """Start with empty counts and sums of these cells."""
        raise NotImplementedError

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
