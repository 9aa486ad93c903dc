"""Counts that are named before a run equal those of the full table, however blocks and threads divide it."""

import numpy as np
import pytest
import xarray as xr
from labels import check_labels
from reduced_runs import (
    CITY,
    CITY_LIMITS,
    LIMITS,
    MARKS,
    MOTIONS,
    STRUCTURES,
    assert_made_of,
    city_of,
    scene_of,
    simulate,
    small_blocks,
    statistics_of,
    with_failures,
)
from scipy import stats

import warpdyn as wd

pytestmark = MARKS
DRIFT = "peak_storey_drift_ratio"
FAILURES = ("diverged", "unstable_step", "not_converged", "control_failed")


@pytest.fixture(scope="module")
def runs():
    """Return full runs by design, each made once; of the city where the design has that in front."""
    made = {}

    def run_of(design):
        if design not in made:
            made[design] = simulate(scene_of(design))
        return made[design]

    return run_of


def states_of(values, status, limits):
    """Return the damage state of samples; collapsed ones are in the last."""
    state = (values[:, None] > np.asarray(limits)).sum(axis=1)
    return np.where(status == 1, len(limits), state)[status <= 1]


def check_counts(counts, run, over, labels=None, each_place=False):
    """Check damage counts against the full run by numpy."""
    suffix = "_by_" + "_".join(over) if over else ""
    labels = {} if labels is None else labels

    def check(got, event, chosen):
        status = event["status"].values[chosen]
        drift = event[DRIFT].values[chosen].astype(np.float64)
        groups = {None: np.arange(chosen.size)}
        limits = {None: list(LIMITS.values())}
        if "archetype_index" in event.coords:
            of = event["archetype_index"].values[chosen]
            groups = {name: np.flatnonzero(of == i) for i, name in enumerate(CITY.archetypes)}
            limits = {name: list(CITY_LIMITS[name].values()) for name in CITY.archetypes}
        expected = np.zeros(got.sizes["damage_state"], dtype=int)
        for name, rows in groups.items():
            worst = np.fmax.reduce(drift[rows], axis=1, initial=-np.inf)
            expected += np.bincount(states_of(worst, status[rows], limits[name]), minlength=expected.size)
        np.testing.assert_array_equal(got[f"damage_count{suffix}"], expected)
        failed = [np.count_nonzero(status == 2 + place) for place in range(len(FAILURES))]
        np.testing.assert_array_equal(got[f"failed_count{suffix}"], failed)
        if each_place:
            for storey, row in enumerate(
                got[f"storey_damage_count{suffix}"].transpose("storey", "damage_state").values
            ):
                own = np.zeros_like(expected)
                for name, rows in groups.items():
                    if name is None or storey < CITY.archetypes[name].building.storeys:
                        own += np.bincount(
                            states_of(drift[rows, storey], status[rows], limits[name]), minlength=own.size
                        )
                np.testing.assert_array_equal(row, own)

    assert_made_of(counts, run, over, labels, check)
    check_labels(counts)
    assert "sample" not in counts.dims


CELLS = np.array(["a", "b", "c", "b", "a", "a", "c"])
OF_DESIGNS = [
    ("crossed", ()),
    ("crossed", ("motion", "stripe")),
    ("crossed", ("stripe", "structure")),
    ("crossed", ("cell", "motion")),
    ("nested", ("stripe", "motion")),
    ("nested", ("structure",)),
    ("cloud", ("motion",)),
    ("one motion", ("motion",)),
    ("one motion", ("cell", "motion")),
    ("sequence", ("event", "motion", "stripe")),
    ("sequence", ("structure", "event")),
    ("city crossed", ("archetype", "motion")),
    ("city crossed", ("building", "stripe")),
    ("city cloud", ("cell", "motion", "archetype")),
    ("city one motion", ("archetype", "motion")),
    ("city at sites", ("archetype", "motion")),
    ("city at sites", ("motion", "building")),
]


def cells_of(design, over):
    """Return labels, if a statistic is over cells."""
    structures = CITY.buildings if design.startswith("city") else STRUCTURES
    return {"cell": np.resize(CELLS, structures)} if "cell" in over else {}


@pytest.mark.parametrize(("design", "over"), OF_DESIGNS, ids=[f"{d} {' '.join(o)}" for d, o in OF_DESIGNS])
def test_damage_counts_are_those_of_the_full_table(design, over, runs, monkeypatch):
    run = runs(design)
    scene, labels = scene_of(design), cells_of(design, over)
    limits = CITY_LIMITS if design.startswith("city") else LIMITS
    statistic = wd.DamageCounts(limits, over=over, labels=labels, each_place=True)
    counts = simulate(scene, statistics=statistic)
    check_counts(counts, run, over, labels, each_place=True)
    small_blocks(monkeypatch, 40)
    for threads in (1, 2):
        again = simulate(scene, statistics=statistic, threads=threads)
        assert statistics_of(again).identical(statistics_of(counts)), threads


def test_the_runs_reach_every_state_and_collapse(runs):
    # Else the comparisons above would compare zeros.
    for design in ("crossed", "nested", "city crossed"):
        assert {0, 1} <= set(np.unique(runs(design)["status"])), design
        status, drift = runs(design)["status"].values, np.fmax.reduce(runs(design)[DRIFT].values, axis=1)
        assert np.bincount(states_of(drift, status, list(LIMITS.values())), minlength=4).min() > 0, design


@pytest.mark.parametrize("design", ["crossed", "city crossed"])
def test_failed_samples_are_counted_by_their_status(design, monkeypatch):
    with_failures(monkeypatch, 0.05)
    city = CITY if design.startswith("city") else None
    scene, over = scene_of(design), ("archetype", "motion") if city else ("motion",)
    run = simulate(scene)
    failed = int((run["status"] == 2).sum())
    assert failed > 0
    statistic = wd.DamageCounts(CITY_LIMITS if city else LIMITS, over=over)
    with pytest.warns(UserWarning, match=rf"{failed} of {run.sizes['sample']} samples .* failed \({failed} diverged\)"):
        counts = simulate(scene, statistics=statistic)
    check_counts(counts, run, over)
    assert counts["failed_samples"].values.tolist() == [failed, 0, 0, 0]
    told, how = wd.summary(counts).splitlines()[:2]
    assert told.endswith(f"failed samples: {failed} diverged")
    steps = run["integration_step"].values
    assert f"{counts.attrs['method']} in float32 on cpu" in how
    assert f"steps {steps.min():.4g} to {steps.max():.4g} s" in how
    if city:
        with pytest.raises(ValueError, match="samples failed; at most 1 % may"):
            wd.damage_shares(counts)


@pytest.mark.parametrize("design", ["crossed", "nested"])
@pytest.mark.parametrize("share", [pytest.param(0.0, marks=pytest.mark.thorough), 0.008])  # with failures shows both
def test_fragility_from_counts_is_that_of_the_run(design, share, monkeypatch):
    if share:
        with_failures(monkeypatch, share)
    stripes = dict(structures_per_motion=80) if design == "nested" else {}
    scene = scene_of(wd.Stripes(MOTIONS, [0.4, 0.8, 1.6, 3.2], wd.PeakGroundAcceleration(), **stripes))
    how = {"structures": None if stripes else 90, "device": "cpu", "seed": 4, "checked_share": 0.1}
    run = wd.simulate(scene, **how)
    assert ((run["status"] >= 2).sum() > 0) == (share > 0)
    over = ("motion", "stripe", "structure_group")
    counts = wd.simulate(scene, statistics=wd.DamageCounts(LIMITS, over=over, each_place=True), **how)
    of_run, of_counts = wd.fragility(run, LIMITS), wd.fragility(counts)
    assert of_run["fragility_median"].notnull().any()
    xr.testing.assert_identical(of_counts, of_run)
    xr.testing.assert_identical(wd.fragility(counts, LIMITS), of_run)
    with pytest.raises(ValueError, match=r"has counts for the limits .* remove limits="):
        wd.fragility(counts, {"slight": 0.004})


def test_fragility_from_counts_of_several_demands():
    scene = scene_of("crossed")
    limits = {
        "slight": {DRIFT: 0.004, "peak_floor_acceleration": 8.0},
        "moderate": {"peak_floor_acceleration": 11.0},
        "complete": {DRIFT: 0.012},
    }
    run = simulate(scene)
    counts = simulate(scene, statistics=wd.DamageCounts(limits, over=("structure_group", "stripe", "motion")))
    xr.testing.assert_identical(wd.fragility(counts), wd.fragility(run, limits))


def test_counts_of_a_signed_demand_are_of_its_magnitude(runs):
    run, name = runs("crossed"), "residual_drift_ratio"
    residual, ok = run[name].values, run["status"].values == 0
    assert (residual[ok] < 0).any()
    worst = np.abs(residual).max(axis=1)
    limits = {"slight": float(np.quantile(worst[ok], 0.3)), "complete": float(np.quantile(worst[ok], 0.8))}
    over = ("motion", "stripe", "structure_group")
    statistic = wd.DamageCounts(limits, demand=name, over=over, each_place=True)
    counts = simulate(scene_of("crossed"), statistics=statistic)
    expected = np.bincount(states_of(worst, run["status"].values, list(limits.values())), minlength=3)
    found = counts["damage_count_by_motion_stripe_structure_group"].sum(["motion", "stripe", "structure_group"])
    assert found.values.tolist() == expected.tolist()
    xr.testing.assert_identical(wd.fragility(counts), wd.fragility(run, limits, demand=name))


def test_a_posterior_from_counts_is_that_of_the_run(runs):
    pytest.importorskip("pyFragility")
    limits, over = {"slight": 0.006}, ("structure_group", "stripe", "motion")
    counts = simulate(scene_of("crossed"), statistics=wd.DamageCounts(limits, over=over))
    # Flat priors do not suffice: the evidence of three records bounds neither the median nor the dispersion.
    priors = {"median": stats.lognorm(0.5, scale=1.5), "dispersion": stats.lognorm(0.3, scale=0.4)}
    how = {"priors": priors, "draws": 200, "seed": 1}
    of_run = wd.fragility_posterior(runs("crossed"), limits, **how)
    xr.testing.assert_identical(wd.fragility_posterior(counts, **how), of_run)


def test_a_run_that_is_stopped_leaves_no_file(tmp_path, monkeypatch):
    from warpdyn.campaigns.reductions.reduction import Reduction

    small_blocks(monkeypatch, 40)
    genuine, added = Reduction.add, []

    def add(self, structures, rows):
        added.append(structures.size)
        if len(added) == 2:
            raise KeyboardInterrupt
        genuine(self, structures, rows)

    monkeypatch.setattr(Reduction, "add", add)
    with pytest.raises(KeyboardInterrupt):
        simulate(scene_of("crossed"), statistics=wd.DamageCounts(LIMITS, over="motion"), path=tmp_path / "counts.nc")
    assert len(added) == 2
    assert not list(tmp_path.iterdir())  # nothing was done: no region had ended


def test_fragility_of_an_archetype_from_the_counts_of_all(runs):
    over = ("archetype", "motion", "stripe", "structure_group")
    counts = simulate(scene_of("crossed", CITY), statistics=wd.DamageCounts(CITY_LIMITS, over=over, each_place=True))
    for name in ("low", "middle"):
        of_run = wd.fragility(wd.select_archetype(runs("city crossed"), name), CITY_LIMITS[name])
        of_counts = wd.fragility(counts.sel(archetype=name))
        for variable in of_run.data_vars:
            xr.testing.assert_equal(of_counts[variable].drop_vars("archetype", errors="ignore"), of_run[variable])


@pytest.mark.parametrize("design", ["crossed", "cloud", "one motion"])
@pytest.mark.parametrize("events", [None, ["b", "a", "b"]])
@pytest.mark.parametrize("share", [pytest.param(0.0, marks=pytest.mark.thorough), 0.006])  # with failures shows both
def test_damage_shares_from_counts_are_those_of_the_run(design, events, share, monkeypatch):
    if share:
        with_failures(monkeypatch, share)
    scene = scene_of(design, city_of(150))
    over = ("archetype", "motion" if events is None else "event", *(("stripe",) if design == "crossed" else ()))
    run, counts = simulate(scene), simulate(scene, statistics=wd.DamageCounts(CITY_LIMITS, over=over, events=events))
    with pytest.MonkeyPatch.context() as patch:
        patch.setattr("warpdyn.answers.fragility.damage_shares.warn_caller", lambda text: None)
        of_run, of_counts = wd.damage_shares(run, CITY_LIMITS, events=events), wd.damage_shares(counts)
    with pytest.raises(ValueError, match="has no status, integration_step: pass the result of simulate"):
        wd.summary(of_counts)  # which tells failed samples, too
    assert (int(of_run["failed_samples"]) > 0) == (share > 0)
    xr.testing.assert_equal(of_counts, of_run)
    if design != "one motion":  # in which not every archetype has a building under every motion
        values, ratios = dict.fromkeys(CITY.archetypes, 1e6), {"slight": 0.05, "complete": 1.0}
        losses = wd.portfolio_losses(of_counts, ratios, values)
        xr.testing.assert_equal(losses, wd.portfolio_losses(of_run, ratios, values))


def test_several_statistics_of_one_run(runs, tmp_path):
    scene = scene_of("crossed", CITY)
    asked = [wd.DamageCounts(CITY_LIMITS, over=over) for over in ("building", ("archetype", "motion"), "structure")]
    counts = simulate(scene, statistics=asked, path=tmp_path / "counts.nc")
    for over in (("building",), ("archetype", "motion")):
        check_counts(
            counts[[f"{what}_count_by_{'_'.join(over)}" for what in ("damage", "failed")]], runs("city crossed"), over
        )
    with xr.open_dataset(tmp_path / "counts.nc") as read:
        assert statistics_of(read).equals(statistics_of(counts))
        assert read.attrs["fingerprint"] == counts.attrs["fingerprint"]
    assert [path.name for path in tmp_path.iterdir()] == ["counts.nc"]
    with pytest.raises(FileExistsError, match="contains another run"):
        simulate(scene, statistics=asked[0], path=tmp_path / "counts.nc")
