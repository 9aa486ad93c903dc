"""How far a memory that settles at a rate of its own has strayed, step by step."""

from typing import Any

import warp as wp

# A step too long for the rate at which a memory settles makes its deviation from there grow instead. One such step in
# passing does no harm; where deviations have grown this many times, the memory has lost its way.
LARGEST_DEVIATION = 10.0
LARGEST_GROWTH = wp.constant(wp.float64(1e30))
POWERS = wp.constant(8)  # of a settling polynomial, zeros included


@wp.func
def deviation_after(deviation: Any, rate_step: Any, polynomial: Any):
    """Return a memory's deviation after a step of this rate times its length, over the least it is taken to be, 1."""
    growth = type(rate_step)(0.0)
    for k in range(POWERS):
        growth = polynomial[POWERS - 1 - k] - rate_step * growth
    if not wp.isfinite(growth):  # a rate without bounds
        growth = type(rate_step)(LARGEST_GROWTH)
    return wp.max(wp.max(deviation, type(deviation)(1.0)) * wp.abs(growth), type(deviation)(1.0))
