"""Records that stand in a set twice, which statistics count double."""

from __future__ import annotations

from collections.abc import Sequence

import numpy as np

from warpdyn.core.messages import warn_caller
from warpdyn.ground_motions.motions import GroundMotion

DUPLICATE = 1e-3  # of the peak, by which two copies of a record differ at most


def warn_of_duplicates(motions: Sequence[GroundMotion], *, is_scaled: bool) -> None:
    """Warn where two motions of a set are one record, as two copies of it are, also if digits were lost in one.

    Args:
        motions: The motions.
        is_scaled: Whether they are scaled to levels, so that copies at different scales are one record too.
    """
    alike: dict[tuple[float, int, int], list[tuple[str, np.ndarray]]] = {}
    found: list[tuple[str, str]] = []
    for motion in motions:
        peak = motion.peak_ground_acceleration
        shape = motion.acceleration / peak if is_scaled and peak > 0 else motion.acceleration
        key = motion.step, shape.size, int(np.abs(shape).argmax())
        others = alike.setdefault(key, [])
        near = DUPLICATE * float(np.abs(shape).max())
        found += [(name, motion.name) for name, other in others if np.abs(shape - other).max() <= near][:1]
        others.append((motion.name, shape))
    if found:
        (first, second), rest = found[0], f" (and {len(found) - 1} more such)" if len(found) > 1 else ""
        warn_caller(f"motions {first!r} and {second!r}{rest} are the same record twice, which statistics count double")
