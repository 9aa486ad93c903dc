"""The backbone of four points and the paths of three straight parts that Pinching4's storeys go along.

All of it is over the yield drift and the yield force, and of a storey that moves ahead.
"""

from typing import Any

import warp as wp

from warpdyn.engine.device.extrema import clamped, maximum, minimum
from warpdyn.engine.laws.pinching4.parameters import Coefficient as C

SLACK = wp.constant(wp.float64(1e-6))
FAR = wp.constant(wp.float64(1e16))


@wp.func
def pinching4_backbone(x: Any, c: Any):
    """Force at a drift ahead, the backbone's slope before it, and where that ends."""
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


@wp.func
def pinching4_corners(x0: Any, f0: Any, x3: Any, f3: Any, low: Any, stiffness: Any, is_up: Any, c: Any):
    """Two corners, as (x1, f1, x2, f2), of the path from a turn (x0, f0) to the point aimed at (x3, f3).

    `low` is the force of the backbone that unloading goes to, times its ratio.
    """
    zero, one, half = type(x0)(0.0), type(x0)(1.0), type(x0)(0.5)
    f2 = f3 * c[C.RELOADING_FORCE]
    x2 = minimum(x3 * c[C.RELOADING_DRIFT], x3 - (f3 - f2) / stiffness)  # reloading is never stiffer than unloading
    f1 = low
    x1 = x0 + (f1 - f0) / stiffness
    is_straight = (x0 >= zero) or (x2 < x0)
    is_low = x1 < x0
    run, rise = x2 - x1, f2 - f1
    steeper = rise - stiffness * run
    # Corners above each other are a steep part, whatever their rounding.
    is_steep = wp.where(run > -type(x0)(SLACK), steeper > zero, steeper < zero)
    is_straight = is_straight or (is_steep and not is_low)
    # Where the parts overlap, or the middle one falls, one corner moves between its neighbours, or both to one height.
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
    # A path that still goes back or falls is a straight line, by way of the origin where the line is too soft.
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
    """Energy given back from a drift on along one part of a path, until it comes to no force."""
    zero = type(x)(0.0)
    length, rise = xb - xa, fb - fa
    start = maximum(x, xa)
    before = fa + (start - xa) * rise / wp.where(length > zero, length, type(x)(1.0))
    run = maximum(xb - start, zero)
    share = wp.where(fb > zero, -before / wp.where(fb > before, fb - before, type(x)(1.0)), type(x)(1.0))
    return wp.where(before < zero, -type(x)(0.5) * (before + minimum(fb, zero)) * run * share, zero)
