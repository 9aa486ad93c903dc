"""Launches of a kernel, and their division into slices that threads share."""

from itertools import pairwise
from typing import NamedTuple

import numpy as np

from warpdyn.kernels.plan import Plan

SLICES_PER_THREAD = 8  # short last slices keep all threads busy to the end


class Launch(NamedTuple):
    """One launch of a kernel over some of the samples that were handed to the device.

    Args:
        plan: The kernel's plan.
        control: The launch's scalars.
        samples: Its samples, as the kernels' struct.
        steps: Steps of each of them, falling, shape [sample].
    """

    plan: Plan
    control: object
    samples: object
    steps: np.ndarray


def slices(launches: list[Launch], lanes: int, threads: int) -> list[tuple[Launch, int, int]]:
    """Divide launches into slices of rows of lanes that take about as long each; the longest samples' come first."""
    costs = [np.cumsum(launch.steps[::lanes], dtype=np.float64) for launch in launches]  # a row is as long as its first
    share = sum(cost[-1] for cost in costs) / (threads * SLICES_PER_THREAD)
    parts = []
    for launch, cost in zip(launches, costs, strict=True):
        count = max(1, round(cost[-1] / share))
        edges = np.searchsorted(cost, np.linspace(0, cost[-1], count + 1)[1:-1])
        edges = np.unique([0, *(edges + 1), cost.size])
        parts += [(launch, int(a), int(b)) for a, b in pairwise(edges)]
    return sorted(parts, key=lambda part: -part[0].steps[part[1] * lanes])
