"""The response history of one sample of a live ensemble, which grows while the motion arrives."""

from __future__ import annotations

from dataclasses import replace
from typing import Any

import numpy as np

from warpdyn.campaigns.integration.ensemble import Ensemble
from warpdyn.campaigns.live.paused_ensemble import PausedEnsemble
from warpdyn.engine.kernels.arguments import brought
from warpdyn.engine.kernels.build import history_plan, load_kernel
from warpdyn.engine.kernels.output_table import HISTORIES, OF_CONTROL
from warpdyn.engine.kernels.queues import CpuQueue, Launch, open_queues

SPARE = 2**12  # intervals for which memory is reserved beyond the expected motion


class FollowedSample(PausedEnsemble):
    """One sample, integrated once more by a kernel that records its history at each sample of the motion.

    It has its own queue, so that another thread can integrate it while the ensemble is integrated.

    Args:
        ensemble: The samples with their structures and steps.
        sample: Index of the sample in the ensemble.
        expected: Expected number of intervals of the motion.
    """

    def __init__(self, ensemble: Ensemble, sample: int, expected: int) -> None:
        part = ensemble.select(np.array([sample]))
        part.queue = open_queues([ensemble.queue.device], 1)[0]
        if isinstance(part.queue, CpuQueue):
            part.queue.in_calling_thread = True  # at the end of Python, pools of threads accept no more tasks
        super().__init__(part)
        self._reserve(expected + SPARE)
        load_kernel(self.groups[0].plan, self.device)

    def _launches(self) -> list[Launch]:
        """Return the launch of the sample by the kernel that records one state for each interval of the motion."""
        part, schedule = self.ensemble, self.ensemble.schedule
        part.schedule = replace(schedule, run_intervals=np.array([self.most_intervals], dtype=np.int32), repeats=1)
        launches = part._launches_of(part._pack(), history_plan(part.plan), every=int(schedule.substeps[0]))
        part.schedule = schedule
        return launches

    def _reserve(self, intervals: int) -> None:
        """Let the kernel write the states of intervals up to a number; states that were read are not kept."""
        self._reserved = intervals
        control = OF_CONTROL if self.ensemble.plan.control is not None else ()
        names = (*self.ensemble.model.dynamics.histories, *control)
        widths = {name: self.ensemble.plan.length(HISTORIES[name].dims[0]) for name in names}
        blank = {name: np.full((1, intervals, width), np.nan) for name, width in widths.items()}
        # Not by the queue, which would change the current stream of the GPU for the thread of the ensemble.
        self._history: Any = brought("History", blank, self.dtype, self.device)

    def follow(self, values: np.ndarray, *names: str) -> list[np.ndarray]:
        """Integrate the sample up to the last known acceleration, and return the new part of its history.

        Args:
            values: All accelerations of the motion so far [m/s2], shape [time, component].
            names: Names of the variables, such as "displacement".

        Returns:
            For each variable its values at the beginning of each new interval, shape [time, dof]; those after a
            collapse are NaN.
        """
        first, last = self.intervals, len(values) - 1
        if last > self._reserved:
            self._reserve(2 * last)
        self.advance(values[first:])
        return [self.queue.read(getattr(self._history, name)[:, first:last])[0] for name in names]
