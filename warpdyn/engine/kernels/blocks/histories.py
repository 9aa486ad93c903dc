"""Base accelerations of rigid blocks on a device, and the launch of kernels over histories and blocks."""

from __future__ import annotations

from collections.abc import Mapping
from concurrent.futures import ThreadPoolExecutor
from itertools import pairwise
from typing import Any

import numpy as np
import warp as wp

from warpdyn.engine.kernels.arguments import as_field
from warpdyn.engine.kernels.kernel_cache import THREADS_OF_A_BLOCK, loaded
from warpdyn.engine.kernels.queues import SLICES_PER_THREAD

double = wp.float64


@wp.struct
class BaseHistories:
    """Base accelerations, one after the other in one array; each is linear between its values and then zero."""

    acceleration: wp.array(dtype=double)  # [m/s2]
    first: wp.array(dtype=wp.int32)  # index of the first value of each history, [history]
    intervals: wp.array(dtype=wp.int32)  # number of intervals between the values of a history, [history]
    step: wp.array(dtype=double)  # time between two values [s], [history]


def filled(struct: Any, arrays: Mapping[str, np.ndarray], device: str) -> Any:
    """Copy arrays {field: array} to the device and return a struct that contains them, in the dtypes of its fields."""
    instance = struct()
    for name, values in arrays.items():
        setattr(instance, name, wp.array(as_field(struct, name, values), device=device))
    return instance


def launched(
    kernel: wp.Kernel, inputs: list[Any], outputs: Mapping[str, tuple[tuple[int, ...], Any]], device: str, threads: int
) -> dict[str, np.ndarray]:
    """Run a kernel with one thread per element of its outputs, and return the outputs {name: array}.

    Args:
        kernel: The kernel; its arguments are the index of the first element, the inputs, and the outputs in order.
        inputs: Inputs of the kernel.
        outputs: Shape and dtype of each output. All have the same number of elements; they are filled with NaN or -1.
        device: Warp device, such as "cpu" or "cuda:0".
        threads: Number of CPU threads.
    """
    arrays = {}
    for name, (shape, dtype) in outputs.items():
        blank = -1 if dtype is wp.int32 else float("nan")
        arrays[name] = wp.full(shape, blank, dtype=dtype, device=device)
    count = int(np.prod(next(iter(outputs.values()))[0]))
    arguments = [*inputs, *arrays.values()]
    loaded(kernel, device)  # compile it before the threads start; otherwise each thread would compile it
    if wp.get_device(device).is_cuda:
        wp.launch(kernel, dim=count, inputs=[0, *arguments], device=device, block_dim=THREADS_OF_A_BLOCK)
    else:

        def run(edges: tuple[int, int]) -> None:
            wp.launch(kernel, dim=edges[1] - edges[0], inputs=[edges[0], *arguments], device=device)

        edges = np.unique(np.linspace(0, count, min(count, threads * SLICES_PER_THREAD) + 1).astype(int))
        with ThreadPoolExecutor(threads) as pool:
            list(pool.map(run, pairwise(edges)))  # the list waits for all results and raises errors of the threads
    return {name: array.numpy() for name, array in arrays.items()}
