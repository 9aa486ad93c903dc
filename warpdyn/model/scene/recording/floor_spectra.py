"""`FloorSpectra`, the settings of the recorder "floor_spectra"."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass

import numpy as np

from warpdyn.foundations.core.checks import finite_numbers, one_of, real_number, shortened
from warpdyn.foundations.core.messages import warn_caller
from warpdyn.foundations.core.near_misses import with_suggestions

PSEUDO, ABSOLUTE = QUANTITIES = ("pseudo_acceleration", "absolute_acceleration")
LONGEST_PERIOD = 100.0  # [s]; longer periods are probably in other units
# Steps per shortest period: of the default step; and the fewest that are accepted. Between two steps the floor
# acceleration is linear, which changes the amplitude of a sine with n steps per period by the factor sinc^2(pi / n).
STEPS_PER_PERIOD, FEWEST_STEPS = 20, 5


@with_suggestions
@dataclass(frozen=True)
class FloorSpectra:
    """Periods and damping ratio of the oscillators with which the recorder "floor_spectra" records floor spectra.

    On each floor there is one oscillator per period. Each oscillator starts at rest, is driven by the absolute
    acceleration of the floor, and does not act on the floor. The floor acceleration is linear between two steps of the
    integration, and the motion of the oscillator is exact for it (Nigam and Jennings 1969).

    Args:
        periods: Undamped natural periods of the oscillators [s], increasing, shape [period].
        damping_ratio: Viscous damping of the oscillators as a fraction of critical damping [1], from 0 up to but not
            including 1.
        quantity: "pseudo_acceleration", the squared circular frequency times the largest displacement relative to the
            floor, or "absolute_acceleration", the largest absolute acceleration of the oscillator. They differ by the
            force of the damper.

    Raises:
        ValueError: If periods are not finite, above 0 and increasing, the damping ratio is outside of its range, or the
            quantity is unknown.

    Example:
        >>> spectra = wd.FloorSpectra(periods=[0.1, 0.2, 0.5], damping_ratio=0.05)
        >>> asked = dict(recorders=("drift", "floor_spectra"), floor_spectra=spectra)
        >>> run = wd.simulate(wd.Scene(building, wd.Cloud(motions), **asked))
        >>> run["peak_floor_spectral_acceleration"].dims
        ('sample', 'floor', 'period')
    """

    periods: Sequence[float]
    damping_ratio: float = 0.05
    quantity: str = PSEUDO

    def __post_init__(self) -> None:
        periods = np.atleast_1d(finite_numbers("FloorSpectra.periods", self.periods))
        if periods.ndim != 1 or not periods.size or periods.min() <= 0 or np.any(np.diff(periods) <= 0):
            raise ValueError(
                "FloorSpectra.periods must be a row of increasing periods above 0 s, such as [0.1, 0.2, 0.5], got "
                f"{shortened(self.periods)} (for period 0, use the recorder 'acceleration')"
            )
        damping_ratio = real_number("FloorSpectra.damping_ratio", self.damping_ratio, least=0)
        if damping_ratio >= 1:
            raise ValueError(
                f"FloorSpectra.damping_ratio must be from 0 up to but not including 1, got {damping_ratio:g} (5 % is "
                "0.05)"
            )
        one_of("FloorSpectra.quantity", self.quantity, QUANTITIES)
        if periods[-1] > LONGEST_PERIOD:
            warn_caller(
                f"FloorSpectra: the longest period is {periods[-1]:g} s: give periods in seconds, not in ms or Hz"
            )
        elif damping_ratio > 0.5:
            warn_caller(f"FloorSpectra: a damping ratio of {damping_ratio:g} is unusually large: 5 % is 0.05")
        object.__setattr__(self, "periods", tuple(periods.tolist()))
        object.__setattr__(self, "damping_ratio", damping_ratio)

    @property
    def coordinate(self) -> dict[str, tuple]:
        """The coordinate `period` of a dataset."""
        words = {"long_name": "natural period of the oscillator", "units": "s"}
        return {"period": ("period", np.array(self.periods), words)}

    @property
    def longest_step(self) -> float:
        """Longest default integration step [s], with STEPS_PER_PERIOD steps in the shortest period."""
        return self.periods[0] / STEPS_PER_PERIOD

    def check_step(self, step: float) -> None:
        """Raise a ValueError if the shortest period has too few steps [s]; warn if it has few.

        Args:
            step: The longest integration step of the run [s].
        """
        shortest = self.periods[0]
        steps = shortest / step * (1 + 1e-9)
        if steps < FEWEST_STEPS:
            raise ValueError(
                f"FloorSpectra.periods: the shortest period, {shortest:g} s, has only {steps:.2g} integration steps of "
                f"{step:.3g} s, which cannot resolve it: give step={shortest / STEPS_PER_PERIOD:.3g} or shorter, "
                f"remove step=, or begin the periods at {FEWEST_STEPS * step:.3g} s"
            )
        if steps < STEPS_PER_PERIOD:
            lost = 1 - np.sinc(1 / steps) ** 2
            warn_caller(
                f"FloorSpectra: the shortest period, {shortest:g} s, has {steps:.3g} integration steps of {step:.3g} "
                f"s. Floor accelerations of this period may be up to {100 * lost:.2g} % too small: give "
                f"step={shortest / STEPS_PER_PERIOD:.3g}, or remove step="
            )

    def arrays(self) -> dict[str, np.ndarray]:
        """Return the arrays of the oscillators for the kernel: {field of the struct Load: array}."""
        frequency = 2 * np.pi / np.array(self.periods)
        return {"oscillator_frequency": frequency, "oscillator_damping": np.array([self.damping_ratio])}
