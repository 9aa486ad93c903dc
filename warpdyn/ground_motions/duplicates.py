"""Records that stand in a set twice, which statistics count double."""

from __future__ import annotations

from collections.abc import Sequence
from hashlib import blake2b

import numpy as np

from warpdyn.core.messages import warn_caller
from warpdyn.ground_motions.motions import GroundMotion

BESIDE = np.array([1, -1, 2, -2, 4, -4, 8, -8, 16, -16])  # samples from the peak
DUPLICATE = 1e-3  # of the peak, by which two copies of a record differ at most


def warn_of_duplicates(motions: Sequence[GroundMotion], *, is_scaled: bool) -> None:
    """Warn where two motions of a set are one record, as two copies of it are, also if digits were lost in one.

    Args:
        motions: The motions.
        is_scaled: Whether they are scaled to levels, so that copies at different scales are one record too.
    """
    alike: dict[tuple[float, int, int], list[int]] = {}
    shapes: list[np.ndarray] = []
    for index, motion in enumerate(motions):
        peak = motion.peak_ground_acceleration
        shape = motion.acceleration / peak if is_scaled and peak > 0 else motion.acceleration
        shapes.append(shape)
        alike.setdefault((motion.step, shape.size, int(np.abs(shape).argmax())), []).append(index)
    first_of: dict[int, int] = {}
    for (_, _, place), group in alike.items():
        if len(group) > 1:
            first_of |= _copies(shapes, group, place)
    found = [(motions[first_of[index]].name, motions[index].name) for index in sorted(first_of)]
    if found:
        (first, second), rest = found[0], f" (and {len(found) - 1} more such)" if len(found) > 1 else ""
        warn_caller(f"motions {first!r} and {second!r}{rest} are the same record twice, which statistics count double")


def _copies(shapes: Sequence[np.ndarray], group: Sequence[int], place: int) -> dict[int, int]:
    """Return, of each copy in a group of records that have their peak at one place, the first record that it is of."""
    first_of: dict[int, int] = {}
    by_digest: dict[bytes, int] = {}
    for index in group:
        first = by_digest.setdefault(blake2b(shapes[index].tobytes()).digest(), index)
        if first != index:
            first_of[index] = first
    # Of two copies each value is nearly the same: those beside the peak tell most other records apart at once.
    single = list(by_digest.values())
    beside = np.clip(place + BESIDE, 0, shapes[single[0]].size - 1)
    probes = np.array([shapes[index][beside] for index in single])
    near = DUPLICATE * np.array([np.abs(shapes[index]).max() for index in single])
    order = np.argsort(probes[:, 0])
    ends = np.searchsorted(probes[order, 0], probes[order, 0] + near.max(), side="right")
    for i, end in enumerate(ends):
        one, others = order[i], order[i + 1 : end]
        for other in others[(np.abs(probes[others] - probes[one]) <= near.max()).all(axis=1)]:
            first, copy = sorted((int(one), int(other)))
            if _is_copy(shapes[single[first]], shapes[single[copy]], near[copy]):
                first_of[single[copy]] = min(single[first], first_of.get(single[copy], single[first]))
    return first_of


def _is_copy(shape: np.ndarray, other: np.ndarray, near: float) -> bool:
    return bool(np.abs(shape - other).max() <= near)
