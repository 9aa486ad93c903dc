"""Device functions of peak-oriented storeys: after zero force, reloading leads towards the peak of the new side.

The drift x is in yield drifts and the force f in yield forces. The backbone consists of three lines, which begin at the
origin, the cracking point and the yield point; its force is the smallest of their forces. Unloading follows a straight
line; reloading after partial unloading returns to the point where unloading began.

`peak_oriented` unloads with the initial stiffness. `takeda` unloads towards the opposite cracking point before yield.
After yield, it unloads with x^-a times the slope at yield (a is the unloading exponent), but at least with the slope to
the origin. If one side has yielded and the other side has not cracked, the other side is loaded with the unloading
slope up to the cracking force, then along a line to the yield point. If a line can be followed in one direction only,
its other end is the drift of the last step.
"""

import enum
from typing import Any

import warp as wp

from warpdyn.engine.device.exponentials import exponential, natural_logarithm
from warpdyn.engine.device.extrema import maximum, minimum
from warpdyn.engine.laws.law import Layout
from warpdyn.engine.laws.peak_oriented.parameters import Coefficient as C, PeakOriented, Takeda
from warpdyn.engine.laws.row_functions import device_functions, kept_force
from warpdyn.engine.laws.spring import Spring

LEAST_WAY = wp.constant(wp.float64(1e-9))  # smallest distance to the target; the force is divided by the distance
# A line ends just before zero force: the rules depend on the sign of the force, which rounding must not decide.
LEAST_FORCE = wp.constant(wp.float64(1e-3))
FARTHEST = wp.constant(wp.float64(1e30))


class M(Layout):
    """Memory of a storey: the history variables that its law keeps from step to step.

    Drifts are divided by the yield drift and forces by the yield force.
    """

    DRIFT = enum.auto()  # drift at the last step
    FORCE = enum.auto()
    PEAK_ABOVE = enum.auto()  # drift of the positive peak minus the cracking drift
    PEAK_BELOW = enum.auto()
    LOWER_END = enum.auto()  # drifts between which the storey stays on its line
    UPPER_END = enum.auto()
    ORIGIN = enum.auto()  # drift at which the loading line has zero force
    LINE_SLOPE = enum.auto()


VALUES = wp.constant(len(M))


@wp.func
def backbone(x: Any, c: Any):
    """Return the force of the backbone, in yield forces, at a drift x >= 0, in yield drifts."""
    return minimum(
        c[C.INITIAL_SLOPE] * x,
        minimum(c[C.SECOND_HEIGHT] + c[C.SECOND_SLOPE] * x, c[C.THIRD_HEIGHT] + c[C.THIRD_SLOPE] * x),
    )


@wp.func
def backbone_slope(x: Any, c: Any):
    second = c[C.SECOND_HEIGHT] + c[C.SECOND_SLOPE] * x
    third = c[C.THIRD_HEIGHT] + c[C.THIRD_SLOPE] * x
    bent = wp.where(second < third, c[C.SECOND_SLOPE], c[C.THIRD_SLOPE])
    return wp.where(c[C.INITIAL_SLOPE] * x < minimum(second, third), c[C.INITIAL_SLOPE], bent)


def _peak_oriented(name: str, law: type[PeakOriented]) -> Spring:
    """Return the device functions of `PeakOriented` or `Takeda`, which differ in the unloading stiffness."""
    IS_TAKEDA = law is Takeda

    def unloading(side: Any, other: Any, c: Any):
        """Return the unloading slope of a side (positive or negative drifts), from the peak drifts of both sides.

        The arguments are the peak drifts of this side and of the other side, minus the cracking drift.
        """
        slope = c[C.INITIAL_SLOPE]
        if IS_TAKEDA:
            one = type(side)(1.0)
            # An uncracked side unloads as it was loaded: with the unloading slope of the other side.
            peak = c[C.CRACKING_DRIFT] + wp.where(side > c[C.UNCRACKED], side, other)
            until_yield = minimum(peak, one)
            slope = (backbone(until_yield, c) + c[C.INITIAL_SLOPE] * c[C.CRACKING_DRIFT]) / (
                until_yield + c[C.CRACKING_DRIFT]
            )
            slope *= exponential(-c[C.UNLOADING_EXPONENT] * natural_logarithm(maximum(peak, one)))
            # The slope is at least that of the line to the origin; otherwise unloading would end beyond the origin.
            slope = maximum(slope, backbone(peak, c) / peak)
        return slope

    unloading = device_functions(name, unloading)["unloading"]

    def leaves_line(drift: Any, memory: Any, c: Any):
        x = drift * c[C.INVERSE_YIELD_DRIFT]
        return x < memory[M.LOWER_END] or x > memory[M.UPPER_END]

    leaves_line = device_functions(name, leaves_line)["leaves_line"]

    def follow(drift: Any, memory: Any, c: Any):
        """Return the memory after a step to a drift, and the slope of f over x there."""
        zero = type(drift)(0.0)
        one = type(drift)(1.0)
        x = drift * c[C.INVERSE_YIELD_DRIFT]
        direction = wp.where(x < memory[M.DRIFT], -one, one)
        # Below, signs are as if the storey moved in the positive direction.
        at = direction * x
        last = direction * memory[M.DRIFT]
        force = direction * memory[M.FORCE]
        is_positive = direction > zero
        ahead = wp.where(is_positive, memory[M.PEAK_ABOVE], memory[M.PEAK_BELOW])
        behind = wp.where(is_positive, memory[M.PEAK_BELOW], memory[M.PEAK_ABOVE])
        is_loading = force > zero
        slope = unloading(wp.where(is_loading, ahead, behind), wp.where(is_loading, behind, ahead), c)
        crossing = last - force / slope
        origin = wp.where(is_loading, direction * memory[M.ORIGIN], crossing)
        target = c[C.CRACKING_DRIFT] + ahead
        if IS_TAKEDA:
            is_first = ahead <= c[C.UNCRACKED] and c[C.CRACKING_DRIFT] + behind > one
            target = wp.where(is_first, one, target)
        peak = backbone(target, c)
        aim = peak / maximum(target - origin, type(drift)(LEAST_WAY))
        # The force is computed from the nearer end of the line; otherwise the rounding of the peak would hide a small
        # force.
        line = wp.where(at - origin < target - at, aim * (at - origin), peak - aim * (target - at))
        line_slope = aim
        if IS_TAKEDA:
            cracking = c[C.INITIAL_SLOPE] * c[C.CRACKING_DRIFT]
            way = maximum(one - origin - cracking / slope, type(drift)(LEAST_WAY))
            from_cracking = (one - cracking) / way
            is_above = is_first and one - from_cracking * (one - at) > line
            line = wp.where(is_above, one - from_cracking * (one - at), line)
            line_slope = wp.where(is_above, from_cracking, line_slope)
        stiff = maximum(slope, aim)  # not less than `aim`; otherwise the force would jump at the backbone
        start = wp.where(is_loading, last, crossing)
        straight = maximum(force, zero) + stiff * (at - start)
        follows_line = line < straight
        reached = wp.where(follows_line, line, straight)
        tangent = wp.where(follows_line, line_slope, stiff)
        is_unloading = at < start
        reached = wp.where(is_unloading, slope * (at - crossing), reached)
        tangent = wp.where(is_unloading, slope, tangent)
        is_beyond = at >= target
        reached = wp.where(is_beyond, backbone(at, c), reached)
        tangent = wp.where(is_beyond, backbone_slope(at, c), tangent)
        farthest = wp.where(is_beyond, at - c[C.CRACKING_DRIFT], ahead)
        after = type(memory)()
        after[M.DRIFT] = x
        after[M.FORCE] = direction * reached
        after[M.PEAK_ABOVE] = wp.where(is_positive, farthest, memory[M.PEAK_ABOVE])
        after[M.PEAK_BELOW] = wp.where(is_positive, memory[M.PEAK_BELOW], farthest)
        after[M.ORIGIN] = wp.where(is_unloading, memory[M.ORIGIN], direction * origin)
        # The line from here: its slope, and the drifts between which the storey stays on it.
        apart = line - straight
        nearing = stiff - line_slope
        meets = not follows_line and nearing > zero
        far = wp.where(meets, minimum(at + apart / wp.where(meets, nearing, one), target), target)
        if IS_TAKEDA:
            far = wp.where(
                is_first, minimum(far, c[C.CRACKING_DRIFT]), far
            )  # beyond cracking, drifts along a line count as peaks
        far = wp.where(reached > zero, far, at)  # a line that is reached before zero force is left again
        slope_from_here = wp.where(follows_line, line_slope, stiff)
        # The storey can return along the unloading line, at most to the known peak, if reloading is not stiffer.
        reach = c[C.CRACKING_DRIFT] + behind
        returns = slope * (reach + direction * memory[M.ORIGIN]) >= backbone(reach, c)
        if IS_TAKEDA:
            returns = returns and not (behind <= c[C.UNCRACKED] and target > one)
        near = wp.where(is_unloading and returns, maximum(last, -reach), at)
        crossing_ahead = minimum(crossing - type(drift)(LEAST_FORCE) / slope, c[C.CRACKING_DRIFT] + ahead)
        far = wp.where(is_unloading, crossing_ahead, far)
        # Beyond the stored peak of the other side the line has no length: a move along it would create a peak.
        far = wp.where(at >= -reach, far, at)
        slope_from_here = wp.where(is_unloading, slope, slope_from_here)
        is_hard = at >= one
        far = wp.where(is_beyond, wp.where(is_hard, type(drift)(FARTHEST), one), far)
        slope_from_here = wp.where(is_beyond, wp.where(is_hard, c[C.THIRD_SLOPE], c[C.SECOND_SLOPE]), slope_from_here)
        is_elastic = maximum(after[M.PEAK_ABOVE], after[M.PEAK_BELOW]) <= zero and at < c[C.CRACKING_DRIFT]
        far = wp.where(is_elastic, c[C.CRACKING_DRIFT], far)
        near = wp.where(is_elastic, -c[C.CRACKING_DRIFT], near)
        slope_from_here = wp.where(is_elastic, c[C.INITIAL_SLOPE], slope_from_here)
        after[M.LOWER_END] = wp.where(is_positive, near, -far)
        after[M.UPPER_END] = wp.where(is_positive, far, -near)
        after[M.LINE_SLOPE] = slope_from_here
        if not leaves_line(drift, memory, c):
            after[M.LOWER_END] = wp.where(memory[M.LOWER_END] == memory[M.DRIFT], x, memory[M.LOWER_END])
            after[M.UPPER_END] = wp.where(memory[M.UPPER_END] == memory[M.DRIFT], x, memory[M.UPPER_END])
            after[M.LINE_SLOPE] = memory[M.LINE_SLOPE]
        for m in range(VALUES):
            after[m] = wp.where(x == memory[M.DRIFT], memory[m], after[m])
        return after, tangent

    follow = device_functions(name, follow)["follow"]

    def force(drift: Any, memory: Any, c: Any):
        after, _slope = follow(drift, memory, c)
        return c[C.YIELD_FORCE] * after[M.FORCE]

    def return_mapping(drift: Any, memory: Any, c: Any):
        after, _slope = follow(drift, memory, c)
        return after

    def memory_on_line(drift: Any, memory: Any, c: Any):
        x = drift * c[C.INVERSE_YIELD_DRIFT]
        after = type(memory)()
        after[M.DRIFT] = x
        after[M.FORCE] = memory[M.FORCE] + memory[M.LINE_SLOPE] * (x - memory[M.DRIFT])
        # The peaks increase only on the backbone.
        after[M.PEAK_ABOVE] = wp.where(
            x > memory[M.DRIFT], maximum(memory[M.PEAK_ABOVE], x - c[C.CRACKING_DRIFT]), memory[M.PEAK_ABOVE]
        )
        after[M.PEAK_BELOW] = wp.where(
            x < memory[M.DRIFT], maximum(memory[M.PEAK_BELOW], -x - c[C.CRACKING_DRIFT]), memory[M.PEAK_BELOW]
        )
        after[M.LOWER_END] = wp.where(memory[M.LOWER_END] == memory[M.DRIFT], x, memory[M.LOWER_END])
        after[M.UPPER_END] = wp.where(memory[M.UPPER_END] == memory[M.DRIFT], x, memory[M.UPPER_END])
        after[M.ORIGIN] = memory[M.ORIGIN]
        after[M.LINE_SLOPE] = memory[M.LINE_SLOPE]
        return after

    def tangent_on_line(drift: Any, memory: Any, c: Any):
        # A line without length, such as the first one, has no slope: the storey is elastic there.
        is_empty = memory[M.LOWER_END] == memory[M.UPPER_END]
        slope = wp.where(is_empty, c[C.INITIAL_SLOPE], memory[M.LINE_SLOPE])
        return c[C.INVERSE_YIELD_DRIFT] * c[C.YIELD_FORCE] * slope

    def elastic_energy(drift: Any, memory: Any, c: Any):
        is_positive = memory[M.FORCE] > type(drift)(0.0)
        side = wp.where(is_positive, memory[M.PEAK_ABOVE], memory[M.PEAK_BELOW])
        other = wp.where(is_positive, memory[M.PEAK_BELOW], memory[M.PEAK_ABOVE])
        return (
            type(drift)(0.5)
            * c[C.YIELD_FORCE]
            / c[C.INVERSE_YIELD_DRIFT]
            * memory[M.FORCE]
            * memory[M.FORCE]
            / unloading(side, other, c)
        )

    def tangent(drift: Any, increment: Any, before: Any, after: Any, c: Any):
        _after, slope = follow(drift, before, c)
        return c[C.INVERSE_YIELD_DRIFT] * c[C.YIELD_FORCE] * slope

    def memory_after(drift: Any, increment: Any, memory: Any, c: Any):
        return return_mapping(drift, memory, c)

    functions = device_functions(
        name, force, return_mapping, memory_on_line, tangent_on_line, elastic_energy, tangent, memory_after
    )
    return_mapping = functions["return_mapping"]
    return Spring(
        coefficients=len(law.rows[name]),
        memory=len(M),
        values_on_line=int(M.ORIGIN),
        leaves_line=leaves_line,
        force_at_accepted_state=kept_force,
        **functions,
    )


SPRINGS = {
    "peak_oriented": _peak_oriented("peak_oriented", PeakOriented),
    "takeda": _peak_oriented("takeda", Takeda),
}
