"""Inherent damping of lumped structures."""

from __future__ import annotations

from collections.abc import Mapping

import numpy as np

from warpdyn.foundations.core.checks import one_of
from warpdyn.model.structures.damping import checked_modes
from warpdyn.model.structures.modal import rayleigh_coefficients

DAMPINGS = ("none", "rayleigh", "mass_proportional", "stiffness_proportional", "modal")


def checked_damping(
    damping: str, ratio: float | None, modes: tuple[int, int] | None, dofs: int
) -> tuple[str, tuple[int, int] | None]:
    """Return the kind of damping and the modes of Rayleigh damping, or raise a ValueError if they do not fit."""
    one_of("damping", damping, DAMPINGS)
    if damping == "none" and ratio is not None:
        raise ValueError(f"damping 'none' takes no damping_ratio: give damping={' or '.join(map(repr, DAMPINGS[1:]))}")
    if damping != "none" and ratio is None:
        raise ValueError(f"damping_ratio is missing: damping {damping!r} needs it")
    if damping != "rayleigh" and modes is not None:
        raise ValueError(f"damping_modes needs damping='rayleigh', got damping={damping!r}")
    return damping, checked_modes(modes, dofs) if damping == "rayleigh" else None


def rayleigh_factors(
    damping: str, modes: tuple[int, int] | None, parameters: Mapping[str, np.ndarray], frequency: np.ndarray
) -> np.ndarray:
    """Return the factors a0 of the mass [1/s] and a1 of the stiffness [s], shape [2, structure]; 0 if not used.

    Args:
        damping: Kind of damping.
        modes: The two modes of Rayleigh damping.
        parameters: Parameter values of some structures.
        frequency: Undamped circular frequencies [rad/s], shape [structure, mode].
    """
    nothing = np.zeros(len(frequency))
    if damping == "mass_proportional":
        return np.stack([2 * parameters["damping_ratio"] * frequency[:, 0], nothing])
    if damping == "stiffness_proportional":
        return np.stack([nothing, 2 * parameters["damping_ratio"] / frequency[:, 0]])
    if damping == "rayleigh":
        assert modes is not None
        first, second = (frequency[:, mode - 1] for mode in modes)
        return np.stack(rayleigh_coefficients(first, second, parameters["damping_ratio"]))
    return np.stack([nothing, nothing])
