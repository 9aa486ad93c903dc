"""Functions that check bounds of a parameter which depend on other parameters, and describe violations."""

from __future__ import annotations

import numpy as np
from numpy.typing import ArrayLike


def first_bad(bad: ArrayLike, name: str, values: ArrayLike, words: str, bounds: ArrayLike, reason: str) -> str | None:
    """Return a sentence about the first value of a parameter that violates its bound, or None if no value does.

    Args:
        bad: Whether each value violates its bound, shape [storey] or [structure, storey].
        name: Name of the parameter.
        values: Values of the parameter.
        words: Required relation of a value to its bound, such as "at most".
        bounds: Bound of each value.
        reason: Meaning of the bound, for the end of the sentence.
    """
    bad, values, bounds = np.broadcast_arrays(bad, values, bounds)
    if not np.any(bad):
        return None
    place = first_place(bad)
    return f"{name} is {values[place]:g} at {place_of(place)}; it must be {words} {bounds[place]:g}, {reason}"


def first_place(bad: np.ndarray) -> tuple[int, ...]:
    """Return the indices of the first True element of a mask [storey] or [structure, storey]."""
    return tuple(np.argwhere(bad)[0])


def place_of(place: tuple[int, ...]) -> str:
    """Return a text for messages, such as "structure 0, storey 2", for indices that are counted from 0.

    In the text, storeys are counted from 1 and structures from 0.
    """
    *structure, storey = place
    return ", ".join([f"structure {i}" for i in structure] + [f"storey {storey + 1}"])


def above(values: np.ndarray, bounds: np.ndarray) -> np.ndarray:
    """Return a mask of the values that exceed their computed bound by more than a rounding error."""
    return values > bounds + 1e-12 * np.abs(bounds)
