"""The statistics of a run, to which its blocks are added as they finish."""

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
    """Return the statistics of a run, given as one or as several, as a list."""
    found = [given] if isinstance(given, Statistic) else given
    if not isinstance(found, list | tuple) or not found or not all(isinstance(each, Statistic) for each in found):
        raise TypeError(
            f"statistics must be a statistic, such as wd.DamageCounts(...), or a list of statistics, got {given!r}"
        )
    return list(found)


class Reduction:
    """The statistics of a run, used in a `with` statement.

    Args:
        statistics: The statistics.
        population: Structures, motions and levels of the samples.
        threads: Number of CPU threads that share the samples of a block.

    Attributes:
        needs: Names of the variables of the samples that are read.

    Raises:
        ValueError, TypeError, MemoryError: If a statistic does not fit the run.
    """

    def __init__(self, statistics: Sequence[Statistic], population: Population, threads: int) -> None:
        self.population, self.statistics = population, tuple(statistics)
        self._reducers = [statistic.reducer(population) for statistic in statistics]
        self.needs = frozenset({"status"}).union(*(reducer.needs for reducer in self._reducers))
        self._failed, self._samples = np.zeros(len(FAILURES), dtype=np.int64), 0
        self._threads, self._side_by_side = Threads(threads), ThreadPoolExecutor(len(self._reducers))
        self._gpus: dict[str, Gpu] = {}

    def __enter__(self) -> Self:
        self.variables()  # raises an error for names that collide, before any sample runs
        return self

    def __exit__(self, *error: object) -> None:
        self._side_by_side.shutdown()
        for each in self._all_workers:
            each.close()

    def add(self, structures: np.ndarray, rows: Arrays) -> None:
        """Add the samples of some structures, after those of all structures before them.

        Args:
            structures: Their numbers.
            rows: Variables of their samples; the first dimension is the sample.
        """
        events = self.population.scene.excitation.event_names
        for event in range(len(events)):
            values = rows
            if len(events) > 1:  # take each history of an event once
                copies = self.population.samples(-1) // self.population.samples(event)
                values = {name: np.ascontiguousarray(array[::copies, event]) for name, array in rows.items()}
            block = Block(structures, event, values)
            self._count_failures(block.status)
            # In parallel, because each reducer waits for its own kernels.
            adding = [self._side_by_side.submit(reducer.add, block, self._threads) for reducer in self._reducers]
            for each in adding:
                each.result()

    def gpu(self, device: str) -> Gpu:
        """Return the workers that reduce samples on a GPU."""
        if device not in self._gpus:
            self._gpus[device] = Gpu(device)
        return self._gpus[device]

    def add_on_gpu(
        self, structures: np.ndarray, rows: Mapping[str, Any], status: np.ndarray, heights: np.ndarray, gpu: Gpu
    ) -> None:
        """Queue the addition of samples on the GPU that integrated them, and return at once; only for a single event.

        Args:
            structures: Their numbers.
            rows: Variables of their samples on the GPU, and the index of the motion on the host; the first dimension is
                the sample.
            status: Their status, on the host.
            heights: Their storey heights [m], shape [structure or 1, storey].
            gpu: The GPU.
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
        """Count the samples of a block, and those that failed."""
        self._samples += status.size
        if status.max(initial=0) >= DIVERGED:
            self._failed += np.bincount(status, minlength=len(STATUS_MEANINGS))[DIVERGED:]

    def finish(self) -> None:
        """Wait until all samples are added.

        Raises:
            ValueError: If a sample that is ok has no valid demand.
        """
        for each in self._all_workers:
            each.finish()

    @property
    def _all_workers(self) -> tuple[Workers, ...]:
        return self._threads, *self._gpus.values()

    def of_structures(self, structures: np.ndarray) -> Reduction:
        """Return the same statistics for only some structures, given by their increasing numbers."""
        part = copy(self)
        part._reducers = [reducer.of_structures(structures) for reducer in self._reducers]
        part._failed, part._samples = np.zeros_like(self._failed), 0
        return part

    def partial(self) -> Arrays:
        """Return the contribution of the samples so far to the statistics, for `include`."""
        found = {"failed": self._failed, "samples": np.array(self._samples)}
        for place, reducer in enumerate(self._reducers):
            found |= {f"{place}/{name}": values for name, values in reducer.partial().items()}
        return found

    def include(self, part: Arrays) -> None:
        """Add a result of `partial` for structures that are not added yet, in any order."""
        self._failed += part["failed"]
        self._samples += int(part["samples"])
        for place, reducer in enumerate(self._reducers):
            before = f"{place}/"
            reducer.include({name.removeprefix(before): a for name, a in part.items() if name.startswith(before)})

    def variables(self) -> tuple[Variables, Coordinates]:
        """Return all variables and coordinates."""
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
        """Return the statistics as a dataset, and warn if many samples failed.

        Args:
            rest: Further variables and attributes of the run.
        """
        self.finish()
        total = int(self._failed.sum())
        if total > LARGEST_EXCLUDED_FRACTION * self._samples:
            of_each = ", ".join(f"{n:,} {name}" for n, name in zip(self._failed, FAILURES, strict=True) if n)
            warn_caller(
                f"{total:,} of {self._samples:,} samples ({100 * total / self._samples:.2g} %) failed ({of_each}) and "
                "are in no statistic; fragility() and damage_shares() raise an error for this share. Try a shorter step"
            )
        scene = self.population.scene
        levels = levels_of(scene)
        measure = levels[0].measure if len(levels) == 1 else {}
        attributes: dict[str, Any] = {**trace(scene.title, "simulate"), **measure, "scene": scene.to_json()}
        variables, coordinates = self.variables()
        dataset = xr.Dataset(variables, coordinates, attributes)
        return dataset.merge(rest).assign_attrs(attributes | rest.attrs)


def _are_same(one: tuple, other: tuple) -> bool:
    """Return whether two variables have the same dimensions, values and attributes."""
    return one[0] == other[0] and np.array_equal(one[1], other[1], equal_nan=True) and one[2] == other[2]
