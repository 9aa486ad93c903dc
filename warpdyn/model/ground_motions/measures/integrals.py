"""Integrals of a ground motion over its duration; they are exact for accelerations that are linear between samples.

Velocity and displacement start from zero without baseline correction.
"""

from __future__ import annotations

import numpy as np

from warpdyn.foundations.core.units import STANDARD_GRAVITY
from warpdyn.model.ground_motions.motions import GroundMotion


def peak_ground_velocity(motion: GroundMotion) -> float:
    """Return the largest absolute velocity [m/s]; it may occur at a sample, or between samples where a(t) is zero."""
    a, slope, velocity = _pieces(motion)
    peak = np.abs(velocity).max()
    turning = a[:-1] * a[1:] < 0
    between = velocity[:-1][turning] - a[:-1][turning] ** 2 / (2 * slope[turning])
    return float(max(peak, np.abs(between).max(initial=0.0)))


def peak_ground_displacement(motion: GroundMotion) -> float:
    """Return the largest absolute displacement [m]; it may occur at a sample, or between samples where v(t) is zero."""
    a, slope, velocity = _pieces(motion)
    h, start, v = motion.step, a[:-1], velocity[:-1]
    gain = h * v + h**2 * (2 * start + a[1:]) / 6
    displacement = np.concatenate([[0.0], np.cumsum(gain)])
    peak = np.abs(displacement).max()
    # An interval has up to two zeros of the velocity. Each is computed by the formula that avoids cancellation. A
    # complex zero is NaN; a zero outside the interval is ignored.
    with np.errstate(invalid="ignore", divide="ignore"):
        q = -(start + np.copysign(np.sqrt(start**2 - 2 * slope * v), start))
        for t in (q / slope, 2 * v / q):
            inside = np.flatnonzero((t > 0) & (t < h))
            s = t[inside]
            between = displacement[inside] + s * (v[inside] + s * (start[inside] / 2 + s * slope[inside] / 6))
            peak = max(peak, np.abs(between).max(initial=0.0))
    return float(peak)


def arias_intensity(motion: GroundMotion) -> float:
    """Return the integral of the squared acceleration times pi / (2 g) [m/s].

    Source: Arias (1970), "A measure of earthquake intensity".
    """
    return float(np.pi / (2 * STANDARD_GRAVITY) * squared_integrals(motion.acceleration, motion.step).sum())


def husid(motion: GroundMotion) -> np.ndarray:
    """Return the fraction of the Arias intensity that is reached at each sample, shape [time]; NaN for zero motion.

    Source: Husid (1969), "Características de terremotos, análisis general", Revista del IDIEM 8.
    """
    peak = motion.peak_ground_acceleration
    if peak == 0:
        return np.full(motion.acceleration.size, np.nan)
    reached = np.cumsum(squared_integrals(motion.acceleration / peak, motion.step))
    return np.append(0.0, reached / reached[-1])


def cumulative_absolute_velocity(motion: GroundMotion) -> float:
    """Return the integral of the absolute acceleration [m/s].

    Source: EPRI (1988), "A criterion for determining exceedance of the operating basis earthquake", NP-5930.
    """
    start, end = np.abs(motion.acceleration[:-1]), np.abs(motion.acceleration[1:])
    both = start + end
    crosses = motion.acceleration[:-1] * motion.acceleration[1:] < 0
    # If the acceleration crosses zero in the interval, the area consists of two triangles; otherwise it is a trapezium.
    area = np.where(crosses, (start**2 + end**2) / np.where(both > 0, both, 1.0), both)
    return float(motion.step / 2 * area.sum())


def significant_duration(motion: GroundMotion, start: float, end: float) -> float:
    """Return the time between two fractions of the Arias intensity [s]; NaN for a motion that is zero throughout.

    Source: Trifunac and Brady (1975), "A study on the duration of strong earthquake ground motion".

    Args:
        motion: The ground motion.
        start: Fraction at which the duration starts, above 0.
        end: Fraction at which the duration ends, above `start` and below 1.
    """
    peak = motion.peak_ground_acceleration
    if peak == 0:
        return float("nan")
    a = motion.acceleration / peak
    reached = np.concatenate([[0.0], np.cumsum(squared_integrals(a, motion.step))])
    times = []
    for share in (start, end):
        i = np.searchsorted(reached, share * reached[-1]) - 1  # the last sample before the time (share is above 0)
        slope, rest = (a[i + 1] - a[i]) / motion.step, share * reached[-1] - reached[i]
        # The acceleration x at this time solves (x^3 - a^3) / (3 slope) = rest. t is (x - a) / slope, in a form
        # without cancellation of digits.
        x = np.cbrt(a[i] ** 3 + 3 * slope * rest)
        times.append(i * motion.step + 3 * rest / (x**2 + x * a[i] + a[i] ** 2))
    return float(times[1] - times[0])


def _pieces(motion: GroundMotion) -> tuple[np.ndarray, np.ndarray, np.ndarray]:
    """Return acceleration at samples [m/s2], its slope in each interval [m/s3], and velocity at samples [m/s]."""
    a = motion.acceleration
    velocity = np.concatenate([[0.0], np.cumsum(motion.step / 2 * (a[:-1] + a[1:]))])
    return a, np.diff(a) / motion.step, velocity


def squared_integrals(a: np.ndarray, step: float) -> np.ndarray:
    """Return the integral of the squared acceleration over each interval, shape [time - 1]."""
    return step / 3 * (a[:-1] ** 2 + a[:-1] * a[1:] + a[1:] ** 2)
