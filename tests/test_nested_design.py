"""Stripes that give each motion structures of its own, beside those where every structure runs under every motion."""

import numpy as np
import pytest

import warpdyn as wd

BUILDING = wd.ShearBuilding(mass=2e5, stiffness=4e7, height=3.2, damping="modal", damping_ratio=0.05)
TIME = np.arange(0, 2, 0.02)
MOTIONS = [wd.GroundMotion(np.sin(w * TIME) * np.hanning(TIME.size), 0.02, name=f"sine {w}") for w in (9, 14, 21)]
SCATTER = {"stiffness": wd.RandomFactor(wd.Lognormal(1.0, 0.3)), "mass": wd.RandomFactor(wd.Lognormal(1.0, 0.1))}
LEVELS = (0.1, 0.4)


def nested(own: int = 2) -> wd.Stripes:
    return wd.Stripes(MOTIONS, LEVELS, wd.PeakGroundAcceleration(), structures_per_motion=own)


def scene(design: wd.Stripes, **settings) -> wd.Scene:
    return wd.Scene(BUILDING, design, SCATTER, recorders=("drift",), tail=0.0, sampling="sobol", **settings)


@pytest.mark.fast
def test_structures_of_a_motion_follow_one_another():
    design = nested()
    assigned = design.assign(np.arange(6), seed=0)
    np.testing.assert_array_equal(assigned.structure, np.repeat(np.arange(6), 2))
    np.testing.assert_array_equal(assigned.motion, [0, 0, 0, 0, 1, 1, 1, 1, 2, 2, 2, 2])
    np.testing.assert_allclose(assigned.im_level, np.tile(LEVELS, 6))
    peaks = np.array([motion.peak_ground_acceleration for motion in MOTIONS]) / 9.80665
    np.testing.assert_allclose(assigned.scale * peaks[assigned.motion], assigned.im_level, rtol=1e-12)
    assert (design.samples_per_structure, design.structures_given) == (2, 6)
    part = design.assign(np.array([3, 5]), seed=0)
    np.testing.assert_array_equal(part.motion, [1, 1, 2, 2])
    assert "2 structures per motion" in repr(design)


def test_a_nested_run_holds_those_histories_of_the_crossed_one():
    crossed = wd.Stripes(MOTIONS, LEVELS, wd.PeakGroundAcceleration())
    whole = wd.simulate(scene(crossed), structures=6, seed=4, device="cpu")
    run = wd.simulate(scene(nested()), seed=4, device="cpu")  # as many structures as the design has
    assert run.sizes["sample"] == 12
    place = (run["structure"].values * 3 + run["motion_index"].values) * 2 + np.tile([0, 1], 6)
    for name in ("peak_storey_drift_ratio", "im_level", "stiffness"):
        np.testing.assert_array_equal(run[name], whole[name].values[place])
    again = wd.Scene.from_json(run.attrs["scene"], MOTIONS)
    assert again.excitation.structures_per_motion == 2
    assert wd.Scene.from_json(whole.attrs["scene"], MOTIONS).excitation.structures_per_motion is None


def test_stripes_without_a_number_run_as_three_structures_per_motion():
    open_design = wd.Stripes(MOTIONS, LEVELS, wd.PeakGroundAcceleration())
    run = wd.simulate(scene(open_design), seed=4, device="cpu")
    named = wd.simulate(scene(nested(3)), seed=4, device="cpu")
    assert run.sizes["sample"] == 3 * len(MOTIONS) * len(LEVELS)
    for name in ("peak_storey_drift_ratio", "structure", "motion_index", "im_level", "stiffness"):
        np.testing.assert_array_equal(run[name], named[name])
    assert wd.Scene.from_json(run.attrs["scene"], MOTIONS).excitation.structures_per_motion == 3


def test_the_named_crossed_design_gives_the_histories_of_a_call_with_structures():
    crossed = wd.Stripes(MOTIONS, LEVELS, wd.PeakGroundAcceleration(), structures_per_motion="crossed")
    open_design = wd.Stripes(MOTIONS, LEVELS, wd.PeakGroundAcceleration())
    run, same = (wd.simulate(scene(each), structures=4, seed=4, device="cpu") for each in (crossed, open_design))
    assert run.sizes["sample"] == 4 * len(MOTIONS) * len(LEVELS)
    for name in ("peak_storey_drift_ratio", "structure", "motion_index", "im_level", "stiffness"):
        np.testing.assert_array_equal(run[name], same[name])
    assert wd.Scene.from_json(run.attrs["scene"], MOTIONS).excitation.structures_per_motion == "crossed"


@pytest.mark.fast
def test_bad_input_of_a_nested_design():
    with pytest.raises(ValueError, match="structures_per_motion must be"):
        nested(0)
    with pytest.raises(ValueError, match="3 motions with structures_per_motion=2 have 6 structures, got structures=4"):
        wd.simulate(scene(nested()), structures=4, device="cpu")
    portfolio = wd.Portfolio({"frame": wd.Archetype(BUILDING, count=6)})
    with pytest.raises(ValueError, match="structures_per_motion does not apply to a portfolio"):
        wd.Scene(portfolio, nested())


def test_the_summary_names_a_nested_design():
    crossed = wd.simulate(scene(wd.Stripes(MOTIONS, LEVELS, wd.PeakGroundAcceleration())), structures=2, device="cpu")
    assert "nested design" not in str(wd.summary(crossed))
    run = wd.simulate(scene(nested()), seed=4, device="cpu")
    assert "nested design: 6 structures, each under one of 3 motions" in str(wd.summary(run))
    one_level = wd.Stripes(MOTIONS, [0.1], wd.PeakGroundAcceleration(), structures_per_motion=2)
    run = wd.simulate(scene(one_level), seed=4, device="cpu")
    assert "nested design: 6 structures, each under one of 3 motions" in str(wd.summary(run))


def test_capacities_without_a_number_are_of_three_structures_per_motion():
    limits, open_design = {"slight": 0.002}, wd.Stripes(MOTIONS, LEVELS, wd.PeakGroundAcceleration())
    found = wd.capacities(scene(open_design), limits, highest=2.0, seed=4, device="cpu")
    named = wd.capacities(scene(nested(3)), limits, highest=2.0, seed=4, device="cpu")
    assert found["drawn_structure"].values.tolist() == [[0, 3, 6], [1, 4, 7], [2, 5, 8]]
    np.testing.assert_array_equal(found["capacity"], named["capacity"])


def test_a_plan_counts_the_histories_of_the_default_design():
    open_design = wd.Stripes(MOTIONS, LEVELS, wd.PeakGroundAcceleration())
    terms = {"target_error": 0.05, "method": "rk4", "dtype": "float32", "device": "cpu"}
    assert wd.plan(scene(open_design), **terms).carried["samples"] == 3 * len(MOTIONS) * len(LEVELS)
    assert wd.plan(scene(open_design), structures=4, **terms).carried["samples"] == 4 * len(MOTIONS) * len(LEVELS)
