"""Intervals of stripe fractions by Korn and Graubard (1998), and the bounds of replicates."""

import numpy as np
import pytest
from scipy.stats import beta, t as student

from warpdyn.answers.fragility.intervals.fractions import fraction_intervals
from warpdyn.answers.fragility.intervals.jackknife import Spread
from warpdyn.answers.fragility.stripe_counts import StripeCounts

pytestmark = pytest.mark.fast


def counts_of(exceeding: np.ndarray, samples: int) -> StripeCounts:
    """Return the counts of one damage state; exceeding samples [record, level] of this many per record and level."""
    records, levels = exceeding.shape
    return StripeCounts(
        levels=0.1 * np.arange(1, levels + 1),
        units="g",
        dim="",
        places=np.arange(0),
        exceeding=exceeding[:, None, :, None, None],
        valid=np.full((records, 1, levels), samples),
        excluded={},
        records=np.arange(records),
        is_crossed=False,
        least_drift=np.inf,
    )


@pytest.mark.parametrize("confidence", [0.95, 0.8])
def test_intervals_are_those_of_svyciprop_with_method_beta(confidence):
    # R's survey::svyciprop(method="beta"), by its source: n.eff = p (1 - p) / SE^2, times
    # (qt(tail, n - 1) / qt(tail, degf))^2, then beta quantiles. Records are the clusters, of equal size: the variance
    # of their mean is that of the sample mean.
    samples, exceeding = 10, np.array([[1, 9], [4, 10], [0, 7], [6, 10], [2, 3], [3, 8]])
    clusters, levels = exceeding.shape
    n, tail = clusters * samples, 0.5 - 0.5 * confidence
    lower, upper = fraction_intervals(counts_of(exceeding, samples), confidence)[:, 0, 0]
    for level in range(levels):
        of_records = exceeding[:, level] / samples
        p, variance = of_records.mean(), of_records.var(ddof=1) / clusters
        effective = p * (1 - p) / variance * (student.ppf(tail, n - 1) / student.ppf(tail, clusters - 1)) ** 2
        assert 1 < effective < n  # neither bound of the number decides
        assert lower[level] == pytest.approx(beta.ppf(tail, effective * p, effective * (1 - p) + 1), rel=1e-9)
        assert upper[level] == pytest.approx(beta.ppf(1 - tail, effective * p + 1, effective * (1 - p)), rel=1e-9)


def test_effective_samples_are_no_more_than_the_samples_and_one_per_record_if_all_are_alike():
    samples, exceeding = 10, np.array([[5, 0, 10]] * 6)  # no variance among the records
    lower, upper = fraction_intervals(counts_of(exceeding, samples), 0.95)[:, 0, 0]
    assert lower[0] == pytest.approx(beta.ppf(0.025, 30, 31), rel=1e-9)
    assert (lower[1], upper[2]) == (0, 1)
    assert upper[1] == pytest.approx(1 - 0.025 ** (1 / 6), rel=1e-9)  # none of 6 records
    assert lower[2] == pytest.approx(0.025 ** (1 / 6), rel=1e-9)


def test_replicates_end_at_four_times_the_estimate_or_at_the_interval_if_that_is_wider():
    error, freedom = 0.3, 2.0
    spread = Spread(np.array([0.7]), np.array([[error**2], [0], [0]]), np.array([freedom]), np.array([[error]]))
    narrow, wide = (spread.draw(20_000, 1, confidence)[:, 0] - 0.7 for confidence in (0.5, 0.99))
    # With 50 % the interval is 0.82 standard errors wide: the bound is a factor of 4.
    for side in (1, -1):
        assert (side * narrow).max() == pytest.approx(np.log(4), rel=1e-12)
    share = 2 * student.sf(np.log(4) / error, freedom)
    at_end = np.mean(np.abs(narrow) > np.log(4) - 1e-9)
    assert at_end == pytest.approx(share, abs=4 * np.sqrt(share / 20_000))  # 4 standard errors of the share
    # With 99 % the interval is 9.9 standard errors wide, more than ln 4.
    assert np.abs(wide).max() == pytest.approx(error * student.ppf(0.995, freedom), rel=1e-12)
    # Neither bound changes the middle of the distribution, which is Student's.
    assert np.median(np.abs(narrow)) == pytest.approx(error * student.ppf(0.75, freedom), rel=0.03)
