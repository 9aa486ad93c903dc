"""Device functions that several laws share."""

import enum
from collections.abc import Callable
from typing import Any, cast

import warp as wp

from warpdyn.engine.laws.law import Layout


class First(Layout):
    """The first coefficients of laws that divide forces by the yield force."""

    INVERSE_YIELD_DRIFT = enum.auto()
    YIELD_FORCE = enum.auto()


class Memory(Layout):
    """The first memory values of laws that divide forces by the yield force."""

    DRIFT = enum.auto()
    FORCE = enum.auto()


@wp.func
def kept_force(drift: Any, memory: Any, c: Any):
    """Return the force [N] from the value in the memory, which is divided by the yield force."""
    return c[First.YIELD_FORCE] * memory[Memory.FORCE]


def device_functions(row: str, *functions: Callable) -> dict[str, wp.Function]:
    """Return {name: device function} for a variant.

    Warp identifies functions by their qualified names, so the name of the variant is added to each of them.
    """
    named: dict[str, wp.Function] = {}
    for function in functions:
        function.__qualname__ = f"{row}_{function.__name__}"
        # Warp annotates the type of the argument, but returns a Function.
        named[function.__name__] = cast(wp.Function, wp.func(function))
    return named
