"""Rates and losses of fragility curves that are not lognormal, and of curves that cross, against closed forms, quad."""

import warnings
from itertools import pairwise

import numpy as np
import pytest
import xarray as xr
from fragility_parameters import curves
from plotted_runs import striped_run
from scipy.integrate import quad
from scipy.special import expit, ndtr
from test_cloud_curves import make_cloud, with_collapses

import warpdyn as wd
from warpdyn.answers.fragility.estimators import FIT_MEANINGS
from warpdyn.answers.risk.curves.curve_set import CurveSet

pytestmark = [pytest.mark.fast, pytest.mark.meant_as_given("drift_limit")]

# A curve of many slopes, one of them level; states whose mass lies in several segments.
BENT = wd.HazardCurve([0.0025, 0.01, 0.1, 0.3, 1.0, 3.0], [0.5, 0.3, 0.02, 0.02, 1e-4, 1e-6])
STATES = {"slight": (0.2, 0.3), "complete": (0.5, 0.6)}
LOGISTIC = np.pi / np.sqrt(3)  # standard deviation of the logistic distribution
# quad is asked for 1e-11; where a rate is a difference of parts, a digit or two is lost.
CLOSE = 1e-9


def loglogistic(states, **how):
    return curves(states, **how).assign_attrs(fragility_shape="loglogistic")


def probability_of_logistic(u, median, dispersion):
    return expit(LOGISTIC * (u - np.log(median)) / dispersion)


def table(levels, probable, name="fragility_curve", along="intensity", **attributes):
    states = [f"state {i}" for i in range(len(probable))]
    return xr.Dataset(
        {name: (("damage_state", along), np.array(probable, dtype=float))},
        {along: (along, np.array(levels, dtype=float), {"units": "g"}), "damage_state": states},
        attributes,
    )


def integrated(probability, hazard=BENT, low=1e-30, high=1e7, kinks=()):
    """Integrate a function of ln(intensity) over the rate of occurrence of intensities, from kink to kink."""
    points, rates = np.log(hazard.intensity), np.log(hazard.annual_rate)
    slopes = -np.diff(rates) / np.diff(points)
    inner = [*points, *np.log([*kinks, 1e-20, 1e-12, 1e-6, 0.05, 0.2, 0.5, 2.0, 10.0])]
    edges = np.unique([np.log(low), *[u for u in inner if np.log(low) < u < np.log(high)], np.log(high)])
    total = 0.0
    for a, b in pairwise(edges):
        segment = int(np.clip(np.searchsorted(points, 0.5 * (a + b)) - 1, 0, slopes.size - 1))

        def occurring(u, k=slopes[segment], at=points[segment], rate=rates[segment]):
            return probability(u) * k * np.exp(rate - k * (u - at))

        total += quad(occurring, a, b, epsabs=0, epsrel=1e-11, limit=400)[0]
    return total


@pytest.mark.parametrize(("k", "median", "dispersion"), [(2.0, 0.5, 0.4), (1.0, 0.2, 0.9), (3.0, 1.0, 0.55)])
def test_loglogistic_curves_over_a_power_law_have_a_closed_form(k, median, dispersion):
    # The mean of a power of a loglogistic capacity: theta^-k (pi k s) / sin(pi k s), with s = sqrt(3) beta / pi.
    hazard = wd.HazardCurve([0.15, 5.0], 1e-3 * np.array([0.15, 5.0]) ** -k)
    s = dispersion / LOGISTIC
    truth = 1e-3 * median**-k * np.pi * k * s / np.sin(np.pi * k * s)
    with warnings.catch_warnings():
        warnings.simplefilter("ignore", UserWarning)  # of what is extrapolated, which is the same power law
        found = wd.annual_rates(loglogistic({"complete": (median, dispersion)}), hazard)
        parts = wd.disaggregate(loglogistic({"complete": (median, dispersion)}), hazard)
    # Some 1,000 terms, each rounded by 1e-16 times the slope's exponent of up to 100.
    assert float(found["annual_rate"][0]) == pytest.approx(truth, rel=1e-12)
    whole = parts["contribution"].sum("intensity") + parts["share_below_bins"] + parts["share_above_bins"]
    np.testing.assert_allclose(whole, 1.0, rtol=1e-12)
    assert "quadrature" in found.attrs["rate_method"]


@pytest.mark.parametrize("state", STATES)
def test_loglogistic_rates_and_their_parts_agree_with_quad(state):
    found = wd.annual_rates(loglogistic(STATES), BENT).sel(damage_state=state)

    def probable(u):
        return probability_of_logistic(u, *STATES[state])

    assert float(found["annual_rate"]) == pytest.approx(integrated(probable), rel=CLOSE)
    parts = wd.disaggregate(loglogistic(STATES), BENT, bins=10).sel(damage_state=state)
    for i in (2, 5, 8):
        ends = [float(parts[f"intensity_{side}"][i]) for side in ("lower", "upper")]
        assert float(parts["annual_rate_of_bin"][i]) == pytest.approx(integrated(probable, BENT, *ends), rel=CLOSE)


def test_a_tail_that_falls_no_faster_than_the_hazard_rises_is_refused():
    steep = wd.HazardCurve([0.1, 1.0], [1e-1, 1e-4])  # slope 3; the tail of a dispersion of 0.7 falls by 2.6
    for function in (wd.annual_rates, wd.disaggregate):
        with pytest.raises(ValueError, match=r"rate of 'wide' is infinite: below the first point .*\(0.1 g\)"):
            function(loglogistic({"narrow": (0.5, 0.3), "wide": (0.6, 0.7)}), steep)


def test_logit_curves_of_a_run_are_taken_with_their_replicates():
    limits = {"slight": 0.008, "moderate": 0.02}
    fitted = wd.fragility(striped_run(), limits, estimator="logit")
    hazard = wd.HazardCurve(BENT.intensity, BENT.annual_rate, measure="PGA")
    found = wd.annual_rates(fitted, hazard)
    assert (found["annual_rate_lower"] < found["annual_rate"]).all()
    assert (found["annual_rate"] < found["annual_rate_upper"]).all()
    for row in (0, 123, 999):
        own = {
            state: tuple(float(fitted[f"replicate_{name}"][row, i]) for name in ("median", "dispersion"))
            for i, state in enumerate(limits)
        }
        truth = [integrated(lambda u, own=own[state]: probability_of_logistic(u, *own)) for state in limits]
        np.testing.assert_allclose(found["replicate_annual_rate"][row], truth, rtol=CLOSE)
    losses = wd.annual_losses(fitted, hazard, {"slight": 0.1, "moderate": 0.4})
    assert losses["expected_annual_loss_lower"] < losses["expected_annual_loss"] < losses["expected_annual_loss_upper"]


def test_a_state_without_replicates_takes_none_from_the_others():
    medians, spread = np.full((50, 2), [0.2, np.nan]), np.full((50, 2), [0.3, np.nan])
    found = wd.annual_rates(loglogistic(STATES, replicates=(medians, spread)), BENT)
    np.testing.assert_allclose(found["annual_rate_upper"], [found["annual_rate"][0], np.nan], rtol=1e-12)
    for make in (curves, loglogistic):  # of the heavier state nothing is known, and so of the loss
        losses = wd.annual_losses(make(STATES, replicates=(medians, spread)), BENT, {"slight": 0.1, "complete": 1.0})
        assert np.isnan(losses["expected_annual_loss_upper"])


def test_curves_of_demand_and_collapse_agree_with_quad():
    im, edp, collapsed = with_collapses()
    limits = {"slight": 0.02, "complete": 0.05}
    fitted = wd.fragility_of_cloud(make_cloud(im, edp, collapsed), limits, estimator="collapse")
    hazard = wd.HazardCurve(BENT.intensity, BENT.annual_rate, measure="PGA")
    found = wd.annual_rates(fitted, hazard)
    intercept, slope, deviation, median, dispersion = (
        float(fitted[name])
        for name in (
            "regression_intercept",
            "regression_slope",
            "regression_deviation",
            "collapse_median",
            "collapse_dispersion",
        )
    )
    for i, limit in enumerate(limits.values()):

        def probable(u, limit=limit):
            exceeds = ndtr((intercept + slope * u - np.log(limit)) / deviation)
            falls = ndtr((u - np.log(median)) / dispersion)
            return exceeds + falls - exceeds * falls

        # The curve is 1 minus a product, to 1e-16, at rates of up to 1e3 times that of the state.
        assert float(found["annual_rate"][i]) == pytest.approx(integrated(probable), rel=1e-9)
    assert (found["annual_rate_lower"] < found["annual_rate"]).all()
    assert (found["annual_rate"] < found["annual_rate_upper"]).all()
    one = wd.annual_rates(fitted.sel(damage_state="complete"), hazard)
    assert float(one["annual_rate"][0]) == pytest.approx(float(found["annual_rate"][1]), rel=1e-12)
    with pytest.raises(ValueError, match="has no regression_slope: give all that fragility_of_cloud"):
        wd.annual_rates(fitted.drop_vars("regression_slope"), hazard)


def test_risk_targets_and_vulnerability_of_other_shapes():
    given = loglogistic(STATES)
    with pytest.raises(ValueError, match=r"curves have another shape: give design_intensity= \[g\]"):
        wd.check_risk_target(given, BENT)
    found = wd.check_risk_target(given, BENT, 0.3)
    assert float(found["conditional_probability"]) == pytest.approx(expit(LOGISTIC * np.log(0.3 / 0.5) / 0.6))
    assert float(found["probability_of_collapse"]) == pytest.approx(
        -np.expm1(-50 * integrated(lambda u: probability_of_logistic(u, *STATES["complete"]))), rel=CLOSE
    )
    for each in (given, table([0.1, 0.4, 1.0], [[0.0, 0.6, 1.0]])):
        ratios = dict.fromkeys(each["damage_state"].values.tolist(), 0.5)
        drawn = wd.vulnerability(each, ratios)
        assert float(drawn["mean_loss_ratio"][-1]) == pytest.approx(0.5, rel=0.01)  # three dispersions above
    np.testing.assert_allclose(drawn["intensity"][[0, -1]], [0.1, 1.0])


CROSSING = {"slight": (0.3, 0.8), "moderate": (0.4, 0.3), "complete": (0.6, 0.7)}
RATIOS = {"slight": 0.1, "moderate": 0.3, "complete": 1.0}


def lowest_of_lighter(u, place, shape=ndtr):
    return min(float(shape((u - np.log(m)) / b)) for m, b in list(CROSSING.values())[: place + 1])


@pytest.mark.parametrize("logit", [False, True])
def test_losses_of_curves_that_cross_are_those_of_the_lower_probability(logit):
    given = (loglogistic if logit else curves)(CROSSING)
    with pytest.warns(UserWarning, match="curves of 'slight' and 'moderate' cross"):
        found = wd.annual_losses(given, BENT, RATIOS)
    crossings = [
        np.exp((np.log(m) * d - np.log(n) * b) / (d - b))
        for m, b in CROSSING.values()
        for n, d in CROSSING.values()
        if b != d
    ]
    shape = (lambda z: expit(LOGISTIC * z)) if logit else ndtr
    reached = [
        integrated(lambda u, i=i: lowest_of_lighter(u, i, shape), kinks=[x for x in crossings if 1e-9 < x < 1e7])
        for i in range(3)
    ]
    # By quadrature a kink within a panel costs some (width / 16)^2 of what comes from there.
    close = {"rtol": 1e-3 if logit else CLOSE}
    np.testing.assert_allclose(found["annual_rate_of_state"], -np.diff([*reached, 0.0]), **close)
    loss = -np.diff([*reached, 0.0]) @ list(RATIOS.values())
    np.testing.assert_allclose(found["expected_annual_loss"], loss, **close)


def test_both_ways_to_the_expected_loss_agree_where_curves_cross():
    with warnings.catch_warnings():
        warnings.simplefilter("ignore", UserWarning)
        levels = np.geomspace(1e-3, 50.0, 6000)
        ratio = wd.vulnerability(curves(CROSSING), RATIOS, intensity=levels)
        by_function = wd.expected_annual_loss(ratio, BENT)["expected_annual_loss"]
        by_rates = wd.annual_losses(curves(CROSSING), BENT, RATIOS)["expected_annual_loss"]
    # Points 0.18 % apart: a line is off by (0.0018 / 0.3)^2 / 12 of the function.
    assert float(by_function) == pytest.approx(float(by_rates), rel=1e-5)


def test_replicates_that_cross_are_ordered_too():
    medians = np.array([[0.3, 0.4, 0.6], [0.35, 0.3, 0.9]])
    spread = np.array([[0.8, 0.3, 0.7], [0.5, 0.5, 0.2]])  # the second row: one pair never crosses, and is in disorder
    found = CurveSet.from_dataset("test", curves(CROSSING, (medians, spread)))
    tree = wd.HazardLogicTree([BENT], [1.0])
    rates = found.sampled_rates(tree, ordered=True)[:, 0]
    for row in range(2):
        pairs = list(zip(medians[row], spread[row], strict=True))
        for place in range(3):

            def probable(u, part=pairs[: place + 1]):
                return min(ndtr((u - np.log(m)) / b) for m, b in part)

            crossings = [
                np.exp((np.log(m) * d - np.log(n) * b) / (d - b)) for m, b in pairs for n, d in pairs if b != d
            ]
            truth = integrated(probable, kinks=[x for x in crossings if 1e-9 < x < 1e7])
            assert rates[row, place] == pytest.approx(truth, rel=CLOSE)


def test_penalised_fits_are_told_once(tmp_path):
    status = ("damage_state", np.array([0, FIT_MEANINGS.index("penalised")], np.int8))
    given = curves(STATES).assign(fit_status=status)
    calls = {
        "annual_rates": lambda: wd.annual_rates(given, BENT),
        "disaggregate": lambda: wd.disaggregate(given, BENT),
        "vulnerability": lambda: wd.vulnerability(given, {"slight": 0.1, "complete": 1.0}),
        "annual_losses": lambda: wd.annual_losses(given, BENT, {"slight": 0.1, "complete": 1.0}),
        "check_risk_target": lambda: wd.check_risk_target(given, BENT),
        "hazard_and_rates": lambda: wd.plots.hazard_and_rates(given, BENT),
        "write_nrml_fragility": lambda: wd.write_nrml_fragility(
            {"A": given.assign_attrs(intensity_measure="PGA")}, tmp_path / "model.xml", no_damage_limit=0.01
        ),
    }
    for name, call in calls.items():
        with warnings.catch_warnings(record=True) as told:
            warnings.simplefilter("always")
            call()
        words = [str(each.message) for each in told if "penalised" in str(each.message)]
        assert len(words) == 1, name
        assert "stripes of 'complete' are separated" in words[0]
    with warnings.catch_warnings():
        warnings.simplefilter("error")
        wd.annual_rates(given.sel(damage_state="slight"), BENT)


def test_rates_of_curves_that_cross_are_told_of_as_losses_are():
    with pytest.warns(
        UserWarning,
        match="the probability of the heavier state is higher by up to .* each rate is that of the state's curve",
    ):
        found = wd.annual_rates(curves(CROSSING), BENT)
    alone = [wd.annual_rates(curves({name: CROSSING[name]}), BENT)["annual_rate"].item() for name in CROSSING]
    np.testing.assert_allclose(found["annual_rate"], alone, rtol=1e-12)
    with warnings.catch_warnings():
        warnings.simplefilter("error")
        wd.annual_rates(curves(STATES), BENT)


@pytest.mark.parametrize(
    ("name", "along", "noise"), [("fragility_curve", "intensity", 5e-4), ("exceedance_fraction", "stripe", 0.05)]
)
def test_a_table_that_falls_with_the_intensity_is_told(name, along, noise):
    def table(row):
        levels = np.geomspace(0.02, 4.0, len(row))
        return xr.Dataset({name: (("damage_state", along), [row])}, {"damage_state": ["moderate"], along: levels})

    # The probability of being in the state, which a heavier one takes over.
    with pytest.warns(
        UserWarning, match=rf"{name} of damage state 'moderate' falls from 0.7 .* to 0.2 .*reaching or exc"
    ):
        wd.annual_rates(table([0.0, 0.3, 0.7, 0.2, 0.0]), BENT)
    with warnings.catch_warnings():
        warnings.filterwarnings("error", message=".*falls from")
        wd.annual_rates(table([0.0, 0.3, 0.7, 0.7 - noise, 1.0]), BENT)
