"""Stick models of flexural-shear buildings: one Hermite beam and one shear spring per storey.

The degrees of freedom of a floor are its displacement and its rotation. If floors have no rotary mass, the rotations
are eliminated by static condensation, which is exact.
"""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np
from numpy.typing import ArrayLike

from warpdyn.foundations.core.checks import finite_numbers, real_number, shortened
from warpdyn.foundations.core.frozen_values import FrozenArrays, freeze_arrays
from warpdyn.foundations.core.near_misses import suggests_names
from warpdyn.model.structures.lumped.flexural_shear import flexural_shear_stiffness
from warpdyn.model.structures.lumped.places.storey_values import storey_values
from warpdyn.model.structures.modal import chain_stiffness_matrix, undamped_modes


@dataclass(frozen=True, eq=False)
class Stick(FrozenArrays):
    """Matrices of a stick whose rotations are condensed; see `lumped_stick`.

    Args:
        mass: Floor masses [kg], shape [floor].
        bending_matrix: Stiffness of the beams after condensation [N/m], shape [floor, floor].
        storey_shear_stiffness: Stiffness of the shear springs GA / h [N/m], shape [storey].
        rotations: Rotation of each floor per unit displacement of each floor [1/m], shape [floor, floor].
        bending_stiffness: Bending stiffness EI of each storey [N m2], shape [storey].
        shear_stiffness: Shear stiffness GA of each storey [N], shape [storey].
    """

    mass: np.ndarray
    bending_matrix: np.ndarray
    storey_shear_stiffness: np.ndarray
    rotations: np.ndarray
    bending_stiffness: np.ndarray
    shear_stiffness: np.ndarray

    def __post_init__(self) -> None:
        freeze_arrays(vars(self))

    @property
    def stiffness(self) -> np.ndarray:
        """Stiffness matrix of beams and shear springs [N/m], shape [floor, floor]."""
        return self.bending_matrix + chain_stiffness_matrix(self.storey_shear_stiffness)

    @property
    def periods(self) -> np.ndarray:
        """Natural periods [s], the longest first, shape [mode]."""
        return 2 * np.pi / np.sqrt(undamped_modes(self.stiffness, np.diag(self.mass))[0])


@suggests_names
def lumped_stick(
    storey_height: ArrayLike, bending_stiffness: ArrayLike, shear_stiffness: ArrayLike, floor_mass: ArrayLike
) -> Stick:
    """Return a stick with one mass per floor and no rotary mass, whose rotations are condensed.

    Each storey has a Hermite beam with the bending stiffness EI and, in parallel, a shear spring GA / h between the
    displacements of its floors. The base is fixed. The shear springs are kept separate in the result, because they may
    yield: condensation involves only the beams.

    Args:
        storey_height: Storey heights h from the ground up [m], shape [storey].
        bending_stiffness: Bending stiffness EI [N m2], one value or shape [storey].
        shear_stiffness: Shear stiffness GA [N], 0 or above, one value or shape [storey].
        floor_mass: Floor masses [kg], one value or shape [storey].

    Returns:
        The matrices of the stick.

    Raises:
        ValueError: If a value is not finite, is below its bound, or there is not one value per storey.

    Example:
        >>> stick = lumped_stick([3.0] * 20, 2.39250923e11, 1.06333744e9, 4e5)
        >>> (1 / stick.periods[:2]).round(5)
        array([0.48186, 1.76508])
    """
    height = storey_values("storey_height", storey_height, None, "m")
    bending = storey_values("bending_stiffness", bending_stiffness, height.size, "N m2")
    shear = storey_values("shear_stiffness", shear_stiffness, height.size, "N", least=0.0)
    mass = storey_values("floor_mass", floor_mass, height.size, "kg")
    full = _assembled(np.array([_bending(h) * ei for h, ei in zip(height, bending, strict=True)]))
    condensed, recovery = static_condensation(full, np.arange(0, 2 * height.size, 2))
    return Stick(mass, condensed, shear / height, recovery[1::2], bending, shear)


@suggests_names
def consistent_stick(
    storey_height: ArrayLike, bending_stiffness: ArrayLike, shear_stiffness: ArrayLike, mass_per_height: ArrayLike
) -> tuple[np.ndarray, np.ndarray]:
    """Return the consistent mass and stiffness matrices of a stick, with displacement and rotation of each floor.

    EI, GA and mass are integrated with the same Hermite shapes, so that the frequencies approach those of the
    continuous flexural-shear cantilever from above, with the fourth power of the storey height. Degrees of freedom:
    u1, rotation 1, u2, rotation 2 and so on, from the first floor up.

    Args:
        storey_height: Storey heights h from the ground up [m], shape [storey].
        bending_stiffness: Bending stiffness EI [N m2], one value or shape [storey].
        shear_stiffness: Shear stiffness GA [N], 0 or above, one value or shape [storey].
        mass_per_height: Mass per height [kg/m], one value or shape [storey].

    Returns:
        Mass matrix and stiffness matrix, shape [2 x storey, 2 x storey]; units kg and N/m for displacements, kg m2 and
        N m for rotations.

    Raises:
        ValueError: If a value is not finite, is below its bound, or there is not one value per storey.

    Example:
        >>> from scipy.linalg import eigh
        >>> mass, stiffness = consistent_stick([3.0] * 20, 2.39250923e11, 1.06333744e9, 4e5 / 3)
        >>> (np.sqrt(eigh(stiffness, mass, eigvals_only=True)[:2]) / (2 * np.pi)).round(5)
        array([0.5    , 1.85451])
    """
    height = storey_values("storey_height", storey_height, None, "m")
    bending = storey_values("bending_stiffness", bending_stiffness, height.size, "N m2")
    shear = storey_values("shear_stiffness", shear_stiffness, height.size, "N", least=0.0)
    density = storey_values("mass_per_height", mass_per_height, height.size, "kg/m")
    masses = np.array([_mass(h) * rho for h, rho in zip(height, density, strict=True)])
    stiffnesses = [_bending(h) * ei + _shear(h) * ga for h, ei, ga in zip(height, bending, shear, strict=True)]
    return _assembled(masses), _assembled(np.array(stiffnesses))


@suggests_names
def stick_of_period(period: float, storey_height: ArrayLike, floor_mass: ArrayLike, alpha0: float) -> Stick:
    """Return a stick of uniform stiffness whose first period is exact, for a given lateral stiffness ratio.

    The stiffness of the continuous cantilever is scaled until the stick has the period. With equal floor masses the
    unscaled stick of 20 storeys has a first frequency that is 3.6 % too low, because its top floor carries half a
    storey of mass too much.

    Args:
        period: First period [s].
        storey_height: Storey heights from the ground up [m], shape [storey].
        floor_mass: Floor masses [kg], one value or shape [storey].
        alpha0: Lateral stiffness ratio H sqrt(GA / EI) [1], from 0 to 1e6.

    Returns:
        The matrices of the stick; its `bending_stiffness` and `shear_stiffness` are the calibrated EI and GA.

    Raises:
        ValueError: If a value is not finite, is below its bound, or there is not one mass per storey.

    Example:
        >>> stick = stick_of_period(2.0, [3.0] * 20, 4e5, alpha0=4.0)
        >>> stick.periods[:2].round(4)
        array([2.   , 0.546])
    """
    height = storey_values("storey_height", storey_height, None, "m")
    mass = storey_values("floor_mass", floor_mass, height.size, "kg")
    total = height.sum()
    period = real_number("period [s]", period, above=0)
    bending, shear = flexural_shear_stiffness(period, total, mass.sum() / total, alpha0)
    factor = (lumped_stick(height, bending, shear, mass).periods[0] / period) ** 2
    return lumped_stick(height, factor * bending, factor * shear, mass)


@suggests_names
def bending_matrix_with_base_rotation(storey_height: ArrayLike, bending_stiffness: ArrayLike) -> np.ndarray:
    """Return the bending stiffness of a stick whose base may rotate, for a rotational spring or hinge at the base.

    Rotations of floors are condensed; the rotation of the base is kept as the first degree of freedom. It is positive
    if floors above move in the positive direction. Without the first row and column, the matrix is the `bending_matrix`
    of `lumped_stick`.

    Args:
        storey_height: Storey heights from the ground up [m], shape [storey].
        bending_stiffness: Bending stiffness EI [N m2], one value or shape [storey].

    Returns:
        Stiffness matrix [N m], [N] or [N/m], shape [1 + floor, 1 + floor].

    Raises:
        ValueError: If a value is not finite and above 0, or there is not one value per storey.

    Example:
        >>> (bending_matrix_with_base_rotation([3.0], 2e8) / 1e6).round(2)  # 3 EI / h^3 [[h^2, -h], [-h, 1]]
        array([[200.  , -66.67],
               [-66.67,  22.22]])
    """
    height = storey_values("storey_height", storey_height, None, "m")
    bending = storey_values("bending_stiffness", bending_stiffness, height.size, "N m2")
    full = _assembled(np.array([_bending(h) * ei for h, ei in zip(height, bending, strict=True)]), fixed=1)
    return static_condensation(full, [0, *range(1, 2 * height.size, 2)])[0]


@suggests_names
def static_condensation(stiffness: ArrayLike, kept: ArrayLike) -> tuple[np.ndarray, np.ndarray]:
    """Return a stiffness matrix without massless degrees of freedom, and the matrix that recovers them.

    With r for the removed and k for the kept degrees of freedom: K = K_kk - K_kr K_rr^-1 K_rk; u_r = -K_rr^-1 K_rk u_k.
    The result is exact if no mass, damping or load acts on the removed degrees of freedom.

    Source: Guyan (1965), "Reduction of stiffness and mass matrices".

    Args:
        stiffness: Stiffness matrix [N/m], symmetric, shape [dof, dof].
        kept: Indices of the kept degrees of freedom [1], without repetition, shape [kept].

    Returns:
        The condensed stiffness matrix [N/m], shape [kept, kept], and the displacements of all degrees of freedom per
        unit displacement of the kept ones, shape [dof, kept].

    Raises:
        ValueError: If the matrix is not square and symmetric, an index is wrong, or the removed degrees of freedom can
            move although the kept ones are fixed.

    Example:
        >>> springs_in_series = [[3.0, -3.0, 0.0], [-3.0, 9.0, -6.0], [0.0, -6.0, 6.0]]  # N/m
        >>> stiffness, recovery = static_condensation(springs_in_series, kept=[0, 2])
        >>> stiffness.round(6)
        array([[ 2., -2.],
               [-2.,  2.]])
    """
    matrix = finite_numbers("stiffness", stiffness)
    if matrix.ndim != 2 or matrix.shape[0] != matrix.shape[1] or not matrix.size:
        raise ValueError(f"stiffness must be a square matrix [dof, dof], got shape {matrix.shape}")
    if np.abs(matrix - matrix.T).max() > 1e-9 * np.abs(matrix).max():
        raise ValueError("stiffness is not symmetric: give a symmetric matrix, such as (K + K.T) / 2")
    dofs = len(matrix)
    index = finite_numbers("kept", kept)
    whole = index.astype(int) if np.abs(index).max(initial=0) < dofs else np.empty(0, int)
    if index.ndim != 1 or not index.size or not np.array_equal(whole, index) or whole.min() < 0:
        raise ValueError(f"kept must be indices from 0 to {dofs - 1}, got {shortened(kept)}")
    if np.unique(whole).size < whole.size:
        raise ValueError(f"kept contains an index twice: {shortened(kept)}; give each index once")
    removed = np.setdiff1d(np.arange(dofs), whole)
    recovery = np.zeros((dofs, whole.size))
    recovery[whole, np.arange(whole.size)] = 1.0
    if removed.size:
        inner = matrix[np.ix_(removed, removed)]
        scale = 1 / np.sqrt(np.where(np.diag(inner) > 0, np.diag(inner), 1.0))  # rotations and displacements
        least = np.linalg.eigvalsh(inner * np.outer(scale, scale))[0]
        if least <= removed.size * np.finfo(float).eps:
            raise ValueError(
                f"the removed degrees of freedom {shortened(removed.tolist())} can move although the kept ones are "
                "fixed: restrain them by a stiffness, or add them to kept="
            )
        recovery[removed] = -np.linalg.solve(inner, matrix[np.ix_(removed, whole)])
    condensed = matrix[whole] @ recovery
    return (condensed + condensed.T) / 2, recovery


def _bending(h: float) -> np.ndarray:
    """Return the stiffness of a Hermite beam with EI = 1; lower displacement and rotation first."""
    pattern = [[12, 6 * h, -12, 6 * h], [0, 4 * h**2, -6 * h, 2 * h**2], [0, 0, 12, -6 * h], [0, 0, 0, 4 * h**2]]
    return _symmetric(pattern) / h**3


def _shear(h: float) -> np.ndarray:
    """Return the integral of the products of slopes of the Hermite shapes, the shear stiffness with GA = 1."""
    pattern = [[36, 3 * h, -36, 3 * h], [0, 4 * h**2, -3 * h, -(h**2)], [0, 0, 36, -3 * h], [0, 0, 0, 4 * h**2]]
    return _symmetric(pattern) / (30 * h)


def _mass(h: float) -> np.ndarray:
    """Return the consistent mass matrix of a beam with a mass per height of 1."""
    pattern = [
        [156, 22 * h, 54, -13 * h],
        [0, 4 * h**2, 13 * h, -3 * h**2],
        [0, 0, 156, -22 * h],
        [0, 0, 0, 4 * h**2],
    ]
    return _symmetric(pattern) * h / 420


def _symmetric(upper: list[list[float]]) -> np.ndarray:
    matrix = np.array(upper, dtype=np.float64)
    return matrix + np.triu(matrix, 1).T


def _assembled(elements: np.ndarray, fixed: int = 2) -> np.ndarray:
    """Return the sum of the elements of a stick without the first `fixed` degrees of freedom (2: a fixed base)."""
    total = np.zeros((2 * len(elements) + 2,) * 2)
    for storey, element in enumerate(elements):
        total[2 * storey : 2 * storey + 4, 2 * storey : 2 * storey + 4] += element
    return total[fixed:, fixed:]
