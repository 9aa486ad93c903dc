"""Device functions of self-centring storeys: a hardening spring in parallel with an elastic spring and a gap in series.

The gap opens at the yield drift and closes at the closing drift, until its opening is 0. The return mapping limits the
opening to the range that the drift allows, so the force depends on the path but not on the step.

With limits (slip or bearing), the drift is divided into three parts. The part beyond the bearing drift deforms only the
bearing. Of the rest, the part beyond the slip drift is slip; the remainder deforms the spring with the flag-shaped
loop.
"""

import enum
from typing import Any

import warp as wp

from warpdyn.engine.device.extrema import clamped, maximum
from warpdyn.engine.laws.law import Layout
from warpdyn.engine.laws.row_functions import device_functions
from warpdyn.engine.laws.self_centring.parameters import Coefficient as C, SelfCentring
from warpdyn.engine.laws.spring import Spring


class M(Layout):
    """Memory of a storey: the history variables that its law keeps; the slip exists only in storeys with limits."""

    OPENING = enum.auto()  # opening of the gap [m], with the sign of the drift
    SLIP = enum.auto()  # [m]


@wp.func
def self_centring_opening(drift: Any, before: Any, c: Any):
    """Return the opening of the gap [m] after a step to a drift; `before` is the opening before the step."""
    zero = type(drift)(0.0)
    size = wp.abs(drift)
    # An opening of the other side has a negative sign here and is clamped to at least 0.
    side = wp.where(drift < zero, -before, before)
    found = clamped(side, maximum(size - c[C.YIELD_DRIFT], zero), maximum(size - c[C.CLOSING_DRIFT], zero))
    return wp.where(drift < zero, -found, found)


def _self_centring(row: str, LIMITS: bool) -> Spring:
    """Return the device functions of storeys without limits, or with slip and bearing (LIMITS is True)."""
    VALUES = len(M) if LIMITS else 1

    def flag_drift(drift: Any, memory: Any, c: Any):
        """Return the drift of the spring with the flag-shaped loop [m], and the slip [m]."""
        slip = type(drift)(0.0)
        inner = drift
        if LIMITS:
            inner = clamped(drift, type(drift)(-1.0) * c[C.BEARING_DRIFT], c[C.BEARING_DRIFT])
            slip = clamped(memory[M.SLIP], inner - c[C.SLIP_DRIFT], inner + c[C.SLIP_DRIFT])
            inner -= slip
        return inner, slip

    flag_drift = device_functions(row, flag_drift)["flag_drift"]

    def return_mapping(drift: Any, memory: Any, c: Any):
        after = type(memory)()
        inner, slip = flag_drift(drift, memory, c)
        after[M.OPENING] = self_centring_opening(inner, memory[M.OPENING], c)
        if LIMITS:
            after[M.SLIP] = slip
        return after

    def force(drift: Any, memory: Any, c: Any):
        inner, slip = flag_drift(drift, memory, c)
        opening = self_centring_opening(inner, memory[M.OPENING], c)
        total = c[C.HARDENING_STIFFNESS] * inner + c[C.GAP_STIFFNESS] * (inner - opening)
        if LIMITS:
            total += c[C.BEARING_STIFFNESS] * (drift - inner - slip)
        return total

    def elastic_energy(drift: Any, memory: Any, c: Any):
        half = type(drift)(0.5)
        inner, slip = flag_drift(drift, memory, c)
        opening = memory[M.OPENING]
        # The force that closes the gap does work, too.
        closing = c[C.GAP_STIFFNESS] * c[C.CLOSING_DRIFT] * wp.abs(opening)
        stretch = inner - opening
        energy = half * (c[C.HARDENING_STIFFNESS] * inner * inner + c[C.GAP_STIFFNESS] * stretch * stretch) + closing
        if LIMITS:
            # The bearing starts at the force of the flag-shaped spring, and returns the work of this force, too.
            pressed = drift - inner - slip
            at_bearing = c[C.HARDENING_STIFFNESS] * inner + c[C.GAP_STIFFNESS] * stretch
            energy += pressed * (at_bearing + half * c[C.BEARING_STIFFNESS] * pressed)
        return energy

    def tangent(drift: Any, increment: Any, before: Any, after: Any, c: Any):
        stiffness = c[C.HARDENING_STIFFNESS]
        inner, slip = flag_drift(drift, before, c)
        opening = self_centring_opening(inner, before[M.OPENING], c)
        if opening == type(drift)(0.0) or opening == before[M.OPENING]:
            stiffness += c[C.GAP_STIFFNESS]
        if LIMITS:
            if slip != before[M.SLIP]:
                stiffness = type(drift)(0.0)
            if wp.abs(drift) > c[C.BEARING_DRIFT]:
                stiffness = c[C.BEARING_STIFFNESS]
        return stiffness

    def memory_after(drift: Any, increment: Any, memory: Any, c: Any):
        return return_mapping(drift, memory, c)

    functions = device_functions(row, return_mapping, force, elastic_energy, tangent, memory_after)
    return_mapping = functions["return_mapping"]
    return Spring(coefficients=len(SelfCentring.rows[row]), memory=VALUES, **functions)


SPRINGS = {
    "self_centring": _self_centring("self_centring", False),
    "self_centring_with_limits": _self_centring("self_centring_with_limits", True),
}
