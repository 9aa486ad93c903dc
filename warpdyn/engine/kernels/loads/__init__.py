"""The table LOADS of kinds of load, and the device functions that evaluate loads."""

import math
from dataclasses import dataclass
from typing import Any

import warp as wp


@dataclass(frozen=True)
class LoadKind:
    """How a load enters the equation of motion.

    Args:
        is_history: Whether it is a stored history: linear between its points and zero after the last point.
        is_base: Whether it is a base acceleration; otherwise it consists of forces on the degrees of freedom.
        is_harmonic: Whether it is an amplitude times sin(w t + phase).
        noise_states: Number of states of the random process that generates it during the run; 0 for other loads.
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
    """Return sin(w t + phase) at t = position * step; whole turns are subtracted in float64, before float32."""
    turns = (circular_frequency * position * wp.float64(step) + phase) / TURN
    return wp.sin(type(step)((turns - wp.floor(turns)) * TURN))


@wp.func
def sampled(loads: Any, motion: int, interval: int, run: int, width: int, column: int, scale: Any):
    """Return a history's value at the start of an interval and its change; both are zero after its last sample.

    A run that ends with the history sees the last sample at its end.
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
    """Return a history at the start and the end of an interval, and its gain in the next interval.

    `begin` is its value at the end of the last interval, `value` the sample at the end of this one.
    """
    if falls_silent:
        begin = type(begin)(0.0)
        gain = type(gain)(0.0)
    return begin, value * gain, gain
