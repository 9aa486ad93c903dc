"""Intensity measures of a ground motion: one number that says how strong it is."""

from __future__ import annotations

from dataclasses import dataclass
from numbers import Real

import numpy as np
from scipy.linalg import expm
from scipy.signal import lfilter

from warpdyn.motions import GroundMotion

# Sets the largest error of spectral_acceleration, which says how.
INSTANTS_PER_PERIOD = 200


def spectral_acceleration(
    motion: GroundMotion, period: float | np.ndarray, damping_ratio: float = 0.05
) -> float | np.ndarray:
    """Pseudo-spectral acceleration of a linear oscillator: its largest displacement times its squared frequency.

    The base acceleration is linear between its samples and zero after them, so the displacement is exact at every
    instant looked at: at least 200 a period, the samples among them, until one period after the end. A peak between
    two instants makes the result too low, by at most 0.0124 % (1 + PGA/Sa) to leading order: the displacement's
    curvature at its peak is at most omega^2 u + PGA, over half an interval of T/200. It is never too high.

    Source: Nigam and Jennings (1969), "Calculation of response spectra from strong-motion earthquake records".

    Args:
        motion: The ground motion.
        period: Undamped natural period [s], a scalar or any shape.
        damping_ratio: Viscous damping as a fraction of critical, from 0 up to but not including 1.

    Returns:
        Spectral acceleration [m/s2], a float for a scalar period, otherwise an array of the shape of `period`.

    Raises:
        ValueError: If a period is not finite and positive, or the damping ratio is outside [0, 1).
    """
    periods = _checked_periods(period)
    _check_damping_ratio(damping_ratio)
    result = np.array([_pseudo_acceleration(motion, each, damping_ratio) for each in periods.flat])
    return float(result[0]) if periods.ndim == 0 else result.reshape(periods.shape)


@dataclass(frozen=True)
class PeakGroundAcceleration:
    """The largest absolute ground acceleration."""

    @property
    def name(self) -> str:
        """What results and figures call this measure."""
        return "PGA"

    def of(self, motion: GroundMotion) -> float:
        """Its value for a motion [m/s2]."""
        return motion.peak_ground_acceleration


@dataclass(frozen=True)
class SpectralAcceleration:
    """The pseudo-spectral acceleration at one period and damping ratio.

    Args:
        period: Undamped natural period [s].
        damping_ratio: Viscous damping as a fraction of critical, from 0 up to but not including 1.

    Raises:
        ValueError: If the period is not one finite, positive number, or the damping ratio is outside [0, 1).
    """

    period: float
    damping_ratio: float = 0.05

    def __post_init__(self) -> None:
        if not isinstance(self.period, Real):
            raise ValueError(f"period must be one number [s], got {self.period!r}")
        _checked_periods(self.period)
        _check_damping_ratio(self.damping_ratio)

    @property
    def name(self) -> str:
        """What results and figures call this measure."""
        return f"Sa({self.period:.4g} s, {100 * self.damping_ratio:.4g} %)"

    def of(self, motion: GroundMotion) -> float:
        """Its value for a motion [m/s2]."""
        return spectral_acceleration(motion, self.period, self.damping_ratio)


def _checked_periods(period: float | np.ndarray) -> np.ndarray:
    periods = np.asarray(period)
    if periods.dtype.kind not in "iuf":
        raise ValueError(f"period must be a number or an array of numbers [s], got {period!r}")
    periods = periods.astype(np.float64)
    bad = periods[~(np.isfinite(periods) & (periods > 0))]
    if bad.size:
        raise ValueError(
            f"period must be finite and above 0 s, got {bad[0]} (for period 0, use PeakGroundAcceleration)"
        )
    return periods


def _check_damping_ratio(damping_ratio: float) -> None:
    if not (isinstance(damping_ratio, Real) and 0 <= damping_ratio < 1):
        raise ValueError(f"damping_ratio must be a number from 0 up to but not including 1, got {damping_ratio!r}")


def _pseudo_acceleration(motion: GroundMotion, period: float, damping_ratio: float) -> float:
    # With q' = root q + a and q(0) = 0, the displacement of u'' + 2 zeta omega u' + omega^2 u = -a is
    # -Im(q) / damped_frequency: one complex state in place of displacement and velocity.
    frequency = 2 * np.pi / period
    damped_frequency = frequency * np.sqrt(1 - damping_ratio**2)
    root = -damping_ratio * frequency + 1j * damped_frequency
    # One matrix exponential holds the whole step: the first row maps (q, a, slope of a) to q a time later.
    # It keeps its digits for periods far above the step, where the closed formulas of its entries cancel.
    generator = np.array([[root, 1, 0], [0, 0, 1], [0, 0, 0]])

    acceleration, step = motion.acceleration, motion.step
    slope = np.diff(acceleration) / step
    decay, constant, linear = expm(generator * step)[0]
    state = np.empty(acceleration.size, dtype=np.complex128)
    state[0] = 0
    state[1:] = lfilter([1], [1, -decay], constant * acceleration[:-1] + linear * slope)

    peak = np.abs(state.imag).max()
    intervals = int(np.ceil(INSTANTS_PER_PERIOD * step / period))
    # One instant at a time for the whole record: memory stays that of the record, however short the period.
    for k in range(1, intervals):
        decay, constant, linear = expm(generator * (k * step / intervals))[0]
        between = decay * state[:-1] + constant * acceleration[:-1] + linear * slope
        peak = max(peak, np.abs(between.imag).max())
    after = state[-1] * np.exp(root * np.linspace(0, period, INSTANTS_PER_PERIOD + 1))
    peak = max(peak, np.abs(after.imag).max())
    return float(peak * frequency**2 / damped_frequency)
