"""Exact linear responses by matrix exponentials, as a reference for tests and figures."""

from __future__ import annotations

import numpy as np
from scipy.linalg import LinAlgError, eigh

from warpdyn.foundations.core.checks import finite_numbers, real_number, shortened

LARGEST_FREQUENCY = 1e9  # [rad/s]; sines of much larger arguments have no correct digits


def harmonic_response(
    mass: np.ndarray,
    damping: np.ndarray,
    stiffness: np.ndarray,
    amplitude: np.ndarray,
    frequency: float,
    phase: float,
    time: np.ndarray,
    initial_displacement: np.ndarray | None = None,
    initial_velocity: np.ndarray | None = None,
) -> tuple[np.ndarray, np.ndarray, np.ndarray]:
    """Return the exact response of M u'' + C u' + K u = F0 sin(w t + phase), for any damping, also at resonance.

    The state is augmented with the sine and cosine of the load. The times are divided into blocks. Each time needs two
    matrix exponentials, from t = 0 to the start of its block and from there to the time, so that rounding errors do not
    accumulate.

    Args:
        mass: Masses [kg], shape [dof], or mass matrix, shape [dof, dof].
        damping: Damping matrix [N s/m], shape [dof, dof].
        stiffness: Stiffness matrix [N/m], symmetric and positive definite, shape [dof, dof].
        amplitude: Force amplitudes F0 [N], shape [dof].
        frequency: Circular frequency of the load w [rad/s].
        phase: Phase of the load [rad].
        time: Uniformly spaced times from t = 0 on [s], shape [time]; the initial state is at t = 0.
        initial_displacement: Displacement at t = 0 [m], shape [dof]; None: at rest.
        initial_velocity: Velocity at t = 0 [m/s], shape [dof]; None: at rest.

    Returns:
        Displacement [m], velocity [m/s] and acceleration [m/s2], each of shape [time, dof].

    Raises:
        ValueError: If a shape does not fit, M or K is asymmetric or not positive definite, or the instants are uneven.

    Example:
        >>> mass, damping, stiffness = np.array([2.0]), np.array([[1.0]]), np.array([[200.0]])
        >>> force = dict(amplitude=np.array([10.0]), frequency=10.0, phase=0.0)  # at resonance
        >>> displacement, velocity, acceleration = wd.truth.harmonic_response(
        ...     mass, damping, stiffness, **force, time=np.arange(1, 4001) * 0.01
        ... )
        >>> float(displacement.max().round(3))  # F0 / (c w) in the end
        1.0
    """
    mass, damping, stiffness = _matrices(mass, damping, stiffness)
    dof = len(mass)
    amplitude = _vector("amplitude", amplitude, dof)
    frequency, phase = real_number("frequency [rad/s]", frequency), real_number("phase [rad]", phase)
    time = finite_numbers("time [s]", time)
    real_number("frequency times the last time [rad]", frequency * float(np.max(np.abs(time), initial=0.0)))
    if abs(frequency) > LARGEST_FREQUENCY:
        raise ValueError(f"frequency must be at most {LARGEST_FREQUENCY:g} rad/s, got {frequency:g}")
    if time.ndim != 1 or time.size < 2 or time[0] < 0 or time[-1] <= time[0]:
        raise ValueError(f"time must be a row of at least 2 increasing values [s] from 0 on, got {shortened(time)}")
    step = (time[-1] - time[0]) / (time.size - 1)
    uneven = np.abs(time - (time[0] + step * np.arange(time.size)))
    if uneven.max() > 1e-9 * step + 8 * np.spacing(time[-1]):
        raise ValueError(
            f"time must be uniform: time[{uneven.argmax()}] is {uneven.max():.3g} s off steps of {step:g} s: give "
            "time = first + step * np.arange(n)"
        )
    shape, omega, system = _modal_state(mass, damping, stiffness)
    force = shape.T @ amplitude
    # Sine and cosine are scaled by the size of the force, so that the load does not dominate the norm of the exponent.
    scale = np.linalg.norm(force) / omega[-1] or 1.0
    augmented = np.zeros((2 * dof + 2, 2 * dof + 2))
    augmented[: 2 * dof, : 2 * dof] = system
    augmented[dof : 2 * dof, 2 * dof] = force / scale
    augmented[-2, -1], augmented[-1, -2] = frequency, -frequency
    start = np.concatenate(
        [
            omega * (shape.T @ mass @ _vector("initial_displacement", initial_displacement, dof)),
            shape.T @ mass @ _vector("initial_velocity", initial_velocity, dof),
            [scale * np.sin(phase), scale * np.cos(phase)],
        ]
    )
    block = int(np.ceil(np.sqrt(time.size)))
    heads = np.array([_exponential(augmented * t) @ start for t in time[::block]])
    within = np.array([_exponential(augmented * (step * j)) for j in range(block)])
    state = np.einsum("jab,ib->ija", within, heads).reshape(-1, len(augmented))[: time.size]
    load = np.sin(frequency * time + phase)[:, None] * amplitude
    return _physical(state, [mass, damping, stiffness], shape, omega, load)


def piecewise_linear_response(
    mass: np.ndarray,
    damping: np.ndarray,
    stiffness: np.ndarray,
    force: np.ndarray,
    step: float,
    initial_displacement: np.ndarray | None = None,
    initial_velocity: np.ndarray | None = None,
) -> tuple[np.ndarray, np.ndarray, np.ndarray]:
    """Return the exact linear response, at the samples of a force, if the force is linear between its samples.

    Args:
        mass: Masses [kg], shape [dof], or mass matrix, shape [dof, dof].
        damping: Damping matrix [N s/m], shape [dof, dof].
        stiffness: Stiffness matrix [N/m], symmetric and positive definite, shape [dof, dof].
        force: Force samples [N], shape [time, dof]; a base acceleration a_g is the force -M r a_g.
        step: Time between samples [s].
        initial_displacement: Displacement at the first sample [m], shape [dof]; None: at rest.
        initial_velocity: Velocity at the first sample [m/s], shape [dof]; None: at rest.

    Returns:
        Displacement [m], velocity [m/s] and acceleration [m/s2], each of shape [time, dof].

    Raises:
        ValueError: If a shape does not fit, M or K is asymmetric or not positive definite, or the step is not above 0.

    Example:
        >>> mass, damping, stiffness = np.array([2.0]), np.array([[0.0]]), np.array([[200.0]])
        >>> force = np.full((101, 1), 10.0)  # N, applied at once
        >>> found = wd.truth.piecewise_linear_response(mass, damping, stiffness, force, step=0.01)
        >>> displacement, velocity, acceleration = found
        >>> float(displacement.max().round(3))  # twice the static displacement F / k
        0.1
    """
    mass, damping, stiffness = _matrices(mass, damping, stiffness)
    dof = len(mass)
    force = finite_numbers("force", force)
    if force.ndim != 2 or force.shape[1] != dof or not len(force):
        raise ValueError(f"force must be of shape [time, {dof}], got shape {force.shape}")
    step = real_number("step [s]", step, above=0)
    shape, omega, system = _modal_state(mass, damping, stiffness)
    augmented = np.zeros((4 * dof, 4 * dof))  # state, force, and the force's increment over the step
    augmented[: 2 * dof, : 2 * dof] = system * step
    augmented[dof : 2 * dof, 2 * dof : 3 * dof] = step * np.eye(dof)
    augmented[2 * dof : 3 * dof, 3 * dof :] = np.eye(dof)
    propagator = _exponential(augmented)[: 2 * dof]
    modal_force = force @ shape
    drive = np.hstack([modal_force[:-1], np.diff(modal_force, axis=0)]) @ propagator[:, 2 * dof :].T
    state = np.empty((len(force), 2 * dof))
    state[0, :dof] = omega * (shape.T @ mass @ _vector("initial_displacement", initial_displacement, dof))
    state[0, dof:] = shape.T @ mass @ _vector("initial_velocity", initial_velocity, dof)
    for i in range(len(force) - 1):
        state[i + 1] = propagator[:, : 2 * dof] @ state[i] + drive[i]
    return _physical(state, [mass, damping, stiffness], shape, omega, force)


def _exponential(matrix: np.ndarray) -> np.ndarray:
    """Return a matrix exponential with an error of about rounding times the norm of the matrix.

    The matrix is scaled to a norm of at most 1/2, its exponential is computed by a Taylor series, and the result is
    squared repeatedly. scipy's expm scales less: for undamped oscillations with a norm of hundreds, it loses two to
    three more digits.
    """
    squarings = max(0, int(np.frexp(np.abs(matrix).sum(axis=0).max())[1]) + 1)
    small = np.ldexp(matrix, -squarings)
    result = identity = np.eye(len(matrix))
    for power in range(15, 0, -1):  # the first omitted term is 0.5^16 / 16! = 7e-19
        result = identity + small @ result / power
    for _ in range(squarings):
        result = result @ result
    return result


def _vector(name: str, value: np.ndarray | None, dof: int) -> np.ndarray:
    value = np.zeros(dof) if value is None else finite_numbers(name, value)
    if value.shape != (dof,):
        raise ValueError(f"{name} must be of shape [{dof}], got {value.shape}")
    return value


def _matrices(mass: np.ndarray, damping: np.ndarray, stiffness: np.ndarray) -> list[np.ndarray]:
    mass = finite_numbers("mass", mass)
    if mass.ndim not in (1, 2) or not mass.size:
        raise ValueError(f"mass must be of shape [dof] or [dof, dof], got {mass.shape}")
    mass = np.diag(mass) if mass.ndim == 1 else mass
    matrices = [mass, finite_numbers("damping", damping), finite_numbers("stiffness", stiffness)]
    for name, matrix in zip(("mass", "damping", "stiffness"), matrices, strict=True):
        if matrix.shape != (len(mass), len(mass)):
            raise ValueError(f"{name} must be of shape [{len(mass)}, {len(mass)}], as mass is, got {matrix.shape}")
        if name != "damping" and not np.allclose(matrix, matrix.T, rtol=0, atol=1e-9 * np.abs(matrix).max()):
            raise ValueError(
                f"{name} must be symmetric, but differs from its transpose by up to "
                f"{np.abs(matrix - matrix.T).max():.6g}: correct it, or give (matrix + matrix.T) / 2"
            )
    return matrices


def _modal_state(mass: np.ndarray, damping: np.ndarray, stiffness: np.ndarray) -> tuple[np.ndarray, ...]:
    """Return undamped mode shapes (mass-normalised), circular frequencies [rad/s], and the matrix of the modal state.

    The state is (w q, q'), with modal coordinates q and frequencies w. The squared norm of this state is twice the
    energy. Without damping, the matrix of the state equation is skew-symmetric; its exponential loses no digits.
    """
    try:
        eigenvalue, shape = eigh(stiffness, mass)
    except LinAlgError:
        raise ValueError("mass must be positive definite: give every degree of freedom a mass above 0 kg") from None
    if eigenvalue[0] <= 0:
        raise ValueError(
            f"stiffness must be positive definite; its least generalised eigenvalue is {eigenvalue[0]:.6g} rad2/s2: "
            "restrain free motions, or correct the matrix"
        )
    omega = np.sqrt(eigenvalue)
    system = np.block([[np.zeros_like(mass), np.diag(omega)], [-np.diag(omega), -shape.T @ damping @ shape]])
    return shape, omega, system


def _physical(
    state: np.ndarray, matrices: list[np.ndarray], shape: np.ndarray, omega: np.ndarray, load: np.ndarray
) -> tuple[np.ndarray, np.ndarray, np.ndarray]:
    """Return displacement [m], velocity [m/s] and acceleration [m/s2], each of shape [time, dof], from modal states.

    The acceleration follows from the equation of motion.

    Args:
        state: Modal states (w q, q'), shape [time, 2 dof or more].
        matrices: Mass, damping and stiffness matrix.
        shape: Mode shapes, shape [dof, mode].
        omega: Circular frequencies [rad/s], shape [mode].
        load: Forces [N], shape [time, dof].
    """
    mass, damping, stiffness = matrices
    dof = len(omega)
    displacement = (state[:, :dof] / omega) @ shape.T
    velocity = state[:, dof : 2 * dof] @ shape.T
    residual = load - velocity @ damping.T - displacement @ stiffness.T
    return displacement, velocity, np.linalg.solve(mass, residual.T).T
