"""What shakes a sample: one row each in LOADS, and the device functions that evaluate it."""

import math
from dataclasses import dataclass
from typing import Any

import warp as wp


@dataclass(frozen=True)
class LoadKind:
    """How a load enters the equation of motion.

    Args:
        is_history: Sampled values, linear between them and zero after the last.
        is_base: Acts as base acceleration on every mass; otherwise as forces on the degrees of freedom.
        is_harmonic: Amplitude times sin(w t + phase).
    """

    is_history: bool = False
    is_base: bool = False
    is_harmonic: bool = False


LOADS = {
    "base_acceleration": LoadKind(is_history=True, is_base=True),
    "force_history": LoadKind(is_history=True),
    "harmonic_force": LoadKind(is_harmonic=True),
    "free_vibration": LoadKind(),
}


TURN = wp.constant(wp.float64(2.0 * math.pi))  # warp would work out 2.0 * wp.pi in float32


@wp.func
def harmonic(position: wp.float64, step: Any, circular_frequency: wp.float64, phase: wp.float64):
    """Return sin(w t + phase) at t = position * step, whole turns taken off in float64, before float32 loses them."""
    turns = (circular_frequency * position * wp.float64(step) + phase) / TURN
    return wp.sin(type(step)((turns - wp.floor(turns)) * TURN))
