"""Fill the structs that kernels take as arguments from NumPy arrays."""

from collections.abc import Iterable
from typing import Any

import numpy as np
import warp as wp

from warpdyn.engine.kernels.plan import output_struct, structs
from warpdyn.foundations.core.output_variables import DIVERGED


def brought(kind: str, arrays: dict[str, np.ndarray], dtype: str, device: str) -> Any:
    """Copy arrays to a device, wait for the copies, and return a struct of `structs` that contains them."""
    struct = getattr(structs(dtype), kind)
    instance = struct()
    for name, values in arrays.items():
        setattr(instance, name, wp.array(as_field(struct, name, values), device=device))
    wp.synchronize_device(device)
    return instance


def with_part(instance: Any, kind: str, names: Iterable[str], dtype: str, **parts: slice) -> Any:
    """Return a copy of a struct in which the arrays named in `parts` are replaced by slices of them."""
    whole = getattr(structs(dtype), kind)()
    for name in names:
        array = getattr(instance, name)
        setattr(whole, name, array[parts[name]] if name in parts else array)
    return whole


def control(dtype: str, **values: float) -> Any:
    """Return the struct Control, which contains the scalar arguments of a launch."""
    instance = structs(dtype).Control()
    for name, value in values.items():
        setattr(instance, name, value)
    return instance


def output_dtype(name: str, dtype: str) -> np.dtype:
    """Return the NumPy dtype of an output."""
    return np.dtype(wp.dtype_to_numpy(output_struct(dtype, (name,)).vars[name].type.dtype))


def blank_value(struct: Any, name: str) -> float:
    """Return the initial value of an output: NaN for real numbers, -1 for integers, DIVERGED for the status."""
    if name == "status":
        return DIVERGED
    return -1 if struct.vars[name].type.dtype is wp.int32 else float("nan")


def as_fields(kind: str, arrays: dict[str, np.ndarray], dtype: str) -> dict[str, np.ndarray]:
    """Return the arrays, converted to the dtypes of the fields of a struct of `structs`."""
    struct = getattr(structs(dtype), kind)
    return {name: as_field(struct, name, values) for name, values in arrays.items()}


def as_field(struct: Any, name: str, values: np.ndarray) -> np.ndarray:
    """Return the values, converted to the dtype of a field of a struct, contiguous in C order."""
    dtype = wp.dtype_to_numpy(struct.vars[name].type.dtype)
    check_held(name, values, dtype)
    return np.ascontiguousarray(values, dtype=dtype)


def check_held(name: str, values: np.ndarray, dtype: Any) -> None:
    """Raise a ValueError if a finite value exceeds the range of float32; infinite values are allowed (no limit)."""
    if np.dtype(dtype) != np.float32 or values.dtype == dtype:
        return
    largest = np.finfo(np.float32).max
    if not values.size or (values.max() <= largest and values.min() >= -largest):
        return
    bad = ((values > largest) | (values < -largest)) & np.isfinite(values)
    if bad.any():
        raise ValueError(
            f"{name.replace('_', ' ')} of {np.abs(values[bad]).max():.3g} exceeds the largest number of float32, "
            f"{largest:.3g}: correct the structure's or the motion's values, or choose dtype='float64'"
        )


def wrapped(struct: Any, name: str, values: np.ndarray) -> wp.array:
    """Return a Warp array for a field of a struct that uses the memory of these values."""
    return wp.array(values, dtype=struct.vars[name].type.dtype, device="cpu", copy=False)


def lane_rows(rows: int, count: int, lanes: int, value: float) -> np.ndarray:
    """Return an array [rows, length] of float64; the length is the first odd multiple of `lanes` from `count` on.

    Elements from `count` on are `value`. If the length were a power of 2, the rows would displace each other in the
    cache of a CPU.
    """
    array = np.empty((rows, (-(-count // lanes) | 1) * lanes))
    array[:, count:] = value
    return array
