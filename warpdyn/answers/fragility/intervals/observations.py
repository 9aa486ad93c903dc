"""Which record and structure observations are of, and what the jackknife leaves out of them one after the other."""

from __future__ import annotations

from dataclasses import dataclass
from functools import cached_property

import numpy as np

from warpdyn.answers.fragility.intervals.jackknife import LeftOut, interaction_variance
from warpdyn.answers.fragility.stripe_counts import structure_groups

MOST_PARTS = 256  # that records are left out in; more would make the variance no better known


@dataclass(frozen=True, eq=False)
class Observations:
    """Which record and which structure each observation is of.

    Args:
        record: Number of the record of each observation, shape [observation].
        structure: Number of its structure.
        sampling: How structures were sampled, as `Scene.sampling`; "" where that is unknown.
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
        """Number of groups of structures (0 where the records tell all), and the group of each observation."""
        crossed, count, group = structure_groups(self.structure, self._record, self.records, self.sampling)
        return (count, group) if crossed and count > 1 and self.over_structures else (0, np.zeros_like(self._record))

    @property
    def groups(self) -> int:
        """Number of groups of structures; 0 where the records tell all."""
        return self._grouped[0]

    @property
    def parts(self) -> int:
        """Number of parts that records are left out in: each by itself, or of very many some at once."""
        return min(self.records, MOST_PARTS)

    @cached_property
    def weights(self) -> np.ndarray:
        """Weights of the observations: all, without each part of the records, without each group of structures.

        Their shape is [row, observation].
        """
        whole = np.ones((1, self._record.size))
        if self.records < 2:
            return whole
        groups, group = self._grouped
        part = self._record % self.parts
        without = [part != np.arange(self.parts)[:, None], group != np.arange(groups)[:, None]]
        return np.concatenate([whole, *without]).astype(np.float64)

    def split(self, values: np.ndarray) -> tuple[np.ndarray, np.ndarray, np.ndarray]:
        """Return what belongs to all, to those without each part of the records, and to those without each group."""
        last = 1 if self.records < 2 else 1 + self.parts
        return values[0], values[1:last], values[last:]

    def left_out(self, logarithms: np.ndarray, influences: np.ndarray, independent: np.ndarray) -> LeftOut:
        """Return the fits of all rows of weights, for the jackknife.

        Args:
            logarithms: ln of median and dispersion, shape [row, 2, damage_state].
            influences: What each observation adds to them, shape [observation, 2, damage_state].
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
