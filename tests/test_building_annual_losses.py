"""Expected annual losses of buildings, against NumPy on the full table of the same run, and closed forms."""

import warnings

import numpy as np
import pytest
import xarray as xr
from reduced_runs import MARKS, scene_of, simulate
from test_building_results import INVENTORY, LIMITS, OF_CITY, make_stock

import warpdyn as wd

pytestmark = MARKS
HAZARD = wd.HazardCurve([0.01, 0.1, 1.0, 10.0], [0.5, 2e-2, 1e-4, 1e-7])
NAMED = wd.HazardCurve(HAZARD.intensity, HAZARD.annual_rate, measure="PGA")
ENDS = pytest.mark.filterwarnings("ignore:building_annual_losses. (levels below|the loss ratio above)")


@pytest.fixture(scope="module")
def stock():
    return make_stock()


def mean_ratios(run: xr.Dataset, stock, along: np.ndarray) -> np.ndarray:
    """Return the mean loss ratio of each building under the samples of each label, from the table of samples."""
    archetypes = list(stock.portfolio.archetypes)
    worst = run["peak_storey_drift_ratio"].max("storey").values
    building, status = run["building"].values, run["status"].values
    labels = np.unique(along)
    found = np.empty((building.max() + 1, labels.size))
    for number in range(found.shape[0]):
        name = archetypes[stock.archetype_index[number]]
        limits = np.array(list(LIMITS[name].values()), np.float32)
        mean = [0.0, *(each[0] if isinstance(each, tuple) else each for each in OF_CITY[name].values())]
        for place, label in enumerate(labels):
            own = (building == number) & (along == label)
            state = np.where(status[own] == 1, limits.size, (worst[own, None] > limits).sum(axis=1))
            found[number, place] = np.mean(np.array(mean)[state])
    return found


@ENDS
def test_losses_from_a_hazard_curve_are_those_of_quadrature_over_the_samples(stock):
    scene = scene_of("crossed", stock.portfolio)
    run = simulate(scene)
    counted = simulate(scene, statistics=wd.DamageCounts(LIMITS, over=("building", "stripe")))
    found = wd.building_annual_losses(counted, stock, INVENTORY, OF_CITY, hazard=HAZARD)
    ratios = mean_ratios(run, stock, run["im_level"].values)
    levels = np.unique(run["im_level"].values)
    # Linear between levels, constant above: the sum over small steps of the ratio times the decrease of the hazard.
    fine = np.unique(np.concatenate([np.geomspace(levels[0], 1e4, 400_000), levels]))
    rate = np.exp(np.interp(np.log(fine), np.log(HAZARD.intensity), np.log(HAZARD.annual_rate)))
    last = np.log(HAZARD.annual_rate[-1] / HAZARD.annual_rate[-2]) / np.log(10.0)
    rate = np.where(fine > 10.0, 1e-7 * (fine / 10.0) ** last, rate)
    middle = 0.5 * (fine[1:] + fine[:-1])
    annual = np.array([-(np.interp(middle, levels, row) * np.diff(rate)).sum() for row in ratios])
    assert found["id"].isin(INVENTORY["id"]).all()
    np.testing.assert_allclose(found["annual_loss_ratio"], annual[found["building"]], rtol=1e-6)
    expected = annual[found["building"]] * found["replacement_cost"]
    np.testing.assert_allclose(found["expected_annual_loss"], expected, rtol=1e-6)
    # The portfolio as a whole, by the function for a vulnerability.
    whole = xr.Dataset(
        {"mean_loss_ratio": ("intensity", ratios[0])}, {"intensity": ("intensity", levels, {"units": "g"})}
    )
    one = float(wd.expected_annual_loss(whole, HAZARD)["expected_annual_loss"])
    assert float(found.set_index("building").loc[0, "annual_loss_ratio"]) == pytest.approx(one, rel=1e-12)


def test_losses_from_rates_of_motions_are_sums_over_the_samples(stock):
    scene = scene_of("cloud", stock.portfolio)
    run = simulate(scene)
    counted = simulate(scene, statistics=wd.DamageCounts(LIMITS, over=("building", "motion")))
    motion = run["motion_index"].values
    rates = 1e-3 * (1 + np.arange(motion.max() + 1))
    found = wd.building_annual_losses(counted, stock, INVENTORY, OF_CITY, event_rates=rates)
    annual = mean_ratios(run, stock, motion) @ rates
    np.testing.assert_allclose(found["annual_loss_ratio"], annual[found["building"]], rtol=1e-12)
    assert found["expected_annual_loss"].sum() == pytest.approx(
        (annual[found["building"]] * found["replacement_cost"]).sum(), rel=1e-12
    )


def test_annual_rates_and_loss_of_a_power_law_hazard_are_the_closed_form():
    level = np.geomspace(0.025, 40.0, 20)
    hazard = wd.HazardCurve(level, 4e-5 * level**-2.6)
    states = ["slight", "moderate", "extensive", "complete"]
    curves = xr.Dataset(
        {
            "fragility_median": ("damage_state", [0.22, 0.45, 0.85, 1.4], {"units": "g"}),
            "fragility_dispersion": ("damage_state", [0.45, 0.45, 0.5, 0.5]),
        },
        {"damage_state": states},
    )
    losses = wd.annual_losses(curves, hazard, dict(zip(states, [0.02, 0.1, 0.5, 1.0], strict=True)))
    assert float(losses["expected_annual_loss"]) == pytest.approx(0.000208126024, rel=1e-7)
    rates = wd.annual_rates(curves, hazard)["annual_rate"].values
    np.testing.assert_allclose(rates, [0.00406456319, 0.000632354063, 0.000142085455, 3.88245058e-05], rtol=1e-7)


@ENDS
def test_counts_hazards_and_inventories_that_do_not_fit_are_refused(stock):
    scene = scene_of("crossed", stock.portfolio)
    counted = simulate(scene, statistics=wd.DamageCounts(LIMITS, over=("building", "stripe")))
    loss = wd.building_annual_losses
    with pytest.raises(ValueError, match="give either hazard= or event_rates="):
        loss(counted, stock, INVENTORY, OF_CITY)
    with pytest.raises(ValueError, match=r"no damage counts over \('building', 'event'\)"):
        loss(counted, stock, INVENTORY, OF_CITY, event_rates=[0.1])
    other = wd.HazardCurve([0.01, 0.1, 1.0], [0.5, 2e-2, 1e-4], measure="SA(0.3)")
    with pytest.raises(ValueError, match="PGA"):
        loss(counted, stock, INVENTORY, OF_CITY, hazard=other)
    with pytest.raises(ValueError, match="has a column 'annual_loss_ratio'"):
        loss(counted, stock, INVENTORY.assign(annual_loss_ratio=0.0), OF_CITY, hazard=HAZARD)
    empty = counted.copy(deep=True)
    name = next(str(each) for each in empty if str(each).startswith("damage_count"))
    empty[name][{"building": 2, "stripe": 1}] = 0
    with pytest.raises(ValueError, match="building 2 has no valid sample in stripe"):
        loss(empty, stock, INVENTORY, OF_CITY, hazard=HAZARD)
    wider = {name: {state: 2 * limit for state, limit in own.items()} for name, own in LIMITS.items()}
    others = simulate(scene, statistics=wd.DamageCounts(wider, over=("building", "stripe")))
    with pytest.raises(
        ValueError, match=r"counts have the limit 0.004 for 'slight' of archetype 'low', but the stock has"
    ):
        loss(others, stock, INVENTORY, OF_CITY, hazard=HAZARD)
    with pytest.raises(ValueError, match="at least 2 levels"):
        loss(counted.isel(stripe=[0]), stock, INVENTORY, OF_CITY, hazard=HAZARD)


@ENDS
def test_a_hazard_curve_that_is_extrapolated_is_named_with_its_share_of_the_loss(stock):
    scene = scene_of("crossed", stock.portfolio)
    run = simulate(scene)
    counted = simulate(scene, statistics=wd.DamageCounts(LIMITS, over=("building", "stripe")))
    with warnings.catch_warnings():
        warnings.simplefilter("error")
        warnings.filterwarnings("ignore", "building_annual_losses. (levels below|the loss ratio above)")
        wd.building_annual_losses(counted, stock, INVENTORY, OF_CITY, hazard=NAMED)
    # The rate 1e-4 x^-3; below 1 g it is extrapolated.
    short = wd.HazardCurve([1.0, 10.0], [1e-4, 1e-7], measure="PGA")
    levels = np.unique(run["im_level"].values)
    cost = stock.replacement_costs(INVENTORY)
    loss = cost @ mean_ratios(run, stock, run["im_level"].values)
    fine = np.geomspace(levels[0], 1e4, 400_001)
    middle = np.sqrt(fine[1:] * fine[:-1])
    part = -np.interp(middle, levels, loss) * np.diff(1e-4 * fine**-3)
    share = part[middle < 1.0].sum()
    with pytest.warns(UserWarning, match=r"below the first point of the hazard curve \(1 g\)") as caught:
        wd.building_annual_losses(counted, stock, INVENTORY, OF_CITY, hazard=short)
    text = next(str(each.message) for each in caught if "first point" in str(each.message))
    assert f"{float(f'{100 * share / part.sum():.2g}'):g} % of the expected loss" in text
