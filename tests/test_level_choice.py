"""Levels where fragility curves rise: beside capacities by scipy, and beside curves of a full grid."""

from __future__ import annotations

import math
from dataclasses import replace

import numpy as np
import pytest
from scipy.signal import StateSpace, lsim
from scipy.stats import norm
from test_target_precision import scene as yielding_scene

import warpdyn as wd
from warpdyn.answers.fragility.sample_size.level_choice import _moments

STIFFNESS, MASS, HEIGHT, DAMPING_RATIO = 4e6, 1e5, 3.0, 0.05
OSCILLATOR = wd.ShearBuilding(
    MASS, STIFFNESS, HEIGHT, law="elastic", damping="stiffness_proportional", damping_ratio=DAMPING_RATIO
)
LIMITS = {"slight": 0.004, "complete": 0.02}
STEP = 0.02
TIME = STEP * np.arange(300)
NOISE = np.random.default_rng(4).normal(size=(30, TIME.size)) * np.sin(np.pi * TIME / TIME[-1]) ** 2
MOTIONS = [wd.GroundMotion(np.convolve(row, np.ones(5) / 5, "same"), STEP, f"noise {i}") for i, row in enumerate(NOISE)]


def peak_drift_ratio(motion: wd.GroundMotion) -> float:
    """Return the oscillator's largest drift ratio, by scipy, exact between samples."""
    frequency = np.sqrt(STIFFNESS / MASS)
    matrix = [[0, 1], [-(frequency**2), -2 * DAMPING_RATIO * frequency]]
    fine = STEP / 20 * np.arange(20 * (TIME.size + 99))
    acceleration = np.interp(fine, TIME, motion.acceleration, right=0.0)
    return float(np.abs(lsim(StateSpace(matrix, [[0], [-1]], [[1, 0]], [[0]]), acceleration, fine)[1]).max() / HEIGHT)


@pytest.mark.parametrize(
    ("measure", "intensity"),
    [
        (wd.PeakGroundAcceleration(), lambda motion: np.abs(motion.acceleration).max() / 9.80665),
        (
            wd.PeakGroundVelocity(),
            lambda motion: np.abs(np.cumsum(motion.acceleration[1:] + motion.acceleration[:-1])).max() * STEP / 2,
        ),
    ],
)
def test_levels_are_quantiles_of_the_capacities(measure, intensity):
    """Of an oscillator a capacity is the limit over the drift at unit intensity."""
    levels = wd.levels_for(wd.Scene(OSCILLATOR, wd.Cloud(MOTIONS, measure)), LIMITS, count=6, device="cpu")
    assert levels.size == 6
    each = np.array([intensity(motion) / peak_drift_ratio(motion) for motion in MOTIONS])
    logarithm = np.log(each[:, None] * list(LIMITS.values()))
    centre, spread = np.median(logarithm, axis=0), 1.6 * logarithm.std(axis=0)
    share = norm.cdf((np.log(levels)[:, None] - centre) / spread).mean(axis=1)
    # Brackets of 10 % leave each capacity an error of .05, of a spread of .49, at a density of .4; those of 30 motions
    # average to a fifth, .008 of a share. Velocities are greater between samples by some parts in a thousand.
    np.testing.assert_allclose(share, (np.arange(6) + 0.5) / 6, atol=0.015)


def curves(given: wd.Scene, levels, limits) -> tuple:
    """Return curves of 16 structures on these levels, and half the intervals of the logarithms of medians."""
    design = given.excitation
    stripes = wd.Stripes(design.motions, levels, design.measure)
    found = wd.fragility(wd.simulate(replace(given, excitation=stripes), structures=16, device="cpu"), limits)
    bounds = found["fragility_median_upper"].values / found["fragility_median_lower"].values
    return found, np.log(bounds) / 2


def test_few_levels_tell_what_a_full_grid_does():
    given = yielding_scene(24)
    limits = {"slight": 0.005, "extensive": 0.02}
    grid = np.geomspace(0.05, 4.0, 17)
    full, half_of_grid = curves(given, grid, limits)
    few, half = curves(given, wd.levels_for(given, limits, count=6, device="cpu"), limits)
    assert np.all(half <= 1.1 * half_of_grid)
    shift = np.abs(np.log(few["fragility_median"].values / full["fragility_median"].values))
    assert np.all(shift <= 0.5 * half_of_grid)
    # As many levels over the range of the grid are worse.
    _, half_of_spread = curves(given, np.geomspace(0.05, 4.0, 6), limits)
    assert np.all(half < half_of_spread)


def test_given_structures_have_their_nominal_values_in_the_pilot():
    given = yielding_scene(24)
    values = np.random.default_rng(2).lognormal(np.log(2e5), 0.1, size=(5, 1))
    with_masses = replace(given, scatter=given.scatter | {"mass": wd.GivenValues(values)})
    limits = {"slight": 0.005, "extensive": 0.02}
    np.testing.assert_array_equal(
        wd.levels_for(with_masses, limits, device="cpu"), wd.levels_for(given, limits, device="cpu")
    )


def test_collapse_has_levels_of_its_own():
    given = replace(yielding_scene(24), collapse_drift_ratio=0.05)
    slight = wd.levels_for(given, {"slight": 0.005}, count=4, device="cpu")
    both = wd.levels_for(given, {"slight": 0.005, "collapse": math.inf}, count=8, device="cpu")
    assert both[-1] > 1.5 * slight[-1]
    found = curves(given, both, {"slight": 0.005, "complete": 0.0499})[0]
    # The upper half of the levels lies about the median of collapse.
    assert both[4] < found["fragility_median"].values[1] < both[-1]


@pytest.mark.fast
def test_limits_that_few_pairs_pass_are_told():
    design = wd.Cloud(MOTIONS)
    capacity = np.exp(np.random.default_rng(1).normal(size=(400, 2)) * [0.2, 0.3] + [0.0, 1.0])
    capacity[:250, 1] = np.inf
    with pytest.warns(UserWarning, match=r"fewer than half of the pairs exceed the limit of damage state 'b'.* \[g\]"):
        centre, dispersion = _moments(capacity, ["a", "b"], design)
    assert centre == pytest.approx([0.0], abs=0.05)  # 400 draws: 0.2 / sqrt(400), with room
    assert dispersion == pytest.approx([0.2], rel=0.15)
    with pytest.raises(
        ValueError, match="fewer than half of the pairs of structure and motion exceed a limit of 'a', 'b'"
    ):
        _moments(np.full((9, 2), np.inf), ["a", "b"], design)


@pytest.mark.fast
def test_bad_input():
    given = wd.Scene(OSCILLATOR, wd.Cloud(MOTIONS))
    with pytest.raises(ValueError, match="count must be a whole number of at least 2, got 1"):
        wd.levels_for(given, LIMITS, count=1)
    with pytest.raises(TypeError, match=r"levels_for\(\) takes a scene of one structure under a Cloud or Stripes"):
        wd.levels_for(wd.Scene(OSCILLATOR, wd.FreeVibration(1.0, velocity=0.1)), LIMITS)
    with pytest.raises(TypeError, match="levels_for"):
        wd.levels_for(OSCILLATOR, LIMITS)
    with pytest.raises(ValueError, match="does not grow"):
        wd.levels_for(wd.Scene(OSCILLATOR, wd.Cloud(MOTIONS, wd.SignificantDuration())), LIMITS)
