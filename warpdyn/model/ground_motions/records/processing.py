"""Processing of records: detrending, band-pass filter and trimming."""

from __future__ import annotations

from dataclasses import replace
from functools import lru_cache

import numpy as np

from warpdyn.foundations.core.checks import check_kind, one_of, real_number, whole_number
from warpdyn.foundations.core.messages import warn_caller
from warpdyn.foundations.core.near_misses import suggests_names
from warpdyn.model.ground_motions.excitation import check_sample_count
from warpdyn.model.ground_motions.measures.integrals import squared_integrals
from warpdyn.model.ground_motions.motions import GroundMotion

HIGHEST_ORDER = 20  # rounding makes Butterworth filters of a higher order inaccurate
AT_REST = 1e-3  # the ground is at rest if the velocity at the end is at most this share of the peak velocity
PERIODS = np.geomspace(0.1, 10.0, 21)  # s; periods at which `trim` compares spectra
LARGEST_CHANGE = 0.05  # relative change of a spectral displacement above which `trim` warns


@suggests_names
def detrend(motion: GroundMotion, trend: str = "linear") -> GroundMotion:
    """Return a motion without its mean or its least-squares straight line.

    Args:
        motion: The motion.
        trend: "constant" or "linear".

    Raises:
        ValueError: If `trend` is neither "constant" nor "linear".
        TypeError: If `motion` is not a GroundMotion.

    Example:
        >>> motion = wd.GroundMotion(noise[0] + 0.1, 0.02)
        >>> round(abs(float(wd.records.detrend(motion, "constant").acceleration.mean())), 9)
        0.0
    """
    check_kind("detrend", "a GroundMotion", motion, GroundMotion, argument="motion")
    from scipy import signal  # imported here, because the import takes half a second

    one_of("trend", trend, ("constant", "linear"))
    return replace(motion, acceleration=signal.detrend(motion.acceleration, type=trend))


@suggests_names
def band_pass(motion: GroundMotion, lowest: float, highest: float, order: int = 4) -> GroundMotion:
    """Return a motion after a Butterworth band-pass filter, applied forward and backward, without phase shift.

    Zeros are added before the start and after the end, for `1.5 * order / lowest` seconds each (padding). The result
    includes the padding, because the filtered motion extends into it. Without the padding, the ground motion would
    start with a jump, and the ground would not come to rest. `trim` shortens the result and leaves the ground at rest.

    Source: Boore and Bommer (2005), "Processing of strong-motion accelerograms: needs, options and consequences"; on
    the padding, Boore (2005), "On pads and filters: processing strong-motion data", BSSA 95(2).

    Args:
        motion: The motion, preferably after `detrend`.
        lowest: Lower corner [Hz].
        highest: Upper corner [Hz], below half the sampling frequency.
        order: Order of the filter in each direction; the gain at the corners is 1/2 in total.

    Raises:
        ValueError: Unless 0 < lowest < highest < 1 / (2 step), and the order is a whole number of at least 1.
        TypeError: If `motion` is not a GroundMotion.

    Example:
        >>> filtered = wd.records.band_pass(wd.records.detrend(motions[0]), lowest=0.2, highest=20.0)  # Hz
        >>> round(filtered.duration - motions[0].duration, 2)  # 1.5 * 4 / 0.2 Hz before it and after it
        60.0
    """
    check_kind("band_pass", "a GroundMotion", motion, GroundMotion, argument="motion")
    from scipy import signal  # imported here, because the import takes half a second

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
    check_sample_count(f"the padding for lowest={lowest:g} Hz", 2 * pad, "give a larger lowest=")
    sections = signal.butter(order, (lowest, highest), "bandpass", fs=1 / motion.step, output="sos")
    return replace(
        motion, acceleration=signal.sosfiltfilt(sections, np.pad(motion.acceleration, int(pad)), padtype=None)
    )


@suggests_names
def trim(
    motion: GroundMotion, start: float = 0.05, end: float = 0.95, pad: float = 0.0, taper: float = 5.0
) -> GroundMotion:
    """Return the strong part of a motion, with tapers before and after it, so that the ground is at rest at both ends.

    The strong part starts when the Arias intensity or the integral of the squared velocity reaches the fraction `start`
    of its final value, whichever is earlier. It ends when both have reached the fraction `end`. (The Arias intensity
    alone would cut off long-period waves.) Before and after this part, the velocity is multiplied by a factor that
    decreases smoothly to 0. If the ground is moving at the end of the record, the taper continues after the end. The
    acceleration in the strong part is unchanged.

    A warning is given if the spectral displacement (5 % damping) changes by more than 5 % at a period of 0.1 to 10 s.

    Args:
        motion: The motion, preferably after `band_pass`, because a drift of the velocity counts as motion.
        start: Fraction at which the part starts [1].
        end: Fraction at which the part ends [1].
        pad: Time before and after the part that is kept unchanged [s], within the record.
        taper: Length of the taper at each end [s].

    Raises:
        ValueError: Unless 0 < start < end < 1, the pad is at least 0 and the taper is longer than two steps; if the
            taper makes too many samples; if the motion is zero throughout.
        TypeError: If `motion` is not a GroundMotion.

    Example:
        >>> strong = wd.records.trim(wd.records.band_pass(motions[0], 0.2, 20.0), end=0.99)
        >>> velocity = np.cumsum(strong.acceleration) * strong.step
        >>> bool(abs(velocity[-1]) < 1e-3 * abs(velocity).max())
        True
    """
    check_kind("trim", "a GroundMotion", motion, GroundMotion, argument="motion")
    real_number("start", start, above=0)
    real_number("end", end, above=0)
    real_number("pad [s]", pad, least=0)
    real_number("taper [s]", taper, above=2 * motion.step)
    if not start < end < 1:
        raise ValueError(f"fractions of the Arias intensity must be 0 < start < end < 1, got {start:g} and {end:g}")
    a, h = motion.acceleration, motion.step
    check_sample_count(f"taper={taper:g} s", a.size + 2 * np.ceil(taper / h), "give a shorter taper= in seconds")
    if not a.any():
        raise ValueError(f"motion {motion.name!r} is zero throughout, so it has no strong part: remove the motion")
    velocity = np.concatenate([[0.0], np.cumsum(h / 2 * (a[:-1] + a[1:]))])
    parts = [_between(values, h, start, end) for values in (a, velocity) if values.any()]
    samples, fade = int(np.ceil(pad / h - 1e-9)), int(np.ceil(taper / h - 1e-9))
    first = max(0, min(part[0] for part in parts) - samples)
    last = min(a.size - 1, max(part[1] for part in parts) + samples)

    # No taper is needed at an end of the record that is closer than the taper, unless the ground moves at the end.
    begin = first - fade if first > fade else 0
    ends_at_rest = abs(velocity[-1]) <= AT_REST * np.abs(velocity).max()
    stop = a.size - 1 if ends_at_rest and last + fade >= a.size - 1 else last + fade
    beyond = max(0, stop - (a.size - 1))
    a, velocity = np.pad(a, (0, beyond)), np.pad(velocity, (0, beyond), mode="edge")
    factor, slope = np.ones(a.size), np.zeros(a.size)
    if begin:
        factor[begin : first + 1], slope[begin : first + 1] = _rise(fade)
    if stop == last + fade:
        falling = _rise(fade)
        factor[last : stop + 1], slope[last : stop + 1] = falling[0][::-1], -falling[1][::-1]
    tapered = (factor * a + slope / h * velocity)[begin : stop + 1]
    if stop == last + fade:
        # The velocity is integrated numerically, so that a velocity of the order of the squared step remains at the
        # end. Remove it within the last taper.
        bump = np.sin(np.linspace(0.0, np.pi, fade + 1)) ** 2
        tapered[-fade - 1 :] -= bump * (tapered.sum() - 0.5 * (tapered[0] + tapered[-1])) / bump.sum()
    trimmed = replace(motion, acceleration=tapered)
    _warn_of_changed_spectrum(motion, trimmed)
    return trimmed


def _between(values: np.ndarray, step: float, start: float, end: float) -> tuple[int, int]:
    """Return the indices of the first and the last sample of the strong part of a motion.

    The strong part is bounded by the samples before the integral of squared values reaches the fraction `start` of its
    final value, and after it reaches the fraction `end`.
    """
    total = np.concatenate([[0.0], np.cumsum(squared_integrals(values / np.abs(values).max(), step))])
    first = int(np.searchsorted(total, start * total[-1], side="right")) - 1
    return first, int(np.searchsorted(total, end * total[-1]))


def _rise(samples: int) -> tuple[np.ndarray, np.ndarray]:
    """Return a factor that rises smoothly from 0 to 1 within `samples` steps, and its slope per step.

    Both arrays have the shape [samples + 1]; the first two derivatives of the factor are continuous.
    """
    x = np.linspace(0.0, 1.0, samples + 1)
    return x**3 * (10 - 15 * x + 6 * x**2), 30 * x**2 * (1 - x) ** 2 / samples


def _warn_of_changed_spectrum(before: GroundMotion, after: GroundMotion) -> None:
    change = spectral_displacements(after, PERIODS) / spectral_displacements(before, PERIODS) - 1
    if np.abs(change).max() > LARGEST_CHANGE:
        worst, first = int(np.abs(change).argmax()), int(np.argmax(np.abs(change) > LARGEST_CHANGE))
        warn_caller(
            f"motion {before.name!r}: trim changes the spectral displacement by {change[worst]:+.0%} at a period of "
            f"{PERIODS[worst]:.2g} s, and by more than {LARGEST_CHANGE:.0%} from {PERIODS[first]:.2g} s on: if such "
            "periods matter, keep a longer part, such as end=0.99, or give a longer taper= or pad="
        )


def spectral_displacements(motion: GroundMotion, periods: np.ndarray) -> np.ndarray:
    """Return spectral displacements for 5 % damping [m], shape [period]; the largest value at a sample is used.

    The response continues for one period after the end of the motion.
    """
    from scipy import signal  # imported here, because the import takes half a second

    peaks = []
    for period in periods.tolist():
        after = np.zeros(int(np.ceil(period / motion.step)))
        response = signal.lfilter(*_oscillator(period, motion.step), np.r_[motion.acceleration, after])
        peaks.append(np.abs(response).max())
    return np.array(peaks)


@lru_cache(maxsize=1000)
def _oscillator(period: float, step: float) -> tuple[np.ndarray, np.ndarray]:
    """Return the coefficients of the difference equation of an oscillator with 5 % damping.

    The ground acceleration is linear between samples. The coefficients are arguments of `scipy.signal.lfilter`.
    """
    from scipy import signal  # imported here, because the import takes half a second

    w = 2 * np.pi / period
    above, below, _ = signal.cont2discrete(([-1.0], [1.0, 0.1 * w, w**2]), step, method="foh")
    return above.ravel(), below
