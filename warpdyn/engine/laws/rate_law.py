"""Functions that rate laws share. The memory of a rate law follows a differential equation, integrated with the motion.

In the rate laws of warpdyn, the force is (hardening stiffness) * drift + (hysteretic force) * z, where z is the first
memory value.
"""

import enum
from typing import Any

import warp as wp

from warpdyn.engine.device.extrema import maximum
from warpdyn.engine.laws.law import Layout
from warpdyn.engine.laws.row_functions import device_functions

# If a step is too long for the rate at which deviations of the memory from its steady value decay, the deviations grow
# instead. If a deviation has grown by this factor, the sample gets the status unstable_step.
LARGEST_DEVIATION = 10.0
LARGEST_GROWTH = wp.constant(wp.float64(1e30))
POWERS = wp.constant(8)  # number of coefficients of `settling_polynomial`, including zeros


class First(Layout):
    """The first two coefficients of each rate law; further coefficients follow."""

    HARDENING_STIFFNESS = enum.auto()
    HYSTERETIC_FORCE = enum.auto()


class Memory(Layout):
    """The first history variable of each rate law; further variables may follow."""

    Z = enum.auto()


def along_drift(rate: wp.Function, relaxation_rate: wp.Function) -> dict[str, wp.Function]:
    """Return device functions {field of `Spring`: function} of a law whose memory rate is proportional to the velocity.

    The memory of such a law depends only on the path of the drift, not on the velocity. One RK4 step integrates the
    memory over an increment of the drift.

    Args:
        rate: `(velocity, memory, coefficients) -> d(memory)/dt`.
        relaxation_rate: `(velocity, memory, coefficients) ->` rate [1/s] at which a deviation of the memory decays.
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
    """Return the deviation of a memory from its steady value after a step, relative to an assumed initial deviation.

    Args:
        deviation: The relative deviation before the step; the result is at least 1.
        rate_step: Rate at which the deviation decays, times the length of the step.
        polynomial: Result of `settling_polynomial`: coefficients of the growth per step.
    """
    growth = type(rate_step)(0.0)
    for k in range(POWERS):
        growth = polynomial[POWERS - 1 - k] - rate_step * growth
    if not wp.isfinite(growth):  # an unbounded rate
        growth = type(rate_step)(LARGEST_GROWTH)
    return maximum(maximum(deviation, type(deviation)(1.0)) * wp.abs(growth), type(deviation)(1.0))
