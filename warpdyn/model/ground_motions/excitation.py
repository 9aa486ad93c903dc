"""The base class of excitations, with the attributes and methods that other modules use; and time grids.

To add an excitation, write a subclass of Excitation. If kernels lack its kind of load, add the load to their LOADS.
"""

from __future__ import annotations

import dataclasses
from collections.abc import Mapping, Sequence
from dataclasses import dataclass, replace
from typing import TYPE_CHECKING, Any, NamedTuple, Protocol

import numpy as np
from numpy.typing import ArrayLike

from warpdyn.foundations.core.checks import real_number
from warpdyn.foundations.core.description import html_table

if TYPE_CHECKING:
    from warpdyn.model.structures.structure import Structure

THE_DURATION, THE_NOISE = "the duration", "the interval of the noise"  # words in messages about steps
MOST_RECORD_SAMPLES = 2**26  # of a resampled history: 7.8 days at 100 samples per second, 0.5 GB
MOST_STEPS = 2**30  # steps in an interval, because kernels count steps in 32-bit integers


class Sampled(Protocol):
    """A history of accelerations or forces that is linear between its samples and zero after the last sample."""

    @property
    def step(self) -> float:
        """Time between samples [s]."""

    @property
    def label(self) -> str:
        """Name of the history in the dataset."""

    @property
    def values(self) -> np.ndarray:
        """Sampled accelerations [m/s2] or forces [N]; the first dimension is time."""

    def resampled(self, step: float) -> Sampled:
        """Return the history with another sampling step [s], by linear interpolation."""


@dataclass(frozen=True, eq=False)
class Timeline:
    """Sampling intervals and integration steps of each motion; all arrays have the shape [motion].

    Args:
        motions: The sampled histories; empty if the load is a formula or noise.
        interval: Time between two samples [s].
        substeps: Number of integration steps in one sampling interval.
        intervals: Number of sampling intervals.
    """

    motions: tuple[Sampled, ...]
    interval: np.ndarray
    substeps: np.ndarray
    intervals: np.ndarray

    @property
    def steps(self) -> np.ndarray:
        """Integration step of each motion [s], shape [motion]."""
        return self.interval / self.substeps


@dataclass(frozen=True, eq=False)
class Assignment:
    """Structure, motion and scale factor of each sample.

    Args:
        structure: Index of the drawn structure, shape [sample].
        motion: Index of the motion, shape [sample].
        scale: Factor that multiplies the motion, shape [sample].
        im_level: Intensity of the scaled motion, shape [sample]; None for a load without intensity.
        measure: Attributes that describe the intensity measure in a dataset.
        units: Units of `im_level`: "g" for accelerations, otherwise SI units.
        is_striped: Whether the values of `im_level` are the levels of stripes.
        repeats: Number of successive samples with the same structure and motion.
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
        """Return the assignment (structure, motion, scale) of the samples with the given indices."""
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
        """Return the assignments of several blocks of samples, one after the other, as one assignment."""
        names = ("structure", "motion", "scale", "im_level")
        values = {name: [getattr(part, name) for part in parts] for name in names}
        whole: dict[str, Any] = {
            name: None if rows[0] is None else np.concatenate(rows) for name, rows in values.items()
        }
        return replace(parts[0], **whole, repeats=1)


class MotionTable(NamedTuple):
    """Ground motions of all sites, and the site of each structure in each draw.

    Entries are motions with scale factors. The entries of one site, one per earthquake and component, are consecutive.

    Args:
        entries: Motion, factor and intensity of each entry, shape [site * stride]; its `structure` is empty.
        site: Index of the site of each structure and draw, shape [structure, draw].
        offset: Index of each sample of a structure among the entries of its site.
        stride: Number of entries per site.
    """

    entries: Assignment
    site: np.ndarray
    offset: np.ndarray
    stride: int


class Excitation:
    """Base class of excitations: a ground acceleration or nodal forces, or an initial state without load.

    An acceleration or force is a sampled history, a random process or a formula.

    Attributes:
        is_force: Whether forces act on the degrees of freedom, instead of a base acceleration.
        has_tail: Whether free vibration follows the load.
        is_same_for_all: Whether the samples of all structures have the same motions and scale factors.
        is_design: Whether the excitation assigns motions to structures, as Stripes and Cloud do.
    """

    is_force = False
    has_tail = True
    is_same_for_all = False
    is_design = False

    if TYPE_CHECKING:  # not at run time: a dataclass would use the property as default value of a field `motions`

        @property
        def motions(self) -> Sequence[Sampled]:
            """Sampled histories; empty if the load is a formula or noise."""

    def _repr_html_(self) -> str:
        return html_table(type(self).__name__, self.told())

    def told(self) -> list[tuple[object, ...]]:
        """Return the rows of the table that notebooks show for the excitation, one row per field."""
        known: Any = self  # each subclass is a dataclass
        values = {field.name: getattr(self, field.name) for field in dataclasses.fields(known)}
        return [
            (name.replace("_", " "), value if np.ndim(value) < 2 else f"array of shape {np.shape(value)}")
            for name, value in values.items()
        ]

    @property
    def base_components(self) -> int:
        """Number of components of the base motion; 0 for forces and initial states."""
        return 0 if self.is_force or self.kernel_load == "free_vibration" else 1

    @property
    def samples_per_structure(self) -> int:
        """Number of samples (response histories) of each structure in the last event."""
        raise NotImplementedError

    @property
    def kernel_load(self) -> str:
        """Name of the excitation's kind of load, a key of LOADS in the kernels."""
        return "base_acceleration"

    @property
    def event_names(self) -> tuple[str, ...]:
        """Names of successive events; ("",) if the excitation is a single event."""
        return ("",)

    @property
    def forcing_frequency(self) -> float | None:
        """Circular frequency of a harmonic force [rad/s]; None for other excitations."""
        return None

    @property
    def samples_by_event(self) -> tuple[int, ...]:
        """Number of samples (response histories) of each structure in each event, shape [event]."""
        return (self.samples_per_structure,)

    def assign(self, structures: np.ndarray, seed: int, event: int = 0) -> Assignment:
        """Return structure, motion and scale factor of each sample in an event.

        Samples of one structure are consecutive.

        Args:
            structures: Indices of the structures; an index may occur several times.
            seed: Seed of random choices.
            event: Index of the event, from 0.
        """
        raise NotImplementedError

    def check_fits(self, structure: Structure) -> None:
        """Raise an error if the excitation cannot act on a structure, such as forces for other degrees of freedom."""

    def check_structures(self, structures: int) -> None:
        """Raise a ValueError if the excitation lists values for another number of structures than `structures`."""

    @property
    def structures_given(self) -> int:
        """Number of structures for which the excitation lists values; 0 if it lists none."""
        return 0

    def motion_table(self) -> MotionTable | None:
        """Return the motions of all sites and the site of each structure; None if motions do not belong to sites."""
        return None

    def of_structures(self, structures: np.ndarray, seed: int) -> Excitation:
        """Return the excitation for some structures of a run, given by indices, with the same random choices."""
        return self

    def timeline(self, step: float | None, target: float, *, resample: bool) -> Timeline:
        """Return the time grid: sampling intervals and integration steps of each motion.

        Args:
            step: Integration step [s]; None: the longest step up to `target` that divides each interval.
            target: Upper bound of chosen steps [s].
            resample: Whether a motion is resampled if `step` does not divide its step.

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
        """Return the arrays of the load that kernels read, as name of the field in their struct Load -> array."""
        displacement, velocity = self.initial_state(dofs)
        common = {
            "intervals": timeline.intervals,
            "initial_displacement": displacement,
            "initial_velocity": velocity,
        }
        return common | self.pack_values(timeline)

    def pack_values(self, timeline: Timeline) -> dict[str, np.ndarray]:
        """Return arrays that only this kind of load has; for sampled histories: values of all motions in one array."""
        lengths = [len(motion.values) for motion in timeline.motions]
        return {
            "values": np.concatenate([motion.values.ravel() for motion in timeline.motions]),
            "first": np.concatenate([[0], np.cumsum(lengths)[:-1]]),
        }

    @property
    def start(self) -> tuple[ArrayLike, ArrayLike]:
        """Initial displacement [m] and velocity [m/s], each with one value per degree of freedom or one for all."""
        return 0.0, 0.0

    def initial_state(self, dofs: int) -> tuple[np.ndarray, np.ndarray]:
        """Return the initial displacement [m] and velocity [m/s] of the degrees of freedom, each of shape [dof]."""
        displacement, velocity = self.start
        return np.broadcast_to(displacement, dofs), np.broadcast_to(velocity, dofs)

    def modal_load(self, shape: np.ndarray, momentum: np.ndarray, influence: np.ndarray) -> np.ndarray:
        """Return the load in each mode under a unit base acceleration or unit forces; modes have unit modal mass.

        Args:
            shape: Mode shapes, shape [structure, dof, mode].
            momentum: Mass times `shape`.
            influence: Displacement of each degree of freedom under a unit base displacement, shape [dof].

        Returns:
            Modal loads, shape [structure, mode], or [structure, dof, mode] if each degree of freedom has a force.
        """
        return -influence @ momentum

    def modal_start(self, momentum: np.ndarray) -> np.ndarray:
        """Return initial modal displacements and velocities, shape [2, structure, mode].

        Args:
            momentum: Mass times mode shapes, shape [structure, dof, mode].
        """
        displacement, velocity = self.initial_state(momentum.shape[1])
        return np.array([displacement @ momentum, velocity @ momentum])


class SingleLoad(Excitation):
    """Base class of loads that act once on every structure, such as forces or noise."""

    @property
    def motions(self) -> Sequence[Sampled]:
        """An empty tuple: the load has no sampled ground motions."""
        return ()

    samples_per_structure = 1
    is_same_for_all = True

    def assign(self, structures: np.ndarray, seed: int, event: int = 0) -> Assignment:
        """Return one sample for each structure with a given index, with scale factor 1."""
        index = np.asarray(structures, dtype=np.int32)
        return Assignment(index, np.zeros(index.size, dtype=np.int32), np.ones(index.size))


def divides(step: float, interval: float) -> bool:
    """Return whether an interval [s] is a whole multiple of the step [s], apart from rounding."""
    count = max(1.0, np.round(interval / step))
    return bool(abs(interval / step - count) <= 1e-6 * count)


def substeps_of(interval: float, step: float | None, target: float, what: str) -> int:
    """Return the number of integration steps in a sampling interval; raise a ValueError if `step` does not divide it.

    Args:
        interval: Sampling interval [s].
        step: Integration step [s]; None: the longest step of at most `target` that divides the interval.
        target: Longest step that may be chosen [s].
        what: Words for the interval in messages.
    """
    if step is None:
        count = max(1.0, np.ceil(interval / target * (1 - 1e-9)))
        if count > MOST_STEPS:
            raise ValueError(
                f"{what}, {interval:g} s, would need {count:.3g} steps of {target:.3g} s, more than {MOST_STEPS}: "
                "check that both are in seconds, or give a longer step= to simulate()"
            )
        return int(count)
    count = max(1.0, np.round(interval / step))
    if not divides(step, interval):
        near = max(1, int(interval / step))
        remedy = f"give step={interval / near:g} or step={interval / (near + 1):g}, or leave out step="
        if what in (THE_DURATION, THE_NOISE):
            raise ValueError(f"step {step:g} s does not divide {what}, {interval:g} s: {remedy}")
        raise ValueError(
            f"step {step:g} s does not divide {what}, {interval:g} s: a step across a sample of the record reduces the "
            f"order of the method: {remedy}; resample=True changes the motion to this step instead"
        )
    if count > MOST_STEPS:
        raise ValueError(f"step {step:g} s divides {what} into more than {MOST_STEPS} steps: give a longer step=")
    return int(count)


def check_sample_count(what: str, count: float, remedy: str) -> None:
    """Raise a ValueError, with advice `remedy`, if a resampled history has more than MOST_RECORD_SAMPLES samples."""
    if count > MOST_RECORD_SAMPLES:
        raise ValueError(f"{what} makes {count:.3g} samples, more than {MOST_RECORD_SAMPLES}: {remedy}")


def resampled_columns(values: np.ndarray, old_step: float, step: float) -> np.ndarray:
    """Return sampled values, whose first dimension is time, at another step [s], by linear interpolation.

    After the last given sample, the values are 0.
    """
    step = real_number("step [s]", step, above=0)
    old = old_step * np.arange(len(values))
    count = np.ceil(old[-1] / step * (1 - 1e-12)) + 1
    check_sample_count(f"step {step:g} s", count, "give a longer step=")
    new = step * np.arange(int(count))
    columns = values.reshape(old.size, -1).T
    return np.stack([np.interp(new, old, column, right=0.0) for column in columns], axis=-1)
