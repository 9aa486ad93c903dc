"""A limit of math.inf, which collapse alone passes, in every function that takes limits."""

from __future__ import annotations

import math

import numpy as np
import pytest
import statsmodels.api as sm
from scipy.stats import norm
from test_cloud_curves import make_cloud, with_collapses
from test_damage import LIMITS as CITY_LIMITS, made
from test_fragility import synthetic_run, with_status

import warpdyn as wd
from warpdyn.campaigns.reductions.damage.counts import Bounds
from warpdyn.campaigns.reductions.limits import limits_by_archetype

pytestmark = [pytest.mark.fast, pytest.mark.meant_as_given("drift_limit")]
LIMITS = {"light": 0.02, "collapse": math.inf}


def probit(intensity: np.ndarray, passed: np.ndarray) -> tuple[float, float]:
    """Return median and dispersion by statsmodels' probit on ln intensity."""
    fit = sm.GLM(
        passed.astype(float),
        sm.add_constant(np.log(intensity)),
        sm.families.Binomial(link=sm.families.links.Probit()),
    ).fit(tol=1e-12)
    return float(np.exp(-fit.params[0] / fit.params[1])), float(1 / fit.params[1])


def run_with_collapses():
    """Return a run in which samples collapse at random, more often at high levels."""
    run = synthetic_run(3)
    share = 0.5 * run["im_level"].values / 2.0
    collapsed = np.random.default_rng(4).random(share.size) < share
    return with_status(run, collapsed, 1), collapsed


@pytest.mark.parametrize("estimator", ["lognormal", "ordinal", "logit"])
def test_the_curve_of_an_infinite_limit_is_that_of_collapse(estimator):
    run, collapsed = run_with_collapses()
    curves = wd.fragility(run, LIMITS, estimator=estimator, replicates=2)
    levels = run["im_level"].values
    counted = [int(collapsed[levels == level].sum()) for level in np.unique(levels)]
    assert curves["exceeding_samples"].sel(damage_state="collapse").values.tolist() == counted
    assert np.isinf(curves["damage_limit"].sel(damage_state="collapse"))
    if estimator == "lognormal":
        median, dispersion = probit(levels, collapsed)
        # statsmodels stops where the deviance changes by 1e-12 of itself.
        assert float(curves["fragility_median"][1]) == pytest.approx(median, rel=1e-5)
        assert float(curves["fragility_dispersion"][1]) == pytest.approx(dispersion, rel=1e-5)


def test_a_run_without_collapses_has_no_curve_of_collapse_and_the_warning_says_why():
    with pytest.warns(UserWarning, match="'collapse' has no lognormal fit.*collapse_drift_ratio"):
        curves = wd.fragility(synthetic_run(3), LIMITS)
    assert np.isnan(curves["fragility_median"].sel(damage_state="collapse"))
    assert np.isfinite(curves["fragility_median"].sel(damage_state="light"))


def test_of_several_demands_an_infinite_limit_is_passed_by_collapse_alone():
    run, collapsed = run_with_collapses()
    limits = {"light": {"peak_storey_drift_ratio": 0.02}, "collapse": {"peak_storey_drift_ratio": math.inf}}
    curves = wd.fragility(run, limits, replicates=2)
    assert int(curves["exceeding_samples"].sel(damage_state="collapse").sum()) == collapsed.sum()


@pytest.mark.parametrize("estimator", ["censored", "collapse"])
def test_a_cloud_has_a_curve_of_collapse_with_either_estimator(estimator):
    intensity, drift, collapsed = with_collapses()
    cloud = make_cloud(intensity, drift, collapsed)
    both = wd.fragility_of_cloud(cloud, {"light": 0.02, "collapse": math.inf}, estimator=estimator)
    median, dispersion = probit(np.asarray(intensity), np.asarray(collapsed))
    # The fractiles are found by bisection to rounding; statsmodels stops at 1e-12 of the deviance.
    assert float(both["fragility_median"][1]) == pytest.approx(median, rel=1e-5)
    assert float(both["fragility_dispersion"][1]) == pytest.approx(dispersion, rel=1e-5)
    alone = wd.fragility_of_cloud(cloud, {"light": 0.02}, estimator=estimator)
    for name in ("fragility_median", "fragility_dispersion", "fragility_median_lower"):
        assert float(both[name][0]) == float(alone[name][0])  # the other states are as without it
    hazard = wd.HazardCurve([0.1, 0.5, 1.0, 2.0, 9.0], [1e-1, 1e-2, 2e-3, 2e-4, 1e-7], measure="PGA")
    rate = wd.annual_rates(both, hazard)["annual_rate"].values[1]
    level = np.geomspace(0.05, 9.0, 20001)  # the integral of the curve over the rate, by the trapezoidal rule
    probable = norm.cdf(np.log(level / median) / dispersion)
    expected = -np.trapezoid(probable, hazard.rate_of(level))
    # Of 20,000 intervals the rule's error is far below the bisection of the fractiles and statsmodels' tolerance.
    assert rate == pytest.approx(expected, rel=1e-3)
    wd.plots.cloud_regression(cloud, both)


def test_a_cloud_without_collapses_has_none():
    intensity, drift, _ = with_collapses()
    with pytest.warns(UserWarning, match="'collapse' has no curve.*0 of 200 samples collapsed"):
        curves = wd.fragility_of_cloud(make_cloud(intensity, drift), {"light": 0.02, "collapse": math.inf})
    assert np.isnan(curves["fragility_median"][1])


def test_shares_of_a_portfolio_count_collapses_alone():
    status = np.zeros(20, dtype=np.int8)
    status[[2, 7, 13]] = 1
    run, limits = (
        made(status=status),
        {name: {"slight": of["slight"], "complete": math.inf} for name, of in CITY_LIMITS.items()},
    )
    finite = wd.damage_shares(run, CITY_LIMITS)
    shares = wd.damage_shares(run, limits)
    counted = (shares["archetype_damage_share"] * shares["counted_buildings"]).sel(damage_state="complete").sum()
    assert float(counted) == pytest.approx(3, rel=1e-12)
    none = shares["damage_share"].sel(damage_state="none").values
    assert none.tolist() == finite["damage_share"].sel(damage_state="none").values.tolist()


def test_counts_where_samples_run_have_the_limit_too():
    states, table = limits_by_archetype(["a"], {"a": {"slight": 0.01, "complete": math.inf}})
    assert states == ["none", "slight", "complete"]
    assert np.isinf(table[0, 1])
    with pytest.raises(ValueError, match="archetype 'a': limits must increase"):
        limits_by_archetype(["a"], {"a": {"slight": math.inf, "complete": math.inf}})
    bounds = Bounds(["none", "slight", "complete"], ("d",), [np.array([[0.01, math.inf]])], by_archetype=False)
    assert np.isinf(bounds.compared[0][0, 1:]).all()  # no demand is above it: the state is reached by collapse alone


def test_figures_leave_out_the_infinite_limit():
    run, _ = run_with_collapses()
    run["im_level"].attrs["design"] = "stripes"
    result = run.merge(wd.fragility(run, LIMITS, replicates=2), combine_attrs="no_conflicts")
    for draw in (wd.plots.drift_over_height, wd.plots.drift_against_intensity, wd.plots.fragility_curves):
        draw(result)
