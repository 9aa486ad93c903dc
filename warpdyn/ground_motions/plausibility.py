"""What is implausible in ground motions: most often the unit of their acceleration or of their step."""

from __future__ import annotations

from collections.abc import Sequence

import numpy as np
from numpy.typing import ArrayLike

from warpdyn.core.plausibility import PlausibilityFindings
from warpdyn.core.units import STANDARD_GRAVITY
from warpdyn.ground_motions.motions import GroundMotion

FEWEST_IN_A_SET = 5  # motions of which one may be told to be the odd one
FEWEST_CROSSINGS = 10  # of a record's baseline, of what is a record
MOST_DRIFT = 8.0  # of the velocity of a baseline over that of the motion about it; of white noise above in 0.2 %


def add_motions(findings: PlausibilityFindings, motions: Sequence[GroundMotion], where: str = "") -> None:
    """Add motions whose step, peak acceleration or baseline is implausible."""
    for index, motion in enumerate(motions):
        named = f" of motion {index} ({motion.name!r}){where}"
        findings.add("record_step", motion.step, named)
        peak = motion.peak_ground_acceleration
        if peak > 0:  # silence is meant
            findings.add("peak_ground_acceleration", peak, named)
            findings.add("record_baseline", baseline_over_peak(motion), named)


def add_weakest_motions(findings: PlausibilityFindings, motions: Sequence[GroundMotion], where: str = "") -> None:
    """Add a few motions of a set that are far weaker than all others, and among these if they were given in g."""
    motions = [motion for motion in motions if motion.peak_ground_acceleration > 0]
    if len(motions) < FEWEST_IN_A_SET:
        return
    ordered = sorted(motions, key=lambda motion: motion.peak_ground_acceleration)
    peaks = np.array([motion.peak_ground_acceleration for motion in ordered])
    few = len(motions) // FEWEST_IN_A_SET
    place = int(np.argmin(peaks[:few] / peaks[1 : few + 1]))
    weak, others = peaks[: place + 1], peaks[place + 1 :]
    if others[0] <= STANDARD_GRAVITY * weak[-1] and STANDARD_GRAVITY * weak[0] <= others[-1]:
        findings.add("weakest_motions", weak[-1] / others[0], f" of motion {ordered[place].name!r}{where}")


def baseline_over_peak(motion: GroundMotion) -> float:
    """Return the peak of a straight line fitted to a record over the record's peak; 0 where no offset explains it.

    An offset makes the velocity drift away: to many times the velocity of what is left without it. Pulses and other
    motions that do not swing about their line have none.
    """
    a = motion.acceleration
    # Places in twice their deviation from the middle: the line's slope and mean are independent.
    place = np.linspace(-1.0, 1.0, a.size)
    line = a.mean() + place * (a @ place) / (place @ place)
    rest = a - line
    if np.count_nonzero(rest[1:] * rest[:-1] < 0) < FEWEST_CROSSINGS:
        return 0.0
    drift, swing = np.abs(np.cumsum(line)).max(), np.abs(np.cumsum(rest)).max()
    return float(np.abs(line).max() / motion.peak_ground_acceleration) if drift > MOST_DRIFT * swing else 0.0


def warn_of_implausible_motions(motions: Sequence[GroundMotion], periods: ArrayLike = ()) -> None:
    """Give one warning of motions whose step or peak acceleration is implausible, and of periods of their spectrum."""
    findings = PlausibilityFindings()
    add_motions(findings, motions)
    add_weakest_motions(findings, motions)
    for period in np.asarray(periods, dtype=np.float64):
        findings.add("measure_period", period)
    findings.warn()
