"""Tables that receive the samples of a region (range of structures) block by block: kept or reduced to statistics."""

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
    """Table that keeps all samples of a region (a range of structures of a run) in memory.

    Args:
        columns: Variables of the dataset with one value for each sample, by name.
        rows: Arrays for all samples of the region, by the name of the variable; the first dimension is the sample.

    Attributes:
        reduces: False: the samples are copied to the host, because no GPU reduces them to statistics.
    """

    reduces = False

    def __init__(self, columns: dict[str, Column], rows: Arrays) -> None:
        self.columns, self.rows, self._given = columns, rows, 0

    def rows_for(self, samples: int) -> Arrays:
        """Return views of the arrays for the next `samples` samples, by the name of the variable."""
        self._given += samples
        return {name: values[self._given - samples : self._given] for name, values in self.rows.items()}

    def add(self, rows: Arrays, run: Ensemble, staying: Mapping[str, Any]) -> None:
        """Do nothing: the block has written its samples to the arrays of `rows_for`."""

    def finish(self) -> None:
        """Do nothing: every block has written its samples to the arrays."""

    def close(self) -> None:
        """Do nothing: this table has no thread that must end."""


class Reduced:
    """Table that reduces the samples of a region (a range of structures) to statistics and does not keep the samples.

    A separate thread adds one block of samples after the other to the statistics, while the main thread launches and
    reads the next blocks. The arrays of a finished block are reused. Samples of a scene with a single event stay on a
    GPU, which reduces them.

    Args:
        run: The prepared run, with its model and devices.
        columns: Variables with one value for each sample, by name; only variables that the statistics need are kept.
        reduction: The statistics.
        structures: Number of each structure of the region in the statistics, shape [structure].
        is_estimated: Whether errors of samples are estimated, which needs the samples on the host.
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
        """End the thread that adds samples to the statistics."""
        self._adding.shutdown(cancel_futures=True)

    def rows_for(self, samples: int) -> Arrays:
        """Return arrays for the next `samples` samples, by the name of the variable; free arrays are reused."""
        for place, rows in enumerate(self._free):
            if len(rows["status"]) == samples:
                return self._free.pop(place)
        return blank_rows(self.model, self.columns, samples)

    def add(self, rows: Arrays, run: Ensemble, staying: Mapping[str, Any]) -> None:
        """Queue a block of samples, whose rows are complete, to be added to the statistics after all earlier blocks."""
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
        """Wait until all samples are added to the statistics.

        A GPU may still reduce its last blocks. Memory that is freed meanwhile is freed on the default stream, which
        waits for these reductions.
        """
        self._wait_for(0)

    def _reduce(self, structures: np.ndarray, rows: Arrays) -> None:
        """Add a block of samples to the statistics on the host; do nothing if an earlier block failed."""
        if self._is_whole:
            self._is_whole = False
            self._reduction.add(structures, rows)
            self._is_whole = True
            self._free.append(rows)

    def _reduce_on_gpu(
        self, structures: np.ndarray, rows: Arrays, staying: dict[str, Any], heights: np.ndarray, device: str
    ) -> wp.Event:
        """Queue the reductions of a block; return the event after which its GPU may overwrite the block's outputs.

        If an earlier block failed, nothing is queued except this event.
        """
        gpu = self._reduction.gpu(device)
        if self._is_whole:
            self._is_whole = False
            motion = {name: rows[name] for name in rows if name == "motion_index"}
            self._reduction.add_on_gpu(structures, staying | motion, rows["status"], heights, gpu)
            self._is_whole = True
            self._free.append(rows)
        return gpu.stream.record_event()

    def _wait_for(self, most: int) -> None:
        """Wait until at most `most` blocks have not yet been added to the statistics."""
        while len(self._under_way) > most:
            result_of(self._under_way.popleft())


Table = InMemory | Reduced


def blank_rows(model: Model, columns: dict[str, Column], samples: int) -> Arrays:
    """Return uninitialised arrays of shape [sample, ...] for `samples` samples, by the name of the column."""
    return {name: np.empty((samples, *lengths(model, column)), column.dtype) for name, column in columns.items()}


def columns_kept(run: Run, outputs: Outputs) -> dict[str, Column]:
    """Return the variables of a run's dataset that have one value for each sample, by name."""
    columns = columns_of(run.model, outputs.keep_inputs)
    if outputs.sample_error is not None:
        columns[ERROR] = Column((), np.dtype("float64"), ATTRIBUTES[ERROR])
        columns[SENSITIVE] = Column((), np.dtype("int8"), ATTRIBUTES[SENSITIVE])
    return columns
