"""The time grid of a run: steps that divide each motion's own, and when each motion and its residual window end."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np

from warpdyn.motions import ForceHistory, GroundMotion
from warpdyn.scene import Scene

# The default step resolves the first period, and a load's, this finely, and stays this far inside the stability limit.
STEPS_PER_PERIOD = 100
SHARE_OF_STABLE_STEP = 0.4
# Free vibration is followed until the first mode has decayed to this part, at most this many periods.
RESIDUAL_DECAY = 0.01
LONGEST_TAIL_IN_PERIODS = 20.0
MOST_STEPS = 2**31 - 1  # steps are counted in 32 bits


@dataclass(frozen=True, eq=False)
class Timeline:
    """When each motion is sampled, integrated and over; one value a motion.

    Args:
        step: Integration step [s].
        substeps: Integration steps in one interval between the motion's samples.
        intervals: Intervals between the motion's samples.
        run_intervals: Intervals integrated: the motion's and the free vibration after it.
        residual_from: Interval from which the residual drift is averaged.
    """

    step: np.ndarray
    substeps: np.ndarray
    intervals: np.ndarray
    run_intervals: np.ndarray
    residual_from: np.ndarray


def motions_of(scene: Scene) -> tuple[GroundMotion | ForceHistory, ...]:
    """Return the sampled histories of a scene; empty where its load is a formula."""
    if isinstance(scene.excitation, ForceHistory):
        return (scene.excitation,)
    return tuple(getattr(scene.excitation, "motions", ()))


def _first_damping_ratio(scene: Scene) -> float:
    """Return the share of critical damping in the first mode, from the nominal matrices."""
    modal = scene.structure.modal()
    shape, frequency = modal["shape"].values[0], float(modal["circular_frequency"][0])
    mass = scene.structure.parameters["mass"]
    generalised = shape @ (np.diag(mass) if mass.ndim == 1 else mass) @ shape
    return float(shape @ scene.structure.damping_matrix() @ shape / (2 * frequency * generalised))


def _tail(scene: Scene, period: float) -> float:
    """Return the free vibration after a motion's end [s]."""
    if scene.tail is not None:
        return scene.tail
    if "residual" not in scene.record:
        return period  # the peak may come a little after the motion's end
    ratio = _first_damping_ratio(scene)
    decay = np.log(1 / RESIDUAL_DECAY) / (2 * np.pi * ratio) if ratio > 0 else np.inf
    return period * (min(decay, LONGEST_TAIL_IN_PERIODS) + 1)


def _substeps(interval: float, step: float | None, target: float, what: str) -> int:
    """Return into how many steps an interval is divided, by the step asked for or the fewest that reach the target."""
    if step is None:
        return max(1, int(np.ceil(interval / target * (1 - 1e-9))))
    count = max(1, round(interval / step))
    if abs(interval / step - count) > 1e-6 * count:
        near = max(1, int(interval / step))
        raise ValueError(
            f"step {step:g} s does not divide {what}, {interval:g} s: steps that straddle a record's corners lose the "
            f"method's order; {interval / near:g} s and {interval / (near + 1):g} s divide it, and step=None "
            "chooses one for each motion"
        )
    return count


def build_timeline(scene: Scene, step: float | None, stable_step: float) -> Timeline:
    """Return the time grid of a scene.

    Args:
        scene: The scene.
        step: Integration step [s] that divides the step of every motion; None to choose one for each motion.
        stable_step: Longest step at which the method is stable for the nominal structure [s].

    Raises:
        ValueError: If the step is not finite and positive, or does not divide a motion's step or the duration.
    """
    if step is not None and not (np.isfinite(step) and step > 0):
        raise ValueError(f"step must be finite and above 0 s, got {step}")
    period = scene.structure.fundamental_period
    target = min(period / STEPS_PER_PERIOD, SHARE_OF_STABLE_STEP * stable_step)
    motions = motions_of(scene)
    if not motions:
        frequency = abs(getattr(scene.excitation, "circular_frequency", 0.0))
        if frequency > 0:
            target = min(target, 2 * np.pi / frequency / STEPS_PER_PERIOD)
        duration = scene.excitation.duration
        count = _substeps(duration, step, target, "the duration")
        last_period = max(0, count - max(1, round(period / duration * count)))
        rows = [(duration / count, 1, count, count, last_period)]
    else:
        tail = _tail(scene, period)
        rows = []
        for index, motion in enumerate(motions):
            name = getattr(motion, "name", "the force history")
            substeps = _substeps(motion.step, step, target, f"the step of motion {index} ({name!r})")
            values = motion.force if isinstance(motion, ForceHistory) else motion.acceleration
            intervals = len(values) - 1
            run = intervals + int(np.ceil(tail / motion.step * (1 - 1e-9)))
            window = min(max(1, round(period / motion.step)), run)
            rows.append((motion.step / substeps, substeps, intervals, run, run - window))
    for _, substeps, _, run, _ in rows:
        if substeps * run > MOST_STEPS:
            raise ValueError(f"{substeps * run} steps a history are more than {MOST_STEPS}: choose a longer step")
    columns = list(zip(*rows, strict=True))
    return Timeline(np.array(columns[0]), *(np.array(column, dtype=np.int32) for column in columns[1:]))
