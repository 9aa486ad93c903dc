"""Independent solvers of linear systems: matrix exponentials and Newmark's formulas with NumPy and SciPy alone."""

from __future__ import annotations

import numpy as np
from scipy.linalg import eigh, expm


def linear_history(mass, damping, stiffness, force, step, start=None):
    """Return displacements and velocities [time, dof] under forces that are linear between their samples.

    One matrix exponential of the state, the force and its slope is exact over a step.

    Args:
        mass: Mass matrix, shape [dof, dof].
        damping: Damping matrix.
        stiffness: Stiffness matrix.
        force: Forces, shape [time, dof].
        step: Sampling step.
        start: Displacement and velocity at the first sample; None: rest.
    """
    mass, damping, stiffness = (np.atleast_2d(np.asarray(each, float)) for each in (mass, damping, stiffness))
    n, inverse = len(mass), np.linalg.inv(mass)
    system = np.zeros((4 * n, 4 * n))
    system[:n, n : 2 * n] = np.eye(n)
    system[n : 2 * n, :n], system[n : 2 * n, n : 2 * n] = -inverse @ stiffness, -inverse @ damping
    system[n : 2 * n, 2 * n : 3 * n], system[2 * n : 3 * n, 3 * n :] = inverse, np.eye(n)
    over = expm(system * step)[: 2 * n]
    slope = np.diff(force, axis=0) / step
    inputs = force[:-1] @ over[:, 2 * n : 3 * n].T + slope @ over[:, 3 * n :].T
    states = np.zeros((len(force), 2 * n))
    if start is not None:
        states[0] = np.concatenate(start)
    growth = over[:, : 2 * n]
    for i, added in enumerate(inputs):
        states[i + 1] = growth @ states[i] + added
    return states[:, :n], states[:, n:]


def refined(force: np.ndarray, parts: int) -> np.ndarray:
    """Return samples of the same piecewise linear force, `parts` times denser."""
    coarse = np.arange(len(force))
    dense = np.arange((len(force) - 1) * parts + 1) / parts
    return np.stack([np.interp(dense, coarse, column) for column in force.T], axis=1)


def peak(values: np.ndarray) -> float:
    """Return the largest absolute value of a smooth history, by a parabola through the largest sample."""
    size = np.abs(values)
    i = int(size.argmax())
    if i in (0, len(size) - 1):
        return float(size[i])
    a, b, c = size[i - 1 : i + 2]
    return float(b + (a - c) ** 2 / (8 * (2 * b - a - c)))


def top(time: np.ndarray, values: np.ndarray) -> tuple[float, float]:
    """Return time and value of the largest excursion, by a parabola through the largest sample."""
    i = int(np.abs(values).argmax())
    a, b, c = values[i - 1 : i + 2]
    shift = (a - c) / (2 * (a - 2 * b + c))
    return float(time[i] + shift * (time[1] - time[0])), float(b - (a - c) * shift / 4)


def newmark(mass, damping, stiffness, force, step, beta, gamma=0.5):
    """Return displacements, velocities and accelerations [time, dof] by Newmark's method for a linear system."""
    mass, damping, stiffness = (np.atleast_2d(np.asarray(each, float)) for each in (mass, damping, stiffness))
    u, v = np.zeros_like(force), np.zeros_like(force)
    a = np.zeros_like(force)
    a[0] = np.linalg.solve(mass, force[0])
    effective = mass + gamma * step * damping + beta * step**2 * stiffness
    for i in range(len(force) - 1):
        ahead = u[i] + step * v[i] + step**2 * (0.5 - beta) * a[i]
        speed = v[i] + step * (1 - gamma) * a[i]
        a[i + 1] = np.linalg.solve(effective, force[i + 1] - damping @ speed - stiffness @ ahead)
        u[i + 1], v[i + 1] = ahead + beta * step**2 * a[i + 1], speed + gamma * step * a[i + 1]
    return u, v, a


def chain(stiffness) -> np.ndarray:
    """Return the stiffness matrix of a chain of springs that is fixed at its first end, shape [dof, dof]."""
    k = np.asarray(stiffness, float)
    return np.diag(k + np.append(k[1:], 0)) - np.diag(k[1:], 1) - np.diag(k[1:], -1)


def modal_damping(mass, stiffness, ratios) -> np.ndarray:
    """Return M P diag(2 zeta w) P^T M with mass-normalised shapes P, shape [dof, dof]."""
    mass = np.diag(mass) if np.ndim(mass) == 1 else np.asarray(mass, float)
    eigenvalues, shapes = eigh(stiffness, mass)
    factors = 2 * np.broadcast_to(ratios, eigenvalues.shape) * np.sqrt(eigenvalues)
    return mass @ shapes @ np.diag(factors) @ shapes.T @ mass
