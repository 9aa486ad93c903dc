"""Device functions that several storey laws share."""

import enum
from collections.abc import Callable
from typing import Any, cast

import warp as wp

from warpdyn.engine.laws.law import Layout


class First(Layout):
    """The first two coefficients of laws that divide forces by the yield force; further coefficients follow."""

    INVERSE_YIELD_DRIFT = enum.auto()
    YIELD_FORCE = enum.auto()


class Memory(Layout):
    """The first two history variables of laws that divide forces by the yield force; further variables may follow."""

    DRIFT = enum.auto()
    FORCE = enum.auto()


@wp.func
def kept_force(drift: Any, memory: Any, c: Any):
    """Return the force [N] of a storey from its memory, which contains the force divided by the yield force."""
    return c[First.YIELD_FORCE] * memory[Memory.FORCE]


def device_functions(row: str, *functions: Callable) -> dict[str, wp.Function]:
    """Return {name: device function} for a variant (set of device functions) of a law.

    Warp identifies functions by their qualified names, so the name `row` of the variant is added to each name.
    """
    named: dict[str, wp.Function] = {}
    for function in functions:
        function.__qualname__ = f"{row}_{function.__name__}"
        # Warp annotates the type of the argument, but returns a Function.
        named[function.__name__] = cast(wp.Function, wp.func(function))
    return named
