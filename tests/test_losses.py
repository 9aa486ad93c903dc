"""Losses of a building: Hazus' ratios, vulnerability, expected annual loss, loss exceedance, return periods."""

import re
import warnings

import matplotlib.pyplot as plt
import numpy as np
import pyFragility
import pytest
import xarray as xr
from fragility_parameters import curves
from scipy.integrate import quad, trapezoid
from scipy.special import ndtr, ndtri
from scipy.stats import beta

import warpdyn as wd
from warpdyn.answers.risk.losses import _least_loss

pytestmark = pytest.mark.fast

STATES = {"slight": (0.2, 0.4), "moderate": (0.4, 0.4), "extensive": (0.7, 0.4), "complete": (1.2, 0.4)}
RATIOS = {"slight": (0.02, 0.8), "moderate": (0.1, 0.5), "extensive": (0.45, 0.3), "complete": 1.0}
HAZARD = wd.HazardCurve([0.01, 0.05, 0.2, 0.6, 2.0, 6.0], [0.4, 0.06, 6e-3, 6e-4, 2e-5, 3e-7], measure="PGA")


def state_rates():
    """Return the rates of damage that comes to each state and no further, by differences."""
    rates = wd.annual_rates(curves(STATES), HAZARD)["annual_rate"].values
    return rates - np.append(rates[1:], 0.0)


# Hazus


def test_hazus_ratios_are_the_printed_ones():
    # Hazus-MH technical manual, tables 15.2 to 15.4 [% of the replacement cost]: single-family dwellings.
    printed = {
        "structural": (0.5, 2.3, 11.7, 23.4),
        "acceleration_sensitive": (0.5, 2.7, 8.0, 26.6),
        "drift_sensitive": (1.0, 5.0, 25.0, 50.0),
    }
    for part, percent in printed.items():
        found = wd.hazus_loss_ratios("RES1", part)
        assert list(found) == ["slight", "moderate", "extensive", "complete"]
        np.testing.assert_allclose(list(found.values()), np.array(percent) / 100, rtol=1e-12)


def test_hazus_ratios_of_whole_buildings():
    # The manual makes its tables of 2, 10 and 100 % of each part (of structure and drift-sensitive parts 50 % in
    # extensive damage, of acceleration-sensitive ones 30 %); of 28 classes, one departs from it, in slight damage.
    occupancies = [f"RES{i}" for i in range(1, 7)] + [f"COM{i}" for i in range(1, 11)]
    occupancies += [f"IND{i}" for i in range(1, 7)] + ["AGR1", "REL1", "GOV1", "GOV2", "EDU1", "EDU2"]
    for occupancy in occupancies:
        slight, moderate, extensive, complete = wd.hazus_loss_ratios(occupancy).values()
        assert slight == pytest.approx(0.016 if occupancy == "AGR1" else 0.02, abs=0.0015)  # three roundings to 0.0005
        assert moderate == pytest.approx(0.1, abs=0.0015)
        assert complete == pytest.approx(1.0, abs=0.0015)
        of_part = [wd.hazus_loss_ratios(occupancy, part)["complete"] for part in ("structural", "drift_sensitive")]
        accelerated = wd.hazus_loss_ratios(occupancy, "acceleration_sensitive")["complete"]
        if occupancy != "RES2":  # mobile homes: 30 % of the structure too
            assert extensive == pytest.approx(0.5 * sum(of_part) + 0.3 * accelerated, abs=0.0025)
    with pytest.raises(ValueError, match="occupancy class 'COM11'"):
        wd.hazus_loss_ratios("COM11")
    with pytest.raises(ValueError, match="part of a building 'contents'"):
        wd.hazus_loss_ratios("COM1", "contents")


# Vulnerability


def test_vulnerability_by_hand():
    level = 0.6
    found = wd.vulnerability(curves(STATES), RATIOS, intensity=[level])
    exceeding = [ndtr(np.log(level / median) / spread) for median, spread in STATES.values()]
    shares = -np.diff([*exceeding, 0.0])
    means, variations = np.array([0.02, 0.1, 0.45, 1.0]), np.array([0.8, 0.5, 0.3, 0.0])
    mean = shares @ means
    variance = (1 - exceeding[0]) * mean**2 + shares @ ((variations * means) ** 2 + (means - mean) ** 2)
    assert float(found["mean_loss_ratio"][0]) == pytest.approx(mean, rel=1e-12)
    assert float(found["coefficient_of_variation"][0]) == pytest.approx(np.sqrt(variance) / mean, rel=1e-12)
    np.testing.assert_allclose(found["probability_of_state"][:, 0], shares, rtol=1e-12)


def test_vulnerability_agrees_with_pyfragility():
    levels = [0.2, 0.4, 0.7, 1.0, 1.5, 2.2]
    counts = [[38, 2, 0, 0], [30, 8, 2, 0], [18, 14, 7, 1], [8, 14, 13, 5], [2, 9, 16, 13], [0, 3, 12, 25]]
    fit = pyFragility.fit_damage_states(levels, counts=counts)
    states = {}
    for state, name in enumerate(("slight", "moderate", "complete"), start=1):
        # A probit in ln(intensity): two of its probabilities are the whole curve.
        score = ndtri(fit.probability(np.array([0.5, 2.0]), state=state))
        dispersion = np.log(4) / np.diff(score)[0]
        states[name] = 2.0 * np.exp(-score[1] * dispersion), dispersion
    ratios = {"slight": 0.05, "moderate": 0.3, "complete": 1.0}
    ours = wd.vulnerability(curves(states), ratios, intensity=[0.3, 0.5, 1.0, 2.0])["mean_loss_ratio"]
    theirs = pyFragility.vulnerability(fit, [0.3, 0.5, 1.0, 2.0], [0.0, *ratios.values()])
    np.testing.assert_allclose(ours, theirs, rtol=1e-9)
    # Of expected losses its sum of 20,000 midpoints, over a spline through 801 points of our hazard.
    points = np.geomspace(0.02, 8, 801)
    hazard = wd.HazardCurve([0.02, 0.2, 1.0, 3.0, 8.0], [0.5, 0.02, 1e-3, 5e-5, 4e-7])
    dense = pyFragility.HazardCurve(points, hazard.rate_of(points))
    grid = np.geomspace(0.02, 8, 20_001)
    loss = pyFragility.expected_annual_loss(fit, dense, [0.0, *ratios.values()], grid)
    found = wd.annual_losses(curves(states), hazard, ratios)
    # Its sum ends at 8 units, above which nearly all is lost, at the rate of the last point.
    above = hazard.annual_rate[-1] * float(pyFragility.vulnerability(fit, [8.0], [0.0, *ratios.values()])[0])
    assert float(found["expected_annual_loss"]) == pytest.approx(loss + above, rel=1e-5)


def test_curves_that_cross_are_warned_of():
    crossing = {"slight": (0.5, 0.8), "complete": (0.6, 0.2)}
    with pytest.warns(UserWarning, match="curves of 'slight' and 'complete' cross"):
        found = wd.vulnerability(curves(crossing), {"slight": 0.1, "complete": 1.0})
    assert (found["probability_of_state"] >= 0).all()
    assert (found["mean_loss_ratio"] <= 1).all()


def test_replicates_make_a_band():
    generator = np.random.default_rng(2)
    medians = np.array([value[0] for value in STATES.values()]) * np.exp(0.1 * generator.standard_normal((500, 1)))
    replicates = medians, np.full(medians.shape, 0.4)
    found = wd.vulnerability(curves(STATES, replicates), RATIOS, intensity=[0.3, 0.6, 1.2])
    # Medians that move together by a factor are intensities that move by its inverse.
    ends = np.exp(-np.quantile(np.log(medians[:, 0] / 0.2), [0.975, 0.025], method="hazen"))
    for i, level in enumerate((0.3, 0.6, 1.2)):
        at_ends = wd.vulnerability(curves(STATES), RATIOS, intensity=np.sort(level * ends))["mean_loss_ratio"].values
        band = [float(found[f"mean_loss_ratio_{side}"][i]) for side in ("lower", "upper")]
        np.testing.assert_allclose(band, at_ends, rtol=1e-3)  # quantiles between two of 500 replicates
    losses = wd.annual_losses(curves(STATES, replicates), HAZARD, RATIOS)
    for name in ("expected_annual_loss", "loss_exceedance_rate", "return_period_loss"):
        assert (losses[f"{name}_lower"] <= losses[name]).all()
        assert (losses[name] <= losses[f"{name}_upper"]).all()
    alone = wd.annual_losses(curves(STATES), HAZARD, RATIOS)
    assert np.isnan(alone["return_period_loss_upper"]).all()


# Annual losses


def test_expected_annual_loss_is_the_integral_of_the_vulnerability():
    found = wd.annual_losses(curves(STATES), HAZARD, RATIOS, replacement_value=2e6)

    def integrand(u, slope):
        level = np.exp(u)
        loss = wd.vulnerability(curves(STATES), RATIOS, intensity=[level])["mean_loss_ratio"].values[0]
        return loss * slope * float(HAZARD.rate_of(level))

    edges = np.log([1e-3, *HAZARD.intensity[1:-1], 1e3])
    parts = [
        quad(integrand, *edges[i : i + 2], args=(HAZARD.slopes[i],), epsrel=1e-7, epsabs=1e-12)[0] for i in range(5)
    ]
    assert float(found["expected_annual_loss"]) == pytest.approx(2e6 * sum(parts), rel=1e-6)
    assert float(found["contribution"].sum()) == pytest.approx(1.0, rel=1e-12)


def test_losses_exceeded_are_mixtures_of_beta_distributions():
    found = wd.annual_losses(curves(STATES), HAZARD, RATIOS, replacement_value=100.0)
    rates = state_rates()
    np.testing.assert_allclose(found["annual_rate_of_state"], rates, rtol=1e-9)
    for ratio in (0.0, 0.03, 0.25, 0.6, 0.99):
        exceeding = [
            beta.sf(ratio, mean * size, (1 - mean) * size)
            for mean, variation in list(RATIOS.values())[:3]
            for size in [(1 - mean) / (mean * variation**2) - 1]
        ]
        truth = rates @ [*exceeding, 1.0]
        assert np.interp(100 * ratio, found["loss"], found["loss_exceedance_rate"]) == pytest.approx(truth, rel=2e-3)
    # The area under the curve is the expected loss; trapezoids over half per cents, of a density that ends at 0.
    area = trapezoid(found["loss_exceedance_rate"], found["loss"])
    assert area == pytest.approx(float(found["expected_annual_loss"]), rel=0.01)
    # Of a compound Poisson process the variance is that of the rate times the mean square.
    squares = [(variation**2 + 1) * mean**2 for mean, variation in [*list(RATIOS.values())[:3], (1.0, 0.0)]]
    assert float(found["deviation_of_annual_loss"]) == pytest.approx(100 * np.sqrt(rates @ squares), rel=1e-9)


def test_return_period_losses_are_on_the_curve():
    found = wd.annual_losses(curves(STATES), HAZARD, RATIOS, return_periods=[100, 250, 475, 2500])
    rates = state_rates()
    losses = found["return_period_loss"].values
    assert losses[0] == 0.0  # damage of any kind is rarer than once in 100 years
    assert 1 / rates.sum() > 100
    for period, loss in zip([250, 475, 2500], losses[1:], strict=True):
        exceeding = [
            beta.sf(loss, mean * size, (1 - mean) * size)
            for mean, variation in list(RATIOS.values())[:3]
            for size in [(1 - mean) / (mean * variation**2) - 1]
        ]
        assert rates @ [*exceeding, float(loss < 1)] == pytest.approx(1 / period, rel=1e-9)


def test_certain_ratios_make_steps():
    ratios = {"slight": 0.02, "moderate": 0.1, "extensive": 0.45, "complete": 1.0}
    rates = state_rates()
    reaching = np.cumsum(rates[::-1])[::-1]
    periods = [1.01 / reaching[0], 0.99 / reaching[1], 1.01 / reaching[1], 1.01 / reaching[3]]
    found = wd.annual_losses(curves(STATES), HAZARD, ratios, return_periods=periods)
    np.testing.assert_allclose(found["return_period_loss"], [0.02, 0.02, 0.1, 1.0], rtol=1e-12)
    below, at = np.nextafter(0.1, 0), 0.1
    rate = found["loss_exceedance_rate"]
    assert float(rate.sel(loss=below)) == pytest.approx(reaching[1], rel=1e-9)
    assert float(rate.sel(loss=at)) == pytest.approx(reaching[2], rel=1e-9)


# Expected annual loss of a vulnerability function


def function(levels, ratios, **attributes):
    coordinates = {"intensity": ("intensity", levels, {"units": "g"})}
    return xr.Dataset({"mean_loss_ratio": ("intensity", ratios)}, coordinates, attributes)


def test_expected_annual_loss_of_a_function_of_closed_form():
    # One line of slope 0.5 from 0.1 to 2.1, over a power law of slope 2 (and of slope 1, where it is a logarithm):
    # the integral of 0.5 k0 x^-k, by parts.
    line = function([0.1, 2.1], [0.0, 1.0])
    for k, integral in ((2.0, 1 / 0.1 - 1 / 2.1), (1.0, np.log(21.0))):
        hazard = wd.HazardCurve([0.05, 0.4, 50.0], 1e-3 * np.array([0.05, 0.4, 50.0]) ** -k)
        found = wd.expected_annual_loss(line, hazard, replacement_value=1e6)
        assert float(found["expected_annual_loss"]) == pytest.approx(1e6 * 0.5e-3 * integral, rel=1e-12)
        above = 2.1**-k / (0.5 * integral)
        assert float(found["share_above_intensities"]) == pytest.approx(above, rel=1e-12)
    # A step at the first intensity is lost as often as that is exceeded.
    level = function([0.2, 5.0], [0.3, 0.3])
    found = wd.expected_annual_loss(level, HAZARD)["expected_annual_loss"]
    assert float(found) == pytest.approx(0.3 * float(HAZARD.rate_of(0.2)), rel=1e-12)


def test_expected_annual_loss_of_the_function_is_that_of_the_curves():
    fine = wd.vulnerability(curves(STATES), RATIOS, intensity=np.geomspace(0.01, 20.0, 3000))
    found = wd.expected_annual_loss(fine, HAZARD)["expected_annual_loss"]
    truth = wd.annual_losses(curves(STATES), HAZARD, RATIOS)["expected_annual_loss"]
    # Chords of 0.25 % of the intensity: an error of the square of that.
    assert float(found) == pytest.approx(float(truth), rel=1e-5)


def test_a_function_that_begins_at_zero_costs_nothing_below_the_hazard():
    begins = function([0.0, 0.5, 2.0], [0.0, 0.1, 1.0])
    start = 0.01  # the first point of the hazard, at which the function has 0.002
    same = function([start, 0.5, 2.0], [0.002, 0.1, 1.0])
    found, expected = (wd.expected_annual_loss(each, HAZARD)["expected_annual_loss"] for each in (begins, same))
    assert float(found) == pytest.approx(float(expected), rel=1e-12)


def test_functions_that_are_refused():
    for levels, ratios, words in (
        ([0.1], [0.2], "at least 2 increasing intensities"),
        ([0.2, 0.1], [0.2, 0.3], "at least 2 increasing intensities"),
        ([0.1, 0.2], [0.2, 20.0], "from 0 to 1 .2 % is 0.02., got 0.2 to 20"),
        ([0.1, 0.2], [0.2, np.nan], r"mean_loss_ratio\[1\] is nan"),
        ([0.0, 0.2], [0.1, 0.2], "at intensity 0 is 0.1"),
    ):
        with pytest.raises(ValueError, match=words):
            wd.expected_annual_loss(function(levels, ratios), HAZARD)
    with pytest.raises(ValueError, match=r"'PGA' and that of the curves is 'SA\(1.0\)'"):
        wd.expected_annual_loss(function([0.1, 1.0], [0.0, 1.0], intensity_measure="SA(1.0)"), HAZARD)


REFUSED = {
    "a state missing": ({"slight": 0.02, "moderate": 0.1, "extensive": 0.5}, "complete missing"),
    "a state unknown": (RATIOS | {"collapse": 1.0}, "collapse unknown"),
    "percent": (RATIOS | {"complete": 100.0}, r"100; it is a share .*2 % is 0\.02"),
    "negative": (RATIOS | {"slight": -0.1}, "at least 0"),
    "falling": (RATIOS | {"moderate": 0.01}, r"'moderate' is 0.01, below that of the lighter state before it \(0.02\)"),
    "too wide": (RATIOS | {"slight": (0.02, 8.0)}, "8 is too large for a beta distribution of mean 0.02.*below 7"),
    "certain but wide": (RATIOS | {"complete": (1.0, 0.1)}, "too large for a beta"),
    "three numbers": (RATIOS | {"slight": (0.02, 0.1, 0.1)}, "mean and a coefficient of variation"),
}


@pytest.mark.parametrize("case", REFUSED)
def test_impossible_ratios_are_refused(case):
    ratios, words = REFUSED[case]
    with pytest.raises(ValueError, match=words):
        wd.annual_losses(curves(STATES), HAZARD, ratios)


def test_other_input_that_is_refused():
    with pytest.raises(TypeError, match="must map each damage state"):
        wd.vulnerability(curves(STATES), [0.1, 0.2])
    with pytest.raises(ValueError, match="increasing intensities"):
        wd.vulnerability(curves(STATES), RATIOS, intensity=[0.2, 0.1])
    with pytest.raises(ValueError, match="row of years above 0"):
        wd.annual_losses(curves(STATES), HAZARD, RATIOS, return_periods=[0])
    with pytest.raises(ValueError, match="'complete' has no fragility curve"):
        wd.vulnerability(curves(STATES | {"complete": (np.nan, np.nan)}), RATIOS)


NO_DATASET = {
    "annual_rates": (lambda given: wd.annual_rates(given, HAZARD), "give the result of fragility(run, limits)"),
    "disaggregate": (lambda given: wd.disaggregate(given, HAZARD), "give the result of fragility(run, limits)"),
    "rates_by_record": (
        lambda given: wd.rates_by_record(given, HAZARD),
        "give the result of capacities(scene, limits)",
    ),
    "check_risk_target": (
        lambda given: wd.check_risk_target(given, HAZARD),
        "give the result of fragility(run, limits)",
    ),
    "vulnerability": (lambda given: wd.vulnerability(given, RATIOS), "give the result of fragility(run, limits)"),
    "annual_losses": (
        lambda given: wd.annual_losses(given, HAZARD, RATIOS),
        "give the result of fragility(run, limits)",
    ),
    "expected_annual_loss": (
        lambda given: wd.expected_annual_loss(given, HAZARD),
        "give the result of vulnerability()",
    ),
    "portfolio_losses": (
        lambda given: wd.portfolio_losses(given, RATIOS, {}),
        "give the result of damage_shares(run, limits)",
    ),
    "storey_losses": (lambda given: wd.storey_losses(given, ([0, 1], [0, 1])), "give the result of simulate()"),
    "plots.disaggregation": (wd.plots.disaggregation, "draw the result of disaggregate("),
    "plots.vulnerability": (wd.plots.vulnerability, "draw the result of vulnerability("),
    "plots.loss_exceedance": (wd.plots.loss_exceedance, "draw the result of annual_losses("),
}


@pytest.mark.parametrize("name", NO_DATASET)
def test_what_is_no_dataset_is_refused(name):
    call, advice = NO_DATASET[name]
    for given in (None, [0.1]):
        with pytest.raises(TypeError) as error:
            call(given)
        found = rf"{re.escape(name)}\(\) takes a Dataset, got {type(given).__name__}( as \w+)?; {re.escape(advice)}"
        assert re.search(found, str(error.value))


def test_a_function_that_is_cut_off_is_warned_of():
    hazard = wd.HazardCurve([0.04, 10.0], [0.625, 1e-5])  # 1e-3 / x^2, to far beyond the functions
    whole = function([0.05, 0.1, 5.0, 6.0], [0.0, 0.001, 1.0, 1.0])
    with warnings.catch_warnings():
        warnings.simplefilter("error")
        wd.expected_annual_loss(whole, hazard)
    # 0.2 at 0.5: the step makes 0.2 * 4e-3, the line to 1.0 at 2.5 makes 0.4e-3 * (1 / 0.5 - 1 / 2.5): 56 %.
    with pytest.warns(UserWarning, match="begins at 0.5 g with a loss ratio of 0.2, .* is 56 % of the"):
        wd.expected_annual_loss(function([0.5, 2.5, 3.0], [0.2, 1.0, 1.0]), hazard)
    # From 0 at 0.1 to 0.2 at 0.2: 2e-3 * (1 / 0.1 - 1 / 0.2) = 1e-2. As steep in the logarithm beyond, it would be
    # 0.2 / ln 2 * 0.025 / 2 = 3.6e-3 more.
    with pytest.warns(UserWarning, match="ends at 0.2 g, where it still rises; .* would add 36 % to"):
        wd.expected_annual_loss(function([0.1, 0.2], [0.0, 0.2]), hazard)


def test_a_hazard_that_ends_before_the_function_is_warned_of():
    whole = function([0.1, 2.1], [0.0, 1.0])  # 0.5 a unit: 0.5e-3 * (1 / 0.1 - 1 / 2.1) a year
    short = wd.HazardCurve([0.04, 0.5], [0.625, 4e-3])
    # Above 0.5: 0.2 * 4e-3 by the step there, and 0.5e-3 * (1 / 0.5 - 1 / 2.1) from there on.
    share = (0.8e-3 + 0.5e-3 * (2 - 1 / 2.1)) / (0.5e-3 * (10 - 1 / 2.1))
    with pytest.warns(UserWarning, match=rf"expected_annual_loss: {100 * share:.2g} % of .* above the last point"):
        wd.expected_annual_loss(whole, short)


def test_a_building_without_losses_is_drawn():
    found = wd.annual_losses(curves(STATES), HAZARD, dict.fromkeys(STATES, 0.0))
    wd.plots.loss_exceedance(found)
    plt.close("all")


def test_return_periods_given_as_rates_are_told():
    with pytest.warns(
        UserWarning, match=r"return period in return_periods \(as a rate, of 475 years\) is .* given as an annual rate"
    ):
        wd.annual_losses(curves(STATES), HAZARD, RATIOS, return_periods=[1 / 475])


def test_a_loss_exceeded_exactly_once_per_return_period_is_that_of_the_period():
    # A curve of steps: a ratio below 0.3 is exceeded 0.5 times per year, one from 0.3 on 0.25 times, and 1 never.
    grid, rates = np.array([0.0, 0.5, 1.0]), np.array([0.5, 0.25, 0.0])
    calls = []

    def rate_of_loss(ratio):
        calls.append(ratio)
        return 0.5 if ratio < 0.3 else 0.25

    assert _least_loss(rate_of_loss, grid, rates, 0.25) == pytest.approx(0.3, abs=1e-9)
    assert max(calls) < 0.5  # in the first interval, whose end is exceeded exactly once in 4 years
    assert _least_loss(rate_of_loss, grid, rates, 0.5) == 0.0  # no loss is exceeded more often than once in 2 years
