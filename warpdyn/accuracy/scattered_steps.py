"""Steps of samples whose period is far below that of the middle of the scatter, which chooses the step of a run."""

from __future__ import annotations

import numpy as np

from warpdyn.integration.dynamics import Vibration
from warpdyn.integration.ensemble import Ensemble
from warpdyn.integration.stability_guard import StabilityFindings
from warpdyn.integration.time_grid import STEPS_PER_PERIOD
from warpdyn.methods.period_error import accurate_step

LARGEST_PHASE_ERROR = 0.05  # radians of the first mode at the end of the vibration, and of its growth or decay


def longest_steps(run: Ensemble, vibration: Vibration) -> np.ndarray:
    """Return the longest step of each sample that keeps the first mode's error [s], never below the default rule's.

    A vibration is remembered for the run's duration, or until it has decayed by e: what is older does not add up.

    Args:
        run: The samples.
        vibration: Vibration of their structures.
    """
    period, decay = vibration.period[run.row], vibration.decay[run.row]
    schedule = run.schedule
    duration = schedule.run_intervals * schedule.substeps * schedule.step
    with np.errstate(divide="ignore"):
        remembered = np.minimum(duration, 1 / decay)
    bound = accurate_step(run.model.method, period, remembered / period, LARGEST_PHASE_ERROR)
    return np.maximum(bound, period / STEPS_PER_PERIOD)


def shorten_steps(run: Ensemble, vibration: Vibration, findings: StabilityFindings, *, divides: bool) -> None:
    """Divide the steps that are too long for their own sample's period, or count them for a warning.

    Args:
        run: The samples; their schedule is changed.
        vibration: Vibration of their structures.
        findings: Collects the messages.
        divides: Whether steps are divided; otherwise they are told of.
    """
    longest = longest_steps(run, vibration)
    long = run.schedule.step > longest * (1 + 1e-9)
    if not long.any():
        return
    count = np.count_nonzero(long)
    if not divides:
        findings.too_long += int(count)
        findings.longest_accurate = min(findings.longest_accurate, float(longest[long].min()))
        return
    samples = np.flatnonzero(long)
    before = run.schedule.substeps[samples]
    substeps = np.ceil(run.schedule.step[samples] * before / longest[samples] * (1 - 1e-9)).astype(np.int64)
    run.schedule = run.restepped(samples, substeps)
