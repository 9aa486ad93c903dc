"""Base class of the reducers, which add the samples of a run to a statistic."""

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
    """Base class: adds blocks of samples to a statistic, for all or some structures of a run.

    A cell is one combination of indices along the dimensions of the statistic, such as (archetype, motion). Samples are
    counted in whole numbers and summed exactly, so that results are bit-identical for any order and division of blocks.

    Attributes:
        cells: The cells of the statistic.
        needs: Names of the variables of samples that are needed, in addition to the status.
        tally: Numbers of samples by cell and outcome; every sample of the sums is counted.
    """

    cells: Cells
    needs: frozenset[str]
    tally: Tally

    @abstractmethod
    def begin(self, cells: Cells) -> None:
        """Start with empty counts and sums for the given cells of the statistic."""

    @abstractmethod
    def add(self, block: Block, workers: Workers) -> None:
        """Add the samples of a block (structures of a run that are integrated together) to the counts and sums."""

    @abstractmethod
    def variables(self) -> tuple[Variables, Coordinates]:
        """Return the variables of the statistic, and the coordinates of their dimensions, for the dataset."""

    @property
    def sums_by_cell(self) -> Sequence[Sums]:
        """All sums by cell that the reducer computes in addition to the counts."""
        return ()

    def of_structures(self, structures: np.ndarray) -> Self:
        """Return an empty reducer of the same statistic for some structures, given by increasing numbers."""
        part = copy(self)
        part.begin(self.cells.of_structures(structures))
        return part

    def partial(self) -> Arrays:
        """Return counts and sums of all cells of the statistic that contain samples, by name, for `include`."""
        counts = self.tally.counts
        cells = np.flatnonzero(counts.any(axis=(0, 2)))
        own = counts[:, cells]
        # Most counts of a region are small, so they are returned in the smallest sufficient integer type.
        numbers = self.cells.of_run(cells).astype(np.int32)
        found = {"cells": numbers, "counts": own.astype(np.min_scalar_type(own.max(initial=0)))}
        for place, sums in enumerate(self.sums_by_cell):
            own_sums = sums.exact.of_cells(cells)
            found |= {f"bins_{place}": own_sums.bins, f"largest_{place}": own_sums.largest}
        return found

    def include(self, part: Arrays) -> None:
        """Add a result of `partial` from another reducer, for structures that this reducer has not counted yet."""
        self.tally.include(part["cells"], part["counts"])
        self.include_sums(part)

    def include_sums(self, part: Arrays) -> None:
        """Add only the sums by cell from a result of `partial`."""
        for place, sums in enumerate(self.sums_by_cell):
            sums.include(part["cells"], ExactSums(part[f"bins_{place}"], part[f"largest_{place}"]))
