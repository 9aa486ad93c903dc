"""Fill the structs that kernels receive as arguments from NumPy arrays.

A struct such as Samples, Structure or Load contains one array per field. The module `plan` defines the structs.
"""

from collections.abc import Iterable
from typing import Any

import numpy as np
import warp as wp

from warpdyn.engine.kernels.plan import output_struct, structs
from warpdyn.foundations.core.output_variables import DIVERGED


def brought(kind: str, arrays: dict[str, np.ndarray], dtype: str, device: str) -> Any:
    """Copy arrays to a device, wait for the copies, and return a struct that contains the copies.

    Args:
        kind: Name of the struct, such as "Structure".
        arrays: Array for each field of the struct: {field: array}.
        dtype: "float32" or "float64", the number type of the kernel.
        device: Name of the device, such as "cuda:0".
    """
    struct = getattr(structs(dtype), kind)
    instance = struct()
    for name, values in arrays.items():
        setattr(instance, name, wp.array(as_field(struct, name, values), device=device))
    wp.synchronize_device(device)
    return instance


def with_part(instance: Any, kind: str, names: Iterable[str], dtype: str, **parts: slice) -> Any:
    """Return a copy of a struct that contains only slices of some arrays.

    Args:
        instance: The struct.
        kind: Name of the struct, such as "Samples".
        names: Names of the arrays to copy.
        dtype: "float32" or "float64", the number type of the kernel.
        **parts: For the name of an array, the slice of it that the copy contains; other arrays are copied whole.
    """
    whole = getattr(structs(dtype), kind)()
    for name in names:
        array = getattr(instance, name)
        setattr(whole, name, array[parts[name]] if name in parts else array)
    return whole


def control(dtype: str, **values: float) -> Any:
    """Return the struct Control, which contains the scalar arguments of a kernel launch, with these values."""
    instance = structs(dtype).Control()
    for name, value in values.items():
        setattr(instance, name, value)
    return instance


def output_dtype(name: str, dtype: str) -> np.dtype:
    """Return the NumPy dtype of the output variable `name` in kernels of the number type `dtype`."""
    return np.dtype(wp.dtype_to_numpy(output_struct(dtype, (name,)).vars[name].type.dtype))


def blank_value(struct: Any, name: str) -> float:
    """Return the initial value of an output variable: NaN for real numbers, -1 for integers, DIVERGED for a status."""
    if name == "status":
        return DIVERGED
    return -1 if struct.vars[name].type.dtype is wp.int32 else float("nan")


def as_fields(kind: str, arrays: dict[str, np.ndarray], dtype: str) -> dict[str, np.ndarray]:
    """Return the arrays {field: array} in the dtypes of the fields of the struct `kind`, for example "Load"."""
    struct = getattr(structs(dtype), kind)
    return {name: as_field(struct, name, values) for name, values in arrays.items()}


def as_field(struct: Any, name: str, values: np.ndarray) -> np.ndarray:
    """Return an array, converted to the dtype of the field `name` of a struct and contiguous in C order."""
    dtype = wp.dtype_to_numpy(struct.vars[name].type.dtype)
    check_held(name, values, dtype)
    return np.ascontiguousarray(values, dtype=dtype)


def check_held(name: str, values: np.ndarray, dtype: Any) -> None:
    """Raise a ValueError if `dtype` is float32 and a finite value exceeds its range; infinity means "no limit"."""
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
    """Return a Warp array on the CPU for the field `name` of a struct; it shares the memory of `values`."""
    return wp.array(values, dtype=struct.vars[name].type.dtype, device="cpu", copy=False)


def lane_rows(rows: int, count: int, lanes: int, value: float) -> np.ndarray:
    """Return an array [rows, length] of float64 for a CPU kernel that reads several samples (lanes) at once.

    The length is the first odd multiple of `lanes` that is at least `count`. Elements from `count` on are `value`. If
    the length were a power of 2, the rows would displace each other in the cache of a CPU.
    """
    array = np.empty((rows, (-(-count // lanes) | 1) * lanes))
    array[:, count:] = value
    return array
