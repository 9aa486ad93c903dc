"""Independent results of the problems on filters: no module of warpdyn is imported."""

from __future__ import annotations

import numpy as np
from scipy.linalg import expm

from .problem import Outcome

MASS, STIFFNESS, DAMPING = np.array([2.0e5, 1.5e5]), (1.2e8, 0.9e8), (4e5, 3e5)  # kg, N/m, N s/m
STEP, COUNT = 0.02, 26  # s, samples
NOISE, PROCESS, PRIOR = 0.05, 0.002, (0.01, 0.1)  # m/s2; m/s per step; m, m/s
AMPLITUDE, FREQUENCY, DECAY = 3.0, 1.5, 0.3  # m/s2, Hz, 1/s


def base_acceleration() -> np.ndarray:
    """Return the base acceleration [m/s2], shape [time]."""
    time = STEP * np.arange(COUNT)
    return np.asarray(AMPLITUDE * np.sin(2 * np.pi * FREQUENCY * time) * np.exp(-DECAY * time))


def record() -> np.ndarray:
    """Return measured accelerations [m/s2], shape [time, floor]: a formula, so that it is the same everywhere."""
    time = STEP * np.arange(COUNT)
    first = 6 * np.sin(9.0 * time + 0.3) + 0.05 * np.cos(71.0 * time)
    second = 9 * np.sin(9.0 * time + 0.2) + 0.05 * np.cos(53.0 * time)
    return np.stack([first, second], axis=1)


def chain_matrix(values: tuple[float, float]) -> np.ndarray:
    """Return the matrix of two springs or dashpots in series."""
    return np.array([[values[0] + values[1], -values[1]], [-values[1], values[1]]])


def kalman() -> Outcome:
    """The Kalman filter with the exact transition over a step (matrix exponential)."""
    to_acceleration = -np.hstack([chain_matrix(STIFFNESS), chain_matrix(DAMPING)]) / MASS[:, None]
    system = np.zeros((6, 6))
    system[:2, 2:4], system[2:4, :4], system[2:4, 4], system[4, 5] = np.eye(2), to_acceleration, -1.0, 1.0
    step, base, data = expm(system * STEP), base_acceleration(), record()
    mean, covariance, total = np.zeros(4), np.diag(np.repeat(PRIOR, 2) ** 2), 0.0
    process, noise = np.diag([0, 0, PROCESS**2, PROCESS**2]), NOISE**2 * np.eye(2)
    roof = []
    for place in range(1, COUNT):
        load = np.array([base[place - 1], (base[place] - base[place - 1]) / STEP])
        mean = step[:4, :4] @ mean + step[:4, 4:] @ load
        covariance = step[:4, :4] @ covariance @ step[:4, :4].T + process
        innovation = to_acceleration @ covariance @ to_acceleration.T + noise
        difference = data[place] - to_acceleration @ mean
        weighted = np.linalg.solve(innovation, difference)
        total -= 0.5 * (difference @ weighted + np.linalg.slogdet(2 * np.pi * innovation)[1])
        gain = np.linalg.solve(innovation, to_acceleration @ covariance).T
        mean, covariance = mean + gain @ difference, covariance - gain @ to_acceleration @ covariance
        roof.append(mean[1])
    curve = STEP * np.arange(1, COUNT), np.array(roof)
    return Outcome([*mean, *np.sqrt(np.diag(covariance)), total], {"posterior mean of the roof displacement": curve})
