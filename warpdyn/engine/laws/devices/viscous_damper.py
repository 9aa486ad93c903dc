"""Viscous dampers of storeys whose force is a power of the velocity, linear in a small range around rest.

The force is c0 v max(|v|, c2)^c1, with c1 the velocity exponent less 1: a power has an endless slope at rest, so
practice makes the force linear there (below c2).
"""

from typing import Any

import warp as wp

from warpdyn.engine.device.extrema import maximum

VALUES = 3  # of a storey's damper


@wp.func
def damper_force(velocity: Any, coefficient: Any, exponent_less_1: Any, linear_velocity: Any):
    return coefficient * velocity * wp.pow(maximum(wp.abs(velocity), linear_velocity), exponent_less_1)


@wp.func
def damper_tangent(velocity: Any, coefficient: Any, exponent_less_1: Any, linear_velocity: Any):
    speed = wp.abs(velocity)
    secant = coefficient * wp.pow(maximum(speed, linear_velocity), exponent_less_1)
    return wp.where(speed > linear_velocity, secant * (type(velocity)(1.0) + exponent_less_1), secant)
