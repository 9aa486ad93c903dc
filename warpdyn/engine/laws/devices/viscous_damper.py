"""Viscous dampers whose force is a power of the velocity, and linear at small velocities.

The force is c0 v max(|v|, c2)^c1, with c1 the velocity exponent minus 1. The slope of a power is infinite at rest, so
the force is linear below the velocity c2, as is common practice.
"""

from typing import Any

import warp as wp

from warpdyn.engine.device.extrema import maximum

VALUES = 3  # per storey


@wp.func
def damper_force(velocity: Any, coefficient: Any, exponent_less_1: Any, linear_velocity: Any):
    return coefficient * velocity * wp.pow(maximum(wp.abs(velocity), linear_velocity), exponent_less_1)


@wp.func
def damper_tangent(velocity: Any, coefficient: Any, exponent_less_1: Any, linear_velocity: Any):
    speed = wp.abs(velocity)
    secant = coefficient * wp.pow(maximum(speed, linear_velocity), exponent_less_1)
    return wp.where(speed > linear_velocity, secant * (type(velocity)(1.0) + exponent_less_1), secant)
