"""Bounds that one parameter of a storey law sets another."""

from __future__ import annotations

import numpy as np
from numpy.typing import ArrayLike


def first_bad(bad: ArrayLike, name: str, values: ArrayLike, words: str, bounds: ArrayLike, reason: str) -> str | None:
    """Return a sentence on the first value out of its bound, or None.

    Args:
        bad: Where that is, shape [storey] or [structure, storey].
        name: The parameter.
        values: Its values.
        words: How values must lie to the bounds, such as "at most".
        bounds: The bounds.
        reason: What the bounds are.
    """
    bad, values, bounds = np.broadcast_arrays(bad, values, bounds)
    if not np.any(bad):
        return None
    place = tuple(np.argwhere(bad)[0])
    where = ", ".join([f"structure {i}" for i in place[:-1]] + [f"storey {place[-1] + 1}"])
    return f"{name} is {values[place]:g} at {where}; it must be {words} {bounds[place]:g}, {reason}"


def above(values: ArrayLike, bounds: ArrayLike) -> np.ndarray:
    """Return where values are above bounds that are computed, whose rounding is forgiven."""
    return values > bounds + 1e-12 * np.abs(bounds)
