"""Results of each building, against numpy on the full table of the same run, and what does not belong together."""

import numpy as np
import pandas as pd
import pytest
import xarray as xr
from reduced_runs import CITY, CITY_LIMITS, MARKS, scene_of, simulate, with_failures
from test_building_numbers import states_of

import warpdyn as wd

pytestmark = MARKS
RATIOS = {"slight": (0.05, 0.5), "complete": (0.8, 0.2)}
OF_CITY = {name: RATIOS if place else {"slight": 0.02, "complete": 1.0} for place, name in enumerate(CITY.archetypes)}
STATES = ("none", "slight", "complete")
LIMITS = {name: {state: limit / 2 for state, limit in own.items()} for name, own in CITY_LIMITS.items()}


def make_inventory():
    """Build an inventory of the city's buildings, in no order, and of one that has no archetype."""
    random = np.random.default_rng(5)
    kind = random.permutation(np.repeat([*CITY.archetypes, "tent"], [*CITY.counts, 1]))
    count = kind.size
    frame = pd.DataFrame(
        {
            "id": [f"b{place}" for place in range(count)],
            "longitude": random.uniform(20.0, 21.0, count),
            "latitude": random.uniform(40.0, 40.5, count),
            "structure_type": kind,
            "replacement_cost": random.uniform(1e5, 3e6, count),
            "number": random.integers(1, 9, count),
            "owner": [f"owner {place % 3}" for place in range(count)],
        },
        index=np.arange(count) + 100,
    )
    return wd.inventories.from_table(frame)


INVENTORY = make_inventory()


def make_stock(inventory=INVENTORY):
    """Return the stock of the inventory, whose portfolio is the city."""
    with pytest.warns(UserWarning, match="left out"):
        return wd.inventories.portfolio(
            inventory,
            {name: name for name in CITY.archetypes},
            archetypes=CITY.archetypes,
            limits=LIMITS,
            unknown="leave out",
        )


@pytest.fixture(scope="module")
def stock():
    return make_stock()


def counted_of(scene, **how):
    return simulate(scene, statistics=wd.DamageCounts(LIMITS, over="building", **how))


def test_results_are_those_of_the_full_table(stock, monkeypatch):
    with_failures(monkeypatch, 0.009)
    scene = scene_of("crossed", stock.portfolio)
    run = simulate(scene)
    asked = [
        wd.DamageCounts(LIMITS, over=("building", "stripe")),
        wd.DamageLoss(LIMITS, OF_CITY, stock.replacement_costs(INVENTORY), over=("building", "stripe")),
    ]
    level = float(np.unique(run["im_level"])[1])
    counted = simulate(scene, statistics=asked).sel(stripe=level)
    results = wd.building_results(counted, stock, INVENTORY, OF_CITY)
    assert results["id"].tolist() == [name for name in INVENTORY["id"] if name not in left_out(stock)]
    monkeypatch.setattr("test_building_numbers.CITY_LIMITS", LIMITS)
    states = states_of(run)
    seen = set()
    for _, row in results.iterrows():
        own = INVENTORY[INVENTORY["id"] == row["id"]].iloc[0]
        for name in INVENTORY.columns:  # every column of the inventory is kept
            assert row[name] == own[name]
        assert row["archetype"] == own["structure_type"]
        chosen = (run["building"].values == row["building"]) & (run["im_level"].values == level)
        name = str(run["archetype"].values[run["archetype_index"].values[chosen][0]])
        assert name == row["archetype"]
        found = states[chosen]
        good = found[found >= 0]
        assert (row["sample_count"], row["failed_count"]) == (good.size, (found < 0).sum())
        seen |= set(found.tolist())
        for place, state in enumerate(STATES):
            is_there = (good == place).astype(float)
            assert row[f"probability_{state}"] == pytest.approx(is_there.mean(), rel=1e-14, abs=1e-16)
            # What numpy calls the standard error of a mean; some additions of numbers up to 1.
            expected = is_there.std(ddof=1) / np.sqrt(good.size)
            assert row[f"standard_error_{state}"] == pytest.approx(expected, rel=1e-12, abs=1e-15)
        mean, deviation = ratios_by_hand(name, good)
        assert row["expected_loss_ratio"] == pytest.approx(mean.mean(), rel=1e-12, abs=1e-15)
        by_hand = np.sqrt(mean.var(ddof=1) + (deviation**2).mean())
        assert row["loss_ratio_standard_deviation"] == pytest.approx(by_hand, rel=1e-12, abs=1e-15)
        cost = own["replacement_cost"]
        assert row["expected_loss"] == pytest.approx(cost * mean.mean(), rel=1e-12, abs=1e-9)
        assert row["loss_standard_deviation"] == pytest.approx(cost * by_hand, rel=1e-12, abs=1e-9)
    assert seen == {-1, 0, 1, 2}
    # And what was added up while the histories ran.
    in_order = results.set_index("building").sort_index()
    np.testing.assert_allclose(in_order["expected_loss"], counted["loss_mean_by_building_stripe"], rtol=1e-12)


def left_out(stock):
    return {INVENTORY["id"].iloc[place] for place in stock.left_out}


def ratios_by_hand(name, states):
    """Return mean and standard deviation of the loss ratio in each of some states."""
    table = [(0.0, 0.0)]
    for given in OF_CITY[name].values():
        mean, variation = given if isinstance(given, tuple) else (given, 0.0)
        table.append((mean, mean * variation))
    return np.array(table)[states].T


def test_one_sample_tells_no_error_and_none_no_probability(stock):
    counted = counted_of(scene_of("one motion", stock.portfolio))
    assert (counted["damage_count_by_building"].sum("damage_state") == 1).all()
    one = wd.building_results(counted, stock, INVENTORY, OF_CITY)
    assert one.filter(like="standard_error").isna().all(axis=None)
    assert one["loss_standard_deviation"].isna().all()
    assert set(one.filter(like="probability").to_numpy().ravel()) <= {0.0, 1.0}
    counted["damage_count_by_building"][3] = 0
    counted["failed_count_by_building"][3] = [1, 0, 0, 0]
    none = wd.building_results(counted, stock, INVENTORY, OF_CITY).set_index("building").loc[3]
    assert (none["sample_count"], none["failed_count"]) == (0, 1)
    assert none[["probability_none", "expected_loss_ratio", "expected_loss"]].isna().all()


def test_what_does_not_belong_together_is_refused(stock):
    counted = counted_of(scene_of("cloud", stock.portfolio))
    assert "expected_loss" not in wd.building_results(counted, stock, INVENTORY)

    def refuses(message, run=counted, of=stock, inventory=INVENTORY, ratios=None, kind=ValueError):
        with pytest.raises(kind, match=message):
            wd.building_results(run, of, inventory, ratios)

    renamed = INVENTORY.assign(id=INVENTORY["id"].where(INVENTORY["id"] != "b4", "c4"))
    refuses("made from another inventory: 1 different id, such as 'c4' in row 4, which was 'b4'", inventory=renamed)
    refuses("the inventory has 20 rows, but the stock was made from one with 26", inventory=INVENTORY.iloc[:20])
    refuses("no column 'id', only longitude, latitude", inventory=INVENTORY.drop(columns="id"))
    refuses("takes an inventory, got dict", inventory={}, kind=TypeError)
    refuses("takes a BuildingStock, got Portfolio", of=stock.portfolio, kind=TypeError)
    without = INVENTORY.drop(columns="replacement_cost")
    refuses("no column replacement_cost", inventory=without, ratios=OF_CITY)
    some = INVENTORY.assign(replacement_cost=INVENTORY["replacement_cost"].where(INVENTORY["id"] != "b4"))
    refuses(r"1 \('b4'\) of 25 buildings have no replacement cost", inventory=some, ratios=OF_CITY)
    refuses("column 'sample_count', but a result has the same name", inventory=INVENTORY.assign(sample_count=1))
    refuses("loss_ratios must name the damage states", ratios={"slight": 0.1})
    refuses(
        r"no damage counts over \('building',\)",
        run=counted.drop_vars("damage_count_by_building").assign(
            damage_count_by_motion=(("motion", "damage_state"), np.ones((3, 3)))
        ),
    )
    refuses("the dataset has no damage counts: give the result of simulate", run=simulate(scene_of("cloud", CITY)))
    larger = counted.assign(damage_limit=counted["damage_limit"] * 2)
    refuses(r"the counts have the limit .* but the stock has .*DamageCounts\(stock.limits", run=larger)
    several = counted_of(scene_of("crossed", stock.portfolio))
    refuses(r"the counts mix 3 levels of intensity: use DamageCounts.*over=\('building', 'stripe'\)", run=several)
    fewer = INVENTORY[INVENTORY["id"] != INVENTORY["id"].iloc[stock.rows[-1]]]
    refuses("the run has 25 buildings and the stock 24", of=make_stock(fewer), inventory=fewer)
    turned = INVENTORY.assign(structure_type=INVENTORY["structure_type"].replace({"low": "high", "high": "low"}))
    refuses("the run has 13 buildings of archetype 'low' and the stock 4:", of=make_stock(turned), inventory=turned)


def test_events_by_which_motions_are_counted(stock):
    counted = counted_of(scene_of("cloud", stock.portfolio), events=["b", "a", "b"])
    results = wd.building_results(counted, stock, INVENTORY)
    assert (results["sample_count"] == 2).all()


def test_an_earthquake_that_is_drawn_again_tells_nothing_new(stock):
    motions = scene_of("cloud", stock.portfolio).excitation.motions
    grid = [[[0], [1], [2]]]  # one site, so that an earthquake drawn again brings the same motion again
    once, often = (
        counted_of(
            scene_of(
                wd.MotionsAtSites(motions, grid, 2.0, site=np.zeros((stock.portfolio.buildings, draws), int)),
                stock.portfolio,
            )
        )
        for draws in (3, 15)
    )
    expected, found = (wd.building_results(each, stock, INVENTORY, OF_CITY) for each in (once, often))
    assert (expected["sample_count"] == 3).all()
    assert (found["sample_count"] == 15).all()
    assert (expected["standard_error_none"] > 0).any()
    # The three earthquakes in another number of draws; shares of 15 and of 3 round differently.
    for name in found.columns[found.columns.str.contains("probability|error|loss")]:
        np.testing.assert_allclose(found[name], expected[name], rtol=1e-12, atol=1e-15)
    two = wd.MotionsAtSites(motions, grid, 2.0, np.zeros((stock.portfolio.buildings, 4), int), earthquake=[0, 2, 2, 0])
    of_two = wd.building_results(counted_of(scene_of(two, stock.portfolio)), stock, INVENTORY)
    share = of_two["probability_none"]
    np.testing.assert_allclose(of_two["standard_error_none"], np.sqrt(share * (1 - share)))  # n is 2
    alone = wd.MotionsAtSites(motions, grid, 2.0, np.zeros((stock.portfolio.buildings, 4), int), earthquake=[1] * 4)
    one = wd.building_results(counted_of(scene_of(alone, stock.portfolio)), stock, INVENTORY)
    assert one.filter(like="standard_error").isna().all(axis=None)
    by_earthquake = simulate(
        scene_of(two, stock.portfolio), statistics=wd.DamageCounts(LIMITS, over=("building", "earthquake"))
    )
    selected = wd.building_results(by_earthquake.sel(earthquake="2"), stock, INVENTORY)
    assert (selected["sample_count"] == 2).all()
    assert selected.filter(like="standard_error").isna().all(axis=None)
    with pytest.warns(
        UserWarning, match="number of different earthquakes of the motions is unknown .*attribute 'scene'"
    ):
        unknown = wd.building_results(often.drop_attrs(), stock, INVENTORY)
    assert unknown["standard_error_none"].max() < found["standard_error_none"].max()


def test_losses_of_events(stock):
    costs = stock.replacement_costs(INVENTORY)
    scene, events = scene_of("cloud", stock.portfolio), ["b", "a", "b"]
    counted = simulate(scene, statistics=wd.DamageLoss(LIMITS, OF_CITY, costs, events=events, over="event"))
    found = wd.event_losses(counted)
    run = simulate(scene)
    drift = np.nanmax(run["peak_storey_drift_ratio"].values.astype(np.float64), axis=1)
    drift = np.where(run["status"] == 1, np.inf, drift).reshape(-1, 3)
    names = np.repeat(list(stock.portfolio.archetypes), stock.portfolio.counts)
    for place, motions in enumerate(([0, 2], [1])):
        worst, loss, variance = drift[:, motions].max(axis=1), 0.0, 0.0
        for name, cost, each in zip(names, costs, worst, strict=True):
            state = sum(each > limit for limit in LIMITS[name].values())
            mean, deviation = ratios_by_hand(name, state)
            loss, variance = loss + cost * mean, variance + (cost * deviation) ** 2
        assert float(found["loss"][place]) == pytest.approx(loss, rel=1e-12)
        assert float(found["loss_deviation"][place]) == pytest.approx(np.sqrt(variance), rel=1e-12)
    larger = int(np.argmax(found["loss"].values))
    assert found["exceedance_probability"].values.tolist() == [0.0 if place == larger else 0.5 for place in range(2)]
    rated = wd.event_losses(
        counted, event_rates=xr.DataArray([0.01, 0.002], {"event": ["a", "b"]}), return_periods=[50]
    )
    rates, losses = np.array([0.002, 0.01]), found["loss"].values  # the losses are of "b" and "a"
    assert float(rated["expected_annual_loss"]) == pytest.approx(rates @ losses, rel=1e-12)
    above = [rates[1] if losses[1] > losses[0] else 0.0, rates[0] if losses[0] > losses[1] else 0.0]
    np.testing.assert_allclose(rated["loss_exceedance_rate"], above)
    assert float(rated["return_period_loss"][0]) == 0.0  # any loss comes every 83 years
    axes = wd.plots.loss_exceedance(found).axes[0]
    np.testing.assert_allclose(axes.lines[0].get_xdata(), [0.0, *np.sort(losses)])
    np.testing.assert_allclose(axes.lines[0].get_ydata(), [1.0, 0.5, 0.0])
    assert wd.plots.loss_exceedance(rated).axes[0].get_yscale() == "log"


def test_losses_that_are_not_one_a_building_are_refused(stock):
    for design, over, message in (
        ("crossed", "motion", "motions have 75 to 75 samples; each building must have one"),
        ("at sites", "motion", "motions have .* samples; each building must have one"),
        ("cloud", "archetype", "no losses by event, motion or earthquake alone"),
    ):
        counted = simulate(scene_of(design, stock.portfolio), statistics=wd.DamageLoss(LIMITS, OF_CITY, over=over))
        with pytest.raises(ValueError, match=message):
            wd.event_losses(counted)
    counted = simulate(scene_of("cloud", stock.portfolio), statistics=wd.DamageLoss(LIMITS, OF_CITY, over="motion"))
    with pytest.raises(ValueError, match="one annual rate of at least 0 for each of the 3 events"):
        wd.event_losses(counted, event_rates=[0.1])
    counted["failed_count_by_motion"][1, 0], counted["counted_count_by_motion"][1] = 2, 23
    with pytest.raises(ValueError, match="2 of 25 buildings failed in motion 1; at most 1 % may"):
        wd.event_losses(counted)
