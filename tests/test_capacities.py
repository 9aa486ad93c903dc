"""Capacities of structures under motions: beside OpenSees, scipy, `simulate` and a fine ladder; and bad input."""

from __future__ import annotations

import math
import warnings
from dataclasses import replace

import numpy as np
import pytest
from opensees import chain_drifts
from scipy.constants import g as STANDARD_GRAVITY
from scipy.signal import StateSpace, lsim

import warpdyn as wd
from warpdyn.model.ground_motions.records import far_field

MASS, STIFFNESS, HEIGHT = np.array([2e5, 1.5e5]), np.array([9e7, 6e7]), 3.2
YIELD_DRIFT_RATIO, HARDENING, DAMPING_RATIO = 0.005, 0.03, 0.05
BUILDING = wd.ShearBuilding(
    MASS,
    STIFFNESS,
    HEIGHT,
    law="bilinear",
    yield_force=STIFFNESS * HEIGHT * YIELD_DRIFT_RATIO,
    hardening_ratio=HARDENING,
    damping="stiffness_proportional",
    damping_ratio=DAMPING_RATIO,
)
LIMITS = {"slight": 0.003, "moderate": 0.008, "extensive": 0.02, "collapse": math.inf}
SCATTER = {
    "stiffness": wd.RandomFactor(wd.Lognormal(median=1.0, dispersion=0.2)),
    "yield_force": wd.RandomFactor(wd.Lognormal(median=1.0, dispersion=0.2)),
}
RECORDS = (0, 9, 21)
COLLAPSE = 0.05


def motions(count: int = 3) -> list[wd.GroundMotion]:
    """Return some far-field records, the strongest eight seconds of each."""
    found = []
    for index in RECORDS[:count]:
        record = far_field()[index]
        peak = int(np.abs(record.acceleration).argmax())
        first = max(0, peak - int(3 / record.step))
        part = record.acceleration[first : first + int(8 / record.step)]
        found.append(wd.GroundMotion(part, record.step, record.name))
    return found


def scene(**rest) -> wd.Scene:
    given = {"excitation": wd.Cloud(motions()), "scatter": SCATTER, "sampling": "monte_carlo"} | rest
    given = {"collapse_drift_ratio": COLLAPSE} | given
    return wd.Scene(BUILDING, **given)


def searched(given: wd.Scene, limits=None, **rest):
    """Return the capacities, and the messages of warnings."""
    with warnings.catch_warnings(record=True) as said:
        warnings.simplefilter("always")
        found = wd.capacities(given, LIMITS if limits is None else limits, device="cpu", **rest)
    return found, [str(each.message) for each in said]


@pytest.fixture(scope="module")
def found():
    return searched(scene(), structures=4, seed=3, keep_curves=True)[0]


def opensees_drift(run, structure: int, motion: wd.GroundMotion, level: float) -> float:
    """Return the largest storey drift ratio of a drawn structure under a motion scaled to a PGA [g], by OpenSees."""
    stiffness, yield_force = (run[name].values[structure].astype(float) for name in ("stiffness", "yield_force"))
    elastic = np.array([[stiffness.sum(), -stiffness[1]], [-stiffness[1], stiffness[1]]])
    frequency = np.sqrt(np.linalg.eigvals(elastic / MASS[:, None]).real.min())
    acceleration = motion.acceleration * level * STANDARD_GRAVITY / motion.peak_ground_acceleration
    drifts = chain_drifts(
        MASS,
        [("Steel01", (f, k, HARDENING)) for f, k in zip(yield_force, stiffness, strict=True)],
        (0.0, 2 * DAMPING_RATIO / frequency * stiffness),
        [0.0, 0.0],
        acceleration,
        motion.step,
        acceleration.size + int(2 / motion.step),
        5,
    )
    return float(np.abs(drifts).max() / HEIGHT)


def test_brackets_hold_the_passage_by_opensees(found):
    drawn = wd.simulate(scene(recorders=("drift",)), structures=4, seed=3, device="cpu").isel(sample=slice(0, None, 3))
    limits = [limit for limit in LIMITS.values() if limit < COLLAPSE]
    for structure, motion in ((0, 0), (1, 2), (3, 1)):
        of_pair = found.isel(structure=structure, motion=motion)
        for state, limit in enumerate(limits):
            lower, upper = (float(of_pair[f"capacity_{end}"][state]) for end in ("lower", "upper"))
            record = motions()[motion]
            # OpenSees steps a tenth of ours or less by another method; beyond yield a level may do .5 % to a drift.
            assert opensees_drift(drawn, structure, record, lower) <= limit * 1.005
            assert opensees_drift(drawn, structure, record, upper) >= limit * 0.995


def test_an_elastic_capacity_is_that_of_the_transfer_function():
    elastic = wd.ShearBuilding(1e5, 4e6, 3.0, law="elastic", damping="stiffness_proportional", damping_ratio=0.05)
    [motion] = motions(1)
    found, _ = searched(wd.Scene(elastic, motion), {"slight": 0.004}, highest=20.0, dtype="float64", tolerance=1e-4)
    frequency = np.sqrt(4e6 / 1e5)
    system = StateSpace([[0, 1], [-(frequency**2), -0.1 * frequency]], [[0], [-1]], [[1, 0]], [[0]])
    time = motion.step / 20 * np.arange(20 * (motion.acceleration.size - 1) + 1)  # lsim is exact between samples
    fine = np.interp(time, motion.step * np.arange(motion.acceleration.size), motion.acceleration)
    peak = np.abs(lsim(system, fine, time)[1]).max() / 3.0
    pga = motion.peak_ground_acceleration / STANDARD_GRAVITY
    assert found.attrs["histories"] == 1, "one elastic run says all"
    # Peaks are those of steps, ours of a hundredth of the period and less: 1 - cos(pi / 100) = 5e-4 below at most.
    assert found["capacity"].item() == pytest.approx(0.004 / peak * pga, rel=6e-4)


def test_simulate_passes_a_limit_above_its_capacity_alone(found):
    levels = [0.2, 0.5, 1.0, 1.6]
    stripes = wd.Stripes(motions(), levels, wd.PeakGroundAcceleration())
    run = wd.simulate(scene(excitation=stripes, recorders=("drift",)), structures=4, seed=3, device="cpu")
    assert not found["resurrections"].values.any(), "or a level above the capacity might be within the limit"
    seen = 0
    for state, limit in enumerate(LIMITS.values()):
        passes = (run["status"] == 1) | (run["peak_storey_drift_ratio"].max("storey") > limit)
        pair = {"structure": run["structure"], "motion": run["motion_index"]}
        lower, upper = (found[f"capacity_{end}"].isel(damage_state=state).isel(pair) for end in ("lower", "upper"))
        level = run["im_level"]
        assert passes.values[(level >= upper).values].all()
        assert not passes.values[(level <= lower).values].any()
        seen += int(((level >= upper) | (level <= lower)).sum())
    assert seen > 0.9 * 4 * run.sizes["sample"]


def test_brackets_are_as_narrow_as_asked_for_and_states_follow_one_another(found):
    assert (found["capacity_status"] == 0).all()
    ratio = found["capacity_upper"] / found["capacity_lower"]
    assert ratio.max() <= 1.02
    assert ratio.min() > 1
    assert (found["capacity"] ** 2).values == pytest.approx((found["capacity_lower"] * found["capacity_upper"]).values)
    assert (found["capacity"].diff("damage_state") >= 0).all()
    assert found.attrs["histories"] / (4 * 3) < 60


def test_scaling_the_elastic_response_changes_no_result():
    once, _ = searched(scene(), structures=4, seed=3)
    again, _ = searched(scene(), structures=4, seed=3, reuse_elastic=False)
    assert again.attrs["histories"] > 1.2 * once.attrs["histories"]
    # Demands differ by the rounding of float32, some 1e-6, and levels by as much; where a level's demand is that close
    # to a limit, one bracket may be another of its width: none of these is.
    assert once["capacity"].values == pytest.approx(again["capacity"].values, rel=1e-5)


def test_peaks_from_a_later_time_on_do_not_scale_an_elastic_response():
    # They do not show that a storey yields before, so that each level is run.
    late = scene(record_from=6.0, tail=2.0)
    once, _ = searched(late, structures=2, seed=3)
    again, _ = searched(late, structures=2, seed=3, reuse_elastic=False)
    assert once.attrs["histories"] == again.attrs["histories"]
    np.testing.assert_array_equal(once["capacity"], again["capacity"])


def test_a_nested_design_gives_each_motion_structures_of_its_own(found):
    levels = [0.01, found.attrs["highest"]]
    stripes = wd.Stripes(motions(), levels, wd.PeakGroundAcceleration(), structures_per_motion=2)
    nested, _ = searched(scene(excitation=stripes), seed=3)
    assert nested["drawn_structure"].values.tolist() == [[0, 2, 4], [1, 3, 5]]
    # The first four structures are those of the crossed design.
    for number, motion in ((0, 0), (1, 0), (0, 1), (1, 1)):
        drawn = nested["drawn_structure"].values[number, motion]
        assert np.array_equal(nested["capacity"][number, motion], found["capacity"][drawn, motion])
    curves = wd.fragility_from_capacities(nested)
    assert "groups" not in curves.attrs["interval_method"], "records tell all"


def test_more_structures_leave_those_before_them_as_they_are(found):
    fewer, _ = searched(scene(), structures=2, seed=3)
    assert np.array_equal(fewer["capacity"], found["capacity"][:2])


def test_curves_are_all_levels_that_were_run(found):
    assert found.sizes["sample"] == found.attrs["histories"]
    pair = found["structure_index"].values * 3 + found["motion_index"].values
    assert (np.diff(pair) >= 0).all()
    assert (np.diff(found["im_level"].values)[np.diff(pair) == 0] > 0).all(), "levels of a pair increase"
    collapsed = found["status"].values == 1
    assert np.isnan(found["peak_storey_drift_ratio"].values[collapsed]).all()
    assert collapsed.any()
    upper = found["capacity_upper"].isel(damage_state=1).values.ravel()[pair]
    within = found["im_level"].values < upper * (1 - 1e-12)
    assert (found["peak_storey_drift_ratio"].values[within] <= LIMITS["moderate"]).all()


def test_a_cloud_without_a_highest_level_is_searched_as_far_as_it_takes(found):
    lower, _ = searched(scene(), structures=4, seed=3, highest=0.6)
    censored = lower["capacity_status"].values == 1
    assert censored.any()
    assert not censored.all()
    assert (lower["capacity_lower"].values[censored] == 0.6).all()
    assert np.isinf(lower["capacity"].values[censored]).all()
    assert (found["capacity"].values[censored] > 0.6 / 1.02).all()


@pytest.mark.thorough
@pytest.mark.meant_as_given("intensity_level", "lowest_intensity_level")
def test_a_fine_ladder_passes_each_limit_first_within_the_bracket(found):
    levels = np.geomspace(0.02, 1.05 * found["capacity"].max().item(), 200)
    stripes = wd.Stripes(motions(), levels, wd.PeakGroundAcceleration())
    run = wd.simulate(scene(excitation=stripes, recorders=("drift",)), structures=4, seed=3, device="cpu")
    worst = np.where(run["status"] == 1, np.inf, run["peak_storey_drift_ratio"].max("storey")).reshape(4, 3, 200)
    for state, limit in enumerate(LIMITS.values()):
        passes = np.isinf(worst) if np.isinf(limit) else worst > limit
        assert passes.any(axis=2).all()
        first = passes.argmax(axis=2)
        of_state = found.isel(damage_state=state)
        assert (of_state["capacity_upper"].values >= levels[first - 1]).all()
        assert (of_state["capacity_lower"].values <= levels[first]).all()


@pytest.mark.thorough
@pytest.mark.meant_as_given("strongest_motion")
@pytest.mark.parametrize(
    ("demand", "limits"),
    [
        ("peak_floor_acceleration", {"a": 1.0, "b": 4.0}),
        ("input_energy", {"a": 1e3, "b": 1e5}),
        ("residual_drift_ratio", {"a": 1e-3, "b": 4e-3}),
        ("hysteretic_energy", {"a": 1e3, "b": 5e4}),
    ],
)
def test_other_demands(demand, limits):
    """The run at a level just within a bracket and just beyond it says the same."""
    found, _ = searched(scene(), limits, structures=2, demand=demand, dtype="float64")
    for end, sign in (("lower", 1), ("upper", -1)):
        for state, limit in enumerate(limits.values()):
            level = found[f"capacity_{end}"].isel(damage_state=state).values
            scales = level / found_intensities()[None, :]
            structure, motion = np.indices(scales.shape).reshape(2, -1)
            drawn = wd.simulate(scene(recorders=("drift",)), structures=2, device="cpu", dtype="float64")
            given = {
                name: wd.GivenValues(drawn[name].values[:: len(RECORDS)][structure])
                for name in ("stiffness", "yield_force")
            }
            design = wd.OneMotionPerStructure(motions(), motion, scales.ravel())
            run = wd.simulate(
                scene(excitation=design, scatter=given), structures=scales.size, device="cpu", dtype="float64"
            )
            worst = np.abs(run[demand].values).reshape(scales.size, -1).max(axis=1)
            worst[run["status"].values == 1] = np.inf
            assert (sign * worst <= sign * limit * (1 + sign * 1e-6)).all()


def found_intensities() -> np.ndarray:
    """Return the peak ground accelerations of the motions [g]."""
    return np.array([motion.peak_ground_acceleration for motion in motions()]) / STANDARD_GRAVITY


@pytest.mark.meant_as_given(
    "first_period", "first_period_over_height", "yield_base_shear_coefficient", "yield_drift_ratio", "integration_step"
)
def test_failed_pairs_are_refused_where_they_are_many():
    # At .01 s its second mode, of 3000 rad/s and more, is far beyond rk4's limit of 2.8 / .01 s.
    stiff = wd.ShearBuilding(
        MASS,
        1e5 * STIFFNESS,
        HEIGHT,
        law="bilinear",
        yield_force=1e9,
        hardening_ratio=HARDENING,
        damping="storey",
        damping_coefficient=1e6,
    )
    given = wd.Scene(stiff, wd.Cloud([motions()[1]]), collapse_drift_ratio=COLLAPSE)
    step = motions()[1].step
    with pytest.raises(ValueError, match=r"1 of 1 pairs .* structure 0 under motion 0: unstable_step; at most 1 % may"):
        wd.capacities(given, LIMITS, device="cpu", step=step, on_unstable="flag")


@pytest.mark.fast
@pytest.mark.parametrize(
    ("change", "message"),
    [
        ({"limits": {}}, "limits must map"),
        ({"limits": {"a": 0.02, "b": 0.01}}, "limits must increase"),
        ({"limits": {"a": math.nan}}, "must be one number above 0"),
        ({"limits": {"a": "1 %"}}, r"must be one number above 0 .* \(0.5 % is 0.005\)"),
        ({"tolerance": 0.0}, "tolerance must be"),
        ({"tolerance": 1.5}, "tolerance must be"),
        ({"ladder": 1.0}, "ladder must be a finite number above 1"),
        ({"demand": "peak_drift"}, "unknown demand of a ShearBuilding 'peak_drift'"),
        ({"highest": 0.0}, "highest must be a finite number above"),
        ({"structures": 0}, "structures must be a whole number"),
        ({"method": "newmark"}, "unknown method"),
    ],
)
def test_bad_arguments(change, message):
    limits = change.pop("limits", LIMITS)
    with pytest.raises(ValueError, match=message):
        wd.capacities(scene(), limits, device="cpu", **change)


@pytest.mark.fast
def test_scenes_that_have_no_capacities():
    with pytest.raises(TypeError, match="a Scene"):
        wd.capacities(BUILDING, LIMITS)
    with pytest.raises(TypeError, match="Cloud or of Stripes, got OneMotionPerStructure"):
        wd.capacities(scene(excitation=wd.OneMotionPerStructure(motions())), LIMITS)
    with pytest.raises(ValueError, match="is not proportional to the scale factor of a motion"):
        wd.capacities(scene(excitation=wd.Cloud(motions(), wd.SignificantDuration())), LIMITS)
    with pytest.raises(ValueError, match="the scene has no collapse criterion"):
        wd.capacities(replace(scene(), collapse_drift_ratio=None), LIMITS, device="cpu")


def test_curves_of_capacities_have_their_moments(found):
    curves = wd.fragility_from_capacities(found)
    logarithm = np.log(found["capacity"].values.reshape(12, -1))
    # A bracket is 2 % wide: where in it a capacity lies changes a mean of 12 by less than 1 %, and a scatter by less.
    np.testing.assert_allclose(curves["fragility_median"], np.exp(logarithm.mean(axis=0)), rtol=0.01)
    np.testing.assert_allclose(curves["fragility_dispersion"], logarithm.std(axis=0), rtol=0.02)
    assert curves.attrs["intensity_measure"] == found.attrs["intensity_measure"]
    assert (curves["fragility_median_lower"] < curves["fragility_median"]).all()


@pytest.mark.fast
def test_limits_in_percent_are_warned_of():
    with pytest.warns(UserWarning, match="percent|%"), pytest.raises(ValueError, match="highest"):
        wd.capacities(scene(), {"slight": 0.5, "moderate": 2.0}, highest=0.0, device="cpu")
