"""Linear-quadratic regulators (LQR), and regulators with a Kalman filter (LQG); SciPy solves the Riccati equations."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from dataclasses import dataclass
from typing import Any

import numpy as np
from numpy.typing import ArrayLike
from scipy.linalg import block_diag, expm, solve_continuous_are, solve_discrete_are

from warpdyn.engine.controllers.rules import ACCELERATION, DISPLACEMENT, OF_DOFS, VELOCITY
from warpdyn.foundations.core.checks import finite_numbers, one_of, real_number, whole_number
from warpdyn.foundations.core.plausibility import PlausibilityFindings
from warpdyn.model.control.state_space import StateSpace, state_space
from warpdyn.model.structures.structure import Structure

ENERGY = "energy"
ROUNDING = 1e-9  # rounding errors of a matrix of weights, relative to its largest entry or eigenvalue


@dataclass(frozen=True, eq=False)
class Regulator:
    """A linear regulator: f = -(gain y + estimate_gain s), with the measured values y and the states s of an observer.

    After each sampling instant the states become growth s + correction y + input f, with the commands f that act. A
    regulator without an observer has only a gain.

    Args:
        gain: Shape [actuator, sensor value]; sensor values are the displacements of all degrees of freedom [m], their
            velocities [m/s] and, if the matrix has columns for them, their absolute accelerations [m/s2].
        estimate_gain: Shape [actuator, state]; None: no observer.
        growth: Shape [state, state].
        correction: Shape [state, sensor value].
        input: Shape [state, actuator].
        sampling_interval: Sampling interval for which the regulator is designed [s]; None: continuous design.
        dofs: Number of degrees of freedom for which the regulator is designed; None: not checked.

    Raises:
        ValueError: If shapes do not fit, or a value is not finite.

    Example:
        >>> velocity_feedback = wd.control.Regulator([[0.0, 0.0, 2e4, 0.0]])  # two floors
        >>> velocity_feedback.actuators, velocity_feedback.states
        (1, 0)
    """

    gain: np.ndarray
    estimate_gain: np.ndarray | None = None
    growth: np.ndarray | None = None
    correction: np.ndarray | None = None
    input: np.ndarray | None = None
    sampling_interval: float | None = None
    dofs: int | None = None

    def __post_init__(self) -> None:
        if self.dofs is not None:
            whole_number("dofs", self.dofs, 1)
        for name in ("gain", "estimate_gain", "growth", "correction", "input"):
            value = getattr(self, name)
            if value is not None:
                matrix = finite_numbers(name, value)
                if matrix.ndim != 2:
                    raise ValueError(f"{name} must be a matrix, got shape {matrix.shape}: give one row per output")
                object.__setattr__(self, name, matrix)
        observer = (self.estimate_gain, self.growth, self.correction, self.input)
        if any(each is None for each in observer) != all(each is None for each in observer):
            raise ValueError("an observer needs estimate_gain, growth, correction and input: give all four or none")
        actuators, values = self.gain.shape
        if self.estimate_gain is None:
            return
        states = self.estimate_gain.shape[1]
        due = {
            "estimate_gain": (actuators, states),
            "growth": (states, states),
            "correction": (states, values),
            "input": (states, actuators),
        }
        for name, shape in due.items():
            if getattr(self, name).shape != shape:
                raise ValueError(f"{name} has shape {getattr(self, name).shape}, but must have {shape}")

    @property
    def actuators(self) -> int:
        """Number of actuators."""
        return self.gain.shape[0]

    @property
    def observer(self) -> dict[str, np.ndarray]:
        """The matrices of the observer by name; empty without an observer."""
        named = {name: getattr(self, name) for name in ("estimate_gain", "growth", "correction", "input")}
        return {name: matrix for name, matrix in named.items() if matrix is not None}

    @property
    def states(self) -> int:
        """Number of states of the observer."""
        return 0 if self.estimate_gain is None else self.estimate_gain.shape[1]

    def kinds(self, dofs: int) -> int:
        """Return the number of kinds of sensors (2, or 3 with accelerations); raise a ValueError for other shapes."""
        values = self.gain.shape[1]
        if self.dofs is not None and self.dofs != dofs:
            raise ValueError(
                f"the regulator was designed for {self.dofs} degrees of freedom, but the structure has {dofs}: call "
                "lqr or lqg with this structure"
            )
        if values not in (2 * dofs, 3 * dofs):
            raise ValueError(
                f"the gain has {values} columns, but the structure has {dofs} degrees of freedom: it must have "
                f"{2 * dofs} (displacements, velocities) or {3 * dofs} (and absolute accelerations)"
            )
        return values // dofs


def lqr(
    structure: Structure,
    actuators: Sequence[Any],
    *,
    force_weight: ArrayLike,
    state_weight: str | ArrayLike | None = None,
    acceleration_weight: ArrayLike | None = None,
    sampling_interval: float | None = None,
    parameters: Mapping[str, ArrayLike] | None = None,
) -> Regulator:
    """Return the linear-quadratic regulator that minimises the integral of x'Q x + a'W a + f'R f for a free vibration.

    x are displacements and velocities, a absolute accelerations, and f the forces of the actuators.

    Args:
        structure: A ShearBuilding or a LumpedStructure; its initial stiffness counts.
        actuators: The actuators.
        force_weight: R: one number, or shape [actuator, actuator].
        state_weight: Q, shape [state, state]; or "energy": half of the stiffness and of the mass matrix, so that x'Q x
            is the energy of the structure [J]. None: "energy" without an `acceleration_weight`, otherwise 0.
        acceleration_weight: Diagonal of W, shape [dof]; None: 0.
        sampling_interval: Interval in which commands are held [s]; the integral and the design are those of the sampled
            system. None: continuous design.
        parameters: As in `state_space`.

    Raises:
        ValueError: If a weight has a wrong shape, R is not positive definite, or Q is not positive semidefinite.

    Example:
        >>> regulator = wd.control.lqr(building, [wd.control.Actuator(1)], force_weight=1e-8)
        >>> regulator.gain.shape
        (1, 4)
    """
    system = state_space(structure, actuators, parameters)
    weights = _weights(system, state_weight, acceleration_weight, force_weight)
    gain = _gain(system, weights, sampling_interval)
    _warn_without_effect(system, gain)
    return Regulator(gain, sampling_interval=sampling_interval, dofs=structure.dofs)


def _warn_without_effect(system: StateSpace, gain: np.ndarray) -> None:
    """Warn if a gain hardly changes the eigenvalues of the structure."""
    alone, controlled = (np.linalg.eigvals(each) for each in (system.dynamics, system.dynamics - system.input @ gain))
    nearest = np.abs(controlled[:, None] - alone).min(axis=1)
    findings = PlausibilityFindings()
    findings.add("regulator_effect", float((nearest / np.abs(alone).max()).max()))
    findings.warn()


def lqg(
    structure: Structure,
    actuators: Sequence[Any],
    *,
    force_weight: ArrayLike,
    sampling_interval: float,
    ground_noise: float,
    sensor_noise: Mapping[str, float],
    sensor_dofs: Mapping[str, Sequence[int]] | None = None,
    state_weight: str | ArrayLike | None = None,
    acceleration_weight: ArrayLike | None = None,
    parameters: Mapping[str, ArrayLike] | None = None,
) -> Regulator:
    """Return a linear-quadratic regulator that acts on the state estimated by a steady Kalman filter (LQG).

    The filter is designed for the sampled system with commands that are held between samples, for base acceleration
    that is white noise, and for independent sensor noise. An observer loses the stability margins of LQR: check the
    loop with `sampled_eigenvalues`.

    Args:
        structure, actuators, force_weight, state_weight, acceleration_weight, parameters: As in `lqr`.
        sampling_interval: Sampling interval of the control [s].
        ground_noise: Intensity of the base acceleration [m2/s3]: its two-sided spectral density times 2 pi.
        sensor_noise: Standard deviation of the noise of each kind of sensor: {"acceleration": 0.01}; kinds
            "displacement" [m], "velocity" [m/s] and "acceleration" (absolute) [m/s2]. Other kinds are not measured.
        sensor_dofs: Indices (from 0) of the degrees of freedom with sensors, by kind; None: all.

    Raises:
        ValueError: If a weight has a wrong shape, a number is out of its range, or a kind of sensor is unknown.

    Example:
        >>> damper = [wd.control.Actuator(1)]
        >>> noise = dict(ground_noise=1e-3, sensor_noise={"acceleration": 0.01})
        >>> wd.control.lqg(building, damper, force_weight=1e-8, sampling_interval=0.01, **noise).states
        5
    """
    interval = real_number("sampling_interval [s]", sampling_interval, above=0)
    intensity = real_number("ground_noise [m2/s3]", ground_noise, above=0)
    system = state_space(structure, actuators, parameters)
    weights = _weights(system, state_weight, acceleration_weight, force_weight)
    regulator = _gain(system, weights, interval)
    dofs, forces = len(system.mass), system.input.shape[1]
    rows, direct, noise, chosen = _sensors(system, sensor_noise, sensor_dofs)
    states = 2 * dofs
    # Van Loan 1978: covariance of the state after an interval of white noise.
    shaped = intensity * np.outer(system.ground, system.ground)
    block = expm(interval * np.block([[-system.dynamics, shaped], [np.zeros((states, states)), system.dynamics.T]]))
    growth, driven = sampled_system(system, interval)
    covariance = growth @ block[:states, states:]
    covariance = (covariance + covariance.T) / 2
    prior = solve_discrete_are(growth.T, rows.T, covariance, np.diag(noise**2))
    kalman = np.linalg.solve(rows @ prior @ rows.T + np.diag(noise**2), rows @ prior).T
    # The states of the observer are the predicted state and the commands that acted until this instant.
    kept = np.eye(states) - kalman @ rows
    through = -kalman @ direct
    whole = np.zeros((states, (3 if ACCELERATION in sensor_noise else 2) * dofs))
    whole[:, chosen] = kalman
    none = np.zeros((forces, states + forces))
    return Regulator(
        gain=regulator @ whole,
        estimate_gain=regulator @ np.hstack([kept, through]),
        growth=np.vstack([growth @ np.hstack([kept, through]), none]),
        correction=np.vstack([growth @ whole, np.zeros((forces, whole.shape[1]))]),
        input=np.vstack([driven, np.eye(forces)]),
        sampling_interval=interval,
        dofs=dofs,
    )


def sampled_system(system: StateSpace, interval: float) -> tuple[np.ndarray, np.ndarray]:
    """Return the matrices that advance the state and the held forces by an interval [s]: [state, state or actuator]."""
    states, forces = system.input.shape
    block = np.zeros((states + forces, states + forces))
    block[:states, :states], block[:states, states:] = system.dynamics, system.input
    whole = expm(interval * block)
    return whole[:states, :states], whole[:states, states:]


def _weights(
    system: StateSpace, state_weight: Any, acceleration_weight: Any, force_weight: Any
) -> tuple[np.ndarray, np.ndarray, np.ndarray]:
    """Return the weights of states, of states times forces, and of forces."""
    states, forces = system.input.shape
    if not forces:
        raise ValueError("a regulator needs an actuator: give actuators=[wd.control.Actuator(1)]")
    if state_weight is None:
        state_weight = ENERGY if acceleration_weight is None else np.zeros((states, states))
    is_energy = isinstance(state_weight, str)
    if is_energy:
        one_of("state_weight", state_weight, (ENERGY,))
        state_weight = block_diag(system.stiffness, system.mass) / 2
    of_states = finite_numbers("state_weight", state_weight)
    if of_states.shape != (states, states):
        raise ValueError(f"state_weight must have shape {(states, states)}, got {of_states.shape}")
    _check_symmetric("state_weight", of_states)
    if not is_energy:
        _check_semidefinite(of_states)
    of_forces = finite_numbers("force_weight", force_weight)
    of_forces = of_forces * np.eye(forces) if of_forces.ndim == 0 else of_forces
    if of_forces.shape != (forces, forces):
        raise ValueError(f"force_weight must be one number or have shape {(forces, forces)}, got {of_forces.shape}")
    _check_symmetric("force_weight", of_forces)
    if np.linalg.eigvalsh(of_forces).min() <= 0:
        raise ValueError("force_weight must be positive (definite): otherwise the forces have no bound")
    mixed = np.zeros((states, forces))
    if acceleration_weight is not None:
        weight = finite_numbers("acceleration_weight", acceleration_weight)
        if weight.shape not in ((), (states // 2,)):
            raise ValueError(f"acceleration_weight must have shape {(states // 2,)}, got {weight.shape}")
        if weight.min() < 0:
            raise ValueError("acceleration_weight must be at least 0")
        rows, direct = system.accelerations
        weight = np.broadcast_to(weight, (states // 2,))[:, None]
        of_states = of_states + rows.T @ (weight * rows)
        mixed = rows.T @ (weight * direct)
        of_forces = of_forces + direct.T @ (weight * direct)
    return of_states, mixed, of_forces


def _check_symmetric(name: str, weight: np.ndarray) -> None:
    """Raise a ValueError if a matrix of weights is not symmetric."""
    if np.abs(weight - weight.T).max() > ROUNDING * np.abs(weight).max():
        raise ValueError(f"{name} must be symmetric: give ({name} + {name}.T) / 2, which has the same cost")


def _check_semidefinite(of_states: np.ndarray) -> None:
    """Raise a ValueError if the weight of the states has a negative eigenvalue, beyond rounding errors."""
    size = np.sqrt(np.abs(np.diag(of_states)))
    scale = 1 / np.where(size > 0, size, 1.0)  # displacements and velocities have different units
    eigenvalues = np.linalg.eigvalsh(scale[:, None] * (of_states + of_states.T) / 2 * scale)
    if eigenvalues.min() < -1e-9 * np.abs(eigenvalues).max():
        raise ValueError(
            "state_weight must be positive semidefinite, but it has a negative eigenvalue, so that the regulator would "
            "increase the vibration: correct its signs, or give a matrix C.T @ C of the outputs C x that must be small"
        )


def _gain(system: StateSpace, weights: tuple[np.ndarray, np.ndarray, np.ndarray], interval: float | None) -> np.ndarray:
    of_states, mixed, of_forces = weights
    a, b = system.dynamics, system.input
    try:
        if interval is None:
            cost = solve_continuous_are(a, b, of_states, of_forces, s=mixed)
            return np.linalg.solve(of_forces, b.T @ cost + mixed.T)
        real_number("sampling_interval [s]", interval, above=0)
        states, forces = b.shape
        size = states + forces
        # Van Loan 1978: the integral of the weights over an interval in which the forces are held.
        held = np.zeros((size, size))
        held[:states, :states], held[:states, states:] = a, b
        weight = np.block([[of_states, mixed], [mixed.T, of_forces]])
        whole = expm(interval * np.block([[-held.T, weight], [np.zeros((size, size)), held]]))
        after = whole[size:, size:]
        integral = after.T @ whole[:size, size:]
        integral = (integral + integral.T) / 2
        growth, driven = after[:states, :states], after[:states, states:]
        q, s, r = integral[:states, :states], integral[:states, states:], integral[states:, states:]
        cost = solve_discrete_are(growth, driven, q, r, s=s)
        return np.linalg.solve(r + driven.T @ cost @ driven, driven.T @ cost @ growth + s.T)
    except np.linalg.LinAlgError as error:
        raise ValueError(
            f"the Riccati equation has no solution ({error}): the actuators must reach every undamped mode, and the "
            "weights must not be too far apart; change force_weight"
        ) from None


def _sensors(
    system: StateSpace, noise: Mapping[str, float], places: Mapping[str, Sequence[int]] | None
) -> tuple[np.ndarray, np.ndarray, np.ndarray, list[int]]:
    """Return the rows of the sensors for states and forces, their noise, and their places among the sensor values."""
    dofs, forces = len(system.mass), system.input.shape[1]
    if not isinstance(noise, Mapping) or not noise:
        raise ValueError('sensor_noise must name the sensors, such as {"acceleration": 0.01} (m/s2)')
    of_acceleration, direct_of_acceleration = system.accelerations
    eye = np.eye(2 * dofs)
    rows = {DISPLACEMENT: eye[:dofs], VELOCITY: eye[dofs:], ACCELERATION: of_acceleration}
    found, direct, sizes, chosen = [], [], [], []
    for kind, deviation in noise.items():
        one_of("kind of sensor", kind, OF_DOFS)
        deviation = real_number(f"sensor_noise of {kind}", deviation, above=0)
        for dof in range(dofs) if places is None or kind not in places else places[kind]:
            if not 0 <= dof < dofs:
                raise ValueError(f"sensor_dofs of {kind} has {dof}, but the degrees of freedom are 0 to {dofs - 1}")
            found.append(rows[kind][dof])
            direct.append(direct_of_acceleration[dof] if kind == ACCELERATION else np.zeros(forces))
            sizes.append(deviation)
            chosen.append(OF_DOFS.index(kind) * dofs + dof)
    return np.array(found), np.array(direct), np.array(sizes), chosen
