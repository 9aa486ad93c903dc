"""Record and structure of each observation, and the parts that the jackknife leaves out."""

from __future__ import annotations

from dataclasses import dataclass
from functools import cached_property

import numpy as np

from warpdyn.answers.fragility.intervals.jackknife import LeftOut, interaction_variance
from warpdyn.answers.fragility.stripe_counts import structure_groups

MOST_PARTS = 256  # in which records are left out; more would not make the variance more precise


@dataclass(frozen=True, eq=False)
class Observations:
    """Record and structure of each observation.

    Args:
        record: Number of the record of each observation, shape [observation].
        structure: Number of its structure.
        sampling: Sampling of the structures, as `Scene.sampling`; "" if unknown.
        over_structures: Whether intervals are over structures too.
    """

    record: np.ndarray
    structure: np.ndarray
    sampling: str = ""
    over_structures: bool = True

    @cached_property
    def records(self) -> int:
        """Number of records."""
        return int(self._record.max()) + 1

    @cached_property
    def _record(self) -> np.ndarray:
        return np.unique(self.record, return_inverse=True)[1]

    @cached_property
    def _grouped(self) -> tuple[int, np.ndarray]:
        """Number of groups of structures (0 if only records are left out), and the group of each observation."""
        crossed, count, group = structure_groups(self.structure, self._record, self.records, self.sampling)
        return (count, group) if crossed and count > 1 and self.over_structures else (0, np.zeros_like(self._record))

    @property
    def groups(self) -> int:
        """Number of groups of structures; 0 if only records are left out."""
        return self._grouped[0]

    @property
    def parts(self) -> int:
        """Number of parts in which records are left out: one record each, or several if there are very many."""
        return min(self.records, MOST_PARTS)

    @cached_property
    def weights(self) -> np.ndarray:
        """Weights [row, observation]: all, without each part of the records, without each group of structures."""
        whole = np.ones((1, self._record.size))
        if self.records < 2:
            return whole
        groups, group = self._grouped
        part = self._record % self.parts
        without = [part != np.arange(self.parts)[:, None], group != np.arange(groups)[:, None]]
        return np.concatenate([whole, *without]).astype(np.float64)

    def split(self, values: np.ndarray) -> tuple[np.ndarray, np.ndarray, np.ndarray]:
        """Return values of all, without each part of the records, and without each group of structures."""
        last = 1 if self.records < 2 else 1 + self.parts
        return values[0], values[1:last], values[last:]

    def left_out(self, logarithms: np.ndarray, influences: np.ndarray, independent: np.ndarray) -> LeftOut:
        """Return the fits for all rows of weights, for the jackknife.

        Args:
            logarithms: ln of median and dispersion, shape [row, 2, damage_state].
            influences: Contribution of each observation to them, shape [observation, 2, damage_state].
            independent: Their variances if all observations were independent, shape [2, damage_state].
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
