"""What shakes a structure, as data: recorded base motions, nodal forces, or an initial state alone."""

from __future__ import annotations

from dataclasses import dataclass, field

import numpy as np
from numpy.typing import ArrayLike

from warpdyn.checks import finite_numbers, real_number, real_numbers

STANDARD_GRAVITY = 9.80665  # m/s2, exact by definition (CGPM 1901)
IN_G = f"g is standard gravity, {STANDARD_GRAVITY} m s-2"  # comment of every variable in g, which UDUNITS reads as gram


@dataclass(frozen=True, eq=False)
class GroundMotion:
    """One recorded base acceleration, linear between its samples and zero after its end.

    Args:
        acceleration: Ground acceleration [m/s2], shape [time]; the first value acts at t = 0.
        step: Sampling step of the record [s].
        name: What the record is called in results.
        source: Where it came from (a file, a package), kept for the record's trace.

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
        """What is sampled, time first."""
        return self.acceleration

    @property
    def duration(self) -> float:
        """Time from the first to the last sample [s]."""
        return (self.acceleration.size - 1) * self.step

    @property
    def peak_ground_acceleration(self) -> float:
        """Largest absolute acceleration [m/s2]."""
        return float(np.abs(self.acceleration).max())


@dataclass(frozen=True, eq=False)
class Assignment:
    """Which structure runs under which motion at which scale, one value a sample.

    Args:
        structure: Index of the drawn structure, shape [sample].
        motion: Index of the motion, shape [sample].
        scale: Factor on the motion, shape [sample].
        im_level: Intensity measure of the scaled motion [g], shape [sample], or None where there is none.
        measure: Name of that intensity measure.
        is_striped: Whether `im_level` takes the values of a list of stripes.
    """

    structure: np.ndarray
    motion: np.ndarray
    scale: np.ndarray
    im_level: np.ndarray | None = None
    measure: str = ""
    is_striped: bool = False


def assign_one(structures: int) -> Assignment:
    """Return one sample a structure under the one load there is."""
    return Assignment(np.arange(structures, dtype=np.int32), np.zeros(structures, dtype=np.int32), np.ones(structures))


def _checked_row(name: str, values: ArrayLike) -> np.ndarray:
    row = np.atleast_1d(finite_numbers(name, values))
    if row.ndim != 1:
        raise ValueError(f"{name} must be a row of values, one a degree of freedom, got shape {row.shape}")
    return row


@dataclass(frozen=True, eq=False)
class HarmonicForce:
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

    def assign(self, structures: int, seed: int) -> Assignment:
        """Return one sample a structure."""
        return assign_one(structures)


@dataclass(frozen=True, eq=False)
class ForceHistory:
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
        return self.force

    def assign(self, structures: int, seed: int) -> Assignment:
        """Return one sample a structure."""
        return assign_one(structures)


@dataclass(frozen=True, eq=False)
class FreeVibration:
    """No load: the structure moves on from an initial state.

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

    def assign(self, structures: int, seed: int) -> Assignment:
        """Return one sample a structure."""
        return assign_one(structures)
