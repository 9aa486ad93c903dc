"""Statistics that do not fit a run are refused by name, before anything runs."""

import numpy as np
import pytest
import xarray as xr
from reduced_runs import CITY, CITY_LIMITS, LIMITS, scene_of

import warpdyn as wd

pytestmark = [
    pytest.mark.fast,
    pytest.mark.meant_as_given("first_period", "yield_base_shear_coefficient", "intensity_level", "scale_factor"),
]
DRIFT = "peak_storey_drift_ratio"


@pytest.fixture(autouse=True)
def nothing_runs(monkeypatch):
    def ran(*arguments, **settings):
        raise AssertionError("it ran")

    monkeypatch.setattr("warpdyn.campaigns.running.regions.workers.Region", ran)
    monkeypatch.setattr("warpdyn.campaigns.running.regions.workers.compile_side_by_side", ran)
    monkeypatch.setattr("warpdyn.campaigns.running.regions.workers.compiling", ran)


CASES = [
    ("crossed", lambda: wd.DamageCounts({"slight": 0.004}, demand="peak_base_shear"), "records no 'peak_base_shear'"),
    ("crossed", lambda: wd.DemandMoments("peak_base_shear"), "records no 'peak_base_shear'.*peak_storey_drift"),
    ("crossed", lambda: wd.LargestDemand("status"), "records no 'status'"),
    ("crossed", lambda: wd.DamageCounts({"slight": 0.01, "moderate": 0.005}), "limits must increase"),
    ("crossed", lambda: wd.DamageCounts({"none": 0.01}), "'none' is the state of samples that exceed no limit"),
    ("crossed", lambda: wd.DamageCounts([0.01]), "limits must map"),
    ("crossed", lambda: wd.DamageCounts(LIMITS, over="building"), "unknown over 'building'.*'structure'"),
    ("crossed", lambda: wd.DamageCounts(LIMITS, over="motions"), "unknown over 'motions'.*did you mean 'motion'"),
    ("crossed", lambda: wd.DamageCounts(LIMITS, over="archetype"), "unknown over 'archetype'"),
    ("crossed", lambda: wd.DamageCounts(LIMITS, over="event"), "over='event' needs events=.*'motion'"),
    ("crossed", lambda: wd.DamageCounts(LIMITS, over=("motion", "motion")), "name each dimension at most once"),
    ("cloud", lambda: wd.DamageCounts(LIMITS, over="stripe"), "unknown over 'stripe'"),
    ("sequence", lambda: wd.DamageCounts(LIMITS, over="motion"), "add 'event' to over="),
    (
        "sequence",
        lambda: wd.DamageCounts(LIMITS, over="event", events=["a"] * 3),
        "an EventSequence has its own events: remove events",
    ),
    ("crossed", lambda: wd.DamageCounts(LIMITS, over="event", events=["a"]), "each of the 3 motions, got 1"),
    (
        "crossed",
        lambda: wd.DamageCounts(LIMITS, over="event", events="abc"),
        "events must be the event of each motion, .* got 'abc'",
    ),
    ("crossed", lambda: wd.DamageCounts(LIMITS, over=("motion", "event"), events=[1, 2, 2]), "unknown over 'motion'"),
    (
        "crossed",
        lambda: wd.DamageCounts(LIMITS, over="cell", labels={"cell": np.zeros(20, int)}),
        r"labels\['cell'\] must contain a label for each of the 21 structures, got shape \(20,\)",
    ),
    (
        "crossed",
        lambda: wd.DamageCounts(LIMITS, over="cell", labels={"cell": np.zeros(21)}),
        r"labels\['cell'\] must be names or whole numbers, got values of type float64",
    ),
    (
        "crossed",
        lambda: wd.DamageCounts(LIMITS, over="motion", labels={"motion": np.zeros(21, int)}),
        "'motion' cannot name a dimension",
    ),
    ("crossed", lambda: wd.DemandMoments("input_energy", each_place=True), "each_place=True needs a demand"),
    (
        "crossed",
        lambda: wd.DamageCounts({"a": {DRIFT: 0.01, "peak_floor_acceleration": 3.0}}, each_place=True),
        "each_place=True needs limits of one demand",
    ),
    (
        "crossed",
        lambda: [wd.DamageCounts(LIMITS), wd.DamageCounts({"other": 0.01})],
        "two statistics have different values (of|along) 'dam",
    ),
    ("city crossed", lambda: wd.DamageCounts(LIMITS), "limits name 'slight', which is not an archetype"),
    (
        "city crossed",
        lambda: wd.DamageCounts({name: CITY_LIMITS[name] for name in list(CITY.archetypes)[1:]}),
        "limits lack archetype 'low'",
    ),
    (
        "city crossed",
        lambda: wd.DamageCounts(CITY_LIMITS | {"middle": {}}),
        "archetype 'middle': limits must map each damage state to a drift ratio, got {}",
    ),
    (
        "city crossed",
        lambda: wd.DamageCounts(CITY_LIMITS | {"middle": 0.01}),
        "archetype 'middle': limits must map each damage state to a drift ratio, got 0.01",
    ),
    ("city cloud", lambda: wd.DamageCounts(CITY_LIMITS, over="earthquake"), "unknown over 'earthquake'"),
    ("city cloud", lambda: wd.DamageCounts(CITY_LIMITS | {"lower": LIMITS}), "limits name 'lower'"),
]


@pytest.mark.parametrize(("design", "made", "message"), CASES, ids=range(len(CASES)))
def test_statistics_that_do_not_fit_are_refused(design, made, message):
    with pytest.raises((TypeError, ValueError), match=message):
        wd.simulate(
            scene_of(design), structures=1 if design.startswith("city") else 21, device="cpu", statistics=made()
        )


@pytest.mark.parametrize(
    ("made", "error", "message"),
    [
        (lambda: wd.DemandHistogram(DRIFT, [0.01, 0.005]), ValueError, "edges must be a row .* that increase"),
        (lambda: wd.DemandHistogram(DRIFT, [0.01, 0.01]), ValueError, "edges must be a row .* that increase"),
        (lambda: wd.DemandHistogram(DRIFT, []), ValueError, "edges must be a row"),
        (lambda: wd.DemandHistogram(DRIFT, [0.0, np.nan]), ValueError, r"edges\[1\] is nan"),
        (lambda: wd.DemandHistogram(DRIFT, [0.05], ()), ValueError, "edges must be a row of 2 to"),
        (lambda: wd.DamageCounts(LIMITS, events=5), TypeError, "events must be the event of each motion"),
        (lambda: wd.DamageCounts({"slight": True}), ValueError, "limits of 'slight' must be a finite number"),
        (lambda: wd.DemandMoments(5), TypeError, "demand must be text, got 5"),
        (
            lambda: wd.DemandHistogram(DRIFT, [0.05, 0.1], quantiles=(0.5, 1.0)),
            ValueError,
            "probabilities between 0 and 1",
        ),
        (lambda: wd.DamageCounts(LIMITS, each_place="storey"), TypeError, "each_place must be True or False"),
        (lambda: wd.DamageCounts(LIMITS, over=3), TypeError, "over must be a name or several"),
        (lambda: wd.DamageCounts(LIMITS, over={"cell": [1]}), TypeError, "over must be a name or several"),
        (lambda: wd.DamageCounts(LIMITS, labels={"cell": [1]}), ValueError, "labels has 'cell', which is not in over"),
        (lambda: wd.DamageCounts(LIMITS, labels=[1]), TypeError, "labels must map a name"),
    ],
)
def test_statistics_are_checked_when_they_are_made(made, error, message):
    with pytest.raises(error, match=message):
        made()


@pytest.mark.parametrize(
    ("settings", "error", "message"),
    [
        ({"histories": wd.Histories([0], 1)}, ValueError, "histories needs single samples"),
        ({"sample_error": 0.05}, ValueError, "sample_error needs single samples"),
        ({"statistics": []}, TypeError, "statistics must be"),
        ({"statistics": {"slight": 0.01}}, TypeError, "statistics must be a statistic, such as wd.DamageCounts"),
    ],
)
def test_arguments_that_do_not_go_together_are_refused(settings, error, message):
    given = {"statistics": wd.DamageCounts(LIMITS)} | settings
    with pytest.raises(error, match=message):
        wd.simulate(scene_of("crossed"), structures=21, device="cpu", **given)


def test_limits_in_percent_are_warned_of():
    with pytest.warns(UserWarning, match="drift limit"), pytest.raises(AssertionError, match="it ran"):
        wd.simulate(scene_of("crossed"), device="cpu", statistics=wd.DamageCounts({"slight": 0.4, "complete": 2.0}))
    of_city = {name: {"slight": 0.4} for name in CITY.archetypes}
    with pytest.warns(UserWarning, match="drift limit"), pytest.raises(AssertionError, match="it ran"):
        wd.simulate(scene_of("city crossed"), device="cpu", statistics=wd.DamageCounts(of_city))


def test_counts_over_too_much_are_refused(monkeypatch):
    monkeypatch.setattr("warpdyn.campaigns.reductions.tally.free_memory", lambda device: 1000)
    statistic = wd.DamageCounts(LIMITS, over=("structure", "motion"))
    with pytest.raises(MemoryError, match=r"over 21 structures x 3 motions takes .* name fewer dimensions in over="):
        wd.simulate(scene_of("crossed"), structures=21, device="cpu", statistics=statistic)


@pytest.mark.parametrize(
    ("statistic", "numbers"),
    [
        # 8 bytes for each number: states or bins, and 4 kinds of failure.
        (wd.DamageCounts(LIMITS, over="structure"), 4 + 4),
        (wd.DamageLoss(LIMITS, dict.fromkeys(LIMITS, 0.5), over="structure"), 4 + 4),
        (wd.DemandHistogram(DRIFT, [0.005, 0.01], over="structure"), 3 + 4),
    ],
)
def test_counts_of_the_worst_storey_take_memory_for_one_place(statistic, numbers, monkeypatch):
    monkeypatch.setattr("warpdyn.campaigns.reductions.tally.free_memory", lambda device: 1000)
    size = f"{8 * 21 * numbers / 1e9:.3g} GB"
    with pytest.raises(MemoryError, match=f"over 21 structures takes {size}, "):
        wd.simulate(scene_of("crossed"), structures=21, device="cpu", statistics=statistic)


def test_more_cells_than_their_32_bit_numbers_are_refused():
    structures, cells = 2**16, np.arange(2**16) // 2
    statistic = wd.DamageCounts(LIMITS, over=("structure", "cell"), labels={"cell": cells})
    with pytest.raises(ValueError, match=r"over structure, cell has 2,147,483,648 cells, .* name fewer dimensions"):
        wd.simulate(scene_of("crossed"), structures=structures, device="cpu", statistics=statistic)


def test_counts_over_something_else_are_refused_by_the_functions_that_take_them():

    counts = xr.Dataset({"damage_count_by_motion": (("motion", "damage_state"), np.ones((3, 2), int))})
    with pytest.raises(ValueError, match=r"no damage counts over .'motion', 'structure_group', 'stripe'., only damage"):
        wd.fragility(counts)
    with pytest.raises(ValueError, match=r"no damage counts over .'archetype', 'event'. or .'archetype', 'motion'."):
        wd.damage_shares(counts)
    with pytest.raises(TypeError, match="only runs with DamageCounts need none"):
        wd.damage_shares(xr.Dataset({"status": ("sample", [0])}))
