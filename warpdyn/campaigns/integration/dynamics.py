"""Equations of motion: the base class for all families of structures."""

from __future__ import annotations

from abc import ABC, abstractmethod
from collections.abc import Mapping, Sequence
from dataclasses import dataclass
from typing import NamedTuple

import numpy as np

from warpdyn.engine.kernels.lumped.pattern import Pattern
from warpdyn.engine.laws.springs import StoreyRules
from warpdyn.engine.methods.table import Method, StoreyForces
from warpdyn.foundations.core.thread_pool import in_parts, structures_of_a_part
from warpdyn.model.ground_motions.excitation import Excitation
from warpdyn.model.structures.structure import Structure

Arrays = dict[str, np.ndarray]
DOUBLES_AT_A_TIME = 2**22  # number of float64 values in the state matrices that are solved at the same time


@dataclass(frozen=True, eq=False)
class Vibration:
    """Properties of the linear vibration of structures, with one value for each structure.

    Args:
        period: First period [s], shape [structure].
        decay: Slowest rate of decay of free vibration [1/s], shape [structure]; NaN if it was not computed.
        stable_step: Longest step at which the integration method is stable [s], shape [structure].
        rayleigh: Rayleigh factors of mass [1/s] and stiffness [s], shape [structure, 2]; 0 without Rayleigh damping.
    """

    period: np.ndarray
    decay: np.ndarray
    stable_step: np.ndarray
    rayleigh: np.ndarray

    def select(self, structures: np.ndarray) -> Vibration:
        """Return the vibration of the given structures (indices, which may repeat)."""
        return Vibration(*(values[structures] for values in self.columns))

    @property
    def columns(self) -> tuple[np.ndarray, ...]:
        """The four arrays in the order of the arguments."""
        return self.period, self.decay, self.stable_step, self.rayleigh

    @staticmethod
    def joined(parts: Sequence[Vibration]) -> Vibration:
        """Return the vibration of several groups of structures, one after the other."""
        return Vibration(*map(np.concatenate, zip(*(part.columns for part in parts), strict=True)))


class Modes(NamedTuple):
    """Undamped modes of structures, and the modal loads.

    Args:
        shape: Mode shapes, displacements or (shear chain) storey drifts, shape [structure or 1, dof, mode].
        stiffness: Squared circular frequencies [rad2/s2], shape [structure, mode].
        damping: Modal damping [1/s]: diagonal, shape [structure, mode], or full matrix, shape [structure, mode, mode].
        mass: Modal mass [kg], which is the same in all modes, shape [structure].
        load: Modal load over modal mass. For a unit base acceleration or the sine of a harmonic force: shape
            [structure, mode]. For a unit force on each degree of freedom: shape [structure, dof, mode].
        start: Initial modal displacement and velocity, shape [2, structure, mode].
    """

    shape: np.ndarray
    stiffness: np.ndarray
    damping: np.ndarray
    mass: np.ndarray
    load: np.ndarray
    start: np.ndarray


class Dynamics(ABC):
    """Equation of motion of the structures that a scene can draw; base class for all families of structures.

    Args:
        structure: The nominal structure.
        representative: Values of the scattered parameters that represent all draws: values of two storeys are equal
            only if all values that can be drawn for these storeys are equal.

    Attributes:
        law: Device functions of the storey laws of all structures.
        forces: Properties of the storey forces that decide which integration methods are supported.
        damping: Kind of damping in the kernel, for all methods except "exact".
        viscous_dampers: Force of the viscous dampers: "none", "linear" in the velocity, or a "power" of the velocity.
        physics: Names of the rows of the table PHYSICS (such as P-Delta) that apply to the structures.
        has_drift_capacity: Whether each storey has a drift at which it collapses.
        counts_reversals: Whether each load reversal damages a storey, even a reversal caused by rounding.
        is_sensitive: Whether a small change of the step or the motion may change peak drifts a lot.
        couples_modes: Whether damping couples the undamped modes.
        needs_eigenvalues: Whether decay and stability may need the eigenvalues of full matrices.
        is_checked_by_vibration: Whether the checks of drawn structures compute matrices that their vibration needs.
        steps_modes: Whether implicit methods integrate modes instead of degrees of freedom.
        histories: Names of the variables in whole histories.
        is_packed_in_parts: Whether the kernel's arrays can be computed for some structures at a time.
        peak: Name of the peaks that decide whether a sample is reliable, and of their recorder.
        pattern: The entries of the matrices of lumped structures that are not 0; None for other families.
        error_of_float32: Estimated relative error of float32 if it is too large for a default [1]; otherwise 0.
        share_of_default_step: Default step of the structure over that of the general rule [1].
    """

    law: StoreyRules
    forces: StoreyForces
    damping: str
    viscous_dampers: str
    physics: tuple[str, ...]
    has_drift_capacity: bool
    counts_reversals: bool = False
    is_sensitive: bool = False
    couples_modes: bool
    needs_eigenvalues: bool
    is_checked_by_vibration: bool = False
    steps_modes: bool
    histories: tuple[str, ...]
    is_packed_in_parts: bool = True
    peak: tuple[str, str] = ("peak_storey_drift", "drift")
    pattern: Pattern | None = None
    error_of_float32: float = 0.0
    share_of_default_step: float = 1.0

    @abstractmethod
    def __init__(self, structure: Structure, representative: Mapping[str, np.ndarray]) -> None:
        self.structure = structure

    def parameters_of(self, drawn: Arrays, structures: slice | np.ndarray = slice(None)) -> Arrays:
        """Return every parameter of drawn structures, by name, shape [structure, ...].

        If nothing is drawn, the result contains the parameters of the nominal structure. For a LinearSystem, the
        parameters are the factors on its matrices.

        Args:
            drawn: Scattered parameters by name; the first dimension is the structure.
            structures: Indices of the structures that are returned.
        """
        if drawn:
            count = len(next(iter(drawn.values()))[structures])
        else:
            count = structures.size if isinstance(structures, np.ndarray) else 1
        return {
            name: drawn[name][structures] if name in drawn else np.broadcast_to(value, (count, *value.shape))
            for name, value in self.structure.nominal_values.items()
        }

    def vibration_of(self, drawn: Arrays, method: Method, threads: int = 1) -> Vibration:
        """Return the vibration of structures; periods: initial stiffness, stable steps: largest tangent stiffness."""
        count = len(next(iter(drawn.values()))) if drawn else 1

        def part(structures: slice) -> Vibration:
            return Vibration(*self._vibration(self.parameters_of(drawn, structures), method))

        return Vibration.joined(in_parts(part, count, threads, self.at_a_time(count, threads)))

    def at_a_time(self, structures: int, threads: int) -> int:
        """Return the number of structures whose vibration a thread computes at a time."""
        found = structures_of_a_part(structures, threads)
        if self.needs_eigenvalues:
            found = min(found, max(1, DOUBLES_AT_A_TIME // threads // (2 * self.structure.dofs) ** 2))
        return found

    def vibration_of_part(self, drawn: Arrays, method: Method, *, needs_decay: bool) -> Vibration:
        """Return the vibration of a few structures; if the decay is not needed, it may be NaN."""
        parameters = self.parameters_of(drawn)
        return Vibration(*(self._vibration if needs_decay else self._without_decay)(parameters, method))

    @abstractmethod
    def _vibration(self, parameters: Arrays, method: Method) -> tuple[np.ndarray, ...]:
        """Return first period [s], slowest decay [1/s], longest stable step [s] and Rayleigh factors of structures."""

    def _without_decay(self, parameters: Arrays, method: Method) -> tuple[np.ndarray, ...]:
        """Return the result of `_vibration`. The decay is NaN if it takes most of the time."""
        return self._vibration(parameters, method)

    @abstractmethod
    def modes(self, parameters: Arrays, excitation: Excitation, *, is_coupled: bool) -> Modes:
        """Return the undamped modes of structures.

        Args:
            parameters: Every parameter of the structures by name; the first dimension is the structure.
            excitation: The excitation.
            is_coupled: Whether the damping is returned as a full matrix.
        """

    @abstractmethod
    def pack(self, parameters: Arrays, rayleigh: np.ndarray) -> Arrays:
        """Return the arrays that kernels of step-by-step methods read, by name; the last dimension is the structure.

        Args:
            parameters: Every parameter of the structures by name; the first dimension is the structure.
            rayleigh: Rayleigh factors of mass [1/s] and stiffness [s], shape [structure, 2].
        """

    def pack_beside_modes(self, parameters: Arrays) -> Arrays:
        """Return the arrays that modal kernels read in addition to the modes; the last dimension is the structure."""
        return {}


def slowest_decay(eigenvalues: np.ndarray) -> np.ndarray:
    """Return the slowest rate of decay [1/s] of each structure from the eigenvalues of its state matrix.

    `eigenvalues` has the shape [structure, eigenvalue]; the result has the shape [structure].
    """
    return np.maximum(-eigenvalues.real.max(axis=1), 0.0)
