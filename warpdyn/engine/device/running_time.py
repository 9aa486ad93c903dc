"""Running time of launches that overlap."""

from __future__ import annotations

from collections.abc import Iterable, Sequence
from typing import Protocol

import numpy as np


class Timed(Protocol):
    """A queue of a device with the times of its launches: (start, end) [s]."""

    device: str
    spans: list[tuple[float, float]]


def seconds_covered(spans: Iterable[tuple[float, float]]) -> float:
    """Return the time [s] during which at least one of the spans (start, end) [s] was running; spans may overlap."""
    covered, reached = 0.0, -np.inf
    for start, end in sorted(spans):
        covered += max(0.0, end - max(start, reached))
        reached = max(reached, end)
    return covered


def seconds_in_kernels(queues: Sequence[Timed]) -> float:
    """Return the running time of all kernels [s]; with several devices, the longest of the devices' times."""
    spans: dict[str, list[tuple[float, float]]] = {}
    for queue in queues:
        spans.setdefault(queue.device, []).extend(queue.spans)
    return max(seconds_covered(each) for each in spans.values())
