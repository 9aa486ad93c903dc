"""Weights of samples: normalisation, effective sample size and systematic resampling."""

from __future__ import annotations

import numpy as np


def normalised(log_weights: np.ndarray) -> tuple[np.ndarray, float]:
    """Return weights with sum 1, and the logarithm of the mean of the given weights (-inf: all weights are 0).

    Args:
        log_weights: Logarithms of weights, shape [sample]; -inf for a weight of 0.
    """
    highest = float(np.max(log_weights))
    if not np.isfinite(highest):
        return np.full(log_weights.size, 1.0 / log_weights.size), -np.inf
    weights = np.exp(log_weights - highest)
    total = float(weights.sum())
    return weights / total, highest + float(np.log(total / log_weights.size))


def effective_sample_size(weights: np.ndarray) -> float:
    """Return 1 / sum of w^2 for weights w with sum 1: the number of equal weights with the same variance [1]."""
    return float(1.0 / np.sum(np.square(weights)))


def systematic(weights: np.ndarray, uniform: float, count: int | None = None) -> np.ndarray:
    """Return the indices of the resampled samples: systematic resampling.

    Sample j is taken as often as points (i + uniform) / N fall between the cumulative weights before and after it.

    Args:
        weights: Weights with sum 1, shape [sample].
        uniform: Random number from 0 to below 1, common to all points.
        count: Number N of resampled samples; None: as many as there are weights.
    """
    count = weights.size if count is None else count
    points = (np.arange(count) + uniform) / count
    ends = np.cumsum(weights)
    return np.minimum(np.searchsorted(ends / ends[-1], points, side="right"), weights.size - 1)


def family_variance(weights: np.ndarray, ancestors: np.ndarray, values: np.ndarray | None = None) -> np.ndarray:
    """Return the variance of an estimate from its families of samples, which have one common first ancestor.

    Families are independent, so the spread of their sums is that of the estimate (Chan and Lai 2013, Annals of
    Statistics 41; Lee and Whiteley 2018, Biometrika 105). It includes the correlation of samples that copies and
    incomplete moves cause.

    Args:
        weights: Weights with sum 1, shape [sample].
        ancestors: Index of the first ancestor of each sample, shape [sample].
        values: Values whose weighted mean is the estimate, shape [sample, value]. None: the estimate is the evidence,
            and the result is its relative variance, shape [].
    """
    count = weights.size
    if values is None:
        shares = np.bincount(ancestors, weights, count)
        return np.maximum(np.sum(np.square(shares)) - 1.0 / count, 0.0)
    centred = weights[:, None] * (values - weights @ values)
    sums = np.stack([np.bincount(ancestors, column, count) for column in centred.T], axis=1)
    return np.sum(np.square(sums), axis=0)
