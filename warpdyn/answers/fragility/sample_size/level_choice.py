"""Choice of stripe levels at which fragility curves rise: at other levels no sample exceeds a limit, or all do."""

from __future__ import annotations

import math
from collections.abc import Mapping
from dataclasses import replace

import numpy as np
from scipy.optimize import brentq
from scipy.special import ndtr

from warpdyn.campaigns.incremental.capacities import capacities
from warpdyn.campaigns.reductions.limits import DRIFT
from warpdyn.foundations.core.checks import whole_number
from warpdyn.foundations.core.messages import warn_caller
from warpdyn.model.ground_motions.designs import Cloud, Stripes
from warpdyn.model.scene.arguments import takes_scene
from warpdyn.model.scene.scatter import GivenValues
from warpdyn.model.scene.scene import Scene

PILOT_PAIRS = 40  # smallest number of pairs of a structure and a motion in the pilot run
PILOT_LADDER, PILOT_TOLERANCE = 1.3, 0.1  # ratio of levels, and relative width of brackets, in the pilot run
# Levels are quantiles of a distribution with SPREAD times the dispersions of the capacities. A factor of 1 would be
# best for medians, but dispersions need levels in the tails of the curves (docs/explanation/intervals.md).
SPREAD = 1.6
LEAST_DISPERSION = 0.1  # a smaller dispersion, which is estimated from few pairs, is replaced by this one
MOST_LEVELS = 1000
DIGITS = 3  # number of significant digits of levels, so that tables and figures need not round them


@takes_scene
def levels_for(
    scene: Scene,
    limits: Mapping[str, float],
    count: int = 8,
    *,
    demand: str = DRIFT,
    method: str | None = None,
    seed: int = 0,
    device: str | None = None,
    threads: int | None = None,
) -> np.ndarray:
    """Return levels for multiple stripe analysis, at which the fragility curves of all damage states rise.

    If no sample exceeds any limit at a level, or every sample exceeds all limits, the histories at this level give no
    information. A pilot run therefore finds the capacities (by `capacities`) of one structure for each motion, or of a
    few more if there are few motions, with about twenty histories each. The levels are quantiles, evenly spaced in
    probability, of the capacities of all damage states together. The dispersions are increased by a factor of 1.6,
    because the tails of a curve determine its dispersion. The structures of the pilot run differ from those of the
    later run, so that the two are independent.

    Args:
        scene: The scene; its excitation is a Cloud or Stripes (the levels of Stripes are ignored).
        limits: Limit of each damage state, from the lightest to the heaviest [units of the demand]; only collapse
            exceeds `math.inf`.
        count: Number of levels; two per damage state and at least six in total are enough
            (docs/explanation/intervals.md).
        demand: Name of the demand that is compared with the limits, as in `capacities`.
        method: Integration method of the pilot run, as in `simulate`.
        seed: Seed of the later run; the pilot run uses another seed that is computed from it.
        device: "cpu" or "cuda:0"; None: the first GPU, or the CPU if there is no GPU.
        threads: Number of CPU threads; None: every core that this process may use.

    Returns:
        Levels of the design's intensity measure, increasing, shape [im_level], in the units of `Stripes`: g for an
        acceleration, otherwise SI units.

    Raises:
        ValueError: If fewer than half of the pairs exceed any limit, `count` is below 2, or for the reasons in
            `capacities`.
        TypeError: If `scene` is not a Scene, or its excitation is not a Cloud or Stripes.

    Example:
        >>> cloud = wd.Scene(building, wd.Cloud(motions), scatter)  # measured by the peak ground acceleration
        >>> levels = wd.levels_for(cloud, limits, count=6, seed=1)
        >>> levels.shape
        (6,)
        >>> scene = wd.Scene(building, wd.Stripes(motions, levels, cloud.excitation.measure), scatter)
    """
    count, seed = whole_number("count", count, 2, MOST_LEVELS), whole_number("seed", seed, 0)
    design = scene.excitation
    if not isinstance(design, Cloud | Stripes) or scene.structure.is_many:
        given = "a Portfolio" if scene.structure.is_many else f"a {type(design).__name__}"
        raise TypeError(
            "levels_for() takes a scene of one structure under a Cloud or Stripes of motions, got "
            f"{given}: give Scene(building, Cloud(motions, measure))"
        )
    if isinstance(design, Stripes):
        design.check_scaled_to_all("levels_for")
    # Structures that the user lists (GivenValues) are only for the later run; the pilot run uses median values.
    scatter = {name: spread for name, spread in scene.scatter.items() if not isinstance(spread, GivenValues)}
    structures = math.ceil(PILOT_PAIRS / len(design.motions)) if scatter else 1
    # `capacities` ignores this level, but it must be plausible for any measure.
    low = [1e-3 * float(np.median(design.intensities))]
    stripes = Stripes(design.motions, low, design.measure, structures_per_motion=structures)
    pilot = capacities(
        replace(scene, excitation=stripes, scatter=scatter),
        limits,
        demand=demand,
        tolerance=PILOT_TOLERANCE,
        ladder=PILOT_LADDER,
        highest=math.inf,
        seed=int(np.random.SeedSequence([seed, 2]).generate_state(1)[0]),
        method=method,
        device=device,
        threads=threads,
    )
    centre, dispersion = _moments(pilot["capacity"].transpose(..., "damage_state").values, list(limits), design)
    levels = np.exp(_quantiles(centre, SPREAD * dispersion, count))
    rounded = np.array([float(f"{level:.{DIGITS}g}") for level in levels])
    return rounded if np.all(np.diff(rounded) > 0) else levels


def _moments(capacity: np.ndarray, states: list[str], design: Cloud | Stripes) -> tuple[np.ndarray, np.ndarray]:
    """Return the median and standard deviation of ln(capacity), for states that at least half of the pairs reach.

    Args:
        capacity: Capacities [units of the intensity measure], shape [..., damage_state].
        states: Names of the damage states.
        design: The design, for the units in messages.
    """
    logarithm = np.log(capacity.reshape(-1, len(states)))
    logarithm = logarithm[~np.isnan(logarithm).any(axis=1)]
    median = np.median(logarithm, axis=0)
    known = np.isfinite(median)
    if not known.any():
        raise ValueError(
            "levels_for: fewer than half of the pairs of structure and motion exceed a limit of "
            f"{', '.join(map(repr, states))}, even at the highest level: check that the limits are in the unit of the "
            "demand"
        )
    for state in np.flatnonzero(~known):
        warn_caller(
            f"levels_for: fewer than half of the pairs exceed the limit of damage state {states[state]!r}, so the "
            f"levels [{design.intensity_units}] are for the other states only: check its limit, or remove it"
        )
    finite = np.where(np.isfinite(logarithm), logarithm, np.nan)[:, known]
    return median[known], np.maximum(np.nanstd(finite, axis=0), LEAST_DISPERSION)


def _quantiles(centre: np.ndarray, spread: np.ndarray, count: int) -> np.ndarray:
    """Return `count` quantiles, evenly spaced in probability, of a mixture of normal distributions of equal weight.

    `centre` and `spread` are the means and standard deviations of the distributions.
    """
    low, high = (centre - 9 * spread).min(), (centre + 9 * spread).max()

    def share_below(level: float, asked: float) -> float:
        return float(ndtr((level - centre) / spread).mean() - asked)

    return np.array([brentq(share_below, low, high, args=((i + 0.5) / count,)) for i in range(count)])
