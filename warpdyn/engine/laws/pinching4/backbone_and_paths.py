"""The backbone of Pinching4's storeys (four points), and the paths on which they unload and reload.

A path consists of three straight segments. Drifts and forces are divided by the yield drift and yield force of the
positive side; signs are such that the storey moves in the positive direction.
"""

from typing import Any

import warp as wp

from warpdyn.engine.device.extrema import clamped, maximum, minimum
from warpdyn.engine.laws.pinching4.parameters import Coefficient as C, Negative as N
from warpdyn.engine.laws.row_functions import device_functions

SLACK = wp.constant(wp.float64(1e-6))
FAR = wp.constant(wp.float64(1e16))


@wp.func
def pinching4_backbone(x: Any, c: Any):
    """Return the force of the backbone at a drift x >= 0, its slope nearer to zero, and the drift at the segment's end.

    Drifts are in yield drifts and forces in yield forces; a segment is the line from one corner to the next.
    """
    zero, one = type(x)(0.0), type(x)(1.0)
    second = x - one
    third = second - c[C.SECOND_LENGTH]
    fourth = third - c[C.THIRD_LENGTH]
    force = minimum(x, one) + c[C.SECOND_SLOPE] * clamped(second, zero, c[C.SECOND_LENGTH])
    force += c[C.THIRD_SLOPE] * clamped(third, zero, c[C.THIRD_LENGTH]) + c[C.FOURTH_SLOPE] * clamped(
        fourth, zero, c[C.FOURTH_LENGTH]
    )
    slope = wp.where(fourth <= c[C.FOURTH_LENGTH], c[C.FOURTH_SLOPE], zero)
    slope = wp.where(fourth <= zero, c[C.THIRD_SLOPE], slope)
    slope = wp.where(third <= zero, c[C.SECOND_SLOPE], slope)
    slope = wp.where(second <= zero, one, slope)
    end = wp.where(
        fourth <= c[C.FOURTH_LENGTH], one + c[C.SECOND_LENGTH] + c[C.THIRD_LENGTH] + c[C.FOURTH_LENGTH], type(x)(FAR)
    )
    end = wp.where(fourth <= zero, one + c[C.SECOND_LENGTH] + c[C.THIRD_LENGTH], end)
    end = wp.where(third <= zero, one + c[C.SECOND_LENGTH], end)
    return force, slope, wp.where(second <= zero, one, end)


def side_functions(name: str, FIRST_NEGATIVE: int | None) -> tuple[wp.Function, wp.Function]:
    """Return two device functions for the side of a storey (positive or negative) towards which the storey moves.

    Args:
        name: Prefix of the names of the device functions.
        FIRST_NEGATIVE: Index of the first coefficient of the negative side; None if both sides are the same.

    Returns:
        `(x, is_up, c) -> force, slope, end` of the backbone, as `pinching4_backbone`. `(is_up, c) -> values`: yield
        drift, drift at the third corner, reloading drift and force, and the force at which unloading ends, for peaks
        before and beyond the third corner.
    """
    ASYMMETRIC = FIRST_NEGATIVE is not None
    FIRST = wp.constant(FIRST_NEGATIVE or 0)

    def backbone(x: Any, is_up: bool, c: Any):
        if ASYMMETRIC:
            zero = type(x)(0.0)
            yields = wp.where(is_up, type(x)(1.0), c[FIRST + N.YIELD_FORCE])
            second_length = wp.where(is_up, c[C.SECOND_LENGTH], c[FIRST + N.SECOND_LENGTH])
            third_length = wp.where(is_up, c[C.THIRD_LENGTH], c[FIRST + N.THIRD_LENGTH])
            fourth_length = wp.where(is_up, c[C.FOURTH_LENGTH], c[FIRST + N.FOURTH_LENGTH])
            second_slope = wp.where(is_up, c[C.SECOND_SLOPE], c[FIRST + N.SECOND_SLOPE])
            third_slope = wp.where(is_up, c[C.THIRD_SLOPE], c[FIRST + N.THIRD_SLOPE])
            fourth_slope = wp.where(is_up, c[C.FOURTH_SLOPE], c[FIRST + N.FOURTH_SLOPE])
            second = x - yields
            third = second - second_length
            fourth = third - third_length
            force = minimum(x, yields) + second_slope * clamped(second, zero, second_length)
            force += third_slope * clamped(third, zero, third_length)
            force += fourth_slope * clamped(fourth, zero, fourth_length)
            slope = wp.where(fourth <= fourth_length, fourth_slope, zero)
            slope = wp.where(fourth <= zero, third_slope, slope)
            slope = wp.where(third <= zero, second_slope, slope)
            slope = wp.where(second <= zero, type(x)(1.0), slope)
            end = wp.where(fourth <= fourth_length, yields + second_length + third_length + fourth_length, type(x)(FAR))
            end = wp.where(fourth <= zero, yields + second_length + third_length, end)
            end = wp.where(third <= zero, yields + second_length, end)
            return force, slope, wp.where(second <= zero, yields, end)
        return pinching4_backbone(x, c)

    def of_side(is_up: bool, c: Any):
        yields = type(c[0])(1.0)
        third_corner = yields + c[C.SECOND_LENGTH] + c[C.THIRD_LENGTH]
        drift, force = c[C.RELOADING_DRIFT], c[C.RELOADING_FORCE]
        unloaded, beyond = c[C.UNLOADED_FORCE], c[C.UNLOADED_FORCE_BEYOND]
        if ASYMMETRIC:
            yields = wp.where(is_up, yields, c[FIRST + N.YIELD_FORCE])
            below = c[FIRST + N.YIELD_FORCE] + c[FIRST + N.SECOND_LENGTH] + c[FIRST + N.THIRD_LENGTH]
            third_corner = wp.where(is_up, third_corner, below)
            drift = wp.where(is_up, drift, c[FIRST + N.RELOADING_DRIFT])
            force = wp.where(is_up, force, c[FIRST + N.RELOADING_FORCE])
            unloaded = wp.where(is_up, unloaded, c[FIRST + N.UNLOADED_FORCE])
            beyond = wp.where(is_up, beyond, c[FIRST + N.UNLOADED_FORCE_BEYOND])
        return yields, third_corner, drift, force, unloaded, beyond

    functions = device_functions(name, backbone, of_side)
    return functions["backbone"], functions["of_side"]


@wp.func
def pinching4_corners(
    x0: Any, f0: Any, x3: Any, f3: Any, low: Any, stiffness: Any, is_up: Any, reloading_drift: Any, reloading_force: Any
):
    """Return the two corners (x1, f1, x2, f2) of the path from the last reversal (x0, f0) to its target point (x3, f3).

    Args:
        x0, f0: Drift and force at the last reversal.
        x3, f3: Drift and force of the target point.
        low: Force at which unloading ends.
        stiffness: Unloading stiffness.
        is_up: Whether the storey moves in the positive direction.
        reloading_drift, reloading_force: Drift and force of the second corner, divided by those of the target point.
    """
    zero, one, half = type(x0)(0.0), type(x0)(1.0), type(x0)(0.5)
    f2 = f3 * reloading_force
    x2 = minimum(x3 * reloading_drift, x3 - (f3 - f2) / stiffness)  # reloading is never stiffer than unloading
    f1 = low
    x1 = x0 + (f1 - f0) / stiffness
    is_straight = (x0 >= zero) or (x2 < x0)
    is_low = x1 < x0
    run, rise = x2 - x1, f2 - f1
    steeper = rise - stiffness * run
    # If both corners are at about the same drift, rounding must not decide whether the middle segment is steep.
    is_steep = wp.where(run > -type(x0)(SLACK), steeper > zero, steeper < zero)
    is_straight = is_straight or (is_steep and not is_low)
    # If the segments overlap or the middle segment falls, one corner moves between its neighbours, or both to one
    # force.
    overlaps = (not is_low) and ((run < zero) or (rise * run < zero) or (run == zero and rise < zero))
    first_moves = is_low or (overlaps and x1 > zero)
    second_moves = overlaps and (not first_moves) and x2 < zero
    both_move = overlaps and not (first_moves or second_moves)
    mean = half * (f1 + f2)
    apart = wp.abs(mean) * type(x0)(0.01)
    last = (x3 - x2) / wp.where(f3 == f2, one, f3 - f2)
    between_x, between_f = half * (x0 + x2), half * (f0 + f2)
    beyond_x, beyond_f = half * (x1 + x3), half * (f1 + f3)
    f1 = wp.where(both_move, mean - apart, f1)
    f2 = wp.where(both_move, mean + apart, wp.where(second_moves, beyond_f, f2))
    x1 = wp.where(both_move, x0 + (f1 - f0) / stiffness, x1)
    x2 = wp.where(both_move, x3 - (f3 - f2) * last, wp.where(second_moves, beyond_x, x2))
    x1 = wp.where(first_moves, between_x, x1)
    f1 = wp.where(first_moves, between_f, f1)
    # A path that still goes back or falls becomes a straight line; if this line is too soft, it leads through the
    # origin.
    falls = (x1 < x0) or (f1 < f0) or (x2 < x1) or (f2 < f1) or (x3 < x2) or (f3 < f2)
    chord = f3 - f0
    secant = wp.where(is_up, chord * x0 > f0 * (x3 - x0), chord * x3 < f3 * (x3 - x0))
    by_origin = falls and (not is_straight) and chord > zero and secant
    is_straight = is_straight or falls
    x1 = wp.where(is_straight, wp.where(by_origin, zero, x0), x1)
    f1 = wp.where(is_straight, wp.where(by_origin, zero, f0), f1)
    x2 = wp.where(is_straight, x1, x2)
    f2 = wp.where(is_straight, f1, f2)
    return x1, f1, x2, f2


@wp.func
def pinching4_release(x: Any, xa: Any, fa: Any, xb: Any, fb: Any):
    """Return the energy that one segment of a path returns, from a drift x to the point of zero force.

    The segment leads from (xa, fa) to (xb, fb).
    """
    zero = type(x)(0.0)
    length, rise = xb - xa, fb - fa
    start = maximum(x, xa)
    before = fa + (start - xa) * rise / wp.where(length > zero, length, type(x)(1.0))
    run = maximum(xb - start, zero)
    share = wp.where(fb > zero, -before / wp.where(fb > before, fb - before, type(x)(1.0)), type(x)(1.0))
    return wp.where(before < zero, -type(x)(0.5) * (before + minimum(fb, zero)) * run * share, zero)
