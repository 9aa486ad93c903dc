"""Rates of fragility curves that are given as points: linear between them, cut off at their ends, or broken."""

import warnings

import numpy as np
import pytest
import xarray as xr
from fragility_parameters import curves
from scipy.special import ndtr
from test_rates_of_any_shape import BENT, STATES, table

import warpdyn as wd

pytestmark = [pytest.mark.fast, pytest.mark.meant_as_given("drift_limit")]


def test_a_table_over_a_power_law_has_a_closed_form():
    # A line from 0 at a to 1 at b, over 1e-3 / x^2: 1e-3 (1 / a - 1 / b) / (b - a); a jump to p at a adds p 1e-3 / a^2.
    hazard = wd.HazardCurve([0.05, 100.0], [0.4, 1e-7])
    a, b, c = 0.2, 0.7, 1.5
    line = 1e-3 * (1 / a - 1 / b) / (b - a)
    jump = 0.3 * 1e-3 / a**2 + 0.7 * line
    late = 1e-3 * (1 / b - 1 / c) / (c - b)
    given = [[0.0, 1.0, 1.0], [0.3, 1.0, 1.0], [0.0, 0.0, 1.0]]
    with pytest.warns(UserWarning, match="below 0.2 g the fragility curve of 'state 1' counts as 0"):
        found = wd.annual_rates(table([a, b, c], given), hazard)
    parts = wd.disaggregate(table([a, b, c], given), hazard, bins=7)
    np.testing.assert_allclose(found["annual_rate"], [line, jump, late], rtol=1e-12)  # of rounding in 20 panels
    np.testing.assert_allclose(parts["annual_rate"], [line, jump, late], rtol=1e-12)
    assert np.isnan(found["annual_rate_upper"]).all()
    assert found.attrs["interval_method"].startswith("none")


@pytest.mark.parametrize("name", ["fragility_curve", "exceedance_fraction"])
def test_tables_of_many_points_have_the_rates_of_their_curve(name):
    levels = np.append(0.0, np.geomspace(1e-3, 30.0, 4000))
    probable = [ndtr(np.log(np.maximum(levels, 1e-300) / median) / beta) for median, beta in STATES.values()]
    along = {"fragility_curve": "intensity", "exceedance_fraction": "stripe"}[name]
    found = wd.annual_rates(table(levels, probable, name, along), BENT)["annual_rate"]
    # Between points 0.26 % apart a line is off by some (0.0026 / 0.3)^2 / 12 of the curve.
    np.testing.assert_allclose(found, wd.annual_rates(curves(STATES), BENT)["annual_rate"], rtol=1e-5)


@pytest.mark.parametrize(("first", "is_told"), [(0.2, True), (1e-3, False)])
def test_a_table_from_0_counts_from_the_first_point_of_the_hazard(first, is_told):
    # A line from 0 to 1 at b, over c / x^2 above the knee and a power of -0.1 below: what is below the hazard is left
    # out.
    b, knee, c = 1.0, 0.02, 1e-4
    flat = c / knee**2
    points = np.array([first, *[x for x in (knee,) if x > first], 100.0])
    hazard = wd.HazardCurve(points, np.where(points < knee, flat * (points / knee) ** -0.1, c / points**2))
    rate = 2 * c / b * (1 / max(first, knee) - 1 / b) + c / b**2
    if first < knee:  # 0.1 flat / b times the integral of (x / knee)^-0.1
        rate += 0.1 * flat * knee / (0.9 * b) * (1 - (first / knee) ** 0.9)
    given = table([0.0, b], [[0.0, 1.0]])
    losses = xr.Dataset({"mean_loss_ratio": ("intensity", [0.0, 1.0])}, {"intensity": ("intensity", [0.0, b])})
    calls = {
        "counts as 0, although its probability there is 0.2": lambda: wd.annual_rates(given, hazard)["annual_rate"],
        "begins at 0.2 g with a loss ratio of 0.2": lambda: wd.expected_annual_loss(losses, hazard)[
            "expected_annual_loss"
        ],
    }
    for words, call in calls.items():
        with warnings.catch_warnings(record=True) as told:
            warnings.simplefilter("always")
            assert call().item() == pytest.approx(rate, rel=1e-12)  # rounding in some 20 panels
        assert any(words in str(each.message) for each in told) == is_told
        assert any("give a hazard curve that begins lower" in str(each.message) for each in told) == is_told


def test_tables_that_are_cut_off_or_broken():
    with pytest.warns(UserWarning, match=r"'state 0' ends at 0.5 g with a probability of 0.4"):
        wd.annual_rates(table([0.1, 0.3, 0.5], [[0.0, 0.1, 0.4]]), BENT)
    for levels, probable, words in (
        ([0.1, 0.3], [[0.0, np.nan]], "'state 0' is nan at 0.3; it must be known and from 0 to 1"),
        ([0.1, 0.3], [[0.0, 1.2]], "'state 0' is 1.2 at 0.3; it must be known and from 0 to 1"),
        ([0.3, 0.1], [[0.0, 1.0]], "at least 2 increasing intensities"),
        ([0.1], [[0.5]], "at least 2 increasing intensities"),
        ([0.0, 0.1], [[0.5, 1.0]], "is 0.5 at intensity 0"),
    ):
        with pytest.raises(ValueError, match=words):
            wd.annual_rates(table(levels, probable), BENT)
    with pytest.raises(ValueError, match="unknown shape 'weibull' of the curves; allowed: 'lognormal', 'loglogistic'"):
        wd.annual_rates(curves(STATES).assign_attrs(fragility_shape="weibull"), BENT)
    in_si = table([0.1, 0.3], [[0.0, 1.0]])
    in_si["intensity"].attrs["units"] = "m s-2"
    with pytest.raises(ValueError, match="in 'g' and the medians in 'm s-2'"):
        wd.annual_rates(in_si, BENT)


def test_discrete_functions_of_openquake_have_rates(tmp_path):
    path = tmp_path / "model.xml"
    wd.write_nrml_fragility({"A": curves(STATES, measure="PGA")}, path, format="discrete", intensities=[0.05, 0.2, 1.0])
    found = wd.annual_rates(wd.read_nrml_fragility(path)["A"], wd.HazardCurve([0.01, 9.0], [0.1, 1e-6], measure="PGA"))
    assert (found["annual_rate"] > 0).all()
