"""Device functions that several laws share."""

import enum
from collections.abc import Callable
from typing import Any, cast

import warp as wp

from warpdyn.engine.laws.law import Layout


class First(Layout):
    """The first coefficients of laws whose forces are divided by the yield force."""

    INVERSE_YIELD_DRIFT = enum.auto()
    YIELD_FORCE = enum.auto()


class Memory(Layout):
    """Their first memory values."""

    DRIFT = enum.auto()
    FORCE = enum.auto()


@wp.func
def kept_force(drift: Any, memory: Any, c: Any):
    """Return the force [N] from the value in the memory, which is divided by the yield force."""
    return c[First.YIELD_FORCE] * memory[Memory.FORCE]


def device_functions(row: str, *functions: Callable) -> dict[str, wp.Function]:
    """Return the device functions of a variant by their names in the source.

    Warp distinguishes functions by their qualified names, so each variant needs its own.
    """
    named: dict[str, wp.Function] = {}
    for function in functions:
        function.__qualname__ = f"{row}_{function.__name__}"
        # Warp annotates the type of the argument, but returns a Function.
        named[function.__name__] = cast(wp.Function, wp.func(function))
    return named
