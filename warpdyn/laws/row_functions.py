"""Device functions of several rows that are written once."""

from collections.abc import Callable
from typing import Any

import warp as wp


@wp.func
def kept_force(drift: Any, memory: Any, c: Any):
    """Return the force of a law whose memory has it second, over the yield force, which is the second coefficient."""
    return c[1] * memory[1]


def device_functions(row: str, *functions: Callable) -> dict[str, wp.Function]:
    """Return a row's device functions under the names that they are written with.

    Warp tells functions apart by their qualified names: those of two rows must not share one.
    """
    named = {}
    for function in functions:
        function.__qualname__ = f"{row}_{function.__name__}"
        named[function.__name__] = wp.func(function)
    return named
