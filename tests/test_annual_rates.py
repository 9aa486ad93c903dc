"""Annual rates: closed forms, quadrature, pyFragility's sums, disaggregation, intervals, records."""

from itertools import pairwise

import numpy as np
import pyFragility
import pytest
import xarray as xr
from fragility_parameters import curves
from plotted_runs import striped_run
from scipy.integrate import quad
from scipy.optimize import brentq
from scipy.special import ndtr
from scipy.stats import norm

import warpdyn as wd
from warpdyn.answers.risk.annual_rates import weighted_bounds

pytestmark = pytest.mark.fast

# A curve of many slopes, one of them level, and two states whose mass lies in several segments.
BENT = wd.HazardCurve([0.0025, 0.01, 0.1, 0.3, 1.0, 3.0], [0.5, 0.3, 0.02, 0.02, 1e-4, 1e-6])
STATES = {"slight": (0.2, 0.3), "complete": (0.5, 0.6)}
WOOD_FRAME = pyFragility.datasets.load_msa_wood_frame()


def power_law(k0, k, lowest=1e-3, highest=1e3, points=9):
    intensity = np.geomspace(lowest, highest, points)
    return wd.HazardCurve(intensity, k0 * intensity**-k)


def rate_by_quadrature(hazard, median, dispersion, low, high):
    """Integrate a fragility curve over the rate of occurrence between two intensities, segment by segment."""

    def integrand(u, slope):
        return ndtr((u - np.log(median)) / dispersion) * slope * float(hazard.rate_of(np.exp(u)))

    total = 0.0
    edges = np.log([low, *[x for x in hazard.intensity if low < x < high], high])
    for a, b in pairwise(edges):
        step = 1e-4 * (b - a)
        slope = -np.log(hazard.rate_of(np.exp(b - step)) / hazard.rate_of(np.exp(a + step))) / (b - a - 2 * step)
        total += quad(integrand, a, b, args=(slope,), epsabs=0, epsrel=1e-11, limit=200)[0]
    return total


@pytest.mark.meant_as_given("annual_rate")
@pytest.mark.parametrize("points", [2, 9])
@pytest.mark.parametrize(
    ("k0", "k", "median", "dispersion", "rate"),
    [(1e-4, 2.5, 1.0, 0.4, 1.64872127070013e-4), (2e-4, 3.0, 0.8, 0.5, 1.20320970660861e-3)],
)
def test_power_law_hazard_has_cornells_closed_form(k0, k, median, dispersion, rate, points, measured):
    # Fifteen digits are published; a sum of ten terms of exponentials of rounded logarithms keeps twelve.
    found = wd.annual_rates(curves({"complete": (median, dispersion)}), power_law(k0, k, points=points))
    measured(
        "annual rate of a lognormal curve under a power-law hazard",
        truth="Cornell's closed form, k0 median^-k exp((k dispersion)^2 / 2), to fifteen digits",
        value=abs(float(found["annual_rate"][0]) / rate - 1),
        bound=1e-12,
    )
    assert float(found["return_period"][0]) == pytest.approx(1 / rate, rel=1e-12)
    assert float(found["probability_in_period"][0]) == pytest.approx(1 - np.exp(-50 * rate), rel=1e-11)


@pytest.mark.parametrize("state", STATES)
def test_rates_of_bent_curves_agree_with_quadrature(state, measured):
    found = wd.annual_rates(curves(STATES), BENT).sel(damage_state=state)
    truth = rate_by_quadrature(BENT, *STATES[state], 1e-8, 1e6)
    measured(
        "annual rates under a hazard curve of many slopes",
        truth="scipy's adaptive quadrature of the same integral",
        value=abs(float(found["annual_rate"]) / truth - 1),
        bound=1e-9,  # of the slopes by differences
    )


@pytest.mark.meant_as_given("annual_rate")
def test_steep_segments_and_small_dispersions_neither_overflow_nor_vanish():
    steep = wd.HazardCurve([0.1, 1.0, 1.1, 5.0], [1e-1, 1e-3, 1e-12, 1e-40])  # slopes of 2, 217 and 42
    with pytest.warns(UserWarning, match="'wide' comes from intensities below"):
        found = wd.annual_rates(curves({"wide": (1.0, 1.5), "sharp": (0.5, 1e-6)}), steep)["annual_rate"]
    assert float(found[0]) == pytest.approx(rate_by_quadrature(steep, 1.0, 1.5, 1e-6, 20.0), rel=1e-6)
    # A capacity without scatter is exceeded as often as its intensity, to the order of the dispersion.
    assert float(found[1]) == pytest.approx(float(steep.rate_of(0.5)), rel=1e-9)


@pytest.mark.parametrize("building", ["B1-Existing", "B2-Existing", "B4-Existing"])
def test_rates_agree_with_pyfragility(building, measured):
    # It interpolates rates by a cubic spline where we take logarithms: given our curve at 2,000 points it has ours. Its
    # sum of 20,000 midpoints is then off by the square of the cells' width, some 1e-7. (At the data's 16 points alone,
    # whose slope changes from 3.6 to 0.4 at 2 g, spline and power laws differ by 1 to 7 %.)
    data = WOOD_FRAME
    hazard = wd.HazardCurve(data.hazard.im, data.hazard.annual_rate)
    fit = pyFragility.fit_msa(data.im, data.counts[building], [data.num_gm] * 16)
    median, dispersion = fit.params
    assert fit.probability([median, median * np.exp(dispersion)]) == pytest.approx([0.5, norm.cdf(1)])
    points = np.geomspace(data.im[0], data.im[-1], 2001)
    dense = pyFragility.HazardCurve(points, hazard.rate_of(points))
    theirs = pyFragility.mean_annual_frequency(fit, dense, np.linspace(data.im[0], data.im[-1], 20_001))
    ours = wd.disaggregate(curves({"collapse": (median, dispersion)}), hazard)
    measured(
        "annual rates of collapse of three wood frames",
        truth="pyFragility's mean_annual_frequency",
        value=abs(float(ours["annual_rate_of_bin"].sum()) / theirs - 1),
        bound=1e-6,
    )


def test_extrapolation_is_said():
    short = wd.HazardCurve([0.1, 0.2, 0.4], [1e-2, 2e-3, 3e-4])
    with pytest.warns(UserWarning, match=r"% of 'complete' comes from intensities above the last point .*\(0.4 g\)"):
        found = wd.annual_rates(curves({"complete": (0.8, 0.4)}), short)
    whole = float(found["annual_rate"][0])
    above = rate_by_quadrature(short, 0.8, 0.4, 0.4, 1e3)
    assert float(found["share_above_hazard"][0]) == pytest.approx(above / whole, rel=1e-8)
    assert float(found["share_below_hazard"][0]) == pytest.approx(
        rate_by_quadrature(short, 0.8, 0.4, 1e-4, 0.1) / whole, rel=1e-6
    )


def test_disaggregation_by_intensity():
    found = wd.disaggregate(curves(STATES), BENT, bins=25)
    for i, (median, dispersion) in enumerate(STATES.values()):
        for j in (5, 12, 20):
            ends = float(found["intensity_lower"][j]), float(found["intensity_upper"][j])
            truth = rate_by_quadrature(BENT, median, dispersion, *ends)
            assert float(found["annual_rate_of_bin"][i, j]) == pytest.approx(truth, rel=1e-7)
    whole = found["contribution"].sum("intensity") + found["share_below_bins"] + found["share_above_bins"]
    np.testing.assert_allclose(whole, 1.0, rtol=1e-12)
    np.testing.assert_allclose(found["annual_rate"], wd.annual_rates(curves(STATES), BENT)["annual_rate"], rtol=1e-12)


@pytest.mark.meant_as_given("annual_rate")
def test_the_mode_of_a_power_law():
    # The density in the logarithm is Phi(z) x^-k, whose largest value has phi(z) / Phi(z) = k beta.
    k, median, beta = 2.5, 1.0, 0.4
    z = brentq(lambda z: norm.pdf(z) / norm.cdf(z) - k * beta, -5, 5)
    found = wd.disaggregate(curves({"complete": (median, beta)}), power_law(1e-4, k), lowest=0.1, highest=10, bins=200)
    width = np.log(100) / 200
    assert np.log(float(found["modal_intensity"][0]) / median) == pytest.approx(beta * z, abs=width)


def test_replicates_and_branches_are_carried_to_intervals():
    generator = np.random.default_rng(3)
    medians = 0.5 * np.exp(0.1 * generator.standard_normal((2000, 1)))
    replicates = medians, np.full((2000, 1), 0.4)
    given = curves({"complete": (0.5, 0.4)}, replicates)
    hazard = wd.HazardCurve([1e-2, 10.0], [0.5, 0.5 * 1e-3**2])  # slope 2
    found = wd.annual_rates(given, hazard)
    # With one slope k the rate goes by median^-k, so that ln rate has k times the deviation of ln median.
    spread = np.log(float(found["annual_rate_upper"][0]) / float(found["annual_rate_lower"][0]))
    quantiles = np.quantile(np.log(medians), [0.025, 0.975])
    assert spread == pytest.approx(2 * np.diff(quantiles)[0], rel=0.01)  # two definitions of a quantile of 2000
    assert float(found["return_period_lower"][0]) == pytest.approx(1 / float(found["annual_rate_upper"][0]))
    assert "2000 replicates" in found.attrs["interval_method"]

    double = wd.HazardCurve([1e-2, 10.0], [0.9, 0.9 * 1e-3**2])
    tree = wd.HazardLogicTree([hazard, double], [0.75, 0.25])
    both = wd.annual_rates(given, tree)
    single = wd.annual_rates(given, double)
    mean = 0.75 * float(found["annual_rate"][0]) + 0.25 * float(single["annual_rate"][0])
    assert float(both["annual_rate"][0]) == pytest.approx(mean, rel=1e-12)
    np.testing.assert_allclose(both["branch_annual_rate"][:, 0], [found["annual_rate"][0], single["annual_rate"][0]])
    assert float(both["annual_rate_upper"][0]) > float(found["annual_rate_upper"][0])

    alone = wd.annual_rates(curves({"complete": (0.5, 0.4)}), hazard)
    assert np.isnan(alone["annual_rate_lower"]).all()
    assert alone.attrs["interval_method"].startswith("none")


def test_replicates_without_a_fit_give_no_interval_when_they_are_many():
    generator = np.random.default_rng(1)
    medians = np.exp(0.1 * generator.standard_normal((100, 2))) * [0.2, 0.5]
    dispersions = np.full((100, 2), 0.4)
    states = {"slight": (0.2, 0.4), "complete": (0.5, 0.4)}
    medians[:4, 1] = np.nan
    kept = wd.annual_rates(curves(states, (medians, dispersions)), BENT)
    without = wd.annual_rates(curves(states, (medians[4:], dispersions[4:])), BENT)
    for side in ("lower", "upper"):
        # Dropped replicates weigh nothing.
        assert float(kept[f"annual_rate_{side}"][1]) == pytest.approx(
            float(without[f"annual_rate_{side}"][1]), rel=1e-12
        )
    medians[:6, 1] = np.nan
    dropped = wd.annual_rates(curves(states, (medians, dispersions)), BENT)["annual_rate_upper"]
    assert np.isfinite(dropped[0])
    assert np.isnan(dropped[1])
    losses = wd.annual_losses(curves(states, (medians, dispersions)), BENT, {"slight": 0.1, "complete": 1.0})
    assert np.isnan(losses["expected_annual_loss_upper"])
    assert np.isfinite(losses["expected_annual_loss"])
    none = wd.annual_rates(curves(states, (np.full((100, 2), np.nan), dispersions)), BENT)
    assert "replicate_annual_rate" not in none


def test_weighted_bounds_are_quantiles():
    values = np.random.default_rng(0).normal(size=(4001, 1, 1))
    low, high = weighted_bounds(values, np.ones(1), 0.9)
    hazen = np.quantile(values, [0.05, 0.95], method="hazen")  # values in the middle of their weights, as ours
    np.testing.assert_allclose([low[0], high[0]], hazen, rtol=1e-9)
    # Of two branches the heavier one holds the middle.
    branches = np.array([[[1.0], [2.0]]])
    assert weighted_bounds(branches, np.array([0.9, 0.1]), 0.5)[0, 0] == 1.0


SLOPES = wd.HazardCurve([0.05, 0.5, 5.0], [1e-2, 1e-3, 1e-5])


def capacities(values, width=1.1):
    """Return capacities [structure][motion] of one state, with brackets of this ratio each way."""
    capacity = np.array(values, dtype=float)[..., None]
    lower, upper = np.where(np.isinf(capacity), 2.0, capacity / width), capacity * width
    upper = np.where(capacity == 0, 0.04, upper)
    along = "structure", "motion", "damage_state"
    variables = {"capacity": (along, capacity, {"units": "g"})}
    variables |= {"capacity_lower": (along, lower), "capacity_upper": (along, upper)}
    return xr.Dataset(variables, {"damage_state": ["complete"]}, {"intensity_measure": ""})


def log_rate(capacity):
    return np.exp(np.interp(np.log(capacity), np.log([0.05, 0.5, 5.0]), np.log([1e-2, 1e-3, 1e-5])))


def test_rates_by_record():
    with pytest.warns(UserWarning, match="17 % of the capacities of 'complete' are above the highest level"):
        found = wd.rates_by_record(capacities([[0.2, 0.4, np.inf], [0.3, 0.8, 1.6]]), SLOPES)
    a, b, c, d, e = (log_rate(capacity) for capacity in (0.2, 0.3, 0.4, 0.8, 1.6))
    records = np.array([(a + b) / 2, (c + d) / 2, e / 2])
    np.testing.assert_allclose(found["record_annual_rate"][:, 0], records, rtol=1e-12)
    np.testing.assert_allclose(found["contribution"][:, 0], records / records.sum(), rtol=1e-12)
    assert float(found["annual_rate"][0]) == pytest.approx(records.mean(), rel=1e-12)
    assert float(found["standard_error"][0]) == pytest.approx(np.std(records, ddof=1) / np.sqrt(3), rel=1e-12)
    assert float(found["censored_share"][0]) == pytest.approx(1 / 6)
    known = np.array([0.2, 0.3, 0.4, 0.8, 1.6])
    assert float(found["annual_rate_lower"][0]) == pytest.approx(log_rate(1.1 * known).sum() / 6, rel=1e-12)
    largest = (log_rate(known / 1.1).sum() + log_rate(2.0)) / 6
    assert float(found["annual_rate_upper"][0]) == pytest.approx(largest, rel=1e-12)


def test_capacities_that_failed_or_lie_below_all_levels():
    found = wd.rates_by_record(capacities([[0.2, 0.4], [np.nan, 0.8]]), SLOPES)
    np.testing.assert_allclose(
        found["record_annual_rate"][:, 0], [log_rate(0.2), (log_rate(0.4) + log_rate(0.8)) / 2], rtol=1e-12
    )
    assert float(found["failed_share"][0]) == 0.25
    with pytest.raises(ValueError, match="'complete' has no known capacity under motion 0"):
        wd.rates_by_record(capacities([[np.nan, 0.4], [np.nan, 0.8]]), SLOPES)
    with pytest.raises(ValueError, match="every capacity must be at least 0"):
        wd.rates_by_record(capacities([[-0.1, 0.4]]), SLOPES)
    # Below 0.04 g, where the hazard curve has no point: its slope there is 1.
    with pytest.warns(UserWarning, match=r"intensities below the first point of the hazard curve \(0.05 g\)"):
        low = wd.rates_by_record(capacities([[0.0, 0.4]]), SLOPES)
    assert float(low["record_annual_rate"][0, 0]) == pytest.approx(1e-2 * 0.05 / 0.04, rel=1e-12)


def test_rates_of_many_lognormal_capacities_are_those_of_their_curve():
    probabilities = (np.arange(20_000) + 0.5) / 20_000
    given = capacities(0.5 * np.exp(0.4 * norm.ppf(probabilities)).reshape(100, 200))
    truth = wd.annual_rates(curves({"complete": (0.5, 0.4)}), BENT)["annual_rate"]
    assert float(wd.rates_by_record(given, BENT)["annual_rate"][0]) == pytest.approx(float(truth[0]), rel=1e-3)  # tails


def test_curves_of_a_run_are_taken_as_they_come():
    limits = {"slight": 0.008, "moderate": 0.02}
    fitted = wd.fragility(striped_run(), limits)
    found = wd.annual_rates(fitted, wd.HazardCurve(BENT.intensity, BENT.annual_rate, measure="PGA"))
    assert found["damage_state"].values.tolist() == list(limits)
    given = {
        state: (float(fitted["fragility_median"].sel(damage_state=state)), float(spread))
        for state, spread in zip(limits, fitted["fragility_dispersion"], strict=True)
    }
    np.testing.assert_array_equal(found["annual_rate"], wd.annual_rates(curves(given), BENT)["annual_rate"])
    assert (found["annual_rate_lower"] < found["annual_rate"]).all()
    assert (found["annual_rate"] < found["annual_rate_upper"]).all()
    with pytest.raises(ValueError, match=r"the measure of the hazard is 'SA\(1.0\)' and that of the curves is 'PGA'"):
        wd.annual_rates(fitted, wd.HazardCurve(BENT.intensity, BENT.annual_rate, measure="SA(1.0)"))


def test_one_damage_state_may_be_selected():
    whole = curves(STATES, np.ones((2, 50, 2)) * np.array([[[0.2, 0.5]], [[0.3, 0.6]]]))
    several, one = (wd.annual_rates(each, BENT) for each in (whole, whole.sel(damage_state="complete")))
    assert one["damage_state"].values.tolist() == ["complete"]
    for name in ("annual_rate", "annual_rate_upper"):
        np.testing.assert_array_equal(one[name], several[name][1:])


def test_curves_that_do_not_fit_are_refused():
    with pytest.raises(ValueError, match="'complete' has no fragility curve"):
        wd.annual_rates(curves({"slight": (0.2, 0.4), "complete": (np.nan, np.nan)}), BENT)
    with pytest.raises(ValueError, match="hazard is in 'g' and the medians in 'm s-1'"):
        wd.annual_rates(curves(STATES, units="m s-1"), BENT)
    named = wd.HazardCurve(BENT.intensity, BENT.annual_rate, measure="SA(0.2)")
    with pytest.raises(ValueError, match=r"'SA\(0.2\)' and that of the curves is 'Sa\(0.75 s, 5 %\)'"):
        wd.annual_rates(curves(STATES, measure="Sa(0.75 s, 5 %)"), named)
    with pytest.raises(ValueError, match="no fragility_dispersion"):
        wd.annual_rates(curves(STATES).drop_vars("fragility_dispersion"), BENT)
    with pytest.raises(TypeError, match="a HazardCurve or a HazardLogicTree"):
        wd.annual_rates(curves(STATES), [0.1, 0.2])


def test_one_state_or_none_may_be_selected():
    many = curves(STATES, replicates=np.full((2, 20, 2), 0.4))
    one = wd.annual_rates(many.sel(damage_state="complete"), BENT)
    xr.testing.assert_equal(one, wd.annual_rates(many.sel(damage_state=["complete"]), BENT))
    with pytest.raises(ValueError, match="annual_rates: the fragility curves have no damage state"):
        wd.annual_rates(many.isel(damage_state=[]), BENT)


def test_bins_that_miss_the_rate_are_warned_of():
    # Of the slight state (median 0.2) next to nothing comes from above 2 g.
    with pytest.warns(UserWarning, match=r"disaggregate: 100 % of 'slight'.* outside the bins \(2 to 3 g\)"):
        wd.disaggregate(curves(STATES), BENT, lowest=2.0)
