"""Step-size control of adaptive methods: each step of the time grid is divided into parts by the estimated error."""

from typing import Any

import warp as wp

# The shortest part of a step. It is accepted even if its estimated error is too large, as at corners of a storey law.
SHORTEST_PART = {"float32": 2.0**-14, "float64": 2.0**-24}


@wp.func
def excess_of(u_error: Any, u_size: Any, u_end: Any, v_error: Any, v_size: Any, v_end: Any):
    """Return the larger of the errors of displacement and velocity, each divided by its largest size so far.

    The result is 1e20 if the displacement or the velocity at the end is not finite.
    """
    zero = type(u_error)(0.0)
    excess = zero
    if u_error > zero:
        excess = u_error / wp.max(u_size, wp.max(wp.abs(u_end), type(u_error)(1e-30)))
    if v_error > zero:
        excess = wp.max(excess, v_error / wp.max(v_size, wp.max(wp.abs(v_end), type(u_error)(1e-30))))
    if not wp.isfinite(u_end + v_end):
        excess = type(u_error)(1e20)
    return excess


@wp.func
def next_part(part: Any, trial: Any, excess: Any, shortest: Any):
    """Return the fraction of the time step to try next, from the error estimate (order 5) of the last attempt.

    Args:
        part: Fraction of the step that was tried; 0 if nothing was tried, and then `trial` is returned.
        trial: Fraction of the step that had been chosen, before it was cut at the end of the step.
        excess: Estimated error relative to the tolerance.
        shortest: Smallest fraction of the step.
    """
    following = trial
    if part > type(part)(0.0):
        change = type(part)(0.9) * wp.pow(wp.max(excess, type(part)(1e-6)), type(part)(-0.2))
        following = part * wp.clamp(change, type(part)(0.2), type(part)(5.0))
        if excess <= type(part)(1.0):  # a part may have been cut by the end of the step
            following = wp.max(following, wp.min(trial, type(part)(5.0) * part))
    return wp.clamp(following, shortest, type(part)(1.0))


@wp.func
def done_after(done: Any, part: Any, excess: Any, shortest: Any):
    """Return the finished fraction of the time step after an attempt.

    The fraction is 1 if less than half of the shortest part remains, or if the state is not finite.
    """
    after = done + part
    if after > type(done)(1.0) - type(done)(0.5) * shortest or excess > type(done)(1e15):
        after = type(done)(1.0)
    return after
