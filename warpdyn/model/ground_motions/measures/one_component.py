"""Intensity measures of a single component of a ground motion."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass
from numbers import Real
from operator import attrgetter
from typing import Any, ClassVar

import numpy as np
import xarray as xr
from numpy.typing import ArrayLike

from warpdyn.foundations.core.checks import real_number, shortened
from warpdyn.foundations.core.near_misses import with_suggestions
from warpdyn.foundations.files.netcdf import trace
from warpdyn.model.ground_motions.measures import integrals
from warpdyn.model.ground_motions.measures.measure import ACCELERATION, OPENQUAKE_UNITS, IntensityMeasure
from warpdyn.model.ground_motions.motions import GroundMotion, checked_motions, motion_names, motion_numbers
from warpdyn.model.ground_motions.plausibility import warn_of_implausible_motions
from warpdyn.model.ground_motions.response_spectra import checked_periods, spectral_displacements


def spectral_acceleration(
    motion: GroundMotion, period: float | np.ndarray, damping_ratio: float = 0.05
) -> float | np.ndarray:
    """Return the pseudo-spectral acceleration: peak displacement of an oscillator times its squared circular frequency.

    The result is exact up to rounding, as in `response_spectra`. It is always computed on the CPU, so that the scale
    factors of stripes do not depend on the device of a run.

    Args:
        motion: The ground motion.
        period: Undamped natural period [s], a scalar or any shape.
        damping_ratio: Viscous damping as a fraction of critical [1], from 0 up to but not including 1.

    Returns:
        Spectral acceleration [m/s2], a float for a scalar period, otherwise an array of the shape of `period`.

    Raises:
        ValueError: If a period is not finite and positive or is outside 1e-5 to 1e9 steps of the motion, or the damping
            ratio is outside [0, 1).
    """
    periods = checked_periods(period)
    result = _accelerations([motion], periods.ravel(), damping_ratio)[0]
    return float(result[0]) if periods.ndim == 0 else result.reshape(periods.shape)


def _accelerations(motions: Sequence[GroundMotion], periods: np.ndarray, damping_ratio: float) -> np.ndarray:
    """Return the pseudo-spectral acceleration of each motion at each period [m/s2], shape [motion, period]."""
    _check_damping_ratio(damping_ratio)
    for motion in motions:
        check_motion(motion)
    return (2 * np.pi / periods) ** 2 * spectral_displacements(motions, periods, np.array([damping_ratio]))[:, 0]


class _WithoutPeriod(IntensityMeasure):
    """Base class of intensity measures that have no period, such as PGA."""

    compute: ClassVar[Any]  # function from a motion to the value of the measure

    def value(self, motion: GroundMotion) -> float:
        """Return the value of the intensity measure for a ground motion [units]."""
        check_motion(motion)
        return float(type(self).compute(motion))


@dataclass(frozen=True)
class PeakGroundAcceleration(_WithoutPeriod):
    """The largest absolute ground acceleration [m/s2].

    Example:
        >>> round(wd.PeakGroundAcceleration().value(motions[0]), 2)
        6.97
    """

    units = ACCELERATION
    name = kind = "PGA"
    compute = attrgetter("peak_ground_acceleration")


@dataclass(frozen=True)
class PeakGroundVelocity(_WithoutPeriod):
    """The largest absolute ground velocity [m/s], without baseline correction of the record.

    Example:
        >>> round(wd.PeakGroundVelocity().value(motions[0]), 2)
        1.1
    """

    units = "m s-1"
    name = kind = "PGV"
    compute = staticmethod(integrals.peak_ground_velocity)


@dataclass(frozen=True)
class PeakGroundDisplacement(_WithoutPeriod):
    """The largest absolute ground displacement [m], without baseline correction of the record.

    Example:
        >>> filtered = wd.records.band_pass(motions[0], 0.2, 20.0)  # removes long-period noise
        >>> round(wd.PeakGroundDisplacement().value(filtered), 2)
        0.09
    """

    units = "m"
    name = kind = "PGD"
    compute = staticmethod(integrals.peak_ground_displacement)


@dataclass(frozen=True)
class AriasIntensity(_WithoutPeriod):
    """The integral of the squared ground acceleration times pi / (2 g) [m/s].

    Example:
        >>> round(wd.AriasIntensity().value(motions[0]), 2)
        1.42
    """

    units = "m s-1"
    power = 2
    name, kind = "Arias intensity", "IA"
    compute = staticmethod(integrals.arias_intensity)


@dataclass(frozen=True)
class CumulativeAbsoluteVelocity(_WithoutPeriod):
    """The integral of the absolute ground acceleration [m/s].

    Example:
        >>> round(wd.CumulativeAbsoluteVelocity().value(motions[0]), 2)
        5.05
    """

    units = "m s-1"
    name = kind = "CAV"
    compute = staticmethod(integrals.cumulative_absolute_velocity)


@with_suggestions
@dataclass(frozen=True)
class SignificantDuration(IntensityMeasure):
    """The time between two fractions of the Arias intensity [s]; NaN for a motion that is zero throughout.

    Args:
        start: Fraction of the Arias intensity at which the duration starts [1].
        end: Fraction at which it ends [1].

    Raises:
        ValueError: Unless 0 < start < end < 1.

    Example:
        >>> measure = wd.SignificantDuration(0.05, 0.75)
        >>> round(measure.value(motions[0]), 2)
        2.13
    """

    start: float = 0.05
    end: float = 0.95
    units = "s"
    power = 0

    def __post_init__(self) -> None:
        start, end = real_number("start", self.start, above=0), real_number("end", self.end, above=0)
        if not start < end < 1:
            raise ValueError(f"fractions of the Arias intensity must be 0 < start < end < 1, got {start:g} and {end:g}")

    @property
    def name(self) -> str:
        """Name of the intensity measure in results and figures, such as "D5-95"."""
        return f"D{100 * self.start:.4g}-{100 * self.end:.4g}"

    @property
    def kind(self) -> str:
        """OpenQuake's name of the measure, such as "RSD595"; "" if OpenQuake does not have these fractions."""
        kind = f"RS{self.name.replace('-', '')}"
        return kind if kind in OPENQUAKE_UNITS else ""

    def value(self, motion: GroundMotion) -> float:
        """Return the significant duration of a ground motion [s]."""
        check_motion(motion)
        return integrals.significant_duration(motion, self.start, self.end)


@with_suggestions
@dataclass(frozen=True)
class SpectralAcceleration(IntensityMeasure):
    """The pseudo-spectral acceleration at one period and damping ratio [m/s2].

    Args:
        period: Undamped natural period [s].
        damping_ratio: Viscous damping as a fraction of critical [1], from 0 up to but not including 1.

    Raises:
        ValueError: If the period is not one finite, positive number, or the damping ratio is outside [0, 1).

    Example:
        >>> measure = wd.SpectralAcceleration(building.fundamental_period)
        >>> measure.values(motions[:3]).round(1)
        array([2.7, 5. , 4.2])
    """

    period: float
    damping_ratio: float = 0.05
    units = ACCELERATION
    kind = "SA"

    def __post_init__(self) -> None:
        if not isinstance(self.period, Real) or isinstance(self.period, bool | np.bool_):
            raise ValueError(f"period must be one number [s], got {shortened(self.period)}")
        checked_periods(self.period)
        _check_damping_ratio(self.damping_ratio)

    @property
    def name(self) -> str:
        """Name of the intensity measure in results and figures, such as "Sa(1 s, 5 %)"."""
        return f"Sa({self.period:.4g} s, {100 * self.damping_ratio:.4g} %)"

    @property
    def parameters(self) -> tuple[float, ...]:
        """Damping ratio [%] and period [s] of the spectral acceleration."""
        return 100 * self.damping_ratio, self.period

    def value(self, motion: GroundMotion) -> float:
        """Return the pseudo-spectral acceleration of a ground motion [m/s2].

        Args:
            motion: The motion.

        Raises:
            TypeError: If `motion` is not a GroundMotion.
        """
        check_motion(motion)
        return float(self.values([motion])[0])

    def values(self, motions: Sequence[GroundMotion]) -> np.ndarray:
        """Return the pseudo-spectral acceleration of each motion [m/s2], shape [motion]; one kernel computes all.

        Args:
            motions: The motions.

        Raises:
            ValueError: If the period is outside 1e-5 to 1e9 steps of a motion.
            TypeError: If an element of `motions` is not a GroundMotion, such as a PairOfMotions.
        """
        return _accelerations(motions, np.array([self.period]), self.damping_ratio)[:, 0]


@with_suggestions
@dataclass(frozen=True)
class AverageSpectralAcceleration(IntensityMeasure):
    """The geometric mean of the pseudo-spectral accelerations at several periods [m/s2].

    Source: Eads, Miranda and Lignos (2015), "Average spectral acceleration as an intensity measure for collapse risk
    assessment", who use evenly spaced periods from 0.2 to 3 times the first period of the structure:
    `AverageSpectralAcceleration(np.arange(0.2 * first, 3 * first, 0.01))`.

    Args:
        periods: Undamped natural periods [s], a 1-D array.
        damping_ratio: Viscous damping as a fraction of critical [1], from 0 up to but not including 1.

    Raises:
        ValueError: If the periods are not a 1-D array of finite, positive numbers, or the damping ratio is outside
            [0, 1).

    Example:
        >>> first = building.fundamental_period
        >>> measure = wd.AverageSpectralAcceleration(np.arange(0.2 * first, 3 * first, 0.1))
        >>> measure.values(motions[:3]).round(1)
        array([2.4, 5. , 3.4])
    """

    periods: ArrayLike
    damping_ratio: float = 0.05
    units = ACCELERATION
    kind = "AvgSA"

    def __post_init__(self) -> None:
        periods = checked_periods(self.periods, "periods")
        if periods.ndim != 1 or periods.size == 0:
            raise ValueError(f"periods must be a row of at least one number [s], got {shortened(self.periods)}")
        _check_damping_ratio(self.damping_ratio)
        object.__setattr__(self, "periods", tuple(periods.tolist()))

    @property
    def name(self) -> str:
        """Name of the intensity measure in results and figures, with the range and number of periods."""
        row = np.asarray(self.periods)
        span = f"{row.min():.4g} to {row.max():.4g} s, {row.size} periods"
        return f"Sa_avg({span}, {100 * self.damping_ratio:.4g} %)"

    @property
    def parameters(self) -> tuple[float, ...]:
        """Damping ratio [%], and the shortest and the longest period of the average [s]."""
        return 100 * self.damping_ratio, float(np.min(self.periods)), float(np.max(self.periods))

    def value(self, motion: GroundMotion) -> float:
        """Return the average spectral acceleration of a ground motion [m/s2]."""
        check_motion(motion)
        return float(self.values([motion])[0])

    def values(self, motions: Sequence[GroundMotion]) -> np.ndarray:
        """Return the average spectral acceleration of each motion [m/s2], shape [motion]; one kernel computes all."""
        values = _accelerations(motions, np.array(self.periods), self.damping_ratio)
        with np.errstate(divide="ignore"):  # the mean of a motion that is zero throughout is zero
            return np.exp(np.log(values).mean(axis=1))


# Variables of the dataset that `intensity_measures` returns: name -> (measure, long name).
_TABLE = {
    "peak_ground_acceleration": (PeakGroundAcceleration(), "peak ground acceleration"),
    "peak_ground_velocity": (PeakGroundVelocity(), "peak ground velocity"),
    "peak_ground_displacement": (PeakGroundDisplacement(), "peak ground displacement"),
    "arias_intensity": (AriasIntensity(), "Arias intensity"),
    "cumulative_absolute_velocity": (CumulativeAbsoluteVelocity(), "cumulative absolute velocity"),
    "significant_duration_5_75": (SignificantDuration(0.05, 0.75), "time from 5 to 75 % of the Arias intensity"),
    "significant_duration_5_95": (SignificantDuration(0.05, 0.95), "time from 5 to 95 % of the Arias intensity"),
}


def intensity_measures(motions: GroundMotion | Sequence[GroundMotion]) -> xr.Dataset:
    """Return the intensity measures without a period: peaks, integrals and durations of ground motions.

    The measures are exact for accelerations that are linear between samples. Velocities and displacements start from
    zero and are computed over the duration of the record, without baseline correction.

    Args:
        motions: One ground motion or several.

    Returns:
        Dataset over `motion`: peak ground acceleration, velocity and displacement, Arias intensity, cumulative absolute
        velocity, and significant durations.

    Raises:
        ValueError: If `motions` is empty.
        TypeError: If a motion is not a GroundMotion.

    Example:
        >>> measures = wd.intensity_measures(motions)
        >>> measures["peak_ground_velocity"].round(2).values
        array([1.1 , 1.53, 0.35, 0.41, 0.61, 0.33, 0.46, 0.67])
    """
    motions = checked_motions(motions)
    warn_of_implausible_motions(motions)
    variables = {
        name: ("motion", measure.values(motions), {"long_name": long_name, "units": measure.units})
        for name, (measure, long_name) in _TABLE.items()
    }
    return xr.Dataset(
        variables,
        coords={"motion": motion_numbers(len(motions)), "motion_name": motion_names(motions)},
        attrs=trace("Intensity measures of ground motions", "intensity_measures"),
    )


def check_motion(motion: object) -> None:
    """Raise a TypeError, with the remedy for a pair of motions, unless `motion` is a GroundMotion."""
    if not isinstance(motion, GroundMotion):
        is_pair = all(isinstance(each, GroundMotion) for each in getattr(motion, "components", [None]))
        remedy = ": give its components, as in measure.values(pair.components)" if is_pair else ""
        raise TypeError(f"motion must be a GroundMotion, got {shortened(motion)}{remedy}")


def _check_damping_ratio(damping_ratio: float) -> None:
    is_number = isinstance(damping_ratio, Real) and not isinstance(damping_ratio, bool | np.bool_)
    if not is_number or not 0 <= damping_ratio < 1:
        raise ValueError(
            f"damping_ratio must be a number from 0 up to but not including 1, got {shortened(damping_ratio)}"
        )
