"""Device functions of wood-frame shear walls: the rules of SAWS as bounds of a force.

Drifts and forces are in units of F0/S0 and F0. Their signs are changed if the wall moves in the negative direction, so
that one set of rules serves both directions. The force changes with the unloading stiffness until it meets the upper
bound. If the wall last unloaded from the envelope of the side towards which it moves, the bound is this envelope;
otherwise it consists of the pinched line, the reloading line and the envelope. The lower bound is the upper bound of
the other side with opposite signs.
"""

import enum
from typing import Any

import warp as wp

from warpdyn.engine.device.exponentials import decay, power_of
from warpdyn.engine.device.extrema import maximum, minimum
from warpdyn.engine.laws.law import Layout
from warpdyn.engine.laws.row_functions import device_functions, kept_force
from warpdyn.engine.laws.saws.parameters import BISECTIONS, Coefficient as C
from warpdyn.engine.laws.spring import Spring

# Up to this multiple of the crossing drift, a wall loads and unloads along its envelope.
SMALL = wp.constant(wp.float64(1.05))
# States: small drifts; on the envelope or unloading from it, signed by the side; between the bounds; failed.
IS_SMALL = wp.constant(wp.float64(0.0))
OFF_ENVELOPE = wp.constant(wp.float64(1.0))
BETWEEN = wp.constant(wp.float64(2.0))
HAS_FAILED = wp.constant(wp.float64(3.0))


class M(Layout):
    """Memory of a wall: the history variables that its law keeps from step to step.

    Drifts are in units of F0/S0 and forces in units of F0.
    """

    DRIFT = enum.auto()
    FORCE = enum.auto()
    STATE = enum.auto()
    FARTHEST_ABOVE = enum.auto()  # largest drift reached on the positive envelope, 0 before it is reached
    FARTHEST_BELOW = enum.auto()


@wp.func
def saws_curve(x: Any, c: Any):
    """Return force and slope of the curved segment of the envelope at a drift x >= 0."""
    one = type(x)(1.0)
    left = decay(x)
    asymptote = one + c[C.HARDENING_SLOPE] * x
    return asymptote * (one - left), asymptote * left + c[C.HARDENING_SLOPE] * (one - left)


@wp.func
def saws_envelope(x: Any, c: Any):
    """Return force and slope of the envelope at a drift x >= 0."""
    force, slope = saws_curve(x, c)
    falls = x > c[C.PEAK_DRIFT]
    force = wp.where(falls, c[C.PEAK_FORCE] - c[C.FALLING_SLOPE] * (x - c[C.PEAK_DRIFT]), force)
    return force, wp.where(falls, -c[C.FALLING_SLOPE], slope)


@wp.func
def saws_reloading(x: Any, farthest: Any, c: Any):
    """Return force and slope of the reloading line of a side at a drift x.

    `farthest` is the largest drift that the wall has reached on the envelope of this side.
    """
    aim = c[C.RELOADING_DRIFT_RATIO] * farthest
    curved, _slope = saws_curve(aim, c)
    # After peaks on the curved segment, the target force is at most the peak force; after peaks on the falling line,
    # the target is on the falling line.
    fallen = c[C.PEAK_FORCE] - c[C.FALLING_SLOPE] * (aim - c[C.PEAK_DRIFT])
    target = wp.where(farthest > c[C.PEAK_DRIFT], fallen, minimum(curved, c[C.PEAK_FORCE]))
    slope = minimum(type(x)(1.0) / power_of(aim, c[C.RELOADING_EXPONENT]), c[C.UNLOADING_SLOPE])
    return target - slope * (aim - x), slope


@wp.func
def saws_follow(drift: Any, memory: Any, c: Any):
    """Return the memory after a step to a drift, and the slope of the force there."""
    zero, one = type(drift)(0.0), type(drift)(1.0)
    small, off_envelope = type(drift)(IS_SMALL), type(drift)(OFF_ENVELOPE)
    between, has_failed = type(drift)(BETWEEN), type(drift)(HAS_FAILED)
    limit = type(drift)(SMALL) * c[C.CROSSING_DRIFT]
    u = drift * c[C.INVERSE_YIELD_DRIFT]
    moves = u != memory[M.DRIFT]
    way = wp.where(u < memory[M.DRIFT], -one, one)
    x = way * u
    farthest = wp.where(way > zero, memory[M.FARTHEST_ABOVE], memory[M.FARTHEST_BELOW])
    state = memory[M.STATE]
    stiff = c[C.UNLOADING_SLOPE]
    force = way * memory[M.FORCE] + stiff * (x - way * memory[M.DRIFT])
    slope = stiff
    size = wp.abs(x)
    on_curve, steep = saws_envelope(size, c)
    if state == small and size <= limit:
        force = wp.where(x < zero, -on_curve, on_curve)
        slope = steep
    elif state == small or (way * state == off_envelope and x > farthest):
        force = on_curve
        slope = steep
        state = way * off_envelope
    elif way * state != off_envelope:
        bound = c[C.PINCHED_FORCE] + c[C.PINCHED_SLOPE] * x
        bound_slope = c[C.PINCHED_SLOPE]
        reaches = between
        if x > c[C.CROSSING_DRIFT]:
            aim = farthest * c[C.RELOADING_DRIFT_RATIO]
            if farthest > zero and x < aim:
                line, line_slope = saws_reloading(x, farthest, c)
                bound_slope = wp.where(line > bound, line_slope, bound_slope)
                bound = maximum(line, bound)
            else:
                bound = on_curve
                bound_slope = steep
            if on_curve <= bound:
                bound = on_curve
                bound_slope = steep
                reaches = wp.where(x > farthest, way * off_envelope, between)
        if force >= bound:
            force = bound
            slope = bound_slope
            state = reaches
    if way * state == off_envelope:
        farthest = maximum(farthest, x)
    if memory[M.STATE] == has_failed or size >= c[C.FAILURE_DRIFT]:
        state = has_failed
        force = zero
        slope = zero
    if not moves:
        force = way * memory[M.FORCE]
    after = type(memory)()
    after[M.DRIFT] = u
    after[M.FORCE] = way * force
    after[M.STATE] = state
    after[M.FARTHEST_ABOVE] = wp.where(way > zero, farthest, memory[M.FARTHEST_ABOVE])
    after[M.FARTHEST_BELOW] = wp.where(way > zero, memory[M.FARTHEST_BELOW], farthest)
    return after, slope


def force(drift: Any, memory: Any, c: Any):
    after, _slope = saws_follow(drift, memory, c)
    return c[C.YIELD_FORCE] * after[M.FORCE]


def return_mapping(drift: Any, memory: Any, c: Any):
    after, _slope = saws_follow(drift, memory, c)
    return after


def memory_after(drift: Any, increment: Any, memory: Any, c: Any):
    after, _slope = saws_follow(drift, memory, c)
    return after


def tangent(drift: Any, increment: Any, before: Any, after: Any, c: Any):
    _after, slope = saws_follow(drift, before, c)
    return c[C.INVERSE_YIELD_DRIFT] * c[C.YIELD_FORCE] * slope


def elastic_energy(drift: Any, memory: Any, c: Any):
    zero, one, half = type(drift)(0.0), type(drift)(1.0), type(drift)(0.5)
    has_failed = type(drift)(HAS_FAILED)
    x, f = wp.abs(memory[M.DRIFT]), wp.abs(memory[M.FORCE])
    left = decay(x)
    # At small drifts, the wall unloads along the envelope; the energy is the integral of the envelope.
    curve = x + half * c[C.HARDENING_SLOPE] * x * x - (one + c[C.HARDENING_SLOPE]) * (one - left)
    curve += c[C.HARDENING_SLOPE] * x * left
    # At other drifts, it unloads to the pinched line, and along this line if its force there has the same sign.
    with_force = wp.where(memory[M.FORCE] < zero, -memory[M.DRIFT], memory[M.DRIFT])
    way = (f + c[C.PINCHED_FORCE] - c[C.PINCHED_SLOPE] * with_force) / (c[C.UNLOADING_SLOPE] - c[C.PINCHED_SLOPE])
    there = f - c[C.UNLOADING_SLOPE] * way
    energy = half * f * f / c[C.UNLOADING_SLOPE]
    if there > zero:
        energy = half * (f + there) * way + half * there * there / c[C.PINCHED_SLOPE]
    energy = wp.where(memory[M.STATE] == zero, curve, energy)
    energy = wp.where(memory[M.STATE] == has_failed, zero, energy)
    return c[C.YIELD_FORCE] / c[C.INVERSE_YIELD_DRIFT] * energy


_FUNCTIONS = device_functions("saws", force, return_mapping, elastic_energy, tangent, memory_after)
SPRINGS = {
    "saws": Spring(coefficients=len(C), memory=len(M), force_at_accepted_state=kept_force, **_FUNCTIONS),
}


@wp.func
def saws_crossing_drift(hardening: wp.float64, force: wp.float64, slope: wp.float64, peak_drift: wp.float64):
    """Return the drift at which the envelope crosses the line force + slope * drift, by bisection.

    `parameters` contains the same function for NumPy. `hardening` is the slope that the envelope approaches.
    """
    one = wp.float64(1.0)
    low, high = wp.float64(0.0), peak_drift
    for _ in range(wp.static(BISECTIONS)):
        middle = (low + high) / wp.float64(2.0)
        power = wp.exp(-middle)
        less = power - one
        # exp(-x) - 1 by Kahan's formula, without loss of digits for small x.
        if power != one and less != -one:
            less = less * -middle / wp.log(power)
        if power == one:
            less = -middle
        if -(one + hardening * middle) * less > force + slope * middle:
            high = middle
        else:
            low = middle
    return high
