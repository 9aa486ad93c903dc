"""Common functions of laws whose memory has a rate, which is integrated with the motion.

In laws of warpdyn the force is a hardening stiffness times the drift plus a hysteretic force times z, the first value
of the memory.
"""

import enum
from typing import Any

import warp as wp

from warpdyn.engine.device.extrema import maximum
from warpdyn.engine.laws.law import Layout
from warpdyn.engine.laws.row_functions import device_functions

# If a step is too long for the rate at which a memory settles, deviations of the memory grow. If a deviation has grown
# by this factor, the sample gets the status unstable_step.
LARGEST_DEVIATION = 10.0
LARGEST_GROWTH = wp.constant(wp.float64(1e30))
POWERS = wp.constant(8)  # coefficients of a settling polynomial, including zeros


class First(Layout):
    """The first coefficients of such a law."""

    HARDENING_STIFFNESS = enum.auto()
    HYSTERETIC_FORCE = enum.auto()


class Memory(Layout):
    """The first memory value."""

    Z = enum.auto()


def along_drift(rate: wp.Function, relaxation_rate: wp.Function) -> dict[str, wp.Function]:
    """Return functions over a step, by their fields in `Spring`, if the rate is proportional to the velocity.

    Such a memory depends on the path of the drift, not on its speed. One step of RK4 integrates it over an increment.
    """

    def memory_after(drift: Any, increment: Any, memory: Any, c: Any):
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
        return c[First.HARDENING_STIFFNESS] + c[First.HYSTERETIC_FORCE] * direction * slope[Memory.Z]

    def relaxation_over_step(increment: Any, memory: Any, c: Any):
        half = type(increment)(0.5)
        first = memory + half * rate(increment, memory, c)
        second = memory + half * rate(increment, first, c)
        third = memory + rate(increment, second, c)
        outer = maximum(relaxation_rate(increment, memory, c), relaxation_rate(increment, third, c))
        return maximum(outer, maximum(relaxation_rate(increment, first, c), relaxation_rate(increment, second, c)))

    functions = device_functions(rate.key, memory_after, tangent, relaxation_over_step)
    return functions | {"rate": rate, "relaxation_rate": relaxation_rate}


@wp.func
def deviation_after(deviation: Any, rate_step: Any, polynomial: Any):
    """Return a memory's deviation after a step, relative to its smallest assumed value 1, from rate times step."""
    growth = type(rate_step)(0.0)
    for k in range(POWERS):
        growth = polynomial[POWERS - 1 - k] - rate_step * growth
    if not wp.isfinite(growth):  # an unbounded rate
        growth = type(rate_step)(LARGEST_GROWTH)
    return maximum(maximum(deviation, type(deviation)(1.0)) * wp.abs(growth), type(deviation)(1.0))
