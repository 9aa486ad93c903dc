"""The time grid of a run: steps that divide each motion's own, and how long each sample vibrates freely after it."""

from __future__ import annotations

import warnings
from dataclasses import dataclass

import numpy as np

from warpdyn.checks import real_number
from warpdyn.motions import Assignment, ForceHistory, GroundMotion
from warpdyn.scene import Scene

# The default step resolves the first period, and a load's, this finely, and stays this far inside the stability limit.
STEPS_PER_PERIOD = 100
SHARE_OF_STABLE_STEP = 0.4
# Free vibration is followed until it has decayed to this part, at most this many periods; then the residual drift is
# averaged over a few periods more.
RESIDUAL_DECAY = 0.01
LONGEST_DECAY_IN_PERIODS = 20.0
RESIDUAL_PERIODS = 3.0
MOST_STEPS = 2**31 - 1  # steps are counted in 32 bits


@dataclass(frozen=True, eq=False)
class Timeline:
    """When each motion is sampled and how it is integrated; one value a motion.

    Args:
        step: Integration step [s].
        substeps: Integration steps in one interval between the motion's samples.
        intervals: Intervals between the motion's samples.
    """

    step: np.ndarray
    substeps: np.ndarray
    intervals: np.ndarray


@dataclass(frozen=True, eq=False)
class Vibration:
    """What the engine must know of each structure's linear vibration; one value a structure.

    Args:
        period: First period [s].
        decay: Slowest rate of decay of free vibration [1/s].
        stable_step: Longest step at which the method is stable [s].
    """

    period: np.ndarray
    decay: np.ndarray
    stable_step: np.ndarray


def motions_of(scene: Scene) -> tuple[GroundMotion | ForceHistory, ...]:
    """Return the sampled histories of a scene; empty where its load is a formula."""
    if isinstance(scene.excitation, ForceHistory):
        return (scene.excitation,)
    return tuple(getattr(scene.excitation, "motions", ()))


def _substeps(interval: float, step: float | None, target: float, what: str) -> int:
    """Return into how many steps an interval is divided, by the step asked for or the fewest that reach the target."""
    if step is None:
        return max(1, int(np.ceil(interval / target * (1 - 1e-9))))
    count = max(1.0, np.round(interval / step))
    if abs(interval / step - count) > 1e-6 * count:
        near = max(1, int(interval / step))
        raise ValueError(
            f"step {step:g} s does not divide {what}, {interval:g} s: steps that straddle a record's corners lose the "
            f"method's order; {interval / near:g} s and {interval / (near + 1):g} s divide it, and step=None "
            "chooses one for each motion"
        )
    if count > MOST_STEPS:
        raise ValueError(f"step {step:g} s divides {what} into more than {MOST_STEPS} steps: choose a longer one")
    return int(count)


def build_timeline(scene: Scene, step: float | None, central: Vibration) -> Timeline:
    """Return the time grid of a scene's motions.

    Args:
        scene: The scene.
        step: Integration step [s] that divides the step of every motion; None to choose one for each motion.
        central: Vibration of the structure at the middle of the scatter, which the default step is chosen for: it must
            not depend on how many samples are drawn.

    Raises:
        ValueError: If the step is not finite and positive, or does not divide a motion's step or the duration.
    """
    if step is not None:
        step = real_number("step [s]", step, above=0)
    target = min(float(central.period[0]) / STEPS_PER_PERIOD, SHARE_OF_STABLE_STEP * float(central.stable_step[0]))
    motions = motions_of(scene)
    if not motions:
        frequency = abs(getattr(scene.excitation, "circular_frequency", 0.0))
        if frequency > 0:
            target = min(target, 2 * np.pi / frequency / STEPS_PER_PERIOD)
        duration = scene.excitation.duration
        count = _substeps(duration, step, target, "the duration")
        return Timeline(np.array([duration / count]), np.array([1]), np.array([count]))
    substeps = []
    for index, motion in enumerate(motions):
        name = getattr(motion, "name", "the force history")
        substeps.append(_substeps(motion.step, step, target, f"the step of motion {index} ({name!r})"))
    steps = [motion.step / count for motion, count in zip(motions, substeps, strict=True)]
    return Timeline(np.array(steps), np.array(substeps), np.array([len(motion.values) - 1 for motion in motions]))


def run_lengths(
    scene: Scene, timeline: Timeline, vibration: Vibration, assignment: Assignment
) -> tuple[np.ndarray, np.ndarray]:
    """Return how long each sample runs and its residual drift is averaged.

    Args:
        scene: The scene.
        timeline: Time grid of each motion.
        vibration: Vibration of each drawn structure.
        assignment: Which structure and motion each sample has.

    Returns:
        Intervals of the motion and of the free vibration after it, and steps at the end over which the residual drift
        is averaged, each of shape [sample].

    Raises:
        ValueError: If a sample would take more steps than can be counted.
    """
    structure = assignment.structure if vibration.period.size > 1 else np.zeros_like(assignment.structure)
    period, motion = vibration.period[structure], assignment.motion
    intervals, substeps = timeline.intervals[motion], timeline.substeps[motion]
    interval_duration = (timeline.step * timeline.substeps)[motion]
    window = RESIDUAL_PERIODS * period
    if not motions_of(scene):
        tail = np.zeros_like(period)
    elif scene.tail is not None:
        tail = np.full_like(period, scene.tail)
        short = "residual" in scene.record and (tail < period).any()
        if short:
            warnings.warn(
                f"a tail of {scene.tail:g} s is shorter than the first period, {period.max():.3g} s: what is recorded "
                "as residual drift is none; leave `tail` out, or 'residual' out of `record`",
                stacklevel=3,
            )
        window = np.minimum(window, np.maximum(tail, period))
    elif "residual" in scene.record:
        with np.errstate(divide="ignore"):
            decay = np.log(1 / RESIDUAL_DECAY) / vibration.decay[structure]
        tail = np.minimum(decay, LONGEST_DECAY_IN_PERIODS * period) + window
    else:
        tail = period  # the peak may come a little after the motion's end
    run = intervals + np.ceil(tail / interval_duration * (1 - 1e-9))
    if (run * substeps).max() >= MOST_STEPS:
        raise ValueError(
            f"a sample would take {(run * substeps).max():.3g} steps, and {MOST_STEPS} can be counted: "
            "choose a longer step or a shorter tail"
        )
    residual_steps = np.clip(np.round(window / timeline.step[motion]), 1, run * substeps)
    return run.astype(np.int32), residual_steps.astype(np.int32)
