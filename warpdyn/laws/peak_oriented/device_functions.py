"""Peak-oriented storeys: reloading aims at the farthest point of its side, from where the force was 0.

The drift x is in yield drifts and the force f in yield forces. The backbone is the least of three lines, through 0,
the cracking point and the yield point. Unloading is straight; reloading after a part of it comes back to where it
began.

`peak_oriented` unloads by the initial stiffness. `takeda` unloads towards the opposite cracking point until it has
yielded, and by x^-a as stiff after that, but no softer than towards the origin. A side of it that has not cracked
where the other has yielded is loaded by the slope of unloading up to the cracking force, then straight to the yield
point.

Coefficients: 1 / yield drift, yield force, the initial slope, height at 0 and slope of the second line, the same of
the third, x at cracking; Takeda's a, and how far beyond the cracking point a peak that has not cracked can be: 0, or
less where the storey yields as it cracks.
The memory: x and f of the last step, how far beyond the cracking points the peaks of the positive and of the negative
side are, between which x the storey stays on the line that it is on, where the line that loading follows has f = 0, and
the slope of the line that it is on. A line that only one way leads along ends, behind the storey, at its last step.
"""

from typing import Any

import warp as wp

from warpdyn.device.exponentials import exponential, natural_logarithm
from warpdyn.laws.row_functions import device_functions, kept_force
from warpdyn.laws.spring import Spring

LEAST_WAY = wp.constant(wp.float64(1e-9))  # to the point aimed at: a turn that rounding puts upon it divides by it
# Before a force of 0 rules are asked again: the sign, which they go by, must not be that of what gliding rounded.
LEAST_FORCE = wp.constant(wp.float64(1e-3))
FARTHEST = wp.constant(wp.float64(1e30))


@wp.func
def backbone(x: Any, c: Any):
    """Return the backbone's force at x >= 0."""
    return wp.min(c[2] * x, wp.min(c[3] + c[4] * x, c[5] + c[6] * x))


@wp.func
def backbone_slope(x: Any, c: Any):
    second = c[3] + c[4] * x
    third = c[5] + c[6] * x
    bent = wp.where(second < third, c[4], c[6])
    return wp.where(c[2] * x < wp.min(second, third), c[2], bent)


def _peak_oriented(name: str, IS_TAKEDA: bool) -> Spring:
    """Return the row of either rule for unloading."""

    def unloading(side: Any, other: Any, c: Any):
        """Return the slope of unloading from a side, by how far its peak and the other's are beyond cracking."""
        slope = c[2]
        if IS_TAKEDA:
            one = type(side)(1.0)
            # A side that has not cracked unloads as it was loaded: by the slope that led there from the other.
            peak = c[7] + wp.where(side > c[9], side, other)
            until_yield = wp.min(peak, one)
            slope = (backbone(until_yield, c) + c[2] * c[7]) / (until_yield + c[7])
            slope *= exponential(-c[8] * natural_logarithm(wp.max(peak, one)))
            # No softer than towards the origin: unloading would end on the other side of it.
            slope = wp.max(slope, backbone(peak, c) / peak)
        return slope

    unloading = device_functions(name, unloading)["unloading"]

    def decides(drift: Any, memory: Any, c: Any):
        x = drift * c[0]
        return x < memory[4] or x > memory[5]

    decides = device_functions(name, decides)["decides"]

    def follow(drift: Any, memory: Any, c: Any):
        """Return the memory at a drift, and the slope of f over x there."""
        zero = type(drift)(0.0)
        one = type(drift)(1.0)
        x = drift * c[0]
        direction = wp.where(x < memory[0], -one, one)
        # From here on all is as if the storey moved in positive direction.
        at = direction * x
        last = direction * memory[0]
        force = direction * memory[1]
        is_positive = direction > zero
        ahead = wp.where(is_positive, memory[2], memory[3])
        behind = wp.where(is_positive, memory[3], memory[2])
        is_loading = force > zero
        slope = unloading(wp.where(is_loading, ahead, behind), wp.where(is_loading, behind, ahead), c)
        crossing = last - force / slope
        origin = wp.where(is_loading, direction * memory[6], crossing)
        target = c[7] + ahead
        if IS_TAKEDA:
            is_first = ahead <= c[9] and c[7] + behind > one
            target = wp.where(is_first, one, target)
        peak = backbone(target, c)
        aim = peak / wp.max(target - origin, type(drift)(LEAST_WAY))
        line = peak - aim * (target - at)
        line_slope = aim
        if IS_TAKEDA:
            cracking = c[2] * c[7]
            way = wp.max(one - origin - cracking / slope, type(drift)(LEAST_WAY))
            from_cracking = (one - cracking) / way
            is_above = is_first and one - from_cracking * (one - at) > line
            line = wp.where(is_above, one - from_cracking * (one - at), line)
            line_slope = wp.where(is_above, from_cracking, line_slope)
        stiff = wp.max(slope, aim)  # no softer, or the force would jump where it meets the backbone
        start = wp.where(is_loading, last, crossing)
        straight = wp.max(force, zero) + stiff * (at - start)
        follows_line = line < straight
        reached = wp.where(follows_line, line, straight)
        tangent = wp.where(follows_line, line_slope, stiff)
        is_unloading = at < start
        reached = wp.where(is_unloading, slope * (at - crossing), reached)
        tangent = wp.where(is_unloading, slope, tangent)
        is_beyond = at >= target
        reached = wp.where(is_beyond, backbone(at, c), reached)
        tangent = wp.where(is_beyond, backbone_slope(at, c), tangent)
        farthest = wp.where(is_beyond, at - c[7], ahead)
        after = type(memory)()
        after[0] = x
        after[1] = direction * reached
        after[2] = wp.where(is_positive, farthest, memory[2])
        after[3] = wp.where(is_positive, memory[3], farthest)
        after[6] = wp.where(is_unloading, memory[6], direction * origin)
        # The line from here on: its slope, and between which drifts the storey stays on it.
        apart = line - straight
        nearing = stiff - line_slope
        meets = not follows_line and nearing > zero
        far = wp.where(meets, wp.min(at + apart / wp.where(meets, nearing, one), target), target)
        if IS_TAKEDA:
            far = wp.where(is_first, wp.min(far, c[7]), far)  # beyond cracking, gliding takes drifts for peaks
        far = wp.where(reached > zero, far, at)  # a line met before its force is 0 is left again
        glides_by = wp.where(follows_line, line_slope, stiff)
        # Back along the line of unloading, if reloading is no stiffer, and no farther than the peak that is known.
        reach = c[7] + behind
        returns = slope * (reach + direction * memory[6]) >= backbone(reach, c)
        if IS_TAKEDA:
            returns = returns and not (behind <= c[9] and target > one)
        near = wp.where(is_unloading and returns, wp.max(last, -reach), at)
        crossing_ahead = wp.min(crossing - type(drift)(LEAST_FORCE) / slope, c[7] + ahead)
        far = wp.where(is_unloading, crossing_ahead, far)
        far = wp.where(at >= -reach, far, at)  # where no peak has been yet gliding would put one
        glides_by = wp.where(is_unloading, slope, glides_by)
        is_hard = at >= one
        far = wp.where(is_beyond, wp.where(is_hard, type(drift)(FARTHEST), one), far)
        glides_by = wp.where(is_beyond, wp.where(is_hard, c[6], c[4]), glides_by)
        is_elastic = wp.max(after[2], after[3]) <= zero and at < c[7]
        far = wp.where(is_elastic, c[7], far)
        near = wp.where(is_elastic, -c[7], near)
        glides_by = wp.where(is_elastic, c[2], glides_by)
        after[4] = wp.where(is_positive, near, -far)
        after[5] = wp.where(is_positive, far, -near)
        after[7] = glides_by
        if not decides(drift, memory, c):
            after[4] = wp.where(memory[4] == memory[0], x, memory[4])
            after[5] = wp.where(memory[5] == memory[0], x, memory[5])
            after[7] = memory[7]
        for m in range(8):
            after[m] = wp.where(x == memory[0], memory[m], after[m])
        return after, tangent

    follow = device_functions(name, follow)["follow"]

    def force(drift: Any, memory: Any, c: Any):
        after, _slope = follow(drift, memory, c)
        return c[1] * after[1]

    def evolve(drift: Any, memory: Any, c: Any):
        after, _slope = follow(drift, memory, c)
        return after

    def glide(drift: Any, memory: Any, c: Any):
        x = drift * c[0]
        after = type(memory)()
        after[0] = x
        after[1] = memory[1] + memory[7] * (x - memory[0])
        # Only on the backbone is it a new peak.
        after[2] = wp.where(x > memory[0], wp.max(memory[2], x - c[7]), memory[2])
        after[3] = wp.where(x < memory[0], wp.max(memory[3], -x - c[7]), memory[3])
        after[4] = wp.where(memory[4] == memory[0], x, memory[4])
        after[5] = wp.where(memory[5] == memory[0], x, memory[5])
        after[6] = memory[6]
        after[7] = memory[7]
        return after

    def recoverable(drift: Any, memory: Any, c: Any):
        is_positive = memory[1] > type(drift)(0.0)
        side = wp.where(is_positive, memory[2], memory[3])
        other = wp.where(is_positive, memory[3], memory[2])
        return type(drift)(0.5) * c[1] / c[0] * memory[1] * memory[1] / unloading(side, other, c)

    def tangent(drift: Any, increment: Any, before: Any, after: Any, c: Any):
        _after, slope = follow(drift, before, c)
        return c[0] * c[1] * slope

    def advance(drift: Any, increment: Any, memory: Any, c: Any):
        return evolve(drift, memory, c)

    functions = device_functions(name, force, evolve, glide, recoverable, tangent, advance)
    evolve = functions["evolve"]
    return Spring(
        coefficients=10 if IS_TAKEDA else 8, memory=8, gliding=6, decides=decides, held=kept_force, **functions
    )


SPRINGS = {
    "peak_oriented": _peak_oriented("peak_oriented", False),
    "takeda": _peak_oriented("takeda", True),
}
