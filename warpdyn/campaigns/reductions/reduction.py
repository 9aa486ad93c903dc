"""Reduction of a run's samples to statistics, to which the blocks of the run are added when they finish."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from concurrent.futures import ThreadPoolExecutor
from copy import copy
from typing import Any, Self

import numpy as np
import warp as wp
import xarray as xr

from warpdyn.campaigns.integration.dynamics import Arrays
from warpdyn.campaigns.integration.model import levels_of
from warpdyn.campaigns.reductions.cells import Coordinates, Variables
from warpdyn.campaigns.reductions.limits import DRIFT
from warpdyn.campaigns.reductions.population import Population
from warpdyn.campaigns.reductions.statistic import Statistic
from warpdyn.campaigns.reductions.tally import FAILURES, Block
from warpdyn.campaigns.reductions.workers import Gpu, Threads, Workers
from warpdyn.engine.kernels.reductions.table import reductions
from warpdyn.foundations.core.messages import warn_caller
from warpdyn.foundations.core.output_variables import DIVERGED, LARGEST_EXCLUDED_FRACTION, STATUS_MEANINGS
from warpdyn.foundations.files.netcdf import trace


def checked_statistics(given: object) -> list[Statistic]:
    """Return the requested statistics of a run as a list; `given` is one statistic or a list of statistics."""
    found = [given] if isinstance(given, Statistic) else given
    if not isinstance(found, list | tuple) or not found or not all(isinstance(each, Statistic) for each in found):
        raise TypeError(
            f"statistics must be a statistic, such as wd.DamageCounts(...), or a list of statistics, got {given!r}"
        )
    return list(found)


class Reduction:
    """All statistics that are requested of a run; it is used in a `with` statement.

    Args:
        statistics: The statistics.
        population: Structures, motions and levels of the samples.
        threads: Number of CPU threads among which the samples of a block are divided.

    Attributes:
        needs: Names of the variables of samples that are needed.

    Raises:
        ValueError, TypeError, MemoryError: If a statistic cannot be computed for the run.
    """

    def __init__(self, statistics: Sequence[Statistic], population: Population, threads: int) -> None:
        self.population, self.statistics = population, tuple(statistics)
        self._reducers = [statistic.reducer(population) for statistic in statistics]
        self.needs = frozenset({"status"}).union(*(reducer.needs for reducer in self._reducers))
        self._failed, self._samples = np.zeros(len(FAILURES), dtype=np.int64), 0
        self._threads, self._side_by_side = Threads(threads), ThreadPoolExecutor(len(self._reducers))
        self._gpus: dict[str, Gpu] = {}

    def __enter__(self) -> Self:
        self.variables()  # raises an error if two statistics have the same variable name, before any sample runs
        return self

    def __exit__(self, *error: object) -> None:
        self._side_by_side.shutdown()
        for each in self._all_workers:
            each.close()

    def add(self, structures: np.ndarray, rows: Arrays) -> None:
        """Add the samples of some structures; all structures before them must already be added.

        Args:
            structures: Numbers of the structures in the run.
            rows: Variables of their samples by name, shape [sample, ...].
        """
        events = self.population.scene.excitation.event_names
        for event in range(len(events)):
            values = rows
            if len(events) > 1:  # use each history of an event once: samples may share it
                copies = self.population.samples(-1) // self.population.samples(event)
                values = {name: np.ascontiguousarray(array[::copies, event]) for name, array in rows.items()}
            block = Block(structures, event, values)
            self._count_failures(block.status)
            # In parallel, because each reducer waits for its own kernels.
            adding = [self._side_by_side.submit(reducer.add, block, self._threads) for reducer in self._reducers]
            for each in adding:
                each.result()

    def gpu(self, device: str) -> Gpu:
        """Return the object that reduces samples on a GPU; it is created once for each device."""
        if device not in self._gpus:
            self._gpus[device] = Gpu(device)
        return self._gpus[device]

    def add_on_gpu(
        self, structures: np.ndarray, rows: Mapping[str, Any], status: np.ndarray, heights: np.ndarray, gpu: Gpu
    ) -> None:
        """Queue the addition of samples on the GPU that integrated them, and return at once (single event only).

        Args:
            structures: Numbers of the structures in the run.
            rows: Variables of their samples by name, shape [sample, ...], in the memory of the GPU; the motion index is
                on the host.
            status: Outcome of each sample, on the host, shape [sample].
            heights: Storey heights [m], shape [structure or 1, storey].
            gpu: The GPU, from `gpu`.
        """
        gpu.begin()
        self._count_failures(status)
        if DRIFT in self.needs:
            drift = rows["peak_storey_drift"]
            real = np.dtype(wp.dtype_to_numpy(drift.dtype))
            ratio = gpu.empty(drift.shape, real)
            given = status.size // structures.size, drift, gpu.array(heights.astype(real)), ratio
            gpu.run(reductions().ratios[str(real)], 0, status.size, lambda thread: given)
            rows = {**rows, DRIFT: ratio}
        block = Block(structures, 0, rows)
        for reducer in self._reducers:
            reducer.add(block, gpu)

    def _count_failures(self, status: np.ndarray) -> None:
        """Count the samples of a block, and count the failed samples by status."""
        self._samples += status.size
        if status.max(initial=0) >= DIVERGED:
            self._failed += np.bincount(status, minlength=len(STATUS_MEANINGS))[DIVERGED:]

    def finish(self) -> None:
        """Wait until all samples are added to the statistics.

        Raises:
            ValueError: If the demand of a sample with the status ok is not valid.
        """
        for each in self._all_workers:
            each.finish()

    @property
    def _all_workers(self) -> tuple[Workers, ...]:
        return self._threads, *self._gpus.values()

    def of_structures(self, structures: np.ndarray) -> Reduction:
        """Return the same statistics, still empty, for some structures only, given by increasing numbers."""
        part = copy(self)
        part._reducers = [reducer.of_structures(structures) for reducer in self._reducers]
        part._failed, part._samples = np.zeros_like(self._failed), 0
        return part

    def partial(self) -> Arrays:
        """Return the contribution of all samples added so far, as arrays by name, for `include`."""
        found = {"failed": self._failed, "samples": np.array(self._samples)}
        for place, reducer in enumerate(self._reducers):
            found |= {f"{place}/{name}": values for name, values in reducer.partial().items()}
        return found

    def include(self, part: Arrays) -> None:
        """Add a result of `partial` for structures that are not added yet; parts may come in any order."""
        self._failed += part["failed"]
        self._samples += int(part["samples"])
        for place, reducer in enumerate(self._reducers):
            before = f"{place}/"
            reducer.include({name.removeprefix(before): a for name, a in part.items() if name.startswith(before)})

    def variables(self) -> tuple[Variables, Coordinates]:
        """Return the variables and the coordinates of all statistics, by name."""
        said = {"long_name": "samples whose integration failed, by status", "units": "1"}
        variables: Variables = {"failed_samples": ("failure", self._failed, said)}
        coordinates: Coordinates = {}
        for reducer in self._reducers:
            own, axes = reducer.variables()
            for name, (dims, values, attributes) in own.items():
                if name in variables and not _are_same(variables[name], (dims, values, attributes)):
                    raise ValueError(
                        f"two statistics have different values of {name!r}: give them different dimensions over=, or "
                        "use separate runs"
                    )
            for name, (_, values, _) in axes.items():
                if name in coordinates and not np.array_equal(coordinates[name][1], values):
                    raise ValueError(f"two statistics have different values along {name!r}: use separate runs")
            variables, coordinates = variables | own, coordinates | axes
        return variables, coordinates

    def dataset(self, rest: xr.Dataset) -> xr.Dataset:
        """Return all statistics as a dataset, and warn if many samples failed.

        Args:
            rest: Further variables and attributes of the run, which are added to the dataset.
        """
        self.finish()
        total = int(self._failed.sum())
        if total > LARGEST_EXCLUDED_FRACTION * self._samples:
            of_each = ", ".join(f"{n:,} {name}" for n, name in zip(self._failed, FAILURES, strict=True) if n)
            warn_caller(
                f"{total:,} of {self._samples:,} samples ({100 * total / self._samples:.2g} %) failed ({of_each}) and "
                "are in no statistic; fragility() and damage_shares() raise an error for this share. Give a shorter "
                "step= or another method="
            )
        scene = self.population.scene
        levels = levels_of(scene)
        measure = levels[0].measure if len(levels) == 1 else {}
        attributes: dict[str, Any] = {**trace(scene.title, "simulate"), **measure, "scene": scene.to_json()}
        variables, coordinates = self.variables()
        dataset = xr.Dataset(variables, coordinates, attributes)
        return dataset.merge(rest).assign_attrs(attributes | rest.attrs)


def _are_same(one: tuple, other: tuple) -> bool:
    """Return whether two variables, as (dimensions, values, attributes), are equal."""
    return one[0] == other[0] and np.array_equal(one[1], other[1], equal_nan=True) and one[2] == other[2]
