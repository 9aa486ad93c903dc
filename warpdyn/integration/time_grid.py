"""The time grid of a run: steps that divide each motion's own, and how long each sample vibrates freely after it."""

from __future__ import annotations

import warnings
from collections.abc import Sequence
from dataclasses import dataclass, replace

import numpy as np

from warpdyn.core.checks import real_number
from warpdyn.ground_motions.filtered_noise import FilteredNoise
from warpdyn.ground_motions.motions import Assignment, ForceHistory, FreeVibration, GroundMotion, HarmonicForce
from warpdyn.scene.scene import Scene

# The default step resolves the first period, and a load's, this finely, and stays this far inside the stability limit.
STEPS_PER_PERIOD = 100
SHARE_OF_STABLE_STEP = 0.4
# Free vibration is followed until it has decayed to this part, at most this many periods; then the residual drift is
# averaged over a few periods more.
RESIDUAL_DECAY = 0.01
LONGEST_DECAY_IN_PERIODS = 20.0
RESIDUAL_PERIODS = 3.0
THE_DURATION, THE_NOISE = "the duration", "the interval of the noise"
MOST_STEPS = 2**30  # steps are counted in 32 bits, with room for a look at the last state


@dataclass(frozen=True, eq=False)
class Timeline:
    """When each motion is sampled and into how many steps its intervals are divided; one value a motion.

    Args:
        motions: The sampled histories, as they are integrated; empty where the load is a formula or noise.
        interval: Time between the motion's samples [s].
        substeps: Integration steps in one interval.
        intervals: Intervals between the motion's samples.
    """

    motions: tuple[GroundMotion | ForceHistory, ...]
    interval: np.ndarray
    substeps: np.ndarray
    intervals: np.ndarray


@dataclass(frozen=True, eq=False)
class Schedule:
    """How each sample is stepped; one value a sample.

    Args:
        run_intervals: Intervals of the motion and of the free vibration after it.
        substeps: Integration steps in one interval.
        step: Integration step [s].
        residual_steps: Steps at the end over which the residual drift is averaged.
        repeats: How many samples in a row have a structure, a motion and all of this in common, throughout.
    """

    run_intervals: np.ndarray
    substeps: np.ndarray
    step: np.ndarray
    residual_steps: np.ndarray
    repeats: int = 1

    @property
    def columns(self) -> tuple[np.ndarray, ...]:
        """What there is of each sample."""
        return self.run_intervals, self.substeps, self.step, self.residual_steps

    def select(self, samples: np.ndarray) -> Schedule:
        """Return that of some of the samples."""
        return Schedule(*(column[samples] for column in self.columns))

    @staticmethod
    def joined(parts: Sequence[Schedule]) -> Schedule:
        """Return those of several blocks of samples as one."""
        return Schedule(*(np.concatenate(columns) for columns in zip(*(part.columns for part in parts), strict=True)))

    def with_substeps(self, samples: np.ndarray, substeps: np.ndarray) -> Schedule:
        """Return the schedule with other steps an interval for some samples, which run as long as before."""
        every, step, residual = self.substeps.copy(), self.step.copy(), self.residual_steps.copy()
        finer = substeps / self.substeps[samples]
        every[samples] = substeps
        step[samples] = self.step[samples] / finer
        residual[samples] = np.maximum(np.round(self.residual_steps[samples] * finer), 1)
        return Schedule(self.run_intervals, every, step, residual)


@dataclass(frozen=True, eq=False)
class Vibration:
    """What the engine must know of each structure's linear vibration; one value a structure.

    Args:
        period: First period [s].
        decay: Slowest rate of decay of free vibration [1/s].
        stable_step: Longest step at which the method is stable [s].
        rayleigh: Factors of the mass [1/s] and the stiffness [s] in Rayleigh damping, 0 in any other, shape
            [structure, 2].
    """

    period: np.ndarray
    decay: np.ndarray
    stable_step: np.ndarray
    rayleigh: np.ndarray

    def select(self, structures: np.ndarray) -> Vibration:
        """Return that of some of the structures, which may repeat."""
        return Vibration(*(values[structures] for values in (self.period, self.decay, self.stable_step, self.rayleigh)))


def motions_of(scene: Scene) -> tuple[GroundMotion | ForceHistory, ...]:
    """Return the sampled histories of a scene; empty where its load is a formula or noise."""
    if isinstance(scene.excitation, ForceHistory):
        return (scene.excitation,)
    return tuple(getattr(scene.excitation, "motions", ()))


def _divides(step: float, interval: float) -> bool:
    count = max(1.0, np.round(interval / step))
    return abs(interval / step - count) <= 1e-6 * count


def _substeps(interval: float, step: float | None, target: float, what: str) -> int:
    """Return into how many steps an interval is divided, by the step asked for or the fewest that reach the target."""
    if step is None:
        return max(1, int(np.ceil(interval / target * (1 - 1e-9))))
    count = max(1.0, np.round(interval / step))
    if not _divides(step, interval):
        near = max(1, int(interval / step))
        holds = f"{interval / near:g} s and {interval / (near + 1):g} s divide it, and step=None chooses"
        if what in (THE_DURATION, THE_NOISE):
            raise ValueError(f"step {step:g} s does not divide {what}, {interval:g} s: {holds} one")
        raise ValueError(
            f"step {step:g} s does not divide {what}, {interval:g} s: steps that straddle a record's corners lose the "
            f"method's order; {holds} one for each motion; resample=True cuts the corners and takes the step as it is"
        )
    if count > MOST_STEPS:
        raise ValueError(f"step {step:g} s divides {what} into more than {MOST_STEPS} steps: choose a longer one")
    return int(count)


def _resampled(motion: GroundMotion | ForceHistory, step: float) -> GroundMotion | ForceHistory:
    """Return a motion on a grid of its own step, straight between the new samples."""
    old = motion.step * np.arange(len(motion.values))
    new = step * np.arange(int(np.ceil(old[-1] / step * (1 - 1e-12))) + 1)
    columns = motion.values.reshape(old.size, -1).T
    values = np.stack([np.interp(new, old, column, right=0.0) for column in columns], axis=-1)
    if isinstance(motion, ForceHistory):
        return replace(motion, force=values, step=step)
    return replace(motion, acceleration=values[:, 0], step=step)


def default_step(central: Vibration) -> float:
    """Return the longest step [s] that resolves the structure in the middle of the scatter."""
    step = float(central.period[0]) / STEPS_PER_PERIOD
    if central.stable_step[0] > 0:  # where no step is stable, the guard says so
        step = min(step, SHARE_OF_STABLE_STEP * float(central.stable_step[0]))
    return step


def build_timeline(
    scene: Scene,
    central: Vibration,
    step: float | None = None,
    longest_step: float | None = None,
    resample: bool = False,
) -> Timeline:
    """Return the time grid of a scene's motions.

    Args:
        scene: The scene.
        central: Vibration of the structure at the middle of the scatter, which the default step is chosen for: it must
            not depend on how many samples are drawn.
        step: Integration step [s] that divides the step of every motion; None to choose one for each motion.
        longest_step: Step [s] that no motion's step may be longer than, where it is chosen; None to choose that too.
        resample: Whether motions whose step is not divided are resampled at the step.

    Raises:
        ValueError: If a step is not finite and positive, or does not divide a motion's step or the duration.
    """
    if step is not None:
        step = real_number("step [s]", step, above=0)
    if longest_step is not None:
        if step is not None:
            raise ValueError("give simulate() a step or a longest_step, not both")
        target = real_number("longest_step [s]", longest_step, above=0)
    else:
        target = default_step(central)
    if resample and step is None:
        raise ValueError("resample needs a step to resample the motions at")
    if resample and not motions_of(scene):
        raise ValueError("resample needs sampled motions or forces, and this scene has none: leave it out")
    motions = motions_of(scene)
    if isinstance(scene.excitation, FilteredNoise):
        noise = scene.excitation
        count = _substeps(noise.interval, step, target, THE_NOISE)
        return Timeline((), np.array([noise.interval]), np.array([count]), np.array([noise.intervals]))
    if not motions:
        frequency = abs(getattr(scene.excitation, "circular_frequency", 0.0))
        if frequency > 0 and longest_step is None:
            target = min(target, 2 * np.pi / frequency / STEPS_PER_PERIOD)
        duration = scene.excitation.duration
        count = _substeps(duration, step, target, THE_DURATION)
        return Timeline((), np.array([duration / count]), np.array([1]), np.array([count]))
    if resample:
        skipped = sum(step > motion.step * (1 + 1e-6) for motion in motions)
        if skipped:
            warnings.warn(
                f"at {step:g} s, {skipped} of {len(motions)} motions are resampled at less than their own rate: what "
                "they hold between is left out",
                stacklevel=4,
            )
        motions = tuple(motion if _divides(step, motion.step) else _resampled(motion, step) for motion in motions)
    substeps = []
    for index, motion in enumerate(motions):
        name = getattr(motion, "name", "the force history")
        substeps.append(_substeps(motion.step, step, target, f"the step of motion {index} ({name!r})"))
    intervals = np.array([len(motion.values) - 1 for motion in motions])
    return Timeline(motions, np.array([motion.step for motion in motions]), np.array(substeps), intervals)


def warn_of_short_tail(scene: Scene, longest_period: float, stacklevel: int) -> None:
    """Say so if a scene's tail is too short for a residual drift to be read of its slowest structure."""
    if scene.tail is None or "residual" not in scene.recorders or not motions_of(scene) or scene.tail >= longest_period:
        return
    warnings.warn(
        f"a tail of {scene.tail:g} s is shorter than the first period, {longest_period:.3g} s: what is recorded as "
        "residual drift is none; leave `tail` out, or 'residual' out of `recorders`",
        stacklevel=stacklevel + 1,
    )


def build_schedule(
    scene: Scene,
    timeline: Timeline,
    vibration: Vibration,
    assignment: Assignment,
    row: np.ndarray,
    comes_to_rest: bool = False,
) -> Schedule:
    """Return how each sample is stepped, how long it runs and its residual drift is averaged.

    Args:
        scene: The scene.
        timeline: Time grid of each motion.
        vibration: Vibration of each drawn structure.
        assignment: Which structure and motion each sample has.
        row: Place of each sample's structure in `vibration`, shape [sample].
        comes_to_rest: Whether free vibration is followed to rest although no residual drift is read.

    Raises:
        ValueError: If a sample would take more steps than can be counted.
    """
    # Once for all samples in a row that have structure and motion in common.
    structure, motion = row[:: assignment.repeats], assignment.motion[:: assignment.repeats]
    period = vibration.period[structure]
    interval, substeps = timeline.interval[motion], timeline.substeps[motion]
    window = RESIDUAL_PERIODS * period
    if isinstance(scene.excitation, HarmonicForce | FreeVibration):
        tail = np.zeros_like(period)
    elif scene.tail is not None:
        tail = np.full_like(period, scene.tail)
        window = np.minimum(window, np.maximum(tail, period))
    elif "residual" in scene.recorders or comes_to_rest:
        with np.errstate(divide="ignore"):
            decay = np.log(1 / RESIDUAL_DECAY) / vibration.decay[structure]
        tail = np.minimum(decay, LONGEST_DECAY_IN_PERIODS * period) + window
    else:
        tail = period  # the peak may come a little after the motion's end
    run = timeline.intervals[motion] + np.ceil(tail / interval * (1 - 1e-9))
    if (run * substeps).max() >= MOST_STEPS:
        raise ValueError(
            f"a sample would take {(run * substeps).max():.3g} steps, and {MOST_STEPS} can be counted: "
            "choose a longer step or a shorter tail"
        )
    step = interval / substeps
    residual_steps = np.clip(np.round(window / step), 1, run * substeps)
    values = run.astype(np.int32), substeps.astype(np.int32), step, residual_steps.astype(np.int32)
    return Schedule(*(np.repeat(column, assignment.repeats) for column in values), assignment.repeats)
