"""Variance of an estimate of subset simulation, from groups of samples with a common ancestor."""

from __future__ import annotations

import numpy as np

GENERATIONS = 2  # samples of a level are dependent if they descend from one chain at most this many levels before


class AncestralVariance:
    """Sum of the contributions of all levels to the variance of ln(probability).

    The deviation of the sample j in level i is d_ij = (indicator - p_i) / (N p_i), where p_i is the level's conditional
    probability and N its number of samples. Samples depend on each other within a chain, and if their chains have a
    common ancestor. The covariance of levels i <= k is therefore the sum, over the chains c of the level max(i - 2, 0),
    of (sum of d_ij over descendants of c) (sum of d_kj over descendants of c).

    Args:
        samples: Number of samples of a level.
    """

    def __init__(self, samples: int) -> None:
        self.samples = samples
        self._sums: list[list[np.ndarray]] = []  # for each level: sums over the chains of each level until then

    def add(self, is_below: np.ndarray, ancestors: list[np.ndarray]) -> float:
        """Add a level; return the coefficient of variation of its conditional probability.

        Args:
            is_below: Whether the value of each sample is below the threshold, shape [sample].
            ancestors: Chain of this and of each earlier level from which each sample descends, shape [sample] each.
        """
        probability = is_below.mean()
        deviation = (is_below - probability) / (self.samples * probability)
        self._sums.append([np.bincount(each, deviation, minlength=self.samples) for each in ancestors])
        own = self._sums[-1][max(0, len(ancestors) - 1 - GENERATIONS)]
        return float(np.sqrt((own**2).sum()))

    @property
    def coefficient_of_variation(self) -> float:
        """Coefficient of variation of the product of all conditional probabilities [1]."""
        total = least = 0.0
        for level, sums in enumerate(self._sums):
            common = max(0, level - GENERATIONS)
            least += float((sums[-1] ** 2).sum())
            for later in self._sums[level:]:
                share = float((sums[common] * later[common]).sum())
                total += share if later is sums else 2 * share
        # Negative sums of few chains can make the total too small. A quarter of the variance of independent levels is
        # a bound below every estimate that is not due to such chance.
        return float(np.sqrt(max(total, least / 4)))
