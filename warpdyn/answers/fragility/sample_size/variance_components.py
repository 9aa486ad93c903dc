"""Variances of capacities among motions and among structures, and the numbers of both that a precision needs."""

from __future__ import annotations

import math
from dataclasses import dataclass

import numpy as np
import xarray as xr
from scipy.special import stdtrit

MOST_STRUCTURES = 256  # largest number of structures per motion
SAFETY = 0.95  # predicted interval divided by the required interval, because variances are estimates
# If records limit the precision, structures are added until the variance that they cause is this share of the variance
# among records (which makes the interval 2.5 % wider than with any number of structures).
LEAST_SHARE = 0.05
MOST_RECORDS = 10**6  # largest number of records that is reported as needed


@dataclass(frozen=True, eq=False)
class Variances:
    """Variances of ln(capacity) among motions and among structures, for each damage state.

    Args:
        among: Variance among motions, shape [damage_state].
        within: Variance among the structures of one motion, including the uncertainty within brackets, shape
            [damage_state].
        motions: Number of motions.
        confidence: Probability that an interval covers the true value [1].
    """

    among: np.ndarray
    within: np.ndarray
    motions: int
    confidence: float

    def half_width(self, structures: float) -> np.ndarray:
        """Return half the width of the interval of ln(median), shape [damage_state], for `structures` per motion."""
        return self._quantile * np.sqrt((self.among + self.within / structures) / self.motions)

    def structures_for(self, half_width: float) -> tuple[int, np.ndarray]:
        """Return the number of structures per motion that an interval needs, and which states the records limit.

        If the records limit the precision, structures are added only as long as they reduce the interval noticeably.

        Args:
            half_width: Half the required width of the interval of ln(median).

        Returns:
            The number of structures; whether the records limit the precision of each state, shape [damage_state].
        """
        with np.errstate(divide="ignore", invalid="ignore"):
            left = (SAFETY * half_width / self._quantile) ** 2 * self.motions - self.among
            by_precision = np.where(left > 0, self.within / left, np.inf)
            by_records = self.within / (LEAST_SHARE * self.among)
        needed = np.fmin(by_precision, by_records)
        most = np.max(np.where(np.isfinite(needed), needed, 1.0), initial=1.0)
        return int(np.clip(math.ceil(most), 1, MOST_STRUCTURES)), self.half_width(math.inf) > half_width

    @property
    def _quantile(self) -> float:
        return float(stdtrit(self.motions - 1, 0.5 + 0.5 * self.confidence))


def variances_of(capacities: xr.Dataset, confidence: float) -> Variances:
    """Return the variances of capacities with two or more structures for each motion, by an analysis of variance.

    Source: Searle, Casella and McCulloch (1992), Variance Components, section 3.6 (balanced data, one-way).

    Args:
        capacities: Result of `capacities` for a design with separate structures for each motion.
        confidence: Probability that an interval covers the true value [1].
    """
    with np.errstate(invalid="ignore"):
        logarithm = np.log(capacities["capacity"].transpose("structure", "motion", "damage_state").values)
    known = np.isfinite(logarithm).all(axis=0)  # motions under which every structure exceeds the limit
    among, within = np.zeros(known.shape[1]), np.zeros(known.shape[1])
    for state, of_state in enumerate(known.T):
        values = logarithm[:, of_state, state]
        if values.shape[1] < 2:
            continue
        within[state] = values.var(axis=0, ddof=1).mean()
        among[state] = max(values.mean(axis=0).var(ddof=1) - within[state] / len(values), 0.0)
    return Variances(among, within, capacities.sizes["motion"], confidence)


def records_for(half_width: float, variance: np.ndarray, confidence: float) -> np.ndarray:
    """Return the number of motions that an interval of ln(median) needs, shape [damage_state]; 0 if unknown.

    Args:
        half_width: Half the required width of the interval of ln(median).
        variance: Variance of ln(capacity) that one motion contributes, shape [damage_state]; NaN if unknown.
        confidence: Probability that the interval covers the true value [1].
    """
    count = np.arange(3, 2000)
    factor = stdtrit(count - 1, 0.5 + 0.5 * confidence) / np.sqrt(count)
    enough = factor[:, None] * np.sqrt(variance) <= half_width
    few = np.where(enough.any(axis=0), count[enough.argmax(axis=0)], 0)
    many = np.ceil((stdtrit(count[-1], 0.5 + 0.5 * confidence) / half_width) ** 2 * np.nan_to_num(variance))
    needed = np.where(few > 0, few, np.minimum(many, MOST_RECORDS)).astype(np.int64)
    return np.where(np.isnan(variance), 0, needed)
