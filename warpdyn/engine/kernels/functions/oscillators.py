"""Exact step of an oscillator whose base acceleration is linear within the step, in scaled variables."""

import math
from typing import Any

import warp as wp

from warpdyn.engine.methods.oscillator_increments import HIGHEST_POWER, LARGEST_NORM

double = wp.float64
_terms = wp.types.vector(length=HIGHEST_POWER + 1, dtype=double)
SERIES = wp.constant(_terms(*(1 / math.factorial(n + 2) for n in range(HIGHEST_POWER + 1))))
LAST_TERM = wp.constant(HIGHEST_POWER)
LARGEST = wp.constant(double(LARGEST_NORM))


@wp.func
def oscillator_factors(frequency: double, damping_ratio: double, step: double):
    """Return the factors of the step of an oscillator: g0, w g1, w g2, w g0, d g0 and w.

    w = (omega h)^2 and d = 2 zeta omega h. `methods/oscillator_increments.py` explains g0, g1 and g2 and does the same
    calculation on the host. With the displacement U = omega^2 u and the velocity V = h omega^2 v, both in the units of
    the acceleration, and the base acceleration a at the start of the step and a + c at its end, the increments are

        dU = g0 V - w g1 (U + a) - w g2 c
        dV = -(w g1 + d g0) V - w g0 (U + a) - w g1 c

    Args:
        frequency: Undamped circular frequency omega [rad/s].
        damping_ratio: Damping ratio zeta [1].
        step: Step h [s].
    """
    norm = frequency * step
    w = norm * norm
    d = double(2.0) * damping_ratio * norm
    whole_w = w
    whole_d = d
    size = norm * (double(1.0) + double(2.0) * damping_ratio)
    halvings = int(0)
    while size > LARGEST:
        size *= double(0.5)
        w *= double(0.25)
        d *= double(0.5)
        halvings += 1
    g1 = double(0.0)
    g2 = double(0.0)
    for n in range(LAST_TERM + 1):
        total = SERIES[LAST_TERM - n] - w * g2 - d * g1
        g2 = g1
        g1 = total
    g0 = double(1.0) - d * g1 - w * g2
    for _doubling in range(halvings):
        next_g0 = (double(1.0) - w * g1 - double(0.5) * d * g0) * g0
        next_g1 = double(0.25) * (g0 * g0 - w * g1 * g1 + double(2.0) * g1)
        g2 = double(0.125) * (double(2.0) * g0 * g1 + d * g1 * g1 + double(2.0) * g2)
        g0 = next_g0
        g1 = next_g1
        w *= double(4.0)
        d *= double(2.0)
    return g0, whole_w * g1, whole_w * g2, whole_w * g0, whole_d * g0, whole_w


@wp.func
def largest_between(start: Any, end: Any, rate: Any, rate_end: Any):
    """Return the largest absolute value of a quantity in a step: at its end, or at an extremum within the step.

    The quantity is a cubic polynomial with the given values and rates at both ends, in time divided by the step. If the
    rates have opposite signs, the polynomial is evaluated where the line between the rates is zero.
    """
    zero = type(start)(0.0)
    difference = rate - rate_end
    turns = rate * rate_end < zero
    s = wp.where(turns, rate / wp.where(turns, difference, type(start)(1.0)), type(start)(1.0))
    rise = end - start
    square = type(start)(3.0) * rise - type(start)(2.0) * rate - rate_end
    cube = rate + rate_end - type(start)(2.0) * rise
    within = start + s * (rate + s * (square + s * cube))
    return wp.max(wp.abs(end), wp.abs(within))
