"""Geometric stiffness of structures under gravity, and the loads at which they buckle."""

from __future__ import annotations

import numpy as np
from numpy.typing import ArrayLike
from scipy.linalg import eigh

from warpdyn.foundations.core.checks import check_kind, finite_numbers
from warpdyn.foundations.core.near_misses import suggests_names
from warpdyn.model.structures.lumped.places.storey_values import storey_values
from warpdyn.model.structures.lumped.structure import LumpedStructure
from warpdyn.model.structures.modal import chain_stiffness_matrix

NEGLIGIBLE = 1e-12  # eigenvalue of the geometric over that of the elastic stiffness, relative to the largest one


@suggests_names
def geometric_stiffness(gravity_load: ArrayLike, storey_height: ArrayLike) -> np.ndarray:
    """Return the geometric stiffness of a chain of storeys (linear P-Delta), for `wd.LumpedStructure`.

    A storey of height h with the axial force P, the sum of the loads above, loses the stiffness P / h between the
    displacements of its two floors. The base does not move.

    Args:
        gravity_load: Vertical load of each floor from the first floor up [N], shape [floor].
        storey_height: Storey heights from the ground up [m], one value or shape [storey].

    Returns:
        Geometric stiffness [N/m], shape [floor, floor].

    Raises:
        ValueError: If a value is not finite or is out of its range, or lengths differ.

    Example:
        >>> wd.geometric_stiffness([2e6, 1e6], 4.0) / 1e6  # storeys carry 3e6 and 1e6 N
        array([[ 1.  , -0.25],
               [-0.25,  0.25]])
    """
    given = finite_numbers("gravity_load", gravity_load, "N")
    if given.ndim != 1 or not given.size:
        raise ValueError(f"gravity_load must be a list with one value per floor, got shape {list(given.shape)}")
    loads = storey_values("gravity_load", given, given.size, "N", least=0.0)
    heights = storey_values("storey_height", storey_height, given.size, "m")
    return chain_stiffness_matrix(np.cumsum(loads[::-1])[::-1] / heights)


@suggests_names
def buckling_factors(structure: LumpedStructure) -> np.ndarray:
    """Return the factors on the geometric stiffness at which an elastic structure buckles.

    The factors lambda solve det(K - lambda K_geometric) = 0, with the initial stiffness K of springs and matrices. The
    first one is the critical load factor: it should be far above 1, because springs lose stiffness when they yield.

    Args:
        structure: A structure with a geometric stiffness.

    Returns:
        The positive factors in increasing order [1], shape [factor].

    Raises:
        ValueError: If the structure has no geometric stiffness, or it is stable under any factor.
        TypeError: If `structure` is not a LumpedStructure.

    Example:
        >>> column = wd.LumpedStructure(
        ...     {"u": 1e5}, [wd.Spring("k", {"u": 1.0}, stiffness=3e6)], geometric_stiffness=[[2.5e5]]
        ... )
        >>> wd.buckling_factors(column)
        array([12.])
    """
    check_kind("buckling_factors", "a LumpedStructure", structure, LumpedStructure)
    if "geometric_stiffness" not in structure.matrices:
        raise ValueError(
            "buckling_factors(): the structure has no geometric stiffness: give it geometric_stiffness=, or "
            "gravity_load='weight' if it is a TorsionalBuilding or FlexuralShearBuilding"
        )
    one = {name: values[None] for name, values in structure.parameters.items()}
    elastic = structure.stiffness_matrices(one, has_gravity=False)[0]
    inverse = eigh(structure.matrices["geometric_stiffness"], elastic, eigvals_only=True)[::-1]
    found = inverse[inverse > NEGLIGIBLE * np.abs(inverse).max()]
    if not found.size:
        raise ValueError(
            "buckling_factors(): the structure is stable under any factor: K_geometric has no positive part"
        )
    return 1 / found
