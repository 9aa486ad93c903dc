"""noDamageLimit, minIML and maxIML of NRML files, in rates, losses and files, against the engine's formula."""

from itertools import pairwise

import numpy as np
import pytest
import xarray as xr
from scipy.integrate import quad
from scipy.stats import lognorm

import warpdyn as wd

pytestmark = pytest.mark.fast
MEAN, STDDEV = 0.3, 0.15
SIGMA = np.sqrt(np.log(STDDEV**2 / MEAN**2 + 1))
MEDIAN = MEAN**2 / np.hypot(STDDEV, MEAN)
HAZARD = wd.HazardCurve([0.01, 0.1, 1.0, 3.0], [0.1, 1e-2, 1e-4, 1e-6], measure="PGA")
MODEL = """<?xml version="1.0" encoding="utf-8"?>
<nrml xmlns="http://openquake.org/xmlns/nrml/0.5">
<fragilityModel id="wd" assetCategory="building" lossCategory="structural">
<description>x</description>
<limitStates>complete</limitStates>
<fragilityFunction id="A" format="{format}"{shape}>
{function}
</fragilityFunction></fragilityModel></nrml>
"""


def continuous(tmp_path, limit, least, greatest, mean=MEAN, stddev=STDDEV):
    imls = f'<imls imt="PGA" noDamageLimit="{limit}" minIML="{least}" maxIML="{greatest}"/>'
    function = f'{imls}<params ls="complete" mean="{mean}" stddev="{stddev}"/>'
    path = tmp_path / "model.xml"
    path.write_text(MODEL.format(format="continuous", shape=' shape="logncdf"', function=function))
    return path


def engine_probability(intensity, limit, least, greatest):
    """Probability as risklib's FragilityFunctionContinuous computes it."""
    clipped = np.clip(intensity, least, greatest)
    return np.where(clipped <= limit, 0.0, lognorm.cdf(clipped, SIGMA, scale=MEDIAN))


def exact_rate(function, kinks):
    """The integral of a function over the hazard, by adaptive quadrature of P(u) k lambda(u) du between all kinks."""
    ends = np.log(np.unique(np.clip([*kinks, *HAZARD.intensity, 20.0], HAZARD.intensity[0], None)))
    total = 0.0
    for a, b in pairwise(ends):
        x, y = np.exp([a, b]) * [1 + 1e-12, 1 - 1e-12]
        slope = -np.log(HAZARD.rate_of(y) / HAZARD.rate_of(x)) / np.log(y / x)
        integrand = lambda u, slope=slope: float(function(np.exp(u))) * slope * float(HAZARD.rate_of(np.exp(u)))  # noqa: E731
        total += quad(integrand, np.log(x), np.log(y), epsabs=1e-16, epsrel=1e-11, limit=200)[0]
    return total + float(function(20.0)) * float(HAZARD.rate_of(20.0))


CASES = [(0.3, 0.1, 5.0), (0.1, 0.1, 1.0), (0.05, 0.02, 0.4), (0.4, 0.05, 0.8)]


@pytest.mark.parametrize("limits", CASES)
def test_rates_are_those_of_the_limited_curve(limits, tmp_path):
    curves = wd.read_nrml_fragility(continuous(tmp_path, *limits))["A"]
    rate = float(wd.annual_rates(curves, HAZARD)["annual_rate"][0])
    # Quadrature on both sides is to 1e-11; the reference leaves 1e-12 of the intensity out at each kink.
    assert rate == pytest.approx(exact_rate(lambda x: engine_probability(x, *limits), limits), rel=1e-9)


def test_the_limits_change_the_rate_by_a_factor_of_two(tmp_path):
    curves = wd.read_nrml_fragility(continuous(tmp_path, 0.3, 0.1, 5.0))["A"]
    without = curves.drop_attrs().assign_attrs(intensity_measure="PGA")
    ratio = wd.annual_rates(without, HAZARD)["annual_rate"] / wd.annual_rates(curves, HAZARD)["annual_rate"]
    exact = exact_rate(lambda x: lognorm.cdf(x, SIGMA, scale=MEDIAN), [1e-3])
    assert float(ratio[0]) == pytest.approx(
        exact / exact_rate(lambda x: engine_probability(x, 0.3, 0.1, 5.0), [0.3]), rel=1e-4
    )
    assert ratio > 2


@pytest.mark.parametrize("limits", CASES)
def test_losses_and_vulnerability_follow_the_limits(limits, tmp_path):
    curves = wd.read_nrml_fragility(continuous(tmp_path, *limits))["A"]
    ratios = {"complete": 0.8}
    loss = float(wd.annual_losses(curves, HAZARD, ratios, replacement_value=100.0)["expected_annual_loss"])
    assert loss == pytest.approx(80 * exact_rate(lambda x: engine_probability(x, *limits), limits), rel=1e-9)
    levels = np.array([0.01, 0.06, 0.2, 0.3, 0.35, 0.5, 2.0, 10.0])
    found = wd.vulnerability(curves, ratios, intensity=levels)["mean_loss_ratio"]
    np.testing.assert_allclose(found, 0.8 * engine_probability(levels, *limits), rtol=1e-12)
    # By default a vulnerability function has both sides of the step among its intensities.
    default = wd.vulnerability(curves, ratios)
    expected = 0.8 * engine_probability(default["intensity"].values, *limits)
    np.testing.assert_allclose(default["mean_loss_ratio"], expected, rtol=1e-12)
    if limits[0] >= default["intensity"][0]:
        step = default["mean_loss_ratio"].sel(intensity=limits[0] * (1 + 1e-9), method="nearest")
        assert float(step) == pytest.approx(0.8 * lognorm.cdf(limits[0], SIGMA, scale=MEDIAN), rel=1e-6)
        assert (default["mean_loss_ratio"].sel(intensity=slice(None, limits[0])) == 0).all()


def test_disaggregation_has_nothing_below_the_limit(tmp_path):
    curves = wd.read_nrml_fragility(continuous(tmp_path, 0.3, 0.1, 5.0))["A"]
    parts = wd.disaggregate(curves, HAZARD, bins=40, lowest=0.05, highest=3.0)
    contribution = parts["contribution"].isel(damage_state=0)
    edges = np.geomspace(0.05, 3.0, 41)
    assert (contribution.isel(intensity=edges[1:] < 0.3) == 0).all()
    assert (contribution.isel(intensity=edges[:-1] > 0.3) > 0).all()


def test_files_that_are_written_again_have_the_same_limits(tmp_path):
    for limits in CASES:
        first = wd.read_nrml_fragility(continuous(tmp_path, *limits))
        again = wd.read_nrml_fragility(wd.write_nrml_fragility(first, tmp_path / "again.xml"))
        for name in ("no_damage_limit", "minimum_intensity", "maximum_intensity"):
            assert again["A"].attrs[name] == first["A"].attrs[name]
        levels = np.linspace(0.01, 2, 41)
        discrete = wd.write_nrml_fragility(first, tmp_path / "discrete.xml", format="discrete", intensities=levels)
        read = wd.read_nrml_fragility(discrete)["A"]
        np.testing.assert_allclose(
            read["exceedance_fraction"].values[0], engine_probability(levels, *limits), rtol=1e-12
        )
        assert read.attrs["no_damage_limit"] == limits[0]


def test_limits_of_zero_or_missing_are_written_again_as_such(tmp_path):
    """Otherwise a file that is read and written again would have other rates."""
    levels = np.array([1e-3, 0.05, 0.1, 0.3, 1.0])
    for least, told, limit in ((0, "", 0.0), (0, "0", 0.0), (0.1, "", 0.0), (0, "0.2", 0.2)):
        path = continuous(tmp_path, told, least, 5.0)
        path.write_text(path.read_text().replace('noDamageLimit="" ', ""))
        first = wd.read_nrml_fragility(path)
        again = wd.read_nrml_fragility(wd.write_nrml_fragility(first, tmp_path / "again.xml"))
        assert again["A"].attrs["minimum_intensity"] == least
        assert again["A"].attrs.get("no_damage_limit", 0.0) == limit
        for curves in (first, again):
            found = wd.vulnerability(curves["A"], {"complete": 1.0}, intensity=levels)["mean_loss_ratio"]
            np.testing.assert_allclose(found, engine_probability(levels, limit, least, 5.0), rtol=1e-9, atol=1e-15)


def test_units_of_limits_are_those_of_the_medians(tmp_path):
    path = continuous(tmp_path, 5.0, 1.0, 100.0, 30.0, 15.0)
    path.write_text(path.read_text().replace('imt="PGA"', 'imt="PGV"'))  # cm/s
    curves = wd.read_nrml_fragility(path)["A"]
    assert curves.attrs["no_damage_limit"] == pytest.approx(0.05)
    assert curves.attrs["maximum_intensity"] == pytest.approx(1.0)
    assert float(curves["fragility_median"][0]) == pytest.approx(0.01 * 100 * MEDIAN)


@pytest.mark.parametrize("limit", [0.0, 0.05, 0.1, 0.15, 0.3])
def test_discrete_functions_begin_at_the_limit_without_damage(limit, tmp_path):
    levels, poes = [0.1, 0.2, 0.5, 1.0], [0.04, 0.5, 0.99, 1.0]
    told = f' noDamageLimit="{limit}"' if limit else ""
    function = f'<imls imt="PGA"{told}>0.1 0.2 0.5 1.0</imls><poes ls="complete">0.04 0.5 0.99 1.0</poes>'
    path = tmp_path / "model.xml"
    path.write_text(MODEL.format(format="discrete", shape="", function=function))
    curves = wd.read_nrml_fragility(path)["A"]

    def probability(x):  # of risklib: the limit is a point of probability 0 if it is below the first; 0 below it
        points, values = ([limit, *levels], [0.0, *poes]) if 0 < limit < levels[0] else (levels, poes)
        return 0.0 if x < max(limit, points[0]) else float(np.interp(x, points, values))

    rate = float(wd.annual_rates(curves, HAZARD)["annual_rate"][0])
    assert rate == pytest.approx(exact_rate(probability, [limit, *levels]), rel=1e-9)
    again = wd.read_nrml_fragility(wd.write_nrml_fragility({"A": curves}, tmp_path / "b.xml", format="discrete"))["A"]
    xr.testing.assert_equal(again["exceedance_fraction"], curves["exceedance_fraction"])
    assert again.attrs.get("no_damage_limit", 0.0) == limit


def test_a_probability_that_is_kept_below_the_minimum_is_warned_of(tmp_path):
    curves = wd.read_nrml_fragility(continuous(tmp_path, 0.05, 0.1, 0.4))["A"]
    with pytest.warns(
        UserWarning, match="below its minimum intensity of 0.1 g .minIML. .* keeps its probability of 0.0183"
    ):
        rate = float(wd.annual_rates(curves, HAZARD)["annual_rate"][0])
    assert rate == pytest.approx(exact_rate(lambda x: engine_probability(x, 0.05, 0.1, 0.4), [0.1, 0.4]), rel=1e-9)


@pytest.mark.parametrize(
    ("limits", "message"),
    [
        ((0.3, 5.0, 5.0), "maxIML 5, which must be above minIML, 5"),
        ((0.3, 6.0, 5.0), "must be above minIML"),
        ((-0.1, 0.1, 5.0), "noDamageLimit of imls is -0.1; it must be at least 0"),
        (("nan", 0.1, 5.0), "noDamageLimit of imls contains nan; every number must be finite"),
        ((0.1, "inf", 5.0), "minIML of imls contains inf"),
        ((0.1, -1, 5.0), "minIML of imls is -1; it must be at least 0"),
        ((6.0, 0.1, 5.0), "no intensity would cause damage"),
        (("", 0.1, 5.0), "noDamageLimit of imls must contain 1 numbers, got 0"),
    ],
)
def test_limits_that_cannot_be_are_refused(limits, message, tmp_path):
    path = continuous(tmp_path, *limits)
    with pytest.raises(ValueError, match=message) as raised:
        wd.read_nrml_fragility(path)
    assert str(path) in str(raised.value)


def test_limits_of_attributes_are_checked(tmp_path):
    curves = wd.read_nrml_fragility(continuous(tmp_path, 0.3, 0.1, 5.0))["A"]
    for name, value in (("no_damage_limit", np.nan), ("minimum_intensity", -1.0), ("maximum_intensity", 0.05)):
        with pytest.raises(ValueError, match=name):
            wd.annual_rates(curves.assign_attrs({name: value}), HAZARD)
