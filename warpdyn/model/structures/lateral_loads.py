"""Lateral load patterns on shear buildings, and the storey shears in equilibrium with them."""

from __future__ import annotations

import numpy as np
from numpy.typing import ArrayLike

from warpdyn.foundations.core.checks import finite_numbers, one_of
from warpdyn.model.structures.modal import chain_stiffness_matrix, modal_properties

PATTERNS = ("first_mode", "triangular", "uniform")


def floor_loads(
    pattern: str | ArrayLike, mass: np.ndarray, height: np.ndarray, stiffness: np.ndarray | None = None
) -> np.ndarray:
    """Return the floor loads of a lateral load pattern, scaled to a base shear of 1.

    Args:
        pattern: "first_mode" (floor mass times first mode shape), "triangular" (floor mass times height above the
            ground), "uniform" (floor mass), or relative floor loads from the ground up, shape [floor].
        mass: Floor mass [kg], shape [storey].
        height: Storey height [m], shape [storey].
        stiffness: Storey stiffness minus P-Delta stiffness [N/m], shape [storey]; needed for "first_mode".

    Returns:
        Floor loads with sum 1, shape [floor].

    Raises:
        ValueError: If the pattern is unknown, the number of loads differs from the number of floors, a load is below 0,
            or the load on the roof is 0.
    """
    if isinstance(pattern, str):
        one_of("lateral load pattern", pattern, PATTERNS)
        if pattern == "first_mode":
            assert stiffness is not None
            shape = modal_properties(mass, chain_stiffness_matrix(stiffness))["shape"].values[0]
        else:
            shape = np.cumsum(height) if pattern == "triangular" else np.ones(len(mass))
        loads = mass * shape
    else:
        loads = finite_numbers("pattern", pattern)
        if loads.shape != mass.shape:
            raise ValueError(f"pattern must be one load per floor, shape [{len(mass)}], got shape {loads.shape}")
        for floor in np.flatnonzero(loads < 0):
            raise ValueError(f"the load on floor {floor + 1} is {loads[floor]:g}; it must be at least 0")
        if loads[-1] == 0:
            raise ValueError("the load on the roof is 0; it must be above 0, so that the storey below it carries shear")
    return loads / loads.sum()


def storey_shears(loads: np.ndarray) -> np.ndarray:
    """Return the shear in each storey, which is the sum of the loads on the floors above it, shape [storey]."""
    return np.cumsum(loads[::-1])[::-1]
