"""Losses of a portfolio, from shares of buildings that are counted by hand."""

import warnings

import numpy as np
import pandas as pd
import pytest
import xarray as xr
from scipy import stats
from test_damage import LIMITS, made

import warpdyn as wd

pytestmark = [pytest.mark.fast, pytest.mark.meant_as_given("drift_limit")]

RATIOS = {"slight": (0.1, 0.5), "complete": 1.0}
VALUES = {"light": 300.0, "heavy": 1000.0}
# Buildings of each archetype that are in slight and in complete damage, [motion]: see test_damage.
SLIGHT = {"light": [1, 0, 1, 1], "heavy": [1, 0, 1, 1]}
COMPLETE = {"light": [0, 1, 1, 1], "heavy": [0, 1, 0, 0]}


def losses(name):
    count = {"light": 3, "heavy": 2}[name]
    return VALUES[name] / count * (0.1 * np.array(SLIGHT[name]) + np.array(COMPLETE[name]))


def shares():
    return wd.damage_shares(made(), LIMITS)


def test_losses_are_those_counted_by_hand():
    found = wd.portfolio_losses(shares(), RATIOS, VALUES)
    for name in VALUES:
        np.testing.assert_allclose(found["archetype_loss"].sel(archetype=name), losses(name), rtol=1e-12)
    total = losses("light") + losses("heavy")
    np.testing.assert_allclose(found["loss"], total, rtol=1e-12)
    np.testing.assert_allclose(found["loss_ratio"], total / 1300, rtol=1e-12)
    # In slight damage, whose ratio scatters by 0.05, is one building of 100 and one of 500.
    expected = 0.05 * np.hypot(100 * np.array(SLIGHT["light"]), 500 * np.array(SLIGHT["heavy"]))
    np.testing.assert_allclose(found["loss_deviation"], expected, rtol=1e-12)
    assert "expected_annual_loss" not in found


def test_each_archetype_may_have_its_own_ratios():
    own = {"light": RATIOS, "heavy": {"slight": 0.2, "complete": 0.8}}
    found = wd.portfolio_losses(shares(), own, VALUES)["archetype_loss"]
    np.testing.assert_allclose(found.sel(archetype="light"), losses("light"), rtol=1e-12)
    np.testing.assert_allclose(found.sel(archetype="heavy"), [100, 400, 100, 100], rtol=1e-12)


def test_events_with_rates():
    # Events of 60, 600, 160 and 160.
    rates = [0.02, 0.001, 0.004, 0.006]
    found = wd.portfolio_losses(shares(), RATIOS, VALUES, event_rates=rates, return_periods=[10, 40, 95, 500, 5000])
    total = losses("light") + losses("heavy")
    np.testing.assert_allclose(total, [60, 600, 160, 160], rtol=1e-12)
    assert float(found["expected_annual_loss"]) == pytest.approx(rates @ total, rel=1e-12)
    by_archetype = found["archetype_expected_annual_loss"]
    np.testing.assert_allclose(by_archetype, [rates @ losses("light"), rates @ losses("heavy")], rtol=1e-12)
    np.testing.assert_allclose(found["loss_exceedance_rate"], [0.011, 0.0, 0.001, 0.001], rtol=1e-12)
    axes = wd.plots.loss_exceedance(found).axes[0]
    steps = axes.lines[0].get_xdata(), axes.lines[0].get_ydata()
    np.testing.assert_allclose(steps[0], np.sort(found["loss"]))
    np.testing.assert_allclose(
        steps[1][:-1], np.sort(found["loss_exceedance_rate"])[:0:-1]
    )  # above the largest is none
    # Losses occur 0.031 times a year, above 60 0.011 times, above 160 0.001 times, above 600 never.
    np.testing.assert_allclose(found["return_period_loss"], [0, 60, 160, 160, 600], rtol=1e-12)


@pytest.mark.parametrize("statistics", [False, True])
def test_losses_of_a_run_know_its_measure_and_integrate_as_the_samples_do(statistics):
    """The expected annual loss from single samples, summed by pandas and integrated by the trapezoidal rule."""
    time = np.arange(0.0, 6.0, 0.02)
    motions = [wd.GroundMotion(np.sin(f * time) * np.sin(0.5 * time), 0.02, f"{f} rad/s") for f in (7.0, 12.0, 20.0)]
    law = {"law": "bilinear", "hardening_ratio": 0.02, "damping": "rayleigh", "damping_ratio": 0.05}
    buildings = {
        "light": wd.ShearBuilding(mass=1e5, stiffness=[3e7, 2e7], height=3.0, yield_force=2e5, **law),
        "heavy": wd.ShearBuilding(mass=3e5, stiffness=[5e7], height=3.0, yield_force=4e5, **law),
    }
    strength = {"yield_force": wd.RandomFactor(wd.Lognormal(1.0, 0.3))}
    portfolio = wd.Portfolio({name: wd.Archetype(each, 4, strength) for name, each in buildings.items()})
    levels, measure = np.array([0.02, 0.1, 0.2, 0.4, 0.8]), wd.SpectralAcceleration(0.5)
    scene = wd.Scene(portfolio, wd.Stripes(motions, levels, measure), recorders=("drift",))
    limits = {name: {"slight": 0.005, "complete": 0.03} for name in buildings}
    counts = wd.DamageCounts(limits, over=("archetype", "motion", "stripe"))
    run = wd.simulate(scene, seed=1)
    found = (
        wd.damage_shares(wd.simulate(scene, seed=1, statistics=counts)) if statistics else wd.damage_shares(run, limits)
    )
    ratios = {"slight": 0.1, "complete": 1.0}
    vulnerability = wd.portfolio_losses(found, ratios, VALUES)
    with pytest.raises(ValueError, match=r"Sa\(0.5 s, 5 %\)"):
        wd.expected_annual_loss(vulnerability, wd.HazardCurve([0.01, 2.0], [1.0, 1e-5], measure="SA(1.0)"))
    hazard = wd.HazardCurve([0.01, 2.0], [1.0, 1e-5], measure="SA(0.5)")
    with warnings.catch_warnings():
        warnings.simplefilter("ignore", UserWarning)  # the function still rises at its last level
        annual = float(wd.expected_annual_loss(vulnerability, hazard, replacement_value=1300.0)["expected_annual_loss"])
    drift = run["peak_storey_drift_ratio"].max("storey").values
    ratio = np.select([drift > 0.03, drift > 0.005], [1.0, 0.1], 0.0)
    value = np.array([VALUES[name] / 4 for name in run["archetype"].values])[run["archetype_index"].values]
    by_motion = pd.Series(ratio * value).groupby([run["im_level"].values, run["motion_index"].values]).sum() / 1300.0
    for place, level in enumerate(levels):
        each = by_motion.loc[level]
        low, high = stats.t.interval(0.95, len(motions) - 1, each.mean(), each.sem()) if each.var() else (np.nan,) * 2
        bounds = [float(vulnerability[f"mean_loss_ratio_{end}"][place]) for end in ("lower", "upper")]
        np.testing.assert_allclose(bounds, np.clip([low, high], 0.0, 1.0), rtol=1e-9)
    assert by_motion.loc[levels[3]].var() > 0
    loss = pd.Series(ratio * value).groupby(run["im_level"].values).sum() / len(motions)
    level = np.geomspace(levels[0], 1e3, 400_001)
    slope = np.log(1e-5) / np.log(200.0)
    falls = -np.diff((level / 0.01) ** slope)
    expected = np.sum(np.interp(np.sqrt(level[1:] * level[:-1]), levels, loss.values) * falls)
    assert loss.iloc[0] == 0.0
    assert 0 < loss.iloc[2] < loss.iloc[4]
    assert annual == pytest.approx(expected, rel=1e-5)


@pytest.mark.parametrize(
    ("scale", "unit", "largest"), [(1.0, "EUR", "600"), (1e5, "million EUR", "60"), (1e7, "billion EUR", "6")]
)
def test_figures_name_the_currency_and_the_unit_of_losses(scale, unit, largest):
    values = {name: scale * value for name, value in VALUES.items()}
    found = wd.portfolio_losses(shares(), RATIOS, values, event_rates=[0.02, 0.001, 0.004, 0.006])
    axes = wd.plots.loss_exceedance(found, currency="EUR").axes[0]
    assert axes.get_xlabel() == f"Loss [{unit}]"
    assert axes.get_legend().get_texts()[0].get_text().endswith(" EUR")
    assert axes.xaxis.get_major_formatter()(600 * scale, 0) == largest
    assert "EUR" not in wd.plots.loss_exceedance(found).axes[0].get_xlabel()
    with pytest.raises(TypeError, match="currency"):
        wd.plots.loss_exceedance(found, currency=1.0)


def test_rates_with_labels_go_by_these():
    rates = [0.02, 0.001, 0.004, 0.006]
    expected = wd.portfolio_losses(shares(), RATIOS, VALUES, event_rates=rates)
    labels = shares()["motion"].values
    turned = xr.DataArray(rates[::-1], dims="motion", coords={"motion": labels[::-1]})
    xr.testing.assert_equal(wd.portfolio_losses(shares(), RATIOS, VALUES, event_rates=turned), expected)
    others = turned.assign_coords(motion=labels + 1)
    with pytest.raises(ValueError, match="event_rates have the motions"):
        wd.portfolio_losses(shares(), RATIOS, VALUES, event_rates=others)


def test_stripes_keep_their_dimension():
    striped = shares().expand_dims(stripe=[0.2, 0.4], axis=-1)
    striped["archetype_damage_share"] = striped["archetype_damage_share"].transpose(
        "archetype", "motion", "stripe", "damage_state"
    )
    found = wd.portfolio_losses(striped, RATIOS, VALUES)
    assert found["loss"].dims == ("motion", "stripe")
    np.testing.assert_allclose(found["loss"].isel(stripe=1), losses("light") + losses("heavy"), rtol=1e-12)
    with pytest.raises(ValueError, match="on stripes"):
        wd.portfolio_losses(striped, RATIOS, VALUES, event_rates=[0.1] * 4)


def striped_shares():
    """Return shares at 0.2 g of undamaged buildings, and at 0.4 g of those counted by hand."""
    damaged = shares()
    none = damaged.copy(deep=True)
    none["archetype_damage_share"] = xr.zeros_like(none["archetype_damage_share"])
    both = xr.concat([none, damaged], xr.DataArray([0.2, 0.4], dims="stripe", name="stripe", attrs={"units": "g"}))
    both["archetype_damage_share"] = both["archetype_damage_share"].transpose(
        "archetype", "motion", "stripe", "damage_state"
    )
    return both.assign_attrs(intensity_measure="PGA")


def test_expected_annual_loss_of_a_portfolio_from_a_hazard_curve():
    found = wd.portfolio_losses(striped_shares(), RATIOS, VALUES)
    total = losses("light") + losses("heavy")
    np.testing.assert_allclose(found["mean_loss_ratio"], [0.0, total.mean() / 1300], rtol=1e-12)
    for bound in ("mean_loss_ratio_lower", "mean_loss_ratio_upper"):  # no motion damages a building at 0.2 g
        np.testing.assert_array_equal(np.isfinite(found[bound]), [False, True])
    of_ratios = 0.05 * np.hypot(100 * np.array(SLIGHT["light"]), 500 * np.array(SLIGHT["heavy"]))
    deviation = np.sqrt(total.var(ddof=1) + (of_ratios**2).mean())
    np.testing.assert_allclose(found["coefficient_of_variation"], [np.nan, deviation / total.mean()], rtol=1e-12)
    # The rate 1e-4 / x^2; the loss rises from 0 at 0.2 g to `mean` at 0.4 g and is constant above:
    # slope * (integral of the rate from 0.2 to 0.4 g) = mean / 0.2 * 1e-4 * (1 / 0.2 - 1 / 0.4).
    hazard = wd.HazardCurve([0.1, 1.0], [1e-2, 1e-4], measure="PGA")
    with pytest.warns(UserWarning, match="it ends at 0.4 g, where it still rises"):
        annual = wd.expected_annual_loss(found, hazard, replacement_value=1300.0)
    assert float(annual["expected_annual_loss"]) == pytest.approx(total.mean() / 0.2 * 1e-4 * 2.5, rel=1e-12)
    with pytest.raises(ValueError, match="PGA"):
        wd.expected_annual_loss(found, wd.HazardCurve([0.1, 1.0], [1e-2, 1e-4], measure="SA(0.5)"))
    assert wd.plots.vulnerability(found).axes[0].lines


REFUSED = {
    "no value": ({"replacement_values": {"light": 1.0}}, "light, heavy; heavy missing"),
    "another archetype": ({"replacement_values": VALUES | {"new": 1.0}}, "new unknown"),
    "no worth": ({"replacement_values": VALUES | {"heavy": 0.0}}, "'heavy' must be a finite number above 0"),
    "a state missing": ({"loss_ratios": {"complete": 1.0}}, "slight missing"),
    "ratios of one archetype": ({"loss_ratios": {"light": RATIOS}}, "heavy missing"),
    "percent": (
        {"loss_ratios": {"light": RATIOS, "heavy": {"slight": 2.0, "complete": 100.0}}},
        "of archetype 'heavy'",
    ),
    "few rates": ({"event_rates": [0.1, 0.2]}, "each of the 4 events"),
    "a negative rate": ({"event_rates": [0.1, -0.2, 0.1, 0.1]}, "of at least 0 for each of the"),
}


@pytest.mark.parametrize("case", REFUSED)
def test_what_does_not_go_together_is_refused(case):
    changed, words = REFUSED[case]
    with pytest.raises(ValueError, match=words):
        wd.portfolio_losses(shares(), **({"loss_ratios": RATIOS, "replacement_values": VALUES} | changed))


def test_archetypes_without_counted_buildings_are_refused():
    none = shares()
    none["counted_buildings"] = none["counted_buildings"].copy(data=[[3, 3, 3, 3], [2, 0, 2, 2]])
    with pytest.raises(ValueError, match="'heavy' has no building with a valid result in motion 1"):
        wd.portfolio_losses(none, RATIOS, VALUES)


def test_rates_and_return_periods_that_are_taken_for_each_other():
    with pytest.warns(UserWarning, match="rate of an event is 475 a year .* given as return periods"):
        wd.portfolio_losses(shares(), RATIOS, VALUES, event_rates=[475] * 4)
    rates = [0.02, 0.001, 0.0, 0.006]
    with pytest.warns(
        UserWarning, match=r"return period in return_periods .* is 0.0021\d* year .* given as an annual rate"
    ):
        wd.portfolio_losses(shares(), RATIOS, VALUES, event_rates=rates, return_periods=[1 / 475])
    with warnings.catch_warnings():
        warnings.simplefilter("error")
        wd.portfolio_losses(shares(), RATIOS, VALUES, event_rates=rates, return_periods=[1, 475, 1e5])
