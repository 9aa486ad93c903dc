"""Independent variances of linear systems under random base motion, with their standard errors; no warpdyn here."""

from __future__ import annotations

import numpy as np
from scipy.linalg import expm

from .chains_truth import SEED
from .problem import Outcome

INTENSITY, INTERVAL, SAMPLES = 0.01, 0.02, 2**14
OMEGA, RATIO = 2 * np.pi, 0.05
TIMES = (1.0, 2.0, 5.0, 10.0)
SEED_TIME, SEED_SAMPLES = 20.0, 2**13
GROUND = (15.0, 0.6)  # rad/s, damping ratio


def white_noise_variances(mass, damping, stiffness, times):
    """Return variances of the displacements [time, dof] from rest under noise that is linear between its nodes.

    The nodes are independent with variance 2 pi S0 / interval; the covariance of state and node is propagated.
    """
    n = len(mass)
    moving = np.zeros((2 * n + 2, 2 * n + 2))
    moving[:n, n : 2 * n] = np.eye(n)
    moving[n : 2 * n, :n], moving[n : 2 * n, n : 2 * n] = -stiffness / mass[:, None], -damping / mass[:, None]
    moving[n : 2 * n, 2 * n], moving[2 * n, 2 * n + 1] = -1, 1
    over = expm(moving * INTERVAL)[: 2 * n]
    growth, end = over[:, : 2 * n], over[:, 2 * n + 1] / INTERVAL
    start = over[:, 2 * n] - end
    node = 2 * np.pi * INTENSITY / INTERVAL
    covariance, cross = np.zeros((2 * n, 2 * n)), np.zeros(2 * n)
    found = {}
    for step in range(1, round(max(times) / INTERVAL) + 1):
        mixed = np.outer(growth @ cross, start)
        covariance = (
            growth @ covariance @ growth.T + mixed + mixed.T + node * (np.outer(start, start) + np.outer(end, end))
        )
        cross = node * end  # of state and the node at its end
        found[step] = np.diag(covariance)[:n]
    return np.array([found[round(t / INTERVAL)] for t in times])


def with_errors(values: np.ndarray, samples: int) -> np.ndarray:
    """Return variances, followed by the standard errors of sample variances of Gaussian values, s^2 sqrt(2/n)."""
    values = np.ravel(values)
    return np.append(values, values * np.sqrt(2 / samples))


def white_noise() -> Outcome:
    """Covariance recursion of the oscillator; at 10 s close to pi S0/(2 zeta w^3)."""
    system = (np.ones(1), np.array([[2 * RATIO * OMEGA]]), np.array([[OMEGA**2]]))
    every = np.round(np.arange(1, 21) * 0.5, 2)
    curve = white_noise_variances(*system, every)[:, 0]
    return Outcome(with_errors(white_noise_variances(*system, TIMES), SAMPLES), {"variance": (every, curve)})


def kanai_tajimi() -> Outcome:
    """Lyapunov equation of ground and oscillator in the stationary state."""
    from scipy.linalg import solve_continuous_lyapunov

    wg, zg = GROUND
    system = np.zeros((4, 4))  # u, v, ground displacement and velocity
    system[0, 1] = system[2, 3] = 1
    system[1] = [-(OMEGA**2), -2 * RATIO * OMEGA, wg**2, 2 * zg * wg]
    system[3, 2:] = [-(wg**2), -2 * zg * wg]
    covariance = solve_continuous_lyapunov(system, -np.diag([0, 0, 0, 2 * np.pi * INTENSITY]))
    return Outcome(with_errors(covariance[0, 0], SAMPLES))


def seed_frame() -> Outcome:
    """Covariance recursion of the three-storey frame."""
    stiffness = SEED["stiffness"]
    return Outcome(
        with_errors(white_noise_variances(SEED["mass"], 0.0015 * stiffness, stiffness, [SEED_TIME]), SEED_SAMPLES)
    )
