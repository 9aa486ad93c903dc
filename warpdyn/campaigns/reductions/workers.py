"""Execution of reductions of samples: by threads of the CPU, or by the GPU that integrated the samples."""

from __future__ import annotations

from collections import deque
from collections.abc import Callable
from concurrent.futures import ThreadPoolExecutor
from typing import Any

import numpy as np
import warp as wp

from warpdyn.engine.kernels.kernel_cache import THREADS_OF_A_BLOCK, loaded
from warpdyn.engine.kernels.queues import BLOCKS_ON_A_GPU, URGENT
from warpdyn.engine.kernels.reductions.table import reductions

# Least number of samples per thread: a launch takes 0.1 ms in Python, during which no other Python thread runs.
LEAST_SAMPLES = 2**15


class Threads:
    """CPU threads that reduce samples; they read NumPy arrays without copies. `Gpu` has the same methods.

    Args:
        threads: Number of threads.

    Attributes:
        threads: Number of CPU threads; 1 for a GPU, which has thousands of threads.
        memory_of_sums: Bytes that the sums of rows of samples may use at a time.
        copies_of_cells: Largest number of copies of the sums by cell. With copies, several threads can add to the same
            cell in parallel.
    """

    memory_of_sums, copies_of_cells = 2**23, 1  # fits in the cache; no copies, because threads add to different cells

    def __init__(self, threads: int) -> None:
        self.threads = threads
        self._pool = ThreadPoolExecutor(threads)

    def array(self, values: np.ndarray) -> Any:
        """Return values as an array that the threads can read until they have reduced a block of samples."""
        return values

    def constant(self, values: np.ndarray) -> Any:
        """Return constant values as an array that the threads can read for all blocks (a CPU needs no copy)."""
        return values

    def empty(self, shape: tuple[int, ...], dtype: Any) -> Any:
        """Return an uninitialised array that the threads can write to until a block of samples is reduced."""
        return np.empty(shape, dtype)

    def no_states(self, shape: tuple[int, ...]) -> Any:
        """Return an array of states filled with zeros, which the threads can change until the block is reduced."""
        return np.zeros(shape, np.uint16)

    def kept(self, values: np.ndarray) -> Any:
        """Return values as an array that the threads change from block to block (the same array: a CPU needs no
        copy)."""
        return values

    def read(self, array: Any) -> np.ndarray:
        """Return an array from `kept` as a NumPy array on the host."""
        return array

    def run(
        self,
        kernel: wp.Kernel,
        first: int,
        last: int,
        arguments: Callable[[int], tuple],
        least: int = 1,
        most: int = 0,
        together: int = 1,
    ) -> None:
        """Launch a reduction kernel over parts of a range in parallel threads, and wait until it is done.

        Args:
            kernel: The kernel, from `reductions`.
            first, last: First element of the range, and the element after its last one.
            arguments: Function of the thread number that returns the kernel arguments after the range.
            least: Smallest number of elements in a part.
            most: Largest number of parts; 0: the number of threads.
            together: Number of successive elements that the same CPU thread must process.
        """
        loaded(kernel)
        parts = max(1, min(most or self.threads, self.threads, (last - first) // max(1, least)))
        edges = (np.linspace(first // together, last // together, parts + 1).astype(int) * together).tolist()

        def part(begin: int, end: int, thread: int) -> None:
            wp.launch(kernel, dim=1, inputs=[begin, end, 1, *arguments(thread)], device="cpu")

        if parts == 1:
            part(first, last, 0)
            return
        list(self._pool.map(part, edges[:-1], edges[1:], range(parts)))

    def units_of_part(self, units: int) -> int:
        """Return how many of the `units` units of a row one CPU thread processes: all units."""
        return units

    def groups(self, cell_of_row: np.ndarray, units: int) -> tuple[np.ndarray, np.ndarray, int]:
        """Return groups of rows whose sums are added to cells, so that two threads never add to the same cell.

        On a CPU all rows are one group, and each thread processes some units of every row, so that rows are read in the
        order of memory.

        Args:
            cell_of_row: Number of each row's cell, shape [row].
            units: Number of units of a row.

        Returns:
            Rows sorted by group; start of each group and end of the last one; number of units for each thread.
        """
        rows = np.arange(cell_of_row.size, dtype=np.int32)
        return rows, np.array([0, rows.size], dtype=np.int32), -(-units // self.threads)

    def bad(self, demand: str) -> Any:
        """Return an array of -1, to which kernels write the number of a structure if its demand is not valid."""
        return np.full(self.threads, -1, dtype=np.int32)

    def refuse(self, demand: str, bad: Any) -> None:
        """Raise a ValueError if a kernel has written the number of a structure to `bad`."""
        _refuse(demand, bad)

    def finish(self) -> None:
        """Do nothing: on a CPU, each call waits until its samples are reduced."""

    def close(self) -> None:
        """End the CPU threads that reduce samples."""
        self._pool.shutdown()


class Gpu:
    """A GPU that reduces samples on a separate stream, one block after the other, while the host continues.

    The methods of this class are not called by the thread that launches response histories, but by another one. All
    threads of a process share the current stream of a device. Therefore the methods do not use the current stream, or
    wait for the whole device after using it.

    Args:
        device: Name of the GPU, such as "cuda:0".
    """

    threads, memory_of_sums, copies_of_cells = 1, 2**28, 64

    def __init__(self, device: str) -> None:
        self.device = device
        # This stream has priority; otherwise it would wait behind the history kernels of other blocks.
        self.stream = wp.Stream(device, priority=URGENT)
        # Arrays of a block, which the next block reuses: every block requests the same arrays in the same order.
        self._held: list[wp.array] = []
        self._views: list[tuple[tuple[int, ...], wp.array]] = []  # shapes and views of these arrays at their last use
        self._taken = 0
        # Host memory of the last blocks' uploads stays allocated: some GPUs read it after the copy was queued.
        self._kept_alive: deque[list[wp.array]] = deque([[]], maxlen=BLOCKS_ON_A_GPU + 1)
        self._constants: dict[int, tuple[np.ndarray, wp.array]] = {}
        self._bad: dict[str, wp.array] = {}

    def begin(self) -> None:
        """Begin another block, which reuses the device memory of the previous block."""
        self._taken = 0
        self._kept_alive.append([])

    def array(self, values: np.ndarray) -> Any:
        """Return a copy of the values on the device, which is valid until the next block."""
        values = np.ascontiguousarray(values)
        there = self.empty(values.shape, values.dtype)
        here: Any = wp.array(values, dtype=there.dtype, device="cpu", copy=False)
        wp.copy(there, here, stream=self.stream)
        self._kept_alive[-1].append(here)
        return there

    def constant(self, values: np.ndarray) -> Any:
        """Return a copy of constant values on the device; it is made once and used for all blocks."""
        if id(values) not in self._constants:
            self._constants[id(values)] = values, self.kept(values)  # keep `values`, so that its id stays unique
        return self._constants[id(values)][1]

    def empty(self, shape: tuple[int, ...], dtype: Any) -> Any:
        """Return an uninitialised array on the device, whose memory the next block reuses."""
        kind, size = wp.dtype_from_numpy(np.dtype(dtype)), int(np.prod(shape))
        place, self._taken = self._taken, self._taken + 1
        if place < len(self._views):
            taken, view = self._views[place]
            if taken == shape and view.dtype is kind:
                return view
        if place == len(self._held) or self._held[place].dtype is not kind or self._held[place].size < size:
            # Allocate 25 % more, because another allocation for a larger block would wait for the whole device.
            held = wp.empty(max(size + size // 4, 1), dtype=kind, device=self.device)
            wp.synchronize_device(self.device)
            self._held[place : place + 1] = [held]
        view = self._held[place][:size].reshape(shape)
        self._views[place : place + 1] = [(shape, view)]
        return view

    def no_states(self, shape: tuple[int, ...]) -> Any:
        """Return an array of states filled with zeros on the device, whose memory the next block reuses."""
        found = self.empty(shape, np.uint16)
        flat = found.reshape((found.size,))
        self.run(reductions().zeros, 0, found.size, lambda thread: (flat,))
        return found

    def kept(self, values: np.ndarray) -> Any:
        """Return a copy of the values on the device, which the kernels change from block to block."""
        copy: wp.array = wp.array(values, dtype=wp.dtype_from_numpy(values.dtype), device=self.device)
        wp.synchronize_device(self.device)
        return copy

    def read(self, array: Any) -> np.ndarray:
        """Return a copy of a device array on the host, after all queued kernels are done."""
        wp.synchronize_stream(self.stream)
        return array.numpy()

    def run(
        self,
        kernel: wp.Kernel,
        first: int,
        last: int,
        arguments: Callable[[int], tuple],
        least: int = 1,
        most: int = 0,
        together: int = 1,
    ) -> None:
        """Queue a reduction kernel over a range, with one GPU thread per element; arguments: see `Threads.run`."""
        loaded(kernel, self.device)
        inputs = [first, last, last - first, *arguments(0)]
        wp.launch(kernel, dim=last - first, inputs=inputs, stream=self.stream, block_dim=THREADS_OF_A_BLOCK)

    def units_of_part(self, units: int) -> int:
        """Return how many units of a row a GPU thread processes: one, because there are thousands of threads."""
        return 1

    def groups(self, cell_of_row: np.ndarray, units: int) -> tuple[np.ndarray, np.ndarray, int]:
        """Return groups of rows: one group for each cell; a GPU thread processes one unit of a group.

        Arguments and result: see `Threads.groups`.
        """
        order = np.argsort(cell_of_row, kind="stable").astype(np.int32)
        in_order = cell_of_row[order]
        start = np.flatnonzero(np.append(True, in_order[1:] != in_order[:-1]))
        return order, np.append(start, order.size).astype(np.int32), 1

    def bad(self, demand: str) -> Any:
        """Return the device array to which kernels write the number of a structure whose demand is not valid."""
        if demand not in self._bad:
            self._bad[demand] = self.kept(np.full(1, -1, dtype=np.int32))
        return self._bad[demand]

    def refuse(self, demand: str, bad: Any) -> None:
        """Do nothing: `finish` reads `bad` after it has waited for the GPU."""

    def finish(self) -> None:
        """Wait until all samples are reduced; raise a ValueError if the demand of a sample that is ok is not valid."""
        wp.synchronize_stream(self.stream)
        self._constants.clear()  # the next region has other constants
        for demand, bad in self._bad.items():
            _refuse(demand, bad.numpy())

    def close(self) -> None:
        """Free the memory that the reductions use on the GPU."""
        for held in (self._held, self._views, self._constants):
            held.clear()


Workers = Threads | Gpu


def _refuse(demand: str, bad: np.ndarray) -> None:
    """Raise a ValueError if `bad` contains the number of a structure (not -1), whose demand is then not valid."""
    if (bad >= 0).any():
        raise ValueError(
            f"a sample of structure {bad[bad >= 0][0]} is 'ok' but its {demand} is not valid: it must be finite, and "
            "a peak not negative. Please report this with the scene"
        )
