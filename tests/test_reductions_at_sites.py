"""Statistics of buildings under motions at sites: the worst component of each draw, against damage_shares by draw."""

import numpy as np
import pytest
from reduced_runs import CITY, CITY_LIMITS, MOTIONS, scene_of, simulate, small_blocks, statistics_of, with_failures

import warpdyn as wd

pytestmark = pytest.mark.meant_as_given(
    "first_period", "yield_base_shear_coefficient", "intensity_level", "scale_factor"
)
# Two earthquakes with both components at three sites, five draws; the motions are six, in pairs.
PAIRED = [*MOTIONS, *(wd.GroundMotion(0.8 * motion.acceleration[::-1], motion.step) for motion in MOTIONS)]
PAIR = np.array([[0, 1], [2, 1], [0, 2]])  # of each site in each earthquake
DRAWN = np.random.default_rng(4).integers(0, 3, (CITY.buildings, 5))
EARTHQUAKE = [0, 1, 0, 0, 1]
BOTH = wd.MotionsAtSites(
    PAIRED, np.stack([PAIR, PAIR + 3], axis=-1), 4.0, DRAWN, earthquake=EARTHQUAKE, names=["north", "south"]
)
EVENTS = ["a", "b", "c", "a", "b", "c"]


def worst_of_draws(run):
    """Return the damage state of each building in each draw, by the worse component; -1 if it failed."""
    drift = np.nanmax(run["peak_storey_drift_ratio"].values, axis=1, initial=-np.inf).reshape(CITY.buildings, 5, 2)
    status = run["status"].values.reshape(drift.shape)
    found = np.full((CITY.buildings, 5), -1)
    for building, draw in np.ndindex(*found.shape):
        name = list(CITY.archetypes)[np.searchsorted(np.cumsum(CITY.counts), building, side="right")]
        limits = list(CITY_LIMITS[name].values())
        states = [
            len(limits) if status[building, draw, k] == 1 else int(np.sum(drift[building, draw, k] > limits))
            for k in range(2)
            if status[building, draw, k] < 2
        ]
        if len(states) == 2 or len(limits) in states:
            found[building, draw] = max(states)
    return found


def test_the_worse_component_of_each_draw_counts(monkeypatch):
    with_failures(monkeypatch, 0.02)
    scene = scene_of(BOTH, CITY)
    with pytest.warns(UserWarning, match="diverged"):
        run = simulate(scene)
    worst = worst_of_draws(run)
    assert {-1, 0, 1, 2} == set(np.unique(worst))
    value = np.linspace(1e5, 3e6, CITY.buildings)
    overs = ("building", ("building", "earthquake"), ("archetype", "event"))
    asked = [wd.DamageCounts(CITY_LIMITS, over=over, events=EVENTS) for over in overs]
    asked.append(wd.DamageLoss(CITY_LIMITS, {"slight": 0.1, "complete": 1.0}, value, over="earthquake", events=EVENTS))
    with pytest.warns(UserWarning, match="failed"):
        counts = simulate(scene, statistics=asked)
    of_draw, event = np.array(EARTHQUAKE), np.array([0, 1, 2])[PAIR[DRAWN, EARTHQUAKE]]
    archetype = np.repeat(np.arange(len(CITY.counts)), CITY.counts)
    for state in range(3):
        name = "damage_count_by_"
        is_so = worst == state
        np.testing.assert_array_equal(counts[f"{name}building"][:, state], is_so.sum(axis=1))
        for earthquake in range(2):
            expected = is_so[:, of_draw == earthquake].sum(axis=1)
            np.testing.assert_array_equal(counts[f"{name}building_earthquake"][:, earthquake, state], expected)
        for place in range(3):
            both = is_so & (event == place)
            expected = [both[archetype == kind].sum() for kind in range(len(CITY.counts))]
            np.testing.assert_array_equal(counts[f"{name}archetype_event"][:, place, state], expected)
    np.testing.assert_array_equal(counts["failed_count_by_building"].sum("failure"), (worst < 0).sum(axis=1))
    assert counts["earthquake"].values.tolist() == ["north", "south"]
    assert counts["event"].values.tolist() == ["a", "b", "c"]
    loss = np.array([0.0, 0.1, 1.0])[worst] * value[:, None]
    for earthquake in range(2):
        own = (worst >= 0) & (of_draw == earthquake)
        got = counts["loss_sum_by_earthquake"][earthquake]
        np.testing.assert_allclose(got, loss[own].sum(), rtol=1e-12)  # sums of a hundred numbers
    small_blocks(monkeypatch, 30)
    with pytest.warns(UserWarning, match="failed"):
        again = simulate(scene, statistics=asked, threads=2)
    assert statistics_of(again).identical(statistics_of(counts))


def test_a_building_in_all_draws_is_what_damage_shares_counts_by_draw():
    scene = scene_of(BOTH, CITY)
    run = wd.sites.label_samples(simulate(scene), BOTH)
    shares = wd.damage_shares(run, CITY_LIMITS, events=run["draw_index"])
    by_draw = (shares["archetype_damage_share"] * shares["counted_buildings"]).sum("event")
    counts = simulate(scene, statistics=wd.DamageCounts(CITY_LIMITS, over="archetype", events=EVENTS))
    # Shares times numbers of buildings are whole numbers but for rounding.
    np.testing.assert_allclose(counts["damage_count_by_archetype"], by_draw, rtol=1e-14)


def test_draws_count_by_themselves_also_where_all_sites_have_the_same_motions():
    motion, events = np.broadcast_to([[[0, 3], [1, 4]]], (3, 2, 2)), EVENTS
    shared = wd.MotionsAtSites(PAIRED, motion, 4.0, DRAWN, earthquake=EARTHQUAKE, names=["north", "south"])
    asked = wd.DamageCounts(CITY_LIMITS, over=("building", "event"), events=events)
    counts = simulate(scene_of(shared, CITY), statistics=asked)["damage_count_by_building_event"].sum("damage_state")
    # Three draws are of the first earthquake, two of the second; nothing is of the third event.
    np.testing.assert_array_equal(counts, np.broadcast_to([3, 2, 0], counts.shape))


def test_without_events_components_count_by_themselves():
    counts = simulate(scene_of(BOTH, CITY), statistics=wd.DamageCounts(CITY_LIMITS, over="earthquake"))
    found = counts["damage_count_by_earthquake"].sum("damage_state") + counts["failed_count_by_earthquake"].sum(
        "failure"
    )
    assert found.values.tolist() == [CITY.buildings * 6, CITY.buildings * 4]


@pytest.mark.fast
def test_components_of_two_events_are_refused():
    asked = wd.DamageCounts(CITY_LIMITS, over="event", events=["a", "b", "c", "a", "b", "b"])
    with pytest.raises(ValueError, match="those at site 1 in earthquake 0 have the events 'c' and 'b'"):
        simulate(scene_of(BOTH, CITY), statistics=asked)
    nameless = wd.DamageCounts(CITY_LIMITS, over="event", events=["a", "", "c", "a", "b", "c"])
    with pytest.raises(ValueError, match=r"events must have names, but that of motion 1 is '': name the records"):
        simulate(scene_of(BOTH, CITY), statistics=nameless)
    with pytest.raises(ValueError, match="unknown over 'earthquake'"):
        simulate(scene_of("cloud"), statistics=wd.DamageCounts({"slight": 0.01}, over="earthquake"))
