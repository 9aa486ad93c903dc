"""Stripes with records selected for each level: which samples are run, what is counted, and what refuses them."""

from __future__ import annotations

import numpy as np
import pytest
from test_simulate import MOTIONS, SEEDED, make_building

import warpdyn as wd

pytestmark = pytest.mark.meant_as_given("drift_limit", "intensity_level", "lowest_intensity_level", "scale_factor")
PGA = wd.PeakGroundAcceleration()
LEVELS = [0.4, 0.8, 1.6]
SETS = [MOTIONS[:2], MOTIONS[1:], MOTIONS[2:]]
LIMITS = {"slight": 0.004, "complete": 0.009}
SELECTED = wd.Stripes(SETS, LEVELS, PGA)


def run_of(design, **settings):
    scene = wd.Scene(make_building(), design, SEEDED, recorders=("drift",))
    return wd.simulate(scene, structures=4, device="cpu", **settings)


def rows(run):
    """Return the drifts of each sample by structure, name of the motion and level."""
    names = run["motion_name"].values[run["motion_index"].values]
    keys = zip(run["structure"].values.tolist(), names.tolist(), run["im_level"].values.tolist(), strict=True)
    return dict(zip(keys, run["peak_storey_drift_ratio"].values.tolist(), strict=True))


@pytest.mark.fast
def test_a_motion_of_several_levels_is_one():
    assert [motion.name for motion in SELECTED.motions] == [motion.name for motion in MOTIONS]
    assert SELECTED.motions_of_levels == ((0, 1), (1, 2), (2,))
    assert SELECTED.samples_per_structure == 5
    again = wd.Stripes(MOTIONS, LEVELS, PGA, motions_of_levels=[[0, 1], [1, 2], [2]])
    one, other = (design.assign(np.arange(2), 0) for design in (SELECTED, again))
    for name in ("structure", "motion", "scale", "im_level"):
        np.testing.assert_array_equal(getattr(one, name), getattr(other, name))
    assert "each with its own motions" in repr(SELECTED)


@pytest.mark.fast
@pytest.mark.parametrize(
    ("arguments", "message"),
    [
        ((SETS[:2], LEVELS, PGA), "motions for 2 levels, but levels has 3:"),
        (([[], *SETS[1:]], LEVELS, PGA), "level 0.4 are .*at least one index"),
        (([MOTIONS[:1] * 2, *SETS[1:]], LEVELS, PGA), "without repetition"),
        ((MOTIONS, LEVELS, PGA, None, [[0], [1], [7]]), "each from 0 to 2"),
        ((SETS, LEVELS, PGA, 2), "structures_per_motion cannot be combined with a list of motions for each level"),
    ],
)
def test_bad_sets_are_refused(arguments, message):
    with pytest.raises(ValueError, match=message):
        wd.Stripes(*arguments)


@pytest.mark.fast
@pytest.mark.parametrize("function", [wd.capacities, wd.levels_for, wd.fragility_to])
def test_what_scales_every_motion_to_many_levels_refuses_them(function):
    with pytest.raises(ValueError, match=rf"{function.__name__}\(\) scales every motion to many levels"):
        function(wd.Scene(make_building(), SELECTED, SEEDED), LIMITS)


def test_samples_are_those_of_the_crossed_design():
    selected, crossed = rows(run_of(SELECTED)), rows(run_of(wd.Stripes(MOTIONS, LEVELS, PGA)))
    assert len(selected) == 4 * 5
    for key, drifts in selected.items():
        assert crossed[key] == drifts


def test_curves_of_samples_and_of_counts_agree_with_joined_runs_of_each_level():
    run = run_of(SELECTED)
    counted = run_of(SELECTED, statistics=wd.DamageCounts(LIMITS, over=("motion", "stripe", "structure_group")))
    parts = [run_of(wd.Stripes(motions, [level], PGA)) for motions, level in zip(SETS, LEVELS, strict=True)]
    joined = wd.join(parts)
    curves = wd.fragility(run, LIMITS)
    assert curves["valid_samples"].values.tolist() == [8, 8, 4]
    for other in (wd.fragility(counted), wd.fragility(joined, LIMITS)):
        shared = [name for name in curves.data_vars if name in other]  # counts are of the worst storey alone
        assert "fragility_median_upper" in shared
        for name in shared:
            np.testing.assert_allclose(other[name], curves[name], rtol=1e-9)  # sums in another order
    scene = wd.Scene.from_json(run.attrs["scene"], MOTIONS)
    assert scene.excitation.motions_of_levels == SELECTED.motions_of_levels


def test_the_run_can_be_drawn_and_reported(tmp_path):
    run = run_of(SELECTED)
    result = run.merge(wd.fragility(run, LIMITS), combine_attrs="no_conflicts")
    for draw in (wd.plots.fragility_curves, wd.plots.drift_against_intensity, wd.plots.ida_curves):
        draw(result)
    assert wd.report(result, tmp_path / "report.html").exists()
