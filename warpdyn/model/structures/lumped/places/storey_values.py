"""Checks of values per storey or per floor: their number, and their bounds."""

from __future__ import annotations

import numpy as np
from numpy.typing import ArrayLike

from warpdyn.foundations.core.checks import finite_numbers


def storey_values(
    what: str, given: ArrayLike, storeys: int | None, units: str, *, least: float | None = None
) -> np.ndarray:
    """Return one value per storey, shape [storey]; a single value applies to all storeys.

    Args:
        what: Name of the argument, for messages.
        given: One value, or one per storey from the ground up.
        storeys: Number of storeys; None: the length of `given`, which must be a list.
        units: Units, for messages.
        least: Smallest allowed value; None: values must be above 0.
    """
    values = finite_numbers(what, given, units)
    if storeys is None and (values.ndim != 1 or not values.size):
        raise ValueError(
            f"{what} must be a list with one value per storey, from the ground up, got shape {list(values.shape)}"
        )
    if values.shape not in ((), (len(values) if storeys is None else storeys,)):
        raise ValueError(
            f"{what} must be one value or one per storey ({storeys}), from the ground up, got shape "
            f"{list(values.shape)}"
        )
    for bad in np.argwhere(values <= 0 if least is None else values < least):
        bound = "above 0" if least is None else f"at least {least:g}"
        of_storey = f" of storey {bad[0] + 1}" if bad.size else ""
        raise ValueError(f"{what}{of_storey} is {values[tuple(bad)]:g} {units}; it must be {bound}".replace("  ", " "))
    return np.array(np.broadcast_to(values, values.shape if storeys is None else (storeys,)))


def floor_masses(given: ArrayLike) -> np.ndarray:
    """Return the floor masses [kg], shape [floor], or raise a ValueError that names the floor."""
    masses = finite_numbers("floor_mass", given, "kg")
    if masses.ndim != 1 or not masses.size:
        raise ValueError(
            f"floor_mass must be a list with one value per floor, from the first floor up, got shape "
            f"{list(masses.shape)}"
        )
    for bad in np.flatnonzero(masses <= 0):
        raise ValueError(f"floor_mass of floor {bad + 1} is {masses[bad]:g} kg; it must be above 0")
    return masses
