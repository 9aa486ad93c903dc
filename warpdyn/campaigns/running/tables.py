"""Tables that take the samples of a region block by block: they keep the samples, or reduce them to statistics."""

from __future__ import annotations

from collections import deque
from collections.abc import Mapping
from concurrent.futures import Future, ThreadPoolExecutor
from functools import partial
from typing import Any

import numpy as np
import warp as wp

from warpdyn.campaigns.accuracy.sample_errors import ATTRIBUTES, ERROR, SENSITIVE
from warpdyn.campaigns.integration.ensemble import Ensemble
from warpdyn.campaigns.integration.model import Model
from warpdyn.campaigns.integration.run import Run
from warpdyn.campaigns.reductions.reduction import Reduction
from warpdyn.campaigns.running.labels import Arrays, Column, columns_of, lengths
from warpdyn.campaigns.running.outputs import Outputs
from warpdyn.engine.kernels.queues import CudaQueue
from warpdyn.foundations.core.thread_pool import result_of

MOST_UNDER_WAY = 2  # blocks that may wait to be added to statistics


class InMemory:
    """Samples in memory, which is allocated for all samples.

    Args:
        columns: Variables of the dataset with one value for each sample.
        rows: The memory, by name, sample first.

    Attributes:
        reduces: Whether a GPU keeps the samples to reduce them.
    """

    reduces = False

    def __init__(self, columns: dict[str, Column], rows: Arrays) -> None:
        self.columns, self.rows, self._given = columns, rows, 0

    def rows_for(self, samples: int) -> Arrays:
        """Return memory for the next samples."""
        self._given += samples
        return {name: values[self._given - samples : self._given] for name, values in self.rows.items()}

    def add(self, rows: Arrays, run: Ensemble, staying: Mapping[str, Any]) -> None:
        """Do nothing: the rows are already in their place."""

    def finish(self) -> None:
        """Return at once: all samples are in place."""

    def close(self) -> None:
        """Return at once: no thread adds samples."""


class Reduced:
    """Statistics to which the samples of a region are added; blocks reuse the memory of rows.

    A separate thread adds blocks, one after the other, while the next blocks are launched and read. Samples of a single
    event stay on a GPU, and are reduced there.

    Args:
        run: The run.
        columns: Variables with one value for each sample; only those that the statistics read are kept.
        reduction: The statistics.
        structures: Number of each structure in the statistics.
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

    def close(self) -> None:
        """End the thread that adds samples."""
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
            what = structures, rows, dict(staying), run.storey_heights, run.queue.device
            released = self._adding.submit(self._reduce_on_gpu, *what)
            assert isinstance(run.queue, CudaQueue)  # outputs stay only on GPUs
            run.queue.hold_until(partial(result_of, released))
            self._under_way.append(released)
        else:
            self._under_way.append(self._adding.submit(self._reduce, structures, rows))
        self._wait_for(MOST_UNDER_WAY)

    def finish(self) -> None:
        """Wait until all samples are added.

        A GPU may still reduce: memory that is released meanwhile is freed on the default stream, which waits for it.
        """
        self._wait_for(0)

    def _reduce(self, structures: np.ndarray, rows: Arrays) -> None:
        """Add a block, unless an earlier block failed: then the run ends."""
        if self._is_whole:
            self._is_whole = False
            self._reduction.add(structures, rows)
            self._is_whole = True
            self._free.append(rows)

    def _reduce_on_gpu(
        self, structures: np.ndarray, rows: Arrays, staying: dict[str, Any], heights: np.ndarray, device: str
    ) -> wp.Event:
        """Queue the reductions of a block; return the event after which its GPU may overwrite the block's outputs."""
        gpu = self._reduction.gpu(device)
        if self._is_whole:
            self._is_whole = False
            motion = {name: rows[name] for name in rows if name == "motion_index"}
            self._reduction.add_on_gpu(structures, staying | motion, rows["status"], heights, gpu)
            self._is_whole = True
            self._free.append(rows)
        return gpu.stream.record_event()

    def _wait_for(self, most: int) -> None:
        """Wait until at most `most` blocks are left to be added."""
        while len(self._under_way) > most:
            result_of(self._under_way.popleft())


Table = InMemory | Reduced


def blank_rows(model: Model, columns: dict[str, Column], samples: int) -> Arrays:
    """Return memory for the columns of some samples."""
    return {name: np.empty((samples, *lengths(model, column)), column.dtype) for name, column in columns.items()}


def columns_kept(run: Run, outputs: Outputs) -> dict[str, Column]:
    """Return the variables of a run's dataset that have one value for each sample, by name."""
    columns = columns_of(run.model, outputs.keep_inputs)
    if outputs.sample_error is not None:
        columns[ERROR] = Column((), np.dtype("float64"), ATTRIBUTES[ERROR])
        columns[SENSITIVE] = Column((), np.dtype("int8"), ATTRIBUTES[SENSITIVE])
    return columns
