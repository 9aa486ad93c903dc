"""Native functions with which threads of a GPU's warp exchange values, if any number of them shares a sample.

All threads of a warp must call these functions together. On a CPU, where a thread has its samples alone, they return
their argument.
"""

import functools
from collections.abc import Sequence
from typing import Any

import warp as wp

from warpdyn.engine.device.processor import on_gpu

# The value of another thread of the warp; `_FROM_OR_ZERO`: 0 if its number is negative.
_FROM = on_gpu("return __shfl_sync(0xffffffff, value, thread);")
_FROM_OR_ZERO = on_gpu("""
value = __shfl_sync(0xffffffff, value, thread);
return thread < 0 ? 0 : value;""")
# Sum over the threads that share the sample, from thread `first` on; the same in each of them.
_TOGETHER = on_gpu("""
auto sum = __shfl_sync(0xffffffff, value, first);
for (int section = 1; section < threads; section++)
    sum += __shfl_sync(0xffffffff, value, first + section);
return sum;""")

# The largest value of the threads that share the sample, from thread `first` on, for values that are not negative; the
# same in each of them, and NaN if one value is NaN. The bits of such numbers are in the order of the numbers. After
# each round a thread knows twice as many values. (`__reduce_max_sync` takes one round for each sample.)
_LARGEST = on_gpu("""
unsigned int largest = __float_as_uint(value);
int own = (threadIdx.x & 31) - first;
for (int reach = 1; reach < threads; reach *= 2) {
    int other = own + reach < threads ? own + reach : own + reach - threads;
    largest = max(largest, __shfl_sync(0xffffffff, largest, min(first + other, 31)));
}
return __uint_as_float(largest);""")
_LARGEST_OF_DOUBLES = on_gpu("""
long long largest = __double_as_longlong(value);
int own = (threadIdx.x & 31) - first;
for (int reach = 1; reach < threads; reach *= 2) {
    int other = own + reach < threads ? own + reach : own + reach - threads;
    long long seen = __shfl_sync(0xffffffff, largest, min(first + other, 31));
    largest = seen > largest ? seen : largest;
}
return __longlong_as_double(largest);""")


@wp.func_native(_FROM)
def from_thread_float32(value: wp.float32, thread: wp.int32) -> wp.float32: ...


@wp.func_native(_FROM_OR_ZERO)
def from_thread_or_zero_float32(value: wp.float32, thread: wp.int32) -> wp.float32: ...


@wp.func_native(_TOGETHER)
def over_sections_float32(value: wp.float32, first: wp.int32, threads: wp.int32) -> wp.float32: ...


@wp.func_native(_FROM)
def from_thread_float64(value: wp.float64, thread: wp.int32) -> wp.float64: ...


@wp.func_native(_FROM_OR_ZERO)
def from_thread_or_zero_float64(value: wp.float64, thread: wp.int32) -> wp.float64: ...


@wp.func_native(_TOGETHER)
def over_sections_float64(value: wp.float64, first: wp.int32, threads: wp.int32) -> wp.float64: ...


@wp.func_native(_LARGEST)
def over_frame_float32(value: wp.float32, first: wp.int32, threads: wp.int32) -> wp.float32: ...


@wp.func_native(_LARGEST_OF_DOUBLES)
def over_frame_float64(value: wp.float64, first: wp.int32, threads: wp.int32) -> wp.float64: ...


_ANY_IN_WARP = on_gpu("return __any_sync(0xffffffff, value != 0) ? 1 : 0;")
_ANY_OF_FRAME = on_gpu("""
unsigned int those = (unsigned int)((1ull << threads) - 1ull);
return (__ballot_sync(0xffffffff, value != 0) >> first & those) != 0 ? 1 : 0;""")


@wp.func_native(_ANY_IN_WARP)
def any_in_warp(value: wp.int32) -> wp.int32:
    """Return whether the value of one of the 32 threads of a warp is not 0, as 1 or 0; on a CPU the value itself."""


@wp.func_native(_ANY_OF_FRAME)
def any_of_frame(value: wp.int32, first: wp.int32, threads: wp.int32) -> wp.int32:
    """Return whether the value of one of the threads that share a sample, from thread `first` on, is not 0: 1 or 0."""


LARGEST = {"float32": over_frame_float32, "float64": over_frame_float64}

# dtype -> the value of another thread; the same, or 0 for a negative number; the sum over the threads of a sample.
EXCHANGES = {
    "float32": (from_thread_float32, from_thread_or_zero_float32, over_sections_float32),
    "float64": (from_thread_float64, from_thread_or_zero_float64, over_sections_float64),
}


def number_at(values: Sequence[int]) -> Any:
    """Return a device function from an index to one of these integers."""
    return _function_of(tuple(map(int, values)))


@functools.cache
def _function_of(values: tuple[int, ...]) -> Any:
    text = ", ".join(map(str, values or (0,)))

    @wp.func_native(f"static const int numbers[] = {{{text}}};\nreturn numbers[index];")
    def number_at(index: wp.int32) -> wp.int32: ...

    return number_at


# If the number of threads that share a sample is a power of two: the value of the section below, that of the section
# above (0 if there is no such section), the maximum and the sum. All threads of a warp must call these functions.
_BELOW = on_gpu("""
value = __shfl_up_sync(0xffffffff, value, 1, threads);
return section == 0 ? 0 : value;""")
_ABOVE = on_gpu("""
value = __shfl_down_sync(0xffffffff, value, 1, threads);
return section == threads - 1 ? 0 : value;""")
_ACROSS = on_gpu("""
for (int distance = 1; distance < threads; distance *= 2)
    value = fmax(value, __shfl_xor_sync(0xffffffff, value, distance));
return value;""")
_SUMMED = on_gpu("""
for (int distance = 1; distance < threads; distance *= 2)
    value += __shfl_xor_sync(0xffffffff, value, distance);
return value;""")


@wp.func_native(_BELOW)
def below_float32(value: wp.float32, section: wp.int32, threads: wp.int32) -> wp.float32: ...


@wp.func_native(_ABOVE)
def above_float32(value: wp.float32, section: wp.int32, threads: wp.int32) -> wp.float32: ...


@wp.func_native(_ACROSS)
def across_float32(value: wp.float32, threads: wp.int32) -> wp.float32: ...


@wp.func_native(_SUMMED)
def together_float32(value: wp.float32, threads: wp.int32) -> wp.float32: ...


@wp.func_native(_BELOW)
def below_float64(value: wp.float64, section: wp.int32, threads: wp.int32) -> wp.float64: ...


@wp.func_native(_ABOVE)
def above_float64(value: wp.float64, section: wp.int32, threads: wp.int32) -> wp.float64: ...


@wp.func_native(_ACROSS)
def across_float64(value: wp.float64, threads: wp.int32) -> wp.float64: ...


@wp.func_native(_SUMMED)
def together_float64(value: wp.float64, threads: wp.int32) -> wp.float64: ...


@wp.func_native(
    on_gpu("""
for (int distance = 1; distance < 32; distance *= 2)
    value = max(value, __shfl_xor_sync(0xffffffff, value, distance));
return value;""")
)
def across_warp(value: wp.int32) -> wp.int32:
    """Return the largest of the values that the 32 threads of a GPU warp pass to this function."""


@wp.func_native("""
#if defined(__CUDA_ARCH__)
__syncwarp();
#endif
""")
def see_neighbours():
    """Wait until other threads of the GPU warp have written to memory, so that this thread can read their values."""


# dtype -> functions that return the value of the section below, the value of the section above, the maximum over all
# sections and the sum over all sections.
NEIGHBOURS = {
    "float32": (below_float32, above_float32, across_float32, together_float32),
    "float64": (below_float64, above_float64, across_float64, together_float64),
}
