"""Velocity pulses of near-fault ground motions."""

from __future__ import annotations

from dataclasses import dataclass, replace

import numpy as np
from numpy.typing import ArrayLike

from warpdyn.foundations.core.checks import finite_numbers, real_number
from warpdyn.foundations.core.near_misses import suggests_names, with_suggestions
from warpdyn.foundations.core.plausibility import PlausibilityFindings
from warpdyn.model.ground_motions.motions import GroundMotion

MOST_SAMPLES = 2**24


@with_suggestions
@dataclass(frozen=True)
class VelocityPulse:
    """A velocity pulse of a near-fault motion: a harmonic wave times a raised cosine.

    The velocity is A / 2 (1 + cos(2 pi f (t - t0) / gamma)) cos(2 pi f (t - t0) + nu) for abs(t - t0) <= gamma / (2 f),
    otherwise 0. For most phases, a permanent displacement remains.

    Source: Mavroeidis and Papageorgiou (2003), "A mathematical representation of near-fault ground motions", Bulletin
    of the Seismological Society of America 93(3).

    Args:
        amplitude: Amplitude A of the velocity [m/s].
        frequency: Frequency f [Hz]; the period of the pulse is 1 / f.
        oscillations: Number of oscillations gamma [1], above 1.
        phase: Phase nu [rad]; 0: the velocity is symmetric about t0; pi / 2: antisymmetric.
        time: Time t0 of the middle of the pulse [s].

    Raises:
        ValueError: If a value is out of range.

    Example:
        >>> pulse = wd.VelocityPulse(amplitude=0.8, frequency=0.4, oscillations=1.5, time=4.0)
        >>> pulse.velocity([2.0, 4.0])
        array([0. , 0.8])
        >>> near_fault = pulse.added_to(motions[0])
    """

    amplitude: float
    frequency: float
    oscillations: float
    phase: float = 0.0
    time: float = 0.0

    def __post_init__(self) -> None:
        for name, unit in (("amplitude", " [m/s]"), ("frequency", " [Hz]"), ("phase", " [rad]"), ("time", " [s]")):
            above = 0.0 if name in ("amplitude", "frequency") else None
            value = real_number(f"VelocityPulse.{name}{unit}", getattr(self, name), above=above)
            object.__setattr__(self, name, value)
        cycles = real_number("VelocityPulse.oscillations", self.oscillations, above=1)
        object.__setattr__(self, "oscillations", cycles)
        findings = PlausibilityFindings()
        findings.add("pulse_amplitude", self.amplitude)
        findings.add("phase", abs(self.phase), " of the VelocityPulse")
        findings.warn()

    @property
    def half_duration(self) -> float:
        """Half of the duration of the pulse, gamma / (2 f) [s]."""
        return self.oscillations / (2 * self.frequency)

    def velocity(self, time: ArrayLike) -> np.ndarray:
        """Return the velocity [m/s] at the given times [s], any shape.

        Raises:
            ValueError: If a time is not a finite number.
        """
        angle, slow, acts = self._angles(time)
        return np.where(acts, self.amplitude / 2 * (1 + np.cos(slow)) * np.cos(angle + self.phase), 0.0)

    def acceleration(self, time: ArrayLike) -> np.ndarray:
        """Return the acceleration [m/s2] at the given times [s], any shape.

        Raises:
            ValueError: If a time is not a finite number.
        """
        angle, slow, acts = self._angles(time)
        fast = angle + self.phase
        value = np.sin(slow) * np.cos(fast) + self.oscillations * np.sin(fast) * (1 + np.cos(slow))
        return np.where(acts, -self.amplitude * np.pi * self.frequency / self.oscillations * value, 0.0)

    @suggests_names
    def motion(self, step: float, duration: float) -> GroundMotion:
        """Return the acceleration of the pulse as a ground motion.

        Args:
            step: Sampling step [s].
            duration: Duration [s]; a longer pulse is cut off.

        Raises:
            ValueError: If a value is not above 0, there would be more than 2^24 samples, the pulse begins before the
                motion, or its frequency is above half of the sampling rate.
        """
        step = real_number("VelocityPulse.motion: step [s]", step, above=0)
        duration = real_number("VelocityPulse.motion: duration [s]", duration, above=0)
        if duration / step > MOST_SAMPLES:
            raise ValueError(
                f"VelocityPulse.motion: duration={duration:g} s at step={step:g} s has over {MOST_SAMPLES} samples: "
                "give a shorter duration= or a longer step="
            )
        self._check_start()
        self._check_step(step)
        time = step * np.arange(max(2, round(duration / step) + 1))
        return GroundMotion(self.acceleration(time), step, "pulse")

    def added_to(self, motion: GroundMotion) -> GroundMotion:
        """Return a motion plus the acceleration of the pulse; zeros are added if the pulse ends after the motion.

        Args:
            motion: The ground motion.

        Raises:
            TypeError: If `motion` is not a GroundMotion.
            ValueError: If the pulse begins before the motion, or its frequency is above half of the sampling rate.
        """
        if not isinstance(motion, GroundMotion):
            raise TypeError(f"VelocityPulse.added_to: motion must be a GroundMotion, got {type(motion).__name__}")
        self._check_start()
        self._check_step(motion.step)
        needed = int(np.ceil((self.time + self.half_duration) / motion.step)) + 1
        if needed > MOST_SAMPLES:
            raise ValueError(f"VelocityPulse.added_to: the pulse ends at sample {needed}: correct time= [s]")
        findings = PlausibilityFindings()
        findings.add("pulse_time", self.time / motion.duration, f" {motion.name!r}")
        findings.warn()
        long = motion.lengthened(needed)
        added = self.acceleration(motion.step * np.arange(long.acceleration.size))
        return replace(long, acceleration=long.acceleration + added, name=f"{motion.name} with pulse")

    def _check_start(self) -> None:
        if self.time - self.half_duration < -1e-9 * self.half_duration:
            raise ValueError(
                f"VelocityPulse.time={self.time:g} s: the pulse begins {self.half_duration - self.time:.4g} s before "
                f"the motion, so that its first part would be lost: give a time of at least {self.half_duration:.4g} s"
            )

    def _check_step(self, step: float) -> None:
        if self.frequency > 0.5 / step:
            raise ValueError(
                f"VelocityPulse.frequency={self.frequency:g} Hz is above the Nyquist frequency {0.5 / step:g} Hz, half "
                f"of the sampling rate of a motion with step={step:g} s, so that its samples do not show the pulse: "
                f"correct frequency= [Hz] (1 / period), or give a motion with a step below {0.5 / self.frequency:.3g} s"
            )

    def _angles(self, time: ArrayLike) -> tuple[np.ndarray, np.ndarray, np.ndarray]:
        """Return the angles of both cosines [rad], and whether the pulse acts."""
        since = finite_numbers("VelocityPulse: time [s]", time) - self.time
        angle = 2 * np.pi * self.frequency * since
        return angle, angle / self.oscillations, np.abs(since) <= self.half_duration
