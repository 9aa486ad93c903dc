"""Intensity measures of pairs of horizontal components; both components of a pair get the same value."""

from __future__ import annotations

from abc import abstractmethod
from collections.abc import Sequence
from dataclasses import dataclass

import numpy as np

from warpdyn.foundations.core.checks import real_number
from warpdyn.foundations.core.near_misses import with_suggestions
from warpdyn.foundations.core.output_variables import MEASURE
from warpdyn.model.ground_motions.measures.measure import ACCELERATION, IntensityMeasure
from warpdyn.model.ground_motions.measures.one_component import SpectralAcceleration
from warpdyn.model.ground_motions.motions import GroundMotion
from warpdyn.model.ground_motions.records.components.orientations import orientation
from warpdyn.model.ground_motions.records.components.pairing import instrument_of, pairs

ANGLES = np.arange(180)  # degrees; rotating a motion by 180 degrees changes only its sign


class PairMeasure(IntensityMeasure):
    """Base class of intensity measures of pairs. Two motions with the same name of the record are a pair."""

    def value(self, motion: GroundMotion) -> float:
        """Raise a ValueError, because a single motion is not sufficient: the measure needs both components."""
        raise ValueError(f"{self.name} needs both components of motion {motion.name!r}: call values([first, second])")

    def values(self, motions: Sequence[GroundMotion]) -> np.ndarray:
        """Return, for each motion, the measure of the pair to which it belongs [units], shape [motion]."""
        both = pairs(motions)
        values = self.pair_values(both)
        of_instrument = {instrument_of(each): value for pair, value in zip(both, values, strict=True) for each in pair}
        for motion in motions:
            if instrument_of(motion) not in of_instrument:
                raise ValueError(
                    f"{self.name} needs horizontal components, but motion {motion.name!r} of record {motion.record!r} "
                    "is vertical: remove the motion, or use records.read(path, components='horizontal')"
                )
        return np.array([of_instrument[instrument_of(motion)] for motion in motions])

    def pair_values(self, both: Sequence[tuple[GroundMotion, GroundMotion]]) -> np.ndarray:
        """Return the value of the measure for each pair of motions [units], shape [pair]."""
        raise NotImplementedError


class CombinedComponents(PairMeasure):
    """Base class of measures that combine the values of one measure for both components, in the recorded directions.

    A subclass defines `components` and `combined`.
    """

    measure: IntensityMeasure

    def __post_init__(self) -> None:
        if not isinstance(self.measure, IntensityMeasure) or isinstance(self.measure, PairMeasure):
            raise TypeError(
                f"measure must be an intensity measure of one component, such as wd.PeakGroundVelocity(), got "
                f"{self.measure!r}"
            )
        object.__setattr__(self, "units", self.measure.units)
        object.__setattr__(self, "power", self.measure.power)

    @property
    def name(self) -> str:
        """Name of the intensity measure in results and figures, such as "geometric mean of PGA"."""
        return f"{self.components} of {self.measure.name}"

    @property
    def kind(self) -> str:
        """OpenQuake's name of the measure of one component, such as "PGA"."""
        return self.measure.kind

    @property
    def parameters(self) -> tuple[float, ...]:
        """Damping ratio [%] and periods [s] of the measure of one component."""
        return self.measure.parameters

    def attributes(self) -> dict[str, object]:
        """Return the attributes that describe this measure in a dataset: its name, and period and damping ratio."""
        return self.measure.attributes() | {MEASURE: self.name}

    def pair_values(self, both: Sequence[tuple[GroundMotion, GroundMotion]]) -> np.ndarray:
        """Return the combination of the measures of the components of each pair [units], shape [pair]."""
        values = self.measure.values([motion for pair in both for motion in pair])
        return self.combined(values[::2], values[1::2])

    @abstractmethod
    def combined(self, first: np.ndarray, second: np.ndarray) -> np.ndarray:
        """Return the combination of the measures of both components, all of shape [pair]."""


@with_suggestions
@dataclass(frozen=True)
class GeometricMean(CombinedComponents):
    """The geometric mean of a measure over both horizontal components in the recorded directions.

    Args:
        measure: The measure of one component.

    Raises:
        ValueError: From `values`, if motions are not pairs (see `records.pairs`).
        TypeError: If `measure` is not an intensity measure of one component.

    Example:
        >>> both = dict(step=0.02, record="quake")
        >>> components = [wd.GroundMotion(noise[i], **both, component="NE"[i]) for i in (0, 1)]
        >>> measure = wd.GeometricMean(wd.PeakGroundAcceleration())
        >>> measure.values(components).round(2)
        array([7.86, 7.86])
    """

    measure: IntensityMeasure
    components = "geometric mean"

    def combined(self, first: np.ndarray, second: np.ndarray) -> np.ndarray:
        """Return the geometric means of the measures of both components, shape [pair]."""
        return np.sqrt(first * second)


@with_suggestions
@dataclass(frozen=True)
class LargerComponent(CombinedComponents):
    """The larger value of a measure among both horizontal components in the recorded directions.

    Args:
        measure: The measure of one component.

    Raises:
        ValueError: From `values`, if motions are not pairs (see `records.pairs`).
        TypeError: If `measure` is not an intensity measure of one component.

    Example:
        >>> both = dict(step=0.02, record="quake")
        >>> components = [wd.GroundMotion(noise[i], **both, component="NE"[i]) for i in (0, 1)]
        >>> larger = wd.LargerComponent(wd.PeakGroundAcceleration())
        >>> float(larger.values(components)[0]) == max(each.peak_ground_acceleration for each in components)
        True
        >>> larger.name
        'larger component of PGA'
    """

    measure: IntensityMeasure
    components = "larger component"

    def combined(self, first: np.ndarray, second: np.ndarray) -> np.ndarray:
        """Return the larger ones of the measures of both components, shape [pair]."""
        return np.maximum(first, second)


@with_suggestions
@dataclass(frozen=True)
class RotatedSpectralAcceleration(PairMeasure):
    """A percentile, over all horizontal directions, of the pseudo-spectral acceleration (RotD50, RotD100) [m/s2].

    The motion is computed in the directions 0, 1, ..., 179 degrees from the first component; zeros are added to the
    shorter component. If the azimuths of the components are known and not 90 degrees apart, the second component is
    first replaced by the component perpendicular to the first one.

    Source: Boore (2010), "Orientation-independent, nongeometric-mean measures of seismic intensity from two horizontal
    components of motion".

    Args:
        period: Undamped natural period [s].
        damping_ratio: Viscous damping as a fraction of critical [1], from 0 up to but not including 1.
        percentile: Percentile over the directions [%]: 50 for RotD50, 100 for RotD100, 0 for RotD00.

    Raises:
        ValueError: If the period is not positive, the damping ratio is outside [0, 1), or the percentile is outside 0
            to 100; from `values`, if motions are not pairs (see `records.pairs`), or the components of a pair have
            different steps.

    Example:
        >>> both = dict(step=0.02, record="quake")
        >>> components = [wd.GroundMotion(noise[i], **both, component="NE"[i]) for i in (0, 1)]
        >>> measure = wd.RotatedSpectralAcceleration(0.5, percentile=100)
        >>> measure.values(components).round(1)
        array([5.6, 5.6])
    """

    period: float
    damping_ratio: float = 0.05
    percentile: float = 50.0
    units = ACCELERATION
    kind = "SA"

    def __post_init__(self) -> None:
        _ = self._of_one  # raises an error if the period or the damping ratio is invalid
        if real_number("percentile", self.percentile, least=0) > 100:
            raise ValueError(f"percentile must be at most 100, got {self.percentile!r}")

    @property
    def name(self) -> str:
        """Name of the intensity measure in results and figures, such as "RotD50 Sa(1 s, 5 %)"."""
        return f"{self.components} {self._of_one.name}"

    @property
    def components(self) -> str:
        """How two components are combined, such as "RotD50"."""
        return f"RotD{self.percentile:02.4g}"

    @property
    def parameters(self) -> tuple[float, ...]:
        """Damping ratio [%] and period [s] of the spectral acceleration."""
        return self._of_one.parameters

    @property
    def _of_one(self) -> SpectralAcceleration:
        return SpectralAcceleration(self.period, self.damping_ratio)

    def pair_values(self, both: Sequence[tuple[GroundMotion, GroundMotion]]) -> np.ndarray:
        """Return the percentile over directions of each pair's spectral acceleration [m/s2], shape [pair]."""
        rotated = [motion for first, second in both for motion in rotated_motions(first, second)]
        return np.percentile(self._of_one.values(rotated).reshape(len(both), ANGLES.size), self.percentile, axis=1)


def rotated_motions(first: GroundMotion, second: GroundMotion) -> list[GroundMotion]:
    """Return the motion of a pair of components in each direction of ANGLES, one motion per degree."""
    if first.step != second.step:
        raise ValueError(
            f"record {first.record!r}: {first.name!r} has a step of {first.step:g} s and {second.name!r} one of "
            f"{second.step:g} s; both need the same step: call motion.resampled({min(first.step, second.step):g})"
        )
    rows = np.zeros((2, max(first.acceleration.size, second.acceleration.size)))
    rows[0, : first.acceleration.size] = first.acceleration
    rows[1, : second.acceleration.size] = second.acceleration
    first_azimuth, second_azimuth = (orientation(motion.component).azimuth for motion in (first, second))
    if first_azimuth is not None and second_azimuth is not None:
        apart = np.radians(second_azimuth - first_azimuth)
        if abs(np.cos(apart)) > 1e-9:  # the components are not perpendicular
            rows[1] = (rows[1] - np.cos(apart) * rows[0]) / np.sin(apart)
    angles = np.radians(ANGLES)
    return [GroundMotion(row, first.step, first.name) for row in np.c_[np.cos(angles), np.sin(angles)] @ rows]
