"""The table LOADS of kinds of load, and the device functions that evaluate loads."""

import math
from dataclasses import dataclass
from typing import Any

import warp as wp


@dataclass(frozen=True)
class LoadKind:
    """Properties of a kind of load: how it enters the equation of motion.

    Args:
        is_history: Whether the load is a stored history: linear between its points and zero after the last point.
        is_base: Whether the load is a base acceleration; otherwise it consists of forces on the degrees of freedom.
        is_harmonic: Whether the load is an amplitude times sin(w t + phase).
        noise_states: Number of states of the random process that generates the load during the run; 0 for other loads.
    """

    is_history: bool = False
    is_base: bool = False
    is_harmonic: bool = False
    noise_states: int = 0


LOADS = {
    "base_acceleration": LoadKind(is_history=True, is_base=True),
    "white_noise": LoadKind(is_history=True, is_base=True, noise_states=1),
    "kanai_tajimi": LoadKind(is_history=True, is_base=True, noise_states=2),
    "clough_penzien": LoadKind(is_history=True, is_base=True, noise_states=4),
    "force_history": LoadKind(is_history=True),
    "harmonic_force": LoadKind(is_harmonic=True),
    "free_vibration": LoadKind(),
}


# 2 pi; Warp would evaluate 2.0 * wp.pi in float32.
TURN = wp.constant(wp.float64(2.0 * math.pi))


@wp.func
def harmonic(position: wp.float64, step: Any, circular_frequency: wp.float64, phase: wp.float64):
    """Return sin(w t + phase) at the time t = position * step.

    Whole turns are subtracted from the angle in float64, before its conversion to the kernel's number type.
    """
    turns = (circular_frequency * position * wp.float64(step) + phase) / TURN
    return wp.sin(type(step)((turns - wp.floor(turns)) * TURN))


@wp.func
def sampled(loads: Any, motion: int, interval: int, run: int, width: int, column: int, scale: Any):
    """Return the value of a load history at the start of an interval, and its change over the interval.

    After the last point of the history, the value and the change are 0. If the run ends with the history, the last
    point is the value at the end of the run. `column` is the degree of freedom and `width` the number of degrees of
    freedom of the history.
    """
    begin = type(scale)(0.0)
    change = type(scale)(0.0)
    if interval < loads.intervals[motion]:
        at = (loads.first[motion] + interval) * width + column
        begin = loads.values[at] * scale
        change = loads.values[at + width] * scale - begin
    if interval == loads.intervals[motion] and interval == run:
        begin = loads.values[(loads.first[motion] + interval) * width + column] * scale
    return begin, change


@wp.func
def at_ends(begin: Any, value: Any, gain: Any, falls_silent: bool):
    """Return a motion at the start and at the end of an interval, and the factor on the motion in the next interval.

    Args:
        begin: Scaled value at the end of the last interval.
        value: Unscaled value at the end of this interval.
        gain: Factor on the motion.
        falls_silent: Whether the motion is zero from this interval on; then all results are 0.
    """
    if falls_silent:
        begin = type(begin)(0.0)
        gain = type(gain)(0.0)
    return begin, value * gain, gain
