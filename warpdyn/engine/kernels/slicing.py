"""Launches of kernels, and their division into slices that threads run."""

from itertools import pairwise
from typing import NamedTuple

import numpy as np

from warpdyn.engine.kernels.plan import Plan

SLICES_PER_THREAD = 8  # short last slices keep all threads busy to the end


class Launch(NamedTuple):
    """One launch of a kernel for some of the uploaded samples.

    Args:
        plan: Plan of the kernel.
        inputs: Structs Control, Samples, Structure and Load of the launch.
        count: Number of samples.
        substeps: Steps per interval.
        order: Indices of the samples among the uploaded samples, longest runs first, shape [sample]; a GPU needs none.
        intervals: Number of intervals of each uploaded sample, shape [uploaded sample]; a GPU needs none.
    """

    plan: Plan
    inputs: tuple[object, object, object, object]
    count: int
    substeps: int
    order: np.ndarray
    intervals: np.ndarray

    def steps_of_rows(self, lanes: int, first: int = 0, last: int | None = None) -> np.ndarray:
        """Return the number of steps of rows `first` to `last` - 1; the first sample of a row is the longest."""
        end = None if last is None else last * lanes
        return self.intervals[self.order[first * lanes : end : lanes]] * np.float64(self.substeps)


def slices(launches: list[Launch], lanes: int, threads: int) -> list[tuple[Launch, int, int]]:
    """Divide launches into slices (launch, first row, last row) of about the same run time, longest samples first."""
    steps = [launch.steps_of_rows(lanes) for launch in launches]
    costs = [np.cumsum(each) for each in steps]
    share = sum(cost[-1] for cost in costs) / (threads * SLICES_PER_THREAD)
    parts = []
    for launch, of_rows, cost in zip(launches, steps, costs, strict=True):
        count = max(1, round(cost[-1] / share))
        edges = np.searchsorted(cost, np.linspace(0, cost[-1], count + 1)[1:-1])
        edges = np.unique([0, *(edges + 1), cost.size])
        parts += [(-of_rows[a], launch, int(a), int(b)) for a, b in pairwise(edges)]
    return [part[1:] for part in sorted(parts, key=lambda part: part[0])]
