"""Distributions of random parameters: quantiles, moments and draws agree with SciPy and with closed forms."""

import copy
import pickle

import numpy as np
import pytest
from prepared_structures import by_host, check_rows, prepared
from scipy import stats
from scipy.special import ndtr

import warpdyn as wd
from warpdyn.campaigns.integration.run import build_run
from warpdyn.campaigns.integration.settings import Execution, Integration
from warpdyn.campaigns.preparation.traced_structures import traced_structures
from warpdyn.engine.tracing.arrays import NotTraceableError

Z = np.linspace(-7.5, 7.5, 61)  # probabilities down to 3e-14 on both sides
MOTION = wd.GroundMotion(np.random.default_rng(1).normal(size=200), 0.02, "noise")
OTHERS = {
    "beta": stats.beta(2.0, 4.0, loc=0.01, scale=0.09),
    "Weibull": stats.weibull_min(6.0, scale=1.1),
    "Gumbel": stats.gumbel_r(loc=1.0, scale=0.1),
    "gamma": stats.gamma(25.0, scale=0.04),
}


def building() -> wd.ShearBuilding:
    return wd.ShearBuilding([2e5, 1e5], [4e8, 3e8], 3.2, damping="rayleigh", damping_ratio=0.05)


def values_of(distribution: object) -> np.ndarray:
    return wd.RandomValue(distribution).distribution.from_standard_normal(Z)


@pytest.mark.fast
def test_weibull_and_gumbel_quantiles_are_the_closed_forms_in_both_tails():
    above, below = ndtr(-Z), ndtr(Z)
    # -ln of 1 - probability and -ln of the probability, with all digits
    survival = np.where(Z < 0, -np.log1p(-below), -np.log(above))
    exponent = np.where(Z > 0, -np.log1p(-above), -np.log(below))
    np.testing.assert_allclose(values_of(OTHERS["Weibull"]), 1.1 * survival ** (1 / 6.0), rtol=1e-12)
    np.testing.assert_allclose(values_of(OTHERS["Gumbel"]), 1.0 - 0.1 * np.log(exponent), rtol=1e-12)


@pytest.mark.fast
@pytest.mark.parametrize("name", OTHERS)
def test_cumulative_probabilities_of_scipys_distributions_are_those_of_the_normal_variable(name):
    drawn = values_of(OTHERS[name])
    np.testing.assert_allclose(OTHERS[name].cdf(drawn[Z < 0]), ndtr(Z[Z < 0]), rtol=1e-9)
    np.testing.assert_allclose(OTHERS[name].sf(drawn[Z > 0]), ndtr(-Z[Z > 0]), rtol=1e-9)


@pytest.mark.fast
@pytest.mark.parametrize(
    ("mean", "deviation", "low", "high"),
    [(1.0, 0.3, 0.4, 1.7), (0.0, 1.0, None, 0.5), (0.0, 1.0, 6.0, None), (2.0, 0.5, 4.0, 4.5), (2.0, 0.5, -1.0, 0.0)],
)
def test_a_truncated_normal_variable_has_the_quantiles_of_scipys(mean, deviation, low, high):
    ends = (-np.inf if low is None else low), (np.inf if high is None else high)
    expected = stats.truncnorm(*((end - mean) / deviation for end in ends), loc=mean, scale=deviation)
    found = values_of(wd.Truncated(wd.Normal(mean, deviation), low, high))
    z = Z[np.abs(Z) <= 5]
    exact = np.where(z < 0, expected.ppf(ndtr(z)), expected.isf(ndtr(-z)))
    np.testing.assert_allclose(found[np.abs(Z) <= 5], exact, rtol=1e-9, atol=1e-9)
    assert found.min() >= ends[0]
    assert found.max() <= ends[1]
    assert (np.diff(found) >= 0).all()


@pytest.mark.fast
def test_a_truncated_lognormal_variable_has_the_mean_of_its_closed_form():
    median, dispersion, low, high = 1.0, 0.4, 0.6, 1.5
    probability = (np.arange(200_000) + 0.5) / 200_000
    drawn = wd.Truncated(wd.Lognormal(median, dispersion), low, high).from_standard_normal(stats.norm.ppf(probability))
    first, last = np.log(low / median) / dispersion, np.log(high / median) / dispersion
    share = (ndtr(last - dispersion) - ndtr(first - dispersion)) / (ndtr(last) - ndtr(first))
    assert drawn.mean() == pytest.approx(median * np.exp(dispersion**2 / 2) * share, rel=1e-8)


@pytest.mark.fast
def test_a_weibull_variable_above_a_limit_has_the_closed_form_quantiles():
    truncated = wd.Truncated(stats.weibull_min(2.0, scale=3.0), low=1.5)
    expected = 3.0 * np.sqrt((1.5 / 3.0) ** 2 - np.log(ndtr(-Z)))
    np.testing.assert_allclose(values_of(truncated), expected, rtol=1e-9)
    within = wd.Truncated(truncated, high=4.0)  # limits of a truncated distribution
    both = wd.Truncated(stats.weibull_min(2.0, scale=3.0), 1.5, 4.0)
    np.testing.assert_allclose(values_of(within), values_of(both), rtol=1e-12)


@pytest.mark.fast
def test_an_empirical_variable_takes_each_observed_value_with_equal_probability():
    observed = np.array([3.0, 1.0, 2.0, 2.0])
    probability = np.array([0.1, 0.2499, 0.2501, 0.7499, 0.7501, 0.999])
    drawn = wd.Empirical(observed).from_standard_normal(stats.norm.ppf(probability))
    assert drawn.tolist() == np.quantile(observed, probability, method="inverted_cdf").tolist()
    assert wd.Empirical(observed).from_standard_normal(np.array([-np.inf, np.inf])).tolist() == [1.0, 3.0]


def test_a_run_draws_the_distributions_with_their_moments_and_correlation():
    scatter = {
        "damping_ratio": wd.RandomValue(OTHERS["beta"]),
        "stiffness": wd.RandomFactor(OTHERS["Weibull"], per="storey"),
        "mass": wd.RandomFactor(wd.Truncated(wd.Normal(1.0, 0.1), 0.8, 1.2)),
    }
    scene = wd.Scene(building(), MOTION, scatter, {("damping_ratio", "mass"): 0.6}, recorders=("drift",))
    run = wd.simulate(scene, structures=4096, seed=1, dtype="float64")
    damping, stiffness, mass = (run[name].values for name in scatter)
    assert damping.mean() == pytest.approx(0.04, rel=1e-3)
    assert damping.std() == pytest.approx(OTHERS["beta"].std(), rel=5e-3)
    np.testing.assert_allclose((stiffness / [4e8, 3e8]).mean(axis=0), OTHERS["Weibull"].mean(), rtol=1e-3)
    assert mass[:, 0].min() >= 0.8 * 2e5
    assert mass[:, 0].max() <= 1.2 * 2e5
    assert stats.spearmanr(damping, mass[:, 0]).statistic == pytest.approx(6 / np.pi * np.arcsin(0.3), abs=0.01)


def test_given_factors_give_the_run_of_the_products_and_its_kernels():
    factors = np.array([[0.8, 1.0], [1.0, 1.1], [1.2, 0.9]])
    nominal = building().parameters["stiffness"]
    runs = [
        wd.simulate(wd.Scene(building(), MOTION, {"stiffness": spread}), dtype="float64")
        for spread in (wd.GivenFactors(factors), wd.GivenValues(factors * nominal))
    ]
    assert (runs[0]["peak_storey_drift"].values == runs[1]["peak_storey_drift"].values).all()
    one = wd.simulate(wd.Scene(building(), MOTION, {"stiffness": wd.GivenFactors([0.8, 1.2])}))
    assert (one["stiffness"].values == np.outer([0.8, 1.2], nominal)).all()
    how, where = Integration(method="rk4", dtype="float64"), Execution(device="cpu")
    scatter = {"stiffness": wd.GivenFactors(factors), "damping_ratio": wd.GivenFactors([0.5, 1.0, 1.5])}
    run = build_run(wd.Scene(building(), MOTION, scatter), 3, how, where, seed=1)
    fields, vibration, refused, _ = prepared(run, 0, 3)
    assert refused == 0
    check_rows((fields, vibration), by_host(run), rounding=1e-13)


@pytest.mark.fast
def test_one_factor_also_applies_to_a_tuned_mass_damper_and_to_a_linear_system():
    damped = building().with_tuned_mass_damper(mass_ratio=0.05)
    scaled = wd.simulate(wd.Scene(damped, MOTION, {"mass": wd.GivenFactors([1.1, 0.9])}), dtype="float64")
    np.testing.assert_allclose(scaled["mass"].values, np.outer([1.1, 0.9], damped.parameters["mass"]), rtol=1e-12)
    system = wd.LinearSystem(np.diag([2e5, 1e5]), np.diag([1e5, 1e5]), np.diag([4e7, 3e7]))
    factors, values = (
        wd.simulate(wd.Scene(system, MOTION, {"stiffness": kind([0.9, 1.1])}))["peak_displacement"].values
        for kind in (wd.GivenFactors, wd.GivenValues)
    )
    assert (factors == values).all()


@pytest.mark.fast
@pytest.mark.parametrize("distribution", [OTHERS["beta"], wd.Truncated(wd.Normal(1, 0.1), 0.5), wd.Empirical([1, 2])])
def test_the_host_draws_what_kernels_cannot_compute(distribution):
    how, where = Integration(method="rk4", dtype="float64"), Execution(device="cpu")
    scene = wd.Scene(building(), MOTION, {"stiffness": wd.RandomFactor(distribution)})
    with pytest.raises(NotTraceableError, match="the host draws values"):
        traced_structures(build_run(scene, 4, how, where, seed=1))


@pytest.mark.fast
@pytest.mark.parametrize(
    "spread",
    [
        wd.RandomValue(stats.beta(2.0, 4.0, 0.01, 0.09)),
        wd.RandomFactor(wd.Truncated(stats.weibull_min(6.0, scale=1.1), low=0.5)),
        wd.RandomFactor(wd.Empirical([0.9, 1.0, 1.2])),
        wd.GivenFactors([0.9, 1.1]),
    ],
)
def test_a_scene_is_rebuilt_copied_and_pickled_with_its_distributions(spread):
    scene = wd.Scene(building(), MOTION, {"damping_ratio": spread})
    text = scene.to_json()
    assert wd.Scene.from_json(text, [MOTION]).to_json() == text
    for again in (copy.deepcopy(spread), pickle.loads(pickle.dumps(spread))):
        assert wd.Scene(building(), MOTION, {"damping_ratio": again}).to_json() == text


@pytest.mark.fast
@pytest.mark.parametrize(
    ("call", "error", "words"),
    [
        (lambda: wd.RandomFactor(stats.gamma), TypeError, "call it with its parameters"),
        (lambda: wd.RandomFactor(stats.poisson(3)), TypeError, "not a continuous distribution of scipy.stats"),
        (lambda: wd.RandomFactor(stats.rv_histogram(np.histogram([1, 2, 3]))), TypeError, "must be Normal"),
        (lambda: wd.RandomFactor(stats.rv_histogram(np.histogram([1, 2, 3]))()), TypeError, "with a name"),
        (lambda: wd.RandomFactor(stats.gamma([2.0, 3.0])), ValueError, "gamma: a must be a finite number"),
        (lambda: wd.RandomFactor(stats.gamma(-2.0)), ValueError, "scipy.stats.gamma has no median"),
        (lambda: wd.Truncated(wd.Normal(1.0, 0.1)), ValueError, "Truncated needs low= or high="),
        (lambda: wd.Truncated(wd.Normal(1.0, 0.1), 1.2, 0.8), ValueError, "must be above Truncated.low=1.2"),
        (lambda: wd.Truncated(wd.Normal(1.0, 0.1), 80.0, 120.0), ValueError, "check the unit"),
        (lambda: wd.Truncated(wd.Normal(1.0, 0.0), 1.0), ValueError, "check the unit"),
        (lambda: wd.Truncated(wd.Empirical([1, 2]), 1.0), TypeError, "needs a continuous distribution"),
        (lambda: wd.Truncated(0.3, 1.0), TypeError, "distribution must be Normal"),
        (lambda: wd.Empirical([1.0]), ValueError, "at least 2 numbers in a row"),
        (lambda: wd.Empirical([1.0, np.nan]), ValueError, "Empirical.values"),
        (lambda: wd.GivenFactors([[[1.0]]]), ValueError, "GivenFactors.values must have shape"),
        (lambda: wd.GivenFactors([1.0, np.inf]), ValueError, "GivenFactors.values"),
    ],
)
def test_invalid_distributions_are_refused_by_name(call, error, words):
    with pytest.raises(error) as raised:
        call()
    assert words in str(raised.value)


@pytest.mark.fast
def test_factors_of_another_shape_or_out_of_bounds_are_refused():
    with pytest.raises(ValueError, match=r"lists values of shape \(2, 3\); it must be \[structure, 2\]"):
        wd.Scene(building(), MOTION, {"mass": wd.GivenFactors(np.ones((2, 3)))})
    with pytest.raises(ValueError, match=r"the given mass.*correct its GivenFactors"):
        wd.simulate(wd.Scene(building(), MOTION, {"mass": wd.GivenFactors([1.0, 1.0, -1.0])}))
