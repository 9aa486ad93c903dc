"""The kernel that fills memory of a GPU.

Warp's `fill_` waits until all kernels on the GPU have ended, also on a stream with a higher priority.
"""

import functools

import numpy as np
import warp as wp

from warpdyn.engine.device.processor import module_options

INTEGERS = {1: wp.int8, 4: wp.int32, 8: wp.int64}  # by their size [bytes]


@functools.cache
def filling_kernel(integer: type) -> wp.Kernel:
    """Return the kernel that writes one number of a type of INTEGERS into all elements of an array."""

    @wp.kernel(module="unique", enable_backward=False, module_options=module_options(max_unroll=1))
    def fill_memory(words: wp.array(dtype=integer), word: integer):
        words[wp.tid()] = word

    return fill_memory


def as_words(array: wp.array) -> wp.array:
    """Return the memory of a contiguous array of numbers as integers with as many bits."""
    integer = INTEGERS[wp.types.type_size_in_bytes(array.dtype)]
    words = wp.array(ptr=array.ptr, dtype=integer, shape=array.size, device=array.device)
    words.owner = array  # otherwise the memory could be freed before the kernel has filled it
    return words


def word_of(value: float) -> int:
    """Return the integer whose bits fill memory with a value: -1 for NaN (all bits are set), or the integer itself."""
    return -1 if np.isnan(value) else int(value)
