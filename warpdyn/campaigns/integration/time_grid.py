"""The time grid of a run: steps that divide the step of each motion, and the free vibration after the motion."""

from __future__ import annotations

from collections.abc import Callable, Sequence
from dataclasses import dataclass, replace
from typing import Any

import numpy as np

from warpdyn.campaigns.integration.dynamics import Vibration
from warpdyn.foundations.core.checks import real_number
from warpdyn.foundations.core.messages import warn_caller
from warpdyn.model.ground_motions.excitation import MOST_STEPS, Assignment, Timeline
from warpdyn.model.scene.scene import Scene

# Default number of steps per first period and per period of a harmonic load; fraction of the stability limit that the
# default step may use.
STEPS_PER_PERIOD = 100
SHARE_OF_STABLE_STEP = 0.4
# Free vibration is integrated until it has decayed to RESIDUAL_DECAY, for at most LONGEST_DECAY_IN_PERIODS periods;
# then the residual drift is averaged over RESIDUAL_PERIODS more periods.
RESIDUAL_DECAY = 0.01
LONGEST_DECAY_IN_PERIODS = 20.0
RESIDUAL_PERIODS = 3.0


@dataclass(frozen=True, eq=False)
class Schedule:
    """Integration steps and duration of samples, with one value for each sample.

    Args:
        run_intervals: Number of intervals of the motion and of the free vibration after it, shape [sample].
        substeps: Number of integration steps per interval, shape [sample].
        step: Integration step [s], shape [sample].
        residual_steps: Number of steps at the end over which the residual drift is averaged, shape [sample].
        repeats: Size of groups of consecutive samples with the same structure, motion and schedule; all groups have
            this size.
    """

    run_intervals: np.ndarray
    substeps: np.ndarray
    step: np.ndarray
    residual_steps: np.ndarray
    repeats: int = 1

    @property
    def columns(self) -> tuple[np.ndarray, ...]:
        """The four arrays with one value for each sample, in the order of the arguments."""
        return self.run_intervals, self.substeps, self.step, self.residual_steps

    def select(self, samples: np.ndarray) -> Schedule:
        """Return the schedule of the given samples (indices)."""
        run_intervals, substeps, step, residual_steps = (column[samples] for column in self.columns)
        return Schedule(run_intervals, substeps, step, residual_steps)

    @staticmethod
    def joined(parts: Sequence[Schedule]) -> Schedule:
        """Return one schedule that contains the samples of several schedules, one after the other."""
        columns = [np.concatenate(column) for column in zip(*(part.columns for part in parts), strict=True)]
        return Schedule(columns[0], columns[1], columns[2], columns[3])

    def with_substeps(self, samples: np.ndarray, substeps: np.ndarray) -> Schedule:
        """Return a schedule with new numbers of steps per interval for the given samples; durations do not change."""
        every, step, residual = self.substeps.copy(), self.step.copy(), self.residual_steps.copy()
        finer = substeps / self.substeps[samples]
        every[samples] = substeps
        step[samples], residual[samples] = divided(self.step[samples], self.residual_steps[samples], finer)
        return Schedule(self.run_intervals, every, step, residual)


def default_step(central: Vibration, share: float = 1.0) -> float:
    """Return the default step [s] from the vibration of the structure with median parameters.

    Args:
        central: Vibration of the structure with median parameters.
        share: Share of the step of the general rule that the structure takes; see Dynamics.share_of_default_step.
    """
    step = float(central.period[0]) / STEPS_PER_PERIOD
    if central.stable_step[0] > 0:  # if no step is stable, the stability guard raises an error later
        step = min(step, SHARE_OF_STABLE_STEP * float(central.stable_step[0]))
    return share * step


def build_timeline(
    scene: Scene,
    central: Callable[[], Vibration],
    step: float | None = None,
    longest_step: float | None = None,
    resample: bool = False,
    refinement: int = 1,
    share: float = 1.0,
) -> Timeline:
    """Return the time grid of a scene's motions: intervals, and integration steps per interval, for each motion.

    Args:
        scene: The scene.
        central: Function that returns the vibration of the structure with median parameters. The default step depends
            only on this structure, so that it does not depend on the number of samples.
        step: Integration step [s] that divides the step of every motion; None: chosen for each motion.
        longest_step: Upper bound of the chosen steps [s]; None: the default step.
        resample: Whether motions whose step is not a multiple of `step` are resampled at `step`.
        refinement: Number of integration steps that replace each step chosen by these rules.
        share: Share of the step of the general rule that is the default step; see Dynamics.share_of_default_step.

    Raises:
        ValueError: If a step is not finite and positive, or does not divide a motion's step or the duration.
    """
    if step is not None and longest_step is not None:
        raise ValueError("step= and longest_step= cannot be combined: remove step= or longest_step=")
    if scene.control is not None and not (resample and step is not None):  # before `central` compiles a kernel
        scene.control.samplings_per_interval(np.array([motion.step for motion in scene.excitation.motions]))
    if step is not None:
        target = step = real_number("step [s]", step, above=0)
    elif longest_step is not None:
        target = real_number("longest_step [s]", longest_step, above=0)
    else:
        target = default_step(central(), share)
    if scene.control is not None:
        target = _step_of_control(scene, target, is_given=step is not None)
    excitation = scene.excitation
    if resample and step is None:
        raise ValueError(
            "resample needs step=, the step at which the motions are resampled: give step= [s], or remove resample"
        )
    if resample and not excitation.motions:
        raise ValueError("resample needs sampled motions or forces, which this scene does not have: remove resample")
    if excitation.forcing_frequency and longest_step is None:
        target = min(target, 2 * np.pi / abs(excitation.forcing_frequency) / STEPS_PER_PERIOD)
    if resample and step is not None:
        skipped = sum(step > motion.step * (1 + 1e-6) for motion in excitation.motions)
        if skipped:
            warn_caller(
                f"at {step:g} s, {skipped} of {len(excitation.motions)} motions are resampled at less than their own "
                f"rate, without a filter: their frequencies above {0.5 / step:.3g} Hz appear as lower ones, and peak "
                "drifts may be several times too large or too small. Give a smaller step=, remove step= and resample=, "
                "or filter the motions before, with records.band_pass"
            )
    if scene.floor_spectra is not None:
        target = min(target, scene.floor_spectra.longest_step)
    timeline = excitation.timeline(step, target, resample=resample)
    timeline = timeline if refinement == 1 else replace(timeline, substeps=refinement * timeline.substeps)
    return timeline if scene.control is None else replace(timeline, substeps=_sampled_substeps(scene, timeline, step))


def _step_of_control(scene: Scene, target: float, *, is_given: bool) -> float:
    """Return the step [s] that a controlled scene takes at most; raise a ValueError if a given step is not stable."""
    assert scene.control is not None
    stable = scene.control.stable_step(scene.structure)
    if is_given and target > stable:
        raise ValueError(
            f"step={target:g} s is beyond the stability limit of the actuators of the control, {stable:.3g} s: give a "
            "shorter step, or remove step="
        )
    return target if is_given else min(target, SHARE_OF_STABLE_STEP * stable)


def _sampled_substeps(scene: Scene, timeline: Timeline, step: float | None) -> np.ndarray:
    """Return numbers of steps per interval such that the sampling instants of the control are ends of steps."""
    assert scene.control is not None
    each = np.maximum(scene.control.samplings_per_interval(timeline.interval), 1).astype(timeline.substeps.dtype)
    substeps = -(-timeline.substeps // each) * each
    if step is not None and (substeps != timeline.substeps).any():
        raise ValueError(
            f"step={step:g} s does not divide the sampling interval of the control, "
            f"{scene.control.sampling_interval:g} s: give a step that does, or remove step="
        )
    return substeps


def steps_of_sampling(scene: Scene, interval: np.ndarray, substeps: np.ndarray) -> np.ndarray:
    """Return the number of integration steps in a sampling interval of the control, shape [sample].

    Args:
        scene: The scene.
        interval: Sampling steps of the motions of the samples [s].
        substeps: Numbers of integration steps in them.
    """
    assert scene.control is not None
    return np.round(substeps / scene.control.samplings_per_interval(interval)).astype(np.int32)


def warn_of_short_tail(scene: Scene, longest_period: float) -> None:
    """Warn if a scene's tail (time of free vibration after the motion) is shorter than the longest period [s]."""
    is_read = "residual" in scene.recorders and scene.excitation.motions
    if scene.tail is None or not is_read or scene.tail >= longest_period:
        return
    warn_caller(
        f"a tail of {scene.tail:g} s is shorter than the first period, {longest_period:.3g} s: the building "
        "still vibrates when its residual drift is recorded. Remove `tail`, or remove 'residual' from `recorders`"
    )


def build_schedule(
    scene: Scene,
    timeline: Timeline,
    vibration: Vibration,
    assignment: Assignment,
    row: np.ndarray,
    comes_to_rest: bool = False,
) -> Schedule:
    """Return the schedule of samples: their steps, their durations, and the time over which residual drift is averaged.

    Args:
        scene: The scene.
        timeline: Time grid of each motion.
        vibration: Vibration of each drawn structure.
        assignment: Structure and motion of each sample.
        row: Index of each sample's structure in `vibration`, shape [sample].
        comes_to_rest: Whether free vibration is integrated until rest even if no residual drift is recorded.

    Raises:
        ValueError: If a sample would take more steps than MOST_STEPS.
    """
    # Compute values once for consecutive samples with the same structure and motion. If all structures have the same
    # motions, compute values that depend only on the motion once for each motion.
    structure, motion = row[:: assignment.repeats], assignment.motion[:: assignment.repeats]
    shared = len(motions_of_all(structure, motion))
    rows: Any = structure
    if shared:
        rows, motion = structure[::shared, None], motion[:shared]
    interval, substeps = timeline.interval[motion], timeline.substeps[motion]
    tail, window = tail_of(scene, vibration.period[rows], vibration.decay[rows], comes_to_rest)
    run = intervals_with_tail(timeline.intervals[motion], tail, interval)
    steps = run * substeps
    if steps.max() >= MOST_STEPS:
        raise ValueError(
            f"a sample would take {steps.max():.3g} steps, but at most {MOST_STEPS} can be counted: "
            "give a longer step= or a smaller Scene(tail=...)"
        )
    step = interval / substeps
    residual_steps = np.ones(1)  # used only if residual drifts are recorded
    if "residual" in scene.recorders:
        residual_steps = steps_of_window(window, step, steps)
    values = run.astype(np.int32), substeps.astype(np.int32), step, residual_steps.astype(np.int32)
    columns = [np.broadcast_to(column, run.shape).ravel() for column in values]
    if assignment.repeats > 1:
        columns = [np.repeat(column, assignment.repeats) for column in columns]
    return Schedule(columns[0], columns[1], columns[2], columns[3], assignment.repeats)


def durations_need_decay(scene: Scene) -> bool:
    """Return whether `tail_of` reads the decay of structures, in at least one event."""
    is_read = "residual" in scene.recorders or len(scene.excitation.event_names) > 1
    return is_read and scene.excitation.has_tail and scene.tail is None


def tail_of(
    scene: Scene, period: np.ndarray, decay: np.ndarray, comes_to_rest: bool = False
) -> tuple[np.ndarray, np.ndarray]:
    """Return two times [s]: of the free vibration after a motion, and of the average that gives the residual drift.

    Args:
        scene: The scene.
        period: First periods of structures [s], of any shape.
        decay: Slowest rates of decay of these structures [1/s], of the same shape.
        comes_to_rest: Whether free vibration is integrated until rest even if no residual drift is recorded.
    """
    window = RESIDUAL_PERIODS * period
    if not scene.excitation.has_tail:
        return np.zeros_like(period), window
    if scene.tail is not None:
        tail = np.full_like(period, scene.tail)
        return tail, np.minimum(window, np.maximum(tail, period))
    if "residual" in scene.recorders or comes_to_rest:
        with np.errstate(divide="ignore"):
            decayed = np.log(1 / RESIDUAL_DECAY) / decay
        return np.minimum(decayed, LONGEST_DECAY_IN_PERIODS * period) + window, window
    return period, window  # one period, because the peak may occur shortly after the motion's end


def intervals_with_tail(intervals: np.ndarray, tail: np.ndarray, interval: np.ndarray) -> np.ndarray:
    """Return the numbers of intervals of motions including the free vibration after them, in float64.

    Args:
        intervals: Number of intervals of each motion.
        tail: Time of free vibration after each motion [s].
        interval: Length of an interval of each motion [s].
    """
    return intervals + np.ceil(tail / interval * (1 - 1e-9))


def steps_of_window(window: np.ndarray, step: np.ndarray, steps: np.ndarray) -> np.ndarray:
    """Return the numbers of steps over which residual drifts are averaged (1 to `steps`), in float64.

    Args:
        window: Time of the average [s].
        step: Integration steps [s].
        steps: Numbers of steps of the samples.
    """
    return np.clip(np.round(window / step), 1, steps)


def divided(step: np.ndarray, residual_steps: np.ndarray, factor: np.ndarray) -> tuple[np.ndarray, np.ndarray]:
    """Return the steps [s] divided by `factor`, and the numbers of steps of the residual drift times `factor`."""
    return step / factor, np.maximum(np.round(residual_steps * factor), 1)


def stable_substeps(step: np.ndarray, substeps: np.ndarray, longest: np.ndarray) -> np.ndarray:
    """Return the smallest numbers of steps per interval that are stable, in float64, shape [sample].

    Args:
        step: Present step of each sample [s].
        substeps: Present number of steps per interval of each sample.
        longest: Longest stable step of each sample [s].
    """
    return np.ceil(step * substeps / longest * (1 - 1e-12))


def motions_of_all(structure: np.ndarray, motion: np.ndarray) -> np.ndarray:
    """Return the motions of one structure if all structures have the same motions in the same order; otherwise empty.

    Args:
        structure: Index of each sample's structure, shape [sample].
        motion: Motion of each sample, shape [sample].
    """
    count = int(np.argmax(structure != structure[0])) or structure.size  # samples of the first structure
    if structure.size % count:
        return motion[:0]
    by_structure = structure.reshape(-1, count), motion.reshape(-1, count)
    if (by_structure[0] != by_structure[0][:, :1]).any() or (by_structure[1] != motion[:count]).any():
        return motion[:0]
    return motion[:count]
