"""Lateral load patterns on shear chains, and the storey shears that balance them."""

from __future__ import annotations

import numpy as np
from numpy.typing import ArrayLike

from warpdyn.foundations.core.checks import finite_numbers, one_of
from warpdyn.model.structures.modal import chain_stiffness_matrix, modal_properties

PATTERNS = ("first_mode", "triangular", "uniform")


def floor_loads(
    pattern: str | ArrayLike, mass: np.ndarray, height: np.ndarray, stiffness: np.ndarray | None = None
) -> np.ndarray:
    """Return the loads on the floors of a chain under a base shear of 1.

    Args:
        pattern: "first_mode" (floor mass times first mode), "triangular" (floor mass times height above the ground),
            "uniform" (floor mass), or loads of any scale from the ground up, shape [floor].
        mass: Floor mass [kg], shape [storey].
        height: Storey height [m], shape [storey].
        stiffness: Storey stiffness [N/m], less the P-Delta stiffness, shape [storey]; the first mode needs it.

    Returns:
        Floor loads of sum 1, shape [floor].

    Raises:
        ValueError: If the pattern is unknown, has another shape, a load is below 0 or the roof's load is not above 0.
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
    """Return the sum of the floor loads above each storey, shape [storey]."""
    return np.cumsum(loads[::-1])[::-1]
