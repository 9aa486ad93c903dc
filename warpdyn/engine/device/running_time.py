"""Running time of launches that overlap."""

from collections.abc import Iterable

import numpy as np


def seconds_covered(spans: Iterable[tuple[float, float]]) -> float:
    """Return the time [s] during which at least one of the spans (start, end) [s] was running; spans may overlap."""
    covered, reached = 0.0, -np.inf
    for start, end in sorted(spans):
        covered += max(0.0, end - max(start, reached))
        reached = max(reached, end)
    return covered
