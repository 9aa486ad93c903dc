"""Steps of samples whose period is far below that of the middle of the scatter, which chooses the step of a run."""

from __future__ import annotations

import numpy as np

from warpdyn.campaigns.integration.dynamics import Vibration
from warpdyn.campaigns.integration.ensemble import Ensemble
from warpdyn.campaigns.integration.stability_guard import StabilityFindings
from warpdyn.campaigns.integration.time_grid import STEPS_PER_PERIOD
from warpdyn.engine.methods.period_error import accurate_step

LARGEST_PHASE_ERROR = 0.05  # radians of the first mode at the end of the vibration, and of its growth or decay
# The instant at which a storey yields or meets a stop is known to a step: nonlinear samples take at least so many steps
# in their first period. Samples of sensitive structures (with contact, damage or falling strength) take at most this
# share of their stable step, too: most of the random samples that were more than 5 % wrong had longer steps.
FEWEST_STEPS_OF_NONLINEAR = 50
SHARE_OF_STABLE_STEP_OF_SENSITIVE = 0.2


def longest_steps(
    run: Ensemble, vibration: Vibration, row: np.ndarray, duration: np.ndarray, *, is_default: bool = False
) -> np.ndarray:
    """Return the longest steps that keep the first mode's error [s], never below the default rule's.

    A vibration is remembered for the run's duration, or until it has decayed by e: what is older does not add up.
    Default steps of nonlinear samples have further bounds.

    Args:
        run: The samples.
        vibration: Vibration of their structures.
        row: Places of some structures, shape [...].
        duration: Durations that these run for [s], of the same shape.
        is_default: Whether the caller left the steps to warpdyn.
    """
    period, decay = vibration.period[row], vibration.decay[row]
    with np.errstate(divide="ignore"):
        remembered = np.minimum(duration, 1 / decay)
    bound = accurate_step(run.model.method, period, remembered / period, LARGEST_PHASE_ERROR)
    bound = np.maximum(bound, period / (STEPS_PER_PERIOD * run.model.refinement))
    dynamics = run.model.dynamics
    if is_default and not dynamics.structure.storey_law.has_only_linear_springs:
        bound = np.minimum(bound, period / (FEWEST_STEPS_OF_NONLINEAR * run.model.refinement))
        stable = vibration.stable_step[row]
        if dynamics.is_sensitive:
            bound = np.where(stable > 0, np.minimum(bound, SHARE_OF_STABLE_STEP_OF_SENSITIVE * stable), bound)
    return bound


def shorten_steps(run: Ensemble, vibration: Vibration, findings: StabilityFindings, *, divides: bool) -> None:
    """Divide the steps that are too long for their own sample's period, or count them for a warning.

    Args:
        run: The samples; their schedule is changed.
        vibration: Vibration of their structures.
        findings: Collects the messages.
        divides: Whether steps are divided; otherwise they are told of.
    """
    schedule = run.schedule
    # Most structures keep the error at the longest of their samples' steps for the longest of the durations, and the
    # bound falls with the duration: only samples of the others are looked at one by one.
    begins = np.append(0, np.flatnonzero(run.row[1:] != run.row[:-1]) + 1)
    duration = schedule.run_intervals * schedule.substeps * schedule.step
    row, step = run.row[begins], np.maximum.reduceat(schedule.step, begins)
    bound = longest_steps(run, vibration, row, np.maximum.reduceat(duration, begins), is_default=divides)
    doubtful = step > bound * (1 + 1e-9)
    if not doubtful.any():
        return
    samples = np.flatnonzero(np.repeat(doubtful, np.diff(begins, append=run.row.size)))
    longest = longest_steps(run, vibration, run.row[samples], duration[samples], is_default=divides)
    long = schedule.step[samples] > longest * (1 + 1e-9)
    if not long.any():
        return
    samples, longest = samples[long], longest[long]
    if not divides:
        findings.too_long += samples.size
        findings.longest_accurate = min(findings.longest_accurate, float(longest.min()))
        return
    before = schedule.substeps[samples]
    substeps = np.ceil(schedule.step[samples] * before / longest * (1 - 1e-9)).astype(np.int64)
    run.schedule = run.restepped(samples, substeps)
