"""Device functions of viscous dampers, whose force is a power of the velocity, and linear at small velocities.

The force is c0 v max(|v|, c2)^c1, where v is the velocity, c0 the damper coefficient, c1 the velocity exponent minus 1,
and c2 the velocity below which the damper is linear. Without the linear range, the slope at rest would be infinite.
"""

from typing import Any

import warp as wp

from warpdyn.engine.device.extrema import maximum

VALUES = 3  # number of values per storey


@wp.func
def damper_force(velocity: Any, coefficient: Any, exponent_less_1: Any, linear_velocity: Any):
    return coefficient * velocity * wp.pow(maximum(wp.abs(velocity), linear_velocity), exponent_less_1)


@wp.func
def damper_tangent(velocity: Any, coefficient: Any, exponent_less_1: Any, linear_velocity: Any):
    speed = wp.abs(velocity)
    secant = coefficient * wp.pow(maximum(speed, linear_velocity), exponent_less_1)
    return wp.where(speed > linear_velocity, secant * (type(velocity)(1.0) + exponent_less_1), secant)
