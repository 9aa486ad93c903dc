"""Intervals of the fractions of samples that exceed a damage state, for samples that share records and structures."""

from __future__ import annotations

import numpy as np
from scipy.special import betaincinv, stdtrit

from warpdyn.answers.fragility.intervals.jackknife import (
    interaction_variance,
    leaves_out_structures,
    spread_of,
    without_each,
)
from warpdyn.answers.fragility.stripe_counts import StripeCounts


def clopper_pearson(exceeding: np.ndarray, total: np.ndarray, confidence: float) -> tuple[np.ndarray, np.ndarray]:
    """Return the exact interval of a binomial probability, from beta quantiles (Clopper and Pearson 1934).

    Args:
        exceeding: Number of samples that exceed the state, of any shape; it need not be an integer.
        total: Number of samples, of a shape that broadcasts with `exceeding`.
        confidence: Probability that the interval covers the true value [1].

    Returns:
        Lower bound and upper bound [1], each of the common shape.
    """
    tail, passing = 0.5 - 0.5 * confidence, total - exceeding
    # If no sample exceeds (or every sample does), there is no beta quantile: compute it for any argument, and discard
    # the result.
    lower = np.where(exceeding > 0, betaincinv(np.maximum(exceeding, 1e-9), passing + 1, tail), 0.0)
    upper = np.where(passing > 0, betaincinv(exceeding + 1, np.maximum(passing, 1e-9), 1 - tail), 1.0)
    return lower, upper


def fraction_intervals(counts: StripeCounts, confidence: float, *, over_structures: bool = True) -> np.ndarray:
    """Return intervals of the fractions of exceeding samples, for samples that share records and structures.

    The intervals are Clopper-Pearson intervals for the effective sample size, i.e. the number of independent samples
    that would have the same variance. The effective sample size is corrected by Student's t, because the variance is
    estimated from few records (Korn and Graubard 1998, Survey Methodology 24). If no sample exceeds or every sample
    does, each record counts as one sample.

    Args:
        counts: Numbers of samples by record, structure group, stripe, place (storey or floor) and damage state.
        confidence: Probability that the intervals cover the true value [1].
        over_structures: Whether intervals include the variability among structures.

    Returns:
        Lower and upper bounds [1], shape [2, place + 1, damage_state, im_level]; NaN for a single record.
    """
    total, trials = counts.total, counts.trials
    with np.errstate(divide="ignore", invalid="ignore"):
        fraction = total / trials

        is_crossed = leaves_out_structures(counts, over_structures)
        interaction = 0 * fraction
        if is_crossed:
            expected = np.moveaxis(fraction, -1, 0) * counts.valid[..., None, None]
            residual = (counts.exceeding - expected) / trials[:, None, None]
            interaction = np.moveaxis(interaction_variance(residual, counts.strata), 0, -1)
        left_out = without_each(counts, np.divide, fraction.shape, is_crossed=is_crossed)
        spread = spread_of(fraction, *left_out, interaction, counts.strata)
        records = (counts.valid.sum(axis=1) > 0).sum(axis=0)
        tail = 0.5 - 0.5 * confidence
        effective = fraction * (1 - fraction) / spread.standard_error**2
        effective *= (stdtrit(np.maximum(trials - 1, 1), tail) / stdtrit(spread.freedom, tail)) ** 2
        effective = np.where((total > 0) & (total < trials), np.clip(effective, 1, trials), records)
        lower, upper = clopper_pearson(fraction * effective, effective, confidence)
    known = np.isfinite(fraction) & (len(counts.valid) > 1)
    return np.where(known, np.stack([lower, upper]), np.nan)
