"""Backbones that are given by corners: drift and force of each corner, divided by those of the yield point."""

from __future__ import annotations

import itertools
import re

import numpy as np

from warpdyn.engine.laws.bounds import first_place, place_of
from warpdyn.engine.laws.law import Values
from warpdyn.engine.laws.parameter import Parameter

# After a falling segment, the last segment of a backbone may rise by this factor: GEM's capacity curves end with a
# residual strength that rises by 1 %, rounded in their tables.
LARGEST_LAST_RISE = 1.0101


def ductility(corner: int) -> Parameter:
    """Return the parameter for the drift at a corner of the backbone, divided by the yield drift (corner 1)."""
    return Parameter("1", f"drift at corner {corner} over the yield drift", low=0.0)


def force_ratio(corner: int) -> Parameter:
    """Return the parameter for the force at a corner of the backbone, divided by the yield force (corner 1)."""
    return Parameter("1", f"force at corner {corner} over the yield force", low=0)


def corners(p: Values, count: int) -> tuple[list[np.ndarray], list[np.ndarray]]:
    """Return the ductilities and the force ratios of all corners of the backbone, from the yield point on.

    Ductilities and force ratios are lists with one array per corner, shape [storey] or [structure, storey].
    """
    numbers = range(2, count + 1)
    names = [f"{what}_{i}" for what in ("ductility", "force_ratio") for i in numbers]
    one = np.ones(np.broadcast_shapes(*(np.shape(p[name]) for name in ("yield_force", *names))))
    return [one, *(p[f"ductility_{i}"] * one for i in numbers)], [one, *(p[f"force_ratio_{i}"] * one for i in numbers)]


def has_negative_side(p: Values) -> bool:
    """Return whether the user gave parameters of the negative side, so that the two sides of a storey may differ."""
    return any(name.endswith("_negative") for name in p)


def negative_side(p: Values) -> Values:
    """Return the parameters of the negative side of a law, renamed to the names of the positive side."""
    return {**p, **{name.removesuffix("_negative"): p[name] for name in p if name.endswith("_negative")}}


def named_as_negative(problem: str | None, p: Values) -> str | None:
    """Return a sentence in which names of parameters are replaced by those of the negative side, such as `x_negative`.

    Only names whose negative parameter was given are replaced.
    """
    if problem is None:
        return None
    given = [name.removesuffix("_negative") for name in p if name.endswith("_negative")]
    return re.sub(rf"\b({'|'.join(given)})\b", r"\1_negative", problem) if given else problem


def falls(p: Values, count: int) -> bool:
    """Return whether the force of any storey's backbone may decrease from one corner to the next.

    Args:
        p: Parameters, each of shape [storey] or [value, storey]; the number of values may differ between parameters.
        count: Number of corners, including the yield point.
    """
    forces = [np.ones((1, 1)), *(np.atleast_2d(p[f"force_ratio_{i}"]) for i in range(2, count + 1))]
    return any((after.min(axis=0) < before.max(axis=0)).any() for before, after in itertools.pairwise(forces))


def backbone_problem(p: Values, count: int) -> str | None:
    """Return a sentence that describes why a backbone is impossible, or None if it is possible.

    - Drifts must increase from corner to corner.
    - No segment may be steeper than the first segment.
    - After a falling segment, no segment may rise, except the last one by 1 %: reloading towards a peak on a rising
      segment would pass above the lowest force, and cycles would generate energy.
    """
    drift, force = corners(p, count)
    for i in range(1, count):
        name, last = f"ductility_{i + 1}", "1, that of yield" if i == 1 else f"ductility_{i}, "
        values = np.broadcast_to(p[name], drift[0].shape)
        if np.any(bad := values <= drift[i - 1]):
            bound = last if i == 1 else f"{last}{drift[i - 1][first_place(bad)]:g}"
            return f"{name} is {values[first_place(bad)]:g} ({place_of(first_place(bad))}); it must be above {bound}"
        rise, length = force[i] - force[i - 1], drift[i] - drift[i - 1]
        if np.any(bad := rise > length * (1 + 1e-9)):  # rounding is tolerated
            name, place = f"force_ratio_{i + 1}", first_place(bad)
            return (
                f"{name} is {force[i][place]:g} ({place_of(place)}); it must be at most "
                f"{force[i - 1][place] + length[place]:g}: no segment may be stiffer than the first one"
            )
    for i in range(2, count):
        rise = LARGEST_LAST_RISE if i == count - 1 else 1.0
        if np.any(bad := (force[i] > rise * force[i - 1]) & (np.min(np.diff(np.stack(force[:i]), axis=0), axis=0) < 0)):
            name, place = f"force_ratio_{i + 1}", first_place(bad)
            return (
                f"{name} is {force[i][place]:g} ({place_of(place)}); it must be at most force_ratio_{i}, "
                f"{force[i - 1][place]:g}: after a falling segment it may not rise again, except by 1 % at the end"
            )
    return None
