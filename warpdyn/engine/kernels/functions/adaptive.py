"""Step-size control of adaptive methods: each step of the time grid is divided according to the estimated error."""

from typing import Any

import warp as wp

# The shortest part of a step. It is accepted even if its estimated error is too large, as at corners of a storey law.
SHORTEST_PART = {"float32": 2.0**-14, "float64": 2.0**-24}


@wp.func
def excess_of(u_error: Any, u_size: Any, u_end: Any, v_error: Any, v_size: Any, v_end: Any):
    """Return the larger of two errors, each relative to the largest size so far; huge if the end is not finite."""
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
    """Return the part of the step to try next, by an error estimate of order 5; unchanged if nothing was tried."""
    following = trial
    if part > type(part)(0.0):
        change = type(part)(0.9) * wp.pow(wp.max(excess, type(part)(1e-6)), type(part)(-0.2))
        following = part * wp.clamp(change, type(part)(0.2), type(part)(5.0))
        if excess <= type(part)(1.0):  # a part may have been cut by the end of the step
            following = wp.max(following, wp.min(trial, type(part)(5.0) * part))
    return wp.clamp(following, shortest, type(part)(1.0))


@wp.func
def done_after(done: Any, part: Any, excess: Any, shortest: Any):
    """Return the finished share of the step; 1 if less than half a shortest part is left or the state is infinite."""
    after = done + part
    if after > type(done)(1.0) - type(done)(0.5) * shortest or excess > type(done)(1e15):
        after = type(done)(1.0)
    return after
