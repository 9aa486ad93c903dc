"""Device functions that a recorded computation calls, for computations with loops."""

from __future__ import annotations

import importlib
from collections.abc import Callable
from typing import Any, NamedTuple

import numpy as np

from warpdyn.engine.tracing.arrays import Traced, nodes_of
from warpdyn.engine.tracing.nodes import called


class DeviceFunction(NamedTuple):
    """A device function of real numbers in float64 that returns a real number.

    Args:
        module: Module that contains it; it is imported when a kernel is built.
        function: The NumPy function that computes the same values.
    """

    module: str
    function: Callable[..., np.ndarray]


_functions: dict[str, DeviceFunction] = {}


def define_function(name: str, module: str, function: Callable[..., np.ndarray]) -> Callable[..., Any]:
    """Return a function of arrays or recorded values; with recorded values a kernel calls the device function.

    Args:
        name: Name of the device function.
        module: Module that contains it.
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
    """Return the NumPy function of a device function that `define_function` knows."""
    return _functions[name].function


def functions_in(text: str) -> dict[str, Any]:
    """Return the device functions that a text calls, by their names."""
    return {
        name: getattr(importlib.import_module(known.module), name)
        for name, known in _functions.items()
        if f"{name}(" in text
    }
