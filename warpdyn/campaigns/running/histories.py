"""Whole response histories of chosen samples, which a run returns in addition to the peaks of all samples."""

from __future__ import annotations

from collections.abc import Iterator, Sequence
from dataclasses import dataclass

import numpy as np
import xarray as xr

from warpdyn.campaigns.accuracy.scattered_steps import shorten_steps
from warpdyn.campaigns.integration.ensemble import Ensemble
from warpdyn.campaigns.integration.run import Run
from warpdyn.campaigns.integration.stability_guard import guard
from warpdyn.campaigns.running.labels import history_variables
from warpdyn.engine.kernels.queues import Queue
from warpdyn.foundations.core.checks import check_memory, finite_numbers, shortened, whole_number
from warpdyn.foundations.core.near_misses import with_suggestions
from warpdyn.foundations.core.output_variables import DIVERGED

# Largest number of histories: 2^20 histories of 1,000 steps need 24 kB per storey each.
MOST_HISTORIES = 2**20
BYTES_OF_A_VALUE = 24  # 3 float64 copies of a value: written by the kernel, read back, and in the dataset


@with_suggestions
@dataclass(frozen=True)
class Histories:
    """Samples whose whole response histories a run returns.

    The times of the histories are multiples of the longest integration step of these samples. If the step of a sample
    does not divide this longest step, its history is interpolated linearly, which may cut peaks; the exact peaks are in
    the variables of the scene's recorders.

    Args:
        samples: Indices along the dimension `sample` of the run's dataset, at least one.
        every: Number of longest steps between two returned states; the initial state is always returned.

    Raises:
        ValueError: If a number is negative or not whole, or if `samples` is empty.

    Example:
        >>> run = wd.simulate(scene, structures=3, histories=wd.Histories([0, 5], every=2))
        >>> run["displacement"].dims
        ('history', 'time', 'dof')
    """

    samples: Sequence[int] = (0,)
    every: int = 1

    def __post_init__(self) -> None:
        if isinstance(self.samples, list | tuple | range) and len(self.samples) > MOST_HISTORIES:
            raise ValueError(
                f"histories.samples asks for {len(self.samples):,} histories, but a run keeps at most "
                f"{MOST_HISTORIES:,}: choose some, such as Histories(range(100))"
            )
        samples = np.atleast_1d(finite_numbers("histories.samples", self.samples))
        if not np.any(samples % 1):
            samples = samples.astype(np.int64)
        if samples.ndim != 1 or samples.size == 0:
            given = shortened(self.samples)
            raise ValueError(f"histories.samples must be a list of at least one sample, got {given}")
        whole = tuple(whole_number("histories.samples", sample, 0) for sample in samples.tolist())
        object.__setattr__(self, "samples", whole)
        object.__setattr__(self, "every", whole_number("histories.every", self.every, 1))


class KeptHistories:
    """Samples of a run whose histories are returned: prepared before the run and integrated again after it.

    Args:
        histories: Indices of the samples, and the interval between returned states.
        run: The prepared run.
        queue: Device queue on which the histories are integrated.

    Raises:
        ValueError: If the run does not contain one of the samples.
    """

    def __init__(self, histories: Histories, run: Run, queue: Queue) -> None:
        if len(run.samples_by_event) > 1:
            raise ValueError(
                "histories of an EventSequence are not kept: remove histories, or run a scene of its first event"
            )
        self.histories = histories
        asked = np.array(histories.samples)
        for sample in asked[asked >= run.samples]:
            raise ValueError(
                f"histories ask for sample {sample}, but the run has samples 0 to {run.samples - 1}: "
                f"remove {sample} from Histories(samples)"
            )
        whole, vibration = run.events(np.unique(asked // (run.samples // run.structures)), queue)[0]
        # The run reports findings on stability; here they are discarded.
        shorten_steps(whole, vibration, run.findings[0], divides=run.integration.divides_steps)
        guard(whole, vibration, run.integration.on_unstable)
        self.part = whole.select(np.searchsorted(whole.sample, asked))
        self.longest_step = float(self.part.schedule.step.max())  # reruns only divide it
        self._check_memory(run)
        self._status = np.zeros(asked.size, dtype=np.int8)

    def _check_memory(self, run: Run) -> None:
        """Raise an error if the histories need more bytes than `memory` of the execution settings, or free memory."""
        schedule = self.part.schedule
        seconds = float((schedule.run_intervals * schedule.substeps * schedule.step).max())
        states = 1 + int(seconds / (self.histories.every * self.longest_step))
        values = len(self.histories.samples) * states * run.model.plan.dofs * len(run.model.dynamics.histories)
        check_memory(
            f"histories= of {len(self.histories.samples):,} samples with up to {states:,} states each",
            BYTES_OF_A_VALUE * values,
            "keep fewer samples, or a larger `every`",
            limit=run.execution.memory,
        )

    def take(self, own: np.ndarray, substeps: np.ndarray, status: np.ndarray) -> None:
        """Set the final steps and the status of some histories, after the run has integrated these samples.

        Args:
            own: Positions of the samples in `Histories.samples`.
            substeps: Final number of integration steps per motion interval, for each of these samples.
            status: Outcome of each of these samples, such as OK or DIVERGED.
        """
        self.part.schedule = self.part.restepped(own, substeps)
        self._status[own] = status

    def result(self) -> xr.Dataset:
        """Integrate the samples again; return their histories as a dataset, NaN for samples that failed."""
        kept = self.histories.every * self.longest_step  # time between the states that are kept [s]
        found = []  # samples, and their histories
        for samples, step in self._groups():
            divides = step == self.longest_step
            time, values = self.part.integrate_histories(samples, self.histories.every if divides else 1, step)
            if not divides:
                values = {name: _interpolated(array, step, time[-1], kept) for name, array in values.items()}
            found.append((samples, values))
        counts = {name: max(values[name].shape[1] for _, values in found) for name in found[0][1]}
        joined = {}
        for name, count in counts.items():
            dofs = found[0][1][name].shape[2]
            joined[name] = np.full((len(self.histories.samples), count, dofs), np.nan)
            for samples, values in found:
                joined[name][samples, : values[name].shape[1]] = values[name]
            joined[name][self._status >= DIVERGED] = np.nan
        time = np.arange(max(counts.values())) * self.histories.every * self.longest_step
        return history_variables(self.histories.samples, time, joined, self.part.scene)

    def _groups(self) -> Iterator[tuple[np.ndarray, float]]:
        """Yield groups of histories that are integrated together, as (positions in `samples`, step of the states [s]).

        The first group contains all samples whose step divides the longest step. The other groups contain one step
        each.
        """
        steps = self.part.schedule.step
        ratio = self.longest_step / steps
        divides = np.isclose(ratio, np.round(ratio), rtol=1e-6, atol=0.0)
        yield np.flatnonzero(divides), self.longest_step
        for step in np.unique(steps[~divides]):
            yield np.flatnonzero(~divides & (steps == step)), float(step)


def outcomes_of(histories: Histories, run: Ensemble, status: np.ndarray) -> tuple[np.ndarray, np.ndarray, np.ndarray]:
    """Return the outcomes of the samples in a block whose whole histories are requested.

    Args:
        histories: Indices of the samples whose histories are requested.
        run: Samples of the block.
        status: Outcome of each sample of the block.

    Returns:
        Positions in `histories.samples` of the samples in the block, their number of steps per interval, their status.
    """
    samples = np.array(histories.samples)
    own = np.flatnonzero((samples >= run.sample[0]) & (samples <= run.sample[-1]))
    place = samples[own] - run.sample[0]
    return own, run.schedule.substeps[place], status[place]


def _interpolated(values: np.ndarray, step: float, end: float, kept: float) -> np.ndarray:
    """Return histories at multiples of `kept`, interpolated linearly; NaN if one of the two states is NaN.

    Args:
        values: The histories, shape [history, time, dof].
        step: Time between two states of `values` [s].
        end: Time of the last state of `values` [s].
        kept: Time between two returned states [s].
    """
    last = values.shape[1] - 1
    place = np.minimum(np.arange(int(end / kept * (1 + 1e-9)) + 1) * (kept / step), last)
    near = np.round(place)
    place = np.where(np.abs(place - near) < 1e-6, near, place)  # the time of a state: not interpolated
    before = np.floor(place).astype(np.int64)
    share = (place - before)[:, None]
    found = values[:, before]
    after = values[:, np.minimum(before + 1, last)]
    return np.where(share == 0, found, found + share * (after - found))
