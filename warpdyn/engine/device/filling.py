"""The kernel that fills memory of a GPU.

Warp's `fill_` waits until all kernels on the GPU have ended, also on a stream with a higher priority.
"""

import functools

import numpy as np
import warp as wp

from warpdyn.engine.device.processor import module_options


@functools.cache
def filling_kernel() -> wp.Kernel:
    """Return the kernel that writes one number of 32 bits into all elements of an array."""

    @wp.kernel(module="unique", enable_backward=False, module_options=module_options(max_unroll=1))
    def fill_memory(words: wp.array(dtype=wp.int32), word: int):
        words[wp.tid()] = word

    return fill_memory


def as_words(array: wp.array) -> wp.array:
    """Return the memory of a contiguous array of numbers with 32 or 64 bits as integers with 32 bits."""
    count = array.size * wp.types.type_size_in_bytes(array.dtype) // 4
    return wp.array(ptr=array.ptr, dtype=wp.int32, shape=count, device=array.device)


def word_of(value: float) -> int:
    """Return the integer whose bits fill memory with a value: -1 for NaN (all bits are set), or the integer itself."""
    return -1 if np.isnan(value) else int(value)
