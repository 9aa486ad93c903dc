"""Eigenvalues of state matrices and largest damping rates of structures, from which stable steps are computed."""

from __future__ import annotations

import numpy as np


def state_eigenvalues(mass: np.ndarray, damping: np.ndarray, stiffness: np.ndarray) -> np.ndarray:
    """Return the eigenvalues of [[0, I], [-M^-1 K, -M^-1 C]] for many structures, with any damping matrices.

    Args:
        mass: Masses [kg], shape [structure, dof], or mass matrices, shape [structure, dof, dof].
        damping: Damping matrices [N s/m], shape [structure, dof, dof].
        stiffness: Stiffness matrices [N/m], shape [structure, dof, dof].

    Returns:
        Complex eigenvalues [1/s], shape [structure, 2 dof].

    Raises:
        ValueError: If a shape does not fit, a value is not finite, or a mass matrix is singular.
    """
    damping, stiffness = np.asarray(damping, dtype=np.float64), np.asarray(stiffness, dtype=np.float64)
    if damping.shape != stiffness.shape:
        raise ValueError(f"damping and stiffness must share a shape, got {damping.shape} and {stiffness.shape}")
    of_displacement, of_velocity = _over_mass(mass, "stiffness", stiffness), _over_mass(mass, "damping", damping)
    structures, dof = stiffness.shape[:2]
    upper = np.broadcast_to(np.eye(dof, 2 * dof, dof), (structures, dof, 2 * dof))
    lower = -np.concatenate([of_displacement, of_velocity], axis=2)
    return np.linalg.eigvals(np.concatenate([upper, lower], axis=1)).astype(np.complex128)


def highest_damping_rate(mass: np.ndarray, damping: np.ndarray) -> np.ndarray:
    """Return the largest eigenvalue of M^-1 C for many structures: the decay rate of a velocity without stiffness.

    Args:
        mass: Masses [kg], shape [structure, dof], or mass matrices, shape [structure, dof, dof].
        damping: Damping matrices [N s/m], symmetric and not negative, shape [structure, dof, dof].

    Returns:
        Rate [1/s], shape [structure].

    Raises:
        ValueError: If a shape does not fit, a value is not finite, or a mass matrix is singular.
    """
    rates = np.linalg.eigvals(_over_mass(mass, "damping", np.asarray(damping, dtype=np.float64))).real
    return np.maximum(rates.max(axis=1), 0)  # without damping, rounding may give a negative rate


def _over_mass(mass: np.ndarray, name: str, matrix: np.ndarray) -> np.ndarray:
    """Return M^-1 times a matrix for each structure, shape [structure, dof, dof]; raise a ValueError if M is singular.

    Args:
        mass: Masses, shape [structure, dof], or mass matrices, shape [structure, dof, dof].
        name: Name of the matrix in messages.
        matrix: The matrices, shape [structure, dof, dof].
    """
    mass = np.asarray(mass, dtype=np.float64)
    if matrix.ndim != 3 or matrix.shape[1] != matrix.shape[2]:
        raise ValueError(f"{name} must have shape [structure, dof, dof], got {matrix.shape}")
    if mass.shape not in (matrix.shape[:2], matrix.shape):
        raise ValueError(f"mass must have shape {matrix.shape[:2]} or {matrix.shape}, got {mass.shape}")
    for title, value in (("mass", mass), (name, matrix)):
        if not np.isfinite(value).all():
            raise ValueError(f"{title}{np.argwhere(~np.isfinite(value))[0].tolist()} is not finite: correct it")
    try:
        if mass.ndim == 2 and (mass == 0).any():
            raise np.linalg.LinAlgError
        return matrix / mass[:, :, None] if mass.ndim == 2 else np.linalg.solve(mass, matrix)
    except np.linalg.LinAlgError:
        raise ValueError(
            "mass is singular: give every degree of freedom of every structure a mass above 0 kg"
        ) from None
