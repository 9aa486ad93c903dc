"""Device functions that a recorded computation calls, for computations that contain loops."""

from __future__ import annotations

import importlib
from collections.abc import Callable
from typing import Any, NamedTuple

import numpy as np

from warpdyn.engine.tracing.arrays import Traced, nodes_of
from warpdyn.engine.tracing.nodes import called


class DeviceFunction(NamedTuple):
    """A device function whose arguments and result are real numbers in float64.

    Args:
        module: Module that contains the device function; it is imported when a kernel is built.
        function: The NumPy function that computes the same values.
    """

    module: str
    function: Callable[..., np.ndarray]


_functions: dict[str, DeviceFunction] = {}


def define_function(name: str, module: str, function: Callable[..., np.ndarray]) -> Callable[..., Any]:
    """Define a device function; return a function that is recorded as this device function, or else calls NumPy.

    With arrays, the returned function calls the NumPy function. With recorded values, it records a call of the device
    function in a kernel.

    Args:
        name: Name of the device function.
        module: Module that contains the device function.
        function: The NumPy function that computes the same values.
    """
    _functions[name] = DeviceFunction(module, function)

    def computed(*values: Any) -> Any:
        if not any(isinstance(each, Traced) for each in values):
            return function(*values)
        arrays: list[Any] = np.broadcast_arrays(*(nodes_of(each) for each in values))  # type: ignore[assignment] # a tuple
        found = np.empty(arrays[0].shape, object)
        for index in np.ndindex(found.shape):
            found[index] = called(name, *(array[index] for array in arrays))
        return Traced(found)

    return computed


def numpy_function(name: str) -> Callable[..., np.ndarray]:
    """Return the NumPy counterpart of a device function that was defined by `define_function`."""
    return _functions[name].function


def functions_in(text: str) -> dict[str, Any]:
    """Return the device functions that the source text of a kernel calls: {name: function}."""
    return {
        name: getattr(importlib.import_module(known.module), name)
        for name, known in _functions.items()
        if f"{name}(" in text
    }
