"""Limits, levels and names as a newcomer mistakes them: each error or warning says what was likely meant."""

import warnings

import numpy as np
import pytest
from plotted_runs import striped_run

import warpdyn as wd

pytestmark = pytest.mark.fast

MOTION = wd.GroundMotion(np.sin(np.arange(100) * 0.3), 0.02, name="wave")
PGV = wd.PeakGroundVelocity()


def scene(structure=None, excitation=None):
    building = wd.ShearBuilding(mass=1e5, stiffness=1e8, height=[3.0, 3.0], damping="rayleigh", damping_ratio=0.05)
    return wd.Scene(structure or building, excitation or wd.Cloud([MOTION]), recorders=("drift",))


CALLS = {
    "fragility": lambda limits: wd.fragility(striped_run(), limits),
    "fragility_of_cloud": lambda limits: wd.fragility_of_cloud(striped_run(), limits),
    "capacities": lambda limits: wd.capacities(scene(), limits),
    "levels_for": lambda limits: wd.levels_for(scene(), limits),
}


@pytest.mark.parametrize("name", CALLS)
def test_states_named_by_numbers_and_limits_that_are_no_numbers(name):
    with pytest.raises(TypeError, match=r"name of a damage state must be text, as in \{'1': ...\}, got 1, .* type int"):
        CALLS[name]({1: 0.005})
    with pytest.raises(ValueError, match=r"(?s)'slight'.*'0.5%'.*\(0.5 % is 0.005\)"):
        CALLS[name]({"slight": "0.5%"})
    with pytest.raises(ValueError, match=r"'slight'.*None"):
        CALLS[name]({"slight": None})


@pytest.mark.parametrize("name", ["capacities", "levels_for"])
def test_limits_of_two_demands_in_a_search(name):
    limits = {"slight": {"peak_storey_drift_ratio": 0.005, "peak_floor_acceleration": 3.0}}
    with pytest.raises(ValueError, match=r"'slight' is .*capacities\(\) and levels_for\(\) need limits of one demand"):
        CALLS[name](limits)


def test_limits_of_drifts_in_millimetres_are_told():
    run = striped_run()
    run["peak_storey_drift"] = 3.0 * run["peak_storey_drift_ratio"]
    run["peak_storey_drift"].attrs["units"] = "m"
    with pytest.warns(
        UserWarning, match=r"limit of a storey drift of 'slight' is 15 m .* given in mm, it would be 0.015 m"
    ):
        wd.fragility(run, {"slight": 15.0}, demand="peak_storey_drift")
    with pytest.warns(UserWarning, match=r"drift limit of 'slight' is 0.5 .*percent, it would be 0.005"):
        wd.fragility(run, {"slight": 0.5}, demand="residual_drift_ratio")
    with warnings.catch_warnings():
        warnings.filterwarnings("error", message="implausible input")
        wd.fragility(run, {"slight": 0.015}, demand="peak_storey_drift")


@pytest.mark.parametrize(
    ("given", "meant"), [("drift", "peak_storey_drift_ratio"), ("residual", "residual_drift_ratio")]
)
def test_a_recorder_in_place_of_its_variable(given, meant):
    with pytest.raises(ValueError, match=rf"no '{given}' \(did you mean '{meant}'\?\)"):
        wd.fragility(striped_run(), {"slight": 0.01}, demand=given)


def test_levels_for_says_what_it_was_given():
    one = scene().structure
    with pytest.raises(TypeError, match=r"under a Cloud or Stripes of motions, got a Portfolio"):
        wd.levels_for(scene(wd.Portfolio({"low": wd.Archetype(one, 2)})), {"slight": 0.005})
    with pytest.raises(TypeError, match=r"got a OneMotionPerStructure"):
        wd.levels_for(scene(excitation=wd.OneMotionPerStructure([MOTION])), {"slight": 0.005})


def test_stripes_without_levels_name_them():
    for call, words in (
        (lambda: wd.Stripes([MOTION], measure=PGV), "missing a required argument: 'levels'"),
        (lambda: wd.Stripes([MOTION], levels_in_g=[0.1], measure=PGV), "'levels_in_g' is called 'levels'"),
        (lambda: wd.Stripes([MOTION], [0.1], PGV, structures=3), "unexpected keyword argument 'structures'"),
    ):
        with pytest.raises(
            TypeError, match=r"^Stripes\(motions, levels, measure\): .*levels_for\(scene, limits\)"
        ) as caught:
            call()
        assert words in str(caught.value)
