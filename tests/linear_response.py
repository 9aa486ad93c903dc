"""Exact response of linear structures to motions that are linear between samples, for reference cases of lumped models.

The response at equally spaced times is exact (matrix exponential); peaks between these times follow from a cubic
polynomial through displacements and velocities, with an error below 1e-7 at the default spacing.
"""

from __future__ import annotations

import numpy as np
from scipy.linalg import eigvals, expm


def pulse(amplitude: float, period: float, decay: float, duration: float = 8.0, step: float = 0.01) -> np.ndarray:
    """Return the samples of A sin(2 pi t / T) exp(-b t) [m/s2]."""
    time = step * np.arange(round(duration / step) + 1)
    return amplitude * np.sin(2 * np.pi * time / period) * np.exp(-decay * time)


def response(
    mass: np.ndarray,
    damping: np.ndarray,
    stiffness: np.ndarray,
    load: np.ndarray,
    acceleration: np.ndarray,
    step: float = 0.01,
    duration: float | None = None,
    parts: int = 20,
) -> dict[str, np.ndarray]:
    """Return the response of M u'' + C u' + K u = -load a(t) from rest.

    Args:
        mass, damping, stiffness: Matrices, shape [dof, dof].
        load: Load masses times influence, shape [dof, component].
        acceleration: Samples, shape [time, component]; after the last one the acceleration falls to 0 in one step.
        step: Step of the samples.
        duration: Duration of the response; by default that of the samples.
        parts: Number of equal parts of a step in the result.

    Returns:
        time, shape [time]; displacement u, velocity v, relative acceleration a, shape [time, dof]; ground, the ground
        acceleration, shape [time, component].
    """
    dofs = len(mass)
    load = np.reshape(load, (dofs, -1))
    samples = np.reshape(acceleration, (-1, load.shape[1]))
    count = len(samples) - 1 if duration is None else round(duration / step)
    padded = np.zeros((max(count, len(samples)) + 1, load.shape[1]))
    padded[: len(samples)] = samples
    inverse = np.linalg.inv(mass)
    system = np.zeros((2 * dofs,) * 2)
    system[:dofs, dofs:] = np.eye(dofs)
    system[dofs:, :dofs], system[dofs:, dofs:] = -inverse @ stiffness, -inverse @ damping
    inward = np.vstack([np.zeros_like(load), -inverse @ load])
    h, width = step / parts, load.shape[1]
    size = 2 * dofs
    augmented = np.zeros((size + 2 * width,) * 2)
    augmented[:size, :size] = system
    augmented[:size, size : size + width] = inward
    augmented[size : size + width, size + width :] = np.eye(width)
    advance = expm(augmented * h)
    state = np.zeros((count * parts + 1, size))
    ground = np.zeros((count * parts + 1, width))
    ground[0] = padded[0]
    for k in range(count):
        slope = (padded[k + 1] - padded[k]) / step
        for j in range(parts):
            i = k * parts + j
            current = padded[k] + slope * h * j
            state[i + 1] = (advance @ np.concatenate([state[i], current, slope]))[:size]
            ground[i + 1] = current + slope * h
    rate = state @ system.T + ground @ inward.T
    time = h * np.arange(len(state))
    return {"time": time, "u": state[:, :dofs], "v": state[:, dofs:], "a": rate[:, dofs:], "ground": ground}


def peak(time: np.ndarray, value: np.ndarray, rate: np.ndarray) -> tuple[float, float]:
    """Return the largest absolute value between samples, and its time, from values and their rates."""
    h = time[1] - time[0]
    x = np.linspace(0, 1, 33)[1:-1]
    basis = np.array([2 * x**3 - 3 * x**2 + 1, x**3 - 2 * x**2 + x, -2 * x**3 + 3 * x**2, x**3 - x**2])
    best = int(np.abs(value).argmax())
    found = (float(abs(value[best])), float(time[best]))
    for i in (best - 1, best):
        if 0 <= i < len(value) - 1:
            inner = np.array([value[i], h * rate[i], value[i + 1], h * rate[i + 1]]) @ basis
            j = int(np.abs(inner).argmax())
            found = max(found, (float(abs(inner[j])), float(time[i] + h * x[j])))
    return found


def complex_modes(mass: np.ndarray, damping: np.ndarray, stiffness: np.ndarray) -> tuple[np.ndarray, np.ndarray]:
    """Return |s| and the damping ratios of the complex modes with positive frequency, by increasing |s|.

    The mass matrix may be singular.
    """
    scale = 1 / np.sqrt(np.outer(np.diag(stiffness), np.diag(stiffness)))  # displacements and rotations
    stiffness, damping, mass = stiffness * scale, damping * scale, mass * scale
    typical = 1 / np.sqrt(np.diag(mass).max())  # circular frequency
    damping, mass = damping * typical, mass * typical**2
    none, identity = np.zeros_like(mass), np.eye(len(mass))
    system, weight = np.block([[none, identity], [-stiffness, -damping]]), np.block([[identity, none], [none, mass]])
    roots = eigvals(system, weight)  # infinite if the mass matrix is singular
    roots = typical * roots[np.isfinite(roots)]
    roots = roots[roots.imag > 0]
    roots = roots[np.argsort(np.abs(roots))]
    return np.abs(roots), -roots.real / np.abs(roots)
