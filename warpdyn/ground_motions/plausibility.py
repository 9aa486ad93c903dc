"""What is implausible in ground motions: most often the unit of their acceleration or of their step."""

from __future__ import annotations

from collections.abc import Sequence

import numpy as np
from numpy.typing import ArrayLike

from warpdyn.core.plausibility import Findings
from warpdyn.ground_motions.motions import GroundMotion


def add_motions(findings: Findings, motions: Sequence[GroundMotion], where: str = "") -> None:
    """Add motions whose step or peak acceleration is implausible."""
    for index, motion in enumerate(motions):
        named = f" of motion {index} ({motion.name!r}){where}"
        findings.add("record_step", motion.step, named)
        peak = motion.peak_ground_acceleration
        if peak > 0:  # silence is meant
            findings.add("peak_ground_acceleration", peak, named)


def warn_of_implausible_motions(motions: Sequence[GroundMotion], periods: ArrayLike = ()) -> None:
    """Give one warning of motions whose step or peak acceleration is implausible, and of periods of their spectrum."""
    findings = Findings()
    add_motions(findings, motions)
    for period in np.asarray(periods, dtype=np.float64):
        findings.add("measure_period", period)
    findings.warn()
