"""Excitations by nodal forces on a structure, or by an initial state."""

from __future__ import annotations

from dataclasses import dataclass, replace
from typing import TYPE_CHECKING

import numpy as np
from numpy.typing import ArrayLike

from warpdyn.foundations.core.checks import finite_numbers, real_number
from warpdyn.foundations.core.messages import amount_of
from warpdyn.foundations.core.near_misses import suggests_names, with_suggestions
from warpdyn.foundations.core.plausibility import PlausibilityFindings
from warpdyn.model.ground_motions.excitation import (
    THE_DURATION,
    SingleLoad,
    Timeline,
    resampled_columns,
    substeps_of,
)

if TYPE_CHECKING:
    from warpdyn.model.structures.structure import Structure

MOST_FORCES = 2**24  # largest number of samples of a force that `unbalance_force` returns
MOST_NAMED = 3  # rotations that an error message names


class FormulaLoad(SingleLoad):
    """Base class of loads that are formulas of time. The run ends when the load ends."""

    duration: float
    has_tail = False

    def timeline(self, step: float | None, target: float, *, resample: bool) -> Timeline:
        """Return the time grid: integration steps that divide the duration."""
        count = substeps_of(self.duration, step, target, THE_DURATION)
        return Timeline((), np.array([self.duration / count]), np.array([1]), np.array([count]))


def _checked_row(name: str, values: ArrayLike) -> np.ndarray:
    row = np.atleast_1d(finite_numbers(name, values))
    if row.ndim != 1 or not row.size:
        raise ValueError(f"{name} must be a row of values, one per degree of freedom, got shape {row.shape}")
    return row


class _FromInitialState:
    """Base class of loads with the fields `initial_displacement` [m] and `initial_velocity` [m/s]."""

    initial_displacement: ArrayLike
    initial_velocity: ArrayLike

    def __post_init__(self) -> None:
        for name in ("initial_displacement", "initial_velocity"):
            object.__setattr__(self, name, _checked_row(name, getattr(self, name)))

    @property
    def start(self) -> tuple[ArrayLike, ArrayLike]:
        """Initial displacement [m] and velocity [m/s], each with one value for all or one per degree of freedom."""
        return self.initial_displacement, self.initial_velocity


@with_suggestions
@dataclass(frozen=True, eq=False)
class HarmonicForce(_FromInitialState, FormulaLoad):
    """Nodal forces F0 sin(w t + phase) on a structure.

    Args:
        amplitude: Amplitude F0 [N], shape [dof]; 0 for a degree of freedom without a force.
        circular_frequency: Circular frequency w [rad/s]; 0: constant force F0 sin(phase).
        duration: Duration of the run [s].
        phase: Phase [rad].
        initial_displacement: Initial displacement [m], shape [dof], or one value for all; see FreeVibration.
        initial_velocity: Initial velocity [m/s], shape [dof], or one value for all.

    Raises:
        ValueError: If a value is not finite, the circular frequency is below 0 or the duration not above 0.

    Example:
        >>> shaker = wd.HarmonicForce([0.0, 2e3], circular_frequency=20.0, duration=5.0)
        >>> wd.Scene(building, shaker).excitation.amplitude
        array([   0., 2000.])
    """

    amplitude: ArrayLike
    circular_frequency: float
    duration: float
    phase: float = 0.0
    initial_displacement: ArrayLike = 0.0
    initial_velocity: ArrayLike = 0.0

    kernel_load = "harmonic_force"
    is_force = True

    def __post_init__(self) -> None:
        super().__post_init__()
        object.__setattr__(self, "amplitude", _checked_row("amplitude", self.amplitude))
        object.__setattr__(self, "duration", real_number("duration [s]", self.duration, above=0))
        frequency = real_number("circular_frequency [rad/s]", self.circular_frequency, least=0)
        object.__setattr__(self, "circular_frequency", frequency)
        object.__setattr__(self, "phase", real_number("phase [rad]", self.phase))
        findings = PlausibilityFindings()
        findings.add("phase", abs(self.phase), " of the HarmonicForce")
        findings.warn()

    @property
    def forcing_frequency(self) -> float:
        """Circular frequency of the harmonic force [rad/s]."""
        return self.circular_frequency

    @suggests_names
    def history(self, step: float) -> ForceHistory:
        """Return the samples of the force, e.g. for `ForceStripes` with a different frequency for each structure.

        Args:
            step: Sampling step [s], at most 1/20 of the period; the force is linear between samples, which is too small
                by up to (w step)^2 / 12.

        Raises:
            ValueError: If the step is out of range.

        Example:
            >>> forces = [wd.HarmonicForce([0.0, 2e3], w, duration=5.0).history(0.01) for w in (5.0, 8.0, 12.0)]
            >>> design = wd.ForceStripes([[each] for each in forces], [5.0, 8.0, 12.0], "circular frequency", "rad s-1")
        """
        step = real_number("HarmonicForce.history: step [s]", step, above=0)
        longest = min(self.duration, 2 * np.pi / self.circular_frequency / 20 if self.circular_frequency else np.inf)
        if step > longest * (1 + 1e-9):
            raise ValueError(
                f"HarmonicForce.history: step={step:g} s is too long for {self.circular_frequency:g} rad/s: give at "
                f"most {longest:.3g} s"
            )
        count = np.ceil(self.duration / step * (1 - 1e-12))
        if count > MOST_FORCES:
            raise ValueError(f"HarmonicForce.history: step={step:g} s makes {count:,.0f} samples: give a longer step=")
        time = step * np.arange(int(count) + 1)
        force = np.sin(self.circular_frequency * time + self.phase)[:, None] * np.asarray(self.amplitude)
        return ForceHistory(force, step, self.initial_displacement, self.initial_velocity)

    def check_fits(self, structure: Structure) -> None:
        """Raise a ValueError if amplitudes or the initial state do not fit the structure's degrees of freedom."""
        _check_width("HarmonicForce.amplitude", self.amplitude, structure, serves_all=False)
        _check_start_fits(self, structure)

    def pack_values(self, timeline: Timeline) -> dict[str, np.ndarray]:
        """Return the arrays that kernels read: amplitudes [N], circular frequency [rad/s] and phase [rad]."""
        return {
            "amplitude": np.asarray(self.amplitude),
            "circular_frequency": np.array([self.circular_frequency]),
            "phase": np.array([self.phase]),
        }

    def modal_load(self, shape: np.ndarray, momentum: np.ndarray, influence: np.ndarray) -> np.ndarray:
        """Return the modal loads if the sine is 1, shape [structure, mode]; see `Excitation.modal_load`."""
        return np.asarray(self.amplitude) @ shape


@with_suggestions
@dataclass(frozen=True, eq=False)
class ForceHistory(_FromInitialState, SingleLoad):
    """Sampled nodal forces on a structure, linear between samples and zero after the last sample.

    At the time of the last sample, the force still acts, so that the acceleration at this time includes its effect.

    Args:
        force: Nodal forces [N], shape [time, dof].
        step: Sampling step [s].
        initial_displacement: Displacement at the first sample [m], shape [dof], or one value for all; see
            FreeVibration.
        initial_velocity: Velocity at the first sample [m/s], shape [dof], or one value for all.

    Raises:
        ValueError: If there are fewer than two times, a force or an initial value is not finite, or the step is not
            finite and above 0.

    Example:
        >>> push = wd.ForceHistory([[0.0, 0.0], [1e4, 2e4], [0.0, 0.0]], step=0.1)
        >>> wd.Scene(building, push).excitation.force.shape
        (3, 2)
    """

    force: ArrayLike
    step: float
    initial_displacement: ArrayLike = 0.0
    initial_velocity: ArrayLike = 0.0

    def __repr__(self) -> str:
        times, dofs = self.values.shape
        return f"ForceHistory({times} values every {self.step:g} s, {dofs} degrees of freedom)"

    kernel_load = "force_history"
    label = "force history"
    is_force = True

    def __post_init__(self) -> None:
        super().__post_init__()
        force = finite_numbers("force", self.force)
        if force.ndim != 2 or force.shape[0] < 2:
            raise ValueError(f"force must have shape [time, dof] with at least 2 times, got shape {force.shape}")
        object.__setattr__(self, "force", force)
        object.__setattr__(self, "step", real_number("step [s]", self.step, above=0))

    @property
    def values(self) -> np.ndarray:
        """Sampled forces [N], shape [time, dof]."""
        return np.asarray(self.force)

    @property
    def motions(self) -> tuple[ForceHistory, ...]:
        """A tuple that contains only this force history: the sampled history of the load."""
        return (self,)

    def resampled(self, step: float) -> ForceHistory:
        """Return the force history with another step [s], by linear interpolation between samples."""
        return replace(self, force=resampled_columns(self.values, self.step, step), step=step)

    def check_fits(self, structure: Structure) -> None:
        """Raise a ValueError if forces or the initial state do not fit the structure's degrees of freedom."""
        columns = self.values.shape[1]
        if columns != structure.dofs:
            raise ValueError(
                f"ForceHistory.force has {amount_of(columns, 'column')}, but the structure has "
                f"{freedom_of(structure)}: give one column per degree of freedom, shape [time, {structure.dofs}]"
            )
        _check_start_fits(self, structure)

    def modal_load(self, shape: np.ndarray, momentum: np.ndarray, influence: np.ndarray) -> np.ndarray:
        """Return the modal loads of a unit force on each degree of freedom, shape [structure, dof, mode]."""
        return shape


@with_suggestions
@dataclass(frozen=True, eq=False)
class FreeVibration(FormulaLoad):
    """Free vibration from an initial state, without load.

    For a nonlinear building, the initial displacement is reached by a slow monotonic pull from rest, so that the storey
    forces at the start are forces of first loading. Energies are counted from the release.

    Args:
        duration: Duration of the run [s].
        displacement: Initial displacement [m] ([rad] of a rotation), shape [dof], or one value for all; zero by
            default. A structure with translations and rotations needs one value per degree of freedom.
        velocity: Initial velocity [m/s] ([rad/s] of a rotation), as `displacement`.

    Raises:
        ValueError: If the duration is not finite and above 0, or a displacement or velocity is not finite.

    Example:
        >>> struck = wd.FreeVibration(duration=2.0, velocity=[0.0, 0.5])
        >>> wd.Scene(building, struck).excitation.velocity
        array([0. , 0.5])
    """

    duration: float
    displacement: ArrayLike = 0.0
    velocity: ArrayLike = 0.0

    kernel_load = "free_vibration"

    def __post_init__(self) -> None:
        object.__setattr__(self, "duration", real_number("duration [s]", self.duration, above=0))
        object.__setattr__(self, "displacement", _checked_row("displacement", self.displacement))
        object.__setattr__(self, "velocity", _checked_row("velocity", self.velocity))

    def check_fits(self, structure: Structure) -> None:
        """Raise a ValueError unless the initial state has one value for all degrees of freedom or one for each."""
        _check_start_fits(self, structure)

    def pack_values(self, timeline: Timeline) -> dict[str, np.ndarray]:
        """Return an empty dictionary, because the load consists only of the initial state."""
        return {}

    @property
    def start(self) -> tuple[ArrayLike, ArrayLike]:
        """Initial displacement [m] and initial velocity [m/s]."""
        return self.displacement, self.velocity


def _check_start_fits(load: HarmonicForce | ForceHistory | FreeVibration, structure: Structure) -> None:
    """Raise a ValueError unless the initial state has one value for all degrees of freedom or one for each."""
    prefix = "" if isinstance(load, FreeVibration) else "initial_"
    for name, values in zip(("displacement", "velocity"), load.start, strict=True):
        called = f"{type(load).__name__}.{prefix}{name}"
        _check_width(called, values, structure, serves_all=True)
        turning = structure.rotating_dofs
        if np.size(values) < structure.dofs and np.any(values) and 0 < len(turning) < structure.dofs:
            units = structure.units_along(("dof",), "m" if name == "displacement" else "m s-1")
            more = f" and {len(turning) - MOST_NAMED} more" if len(turning) > MOST_NAMED else ""
            raise ValueError(
                f"{called} has 1 value [{units}], which would be that of translations and of rotations "
                f"({', '.join(turning[:MOST_NAMED])}{more}): give one value per degree of freedom, shape "
                f"[{structure.dofs}]"
            )


def freedom_of(structure: Structure) -> str:
    """Return the structure's number of degrees of freedom as text, such as "2 degrees of freedom"."""
    return amount_of(structure.dofs, "degree of freedom", "degrees of freedom")


def _check_width(name: str, values: ArrayLike, structure: Structure, *, serves_all: bool) -> None:
    """Raise a ValueError unless there is one value per degree of freedom (or a single value, if `serves_all`)."""
    size = np.size(values)
    if size != structure.dofs and (size != 1 or not serves_all):
        raise ValueError(
            f"{name} has {amount_of(size, 'value')}, but the structure has {freedom_of(structure)}: give one value per "
            "degree of freedom"
        )


@suggests_names
def unbalance_force(
    unbalance: float, *, acceleration: float, duration: float, step: float, speed: float = 0.0
) -> ForceHistory:
    """Return the force of an unbalanced rotor in two directions, with a constant angular acceleration.

    With the angle p, m e (p'^2 cos(p) + p'' sin(p)) in x and m e (p'^2 sin(p) - p'' cos(p)) in y: proportional to the
    square of the speed. The force is linear between samples, so that it is too small by about 3.3 / n^2 with n samples
    per turn.

    Args:
        unbalance: Mass times eccentricity m e [kg m], such as that of `wd.UnbalancedRotor`.
        acceleration: Angular acceleration p'' [rad/s2]; 0: constant speed; negative: run-down.
        duration: Duration [s].
        step: Sampling step of the force [s].
        speed: Speed at the start [rad/s].

    Raises:
        ValueError: If a value is not finite or is out of its range.

    Example:
        >>> wd.unbalance_force(0.01, acceleration=200.0, duration=1.5, step=2e-4)
        ForceHistory(7501 values every 0.0002 s, 2 degrees of freedom)
    """
    own = real_number("unbalance [kg m]", unbalance, above=0)
    rate, first = real_number("acceleration [rad/s2]", acceleration), real_number("speed [rad/s]", speed)
    dt, whole = real_number("step [s]", step, above=0), real_number("duration [s]", duration, above=0)
    if not 0.5 < whole / dt <= MOST_FORCES:
        raise ValueError(f"duration over step is {whole / dt:,.0f}; it must be from 1 to {MOST_FORCES:,}: change step=")
    time = dt * np.arange(round(whole / dt) + 1)
    turning, angle = first + rate * time, first * time + 0.5 * rate * time**2
    cosine, sine = np.cos(angle), np.sin(angle)
    force = np.stack([turning**2 * cosine + rate * sine, turning**2 * sine - rate * cosine], axis=1)
    return ForceHistory(own * force, dt)
