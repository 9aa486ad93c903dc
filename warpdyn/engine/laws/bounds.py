"""Bounds of a parameter that depend on other parameters."""

from __future__ import annotations

import numpy as np
from numpy.typing import ArrayLike


def first_bad(bad: ArrayLike, name: str, values: ArrayLike, words: str, bounds: ArrayLike, reason: str) -> str | None:
    """Return a sentence on the first value out of its bound, or None.

    Args:
        bad: Whether each value is out of its bound, shape [storey] or [structure, storey].
        name: The parameter.
        values: Its values.
        words: Relation of values to bounds, such as "at most".
        bounds: The bounds.
        reason: Meaning of the bounds.
    """
    bad, values, bounds = np.broadcast_arrays(bad, values, bounds)
    if not np.any(bad):
        return None
    place = first_place(bad)
    return f"{name} is {values[place]:g} at {place_of(place)}; it must be {words} {bounds[place]:g}, {reason}"


def first_place(bad: np.ndarray) -> tuple[int, ...]:
    """Return the indices of the first bad value, [storey] or [structure, storey]."""
    return tuple(np.argwhere(bad)[0])


def place_of(place: tuple[int, ...]) -> str:
    """Return the place of these indices in words; storeys are counted from 1."""
    *structure, storey = place
    return ", ".join([f"structure {i}" for i in structure] + [f"storey {storey + 1}"])


def above(values: np.ndarray, bounds: np.ndarray) -> np.ndarray:
    """Return where values are above computed bounds by more than rounding."""
    return values > bounds + 1e-12 * np.abs(bounds)
