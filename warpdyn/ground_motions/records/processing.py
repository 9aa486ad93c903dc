"""What is mostly done to a record before it is used: detrend, filter and trim it."""

from __future__ import annotations

from dataclasses import replace

import numpy as np

from warpdyn.core.checks import check_kind, one_of, real_number, whole_number
from warpdyn.core.near_misses import suggests_names
from warpdyn.ground_motions.excitation import check_sample_count
from warpdyn.ground_motions.motion_integrals import squared_integrals
from warpdyn.ground_motions.motions import GroundMotion

HIGHEST_ORDER = 20  # of a Butterworth filter, whose sections lose digits beyond it


@suggests_names
def detrend(motion: GroundMotion, trend: str = "linear") -> GroundMotion:
    """Return a motion without its mean or its straight line of least squares.

    Args:
        motion: The motion.
        trend: "constant" or "linear".

    Raises:
        ValueError: If the trend is another word.
        TypeError: If `motion` is no GroundMotion.

    Example:
        >>> motion = wd.GroundMotion(noise[0] + 0.1, 0.02)
        >>> round(abs(float(wd.records.detrend(motion, "constant").acceleration.mean())), 9)
        0.0
    """
    check_kind("detrend", "a GroundMotion", motion, GroundMotion, argument="motion")
    from scipy import signal  # which takes half a second to import

    one_of("trend", trend, ("constant", "linear"))
    return replace(motion, acceleration=signal.detrend(motion.acceleration, type=trend))


@suggests_names
def band_pass(motion: GroundMotion, lowest: float, highest: float, order: int = 4) -> GroundMotion:
    """Return a motion filtered forth and back, without a shift of phase, by a Butterworth band-pass.

    The motion is taken as zero before its start and after its end, for 1.5 orders divided by the lowest frequency, and
    what the filter leaves there is cut off again. Source: Boore and Bommer (2005), "Processing of strong-motion
    accelerograms: needs, options and consequences".

    Args:
        motion: The motion, best without its trend.
        lowest: Lower corner [Hz].
        highest: Upper corner [Hz], below half the sampling frequency.
        order: Order of the filter in each direction; the gain at the corners is 1/2.

    Raises:
        ValueError: Unless 0 < lowest < highest < 1 / (2 step), and the order is a whole number of at least 1.
        TypeError: If `motion` is no GroundMotion.

    Example:
        >>> filtered = wd.records.band_pass(wd.records.detrend(motions[0]), lowest=0.2, highest=20.0)  # Hz
        >>> len(filtered.acceleration) == len(motions[0].acceleration)
        True
    """
    check_kind("band_pass", "a GroundMotion", motion, GroundMotion, argument="motion")
    from scipy import signal  # which takes half a second to import

    half = 0.5 / motion.step
    real_number("lowest [Hz]", lowest, above=0)
    real_number("highest [Hz]", highest, above=0)
    if not lowest < highest < half:
        raise ValueError(
            f"motion {motion.name!r}: corners must be 0 < lowest < highest < {half:g} Hz (half the sampling "
            f"frequency), got {lowest:g} and {highest:g} Hz"
        )
    order = whole_number("order", order, 1, HIGHEST_ORDER)
    pad = np.ceil(1.5 * order / lowest / motion.step)
    check_sample_count(
        f"lowest={lowest:g} Hz with pads of 1.5 orders over it", 2 * pad, "choose a corner that the record holds"
    )
    pad = int(pad)
    sections = signal.butter(order, (lowest, highest), "bandpass", fs=1 / motion.step, output="sos")
    filtered = signal.sosfiltfilt(sections, np.pad(motion.acceleration, pad), padtype=None)
    return replace(motion, acceleration=filtered[pad:-pad])


@suggests_names
def trim(motion: GroundMotion, start: float = 0.05, end: float = 0.95, pad: float = 0.0) -> GroundMotion:
    """Return the part of a motion between two shares of its Arias intensity, with some time before and after.

    Args:
        motion: The motion.
        start: Share of the Arias intensity at which the part starts [1].
        end: Share at which it ends [1].
        pad: Time that is kept before and after it [s], as far as the record goes.

    Raises:
        ValueError: Unless 0 < start < end < 1 and the pad is at least 0, or if the motion is zero throughout.
        TypeError: If `motion` is no GroundMotion.

    Example:
        >>> strong = wd.records.trim(motions[0], start=0.05, end=0.95, pad=0.5)
        >>> round(strong.duration, 2), round(motions[0].duration, 2)
        (4.08, 9.98)
    """
    check_kind("trim", "a GroundMotion", motion, GroundMotion, argument="motion")
    real_number("start", start, above=0)
    real_number("end", end, above=0)
    real_number("pad [s]", pad, least=0)
    if not start < end < 1:
        raise ValueError(f"shares of the Arias intensity must be 0 < start < end < 1, got {start:g} and {end:g}")
    total = np.concatenate([[0.0], np.cumsum(squared_integrals(motion.acceleration, motion.step))])
    if not total[-1] > 0:
        raise ValueError(f"motion {motion.name!r} is zero throughout, and has no Arias intensity")
    first = int(np.searchsorted(total, start * total[-1], side="right")) - 1
    last = int(np.searchsorted(total, end * total[-1]))
    samples = int(np.ceil(pad / motion.step - 1e-9))
    return replace(motion, acceleration=motion.acceleration[max(0, first - samples) : last + samples + 1])
