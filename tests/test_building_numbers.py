"""Buildings that a row of an inventory stands for: added up from the full table by numpy, and in shares."""

import warnings

import numpy as np
import pandas as pd
import pytest
from reduced_runs import CITY, CITY_LIMITS, MARKS, assert_made_of, scene_of, simulate, small_blocks, with_failures
from test_reduced_losses import RATIOS

import warpdyn as wd

pytestmark = MARKS
STATES = ("none", "slight", "complete")
# Some are parts of a building, as in exposure models where a count was divided among cells.
NUMBER = np.where(np.arange(CITY.buildings) % 3 == 0, 12.375, 1.0 + np.arange(CITY.buildings) % 5)


def states_of(run):
    """Return the damage state of every sample by its place among the states, -1 where it failed."""
    drift = run["peak_storey_drift_ratio"].values.astype(np.float64)
    worst = np.fmax.reduce(drift, axis=1)  # NaN if the sample failed
    names = run["archetype"].values[run["archetype_index"].values]
    limits = np.array([list(CITY_LIMITS[str(name)].values()) for name in names])
    found = np.where(run["status"] == 1, 2, (worst[:, None] > limits).sum(axis=1))
    return np.where(run["status"] > 1, -1, found)


@pytest.mark.parametrize(
    ("design", "over"), [("crossed", ("motion", "stripe")), ("one motion", ("cell",)), ("at sites", ("motion",))]
)
def test_numbers_are_those_of_the_full_table(design, over, monkeypatch):
    with_failures(monkeypatch, 0.009)
    scene = scene_of(design, CITY)
    labels = {"cell": np.arange(CITY.buildings) // 7} if "cell" in over else {}
    asked = wd.DamageCounts(CITY_LIMITS, number=NUMBER, over=over, labels=labels)
    run, found = simulate(scene), simulate(scene, statistics=asked)
    suffix, states = "_by_" + "_".join(over), states_of(run)
    plain = simulate(scene, statistics=wd.DamageCounts(CITY_LIMITS, over=over, labels=labels))
    assert found[f"damage_count{suffix}"].identical(plain[f"damage_count{suffix}"])
    assert not any("number_of_buildings" in str(name) for name in plain)

    def check(got, event, chosen):
        number, own = NUMBER[event["building"].values[chosen]], states[chosen]
        # Eighths of whole numbers are exact in floating-point numbers.
        for place, name in enumerate(STATES):
            assert got[f"number_of_buildings{suffix}"].sel(damage_state=name) == number[own == place].sum()
        assert got[f"failed_number_of_buildings{suffix}"] == number[own == -1].sum()

    assert_made_of(found, run, over, labels, check)
    if design == "crossed":
        assert (states == -1).any()
    small_blocks(monkeypatch, 40)
    for threads in (1, 2):
        again = simulate(scene, statistics=asked, threads=threads)
        assert again[f"number_of_buildings{suffix}"].identical(found[f"number_of_buildings{suffix}"]), threads


def test_sums_of_any_numbers_do_not_depend_on_blocks(monkeypatch):
    number = np.random.default_rng(3).random(CITY.buildings) + 0.1
    asked = wd.DamageCounts(CITY_LIMITS, number=number, over="motion")
    found = simulate(scene_of("crossed", CITY), statistics=asked)["number_of_buildings_by_motion"]
    small_blocks(monkeypatch, 40)
    assert simulate(scene_of("crossed", CITY), statistics=asked)["number_of_buildings_by_motion"].identical(found)


@pytest.mark.parametrize("events", [None, ["b", "a", "b"]])
def test_shares_are_of_all_buildings(events):
    scene = scene_of("cloud", CITY)
    limits = {name: {state: limit / 8 for state, limit in own.items()} for name, own in CITY_LIMITS.items()}
    run = simulate(scene)
    along = "motion" if events is None else "event"
    asked = wd.DamageCounts(limits, number=NUMBER, events=events, over=("archetype", along))
    shares = wd.damage_shares(simulate(scene, statistics=asked))
    full = wd.damage_shares(run, limits, events=events, number=NUMBER)
    assert not np.allclose(shares["damage_share"], wd.damage_shares(run, limits, events=events)["damage_share"])
    for name in ("damage_share", "archetype_damage_share", "counted_buildings", "failed_buildings"):
        np.testing.assert_array_equal(shares[name], full[name])  # sums of eighths are exact
    # By hand, of the whole city: the worst drift of an event over the building's own limits.
    drift = np.nanmax(run["peak_storey_drift_ratio"].values.astype(np.float64), axis=1)
    drift = np.where(run["status"] == 1, np.inf, drift).reshape(CITY.buildings, 3)
    members = [[0], [1], [2]] if events is None else [[0, 2], [1]]
    own = np.repeat([limits[name]["complete"] for name in CITY.archetypes], CITY.counts)
    for place, motions in enumerate(members):
        is_complete = drift[:, motions].max(axis=1) > own
        expected = NUMBER[is_complete].sum() / NUMBER.sum()
        got = shares["damage_share"].sel(damage_state="complete").isel({along: place})
        assert float(got) == pytest.approx(expected, rel=1e-14)  # one division
    # Losses of a portfolio follow from these shares, of archetypes whose buildings are of equal value.
    values = {
        name: float(NUMBER[np.repeat(np.arange(4), CITY.counts) == i].sum()) for i, name in enumerate(CITY.archetypes)
    }
    losses = wd.portfolio_losses(shares, RATIOS, values)["loss"]
    each = wd.DamageLoss(limits, RATIOS, NUMBER, events=events, over=along)
    expected = simulate(scene, statistics=each)[f"loss_sum_by_{along}"]
    np.testing.assert_allclose(losses, expected, rtol=1e-12)


@pytest.mark.parametrize(
    ("number", "message"),
    [
        ([1.0, 2.0], r"number must be above 0 for each of the 25 buildings, got shape \(2,\)"),
        (np.zeros(25), r"got shape \(25,\) and a least value of 0"),
        (np.full(25, np.nan), r"number\[0\] is nan"),
    ],
)
def test_numbers_that_do_not_fit_are_refused(number, message):
    asked = wd.DamageCounts(CITY_LIMITS, number=number, over="motion")
    with pytest.raises(ValueError, match=message):
        simulate(scene_of("crossed", CITY), statistics=asked)
    with pytest.raises(ValueError, match=r"number(\[0\] is nan| must be above 0 and have one value for each building)"):
        wd.damage_shares(simulate(scene_of("cloud", CITY)), CITY_LIMITS, number=number)


def test_counts_have_had_their_numbers():
    found = simulate(scene_of("cloud", CITY), statistics=wd.DamageCounts(CITY_LIMITS, over=("archetype", "motion")))
    with pytest.raises(ValueError, match="give number= to DamageCounts"):
        wd.damage_shares(found, number=NUMBER)


def test_columns_of_a_table_are_taken_as_they_stand(tmp_path):
    # A column has an index of its own, by which nothing is sorted; a run with a path has it in its fingerprint.
    index = np.arange(CITY.buildings)[::-1]
    town = pd.Series(np.where(np.arange(CITY.buildings) % 2 == 0, "Berkeley", "Oakland"), index)
    for labels in ({"town": town}, {"town": town.astype("category")}):
        asked = [
            wd.DamageCounts(CITY_LIMITS, number=pd.Series(NUMBER, index), over="town", labels=labels),
            wd.DamageLoss(CITY_LIMITS, RATIOS, pd.Series(NUMBER, index), over="town", labels=labels),
        ]
        found = simulate(scene_of("cloud", CITY), statistics=asked, path=tmp_path / "run.nc", overwrite=True)
        plain = {"town": town.to_numpy().astype(str)}
        expected = simulate(
            scene_of("cloud", CITY),
            statistics=[
                wd.DamageCounts(CITY_LIMITS, number=NUMBER.tolist(), over="town", labels=plain),
                wd.DamageLoss(CITY_LIMITS, RATIOS, NUMBER, over="town", labels=plain),
            ],
        )
        assert found["town"].values.tolist() == ["Berkeley", "Oakland"]
        for name in ("number_of_buildings_by_town", "loss_sum_by_town"):
            np.testing.assert_array_equal(found[name], expected[name])
        assert found.attrs["fingerprint"] == expected.attrs["fingerprint"]


def test_a_column_in_the_order_of_the_inventory_is_told():
    # As a reader returns it; the buildings of the portfolio stand archetype by archetype.
    places = {"longitude": 0.0, "latitude": np.zeros(CITY.buildings), "id": np.arange(CITY.buildings)}
    inventory = wd.inventories.from_table(pd.DataFrame(places | {"number": NUMBER}))
    column, town = inventory["number"], (inventory["number"] > 2).astype(int)
    scene, told = scene_of("cloud", CITY), "column of the inventory, in the order of its rows"
    for asked, name in (
        (wd.DamageCounts(CITY_LIMITS, number=column), "DamageCounts: number"),
        (wd.DamageLoss(CITY_LIMITS, RATIOS, column), "DamageLoss: replacement_values"),
        (wd.DamageCounts(CITY_LIMITS, over="town", labels={"town": town}), r"DamageCounts: labels\['town'\]"),
    ):
        with pytest.warns(UserWarning, match=f"{name} is a {told}"):
            simulate(scene, statistics=asked)
    run = simulate(scene)
    with pytest.warns(UserWarning, match=f"damage_shares: number is a {told}"):
        wd.damage_shares(run, CITY_LIMITS, number=column)
    # In the order of a stock nothing is told, even where it is the same one.
    one = next(iter(CITY.archetypes.values()))
    stock = wd.inventories.portfolio(inventory, lambda table: ["one"] * len(table), archetypes={"one": one})
    in_order = stock.buildings(inventory)["number"]
    with warnings.catch_warnings():
        warnings.simplefilter("error")
        wd.damage_shares(run, CITY_LIMITS, number=in_order)
