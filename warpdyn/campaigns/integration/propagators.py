"""Propagators: matrices that advance a linear structure by one step, for each pair of a structure and a step.

Propagators are computed in coordinates of the undamped modes, u = shape q, in which mass and stiffness are diagonal:
q'' + damping q' + stiffness q = p. If damping is diagonal too, each mode is a separate oscillator.
"""

from __future__ import annotations

from math import factorial

import numpy as np

from warpdyn.campaigns.integration.dynamics import DOUBLES_AT_A_TIME, Arrays, Dynamics, Modes
from warpdyn.engine.methods.oscillator_increments import HIGHEST_POWER, halvings_of, oscillator_increments
from warpdyn.engine.methods.table import ImplicitMethod, Method
from warpdyn.model.ground_motions.excitation import Excitation


def pack_linear(
    dynamics: Dynamics, excitation: Excitation, method: Method, parameters: Arrays, step: np.ndarray
) -> Arrays:
    """Return the arrays that the kernel of linear structures reads; the last dimension is the pair (structure, step).

    Args:
        dynamics: Equation of motion.
        excitation: The excitation.
        method: Integration method.
        parameters: Every parameter of the structure of each pair (structure, step); the first dimension is the pair.
        step: Integration step of each pair [s], shape [pair].
    """
    # An implicit method solves for all modes together, even if damping does not couple them.
    modes = dynamics.modes(parameters, excitation, is_coupled=dynamics.couples_modes or method.kind == "implicit")
    pairs, number = modes.stiffness.shape
    frequency = excitation.forcing_frequency
    by_force = modes.load.ndim == 3  # then each mode has its own load, not a share of one load
    halvings = _halvings(modes, step, frequency or 0.0)
    chosen: list[np.ndarray] = []
    parts: list[tuple[np.ndarray, np.ndarray]] = []
    # Pairs are grouped by their number of halvings, so that the result of a pair does not depend on other pairs.
    for count in np.unique(halvings):
        pairs_of_count = np.flatnonzero(halvings == count)
        for some in np.array_split(pairs_of_count, 1 + pairs_of_count.size * number**2 // DOUBLES_AT_A_TIME):
            chosen.append(some)
            parts.append(_increments(method, modes, some, step[some], frequency, by_force, int(count)))
    order = np.argsort(np.concatenate(chosen))
    propagator, response = (np.concatenate(part)[order] for part in zip(*parts, strict=True))
    return dynamics.pack_beside_modes(parameters) | {
        "propagator": propagator.reshape(pairs, -1).T,
        "load_response": response.reshape(pairs, -1).T,
        "mode_shape": modes.shape.reshape(len(modes.shape), -1).T,
        "modal_stiffness": modes.stiffness.T,
        "modal_damping": modes.damping.reshape(pairs, -1).T,
        "modal_mass": modes.mass,
        "modal_load": modes.load.reshape(pairs, -1).T,
        "initial_state": np.concatenate(list(modes.start), axis=1).T,
    }


def _halvings(modes: Modes, step: np.ndarray, frequency: float) -> np.ndarray:
    """Return how often each step is halved before the series is evaluated, so that it converges fast, shape [pair]."""
    damping = np.abs(modes.damping)
    rates = np.sqrt(modes.stiffness) + (damping if damping.ndim == 2 else damping.sum(axis=2))
    norm = step * np.maximum(rates.max(axis=1), abs(frequency))
    return halvings_of(norm)


def _increments(
    method: Method,
    modes: Modes,
    chosen: np.ndarray,
    step: np.ndarray,
    frequency: float | None,
    by_force: bool,
    halvings: int,
) -> tuple[np.ndarray, np.ndarray]:
    """Return the increments of (q, q') over a step (implicit methods: of q''), per unit of the state and of the loads.

    Args:
        method: Integration method.
        modes: The modes of all pairs of a structure and a step.
        chosen: Numbers of the pairs that are computed.
        step: Steps of the chosen pairs [s].
        frequency: Circular frequency of a harmonic load [rad/s]; None: a load that is linear within the step.
        by_force: Whether each mode has its own load.
        halvings: Number of halvings of the steps.

    Returns:
        Increments per unit of the state, shape [pair, row, state] or, for uncoupled modes, [pair, 2, mode, 2]; and per
        unit of the load at the start and at the end of the step (harmonic load: of its sine and cosine at the start),
        shape [pair, row, load, 2].
    """
    stiffness, damping, load = modes.stiffness[chosen], modes.damping[chosen], modes.load[chosen]
    number = stiffness.shape[1]
    if damping.ndim == 2:
        increments, response = oscillator_increments(stiffness, damping, step[:, None], frequency, halvings)
        return increments, response if by_force else response * load[:, None, :, None]
    loads = np.broadcast_to(np.eye(number), damping.shape) if by_force else load[:, :, None]
    if isinstance(method, ImplicitMethod):
        return _implicit(method, stiffness, damping, step[:, None, None], loads)
    return _coupled(stiffness, damping, step[:, None, None], loads, frequency, halvings)


def _coupled(
    stiffness: np.ndarray,
    damping: np.ndarray,
    h: np.ndarray,
    loads: np.ndarray,
    frequency: float | None,
    halvings: int,
) -> tuple[np.ndarray, np.ndarray]:
    """Return the increments of displacement and velocity over a step, for modes that damping couples.

    A Taylor series gives the increments over a short step, which is then doubled until it is the whole step.

    A pair is a structure with one of its steps. The algorithm is that of `oscillator_increments`, but with matrices.
    Arguments: stiffness, shape [pair, mode]; damping, shape [pair, mode, mode]; step h [s], shape [pair, 1, 1]; loads,
    shape [pair, mode, load]; frequency and halvings, and the result: see `_increments`.
    """
    omega, number = np.sqrt(stiffness), stiffness.shape[1]
    # In the state (omega q, q') the matrix is skew-symmetric except for damping, so that its powers do not grow. For
    # free motions (omega = 0) the scale is arbitrary, but must not be 0.
    omega = np.where(omega > 0, omega, omega.max(axis=1, keepdims=True))
    z = np.zeros((len(omega), 2 * number, 2 * number))
    z[:, :number, number:] = omega[:, :, None] * np.eye(number)
    z[:, number:, :number] = -(stiffness / omega)[:, :, None] * np.eye(number)
    z[:, number:, number:] = -damping
    z, turn = np.ldexp(z * h, -halvings), 1j * np.ldexp((frequency or 0.0) * h, -halvings)
    push = np.concatenate([np.zeros_like(loads), loads], axis=1)
    # Responses to a constant load (sum of z^n / (n + 1)!), to a load that rises from 0 to 1 (sum of z^n / (n + 2)!),
    # and to the load exp(i angle).
    identity, share = np.eye(2 * number), 0 * turn
    series, rising, driven = np.zeros_like(z), np.zeros_like(push), 0j * push
    for power in range(HIGHEST_POWER, -1, -1):
        series = identity / factorial(power + 1) + z @ series
        rising = push / factorial(power + 2) + z @ rising
        if frequency is not None:
            share = 1 / factorial(power + 1) + turn * share
            driven = share * push + z @ driven
    constant, increments = series @ push, z @ series
    for _ in range(halvings):
        if frequency is not None:
            driven = ((1 + np.exp(turn)) * driven + increments @ driven) / 2
            turn = 2 * turn
        rising = (constant + 2 * rising + increments @ rising) / 4
        constant = constant + increments @ constant / 2
        increments = 2 * increments + increments @ increments
    ends = [constant - rising, rising] if frequency is None else [driven.real, driven.imag]
    scale = np.concatenate([omega, np.ones_like(omega)], axis=1)
    increments = increments * scale[:, None, :] / scale[:, :, None]
    return increments, h[..., None] * np.stack(ends, axis=-1) / scale[:, :, None, None]


def _implicit(
    method: ImplicitMethod, stiffness: np.ndarray, damping: np.ndarray, h: np.ndarray, loads: np.ndarray
) -> tuple[np.ndarray, np.ndarray]:
    """Return the change of q'' over a step of an implicit method, per unit of (q, q', q'') and of the loads.

    At t + theta h the acceleration has changed by x, the velocity by theta h (a + gamma x), and the displacement by
    theta h v + (theta h)^2 (a / 2 + beta x); at t + h the acceleration has changed by x / theta.
    """
    number = stiffness.shape[1]
    identity, stiffness = np.eye(number), stiffness[:, :, None] * np.eye(number)
    reach, end = method.extension * h, 1 - method.force_lag
    effective = end * (method.gamma * reach * damping + method.beta * reach**2 * stiffness)
    effective += (1 - method.mass_lag) * identity
    by_displacement = -stiffness
    by_velocity = -damping - end * reach * stiffness
    by_acceleration = -identity - end * (reach * damping + reach**2 / 2 * stiffness)
    known = np.concatenate([by_displacement, by_velocity, by_acceleration, loads], axis=2)
    change = np.linalg.solve(method.extension * effective, known)
    by_state, by_loads = change[:, :, : 3 * number], change[:, :, 3 * number :]
    at_end = end * method.extension
    return by_state, np.stack([(1 - at_end) * by_loads, at_end * by_loads], axis=-1)
