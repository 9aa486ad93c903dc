"""Subset simulation and importance sampling of limit-state functions, against probabilities by quadrature."""

from __future__ import annotations

import warnings

import numpy as np
import pytest
from reliability_problems import PROBLEMS, linear
from scipy.special import ndtr

import warpdyn as wd

pytestmark = pytest.mark.fast

SEEDS = range(8)
# Most samples of this problem lead away from its failure domain, so that it needs more samples.
DECEPTIVE = "RP110"
FEW_VARIABLES = ("four branches", "RP25", "RP28", "RP54", "RP107", "RP111")


def estimates(function, name, seeds, **given):
    """Return probability / exact probability, and coefficient of variation, shape [2, seed]."""
    limit_state, variables, exact = PROBLEMS[name]
    found = [function(limit_state, variables, seed=seed, **given) for seed in seeds]
    return np.array([[float(each["probability"]) / exact, float(each["coefficient_of_variation"])] for each in found]).T


def scores(ratio, variation):
    """Return the standard scores of the logarithms of ratios with given coefficients of variation."""
    return np.log(ratio) / np.sqrt(np.log1p(variation**2))


@pytest.fixture(scope="module")
def of_subset():
    return {name: estimates(wd.subset_simulation, name, SEEDS) for name in PROBLEMS if name != DECEPTIVE}


@pytest.fixture(scope="module")
def of_weights():
    return {name: estimates(wd.importance_sampling, name, range(2), samples=10_000) for name in FEW_VARIABLES}


def test_subset_simulation_agrees_with_quadrature(of_subset):
    # Of 136 estimates, 95 % are expected within two standard errors; 90 % is 2.7 standard errors of this share below.
    every = np.concatenate([scores(*found) for found in of_subset.values()])
    assert np.mean(np.abs(every) < 2) > 0.9
    assert np.abs(every).max() < 4


def test_subset_simulation_is_nearly_unbiased(of_subset):
    for name, (ratio, variation) in of_subset.items():
        error = ratio.std(ddof=1) / np.sqrt(len(SEEDS))
        bias = (variation**2).mean()  # the largest bias that the documentation states
        assert abs(ratio.mean() - 1) < 3 * error + bias, name
    mean = np.mean([ratio.mean() for ratio, _ in of_subset.values()])
    assert abs(mean - 1) < 0.05  # standard error 0.012, bias about 0.02


def test_coefficient_of_variation_is_the_spread_of_estimates(of_subset):
    # Squared spreads of 8 estimates vary by 53 %; the mean over 17 problems by 13 %, i.e. 6.5 % of the spread.
    spread = np.mean([ratio.var(ddof=1) / (variation**2).mean() for ratio, variation in of_subset.values()])
    assert 0.65 < spread < 1.5


def test_a_deceptive_failure_domain_needs_many_samples():
    ratio, _ = estimates(wd.subset_simulation, DECEPTIVE, range(8), samples=20_000)
    assert abs(ratio.mean() - 1) < 3 * ratio.std(ddof=1) / np.sqrt(ratio.size)


def test_any_number_of_variables():
    found = wd.subset_simulation(linear, 1000, samples=1000, seed=1)
    assert abs(scores(float(found["probability"]) / ndtr(-4.2649), float(found["coefficient_of_variation"]))) < 2


def test_variables_of_subset_simulation():
    limit_state, variables, _ = PROBLEMS["RP107"]
    found = wd.subset_simulation(limit_state, variables, samples=1000, level_probability=0.2, seed=3)
    conditional = found["conditional_probability"].values
    assert (conditional[:-1] >= 0.2).all()
    assert (conditional[:-1] < 0.21).all()  # several samples of a chain may have the value of the threshold
    assert conditional[-1] >= 0.2
    assert (
        found["exceedance_probability"].values[-1] == float(found["probability"]) == pytest.approx(conditional.prod())
    )
    assert (np.diff(found["threshold"].values) < 0).all()
    assert found["threshold"].values[-1] == 0
    assert int(found["evaluations"]) == 1000 + 800 * (conditional.size - 1)
    assert np.isnan(found["acceptance_rate"].values[0])
    assert (np.abs(found["acceptance_rate"].values[1:] - 0.44) < 0.15).all()  # the rate that the spread is adapted to
    low, high = float(found["probability_lower"]), float(found["probability_upper"])
    assert low < float(found["probability"]) < high
    # Each threshold is reached with the stated probability: the sum of ten variables is normal.
    of_threshold = ndtr(-(5 * np.sqrt(10) - found["threshold"].values) / np.sqrt(10))
    assert (np.abs(np.log(found["exceedance_probability"].values / of_threshold)) < 1.5).all()
    again = wd.subset_simulation(limit_state, variables, samples=1000, level_probability=0.2, seed=3)
    assert again.identical(found)
    narrow = wd.subset_simulation(limit_state, variables, samples=1000, level_probability=0.2, confidence=0.5, seed=3)
    assert float(narrow["probability_lower"]) > low


def test_cost_is_far_below_plain_monte_carlo():
    limit_state, variables, exact = PROBLEMS["RP107"]
    for function in (wd.subset_simulation, wd.importance_sampling):
        found = function(limit_state, variables, seed=1)
        plain = (1 - exact) / (exact * float(found["coefficient_of_variation"]) ** 2)  # samples for the same error
        assert int(found["evaluations"]) < plain / 1000


def test_importance_sampling_agrees_with_quadrature(of_weights):
    every = np.concatenate([scores(*found) for found in of_weights.values()])
    assert np.mean(np.abs(every) < 2) >= 10 / 12  # 95 % expected
    assert np.abs(every).max() < 4
    assert (np.concatenate([variation for _, variation in of_weights.values()]) < 0.1).all()


def test_importance_sampling_with_given_centres():
    # The weights of samples about the design point of a linear function have a known variance.
    beta, variables, samples = 5.0, 50, 20_000
    centre = np.full(variables, beta / np.sqrt(variables))

    def limit_state(normals):
        return beta - normals.sum(axis=1) / np.sqrt(variables)

    found = wd.importance_sampling(limit_state, variables, centres=centre, samples=samples, seed=2)
    exact = ndtr(-beta)
    assert abs(float(found["probability"]) / exact - 1) < 2.5 * float(found["coefficient_of_variation"])
    # Without the plain share, E[w^2] = exp(beta^2) Phi(-2 beta); the share of 10 % changes it by 1 / 0.9.
    expected = np.sqrt((np.exp(beta**2) * ndtr(-2 * beta) / (0.9 * exact**2) - 1) / samples)
    assert float(found["coefficient_of_variation"]) == pytest.approx(expected, rel=0.05)


@pytest.mark.parametrize(
    ("limit_state", "given", "message"),
    [
        (lambda z: np.where(z[:, 0] > 3, -1.0, 1.0), {}, r"level 2 does not progress.*capacity - demand"),
        (lambda z: np.maximum(3 - z[:, 0], 1), {}, "does not progress: its threshold, 1,"),
        (lambda z: np.ones(len(z)), {}, "is 1 for all 2000 samples"),
        (lambda z: z[:, 0] - 10, {}, "negative for all 2000 samples.*sign may be wrong"),
        (lambda z: 100 - z[:, 0], {}, "the probability is below 1e-15.*Check the sign and the limit"),
        (lambda z: np.where(z[:, 0] > 2, np.nan, 1.0), {}, "is NaN for .* of 2000 samples; the first has the"),
        (lambda z: z, {}, r"returned values of shape \(2000, 2\)"),
        (lambda z: 3 - z[:, 0], {"samples": 50}, "samples=50 per level are too few"),
        (lambda z: 3 - z[:, 0], {"samples": 1005}, "multiple of 10 .*samples=1010"),
        (lambda z: 3 - z[:, 0], {"level_probability": 0.3}, "1 divided by a whole number"),
        (lambda z: 3 - z[:, 0], {"variables": 0}, "variables must be"),
        (lambda z: 3 - z[:, 0], {"variables": None}, "give variables="),
        (lambda z: 3 - z[:, 0], {"confidence": 1.5}, "confidence"),
    ],
)
def test_subset_simulation_refuses(limit_state, given, message):
    with pytest.raises(ValueError, match=message):
        wd.subset_simulation(limit_state, **{"variables": 2, **given})


def test_limit_states_that_are_not_functions_of_numbers():
    with pytest.raises(TypeError, match="must be a function of standard normal values"):
        wd.subset_simulation(3.0, 2)
    with pytest.raises(TypeError, match="type bool; it must return real numbers"):
        wd.importance_sampling(lambda z: z[:, 0] > 3, 2)


def test_importance_sampling_refuses():
    with pytest.raises(ValueError, match=r"centres must have the shape \[centre, 2\]"):
        wd.importance_sampling(lambda z: 3 - z[:, 0], 2, centres=[1.0, 2.0, 3.0])
    with pytest.raises(ValueError, match="none of 200 samples failed, with 1 given centres: give centres= near"):
        wd.importance_sampling(lambda z: 9 - z[:, 0], 2, centres=[-1.0, 0.0], samples=200)
    with pytest.raises(ValueError, match="cannot choose a density for 100 variables"):
        wd.importance_sampling(linear, 100)
    with pytest.raises(ValueError, match="samples=10 are too few"):
        wd.importance_sampling(lambda z: 3 - z[:, 0], 2, samples=10)


def test_warnings_of_unreliable_estimates():
    with pytest.warns(UserWarning, match="count as .* samples of equal weight"):
        wd.importance_sampling(lambda z: 4 - z[:, 0], 2, centres=[2.0, 6.0], samples=200, seed=1)

    def narrow(z):  # the levels consist of thin lines, which candidates rarely hit
        return 3 * np.abs(np.sin(40 * z)).sum(axis=1) + 1e-3 * z[:, 0] - 0.3

    with pytest.warns(UserWarning, match=r"chains of level .* accepted less than 5%"):
        wd.subset_simulation(narrow, 4, samples=200, seed=1)


def test_warnings_are_absent_for_usual_problems():
    with warnings.catch_warnings():
        warnings.simplefilter("error")
        wd.subset_simulation(*PROBLEMS["RP22"][:2])
        wd.importance_sampling(*PROBLEMS["RP22"][:2], samples=1000)
