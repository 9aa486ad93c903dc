"""Eigenvalues of state matrices and largest damping rates of structures, from which stable steps are computed."""

from __future__ import annotations

import numpy as np

ROUNDED = 1e-14  # change of an eigenvalue over its size, or damping between modes over that of modes
MOST_ITERATIONS = 12
MOST_IN_OTHERS = 0.5  # sum of amplitudes in other modes


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


def damped_motions(
    mass: np.ndarray, damping: np.ndarray, stiffness: np.ndarray, squared: np.ndarray, shapes: np.ndarray
) -> tuple[np.ndarray, np.ndarray]:
    """Return the results of `state_eigenvalues` and `highest_damping_rate` for structures whose modes are known.

    Args:
        mass: Mass matrices [kg], shape [structure, dof, dof].
        damping: Damping matrices [N s/m], symmetric and not negative, shape [structure, dof, dof].
        stiffness: Stiffness matrices [N/m], shape [structure, dof, dof].
        squared: Squared circular frequencies w^2 without damping [rad2/s2], not negative, shape [structure, mode]; 0
            for a motion without resistance, or that grows.
        shapes: Modes of unit modal mass, shape [structure, dof, mode].
    """
    modal = shapes.transpose(0, 2, 1) @ damping @ shapes
    found, is_found = _of_modes(squared, modal)
    if not is_found.all():
        found[~is_found] = state_eigenvalues(*(each[~is_found] for each in (mass, damping, stiffness)))
    return found, np.maximum(np.linalg.eigvalsh(modal)[:, -1], 0.0)


def _of_modes(squared: np.ndarray, modal: np.ndarray) -> tuple[np.ndarray, np.ndarray]:
    """Return eigenvalues of damped modes [1/s], and in which structures they are all found.

    If damping does not couple modes, the eigenvalues of a mode are the roots of x^2 + c x + w^2. If it couples them
    weakly, the eigenvector of an underdamped mode is 1 in this mode and small in others. Its equations in the others
    give their amplitudes from the eigenvalue, and the equation in the mode gives the eigenvalue. Iteration converges by
    about the ratio of damping between modes to the difference of their frequencies. Eigenvectors with small amplitudes
    in other modes differ, so that no eigenvalue is found twice.

    Args:
        squared: Squared circular frequencies w^2 without damping [rad2/s2], shape [structure, mode].
        modal: Modal damping matrices [1/s], shape [structure, mode, mode].
    """
    own = np.maximum(np.einsum("sii->si", modal), 0.0)
    is_own = np.eye(own.shape[1], dtype=bool)
    between = np.where(is_own, 0.0, modal)
    fast = -own / 2 - np.sqrt((own**2 / 4 - squared).astype(np.complex128))
    slow = np.divide(squared, fast, out=np.zeros_like(fast), where=fast != 0)
    is_found = (np.abs(between).max(axis=(1, 2)) <= ROUNDED * own.max(axis=1)) & (squared > 0).all(axis=1)
    # Each structure is iterated until it converges, so that its result does not depend on others.
    left = np.flatnonzero(~is_found & (own**2 < 4 * squared).all(axis=1))
    amplitudes = np.broadcast_to(is_own.astype(np.complex128), (left.size, *is_own.shape))
    for _ in range(MOST_ITERATIONS):
        before, rates, coupling = slow[left, :, None], own[left], between[left]
        with np.errstate(all="ignore"):
            others = before * (before + rates[:, None, :]) + squared[left, None, :]
            amplitudes = np.where(is_own, 1.0, -before * (amplitudes @ coupling) / others)
            rates = (rates + np.einsum("sij,sij->si", amplitudes, coupling)) / 2
            slow[left] = -rates + 1j * np.sqrt(squared[left] - rates**2)
        fast[left] = slow[left].conj()
        change = np.abs(slow[left] - before[:, :, 0])
        is_done = (change <= ROUNDED * np.abs(slow[left])).all(axis=1)
        is_small = (np.abs(amplitudes).sum(axis=2) < 1 + MOST_IN_OTHERS).all(axis=1)
        is_found[left] = is_done & is_small
        goes_on = ~is_done & is_small
        left, amplitudes = left[goes_on], amplitudes[goes_on]
        if not left.size:
            break
    return np.concatenate([fast, slow], axis=1), is_found


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
