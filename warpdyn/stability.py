"""How long a step an explicit Runge-Kutta method can take before its own oscillation grows."""

from __future__ import annotations

from collections.abc import Sequence
from functools import lru_cache
from math import factorial

import numpy as np

# The tabulated limit falls at most this far (relative) from one damping ratio to the next, but at jumps.
TABLE_TOLERANCE = 2e-3
# Damping ratios below this get no credit for their damping: eigenvalues carry rounding of about 1e-12.
LEAST_DAMPING_RATIO = 1e-9
# Cells of the table are not refined below this width, which only a jump of the limit asks for.
LEAST_CELL = 1e-12
# What a smooth minimum between two tabulated damping ratios can lie below both.
TABLE_MARGIN = 1e-5


def stability_limit(polynomial_coefficients: Sequence[float], damping_ratio: float) -> float:
    """Largest w h up to which a method's step does not amplify u'' + 2 zeta w u' + w^2 u = 0.

    It is the first root of |R(z)|^2 = 1 along z = w h (-zeta +- i sqrt(1 - zeta^2)) beyond which |R| > 1; with
    zeta > 1 both roots are real and the faster one governs (Hairer and Wanner, Solving ODEs II, IV.2).

    Args:
        polynomial_coefficients: Coefficients c_k of the stability polynomial R(z) = sum of c_k z^k, shape [power].
        damping_ratio: Damping ratio zeta [-], 0 or above.

    Returns:
        The limit of w h [-]; 0 where every step amplifies.

    Raises:
        ValueError: If the polynomial does not start 1 + z, or the damping ratio is not finite and 0 or above.
    """
    coefficients = _consistent(polynomial_coefficients)
    zeta = _at_least_zero("damping_ratio", np.asarray(damping_ratio, dtype=np.float64))
    return float(_limits(coefficients, np.minimum(zeta, 1.0)[None])[0] / _fast_root(zeta))


def stable_step(
    polynomial_coefficients: Sequence[float], frequency: np.ndarray, damping_ratio: np.ndarray
) -> np.ndarray:
    """Longest step without growth for many oscillators, up to 0.21 % below the exact limit and never above it.

    The limit is tabulated over the damping ratio once a method; each oscillator takes the lesser of its neighbours.

    Args:
        polynomial_coefficients: Coefficients c_k of the stability polynomial R(z) = sum of c_k z^k, shape [power].
        frequency: Circular frequency [rad/s], shape [...].
        damping_ratio: Damping ratio [-], 0 or above (below 1e-9 taken as none), shape [...].

    Returns:
        Step [s], of the arguments' common shape; 0 where every step amplifies.

    Raises:
        ValueError: If the polynomial does not start 1 + z, a frequency is not above 0, or a damping ratio is below 0.
    """
    frequency = _at_least_zero("frequency", np.asarray(frequency, dtype=np.float64))
    if (frequency == 0).any():
        raise ValueError(f"frequency{_first(frequency == 0)} is 0; it must be above 0 rad/s")
    zeta = _at_least_zero("damping_ratio", np.asarray(damping_ratio, dtype=np.float64))
    grid, cell_limit = _table(_consistent(polynomial_coefficients))
    cell = np.clip(np.searchsorted(grid, zeta, side="right") - 1, 0, cell_limit.size - 1)
    return cell_limit[cell] / (_fast_root(zeta) * frequency)


def stable_step_of_eigenvalues(polynomial_coefficients: Sequence[float], eigenvalues: np.ndarray) -> np.ndarray:
    """Longest step at which a method amplifies no eigenvector of a linear system, to the accuracy of `stable_step`.

    Args:
        polynomial_coefficients: Coefficients c_k of the stability polynomial R(z) = sum of c_k z^k, shape [power].
        eigenvalues: Eigenvalues of the state matrix [1/s], shape [structure, eigenvalue]; a 0 sets no limit.

    Returns:
        Step [s], shape [structure].

    Raises:
        ValueError: If an eigenvalue is not finite, or its motion grows by itself (real part above 0).
    """
    eigenvalues = np.asarray(eigenvalues)
    if eigenvalues.ndim != 2 or eigenvalues.shape[1] == 0 or not np.isfinite(eigenvalues).all():
        raise ValueError(f"eigenvalues must be finite and of shape [structure, eigenvalue], got {eigenvalues.shape}")
    size = np.abs(eigenvalues)
    growing = eigenvalues.real > 1e-9 * size.max(axis=1, keepdims=True)  # rounding leaves about 1e-13
    if growing.any():
        raise ValueError(
            f"eigenvalues{_first(growing)} is {eigenvalues[growing][0]:.6g} 1/s: a motion that grows by itself has no "
            f"stable step (is the damping or stiffness negative?)"
        )
    moving = size > 0
    size = np.where(moving, size, 1.0)
    ratio = np.clip(-eigenvalues.real / size, 0.0, 1.0)
    return np.where(moving, stable_step(polynomial_coefficients, size, ratio), np.inf).min(axis=1)


def state_eigenvalues(mass: np.ndarray, damping: np.ndarray, stiffness: np.ndarray) -> np.ndarray:
    """Eigenvalues of [[0, I], [-M^-1 K, -M^-1 C]] for many structures, with any damping matrices.

    Args:
        mass: Masses [kg], shape [structure, dof], or mass matrices, shape [structure, dof, dof].
        damping: Damping matrices [N s/m], shape [structure, dof, dof].
        stiffness: Stiffness matrices [N/m], shape [structure, dof, dof].

    Returns:
        Complex eigenvalues [1/s], shape [structure, 2 dof].

    Raises:
        ValueError: If a shape does not fit, a value is not finite, or a mass matrix is singular.
    """
    mass, damping, stiffness = (np.asarray(value, dtype=np.float64) for value in (mass, damping, stiffness))
    if stiffness.ndim != 3 or stiffness.shape[1] != stiffness.shape[2] or damping.shape != stiffness.shape:
        raise ValueError(
            f"damping and stiffness must share a shape [structure, dof, dof], got {damping.shape} and {stiffness.shape}"
        )
    if mass.shape not in (stiffness.shape[:2], stiffness.shape):
        raise ValueError(f"mass must have shape {stiffness.shape[:2]} or {stiffness.shape}, got {mass.shape}")
    for name, value in (("mass", mass), ("damping", damping), ("stiffness", stiffness)):
        if not np.isfinite(value).all():
            raise ValueError(f"{name}{_first(~np.isfinite(value))} is not finite")
    structures, dof = stiffness.shape[:2]
    both = -np.concatenate([stiffness, damping], axis=2)
    try:
        if mass.ndim == 2 and (mass == 0).any():
            raise np.linalg.LinAlgError
        lower = both / mass[:, :, None] if mass.ndim == 2 else np.linalg.solve(mass, both)
    except np.linalg.LinAlgError:
        raise ValueError("mass must not be singular") from None
    upper = np.broadcast_to(np.eye(dof, 2 * dof, dof), (structures, dof, 2 * dof))
    return np.linalg.eigvals(np.concatenate([upper, lower], axis=1)).astype(np.complex128)


def _limits(coefficients: tuple[float, ...], zeta: np.ndarray) -> np.ndarray:
    """Stability limits of w h for damping ratios from 0 to 1, shape [ratio]."""
    stages = len(coefficients) - 1
    order = next((k - 1 for k, c in enumerate(coefficients) if c != 1 / factorial(k)), stages)
    chebyshev = np.polynomial.chebyshev.chebvander(-zeta, 2 * stages)  # cos(m angle), exact at zeta = 0
    # Coefficients of (|R|^2 - 1) / x in x = w h. Up to the method's order they are those of exp(-2 zeta x), which
    # spares the cancellation that would hide them at low damping.
    growth = np.zeros((zeta.size, 2 * stages))
    for power in range(1, 2 * stages + 1):
        if power <= order:
            growth[:, power - 1] = (-2 * zeta) ** power / factorial(power)
        else:
            for j in range(max(0, power - stages), min(stages, power) + 1):
                growth[:, power - 1] += coefficients[j] * coefficients[power - j] * chebyshev[:, abs(2 * j - power)]
    degree = 2 * stages - 1
    companion = np.zeros((zeta.size, degree, degree))
    companion[:, np.arange(1, degree), np.arange(degree - 1)] = 1
    companion[:, :, -1] = -growth[:, :-1] / growth[:, -1:]
    roots = np.linalg.eigvals(companion)
    # Rounding may split a double root into a complex pair; a candidate too many does no harm, the signs decide.
    real = (np.abs(roots.imag) <= 1e-5 * np.abs(roots)) & (roots.real > 0)
    ends = np.sort(np.where(real, roots.real, np.inf), axis=1)
    ends = np.concatenate([np.zeros((zeta.size, 1)), ends, np.full((zeta.size, 1), np.inf)], axis=1)
    with np.errstate(invalid="ignore"):
        middle = np.where(np.isfinite(ends[:, 1:]), (ends[:, :-1] + ends[:, 1:]) / 2, 2 * ends[:, :-1] + 1)
        value = np.zeros_like(middle)
        for column in growth.T[::-1]:
            value = value * middle + column[:, None]
    # Beyond the last root |R| grows, so that some interval is always found.
    first = (~(value <= 0)).argmax(axis=1)
    return ends[np.arange(zeta.size), first]


@lru_cache(maxsize=64)
def _table(coefficients: tuple[float, ...]) -> tuple[np.ndarray, np.ndarray]:
    """Damping ratios from 0 to 1, refined where the limit is steep, and the least limit in each cell between them."""
    grid = np.concatenate([[0, LEAST_DAMPING_RATIO], np.linspace(0, 1, 501)[1:]])
    limit = _limits(coefficients, grid)
    while True:
        coarse = np.abs(np.diff(limit)) > TABLE_TOLERANCE * np.maximum(limit[:-1], limit[1:])
        coarse &= (grid[:-1] > 0) & (np.diff(grid) > LEAST_CELL)
        if not coarse.any():
            return grid, (1 - TABLE_MARGIN) * np.minimum(limit[:-1], limit[1:])
        where = np.flatnonzero(coarse) + 1
        between = (grid[where - 1] + grid[where]) / 2
        grid, limit = np.insert(grid, where, between), np.insert(limit, where, _limits(coefficients, between))


def _consistent(polynomial_coefficients: Sequence[float]) -> tuple[float, ...]:
    """The coefficients as a tuple, those of the exponential series free of a tableau's rounding, trailing zeros cut."""
    values = np.trim_zeros(np.asarray(polynomial_coefficients, dtype=np.float64), "b")
    exact = [1 / factorial(k) for k in range(values.size)]
    snapped = np.where(np.isclose(values, exact, rtol=1e-12, atol=0), exact, values)
    if not np.isfinite(snapped).all() or snapped.size < 2 or (snapped[:2] != 1).any():
        raise ValueError(f"polynomial_coefficients must be finite and start 1, 1, got {list(polynomial_coefficients)}")
    return tuple(snapped.tolist())


def _fast_root(zeta: np.ndarray) -> np.ndarray:
    """Size of the faster root over w: 1 up to critical damping, more beyond."""
    return np.where(zeta > 1, zeta + np.sqrt(np.maximum(zeta**2 - 1, 0)), 1.0)


def _first(bad: np.ndarray) -> list[int]:
    return [int(i) for i in np.argwhere(bad)[0]]


def _at_least_zero(name: str, value: np.ndarray) -> np.ndarray:
    bad = ~(np.isfinite(value) & (value >= 0))
    if bad.any():
        raise ValueError(f"{name}{_first(bad) or ''} is {value[bad].flat[0]}; it must be finite and 0 or above")
    return value
