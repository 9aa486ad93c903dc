"""Queues of kernel launches: `CpuQueue` (threads) and `CudaQueue` (streams of a GPU) have the same methods."""

import threading
import time
from collections.abc import Callable, Collection, Iterable, Sequence
from concurrent.futures import ThreadPoolExecutor
from contextlib import AbstractContextManager, nullcontext
from functools import partial
from itertools import cycle
from typing import Any

import numpy as np
import warp as wp

from warpdyn.engine.device.filling import as_words, filling_kernel, word_of
from warpdyn.engine.kernels.arguments import as_field, blank_value, check_held, wrapped
from warpdyn.engine.kernels.build import load_kernel
from warpdyn.engine.kernels.kernel_cache import THREADS_OF_A_BLOCK, initialise, loaded
from warpdyn.engine.kernels.plan import Plan, output_struct, structs
from warpdyn.engine.kernels.slicing import SLICES_PER_THREAD as SLICES_PER_THREAD, Launch, is_small, slices
from warpdyn.foundations.core import checks
from warpdyn.foundations.core.interruption import stop_if_asked
from warpdyn.foundations.core.thread_pool import as_finished

# A launch cannot be interrupted, so launches are cut into pieces of about SECONDS_OF_A_PIECE, after which Ctrl-C works.
SECONDS_OF_A_PIECE, MOST_GROWTH = 0.3, 16  # a piece has at most MOST_GROWTH times as many steps as the last piece
FIRST_PIECE = 3e4  # steps times storeys of the first piece; with the slowest laws it takes 0.5 s
PART = 2**17  # samples of an output that one thread copies
WAIT_FOR_GPU = 2e-4  # seconds between checks whether the GPU has finished or Ctrl-C was pressed
# Number of blocks (groups of samples) on a GPU at the same time: while the host waits for one block, others use the
# GPU. A block has one launch for each number of steps per interval; its launches run on STREAMS_OF_A_BLOCK streams.
BLOCKS_ON_A_GPU, STREAMS_OF_A_BLOCK = 3, 3
Advance = Callable[[int], object]  # takes the number of samples that have finished since its last call
URGENT = -1  # priority of streams whose kernels run before all waiting kernels of other streams


def checked_devices(device: str | Sequence[str] | None) -> tuple[str, ...]:
    """Return the names of the devices of a run.

    Args:
        device: One name or several names; "cuda": all GPUs; None: the first GPU, or the CPU if there is no GPU.

    Raises:
        TypeError: If `device` is neither a name nor a sequence of names.
        ValueError: If a device does not exist, is named twice, or the CPU is named together with a GPU.
    """
    initialise()
    gpus = [f"cuda:{i}" for i in range(wp.get_cuda_device_count())]
    if device is None:
        return (gpus[0] if gpus else "cpu",)
    given = [device] if isinstance(device, str) else device
    if not isinstance(given, Sequence):
        raise TypeError(f"device must be a name such as 'cuda:0' or a list of names, got {device!r}")
    names = tuple(gpus) if list(given) == ["cuda"] and gpus else tuple(given)
    for name in names:
        if name not in ("cpu", *gpus):
            raise ValueError(f"this computer has no device {name!r}; available: {', '.join(['cpu', *gpus])}")
    if not names or len(set(names)) < len(names) or ("cpu" in names and len(names) > 1):
        raise ValueError(f"device must be one device or several different GPUs (device='cuda' for all), got {device!r}")
    return names


def device_names(devices: Sequence[str]) -> str:
    """Return a text with the name and the model of each device for the dataset, such as "cuda:0 (NVIDIA H100)"."""
    return ", ".join(f"{device} ({wp.get_device(device).name})" for device in devices)


def free_memory(device: str) -> int:
    """Return the free memory of a device [bytes]."""
    if device != "cpu":
        return wp.get_device(device).free_memory
    return checks.free_memory()


class CpuQueue:
    """Queue of the CPU: arrays are not copied, and `launch` returns when the kernels have finished."""

    device = "cpu"

    def __init__(self, threads: int) -> None:
        self.threads, self.in_calling_thread = threads, False
        self.spans: list[tuple[float, float]] = []
        self._pace: dict[Plan, float] = {}  # steps (of all rows of lanes together) that a thread takes per piece

    def begin(self) -> None:
        """Delete the recorded times of the last run."""
        self.spans.clear()

    def memory(self, kind: str, name: str, shape: tuple[int, ...], dtype: Any) -> wp.array:
        """Return a new uninitialised Warp array; `kind` and `name` are ignored."""
        return wp.empty(shape, dtype=dtype, device=self.device)

    def fetch(self, arrays: dict[str, wp.array]) -> Callable[[], dict[str, np.ndarray]]:
        """Return a function that returns the arrays as NumPy arrays {name: array}."""
        return lambda: {name: array.numpy() for name, array in arrays.items()}

    def urgently(self) -> AbstractContextManager[object]:
        """Return a context that does nothing: on a CPU, launches run at once."""
        return nullcontext()

    def upload(self, kind: str, arrays: dict[str, np.ndarray], dtype: str) -> Any:
        """Return the struct `kind`, such as "Load", with these arrays, converted to the types of its fields."""
        struct = getattr(structs(dtype), kind)
        instance = struct()
        for name, values in arrays.items():
            setattr(instance, name, wrapped(struct, name, as_field(struct, name, values)))
        return instance

    def blank(self, into: dict[str, np.ndarray], dtype: str) -> Any:
        """Fill `into` (first index: sample) with blank values; return a struct Output that shares its memory."""
        struct = output_struct(dtype, into)
        instance = struct()
        for name, values in into.items():
            values.fill(blank_value(struct, name))
            setattr(instance, name, wrapped(struct, name, values.T))
        return instance

    def launch(
        self, launches: list[Launch], arguments: list, advance: Advance = lambda done: None, *, is_rerun: bool = False
    ) -> None:
        """Divide launches into slices, run the slices in threads, and wait until all have finished.

        Small launches, and all launches if `in_calling_thread` is True, run in the calling thread. A slice is launched
        in pieces of about SECONDS_OF_A_PIECE; Ctrl-C works between two pieces. A piece is a whole number of groups of
        `plan.lanes` samples.

        Args:
            launches: The launches.
            arguments: Further arguments of the kernels, after the inputs of each launch.
            advance: Function that is called with the number of samples that have finished since its last call.
            is_rerun: Ignored: on a CPU, launches follow one another.
        """
        # Load the kernels before the threads start; otherwise each thread would compile them.
        kernels = {plan: load_kernel(plan, self.device) for plan in {launch.plan for launch in launches}}
        lanes = launches[0].plan.lanes

        stopping = threading.Event()

        def run(launch: Launch, first: int, last: int) -> int:
            plan = launch.plan
            costs = np.cumsum(launch.steps_of_rows(plan.lanes, first, last))
            done = 0
            while done < costs.size and not stopping.is_set():
                stop_if_asked()
                # Number of groups of samples that take SECONDS_OF_A_PIECE, estimated from the last pieces.
                before = costs[done - 1] if done else 0.0
                until = max(
                    done + 1,
                    int(np.searchsorted(costs, before + self._pace.get(plan, FIRST_PIECE / plan.dofs), "right")),
                )
                inputs = [first + done, *launch.inputs, *arguments]
                began = time.perf_counter()
                wp.launch(kernels[plan], dim=until - done, inputs=inputs, device=self.device)
                seconds = max(time.perf_counter() - began, SECONDS_OF_A_PIECE / MOST_GROWTH)
                self._pace[plan] = (costs[until - 1] - before) * SECONDS_OF_A_PIECE / seconds
                done = until
            return min(last * plan.lanes, launch.count) - first * plan.lanes

        started = time.perf_counter()
        pool = ThreadPoolExecutor(self.threads)  # without a thread until its first task
        try:
            if is_small(launches, lanes):
                for launch in launches:
                    advance(run(launch, 0, -(-launch.count // lanes)))
                return
            parts = slices(launches, lanes, self.threads)
            if self.in_calling_thread:
                for part in parts:
                    advance(run(*part))
                return
            tasks = [pool.submit(run, *part) for part in parts]
            for done in as_finished(tasks):
                advance(done.result())
        finally:
            stopping.set()
            pool.shutdown(cancel_futures=True)
            self.spans.append((started, time.perf_counter()))

    def start_reading(
        self, output: Any, shapes: dict[str, tuple[int, ...]], arriving: Collection[str] | None = None
    ) -> None:
        """Do nothing: on a CPU, outputs need no copy."""

    def settle(self) -> None:
        """Do nothing: on a CPU, a launch has finished when `launch` returns."""

    def read_into(self, rows: dict[str, np.ndarray], each: Callable[..., Iterable[object]] = map) -> None:
        """Do nothing: on a CPU, kernels write the outputs directly into the arrays of `blank`."""

    def read(self, array: Any) -> np.ndarray:
        """Return a Warp array as a NumPy array."""
        return array.numpy()


class CudaQueue:
    """Queue of a GPU for one block (group of samples) at a time, with its own CUDA streams.

    Memory is kept for the next block, because freeing memory would wait for everything that is queued on the GPU.

    Args:
        device: Name of the GPU, such as "cuda:0".
        origin: Event that was recorded on the GPU earlier; times are measured from this event.
    """

    def __init__(self, device: str, origin: wp.Event) -> None:
        self.device, self.origin = device, origin
        # Preparations, copies and reruns of a few samples begin before waiting histories of other blocks.
        self.stream = wp.Stream(device, priority=URGENT)  # makes the copies
        self.streams = [wp.Stream(device) for _ in range(STREAMS_OF_A_BLOCK)]
        self.streams_of_reruns = [wp.Stream(device, priority=URGENT) for _ in range(STREAMS_OF_A_BLOCK)]
        self.spans: list[tuple[float, float]] = []
        # Arrays that are used again; key: purpose and dtype (samples that run again may have another dtype).
        self.held: dict[tuple[str, str, Any], wp.array] = {}
        self._sent: dict[str, wp.Event] = {}  # struct -> event after which its arrays on the host may be overwritten
        self._kept_alive: list[object] = []
        self._timed: list[tuple[wp.Event, wp.Event]] = []
        self._arriving: dict[str, np.ndarray] = {}
        self._arrived: wp.Event | None = None
        self.staying: dict[str, Any] = {}  # outputs that remain on the GPU; their first index is the sample
        self._held_until: Callable[[], wp.Event] | None = None
        self._advance: Callable[[], object] = lambda: None

    def begin(self) -> None:
        """Delete times and outputs of the last run, which may have been interrupted, without waiting for it."""
        self.spans.clear()
        self.staying, self._held_until = {}, None

    def memory(self, kind: str, name: str, shape: tuple[int, ...], dtype: Any) -> wp.array:
        """Return a GPU array for the present block of samples; its memory is used again for the next block."""
        return self._array((kind, name), shape, dtype)

    def urgently(self) -> AbstractContextManager[object]:
        """Return a context in which kernels run before those of all blocks in progress."""
        return wp.ScopedStream(self.stream, sync_enter=False)

    def fetch(self, arrays: dict[str, wp.array]) -> Callable[[], dict[str, np.ndarray]]:
        """Queue copies of GPU arrays to the host; return a function that waits for them and returns NumPy arrays."""
        found = {name: self._array(("fetched", name), a.shape, a.dtype, pinned=True) for name, a in arrays.items()}
        for name, array in arrays.items():
            wp.copy(found[name], array)
        event = wp.get_stream(self.device).record_event()

        def wait() -> dict[str, np.ndarray]:
            self._wait(event)
            return {name: array.numpy().copy() for name, array in found.items()}

        return wait

    def upload(self, kind: str, arrays: dict[str, np.ndarray], dtype: str) -> Any:
        """Return the struct `kind` with these arrays, copied to the GPU and converted to the types of its fields.

        The copies are queued without waiting, from page-locked memory, which is ten times as fast as other memory.
        """
        struct = getattr(structs(dtype), kind)
        instance = struct()
        if kind in self._sent:
            self._wait(self._sent[kind])
        try:
            for name, values in arrays.items():
                field = struct.vars[name].type.dtype
                check_held(name, values, wp.dtype_to_numpy(field))
                here = self._array((f"{kind} to be sent", name), values.shape, field, pinned=True)
                np.copyto(here.numpy(), values, casting="unsafe")
                there = self._array((kind, name), values.shape, field)
                wp.copy(there, here, stream=self.stream)
                setattr(instance, name, there)
        finally:  # even after an error: the queued copies read the host arrays until this event
            self._sent[kind] = self.stream.record_event()
        return instance

    def blank(self, into: dict[str, np.ndarray], dtype: str) -> Any:
        """Return a struct Output with blank GPU arrays, of the transposed shapes of `into` (last index: sample)."""
        struct = output_struct(dtype, into)
        instance = struct()
        for name, values in into.items():
            array = self._array(("Output", name), values.T.shape, struct.vars[name].type.dtype)
            words, word = as_words(array), word_of(blank_value(struct, name))
            kernel = loaded(filling_kernel(words.dtype), self.device)
            wp.launch(kernel, dim=words.size, inputs=[words, word], stream=self.stream, block_dim=THREADS_OF_A_BLOCK)
            setattr(instance, name, array)
        return instance

    def launch(
        self, launches: list[Launch], arguments: list, advance: Advance = lambda done: None, *, is_rerun: bool = False
    ) -> None:
        """Queue kernel launches on several CUDA streams; later operations of this queue wait for them.

        Arguments: see CpuQueue. `is_rerun`: whether samples of a block are run again, for which the block waits.
        """
        kernels = {plan: load_kernel(plan, self.device) for plan in {launch.plan for launch in launches}}
        streams = self.streams_of_reruns if is_rerun else self.streams
        ready = self.stream.record_event()
        for stream in streams:
            stream.wait_event(ready)
        for stream, launch in zip(cycle(streams), launches):
            start = stream.record_event(wp.Event(self.device, enable_timing=True))
            inputs = [0, *launch.inputs, *arguments]
            plan = launch.plan
            threads = plan.threads_of(launch.count)
            # Whole thread blocks, because threads of a sample exchange values; others repeat the last sample.
            dim = -(-threads // THREADS_OF_A_BLOCK) * THREADS_OF_A_BLOCK
            wp.launch(kernels[plan], dim=dim, inputs=inputs, stream=stream, block_dim=THREADS_OF_A_BLOCK)
            self._timed.append((start, stream.record_event(wp.Event(self.device, enable_timing=True))))
        for _, end in self._timed:
            self.stream.wait_event(end)
        self._kept_alive += [launches, arguments]
        self._advance = partial(advance, sum(launch.count for launch in launches))

    def start_reading(
        self, output: Any, shapes: dict[str, tuple[int, ...]], arriving: Collection[str] | None = None
    ) -> None:
        """Queue the transposition of the outputs, so that the first index is the sample, and their copies to the host.

        Args:
            output: The struct Output.
            shapes: Shapes of the outputs on the host; the first index is the sample.
            arriving: Names of the outputs to copy to the host; then all outputs remain available on the GPU in
                `staying`. None: copy all outputs, and keep no output on the GPU.
        """
        self._arriving, self.staying = {}, {}
        held_until, self._held_until = self._held_until, None
        if arriving is not None and held_until is not None:
            self.stream.wait_event(held_until())
        with wp.ScopedStream(self.stream):
            for name, shape in shapes.items():
                array = getattr(output, name)
                if len(shape) > 1 or arriving is not None:
                    turned = self._array(("turned", name), shape, array.dtype)
                    wp.copy(turned, array.transpose(tuple(reversed(range(len(shape))))) if len(shape) > 1 else array)
                    array = turned
                if arriving is not None:
                    self.staying[name] = array
                if arriving is None or name in arriving:
                    here = self._array(("here", name), shape, array.dtype, pinned=True)
                    wp.copy(here, array, stream=self.stream)
                    self._arriving[name] = here.numpy()
            self._arrived = self.stream.record_event()

    def read_into(self, rows: dict[str, np.ndarray], each: Callable[..., Iterable[object]] = map) -> None:
        """Wait for the outputs and copy them into `rows`; `each(function, parts)` may copy parts in parallel."""
        self._wait(self._arrived)
        pairs = ((rows[name], values) for name, values in self._arriving.items())
        parts = [(a[i : i + PART], b[i : i + PART]) for a, b in pairs for i in range(0, len(b), PART)]
        list(each(lambda part: np.copyto(*part), parts))
        self.settle()
        self._advance()

    def put_back(self, staying: dict[str, Any], rows: dict[str, np.ndarray]) -> None:
        """Overwrite the outputs `staying` on the GPU by the host arrays `rows`, and wait for the copies."""
        for name, array in staying.items():
            array.assign(rows[name])
        wp.synchronize_device(self.device)

    def hold_until(self, released: Callable[[], wp.Event]) -> None:
        """Keep the present outputs on the GPU until the event that `released()` will return."""
        self._held_until = released

    def read(self, array: Any) -> np.ndarray:
        """Wait for everything that is queued, and return a GPU array as a NumPy array."""
        self._wait(self.stream.record_event())
        self.settle()
        return array.numpy()

    def _wait(self, event: wp.Event) -> None:
        """Wait until the GPU has reached an event; Ctrl-C interrupts the wait."""
        while not event.is_complete:
            stop_if_asked()
            time.sleep(WAIT_FOR_GPU)

    def settle(self) -> None:
        """Record the times of launches, which must have finished, and free their arguments."""
        self._kept_alive.clear()
        while self._timed:
            start, end = self._timed.pop()
            moments = (wp.get_event_elapsed_time(self.origin, event, synchronize=False) for event in (start, end))
            self.spans.append(tuple(1e-3 * moment for moment in moments))

    def _array(self, place: tuple[str, str], shape: tuple[int, ...], dtype: Any, pinned: bool = False) -> wp.array:
        """Return an array in the memory that is kept for the purpose `place`; memory that is too small is replaced."""
        size = int(np.prod(shape))
        held = self.held.get((*place, dtype))
        if held is None or held.size < size:
            with wp.ScopedStream(self.stream):
                held = wp.empty(size, dtype=dtype, device="cpu" if pinned else self.device, pinned=pinned)
            self.held[*place, dtype] = held
        return held[:size].reshape(shape)


Queue = CpuQueue | CudaQueue


def open_queues(devices: Sequence[str], threads: int, kept: Sequence[CudaQueue] = ()) -> list[Queue]:
    """Return one queue per device and block of samples that may run there at once, or those kept by an earlier run."""
    if devices[0] == "cpu":
        return [CpuQueue(threads) for _ in devices]
    origins = {device: wp.get_stream(device).record_event(wp.Event(device, enable_timing=True)) for device in devices}
    for queue in kept:
        queue.begin()
        queue.origin = origins[queue.device]  # times since a distant origin are inaccurate
    return list(kept) or [CudaQueue(device, origins[device]) for _ in range(BLOCKS_ON_A_GPU) for device in devices]
