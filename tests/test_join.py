"""Runs joined: numbers anew by what they are of, no sample twice, and the fragility of one run of the same size."""

from __future__ import annotations

import json

import numpy as np
import pytest
import xarray as xr
from test_fragility import make_run
from test_simulate import MOTIONS, SEEDED, make_building

import warpdyn as wd

pytestmark = pytest.mark.meant_as_given("drift_limit", "intensity_level", "lowest_intensity_level", "scale_factor")
PGA = wd.PeakGroundAcceleration()
LEVELS = [0.4, 0.8, 1.6]
LIMITS = {"slight": 0.004, "complete": 0.009}
CONCAT = {"data_vars": "minimal", "coords": "minimal", "compat": "override"}
KEYS = ["structure", "motion_index", "im_level"]


def run_of(motions=MOTIONS, levels=LEVELS, seed=0, structures=4, building=None, scatter=SEEDED, **settings):
    scene = wd.Scene(building or make_building(), wd.Stripes(motions, levels, PGA), scatter, recorders=("drift",))
    return wd.simulate(scene, structures=structures, seed=seed, device="cpu", **settings)


def synthetic(records: list[int], structures: list[int], seed: int, levels=(0.3, 0.6, 0.9, 1.2, 1.6), study=0):
    """Return a run that was made by hand, with the attributes of a simulated one, of one large table of samples."""
    generator = np.random.default_rng(study)
    of_record, of_structure = 0.3 * generator.standard_normal(100), 0.25 * generator.standard_normal(64)
    record, structure, level = (
        each.ravel() for each in np.meshgrid(records, structures, levels, indexing="ij", sparse=False)
    )
    own = np.array(
        [np.random.default_rng([study, *each]).standard_normal() for each in zip(record, structure, strict=True)]
    )
    drift = 0.02 * level * np.exp(of_record[record] + of_structure[structure] + 0.2 * own)
    run = make_run(drift, np.searchsorted(records, record), level)
    motions = [{"name": f"motion {number}", "digest": str(number)} for number in records]
    scene = {"structure": {"type": "A"}, "excitation": {"type": "Stripes", "motions": motions}, "scatter": {"mass": 1}}
    attributes = {"scene": json.dumps(scene), "seed": seed, "title": "frame"}
    number = np.searchsorted(structures, structure)
    run["motion_name"] = "motion", np.array([each["name"] for each in motions])
    said = {"sampling": "monte_carlo"}
    named = {"structure": ("sample", number, said), "sample": np.arange(number.size), "motion": np.arange(len(records))}
    return run.assign_coords(named).assign_attrs(attributes)


def intervals(curves: xr.Dataset) -> np.ndarray:
    names = [f"fragility_{what}{end}" for what in ("median", "dispersion") for end in ("", "_lower", "_upper")]
    return np.array([curves[name].values for name in names])


LIGHT = {"light": 0.018}
ALL, HALF = list(range(20)), list(range(8))


@pytest.mark.fast
@pytest.mark.parametrize("study", range(5))
def test_joined_seeds_have_the_curves_and_intervals_of_one_run_of_the_same_size(study):
    whole = synthetic(ALL, list(range(16)), seed=0, study=study)
    parts = [synthetic(ALL, HALF, 1, study=study), synthetic(ALL, [8 + i for i in HALF], 2, study=study)]
    joined = wd.join(parts)
    assert joined["structure"].values.max() == 15
    # The same samples in another order: sums in another order, and 95 % intervals within 5 % with much room.
    np.testing.assert_allclose(intervals(wd.fragility(joined, LIGHT)), intervals(wd.fragility(whole, LIGHT)), rtol=1e-9)
    # xr.concat counts structures 0 to 7 of both as the same ones; every estimator says so.
    with pytest.raises(ValueError, match=r"sample number 0 is in the dataset twice.*wd.join"):
        wd.fragility(xr.concat(parts, "sample", **CONCAT), LIGHT)


@pytest.mark.fast
def test_five_runs_of_one_level_with_other_records_have_a_hundred_records():
    levels = [0.3, 0.6, 0.9, 1.2, 1.6]
    parts = [synthetic(list(range(20 * i, 20 * i + 20)), HALF, 7, levels=[x]) for i, x in enumerate(levels)]
    joined = wd.join(parts)
    assert joined.sizes["motion"] == 100
    assert joined["motion_name"].values.tolist() == [f"motion {number}" for number in range(100)]
    assert joined["structure"].values.max() == 7  # the same structures, by seed and number
    curves = wd.fragility(joined, LIGHT)
    assert curves.attrs["interval_method"].startswith("jackknife over 100 records in 5 sets")


@pytest.mark.fast
@pytest.mark.parametrize("estimator", [wd.fragility, wd.fragility_of_cloud, wd.fragility_posterior])
def test_every_estimator_refuses_repeated_samples_and_clashing_numbers(estimator):
    one, other = synthetic(ALL, HALF, 1), synthetic(ALL, [8 + i for i in HALF], 2)
    together = xr.concat([one, other], "sample", **CONCAT)
    with pytest.raises(ValueError, match=r"in the dataset twice.*wd\.join"):
        estimator(together, LIGHT)
    renumbered = together.assign_coords(sample=np.arange(together.sizes["sample"]))
    with pytest.raises(ValueError, match=r"samples occur twice, the first of them structure 0.*wd\.join"):
        estimator(renumbered, LIGHT)
    with pytest.raises(ValueError, match=r"samples occur twice"):
        estimator(renumbered.drop_vars("sample"), LIGHT)
    along = xr.concat([one, other], "sample", **CONCAT | {"data_vars": "all"}).drop_vars("sample")
    with pytest.raises(ValueError, match=r"'motion_name' lies along sample|occur twice"):
        estimator(along, LIGHT)


@pytest.mark.fast
def test_a_selection_by_where_is_told_how_to_select():
    run = synthetic(ALL, HALF, 1)
    chosen = run["im_level"] > 0.5
    with pytest.raises(ValueError, match=r"selected by where\(\), select them by run.isel\(sample=condition.values\)"):
        wd.fragility(run.where(chosen, drop=True), LIGHT)
    assert wd.fragility(run.isel(sample=chosen.values), LIGHT).sizes["stripe"] == 4


@pytest.mark.fast
def test_a_run_joined_with_itself_is_refused():
    run = synthetic(ALL, HALF, 1)
    with pytest.raises(ValueError, match=r"800 of the 800 samples of run 1 are in run 0 too: sample 0 is its sample 0"):
        wd.join([run, run])
    both = wd.join([run, synthetic(ALL, HALF, 2)])
    with pytest.raises(ValueError, match="samples of run 1 are in run 0 too"):
        wd.join([both, run])
    assert wd.join([both, synthetic(ALL, HALF, 3)])["structure"].values.max() == 23
    part = run.isel(sample=run["structure"].values < 4)
    for runs, message in (([part, run], "Run 1 contains all samples of run 0"), ([run, part], "Run 0 contains all")):
        with pytest.raises(ValueError, match=message):
            wd.join(runs)


@pytest.mark.fast
def test_paths_and_runs_outside_a_list_are_refused_with_what_to_type():
    with pytest.raises(TypeError, match=r"open the file first: xarray\.open_dataset\('a\.nc'\)"):
        wd.join(["a.nc", "b.nc"])
    run = synthetic(ALL, HALF, 1)
    with pytest.raises(
        TypeError, match=r"takes 1 argument without a name \(runs\), got 2: .* join\(\[first, second\]\)"
    ):
        wd.join(run, run)


@pytest.mark.fast
@pytest.mark.parametrize(
    ("change", "message"),
    [
        (lambda run: run.drop_attrs(deep=False), "has no attribute 'scene'"),
        (lambda run: run.isel(sample=[]), "has no samples"),
        (lambda run: run.drop_vars("peak_storey_drift_ratio"), "run 1 has no 'peak_storey_drift_ratio', which run 0"),
        (lambda run: xr.Dataset({"failed_samples": 0}), "statistics, which keep no samples"),
        (
            lambda run: run.assign_coords(im_level=run["im_level"].assign_attrs(intensity_measure="PGV")),
            "intensity measure of run 1 is 'PGV'",
        ),
        (lambda run: run.assign_coords(im_level=run["im_level"].assign_attrs(units="m s-1")), "has units 'm s-1'"),
        (
            lambda run: run.assign_coords(archetype_index=("sample", np.zeros(run.sizes["sample"], dtype=int))),
            "run 1 is one archetype of a portfolio",
        ),
    ],
)
def test_what_cannot_be_joined_is_refused(change, message):
    first, second = synthetic(ALL, HALF, 1), synthetic(ALL, HALF, 2)
    with pytest.raises(ValueError, match=message):
        wd.join([first, change(second)])


@pytest.mark.fast
@pytest.mark.parametrize("given", [None, 3, "runs", xr.Dataset(), [1, 2]])
def test_arguments_of_another_kind_are_refused(given):
    with pytest.raises(TypeError, match="join"):
        wd.join(given)


@pytest.mark.parametrize("by", ["motions", "levels"])
def test_parts_of_one_run_joined_are_that_run(by):
    whole = run_of()
    if by == "motions":
        parts = [run_of(MOTIONS[:1]), run_of(MOTIONS[1:])]
    else:
        parts = [run_of(levels=LEVELS[:1]), run_of(levels=LEVELS[1:])]
    joined = wd.join(parts)
    one, other = (each.sortby(KEYS) for each in (whole, joined))
    for name in (*KEYS, "peak_storey_drift_ratio", "status", "yield_force"):
        np.testing.assert_array_equal(one[name], other[name])
    assert one["motion_name"].values.tolist() == other["motion_name"].values.tolist()


def test_peaks_from_different_times_on_are_not_joined():
    runs = [
        wd.simulate(
            wd.Scene(make_building(), wd.Cloud(MOTIONS), SEEDED, recorders=("drift",), record_from=start),
            structures=2,
            seed=seed,
            device="cpu",
        )
        for seed, start in enumerate((0.0, 0.25, 0.25))
    ]
    with pytest.raises(ValueError, match=r"of run 1 is of the states from record_from = 0\.25 s on"):
        wd.join(runs[:2])
    assert wd.join(runs[1:]).sizes["sample"] == 2 * runs[1].sizes["sample"]


def test_runs_from_files_are_joined_without_reading_their_demands(tmp_path):
    in_memory = wd.join([run_of(seed=1), run_of(seed=2)])
    wd.write(run_of(seed=1), tmp_path / "one.nc")
    run_of(seed=2, path=tmp_path / "two.zarr").close()
    with xr.open_dataset(tmp_path / "one.nc") as one, xr.open_zarr(tmp_path / "two.zarr") as two:
        joined = wd.join([one, two])
        np.testing.assert_array_equal(joined["peak_storey_drift_ratio"], in_memory["peak_storey_drift_ratio"])
        np.testing.assert_array_equal(joined["structure_identity"], in_memory["structure_identity"])
        wd.write(joined, tmp_path / "joined.nc")
    with xr.open_dataset(tmp_path / "joined.nc") as again, pytest.raises(ValueError, match="are in run 0 too"):
        wd.join([again, run_of(seed=2)])


def test_other_buildings_are_archetypes_of_a_portfolio():
    taller = wd.ShearBuilding(
        [2e3, 1e3, 1e3], [6e5, 4e5, 4e5], 3.0, law="bilinear", yield_force=[4e3, 2e3, 2e3], hardening_ratio=0.05,
        damping="storey", damping_coefficient=2e3,
    )  # fmt: skip
    low, high = run_of(), run_of(building=taller, scatter={"stiffness": wd.RandomFactor(wd.Lognormal(1, 0.1))})
    city = wd.join({"low": low, "high": high})
    assert city["archetype"].values.tolist() == ["low", "high"]
    assert city["storeys_of_archetype"].values.tolist() == [2, 3]
    assert city["buildings_of_archetype"].values.tolist() == [4, 4]
    for name, run in (("low", low), ("high", high)):
        alone = wd.select_archetype(city, name)
        np.testing.assert_array_equal(alone["peak_storey_drift_ratio"], run["peak_storey_drift_ratio"])
        expected = wd.fragility(run, LIMITS)["exceedance_fraction"]
        np.testing.assert_array_equal(wd.fragility(alone, LIMITS)["exceedance_fraction"], expected)
    with pytest.raises(ValueError, match="several archetypes"):
        wd.fragility(city, LIMITS)
    shares = wd.damage_shares(city, {"low": LIMITS, "high": LIMITS})
    assert int(shares["counted_buildings"].sum()) == city.sizes["sample"]
    more = wd.join([city, run_of(seed=5)])
    assert more["buildings_of_archetype"].values.tolist() == [8, 4]
    assert "scene" not in city.attrs


@pytest.mark.parametrize("order", [1, -1])
def test_isolators_of_one_building_are_no_storey_of_the_other(order):
    isolators = {"stiffness": 1.0e5, "yield_force": 1.0e3, "post_yield_stiffness": 1.0e4}
    isolated = make_building().on_isolators("lead_rubber_bearing", 2e3, 0.3, **isolators)
    own = {"fixed": make_building(), "isolated": isolated}
    runs = {name: run_of(building=building) for name, building in list(own.items())[::order]}
    city = wd.join(runs)
    for name, run in runs.items():
        alone = wd.select_archetype(city, name)
        expected = wd.fragility(run, LIMITS)["exceedance_fraction"]
        np.testing.assert_array_equal(wd.fragility(alone, LIMITS)["exceedance_fraction"], expected)
    # Exceedances counted by hand: of all storeys of the fixed building, of those above the isolators of the other.
    above = {"fixed": slice(0, 2), "isolated": slice(1, 3)}
    worst = {name: runs[name]["peak_storey_drift_ratio"].isel(storey=above[name]).max("storey") for name in runs}
    shares = wd.damage_shares(city, dict.fromkeys(runs, LIMITS))["damage_share"].mean("motion")
    for level in LEVELS:
        exceeding = [float((each[runs[name]["im_level"] == level] > 0.004).mean()) for name, each in worst.items()]
        # As many samples of each; means of some tens of shares of 1/8.
        np.testing.assert_allclose(1 - shares.sel(stripe=level, damage_state="none"), np.mean(exceeding), rtol=1e-12)


def test_capacities_are_joined_along_structures_or_motions():
    def found(motions, seed, structures=2):
        scene = wd.Scene(make_building(), wd.Cloud(motions), SEEDED)
        return wd.capacities(scene, {"slight": 0.004}, structures=structures, seed=seed, highest=8.0, device="cpu")

    one, two = found(MOTIONS, 1), found(MOTIONS, 2)
    joined = wd.join([one, two])
    assert joined.sizes["structure"] == 4
    assert np.unique(joined["drawn_structure"]).tolist() == [0, 1, 2, 3]
    with pytest.raises(ValueError, match=r"are repeated.*wd\.join"):
        wd.fragility_from_capacities(xr.concat([one, two], "structure", **CONCAT))
    with pytest.raises(ValueError, match="dataset 1 and dataset 0 have 6 pairs of a structure and a motion in common"):
        wd.join([one, one])
    by_motion = wd.join([found(MOTIONS[:1], 1), found(MOTIONS[1:], 1)])
    np.testing.assert_array_equal(by_motion["motion_name"], one["motion_name"])
    with pytest.raises(ValueError, match="neither the same motions nor the same structures"):
        wd.join([found(MOTIONS[:1], 1), found(MOTIONS[1:], 2)])


def test_runs_of_one_sequence_with_other_seeds_are_joined():
    events = wd.EventSequence({"first": wd.Stripes(MOTIONS, LEVELS, PGA), "second": wd.Cloud(MOTIONS[:1])})
    scene = wd.Scene(make_building(), events, SEEDED, recorders=("drift",))
    parts = [wd.simulate(scene, structures=2, seed=seed, device="cpu") for seed in (1, 2)]
    joined = wd.join(parts)
    first = wd.select_event(joined, "first")
    expected = wd.join([wd.select_event(part, "first") for part in parts])
    np.testing.assert_array_equal(first["peak_storey_drift_ratio"], expected["peak_storey_drift_ratio"])
    with pytest.raises(ValueError, match="are in run 0 too"):
        wd.join([parts[0], parts[0]])
