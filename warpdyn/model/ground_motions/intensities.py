"""Levels of an intensity, and intensities of the motions of a design, which are single motions or pairs of motions."""

from __future__ import annotations

from collections.abc import Sequence
from typing import Any

import numpy as np
from numpy.typing import ArrayLike

from warpdyn.foundations.core.checks import real_numbers, shortened
from warpdyn.foundations.core.messages import amount_of
from warpdyn.model.ground_motions.measures.measure import IntensityMeasure
from warpdyn.model.ground_motions.measures.pairs import GeometricMean, PairMeasure
from warpdyn.model.ground_motions.motions import GroundMotion
from warpdyn.model.ground_motions.pairs_of_motions import PairOfMotions, components_of


def checked_levels(levels: ArrayLike, units: str) -> np.ndarray:
    """Return levels of an intensity as an array, shape [im_level].

    Raises:
        ValueError: If levels are not a row of finite, increasing values above 0.
    """
    found = np.atleast_1d(real_numbers("levels", levels, units))
    if found.ndim != 1 or found.size == 0 or not np.all(np.isfinite(found)) or found[0] <= 0:
        raise ValueError(f"levels must be a row of finite values above 0 {units}, got {shortened(levels)}")
    if np.any(np.diff(found) <= 0):
        raise ValueError(
            f"levels must increase, got {shortened(found.tolist())}: sort levels=, and give each level once"
        )
    return found


def intensities_of(motions: Sequence[Any], measure: IntensityMeasure) -> np.ndarray:
    """Return the intensity of every motion, in g for accelerations; raise a TypeError if `measure` is not a measure."""
    if not isinstance(measure, IntensityMeasure):
        raise TypeError(f"measure must be an IntensityMeasure, such as SpectralAcceleration(period), got {measure!r}")
    both = [(motion.x, motion.y) for motion in motions if isinstance(motion, PairOfMotions)]
    if not both:
        return measure.level_values(motions)
    assert isinstance(measure, PairMeasure)  # from `measure_for`
    return measure.pair_values(both) / measure.unit_size(measure.level_units)


def measure_for(motions: Sequence[GroundMotion | PairOfMotions], measure: IntensityMeasure) -> IntensityMeasure:
    """Return the measure of a design: for pairs, the geometric mean of a measure of one component.

    Raises:
        ValueError: If motions have different numbers of components.
    """
    counts = [len(components_of(motion)) for motion in motions]
    if len(set(counts)) > 1:
        other = int(np.argmax(np.array(counts) != counts[0]))
        raise ValueError(
            f"motion 0 ({motions[0].name!r}) has {amount_of(counts[0], 'component')}, but motion {other} "
            f"({motions[other].name!r}) has {counts[other]}: give all motions the same number"
        )
    is_single = isinstance(measure, IntensityMeasure) and not isinstance(measure, PairMeasure)
    return GeometricMean(measure) if counts[0] > 1 and is_single else measure
