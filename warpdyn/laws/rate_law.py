"""What laws have in common whose force is c0 d + c1 z, with a z that has a rate and comes first in the memory."""

from collections.abc import Callable
from typing import Any

import warp as wp

from warpdyn.laws.row_functions import device_functions


def along_drift(rate: Callable, relaxation: Callable) -> dict[str, Callable]:
    """Return what a law whose memory has a rate that is proportional to the velocity does over a step: its fields.

    Such a memory depends on the path of the drift, not on its speed: it goes along an increment in one step of RK4.
    """

    def advance(drift: Any, increment: Any, memory: Any, c: Any):
        half = type(increment)(0.5)
        k1 = rate(increment, memory, c)
        k2 = rate(increment, memory + half * k1, c)
        k3 = rate(increment, memory + half * k2, c)
        k4 = rate(increment, memory + k3, c)
        return memory + (k1 + type(increment)(2.0) * (k2 + k3) + k4) / type(increment)(6.0)

    def tangent(drift: Any, increment: Any, before: Any, after: Any, c: Any):
        direction = type(increment)(1.0)
        if increment < type(increment)(0.0):
            direction = -direction
        slope = rate(direction, after, c)
        return c[0] + c[1] * direction * slope[0]

    def relaxation_along(increment: Any, memory: Any, c: Any):
        half = type(increment)(0.5)
        first = memory + half * rate(increment, memory, c)
        second = memory + half * rate(increment, first, c)
        third = memory + rate(increment, second, c)
        outer = wp.max(relaxation(increment, memory, c), relaxation(increment, third, c))
        return wp.max(outer, wp.max(relaxation(increment, first, c), relaxation(increment, second, c)))

    functions = device_functions(rate.key, advance, tangent, relaxation_along)
    return functions | {"rate": rate, "relaxation": relaxation}
