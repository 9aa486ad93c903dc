"""Device functions of several rows that are written once."""

import enum
from collections.abc import Callable
from typing import Any, cast

import warp as wp

from warpdyn.engine.laws.law import Layout


class First(Layout):
    """What comes first in the coefficients of laws that are over the yield force."""

    INVERSE_YIELD_DRIFT = enum.auto()
    YIELD_FORCE = enum.auto()


class Memory(Layout):
    """What comes first in their memory."""

    DRIFT = enum.auto()
    FORCE = enum.auto()


@wp.func
def kept_force(drift: Any, memory: Any, c: Any):
    """Return the force that a law keeps in its memory, over the yield force."""
    return c[First.YIELD_FORCE] * memory[Memory.FORCE]


def device_functions(row: str, *functions: Callable) -> dict[str, wp.Function]:
    """Return a row's device functions under the names that they are written with.

    Warp tells functions apart by their qualified names: those of two rows must not share one.
    """
    named: dict[str, wp.Function] = {}
    for function in functions:
        function.__qualname__ = f"{row}_{function.__name__}"
        # Warp's annotation gives back the type of what it is given; what comes back is a Function.
        named[function.__name__] = cast(wp.Function, wp.func(function))
    return named
