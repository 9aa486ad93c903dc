"""The kernel that interpolates recorded motions on a device, so that they have a value at each integration step."""

import functools
from typing import Any

import warp as wp

from warpdyn.engine.device.processor import module_options
from warpdyn.engine.kernels.kernel_cache import block_size, loaded
from warpdyn.engine.kernels.plan import DTYPES, structs


@functools.cache
def interpolation_kernel(dtype: str) -> wp.Kernel:
    """Return the kernel that interpolates values of the number type `dtype` ("float32" or "float64")."""
    number = DTYPES[dtype]

    @wp.kernel(module="unique", enable_backward=False, module_options=module_options(max_unroll=1))
    def interpolate(values: wp.array(dtype=number), finer: int, components: int, result: wp.array(dtype=number)):
        k = wp.tid()
        row = k // components
        at = row // finer
        before = at * components + k - row * components
        begin = values[before]
        place = row - at * finer
        if place > 0:
            begin += number(place) / number(finer) * (values[before + components] - begin)
        result[k] = begin

    return interpolate


def interpolated(load: Any, dtype: str, finer: int, components: int = 1) -> Any:
    """Return a load whose motions have `finer` intervals for each original interval, by linear interpolation.

    An interval is the time between two values of a motion.

    Args:
        load: Struct Load with all motions in one array, the indices of their first values, and their numbers of
            intervals.
        dtype: Number type of the load, "float32" or "float64".
        finer: Number of new intervals per original interval.
        components: Number of components of each motion, whose values at one time follow each other.
    """
    struct = structs(dtype).Load
    result, device = struct(), str(load.values.device)
    for name in struct.vars:
        setattr(result, name, getattr(load, name))
    rows = finer * (load.values.size // components - 1) + 1
    count = rows * components  # the kernel also fills values between two motions, which are never read
    result.values = wp.empty(count, dtype=DTYPES[dtype], device=device)
    write_interpolated(load.values, dtype, finer, components, result.values, rows)
    for name in ("first", "intervals"):
        setattr(result, name, wp.array(getattr(load, name).numpy() * finer, dtype=wp.int32, device=device))
    wp.synchronize_device(device)
    return result


def write_interpolated(
    values: wp.array,
    dtype: str,
    finer: int,
    components: int,
    result: wp.array,
    rows: int,
    stream: wp.Stream | None = None,
) -> None:
    """Queue the kernel that interpolates motions.

    Args:
        values: Values of the motions, shape [time and component].
        dtype: Their number type, "float32" or "float64".
        finer: Number of new intervals per original interval.
        components: Number of components of each motion.
        result: Array whose first elements become the interpolated values.
        rows: Number of times of the result.
        stream: CUDA stream; None: the current stream of the device.
    """
    device = str(values.device)
    kernel = loaded(interpolation_kernel(dtype), device)
    inputs = [values, finer, components, result]
    wp.launch(kernel, dim=rows * components, inputs=inputs, device=device, stream=stream, block_dim=block_size(device))
