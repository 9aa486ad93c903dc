"""Launches of kernels, and the division of launches into slices of samples for CPU threads."""

from itertools import pairwise
from typing import NamedTuple

import numpy as np

from warpdyn.engine.kernels.plan import Plan

SLICES_PER_THREAD = 8  # short last slices keep all threads busy to the end
# Steps (of all rows of lanes together) times storeys of the largest launch that runs in the calling thread. It takes
# less than 0.1 s with the slowest laws, and usually less than it takes to wake other threads on a busy machine.
LEAST_OF_THREADS = 4096


class Launch(NamedTuple):
    """One launch of a kernel for some of the uploaded samples.

    A motion consists of intervals (time between two values), and each interval consists of `substeps` integration
    steps.

    Args:
        plan: Plan of the kernel.
        inputs: Structs Control, Samples, Structure and Load of the launch.
        count: Number of samples.
        substeps: Steps per interval.
        order: Indices of the samples among the uploaded samples, longest runs first, shape [sample]; not used on a GPU.
        intervals: Number of intervals of each uploaded sample, shape [uploaded sample]; not used on a GPU.
    """

    plan: Plan
    inputs: tuple[object, object, object, object]
    count: int
    substeps: int
    order: np.ndarray
    intervals: np.ndarray

    def steps_of_rows(self, lanes: int, first: int = 0, last: int | None = None) -> np.ndarray:
        """Return the number of integration steps of rows `first` to `last` - 1, shape [row].

        A row is a group of `lanes` samples that one thread integrates at once. Its first sample is its longest, so the
        steps of this sample are the steps of the row.
        """
        end = None if last is None else last * lanes
        return self.intervals[self.order[first * lanes : end : lanes]] * np.float64(self.substeps)


def is_small(launches: list[Launch], lanes: int) -> bool:
    """Return whether launches are so small that a CPU should not divide them among threads."""
    return sum(launch.steps_of_rows(lanes).sum() * launch.plan.dofs for launch in launches) <= LEAST_OF_THREADS


def slices(launches: list[Launch], lanes: int, threads: int) -> list[tuple[Launch, int, int]]:
    """Divide launches into slices of about the same run time for CPU threads; return the slices, the longest first.

    Args:
        launches: The launches.
        lanes: Number of samples that a thread integrates at once; such a group is called a row.
        threads: Number of threads.

    Returns:
        Tuples (launch, first row, last row + 1), slices with the longest samples first.
    """
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
