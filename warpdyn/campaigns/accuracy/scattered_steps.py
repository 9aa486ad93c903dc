"""Steps of samples whose period is far below the median period, which chooses the step of a run."""

from __future__ import annotations

import numpy as np

from warpdyn.campaigns.integration.dynamics import Vibration
from warpdyn.campaigns.integration.ensemble import Ensemble
from warpdyn.campaigns.integration.stability_guard import StabilityFindings
from warpdyn.campaigns.integration.time_grid import STEPS_PER_PERIOD
from warpdyn.engine.methods.period_error import accurate_step

LARGEST_PHASE_ERROR = 0.05  # of the first mode at the end of the vibration [rad], and of its growth or decay
# The instant at which a storey yields or meets a stop is known to within a step, so nonlinear samples take at least
# FEWEST_STEPS_OF_NONLINEAR steps in their first period. Steps of sensitive structures (with contact, damage or falling
# strength) are also at most this share of the stable step: most random samples more than 5 % wrong had longer steps.
FEWEST_STEPS_OF_NONLINEAR = 50
SHARE_OF_STABLE_STEP_OF_SENSITIVE = 0.2


def longest_steps(
    run: Ensemble, vibration: Vibration, row: np.ndarray, duration: np.ndarray, *, is_default: bool = False
) -> np.ndarray:
    """Return the longest steps that keep the first mode's error [s], at least those of the default rule.

    Errors of a vibration add up over the run's duration, or until it has decayed by a factor of e. Default steps of
    nonlinear samples have further bounds.

    Args:
        run: The samples.
        vibration: Vibration of their structures.
        row: Places of some structures, shape [...].
        duration: Durations of their runs [s], of the same shape.
        is_default: Whether warpdyn chooses the steps.
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
    """Divide steps that are too long for the period of their sample, or count them for a warning.

    Args:
        run: The samples; their schedule is changed.
        vibration: Vibration of their structures.
        findings: Collects the messages.
        divides: Whether steps are divided; otherwise they are counted.
    """
    schedule = run.schedule
    # First check each structure with the longest step and the longest duration of its samples: the bound falls with the
    # duration. Check single samples only of structures that fail.
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
