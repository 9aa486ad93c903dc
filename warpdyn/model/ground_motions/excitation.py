"""The interface of excitations: what a scene, the integration and the dataset read of each; and its time grid.

To add one, write a subclass of Excitation; a load that kernels do not have yet is a row of their LOADS.
"""

from __future__ import annotations

import dataclasses
from collections.abc import Mapping, Sequence
from dataclasses import dataclass, replace
from typing import TYPE_CHECKING, Any, Protocol

import numpy as np
from numpy.typing import ArrayLike

from warpdyn.foundations.core.checks import real_number
from warpdyn.foundations.core.description import html_table

if TYPE_CHECKING:
    from warpdyn.model.structures.structure import Structure

THE_DURATION, THE_NOISE = "the duration", "the interval of the noise"
MOST_RECORD_SAMPLES = 2**26  # 7.8 days at 100 samples a second, 0.5 GB
MOST_STEPS = 2**30  # steps are counted in 32 bits, with room for a look at the last state


class Sampled(Protocol):
    """A history that is linear between its samples and zero after the last."""

    @property
    def step(self) -> float:
        """Time between samples [s]."""

    @property
    def label(self) -> str:
        """What the dataset calls it."""

    @property
    def values(self) -> np.ndarray:
        """What is sampled, time first."""

    def resampled(self, step: float) -> Sampled:
        """Return it on a grid of another step [s], straight between the new samples."""


@dataclass(frozen=True, eq=False)
class Timeline:
    """When each motion is sampled and into how many steps its intervals are divided; one value a motion.

    Args:
        motions: The sampled histories, as they are integrated; empty where the load is a formula or noise.
        interval: Time between the motion's samples [s].
        substeps: Integration steps in one interval.
        intervals: Intervals between the motion's samples.
    """

    motions: tuple[Sampled, ...]
    interval: np.ndarray
    substeps: np.ndarray
    intervals: np.ndarray

    @property
    def steps(self) -> np.ndarray:
        """Integration step of each motion [s]."""
        return self.interval / self.substeps


@dataclass(frozen=True, eq=False)
class Assignment:
    """Which structure runs under which motion at which scale, one value a sample.

    Args:
        structure: Index of the drawn structure, shape [sample].
        motion: Index of the motion, shape [sample].
        scale: Factor on the motion, shape [sample].
        im_level: Intensity measure of the scaled motion, shape [sample], or None where there is none.
        measure: Attributes that name that intensity measure in a dataset.
        units: Its units: "g" for accelerations, SI for others.
        is_striped: Whether `im_level` takes the values of a list of stripes.
        repeats: How many samples in a row have a structure and a motion in common, throughout.
    """

    structure: np.ndarray
    motion: np.ndarray
    scale: np.ndarray
    im_level: np.ndarray | None = None
    measure: Mapping[str, object] = dataclasses.field(default_factory=dict)
    units: str = "g"
    is_striped: bool = False
    repeats: int = 1

    def select(self, samples: np.ndarray) -> Assignment:
        """Return that of some of the samples."""
        level = None if self.im_level is None else self.im_level[samples]
        return replace(
            self,
            structure=self.structure[samples],
            motion=self.motion[samples],
            scale=self.scale[samples],
            im_level=level,
            repeats=1,
        )

    @staticmethod
    def joined(parts: Sequence[Assignment]) -> Assignment:
        """Return those of several blocks of samples as one."""
        names = ("structure", "motion", "scale", "im_level")
        values = {name: [getattr(part, name) for part in parts] for name in names}
        whole: dict[str, Any] = {
            name: None if rows[0] is None else np.concatenate(rows) for name, rows in values.items()
        }
        return replace(parts[0], **whole, repeats=1)


class Excitation:
    """What shakes a structure: a base acceleration or nodal forces, sampled, random or a formula, or nothing at all.

    Attributes:
        is_force: Whether it acts as forces on the degrees of freedom.
        has_tail: Whether free vibration follows it.
        is_design: Whether it says which motions each structure runs under: Stripes, Cloud or such.
    """

    is_force = False
    has_tail = True
    is_design = False

    if TYPE_CHECKING:  # a property of the base would be taken for the default of the fields of this name

        @property
        def motions(self) -> Sequence[Sampled]:
            """Sampled histories; empty where the load is a formula or noise."""

    def _repr_html_(self) -> str:
        return html_table(type(self).__name__, self.told())

    def told(self) -> list[tuple[object, ...]]:
        """Return what tables of notebooks say of it, a row each."""
        known: Any = self  # each kind is a data class
        values = {field.name: getattr(self, field.name) for field in dataclasses.fields(known)}
        return [
            (name.replace("_", " "), value if np.ndim(value) < 2 else f"array of shape {np.shape(value)}")
            for name, value in values.items()
        ]

    @property
    def samples_per_structure(self) -> int:
        """Samples that each structure has in all, of the last event."""
        raise NotImplementedError

    @property
    def kernel_load(self) -> str:
        """Row of the kernels' LOADS."""
        return "base_acceleration"

    @property
    def event_names(self) -> tuple[str, ...]:
        """Names of the events that follow one another; one without a name where there is but one."""
        return ("",)

    @property
    def forcing_frequency(self) -> float | None:
        """Circular frequency of a load that is a sine [rad/s]; None for any other."""
        return None

    @property
    def samples_by_event(self) -> tuple[int, ...]:
        """Samples that a structure has in each event."""
        return (self.samples_per_structure,)

    def assign(self, structures: np.ndarray, seed: int, event: int = 0) -> Assignment:
        """Return the samples of an event on each of these structures.

        Args:
            structures: Indices of the structures, which may repeat.
            seed: Seed of what is drawn.
            event: Number of the event.
        """
        raise NotImplementedError

    def check_fits(self, structure: Structure) -> None:
        """Raise an error unless it can act on a structure."""

    def check_structures(self, structures: int) -> None:
        """Raise a ValueError unless what is given a structure is given for so many of them."""

    @property
    def structures_given(self) -> int:
        """How many structures it lists something of; 0 if it serves any number."""
        return 0

    def of_structures(self, structures: np.ndarray, seed: int) -> Excitation:
        """Return it for some structures of a run, given by their indices: what is drawn goes by these."""
        return self

    def timeline(self, step: float | None, target: float, *, resample: bool) -> Timeline:
        """Return its time grid.

        Args:
            step: Integration step asked for [s]; None to take the fewest that are no longer than the target.
            target: Step [s] that those chosen are no longer than.
            resample: Whether motions whose own step is not divided are resampled.

        Raises:
            ValueError: If the step does not divide a motion's step.
        """
        motions = tuple(self.motions)
        if resample and step is not None:
            motions = tuple(motion if divides(step, motion.step) else motion.resampled(step) for motion in motions)
        substeps = [
            substeps_of(motion.step, step, target, f"the step of motion {index} ({motion.label!r})")
            for index, motion in enumerate(motions)
        ]
        intervals = np.array([len(motion.values) - 1 for motion in motions])
        return Timeline(motions, np.array([motion.step for motion in motions]), np.array(substeps), intervals)

    def pack(self, timeline: Timeline, dofs: int) -> dict[str, np.ndarray]:
        """Return what the kernels' Load struct holds, named as its fields are."""
        displacement, velocity = self.initial_state(dofs)
        common = {
            "intervals": timeline.intervals,
            "initial_displacement": displacement,
            "initial_velocity": velocity,
        }
        return common | self.pack_values(timeline)

    def pack_values(self, timeline: Timeline) -> dict[str, np.ndarray]:
        """Return the arrays that are of this load alone: of sampled histories all values, end to end."""
        lengths = [len(motion.values) for motion in timeline.motions]
        return {
            "values": np.concatenate([motion.values.ravel() for motion in timeline.motions]),
            "first": np.concatenate([[0], np.cumsum(lengths)[:-1]]),
        }

    @property
    def start(self) -> tuple[ArrayLike, ArrayLike]:
        """Displacement [m] and velocity [m/s] at the start, one value a degree of freedom or one for all."""
        return 0.0, 0.0

    def initial_state(self, dofs: int) -> tuple[np.ndarray, np.ndarray]:
        """Return the displacement [m] and the velocity [m/s] that it starts from, shape [dof]."""
        displacement, velocity = self.start
        return np.broadcast_to(displacement, dofs), np.broadcast_to(velocity, dofs)

    def modal_load(self, shape: np.ndarray, momentum: np.ndarray, influence: np.ndarray) -> np.ndarray:
        """Return the load of modes of unit modal mass, for a unit of what the kernel evaluates.

        Args:
            shape: Displacement by mode, shape [structure, dof, mode].
            momentum: Mass times that.
            influence: Displacement of each degree of freedom under a unit base displacement, shape [dof].

        Returns:
            Shape [structure, mode], or [structure, dof, mode] where each degree of freedom has a force of its own.
        """
        return -influence @ momentum

    def modal_start(self, momentum: np.ndarray) -> np.ndarray:
        """Return the modes' initial displacement and velocity, shape [2, structure, mode]; arguments as above."""
        displacement, velocity = self.initial_state(momentum.shape[1])
        return np.array([displacement @ momentum, velocity @ momentum])


class SingleLoad(Excitation):
    """A load that every structure runs under once, as it is."""

    @property
    def motions(self) -> Sequence[Sampled]:
        """None."""
        return ()

    samples_per_structure = 1

    def assign(self, structures: np.ndarray, seed: int, event: int = 0) -> Assignment:
        """Return one sample for each of these structures, given by their indices."""
        index = np.asarray(structures, dtype=np.int32)
        return Assignment(index, np.zeros(index.size, dtype=np.int32), np.ones(index.size))


def divides(step: float, interval: float) -> bool:
    """Return whether an interval is a whole number of steps, but for rounding."""
    count = max(1.0, np.round(interval / step))
    return bool(abs(interval / step - count) <= 1e-6 * count)


def substeps_of(interval: float, step: float | None, target: float, what: str) -> int:
    """Return into how many steps an interval is divided, by the step asked for or the fewest that reach the target."""
    if step is None:
        count = max(1.0, np.ceil(interval / target * (1 - 1e-9)))
        if count > MOST_STEPS:
            raise ValueError(
                f"{what}, {interval:g} s, would take {count:.3g} steps of {target:.3g} s, and {MOST_STEPS} can be "
                "counted: make it shorter, or give a longer step= to simulate()"
            )
        return int(count)
    count = max(1.0, np.round(interval / step))
    if not divides(step, interval):
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


def check_sample_count(what: str, count: float, remedy: str) -> None:
    """Raise a ValueError if a history would have more samples than any record has."""
    if count > MOST_RECORD_SAMPLES:
        raise ValueError(f"{what} makes {count:.3g} samples, and a record has at most {MOST_RECORD_SAMPLES}: {remedy}")


def resampled_columns(values: np.ndarray, old_step: float, step: float) -> np.ndarray:
    """Return sampled values, time first, on a grid of another step, straight between the new samples."""
    step = real_number("step [s]", step, above=0)
    old = old_step * np.arange(len(values))
    count = np.ceil(old[-1] / step * (1 - 1e-12)) + 1
    check_sample_count(f"step {step:g} s", count, "choose a longer step")
    new = step * np.arange(int(count))
    columns = values.reshape(old.size, -1).T
    return np.stack([np.interp(new, old, column, right=0.0) for column in columns], axis=-1)
