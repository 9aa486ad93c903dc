"""Whole histories of chosen samples, besides what all samples record."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass

import numpy as np
import xarray as xr

from warpdyn.accuracy.scattered_steps import shorten_steps
from warpdyn.core.checks import whole_number
from warpdyn.core.output_variables import DIVERGED
from warpdyn.integration.ensemble import Ensemble
from warpdyn.integration.run import Run
from warpdyn.integration.settings import Integration
from warpdyn.integration.stability_guard import Findings, guard
from warpdyn.kernels.queues import Queue
from warpdyn.running.labels import history_variables


@dataclass(frozen=True)
class Histories:
    """Samples whose whole histories are kept.

    Args:
        samples: Indices along the dimension `sample`, at least one.
        every: Number of steps from one kept state to the next; the first state is kept.

    Raises:
        ValueError: If a number is not whole or negative, or there is no sample.
    """

    samples: Sequence[int] = (0,)
    every: int = 1

    def __post_init__(self) -> None:
        samples = np.atleast_1d(np.asarray(self.samples))
        if samples.ndim != 1 or samples.size == 0:
            raise ValueError(f"histories.samples must be a row of at least one sample, got {self.samples!r}")
        whole = tuple(whole_number("histories.samples", sample, 0) for sample in samples.tolist())
        object.__setattr__(self, "samples", whole)
        object.__setattr__(self, "every", whole_number("histories.every", self.every, 1))


class KeptHistories:
    """The samples of a run whose histories are kept: prepared before the run, integrated after it.

    Args:
        histories: The samples.
        run: The run.
        queue: Device queue that they are integrated on.
        integration: How the run is integrated.

    Raises:
        ValueError: If a sample is not in the run, or the samples' steps do not divide each other.
    """

    def __init__(self, histories: Histories, run: Run, queue: Queue, integration: Integration) -> None:
        if len(run.samples_by_event) > 1:
            raise ValueError(
                "histories of an EventSequence are not kept: leave them out, or run its first event by itself"
            )
        for sample in histories.samples:
            if sample >= run.samples:
                raise ValueError(f"histories ask for sample {sample}, but the run has samples 0 to {run.samples - 1}")
        self.histories = histories
        asked = np.array(histories.samples)
        whole, vibration = run.events(np.unique(asked // (run.samples // run.structures)), queue)[0]
        findings = Findings(whole.sample.size, integration.method)  # the run's own are told
        shorten_steps(whole, vibration, findings, divides=integration.divides_steps)
        guard(whole, vibration, integration.on_unstable)
        self.part = whole.select(np.searchsorted(whole.sample, asked))
        self.common_step = self.part.common_step(np.arange(asked.size))
        self._status = np.zeros(asked.size, dtype=np.int8)

    def add(self, run: Ensemble, status: np.ndarray) -> None:
        """Take the final steps and the status of the samples that are in a block."""
        own = np.flatnonzero((self.part.sample >= run.sample[0]) & (self.part.sample <= run.sample[-1]))
        place = self.part.sample[own] - run.sample[0]
        self.part.schedule = self.part.restepped(own, run.schedule.substeps[place])
        self._status[own] = status[place]

    def result(self) -> xr.Dataset:
        """Return the histories; those of samples that failed are NaN."""
        everything = np.arange(len(self.histories.samples))
        time, values = self.part.integrate_histories(everything, self.histories.every, self.common_step)
        for array in values.values():
            array[self._status >= DIVERGED] = np.nan
        return history_variables(self.histories.samples, time, values)
