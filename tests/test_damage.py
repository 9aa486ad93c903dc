"""Shares of buildings in each damage state: counted by hand, with limits by archetype, by record, pair and stripe."""

import numpy as np
import pytest
import xarray as xr
from labels import check_labels
from test_portfolio import DAMPED, MOTIONS, YIELDING, chain

import warpdyn as wd

pytestmark = pytest.mark.meant_as_given("drift_limit")

STATES = ("slight", "complete")
# Peak drift ratios [building, motion, storey] of three buildings with limits 1 and 2, and two with limits 10 and 20.
NAN = np.nan
DRIFTS = [
    [[0.5, NAN], [1.0, NAN], [2.5, NAN], [1.5, NAN]],
    [[1.5, NAN], [0.1, NAN], [0.2, NAN], [0.3, NAN]],
    [[0.1, NAN], [9.9, NAN], [1.1, NAN], [2.1, NAN]],
    [[9.0, 11.0], [25.0, 1.0], [1.0, 1.0], [2.0, 10.0]],
    [[5.0, 5.0], [5.0, 5.0], [5.0, 10.5], [15.0, 5.0]],
]
LIMITS = {"light": {"slight": 1.0, "complete": 2.0}, "heavy": {"slight": 10.0, "complete": 20.0}}


def made(drifts=DRIFTS, status=None, counts=(3, 2), **extra):
    drift = np.array(drifts, dtype=np.float32).reshape(-1, 2)
    buildings, samples = sum(counts), len(drift)
    each = samples // buildings
    flags = {
        "flag_values": np.arange(5, dtype=np.int8),
        "flag_meanings": "ok collapsed diverged unstable_step not_converged",
    }
    columns = {
        "building": np.repeat(np.arange(buildings), each),
        "archetype_index": np.repeat([0, 1], np.multiply(counts, each)),
        "motion_index": np.tile(np.arange(each), buildings),
    }
    return xr.Dataset(
        {
            "peak_storey_drift_ratio": (("sample", "storey"), drift),
            "status": ("sample", np.zeros(samples, np.int8) if status is None else status, flags),
            "motion_name": ("motion", [f"m{i}" for i in range(4)]),
            "buildings_of_archetype": ("archetype", list(counts)),
            "storeys_of_archetype": ("archetype", [1, 2]),
        },
        {"archetype": ["light", "heavy"]} | {name: ("sample", values) for name, values in (columns | extra).items()},
    )


def test_shares_are_those_counted_by_hand():
    shares = wd.damage_shares(made(), LIMITS)
    assert shares["damage_state"].values.tolist() == ["none", "slight", "complete"]
    light = shares["archetype_damage_share"].sel(archetype="light")
    assert light.dims == ("motion", "damage_state")
    # A drift equal to a limit does not pass it.
    np.testing.assert_array_equal(light * 3, [[2, 1, 0], [2, 0, 1], [1, 1, 1], [1, 1, 1]])
    heavy = shares["archetype_damage_share"].sel(archetype="heavy")
    np.testing.assert_array_equal(heavy * 2, [[1, 1, 0], [1, 0, 1], [1, 1, 0], [1, 1, 0]])
    np.testing.assert_allclose(shares["damage_share"] * 5, [[3, 2, 0], [3, 0, 2], [2, 2, 1], [2, 2, 1]])
    np.testing.assert_array_equal(shares["counted_buildings"], [[3] * 4, [2] * 4])
    np.testing.assert_array_equal(shares["damage_limit"], [[0, 1, 2], [0, 10, 20]])
    assert shares["motion_name"].values.tolist() == ["m0", "m1", "m2", "m3"]


def test_the_worse_component_of_a_pair_counts():
    shares = wd.damage_shares(made(), LIMITS, events=["first", "first", "second", "second"])
    assert shares["event"].values.tolist() == ["first", "second"]
    light = shares["archetype_damage_share"].sel(archetype="light")
    np.testing.assert_allclose(light * 3, [[1, 1, 1], [1, 0, 2]])
    heavy = shares["archetype_damage_share"].sel(archetype="heavy")
    np.testing.assert_allclose(heavy * 2, [[1, 0, 1], [1, 1, 0]])
    # Components need not stand side by side.
    crossed = wd.damage_shares(made(), LIMITS, events=["b", "a", "a", "b"])
    np.testing.assert_allclose(crossed["damage_share"].sel(event="a") * 5, [1, 1, 3])


def test_collapse_is_the_last_state_and_failures_are_kept_out():
    counts, drifts = (150, 150), np.full((300, 1, 2), 0.5)
    status = np.zeros(300, np.int8)
    status[[0, 1]] = 1
    status[2], drifts[2] = 2, NAN
    run = made(drifts, status, counts).drop_dims("motion").assign(motion_name=("motion", ["m0"]))
    shares = wd.damage_shares(run, LIMITS)
    np.testing.assert_array_equal(shares["counted_buildings"], [[149], [150]])
    np.testing.assert_allclose(shares["archetype_damage_share"][0, 0] * 149, [147, 0, 2])
    assert int(shares["failed_samples"]) == 1
    status[3:10] = 4
    with pytest.raises(ValueError, match="8 of 300 samples failed"):
        wd.damage_shares(run.assign(status=run["status"].copy(data=status)), LIMITS)


def test_a_pair_fails_with_one_of_its_components_unless_the_other_is_a_collapse():
    status = np.zeros(400, np.int8)
    status[5] = 2  # building 1 in event "a"
    drifts = np.full((100, 4, 2), 0.5)
    pairs = made(drifts, status, (50, 50))
    with pytest.warns(UserWarning, match="more than 1 % failed .*: 1 of 50 of archetype 'light' in event 'a'"):
        shares = wd.damage_shares(pairs, LIMITS, events=["a", "a", "b", "b"])
    np.testing.assert_array_equal(shares["counted_buildings"], [[49, 50], [50, 50]])
    np.testing.assert_array_equal(shares["failed_buildings"], [[1, 0], [0, 0]])
    # A collapse, or a drift beyond the last limit, stays one, whatever became of the other component.
    for known in ("collapsed", "complete"):
        status[4], drifts[1, 0] = (1, 0.5) if known == "collapsed" else (0, 2.5)
        shares = wd.damage_shares(made(drifts, status, (50, 50)), LIMITS, events=["a", "a", "b", "b"])
        np.testing.assert_array_equal(shares["counted_buildings"], [[50, 50], [50, 50]])
        np.testing.assert_allclose(shares["archetype_damage_share"][0, 0] * 50, [49, 0, 1])
        assert int(shares["failed_buildings"].sum()) == 0
        assert int(shares["failed_samples"]) == 1


def test_failures_are_judged_by_buildings_not_by_samples():
    # 1 % of the samples, but every building in the one event there is.
    status = np.zeros(20_000, np.int8)
    status[::100] = 4
    run = made(np.full((200, 100, 2), 0.5), status, (100, 100))
    run = run.drop_vars("motion_name").assign(motion_name=("motion", [f"m{i}" for i in range(100)]))
    with pytest.raises(ValueError, match="200 of 200 buildings, each counted once per event, failed; at most 1 %"):
        wd.damage_shares(run, LIMITS, events=[0] * 100)


def test_failures_of_buildings_that_stand_for_several_are_of_these():
    status = np.zeros(100, np.int8)
    status[0] = 2
    run = made(np.full((100, 1, 2), 0.5), status, (50, 50)).drop_dims("motion")
    run = run.assign(motion_name=("motion", ["m0"]))
    number = np.where(np.arange(100) == 0, 2000.0, 1.5)  # 1.5 of the 99 others: 148.5
    with pytest.raises(ValueError, match=r"^2,000 of 2,148\.5 buildings failed; at most 1 %"):
        wd.damage_shares(run, LIMITS, number=number)
    number[0] = 1.0
    with pytest.warns(UserWarning, match=r": 1 of 74\.5 of archetype 'light' in motion 0"):
        wd.damage_shares(run, LIMITS, number=number)


def test_one_archetype_of_some_of_the_samples():
    run = made()
    some = run.isel(sample=[0, 5, 13, 18, 3])
    for name, expected in (("light", [0, 5, 3]), ("heavy", [13, 18])):
        part = wd.select_archetype(some, name)
        rows = run["peak_storey_drift_ratio"][expected, : part.sizes["storey"]]
        np.testing.assert_array_equal(part["peak_storey_drift_ratio"], rows)


@pytest.mark.parametrize("events", [["1 Northridge", "1 Northridge", "2 Duzce", "2 Duzce"], [7, 7, 3, 3], None])
def test_shares_come_back_from_a_file(tmp_path, events):
    run = made().assign_attrs(title="a city", seed=3)
    shares = wd.damage_shares(run, LIMITS, events=events)
    assert shares.attrs == run.attrs
    check_labels(shares.drop_vars("motion_name", errors="ignore"))
    with xr.open_dataset(wd.write(shares, tmp_path / "shares.nc")) as read:
        assert read.attrs.pop("history").endswith("warpdyn.write")  # by which warpdyn knows its own
        xr.testing.assert_identical(read.load(), shares)


def test_stripes_are_counted_apart():
    level = ("sample", np.tile([0.2, 0.1, 0.2, 0.1], 5), {"design": "stripes", "units": "g"})
    run = made(motion_index=np.tile([0, 0, 1, 1], 5)).assign_coords(im_level=level).drop_vars("motion_name")
    run = run.assign(motion_name=("motion", ["a", "b"]))
    shares = wd.damage_shares(run, LIMITS)
    assert shares["damage_share"].dims == ("motion", "stripe", "damage_state")
    np.testing.assert_allclose(shares["damage_share"].sel(stripe=0.1) * 5, [[3, 0, 2], [2, 2, 1]])
    np.testing.assert_allclose(shares["damage_share"].sel(stripe=0.2) * 5, [[3, 2, 0], [2, 2, 1]])
    pair = wd.damage_shares(run, LIMITS, events=["both", "both"])["damage_share"]
    np.testing.assert_allclose(pair.sel(stripe=0.2) * 5, [[0, 4, 1]])
    assert shares["stripe"].attrs["units"] == "g"
    in_si = ("sample", level[1], {"design": "stripes", "units": "m s-1"})
    of_velocity = wd.damage_shares(run.assign_coords(im_level=in_si), LIMITS)["stripe"].attrs
    assert of_velocity == {"long_name": "intensity of the stripe", "units": "m s-1"}


BAD = {
    "no portfolio": (lambda run: run.drop_vars("archetype_index"), LIMITS, {}, "no 'archetype_index'"),
    "no drift": (lambda run: run.drop_vars("peak_storey_drift_ratio"), LIMITS, {}, "add 'drift' to Scene"),
    "missing": (None, {"light": LIMITS["light"]}, {}, "limits lack archetype 'heavy'"),
    "unknown": (None, {"lihgt": {}}, {}, "limits name 'lihgt'"),
    "states": (None, LIMITS | {"heavy": {"slight": 1.0}}, {}, "archetype 'heavy': its damage states are slight"),
    "order": (None, LIMITS | {"heavy": {"slight": 3.0, "complete": 2.0}}, {}, "'heavy': limits must increase"),
    "sign": (None, LIMITS | {"heavy": {"slight": -3.0, "complete": 2.0}}, {}, "'heavy': the limit of .*'slight' is"),
    "events": (None, LIMITS, {"events": [0, 1]}, "each of the 4 motions, got 2 events"),
    "a word": (None, LIMITS, {"events": "aabb"}, "each of the 4 motions, got 'aabb'"),
    "tuples": (None, LIMITS, {"events": [("a", 1)] * 4}, "events must be names or whole numbers, all of one kind"),
    "mixed": (None, LIMITS, {"events": ["a", "a", 1, 1]}, "events must be names or whole numbers, all of one kind"),
    "unnamed": (None, LIMITS, {"events": ["a", "a", None, None]}, "events must be names or whole numbers"),
    "none": (None, {name: {"none": 1.0} for name in LIMITS}, {}, "'none' is the state of buildings that exceed no"),
}  # fmt: skip


@pytest.mark.parametrize("case", BAD)
def test_bad_input(case):
    change, limits, settings, message = BAD[case]
    with pytest.raises((ValueError, TypeError), match=message):
        wd.damage_shares(made() if change is None else change(made()), limits, **settings)


@pytest.fixture(scope="module")
def run():
    scatter = {"yield_force": wd.RandomFactor(wd.Lognormal(1, 0.3))}
    city = wd.Portfolio({"low": wd.Archetype(chain(1), 12, scatter), "high": wd.Archetype(chain(2), 8, scatter)})
    levels = [0.05, 0.1, 0.2, 0.4, 0.8, 1.6]
    stripes = wd.Stripes(MOTIONS, levels, wd.PeakGroundAcceleration())
    return wd.simulate(wd.Scene(city, stripes, recorders=("drift",), tail=1.0), device="cpu", seed=3)


@pytest.mark.filterwarnings("ignore:.*:UserWarning")  # three records make no intervals
def test_one_archetype_reads_as_an_ordinary_run(run):
    part = wd.select_archetype(run, "high")
    assert dict(part.sizes) == {"sample": 8 * 3 * 6, "storey": 2, "motion": 3}
    assert np.isfinite(part["peak_storey_drift_ratio"]).all()
    assert wd.select_archetype(run, "low").sizes["storey"] == 1
    limits = {"slight": 0.001, "complete": 0.005}
    with pytest.raises(ValueError, match="archetype of the run 'tall'; allowed: 'low', 'high'"):
        wd.select_archetype(run, "tall")
    # Its fragility is that of the same buildings by themselves, drawn apart.
    scatter = {"yield_force": wd.GivenValues(part["yield_force"].values[:: 3 * 6].astype(np.float64))}
    stripes = wd.Stripes(MOTIONS, np.unique(part["im_level"]), wd.PeakGroundAcceleration())
    building = wd.ShearBuilding(2e3, [6e5] * 2, 3.0, **(YIELDING | DAMPED))
    scene = wd.Scene(building, stripes, scatter, recorders=("drift",), tail=1.0)
    alone = wd.simulate(scene, structures=8, longest_step=0.005, device="cpu")
    curves, own = (wd.fragility(each, limits) for each in (part, alone))
    xr.testing.assert_equal(curves, own)
    assert np.isfinite(curves["fragility_median"]).all()
    # The shares agree with the fragility's count of exceeding samples.
    shares = wd.damage_shares(run, {"low": limits, "high": limits})
    in_or_beyond = shares["archetype_damage_share"].sel(archetype="high").mean("motion")[:, ::-1].cumsum("damage_state")
    exceeding = curves["exceedance_fraction"].values.T
    np.testing.assert_allclose(in_or_beyond.values[:, 1::-1], exceeding, atol=1e-12)
    merged = run.merge(shares, combine_attrs="no_conflicts", compat="override")
    assert "damage_share" in merged


def test_a_run_that_is_not_of_a_portfolio_is_refused_with_what_to_type():
    building = chain(2)
    scene = wd.Scene(building, wd.Cloud(MOTIONS))
    run, limits = wd.simulate(scene, device="cpu"), {"slight": 0.002, "complete": 0.01}
    counts = wd.simulate(scene, device="cpu", statistics=wd.DamageCounts(limits, over=("motion",)))
    words = r"damage_shares: run contains one structure, not a wd.Portfolio.*wd.Archetype\(building, count\)"
    for dataset, given in ((run, {"houses": limits}), (run, limits), (run, None), (counts, None)):
        with pytest.raises(ValueError, match=rf"{words}.*limits={{'houses': limits}}; .*wd.fragility\(run, limits\)$"):
            wd.damage_shares(dataset, given)
    with pytest.raises(ValueError, match=r"select_archetype: run contains one structure.*use the run itself"):
        wd.select_archetype(run, "houses")
    with pytest.raises(ValueError, match="damage_shares: run has no 'archetype': give the run of a portfolio"):
        wd.damage_shares(xr.Dataset({"drift": ("sample", [0.1])}), {"houses": limits})
    # What the message proposes.
    portfolio = wd.Portfolio({"houses": wd.Archetype(building, 2)})
    whole = wd.simulate(wd.Scene(portfolio, wd.Cloud(MOTIONS)), device="cpu")
    assert wd.damage_shares(whole, {"houses": limits})["counted_buildings"].sum() == 2 * len(MOTIONS)
    with pytest.raises(ValueError, match=r"run has no 'archetype': .*not the result of select_archetype\(\)"):
        wd.damage_shares(wd.select_archetype(whole, "houses"), {"houses": limits})
