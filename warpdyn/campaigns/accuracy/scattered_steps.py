"""Steps of samples whose period is far below the median period: the default step is chosen for the median period."""

from __future__ import annotations

from dataclasses import replace

import numpy as np

from warpdyn.campaigns.integration.dynamics import Vibration
from warpdyn.campaigns.integration.ensemble import Ensemble
from warpdyn.campaigns.integration.model import Model
from warpdyn.campaigns.integration.stability_guard import StabilityFindings
from warpdyn.campaigns.integration.time_grid import STEPS_PER_PERIOD
from warpdyn.engine.methods.period_error import accurate_step

LARGEST_PHASE_ERROR = (
    0.05  # phase error of the first mode at the end of the vibration [rad]; also ln of its amplitude error
)
# The time at which a storey yields or meets a stop is known to within one step, so nonlinear samples have at least
# FEWEST_STEPS_OF_NONLINEAR steps in their first period. In sensitive structures (with contact, damage or falling
# strength) the step is also at most SHARE_OF_STABLE_STEP_OF_SENSITIVE of the stable step: most random samples with
# errors above 5 % had longer steps.
FEWEST_STEPS_OF_NONLINEAR = 50
SHARE_OF_STABLE_STEP_OF_SENSITIVE = 0.2
ROUNDING = 1e-9  # a step that exceeds its bound by this share is not too long: the excess is rounding


def longest_steps(
    model: Model,
    period: np.ndarray,
    decay: np.ndarray,
    stable: np.ndarray,
    duration: np.ndarray,
    *,
    is_default: bool = False,
) -> np.ndarray:
    """Return the longest steps [s] with an acceptable error of the first mode, not below the default steps.

    The phase error of a vibration grows during the run, or until the vibration has decayed by a factor of e. For
    nonlinear samples with default steps, there are further limits.

    Args:
        model: Model of the run, with the integration method.
        period: First periods of the structures [s], of any shape.
        decay: Slowest rates of decay [1/s], of the same shape.
        stable: Longest stable steps [s], of the same shape.
        duration: Durations of the runs [s], of the same shape.
        is_default: Whether warpdyn chooses the steps (not the user).
    """
    with np.errstate(divide="ignore"):
        remembered = np.minimum(duration, 1 / decay)
    bound = accurate_step(model.method, period, remembered / period, LARGEST_PHASE_ERROR)
    bound = np.maximum(bound, period / (STEPS_PER_PERIOD * model.refinement))
    dynamics = model.dynamics
    if is_default and not dynamics.structure.storey_law.has_only_linear_springs:
        bound = np.minimum(bound, period / (FEWEST_STEPS_OF_NONLINEAR * model.refinement))
        if dynamics.is_sensitive:
            bound = np.where(stable > 0, np.minimum(bound, SHARE_OF_STABLE_STEP_OF_SENSITIVE * stable), bound)
    return bound


def shorten_steps(run: Ensemble, vibration: Vibration, findings: StabilityFindings, *, divides: bool) -> None:
    """Divide steps that are too long for the period of their sample; if `divides` is False, only count them.

    Args:
        run: The samples; if `divides`, their schedule is changed.
        vibration: Vibration of their structures.
        findings: Findings on the run, to which too long steps are added; a warning reports their number.
        divides: Whether steps are divided.
    """
    schedule = run.schedule
    # First compare, for each structure, the longest step of its samples with the bound for their longest duration
    # (bounds decrease with the duration). Check single samples only for structures that fail this comparison.
    begins = np.append(0, np.flatnonzero(run.row[1:] != run.row[:-1]) + 1)
    duration = schedule.run_intervals * schedule.substeps * schedule.step
    row, step = run.row[begins], np.maximum.reduceat(schedule.step, begins)

    def longest_of(row: np.ndarray, duration: np.ndarray) -> np.ndarray:
        # A decay that was not computed counts as 0, which gives shorter bounds.
        period, decay, stable = vibration.period[row], np.nan_to_num(vibration.decay[row]), vibration.stable_step[row]
        return longest_steps(run.model, period, decay, stable, duration, is_default=divides)

    bound = longest_of(row, np.maximum.reduceat(duration, begins))
    doubtful = is_too_long(step, bound)
    if not doubtful.any():
        return
    samples = np.flatnonzero(np.repeat(doubtful, np.diff(begins, append=run.row.size)))
    if np.isnan(vibration.decay).any():
        vibration = with_decay(run, vibration, np.unique(run.row[samples]))
    longest = longest_of(run.row[samples], duration[samples])
    long = is_too_long(schedule.step[samples], longest)
    if not long.any():
        return
    samples, longest = samples[long], longest[long]
    if not divides:
        findings.too_long += samples.size
        findings.longest_accurate = min(findings.longest_accurate, float(longest.min()))
        return
    before = schedule.substeps[samples]
    substeps = accurate_substeps(schedule.step[samples], before, longest).astype(np.int64)
    run.schedule = run.restepped(samples, substeps)


def with_decay(run: Ensemble, vibration: Vibration, structures: np.ndarray) -> Vibration:
    """Return the vibration of the structures of a run with the decay of some of them (indices)."""
    model, drawn = run.model, {name: values[structures] for name, values in run.drawn.items()}
    decay = vibration.decay.copy()
    decay[structures] = model.dynamics.vibration_of(drawn, model.method, model.threads).decay
    return replace(vibration, decay=decay)


def is_too_long(step: np.ndarray, longest: np.ndarray) -> np.ndarray:
    """Return which steps [s] exceed the bounds `longest` [s] from `longest_steps`, by more than rounding."""
    return step > longest * (1 + ROUNDING)


def accurate_substeps(step: np.ndarray, substeps: np.ndarray, longest: np.ndarray) -> np.ndarray:
    """Return the smallest numbers of steps per interval with which steps do not exceed `longest` [s], in float64.

    Args:
        step: Present steps [s].
        substeps: Present numbers of steps per interval.
        longest: Longest accurate steps [s].
    """
    return np.ceil(step * substeps / longest * (1 - ROUNDING))
