"""What acts on a structure, as data: recorded base motions, nodal forces, or an initial state alone."""

from __future__ import annotations

from collections.abc import Iterable, Sequence
from dataclasses import dataclass, field, replace
from typing import Any

import numpy as np
from numpy.typing import ArrayLike

from warpdyn.core.checks import finite_numbers, real_number, real_numbers


@dataclass(frozen=True, eq=False)
class GroundMotion:
    """One recorded base acceleration, linear between its samples and zero after its end.

    Args:
        acceleration: Ground acceleration [m/s2], shape [time]; the first value acts at t = 0.
        step: Sampling step of the record [s].
        name: What the record is called in results.
        source: Where it came from (a file, a package).

    Raises:
        ValueError: If the acceleration is not a finite 1-D array of at least two values, or the step is not
            finite and positive.
    """

    acceleration: np.ndarray = field(repr=False)
    step: float
    name: str = "motion"
    source: str = field(default="", repr=False)

    def __post_init__(self) -> None:
        acceleration = real_numbers(f"motion {self.name!r}: acceleration", self.acceleration)
        if acceleration.ndim != 1 or acceleration.size < 2:
            raise ValueError(
                f"motion {self.name!r}: acceleration must be one row of at least 2 values, "
                f"got shape {acceleration.shape}"
            )
        bad = np.flatnonzero(~np.isfinite(acceleration))
        if bad.size:
            raise ValueError(
                f"motion {self.name!r}: acceleration[{bad[0]}] is {acceleration[bad[0]]} "
                f"({bad.size} of {acceleration.size} values are not finite); every value must be finite"
            )
        acceleration.flags.writeable = False
        object.__setattr__(self, "acceleration", acceleration)
        object.__setattr__(self, "step", real_number(f"motion {self.name!r}: step [s]", self.step, above=0))

    @property
    def values(self) -> np.ndarray:
        """The sampled values, time first."""
        return self.acceleration

    @property
    def duration(self) -> float:
        """Time from the first to the last sample [s]."""
        return (self.acceleration.size - 1) * self.step

    @property
    def peak_ground_acceleration(self) -> float:
        """Largest absolute acceleration [m/s2]."""
        return float(np.abs(self.acceleration).max())


def checked_motions(motions: GroundMotion | Sequence[GroundMotion]) -> tuple[GroundMotion, ...]:
    """Return ground motions, or one, as a tuple; raise an error if there is none or one is something else."""
    if not isinstance(motions, GroundMotion | Iterable):
        raise TypeError(f"motions must be ground motions, got {motions!r}")
    motions = (motions,) if isinstance(motions, GroundMotion) else tuple(motions)
    if not motions:
        raise ValueError("motions is empty: give at least one GroundMotion")
    for index, motion in enumerate(motions):
        if not isinstance(motion, GroundMotion):
            raise TypeError(f"motions[{index}] is a {type(motion).__name__}; every motion must be a GroundMotion")
    return motions


def motion_names(motions: Sequence[GroundMotion | ForceHistory]) -> tuple:
    """Return the variable `motion_name` of datasets."""
    names = [getattr(motion, "name", "force history") for motion in motions]
    return "motion", np.array(names, dtype=str), {"long_name": "name of the motion", "units": "1"}


def motion_numbers(count: int) -> tuple:
    """Return the dimension coordinate `motion` of datasets."""
    return "motion", np.arange(count, dtype=np.int32), {"long_name": "index of the motion", "units": "1"}


@dataclass(frozen=True, eq=False)
class Assignment:
    """Which structure runs under which motion at which scale, one value for each sample.

    Args:
        structure: Index of the drawn structure, shape [sample].
        motion: Index of the motion, shape [sample].
        scale: Factor on the motion, shape [sample].
        im_level: Intensity measure of the scaled motion, shape [sample]; None if there is none.
        measure: Name of that intensity measure.
        units: Its units: "g" for accelerations, SI for others.
        is_striped: Whether `im_level` takes the values of a list of stripes.
        repeats: Number of consecutive samples that have a structure and a motion in common, the same throughout.
    """

    structure: np.ndarray
    motion: np.ndarray
    scale: np.ndarray
    im_level: np.ndarray | None = None
    measure: str = ""
    units: str = "g"
    is_striped: bool = False
    repeats: int = 1

    def select(self, samples: np.ndarray) -> Assignment:
        """Return the assignment of some of the samples."""
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
        """Return the assignments of several blocks of samples as one."""
        names = ("structure", "motion", "scale", "im_level")
        values = {name: [getattr(part, name) for part in parts] for name in names}
        whole: dict[str, Any] = {
            name: None if rows[0] is None else np.concatenate(rows) for name, rows in values.items()
        }
        return replace(parts[0], **whole, repeats=1)


class OneLoad:
    """A load that acts on every structure once, unscaled."""

    samples_per_structure = 1

    def assign(self, structures: np.ndarray, seed: int) -> Assignment:
        """Return one sample for each of these structures, given by their indices."""
        index = np.asarray(structures, dtype=np.int32)
        return Assignment(index, np.zeros(index.size, dtype=np.int32), np.ones(index.size))


def _checked_row(name: str, values: ArrayLike) -> np.ndarray:
    row = np.atleast_1d(finite_numbers(name, values))
    if row.ndim != 1:
        raise ValueError(f"{name} must be a row of values, one a degree of freedom, got shape {row.shape}")
    return row


@dataclass(frozen=True, eq=False)
class HarmonicForce(OneLoad):
    """Nodal forces F0 sin(w t + phase) on a structure at rest.

    Args:
        amplitude: F0 [N], shape [dof]; zero where no force acts.
        circular_frequency: w [rad/s].
        duration: Length of the run [s].
        phase: Phase [rad].
    """

    amplitude: ArrayLike
    circular_frequency: float
    duration: float
    phase: float = 0.0

    def __post_init__(self) -> None:
        object.__setattr__(self, "amplitude", _checked_row("amplitude", self.amplitude))
        object.__setattr__(self, "duration", real_number("duration [s]", self.duration, above=0))
        for name in ("circular_frequency", "phase"):
            object.__setattr__(self, name, real_number(name, getattr(self, name)))


@dataclass(frozen=True, eq=False)
class ForceHistory(OneLoad):
    """Nodal forces sampled in time on a structure at rest, linear between samples and zero after the last.

    Args:
        force: Nodal forces [N], shape [time, dof].
        step: Sampling step [s].
    """

    force: ArrayLike
    step: float

    def __post_init__(self) -> None:
        force = finite_numbers("force", self.force)
        if force.ndim != 2 or force.shape[0] < 2:
            raise ValueError(f"force must have shape [time, dof] with at least 2 times, got shape {force.shape}")
        object.__setattr__(self, "force", force)
        object.__setattr__(self, "step", real_number("step [s]", self.step, above=0))

    @property
    def values(self) -> np.ndarray:
        """What is sampled, time first."""
        return np.asarray(self.force)


@dataclass(frozen=True, eq=False)
class FreeVibration(OneLoad):
    """No load: the structure vibrates freely from an initial state.

    Args:
        duration: Length of the run [s].
        displacement: Initial displacement [m], shape [dof]; zero by default.
        velocity: Initial velocity [m/s], shape [dof]; zero by default.
    """

    duration: float
    displacement: ArrayLike = 0.0
    velocity: ArrayLike = 0.0

    def __post_init__(self) -> None:
        object.__setattr__(self, "duration", real_number("duration [s]", self.duration, above=0))
        object.__setattr__(self, "displacement", _checked_row("displacement", self.displacement))
        object.__setattr__(self, "velocity", _checked_row("velocity", self.velocity))
