"""Tables that take the samples of a run block by block: in memory, in a file, or into statistics alone."""

from __future__ import annotations

from collections import deque
from collections.abc import Mapping
from concurrent.futures import Future, ThreadPoolExecutor
from functools import partial
from types import TracebackType
from typing import Any, Protocol, Self

import numpy as np
import warp as wp
import xarray as xr

from warpdyn.campaigns.integration.ensemble import Ensemble
from warpdyn.campaigns.integration.model import Model
from warpdyn.campaigns.integration.run import Run
from warpdyn.campaigns.reductions.reduction import Reduction
from warpdyn.campaigns.running.labels import Arrays, Column, labelled, lengths
from warpdyn.engine.kernels.queues import CudaQueue
from warpdyn.foundations.core.thread_pool import result_of
from warpdyn.foundations.files.netcdf import GrowingFile

MOST_UNDER_WAY = 2  # blocks that are left to be added to statistics


class Table(Protocol):
    """A table that takes the rows of a run's samples, used in a `with` statement.

    Args:
        columns: Variables of the dataset with one value for each sample.
        reduces: Whether it takes samples of a single event where a GPU integrated them.
    """

    columns: dict[str, Column]
    reduces: bool

    def __enter__(self) -> Self: ...

    def __exit__(self, kind: type | None, error: BaseException | None, trace: TracebackType | None) -> None: ...

    def rows_for(self, samples: int) -> Arrays:
        """Return memory for the next samples."""

    def add(self, rows: Arrays, run: Ensemble, staying: Mapping[str, Any]) -> None:
        """Add samples whose rows are complete, after all earlier samples.

        Args:
            rows: Their rows.
            run: The samples.
            staying: Variables that their GPU has kept, sample first; none if all are in the rows.
        """

    def finish(self, rest: xr.Dataset) -> xr.Dataset:
        """Return the dataset, with the variables and attributes that are known only at the end."""


class InMemory:
    """The whole dataset, each variable allocated once.

    Args:
        model: How the samples are integrated.
        columns: Variables of the dataset with one value for each sample.
        samples: Number of samples in the run.
    """

    reduces = False

    def __init__(self, model: Model, columns: dict[str, Column], samples: int) -> None:
        self.model, self.columns = model, columns
        self.rows, self._given = blank_rows(model, columns, samples), 0

    def __enter__(self) -> InMemory:
        return self

    def __exit__(self, kind: type | None, error: BaseException | None, trace: TracebackType | None) -> None:
        pass

    def rows_for(self, samples: int) -> Arrays:
        """Return memory for the next samples."""
        self._given += samples
        return {name: values[self._given - samples : self._given] for name, values in self.rows.items()}

    def add(self, rows: Arrays, run: Ensemble, staying: Mapping[str, Any]) -> None:
        """Add samples whose rows are complete; nothing is copied, as they are in place."""

    def finish(self, rest: xr.Dataset) -> xr.Dataset:
        """Return the dataset, with the variables and attributes that are known at the end."""
        dataset = labelled(self.model, self.columns, self.rows)
        attributes = dataset.attrs | rest.attrs
        return (dataset.merge(rest) if rest.variables else dataset).assign_attrs(attributes)


class InFile:
    """A netCDF file that grows; a block's rows are freed when they have been written.

    Args:
        model: How the samples are integrated.
        columns: Variables of the dataset with one value for each sample.
        file: The file.
    """

    reduces = False

    def __init__(self, model: Model, columns: dict[str, Column], file: GrowingFile) -> None:
        self.model, self.columns, self.file = model, columns, file

    def __enter__(self) -> InFile:
        self.file.__enter__()
        return self

    def __exit__(self, kind: type | None, error: BaseException | None, trace: TracebackType | None) -> None:
        self.file.__exit__(kind, error, trace)

    def rows_for(self, samples: int) -> Arrays:
        """Return memory for the next samples."""
        return blank_rows(self.model, self.columns, samples)

    def add(self, rows: Arrays, run: Ensemble, staying: Mapping[str, Any]) -> None:
        """Take samples whose rows are complete, after all those before them."""
        self.file.append(rows, lambda first: labelled(self.model, self.columns, first))

    def finish(self, rest: xr.Dataset) -> xr.Dataset:
        """Return the dataset as the file has it, with the variables and attributes that are known at the end."""
        self.file.finish(rest)
        return xr.open_dataset(self.file.unfinished.path, engine="netcdf4")


class Reduced:
    """The statistics of a run, to which the rows of blocks are added; the memory of rows serves blocks in turn.

    A thread of its own adds them, one block after the other, while the next blocks are launched and read.

    Samples of a single event stay on a GPU, and are reduced there.

    Args:
        run: The run.
        columns: Variables with one value for each sample, of which those that the statistics read are held.
        reduction: The statistics.
        structures: Numbers of the run's structures among those of the statistics.
        is_estimated: Whether errors are estimated, from samples on the host.
    """

    def __init__(
        self,
        run: Run,
        columns: dict[str, Column],
        reduction: Reduction,
        structures: np.ndarray,
        *,
        is_estimated: bool = False,
    ) -> None:
        self.model = run.model
        self.reduces = run.execution.is_gpu and len(run.samples_by_event) == 1 and not is_estimated
        on_host = reduction.needs & {"status", "motion_index"} if self.reduces else reduction.needs
        self.columns = {name: columns[name] for name in on_host}
        self._reduction, self._structures, self._done = reduction, structures, 0
        self._samples_per_structure = run.model.scene.excitation.samples_per_structure
        self._free: list[Arrays] = []
        self._adding, self._is_whole = ThreadPoolExecutor(1), True
        self._under_way = deque[Future[Any]]()

    def __enter__(self) -> Reduced:
        return self

    def __exit__(self, kind: type | None, error: BaseException | None, trace: TracebackType | None) -> None:
        self._adding.shutdown(cancel_futures=True)

    def rows_for(self, samples: int) -> Arrays:
        """Return memory for the next samples."""
        for place, rows in enumerate(self._free):
            if len(rows["status"]) == samples:
                return self._free.pop(place)
        return blank_rows(self.model, self.columns, samples)

    def add(self, rows: Arrays, run: Ensemble, staying: Mapping[str, Any]) -> None:
        """Reduce samples whose rows are complete, after all those before them."""
        first, count = self._done, len(rows["status"]) // self._samples_per_structure
        self._done += count
        structures = self._structures[first : self._done]
        if staying:
            heights = run.heights if "height" in run.drawn else run.heights[:1]
            what = structures, rows, dict(staying), heights, run.queue.device
            released = self._adding.submit(self._reduce_on_gpu, *what)
            assert isinstance(run.queue, CudaQueue)  # nothing stays anywhere else
            run.queue.hold_until(partial(result_of, released))
            self._under_way.append(released)
        else:
            self._under_way.append(self._adding.submit(self._reduce, structures, rows))
        self._wait_for(MOST_UNDER_WAY)

    def finish(self, rest: xr.Dataset) -> xr.Dataset:
        """Return the variables and attributes that are known at the end, without the statistics.

        A GPU may still reduce: memory that is let go of meanwhile is freed on the default stream, which waits for it.
        """
        self._wait_for(0)
        return rest

    def _reduce(self, structures: np.ndarray, rows: Arrays) -> None:
        """Add a block, unless one before it could not be added: then the run ends."""
        if self._is_whole:
            self._is_whole = False
            self._reduction.add(structures, rows)
            self._is_whole = True
            self._free.append(rows)

    def _reduce_on_gpu(
        self, structures: np.ndarray, rows: Arrays, staying: dict[str, Any], heights: np.ndarray, device: str
    ) -> wp.Event:
        """Queue a block's reductions, likewise; return the event after which its GPU may change what stays on it."""
        gpu = self._reduction.gpu(device)
        if self._is_whole:
            self._is_whole = False
            motion = {name: rows[name] for name in rows if name == "motion_index"}
            self._reduction.add_on_gpu(structures, staying | motion, rows["status"], heights, gpu)
            self._is_whole = True
            self._free.append(rows)
        return gpu.stream.record_event()

    def _wait_for(self, most: int) -> None:
        """Wait until at most so many blocks are left to be added."""
        while len(self._under_way) > most:
            result_of(self._under_way.popleft())


def blank_rows(model: Model, columns: dict[str, Column], samples: int) -> Arrays:
    """Return memory for the columns of some samples."""
    return {name: np.empty((samples, *lengths(model, column)), column.dtype) for name, column in columns.items()}
