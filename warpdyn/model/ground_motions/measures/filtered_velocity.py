"""Filtered incremental velocity (FIV3), an intensity measure for collapse."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np

from warpdyn.foundations.core.checks import real_number
from warpdyn.foundations.core.near_misses import with_suggestions
from warpdyn.model.ground_motions.measures.measure import IntensityMeasure
from warpdyn.model.ground_motions.measures.one_component import check_motion
from warpdyn.model.ground_motions.motions import GroundMotion

PULSES = 3  # number of velocity increments that are added
ORDER = 2  # of the Butterworth filter
PADDING = 3 * (ORDER + 1)  # samples by which SciPy's filtfilt extends each end


@with_suggestions
@dataclass(frozen=True)
class FilteredIncrementalVelocity(IntensityMeasure):
    """The filtered incremental velocity FIV3: the sum of the three largest velocity increments of a motion [m/s].

    The acceleration is filtered by a low-pass Butterworth filter of second order with the cut-off frequency beta /
    period, forwards and backwards. The velocity increment V(t) is the integral of the filtered acceleration from t to t
    + alpha * period. The measure is the larger of the sum of the three largest local maxima of V and the absolute sum
    of its three lowest local minima. A motion with fewer than three of them has the sum of those it has.

    Source: Davalos and Miranda (2019), "Filtered incremental velocity: A novel approach in intensity measures for
    seismic collapse estimation", Earthquake Engineering & Structural Dynamics 48(12).

    Args:
        period: First period of the structure [s].
        alpha: Length of the increments over the period [1], such as 0.7.
        beta: Cut-off frequency of the filter times the period [1], such as 0.85.

    Raises:
        ValueError: If a number is not finite and above 0. When values are computed: if the cut-off frequency is not
            below half the sampling frequency of a motion, or a motion is not longer than an increment or has at most 9
            samples.

    Example:
        >>> measure = wd.FilteredIncrementalVelocity(period=0.5, alpha=0.7, beta=0.85)
        >>> round(measure.value(motions[0]), 2)
        0.59
    """

    period: float
    alpha: float
    beta: float
    units = "m s-1"

    def __post_init__(self) -> None:
        for name in ("period", "alpha", "beta"):
            real_number(f"FilteredIncrementalVelocity.{name}", getattr(self, name), above=0)

    @property
    def name(self) -> str:
        """Name of the intensity measure in results and figures, such as "FIV3(1 s, 0.7, 0.85)"."""
        return f"FIV3({self.period:.4g} s, {self.alpha:.4g}, {self.beta:.4g})"

    def value(self, motion: GroundMotion) -> float:
        """Return the filtered incremental velocity of a ground motion [m/s]."""
        from scipy import signal  # its import takes 0.3 s

        check_motion(motion)
        if motion.acceleration.size <= PADDING:
            raise ValueError(
                f"{self.name} of {motion.name!r}: the filter needs a motion of more than {PADDING} samples, got "
                f"{motion.acceleration.size}: leave out this motion"
            )
        step, window = motion.step, self.alpha * self.period
        cutoff = self.beta / self.period * 2 * step  # as a fraction of half the sampling frequency
        length = (motion.acceleration.size - 1) * step
        if cutoff >= 1 or window >= length:
            raise ValueError(
                f"{self.name} of {motion.name!r}: the cut-off frequency {self.beta / self.period:.4g} Hz must be below "
                f"{0.5 / step:.4g} Hz, and the increment of {window:.4g} s shorter than the motion of {length:.4g} s: "
                "correct the period [s]"
            )
        filtered = signal.filtfilt(*signal.butter(ORDER, cutoff), motion.acceleration)
        velocity = np.concatenate([[0.0], np.cumsum(step / 2 * (filtered[:-1] + filtered[1:]))])
        # Velocity at the end of each increment, exact for an acceleration that is linear between samples.
        start = np.arange(int(np.floor((length - window) / step * (1 + 1e-12))) + 1)
        whole, part = np.divmod(window / step, 1.0)
        first = np.minimum(start + int(whole), filtered.size - 2)
        rest = (start + int(whole) + part - first) * step
        slope = (filtered[first + 1] - filtered[first]) / step
        increment = velocity[first] + filtered[first] * rest + slope / 2 * rest**2 - velocity[start]
        sums = []
        for sign in (1.0, -1.0):
            places, _ = signal.find_peaks(sign * increment)
            sums.append(float(np.sort(sign * increment[places])[::-1][:PULSES].sum()))
        return max(*sums, 0.0)
