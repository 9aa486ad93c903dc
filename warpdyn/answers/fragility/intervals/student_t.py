"""Intervals of any estimate by a jackknife with Student's t."""

from __future__ import annotations

import numpy as np
from numpy.typing import ArrayLike
from scipy.special import stdtrit


def jackknife_half_width(left: ArrayLike, confidence: float) -> np.ndarray:
    """Return half the widths of the intervals of estimates, of shape [...]; NaN for fewer than 2 parts.

    Args:
        left: The estimates without one part of the samples at a time, such as one motion, shape [part, ...].
        confidence: Probability that the intervals cover the true value [1].
    """
    estimates = np.asarray(left, dtype=np.float64)
    parts = len(estimates)
    if parts < 2:
        return np.full(estimates.shape[1:], np.nan)
    spread = ((estimates - estimates.mean(axis=0)) ** 2).sum(axis=0)
    half: np.ndarray = stdtrit(parts - 1, 0.5 + 0.5 * confidence) * np.sqrt((parts - 1) / parts * spread)
    return half
