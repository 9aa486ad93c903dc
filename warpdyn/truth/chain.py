"""Shear chains of yielding storeys, described by storey drifts and memories, for the exact responses."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np
from numpy.typing import ArrayLike
from scipy.linalg import eigh

from warpdyn.engine.laws import HARDENING_RATIO, YIELD_FORCE, Parameter
from warpdyn.foundations.core.checks import finite_numbers, real_number

POSITIVE = Parameter("", "", low=0.0, low_open=True)


@dataclass(frozen=True, eq=False)
class YieldingResponse:
    """Response of a shear chain of yielding storeys at the times of the load samples.

    Args:
        displacement: Floor displacement [m], shape [time, storey].
        velocity: Floor velocity [m/s], shape [time, storey].
        memory: Hysteretic force of each storey divided by its yield force (z of Bouc-Wen) [-], shape [time, storey].
            For bilinear storeys, drift - memory yield_force / stiffness is the plastic drift.
        hysteretic_energy: Energy dissipated by each storey since the start [J], shape [time, storey].
        peak_storey_drift: Largest absolute drift of each storey [m], also between samples, shape [storey].
    """

    displacement: np.ndarray
    velocity: np.ndarray
    memory: np.ndarray
    hysteretic_energy: np.ndarray
    peak_storey_drift: np.ndarray


class ShearChain:
    """Shear chain whose storeys have the force a k d + (1 - a) Fy z at the drift d.

    a is the hardening ratio, k the elastic stiffness, Fy the yield force and z the memory of the storey. The state is
    (d, d', z). Drifts are used instead of floor displacements, because the drift rate of a storey at rest is then
    exactly 0.

    Args:
        mass: Floor mass [kg], shape [storey].
        stiffness: Elastic storey stiffness from the ground up [N/m], shape [storey] or one for all.
        yield_force: Storey yield force [N], shape [storey] or one for all.
        hardening_ratio: Stiffness after yield over elastic stiffness [-], shape [storey] or one for all.
        damping: Viscous damping matrix of the floors [N s/m], shape [storey, storey].
        force: Force on each floor [N], shape [time, storey].
        step: Time between samples [s].

    Raises:
        ValueError: If a value is out of its range or a shape does not fit.
    """

    def __init__(
        self,
        mass: ArrayLike,
        stiffness: ArrayLike,
        yield_force: ArrayLike,
        hardening_ratio: ArrayLike,
        damping: ArrayLike,
        force: ArrayLike,
        step: float,
    ) -> None:
        mass = finite_numbers("mass", mass)
        if mass.ndim != 1 or not mass.size:
            raise ValueError(f"mass must have shape [storey], got {mass.shape}")
        n = self.storeys = mass.size
        mass = self.one_per_storey("mass", mass, POSITIVE)
        stiffness = self.one_per_storey("stiffness", stiffness, POSITIVE)
        yield_force = self.one_per_storey("yield_force", yield_force, YIELD_FORCE)
        hardening_ratio = self.one_per_storey("hardening_ratio", hardening_ratio, HARDENING_RATIO)
        damping, force = finite_numbers("damping", damping), finite_numbers("force", force)
        if damping.shape != (n, n):
            raise ValueError(f"damping must have shape [{n}, {n}], got {damping.shape}")
        if force.ndim != 2 or not len(force) or force.shape[1] != n:
            raise ValueError(f"force must have shape [time, {n}], got {force.shape}")
        self.step = real_number("step", step, above=0)
        with np.errstate(over="ignore"):
            self.yield_drift = yield_force / stiffness
        finite_numbers("yield_force over stiffness", self.yield_drift)
        self.hysteretic_force = (1 - hardening_ratio) * yield_force
        drifts_of_floors = np.eye(n) - np.eye(n, k=-1)
        drifts_of_forces = drifts_of_floors / mass  # matrix from forces on floors to accelerations of drifts
        self.load = force @ drifts_of_forces.T
        of_storey_forces = drifts_of_forces @ drifts_of_floors.T
        self.viscous = drifts_of_forces @ damping @ np.tri(n)
        # d'' = generator @ (d, d', z) + load
        self.generator = -np.hstack(
            [of_storey_forces * (hardening_ratio * stiffness), self.viscous, of_storey_forces * self.hysteretic_force]
        )
        stiffness_matrix = drifts_of_floors.T @ (stiffness[:, None] * drifts_of_floors)
        root = np.sqrt(mass)
        # Upper bound of the circular frequencies [rad/s]: no tangent stiffness is larger than the elastic stiffness.
        self.fastest = np.sqrt(eigh(stiffness_matrix, np.diag(mass), eigvals_only=True)[-1])
        self.fastest += np.linalg.norm(damping / np.outer(root, root), 2)

    def one_per_storey(self, name: str, value: ArrayLike, parameter: Parameter | None = None) -> np.ndarray:
        """Return a parameter as an array [storey]; raise a ValueError if its shape or a value is not allowed.

        Args:
            name: Name of the parameter, for messages.
            value: One value, or one value per storey.
            parameter: Bounds of the parameter; None: any finite value is allowed.
        """
        array = finite_numbers(name, value)
        if array.shape not in ((), (self.storeys,)):
            raise ValueError(
                f"{name} must be one value or one per storey, shape [{self.storeys}], got {array.shape}: mass has "
                f"{self.storeys} storeys"
            )
        array = np.array(np.broadcast_to(array, self.storeys))
        problem = parameter and parameter.first_violation(name, array, ("storey",))
        if problem:
            raise ValueError(problem)
        return array

    def start(self, displacement: ArrayLike, velocity: ArrayLike) -> np.ndarray:
        """Return the state (d, d', 0) of the chain from displacements [m] and velocities [m/s] of the floors."""
        displacement = self.one_per_storey("initial_displacement", displacement)
        velocity = self.one_per_storey("initial_velocity", velocity)
        return np.concatenate([np.diff(displacement, prepend=0), np.diff(velocity, prepend=0), np.zeros(self.storeys)])

    def response(self, history: np.ndarray, peak_storey_drift: np.ndarray) -> YieldingResponse:
        """Return the response from the history of (d, d', z, dissipated energy), [time, 4 storey], and peak drifts."""
        drift, rate, memory, energy = np.split(history, 4, axis=1)
        return YieldingResponse(drift.cumsum(axis=1), rate.cumsum(axis=1), memory, energy, peak_storey_drift)
