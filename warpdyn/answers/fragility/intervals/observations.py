"""Record and structure of each observation, and the groups of observations that a jackknife leaves out."""

from __future__ import annotations

from dataclasses import dataclass
from functools import cached_property

import numpy as np

from warpdyn.answers.fragility.intervals.jackknife import LeftOut, interaction_variance
from warpdyn.answers.fragility.stripe_counts import structure_groups

MOST_PARTS = 256  # largest number of groups of records that are left out; more do not make the variance more precise


@dataclass(frozen=True, eq=False)
class Observations:
    """Record and structure of each observation (a capacity or a sample of a cloud), for a jackknife.

    Args:
        record: Index of the record of each observation, shape [observation].
        structure: Index of the structure of each observation, shape [observation].
        sampling: Sampling method of the structures, see `Scene.sampling`; "" if it is unknown.
        over_structures: Whether intervals include the variability among structures.
    """

    record: np.ndarray
    structure: np.ndarray
    sampling: str = ""
    over_structures: bool = True

    @cached_property
    def records(self) -> int:
        """Number of different records among the observations."""
        return int(self._record.max()) + 1

    @cached_property
    def _record(self) -> np.ndarray:
        return np.unique(self.record, return_inverse=True)[1]

    @cached_property
    def _grouped(self) -> tuple[int, np.ndarray]:
        """Number of groups of structures (0 if only records are left out), and the group index of each observation."""
        crossed, count, group = structure_groups(self.structure, self._record, self.records, self.sampling)
        return (count, group) if crossed and count > 1 and self.over_structures else (0, np.zeros_like(self._record))

    @property
    def groups(self) -> int:
        """Number of groups of structures; 0 if only records are left out."""
        return self._grouped[0]

    @property
    def parts(self) -> int:
        """Number of fits that leave out records: the number of records or, above MOST_PARTS, of groups of records."""
        return min(self.records, MOST_PARTS)

    @cached_property
    def weights(self) -> np.ndarray:
        """Weights of the observations for each fit, shape [row, observation].

        The first row is the fit to all observations. The next rows leave out each part of the records, the last rows
        each group of structures.
        """
        whole = np.ones((1, self._record.size))
        if self.records < 2:
            return whole
        groups, group = self._grouped
        part = self._record % self.parts
        without = [part != np.arange(self.parts)[:, None], group != np.arange(groups)[:, None]]
        return np.concatenate([whole, *without]).astype(np.float64)

    def split(self, values: np.ndarray) -> tuple[np.ndarray, np.ndarray, np.ndarray]:
        """Return the values [row, ...] of all fits in three arrays: all samples, without records, without groups."""
        last = 1 if self.records < 2 else 1 + self.parts
        return values[0], values[1:last], values[last:]

    def left_out(self, logarithms: np.ndarray, influences: np.ndarray, independent: np.ndarray) -> LeftOut:
        """Return the fits for all rows of weights in the form that the jackknife uses.

        Args:
            logarithms: ln(median) and ln(dispersion) of each fit, shape [row, 2, damage_state].
            influences: Contribution of each observation to both logarithms, shape [observation, 2, damage_state].
            independent: Variances of both logarithms if all observations were independent, shape [2, damage_state].
        """
        whole, records, without_groups = self.split(logarithms)
        groups, group = self._grouped
        interaction, of_records = np.zeros_like(whole), np.zeros((self.records, *whole.shape))
        np.add.at(of_records, self._record, influences)
        if groups:
            cells = np.zeros((self.parts, groups, *influences.shape[1:]))
            np.add.at(cells, (self._record % self.parts, group), influences)
            interaction = interaction_variance(cells)
        return LeftOut(whole, records, without_groups, interaction, independent, of_records)
