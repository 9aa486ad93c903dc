"""Intensity measures of a ground motion: one number that says how strong it is."""

from __future__ import annotations

from dataclasses import dataclass
from numbers import Real

import numpy as np

from warpdyn.motions import GroundMotion
from warpdyn.response_spectra import checked_periods, spectral_displacements


def spectral_acceleration(
    motion: GroundMotion, period: float | np.ndarray, damping_ratio: float = 0.05
) -> float | np.ndarray:
    """Pseudo-spectral acceleration of a linear oscillator: its largest displacement times its squared frequency.

    It is exact to rounding, as `response_spectra` says. It is computed on the CPU, whatever device runs an ensemble, so
    that the scale factors of stripes do not depend on the device.

    Args:
        motion: The ground motion.
        period: Undamped natural period [s], a scalar or any shape.
        damping_ratio: Viscous damping as a fraction of critical, from 0 up to but not including 1.

    Returns:
        Spectral acceleration [m/s2], a float for a scalar period, otherwise an array of the shape of `period`.

    Raises:
        ValueError: If a period is not finite and positive or is outside 1e-5 to 1e9 steps of the motion, or the damping
            ratio is outside [0, 1).
    """
    periods = checked_periods(period)
    _check_damping_ratio(damping_ratio)
    displacement = spectral_displacements([motion], periods.ravel(), np.array([damping_ratio]))[0, 0]
    result = (2 * np.pi / periods.ravel()) ** 2 * displacement
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
        checked_periods(self.period)
        _check_damping_ratio(self.damping_ratio)

    @property
    def name(self) -> str:
        """What results and figures call this measure."""
        return f"Sa({self.period:.4g} s, {100 * self.damping_ratio:.4g} %)"

    def of(self, motion: GroundMotion) -> float:
        """Its value for a motion [m/s2]."""
        return spectral_acceleration(motion, self.period, self.damping_ratio)


def _check_damping_ratio(damping_ratio: float) -> None:
    if not (isinstance(damping_ratio, Real) and 0 <= damping_ratio < 1):
        raise ValueError(f"damping_ratio must be a number from 0 up to but not including 1, got {damping_ratio!r}")
