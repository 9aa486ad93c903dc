"""Runs of sequences: designs, the dataset, statuses, reruns, error estimates, fragility of the damaged, bad input."""

from dataclasses import replace

import numpy as np
import pytest
import xarray as xr
from report_pages import Page
from test_sequences import AFTER, LATER, MAIN, joined, make_building, make_motion, scaled

import warpdyn as wd
from warpdyn.foundations.core.output_variables import COLLAPSED, OK

pytestmark = pytest.mark.meant_as_given(
    "damping_ratio",
    "first_period",
    "first_period_over_height",
    "storey_height",
    "yield_base_shear_coefficient",
    "yield_drift_ratio",
)

LEVELS, PEAK = [1.0, 2.0], wd.PeakGroundAcceleration()
STRIPED = wd.EventSequence(
    {
        "mainshock": wd.Stripes([MAIN, LATER], LEVELS, PEAK),
        "aftershock": wd.Stripes([AFTER, MAIN], [0.5, 1.5, 3.0], PEAK),
    }
)
DRAWN = {
    "stiffness": wd.RandomFactor(wd.Lognormal(1, 0.2), per="storey"),
    "yield_force": wd.RandomFactor(wd.Lognormal(1, 0.3)),
}


@pytest.fixture(scope="module")
def striped():
    return wd.simulate(wd.Scene(make_building(), STRIPED, DRAWN), structures=3, seed=4, device="cpu")


def test_every_damaged_building_meets_every_aftershock(striped):
    # Structure, then motion and level of the mainshock, then those of the aftershock.
    assert striped.sizes["sample"] == 3 * 4 * 6
    np.testing.assert_array_equal(striped["event"], ["mainshock", "aftershock"])
    np.testing.assert_array_equal(striped["structure"], np.repeat(range(3), 24))
    names = striped["motion_name"].values[striped["motion_index"].values]
    np.testing.assert_array_equal(names[:, 0], np.tile(np.repeat([MAIN.name, LATER.name], 12), 3))
    np.testing.assert_array_equal(names[:, 1], np.tile(np.repeat([AFTER.name, MAIN.name], 3), 12))
    assert striped.sizes["motion"] == 3
    np.testing.assert_array_equal(striped["im_level"][:, 0], np.tile(np.repeat(LEVELS, 6), 6))
    np.testing.assert_array_equal(striped["im_level"][:, 1], np.tile([0.5, 1.5, 3.0], 24))
    assert striped["im_level"].attrs["units"] == "g"
    assert striped["peak_storey_drift_ratio"].dims == ("sample", "event", "storey")
    assert striped["stiffness"].dims == ("sample", "storey")
    assert (striped["status"] == 0).all()
    # One history of it by itself.
    sample = 24 + 2 * 6 + 5
    own = striped.isel(sample=sample)
    building = make_building(stiffness=own["stiffness"].values, yield_force=own["yield_force"].values)
    scales = own["scale_factor_of_motion"].values
    single = {
        "mainshock": wd.OneMotionPerStructure([LATER], scale=scales[0]),
        "aftershock": wd.OneMotionPerStructure([MAIN], scale=scales[1]),
    }
    step = own["integration_step"].values[0]
    alone = wd.simulate(wd.Scene(building, wd.EventSequence(single)), step=step, device="cpu").isel(sample=0)
    for name in ("peak_storey_drift", "residual_drift_ratio", "hysteretic_energy"):
        scale = float(np.abs(own[name]).max())
        np.testing.assert_allclose(own[name], alone[name], rtol=0, atol=1e-4 * scale, err_msg=name)  # float32 inputs


def test_the_mainshock_is_an_ordinary_run(striped):
    scene = wd.Scene(make_building(), STRIPED.events["mainshock"], DRAWN)
    alone = wd.simulate(scene, structures=3, seed=4, device="cpu")
    main = wd.select_event(striped, "mainshock")
    for name in alone.data_vars:
        if "sample" in alone[name].dims:
            one, other = main[name].values, alone[name].values
            assert one.shape == other.shape, name
            np.testing.assert_allclose(one, other, rtol=1e-5, atol=1e-5 * np.abs(other).max(), err_msg=name)
    assert main["im_level"].attrs == alone["im_level"].attrs
    # Of some of the samples, too: those of one mainshock level, of which one structure has but one sample left.
    some = striped.isel(sample=np.flatnonzero((striped["im_level"].values[:, 0] == 2.0) & (striped["sample"] > 46)))
    np.testing.assert_array_equal(wd.select_event(some, "mainshock")["sample"], [47, 54, 66])
    assert wd.select_event(some, "aftershock").sizes["sample"] == some.sizes["sample"]


@pytest.mark.filterwarnings("ignore:.*:UserWarning")  # two records make no intervals
def test_aftershocks_make_no_samples_of_the_mainshock(striped):
    # The fragility of the mainshock, and the width of its intervals, are those of a run of the mainshock alone.
    alone = wd.simulate(
        wd.Scene(make_building(), STRIPED.events["mainshock"], DRAWN), structures=3, seed=4, device="cpu"
    )
    limits = {"slight": float(alone["peak_storey_drift_ratio"].max("storey").median())}
    found = [wd.fragility(run, limits) for run in (alone, wd.select_event(striped, "mainshock"))]
    for name in ("valid_samples", "exceedance_fraction", "exceedance_fraction_lower", "exceedance_fraction_upper"):
        np.testing.assert_array_equal(found[0][name], found[1][name], err_msg=name)
    assert wd.summary(striped).startswith("mainshock\n12 samples: 12 ok")


def test_no_division_changes_a_bit(striped, tmp_path):
    scene = wd.Scene(make_building(), STRIPED, DRAWN)
    settings = {"structures": 3, "seed": 4, "device": "cpu"}
    divided = wd.simulate(scene, memory=67_130_000, threads=3, **settings)
    with wd.simulate(scene, path=tmp_path / "run.nc", **settings) as read:
        for name in striped.variables:
            assert divided[name].values.tobytes() == striped[name].values.tobytes(), name
            assert read[name].values.tolist() == striped[name].values.tolist(), name


def test_drawn_motions_differ_between_events():
    motions = [make_motion(31, seed) for seed in range(20)]
    design = wd.OneMotionPerStructure(motions)
    scene = wd.Scene(
        make_building("elastic"), wd.EventSequence({"a": design, "b": design}), recorders=("drift",), tail=0.0
    )
    record = wd.simulate(scene, structures=60, device="cpu")["motion_index"].values
    assert (record[:, 0] == record[:, 1]).sum() < 15  # 3 are due; as many by chance once in a million runs
    alone = wd.simulate(replace(scene, excitation=design), structures=60, device="cpu")["motion_index"]
    np.testing.assert_array_equal(record[:, 0], alone)


def test_what_has_collapsed_stays_collapsed():
    scene = wd.Scene(make_building(), STRIPED, collapse_drift_ratio=0.012)
    run = wd.simulate(scene, device="cpu")
    main, after = run.sel(event="mainshock"), wd.select_event(run, "aftershock")
    fallen = (main["status"] == COLLAPSED).values
    assert 0 < fallen.sum() < 24
    assert (after["status"][fallen] == COLLAPSED).all()
    for name in ("peak_storey_drift_ratio", "residual_drift_ratio", "peak_base_shear", "input_energy"):
        assert np.isnan(after[name].values[fallen]).all(), name
        stands = (after["status"] != COLLAPSED).values if name == "residual_drift_ratio" else ~fallen
        assert np.isfinite(after[name].values[stands]).all(), name
        known = main[name].values
        assert np.isfinite(known[~fallen] if name == "residual_drift_ratio" else known).all(), name
    unlimited = wd.simulate(replace(scene, collapse_drift_ratio=None), device="cpu")
    same = wd.select_event(unlimited, "aftershock")["peak_storey_drift"].values[~fallen]
    stands = (after["status"] != COLLAPSED).values[~fallen]
    assert 0 < stands.sum() < stands.size
    np.testing.assert_array_equal(after["peak_storey_drift"].values[~fallen][stands], same[stands])


def test_what_has_failed_stays_failed():
    # Of two storeys one is too stiff for the step.
    scatter = {"stiffness": wd.GivenValues([6e5, 6e9])}
    scene = wd.Scene(make_building(), wd.EventSequence({"a": MAIN, "b": AFTER}), scatter)
    with pytest.warns(UserWarning, match="[ab]: the step is beyond the stability limit of 1 of 2 samples"):
        run = wd.simulate(scene, structures=2, step=0.01, on_unstable="flag", device="cpu")
    np.testing.assert_array_equal(run["status"], [[0, 0], [3, 3]])
    assert np.isnan(run["peak_storey_drift"].values[1]).all()
    with pytest.raises(ValueError, match="a: the step is beyond the stability limit of 1 of 2 samples"):
        wd.simulate(scene, structures=2, step=0.01, on_unstable="raise", device="cpu")


def test_reruns_of_an_event_start_from_what_the_event_before_left():
    # Bouc-Wen storeys whose memory settles too fast for the step in the second event alone.
    building = wd.ShearBuilding(
        1e4,
        1e5,
        1.0,
        law="bouc_wen",
        yield_force=300.0,
        hardening_ratio=0.0,
        exponent=2.0,
        damping_ratio=0.05,
        damping="rayleigh",
    )
    gentle, strong = (scaled(make_motion(201, 7), size) for size in (0.05, 2.0))
    scene = wd.Scene(
        building, wd.EventSequence({"gentle": gentle, "strong": strong}), tail=1.0, recorders=("drift", "energy")
    )
    settings = {"dtype": "float64", "device": "cpu"}
    run = wd.simulate(scene, step=0.01, **settings)
    assert (run["status"] == OK).all()
    steps = run["integration_step"].values[0]
    assert steps[1] < steps[0] == 0.01
    whole = replace(scene, excitation=joined(gentle, strong, tail=1.0))
    finest = wd.simulate(whole, step=0.000625, **settings)
    np.testing.assert_allclose(run["peak_storey_drift"][0, 1], finest["peak_storey_drift"][0], rtol=5e-3)


def test_errors_are_estimated_through_all_events():
    settings = {"structures": 30, "device": "cpu", "seed": 2}
    load = wd.EventSequence({"mainshock": MAIN, "aftershock": AFTER})
    scene = wd.Scene(make_building(), load, DRAWN, recorders=("drift",), tail=1.0)
    run = wd.simulate(scene, step=0.01, checked_share=1.0, **settings)
    finer = wd.simulate(scene, step=0.005, dtype="float64", **settings)
    for event in range(2):
        one, other = (each["peak_storey_drift"].values[:, event] for each in (run, finer))
        error = np.abs(one - other).max(axis=1) / np.abs(other).max(axis=1) / (1 - 1 / 4)
        told = run["estimated_relative_error"].isel(event=event).sel(demand="peak_storey_drift")
        np.testing.assert_allclose(told.sel(error_statistic="worst"), error.max(), rtol=1e-6)
        assert told.sel(error_statistic="worst") > 1e-5
    text = wd.summary(run)
    assert text.count("estimated relative error") == 2
    assert text.startswith("mainshock\n30 samples: 30 ok")


@pytest.mark.filterwarnings("ignore:damage state:UserWarning")
def test_fragility_of_the_damaged_building():
    motions = [make_motion(201, seed) for seed in range(6)]
    stripes = wd.Stripes(motions, [0.5, 1.0, 2.0, 4.0], PEAK)
    scene = wd.Scene(
        make_building(), wd.EventSequence({"mainshock": stripes, "aftershock": stripes}), recorders=("drift",)
    )
    run = wd.simulate(scene, device="cpu")
    main, after = run.sel(event="mainshock"), wd.select_event(run, "aftershock")
    worst = main["peak_storey_drift_ratio"].max("storey")
    damaged = (worst > 0.003) & (worst <= 0.01)
    assert 24 < damaged.sum() < 24 * 24
    curves = wd.fragility(after.isel(sample=damaged), {"extensive": 0.01})
    level, drift = after["im_level"].values, after["peak_storey_drift_ratio"].max("storey").values
    counted = [np.mean(drift[damaged.values & (level == value)] > 0.01) for value in stripes.levels]
    np.testing.assert_allclose(curves["exceedance_fraction"][0], counted)
    with pytest.raises(ValueError, match="of a sequence"):
        wd.fragility(run.isel(event=1), {"extensive": 0.01})
    with pytest.raises(ValueError, match="of a sequence"):
        wd.fragility_of_cloud(run.isel(event=0), {"extensive": 0.01})


@pytest.mark.fast
def test_bad_input_is_refused_by_name():
    building = make_building()
    with pytest.raises(TypeError, match="must map each event's name to its design"):
        wd.EventSequence([MAIN, AFTER])
    with pytest.raises(ValueError, match="at least two events, got 1"):
        wd.EventSequence({"mainshock": MAIN})
    with pytest.raises(TypeError, match="name must be text, such as 'mainshock', got 1"):
        wd.EventSequence({1: MAIN, "aftershock": AFTER})
    with pytest.raises(TypeError, match=r"event 'aftershock' must be Stripes, .* got FreeVibration"):
        wd.EventSequence({"mainshock": MAIN, "aftershock": wd.FreeVibration(1.0, velocity=1.0)})
    with pytest.raises(TypeError, match=r"event 'aftershock' must be Stripes, .* got float"):
        wd.EventSequence({"mainshock": MAIN, "aftershock": 0.3})
    events = wd.EventSequence({"mainshock": MAIN, "aftershock": wd.OneMotionPerStructure([AFTER], scale=[1.0, 2.0])})
    scene = wd.Scene(building, events)
    with pytest.raises(
        ValueError, match=r"event 'aftershock': OneMotionPerStructure\.scale has 2 values, but the run has 3 struct"
    ):
        wd.simulate(scene, structures=3)
    with pytest.raises(ValueError, match="histories of an EventSequence are not kept"):
        wd.simulate(scene, structures=2, histories=wd.Histories((0,)))
    with pytest.raises(ValueError, match="pilot of target_error can run only one event"):
        wd.simulate(scene, structures=2, target_error=0.01)
    with pytest.raises(ValueError, match="'exact' is for linear structures"):
        wd.simulate(wd.Scene(make_building("elastic"), events), structures=2, method="exact")
    with pytest.raises(TypeError, match="an EventSequence needs a ShearBuilding"):
        wd.Scene(wd.LinearSystem(np.eye(2), np.eye(2), np.eye(2)), events)
    with pytest.raises(TypeError, match="OneMotionPerStructure or MotionsAtSites, got EventSequence"):
        wd.Scene(wd.Portfolio({"a": wd.Archetype(building)}), events)
    run = xr.Dataset({"status": ("sample", [0])})
    with pytest.raises(ValueError, match="the dataset has no events"):
        wd.select_event(run, "mainshock")


def test_a_report_has_every_event(striped, tmp_path):
    page = Page(wd.report(striped, tmp_path / "page.html"))
    assert [name for name in page.headings if name.startswith("Event")] == ["Event: mainshock", "Event: aftershock"]
    # Three structures under two motions at two levels, each history once; then each of them under six more.
    assert page.numbers("Status of the samples", "samples").tolist() == [12]
    assert page.numbers("Status of the samples (again 1)", "samples").tolist() == [72]
