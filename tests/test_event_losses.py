"""Losses of a city in each earthquake at sites, against sums by hand over the samples of the same run."""

import numpy as np
import pytest
import xarray as xr
from reduced_runs import CITY, MARKS, MOTIONS, scene_of, simulate
from test_building_results import INVENTORY, LIMITS, OF_CITY, make_stock
from test_reductions_at_sites import BOTH, EARTHQUAKE, EVENTS

import warpdyn as wd
from warpdyn.answers.risk.event_losses import rates_of_losses
from warpdyn.foundations.core.units import STANDARD_GRAVITY

pytestmark = MARKS


def losses_by_hand(run, costs, draws):
    """Return the loss of all buildings in each draw and its variance by the scatter of the ratios, shape [draw]."""
    drift = np.nanmax(run["peak_storey_drift_ratio"].values.astype(np.float64), axis=1)
    worst = np.where(run["status"] == 1, np.inf, drift).reshape(len(costs), draws, -1).max(axis=2)
    names = np.repeat(list(CITY.archetypes), CITY.counts)
    loss, variance = np.zeros(draws), np.zeros(draws)
    for name, cost, each in zip(names, costs, worst, strict=True):
        for draw in range(draws):
            state = sum(each[draw] > limit for limit in LIMITS[name].values())
            ratio = [0.0, *OF_CITY[name].values()][state]
            mean, variation = ratio if isinstance(ratio, tuple) else (ratio, 0.0)
            loss[draw] += cost * mean
            variance[draw] += (cost * mean * variation) ** 2
    return loss, variance


def test_the_loss_of_an_earthquake_is_the_mean_of_its_draws():
    scene, costs = scene_of(BOTH, CITY), np.linspace(1e5, 3e6, CITY.buildings)
    asked = wd.DamageLoss(LIMITS, OF_CITY, costs, events=EVENTS, over="earthquake")
    counted = simulate(scene, statistics=asked)
    found = wd.event_losses(counted)
    loss, variance = losses_by_hand(simulate(scene), costs, 5)
    of_draw = np.array(EARTHQUAKE)
    mean = np.array([loss[of_draw == number].mean() for number in range(2)])
    assert mean[0] != mean[1]
    assert found["loss"].dims == ("earthquake",)
    np.testing.assert_allclose(found["loss"], mean, rtol=1e-12)  # sums of a hundred numbers
    of_one_draw = [np.sqrt(variance[of_draw == number].mean()) for number in range(2)]
    np.testing.assert_allclose(found["loss_deviation"], of_one_draw, rtol=1e-12)
    assert found["counted_buildings"].values.tolist() == [CITY.buildings] * 2
    by_name = xr.DataArray([0.01, 0.002], {"earthquake": ["south", "north"]})
    for rates in ([0.002, 0.01], by_name):
        rated = wd.event_losses(counted, event_rates=rates)
        assert float(rated["expected_annual_loss"]) == pytest.approx(0.002 * mean[0] + 0.01 * mean[1], rel=1e-12)
    assert wd.plots.loss_exceedance(found).axes[0].get_ylabel() == "Share of the earthquakes with a larger loss"


def test_the_annual_loss_of_openquakes_ground_motion_fields(tmp_path):
    values = np.array([[2.0, 3.0, 4.0, 5.0], [0.5, 1.5, 2.5, 0.0]])  # of the records' peaks, [earthquake, site]
    records, drawn = MOTIONS[:2], [1, 0]
    peaks = np.array([records[number].peak_ground_acceleration for number in drawn]) / STANDARD_GRAVITY
    field = values * peaks[:, None]
    rows = [f"{event},{site},{field[k, site]:.17g}" for k, event in enumerate((4, 9)) for site in range(4)]
    (tmp_path / "gmf.csv").write_text("\n".join(["event_id,site_id,gmv_PGA", *rows[:-1]]) + "\n")
    mesh = ["site_id,lon,lat", "0,20.0,40.0", "1,21.0,40.0", "2,20.0,40.5", "3,21.0,40.5"]
    (tmp_path / "mesh.csv").write_text("\n".join(mesh) + "\n")
    shaking = wd.sites.read_ground_motion_field(tmp_path / "gmf.csv", tmp_path / "mesh.csv", events=[4, 9])
    stock, draws = make_stock(), 5  # three of the first event, two of the second
    design = wd.sites.scale_records(shaking["PGA"], records, record=drawn).at(INVENTORY, stock, draws=draws)
    scene, costs = scene_of(design, stock.portfolio), stock.replacement_costs(INVENTORY)
    counted = simulate(scene, statistics=wd.DamageLoss(LIMITS, OF_CITY, costs, over="earthquake"))
    rates = [0.02, 0.001]
    found = wd.event_losses(counted, event_rates=rates)
    # Each sample is of its building's site, in the order of the portfolio: the field says how strong it is.
    run = wd.sites.label_samples(simulate(scene), design)
    strength = field[run["earthquake_index"], run["site_index"]]
    np.testing.assert_allclose(run["im_level"], strength, rtol=1e-6, atol=1e-12)  # levels of 32 bits
    loss, _ = losses_by_hand(run, costs, draws)
    first, second = loss[[0, 2, 4]].mean(), loss[[1, 3]].mean()
    assert found["earthquake"].values.tolist() == ["4", "9"]
    assert 0 < second < first
    assert float(found["expected_annual_loss"]) == pytest.approx(rates[0] * first + rates[1] * second, rel=1e-12)
    np.testing.assert_array_equal(found["loss_exceedance_rate"], [0.0, rates[0]])


def test_what_is_not_of_all_draws_is_refused():
    costs = np.linspace(1e5, 3e6, CITY.buildings)
    of_motions = simulate(scene_of(BOTH, CITY), statistics=wd.DamageLoss(LIMITS, OF_CITY, costs, over="motion"))
    with pytest.raises(ValueError, match=r"for MotionsAtSites give .*over='earthquake'"):
        wd.event_losses(of_motions)
    asked = wd.DamageLoss(LIMITS, OF_CITY, costs, events=EVENTS, over="earthquake")
    counted = simulate(scene_of(BOTH, CITY), statistics=asked)
    with pytest.raises(ValueError, match="of at least 0 for each of the 2 events"):
        wd.event_losses(counted, event_rates=[0.01])
    alike = counted.assign_coords(earthquake=["north", "north"])
    with pytest.raises(ValueError, match="two earthquakes have one name: give event_rates in the order"):
        wd.event_losses(alike, event_rates=xr.DataArray([0.01, 0.02], {"earthquake": ["north", "north"]}))
    assert float(wd.event_losses(alike, event_rates=[0.0, 0.0])["expected_annual_loss"]) == 0.0
    none = counted.copy(deep=True)
    none["counted_count_by_earthquake"][1] = 0
    with pytest.raises(ValueError, match=r"0 to 75 samples of 25 buildings.*at least one, of each earthquake"):
        wd.event_losses(none)
    counted["failed_count_by_earthquake"][0, 0] = 2
    counted["counted_count_by_earthquake"][0] = 73
    with pytest.raises(ValueError, match="2 of 75 samples failed in earthquake 'north'"):
        wd.event_losses(counted)


def test_a_loss_exceeded_exactly_once_per_return_period_is_that_of_the_period():
    # Losses of 10, 20 and 40 in events of 0.25 per year each: above 20 lies one event, exceeded once in 4 years.
    loss = xr.DataArray([20.0, 40.0, 10.0], dims="event", coords={"event": ["a", "b", "c"]})
    found = rates_of_losses(loss, np.full(3, 0.25), [1.0, 4 / 3, 2.0, 4.0, 5.0])
    assert found["return_period_loss"].values.tolist() == [0.0, 0.0, 10.0, 20.0, 40.0]
    assert found["loss_exceedance_rate"].values.tolist() == [0.25, 0.0, 0.5]
    assert float(found["expected_annual_loss"]) == 17.5
