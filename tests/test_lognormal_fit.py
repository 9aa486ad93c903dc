"""Binomial intervals and the lognormal fit, against published values, pyFragility and general minimisers."""

import re

import numpy as np
import pyFragility
import pytest
from scipy.optimize import minimize
from scipy.stats import beta, norm
from validation import difference

from warpdyn.answers.fragility.intervals.fractions import clopper_pearson
from warpdyn.answers.fragility.lognormal_fit import (
    FIT_MEANINGS,
    fit_stripes,
    levels_to_add,
    probability,
)

pytestmark = pytest.mark.fast

# Baker (2015), Earthquake Spectra 31(1): levels [g], trials a stripe, exceedances.
BAKER_LEVELS = np.array([0.2, 0.3, 0.4, 0.6, 0.7, 0.8, 0.9, 1.0])
BAKER_TOTAL = 40
BAKER_EXCEEDING = np.array([0, 0, 0, 4, 6, 13, 12, 16])
WOOD_FRAME = pyFragility.datasets.load_msa_wood_frame()


def direct_fit(levels, exceeding, total):
    """Fit by a general minimiser in median and dispersion: another parametrisation, another method."""

    def cost(parameters):
        score = (np.log(levels) - parameters[0]) / np.exp(parameters[1])
        return -np.sum(exceeding * norm.logcdf(score) + (total - exceeding) * norm.logsf(score))

    options = {"xatol": 1e-10, "fatol": 1e-12, "maxiter": 4000, "maxfev": 4000}
    found = minimize(cost, [np.log(np.median(levels)), np.log(0.4)], method="Nelder-Mead", options=options)
    return np.exp(found.x)


# Binomial intervals


def test_clopper_pearson_published_values(measured):
    lower, upper = clopper_pearson(np.array([0, 4, 40]), np.array(40), 0.95)
    # Twelve decimals are published. All of 40 mirrors none of 40.
    measured(
        "Clopper-Pearson limits of 0, 4 and 40 in 40",
        truth="published values to twelve decimals",
        value=difference(lower, [0, 0.027925415294, 1 - 0.088097302879]),
        bound=1e-12,
    )
    np.testing.assert_allclose(upper, [0.088097302879, 0.236637399876, 1], atol=1e-12, rtol=0)


def test_clopper_pearson_agrees_with_beta_quantiles_and_knows_nothing_without_trials():
    exceeding, total = np.arange(1, 60)[:, None], np.array([60, 1000, 500_000])
    lower, upper = clopper_pearson(exceeding, total, 0.9)
    # Two implementations of the same quantile: a few digits of rounding apart.
    np.testing.assert_allclose(lower, beta.ppf(0.05, exceeding, total - exceeding + 1), rtol=1e-10)
    np.testing.assert_allclose(upper, beta.ppf(0.95, exceeding + 1, total - exceeding), rtol=1e-10)
    assert [float(bound) for bound in clopper_pearson(np.array(0), np.array(0), 0.95)] == [0, 1]


# The fit


def test_fit_of_bakers_data(measured):
    median, dispersion, _ = fit_stripes(BAKER_LEVELS, BAKER_EXCEEDING, BAKER_TOTAL)
    # The truth is given to 1e-16; the fit promises 1e-10.
    measured(
        "maximum likelihood of Baker's (2015) example of multiple stripes: median and dispersion",
        truth="the maximum by 40-digit arithmetic",
        value=difference([median, dispersion], [1.0761157942926833, 0.4292372038323184]),
        bound=1e-9,
    )


def test_the_start_of_the_search_does_not_matter():
    random = np.random.default_rng(3)
    levels = np.geomspace(0.1, 3, 9)
    exceeding = random.binomial(40, norm.cdf(np.log(levels / 0.8) / 0.5), size=(300, 9))
    median, dispersion, outcome = fit_stripes(levels, exceeding, 40)
    assert np.all(outcome == 0)
    # Near, far, absurdly far, and none at all for a part of the rows.
    for start in ((0.8, 0.5), (5.0, 0.1), (1e-3, 4.0), (1e6, 1e-3), (np.where(np.arange(300) % 2, 0.8, np.nan), 0.5)):
        found = fit_stripes(levels, exceeding, 40, tuple(np.broadcast_to(value, 300) for value in start))
        np.testing.assert_allclose(found[0], median, rtol=1e-10)
        np.testing.assert_allclose(found[1], dispersion, rtol=1e-10)
        assert np.all(found[2] == 0)


@pytest.mark.parametrize(
    ("levels", "exceeding", "total"),
    [
        (BAKER_LEVELS, BAKER_EXCEEDING, BAKER_TOTAL),
        (WOOD_FRAME.im, WOOD_FRAME.counts["B1-Existing"].to_numpy(), WOOD_FRAME.num_gm),
        (WOOD_FRAME.im, WOOD_FRAME.counts["B2-Existing"].to_numpy(), WOOD_FRAME.num_gm),
        (WOOD_FRAME.im, WOOD_FRAME.counts["B4-Retoifit"].to_numpy(), WOOD_FRAME.num_gm),
    ],
    ids=["Baker", "wood frame 1", "wood frame 2", "wood frame 4, retrofitted"],
)
def test_fit_agrees_with_pyfragility(levels, exceeding, total, measured):
    totals = np.full(levels.size, float(total))
    theirs = pyFragility.fit_msa(levels, exceeding, totals)
    also = pyFragility.mle.fit_mle(pyFragility.CollapseData(levels, exceeding, totals)).fragility
    ours = fit_stripes(levels, exceeding, total)[:2]
    # pyFragility stops its minimiser at about 1e-6.
    measured(
        "medians and dispersions of four published sets of counts",
        truth="pyFragility's fit_msa, whose minimiser stops at about 1e-6",
        value=difference(ours, theirs.params),
        bound=1e-4,
    )
    np.testing.assert_allclose(ours, [also.theta, also.beta], atol=1e-4, rtol=0)


def test_fit_of_many_rows_is_the_fit_of_each():
    generator = np.random.default_rng(5)
    levels = np.array([0.05, 0.3, 0.31, 2.0, 9.0])
    total = np.array([3, 50, 0, 7, 1000])  # unequal stripes, one of them empty
    exceeding = generator.binomial(total, probability(levels, 1.5, 0.9), (3, 4, 5))
    median, dispersion, _ = fit_stripes(levels, exceeding, total)
    assert median.shape == dispersion.shape == (3, 4)
    for index in np.ndindex(3, 4):
        # A minimiser that sees values only finds the place to about the square root of double rounding.
        expected = direct_fit(levels, exceeding[index], total)
        np.testing.assert_allclose([median[index], dispersion[index]], expected, rtol=1e-6)


def test_fit_far_in_the_tails_solves_the_score_equations():
    # Exceedances at 60 dispersions below the median of the rest: densities underflow there, their logarithms do not.
    levels, total = np.array([1e-3, 0.1, 1.0, 1.1, 100.0]), 10_000
    exceeding = np.array([1, 0, 4_000, 6_000, 10_000])
    median, dispersion, _ = fit_stripes(levels, exceeding, total)
    score = np.log(levels / median) / dispersion
    pull = exceeding * np.exp(norm.logpdf(score) - norm.logcdf(score))
    pull -= (total - exceeding) * np.exp(norm.logpdf(score) - norm.logsf(score))
    # Derivatives of the likelihood, against the size of their terms.
    assert abs(pull.sum()) < 1e-9 * np.abs(pull).sum()
    assert abs(pull @ np.log(levels)) < 1e-9 * np.abs(pull * np.log(levels)).sum()


@pytest.mark.parametrize(
    ("exceeding", "meaning"),
    [
        ([0, 0, 0, 0], "no_exceedance"),
        ([8, 8, 8, 8], "all_exceeding"),
        ([0, 0, 8, 8], "separated"),
        ([0, 3, 8, 8], "separated"),
        ([0, 0, 0, 5], "separated"),
        ([4, 4, 4, 4], "not_increasing"),
        ([5, 3, 2, 1], "not_increasing"),
        ([8, 8, 2, 0], "not_increasing"),
        ([0, 3, 4, 8], "fitted"),
        ([0, 0, 1, 5], "fitted"),
    ],
)
def test_rows_that_cannot_be_fitted_are_nan(exceeding, meaning):
    rows = [[0, 1, 4, 7], exceeding]  # beside a row that can be
    median, dispersion, outcome = fit_stripes([0.1, 0.2, 0.4, 0.8], rows, 8)
    assert [FIT_MEANINGS[code] for code in outcome] == ["fitted", meaning]
    assert np.isfinite([median[0], dispersion[0]]).all()
    assert np.isfinite([median[1], dispersion[1]]).all() == (meaning == "fitted")
    assert np.isnan([median[1], dispersion[1]]).all() == (meaning != "fitted")


def test_nearly_flat_counts_are_no_fit():
    levels = np.array([0.5, 1.0, 2.0])
    # A slope of 1e-4 a stripe about 10 %: the median is 2^thousands of the level, beyond floating point.
    median, dispersion, outcome = fit_stripes(levels, [[10_000, 10_001, 10_002]], 100_000)
    assert FIT_MEANINGS[outcome[0]] == "no_finite_median"
    assert np.isnan(median[0])
    assert np.isnan(dispersion[0])


def test_equal_shares_of_different_numbers_of_samples_do_not_increase():
    # The shares are equal as fractions of whole numbers; in floating point some of them seem to increase by rounding.
    generator = np.random.default_rng(1)
    denominator = generator.integers(2, 50, 2000)[:, None]
    numerator = generator.integers(1, denominator)
    multiple = generator.integers(1, 1000, (2000, 4))
    median, _, outcome = fit_stripes([0.1, 0.2, 0.4, 0.8], numerator * multiple, denominator * multiple)
    assert {FIT_MEANINGS[code] for code in outcome} == {"not_increasing"}
    assert np.isnan(median).all()


def test_estimator_recovers_bias_and_standard_error():
    """Baker's design with truth 1 and 0.4, against the standard errors of its expected information."""
    replicates = 20_000
    generator = np.random.default_rng(11)
    chance = norm.cdf(np.log(BAKER_LEVELS) / 0.4)
    # 100 times the trials, where the asymptotic standard errors hold to about 1/4000: .05555516 and .07049606 over 10.
    median, dispersion, _ = fit_stripes(BAKER_LEVELS, generator.binomial(4000, chance, (replicates, 8)), 4000)
    # Monte Carlo error of a standard deviation is 1/sqrt(2 N) = 0.5 %; four of them.
    assert np.log(median).std() == pytest.approx(0.005555516, rel=0.02)
    assert dispersion.std() == pytest.approx(0.007049606, rel=0.02)
    assert abs(np.log(median).mean()) < 4 * 0.005555516 / np.sqrt(replicates) + 1e-4  # and a bias of order 1/n
    # Baker's own 40 trials: the known bias of the dispersion, within four Monte Carlo errors of its mean.
    median, dispersion, _ = fit_stripes(BAKER_LEVELS, generator.binomial(40, chance, (replicates, 8)), 40)
    assert dispersion.mean() - 0.4 == pytest.approx(-0.00307, abs=4 * 0.0705 / np.sqrt(replicates))
    # At 40 trials the spread is not asymptotic any more, but within a few per cent.
    assert np.log(median).std() == pytest.approx(0.05555516, rel=0.06)
    assert dispersion.std() == pytest.approx(0.07049606, rel=0.06)


@pytest.mark.parametrize(
    ("levels", "exceeding", "total", "message"),
    [
        ([0.5], [1], 2, "at least 2 distinct"),
        ([0.5, 0.5], [1, 1], 2, "at least 2 distinct"),
        ([0.5, 0.0], [1, 1], 2, r"levels\[1\] is 0.0"),
        ([0.5, 1.0], [1, 3], 2, r"counts at \(1,\): 3.0 exceeding of 2.0"),
        ([0.5, 1.0], [-1, 1], 2, "0 <= exceeding <= total"),
        ([0.5, 1.0], [np.nan, 1], 2, "finite"),
        ([0.5, 1.0], [0, 1, 1], 2, "must be that of the levels, of length 2"),
        ([0.5, 1.0], [0, 1], [2, 2, 2], "give one total for all levels, or one per level"),
    ],
)
def test_fit_refuses(levels, exceeding, total, message):
    with pytest.raises(ValueError, match=message):
        fit_stripes(levels, exceeding, total)


def test_probability_is_the_lognormal_distribution():
    np.testing.assert_allclose(probability([0.0, 0.7, 1.4], 0.7, 0.5), [0, 0.5, norm.cdf(np.log(2) / 0.5)], atol=1e-15)


LEVELS_IN_G = np.array([0.2, 0.4, 0.6, 0.8])


@pytest.mark.parametrize(
    ("exceeding", "told", "added"),
    [
        ([0, 0, 8, 8], "add levels between 0.4 and 0.6 g, where some samples exceed it", [0.45, 0.55]),
        ([0, 0, 0, 0], "add levels above 0.8 g, where samples exceed it", [0.9, 1.0]),
        ([8, 8, 8, 8], "add levels below 0.2 g, where samples do not exceed it", [0.1, 0.15]),
        (
            [0, 3, 8, 8],
            "only at 0.4 g some samples exceed it and some do not: "
            "add levels between 0.2 and 0.4 g or between 0.4 and 0.6 g",
            [0.3, 0.5],
        ),
        (
            [0, 0, 0, 5],
            "only at 0.8 g some samples exceed it and some do not: add levels between 0.6 and 0.8 g or above 0.8 g",
            [0.7, 0.9],
        ),
        ([5, 4, 3, 2], "", None),  # fewer exceed higher levels: more of them do not mend that
    ],
)
def test_levels_to_add_are_told_and_give_a_fit(exceeding, told, added):
    assert levels_to_add(LEVELS_IN_G, np.array(exceeding), np.full(4, 8)) == told
    in_metres = levels_to_add(LEVELS_IN_G, np.array(exceeding), np.full(4, 8), "m s-1")
    assert in_metres == re.sub(r"(\d) g\b", r"\1 m s-1", told)
    assert fit_stripes(LEVELS_IN_G, exceeding, 8)[2] != FIT_MEANINGS.index("fitted")
    if added:
        # At the levels added 2 and 5 of 8 samples exceed.
        levels, order = np.append(LEVELS_IN_G, added), np.argsort(np.append(LEVELS_IN_G, added))
        counts = np.append(exceeding, [2, 5])
        assert fit_stripes(levels[order], counts[order], 8)[2] == FIT_MEANINGS.index("fitted")
