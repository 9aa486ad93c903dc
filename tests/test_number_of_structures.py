"""Scatter without structures=, and structures without scatter: both warn and name what to type."""

from __future__ import annotations

import warnings

import numpy as np
import pytest
from test_simulate import MOTIONS, SEEDED, make_building

import warpdyn as wd
from warpdyn.model.scene.number_of_structures import number_of_structures, with_default_design

pytestmark = pytest.mark.fast
PGA = wd.PeakGroundAcceleration()
STRIPES = wd.Stripes(MOTIONS, [0.1, 0.2], PGA)
CLOUD = wd.Cloud(MOTIONS)
GIVEN = {"mass": wd.GivenValues(np.ones((3, 2)) * 1e5)}


def scene(design=STRIPES, scatter=SEEDED):
    return wd.Scene(make_building(), design, scatter, recorders=("drift",))


@pytest.mark.parametrize("design", [STRIPES, CLOUD, wd.OneMotionPerStructure(MOTIONS, motion=None)])
@pytest.mark.parametrize("function", ["simulate", "capacities"])
def test_scatter_without_structures_warns(design, function):
    expected = rf"{function}: structures= is missing and .* scattered, .*Give {function}\(\.\.\., structures=16"
    with pytest.warns(UserWarning, match=expected):
        assert number_of_structures(function, scene(design), None) == 1


def test_a_motion_drawn_for_each_structure_warns_too():
    design = wd.OneMotionPerStructure(MOTIONS, motion=None)
    with pytest.warns(UserWarning, match=f"each structure has a motion drawn from {len(MOTIONS)}"):
        number_of_structures("simulate", scene(design, {}), None)


@pytest.mark.parametrize(
    ("design", "scatter", "structures", "number"),
    [
        (STRIPES, SEEDED, 1, 1),  # one is asked for
        (STRIPES, SEEDED, 8, 8),
        (STRIPES, {}, None, 1),
        (CLOUD, {}, 1, 1),
        (wd.Stripes(MOTIONS, [0.1], PGA, structures_per_motion=3), SEEDED, None, 3 * len(MOTIONS)),
        (wd.OneMotionPerStructure(MOTIONS, motion=[0, 1]), SEEDED, None, 2),
    ],
)
def test_numbers_that_are_meant_give_no_warning(design, scatter, structures, number):
    with warnings.catch_warnings():
        warnings.simplefilter("error")
        assert number_of_structures("simulate", scene(design, scatter), structures) == number


def test_structures_without_scatter_warn():
    with pytest.warns(UserWarning, match="nothing is scattered, so that all 4 structures are the same"):
        assert number_of_structures("simulate", scene(STRIPES, {}), 4) == 4


@pytest.mark.parametrize("function", [wd.simulate, lambda given: wd.capacities(given, {"slight": 0.01})])
def test_the_public_functions_warn(function):
    def stop(*_, **__):
        raise RuntimeError("stopped before anything is run")

    with pytest.MonkeyPatch.context() as patch:
        patch.setattr("warpdyn.campaigns.running.simulate.warn_of_implausible", stop)
        patch.setattr("warpdyn.campaigns.incremental.capacities.build_run", stop)
        with pytest.warns(UserWarning, match="structures= is missing"), pytest.raises(RuntimeError, match="stopped"):
            function(scene(CLOUD))


@pytest.mark.parametrize(
    ("design", "scatter", "structures"),
    [
        (STRIPES, SEEDED, 4),  # the call gives a number
        (STRIPES, {}, None),  # nothing is random
        (STRIPES, GIVEN, None),  # the scene lists structures
        (CLOUD, SEEDED, None),
        (wd.Stripes(MOTIONS, [0.1, 0.2], PGA, structures_per_motion="crossed"), SEEDED, None),
        (wd.Stripes(MOTIONS, [0.1, 0.2], PGA, structures_per_motion=2), SEEDED, None),
        (wd.Stripes(MOTIONS[:1], [0.1, 0.2], PGA), SEEDED, None),  # each motion's own structures would be all
        (wd.Stripes([MOTIONS[:1], MOTIONS[1:2]], [0.1, 0.2], PGA), SEEDED, None),  # motions of each level
    ],
)
def test_scenes_that_keep_their_design(design, scatter, structures):
    given = scene(design, scatter)
    assert with_default_design(given, structures) is given


def test_random_stripes_without_a_number_have_three_structures_per_motion():
    given = scene()
    changed = with_default_design(given, None)
    assert changed.excitation.structures_per_motion == 3
    assert number_of_structures("simulate", changed, None) == 3 * len(MOTIONS)
    assert given.excitation.structures_per_motion is None  # the user's scene is not changed


def test_the_crossed_design_needs_a_number():
    crossed = wd.Stripes(MOTIONS, [0.1, 0.2], PGA, structures_per_motion="crossed")
    with pytest.warns(UserWarning, match="simulate: structures= is missing"):
        assert number_of_structures("simulate", scene(crossed), None) == 1
    with pytest.raises(ValueError, match="structures_per_motion"):
        wd.Stripes(MOTIONS, [0.1, 0.2], PGA, structures_per_motion="nested")
