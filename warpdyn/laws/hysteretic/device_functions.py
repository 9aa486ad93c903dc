"""Trilinear backbone with pinching, damage by ductility and energy, and softer unloading (OpenSees: Hysteretic).

Everything is over the yield drift and the yield force, and mirrored so that the storey moves ahead: one set of rules
serves both directions. The memory is the last drift and force, the farthest drifts ahead and behind (damage moves them
out), the work done, between which drifts the storey stays on the line that it is on, the direction of the last step,
the drifts at which the last unloading from behind and from ahead came to no force, and the slope of the line that it is
on. A line that only one way leads along ends, behind the storey, at its last step.

Coefficients: 1 / yield drift, yield force, length and slope of the backbone's second part, slope and length of its
third, drifts at which these fall to no force, pinching of drift and of force, damage by ductility and by energy, and
last the exponent of unloading, where there is one.
"""

from typing import Any

import warp as wp

from warpdyn.device.exponentials import power_of
from warpdyn.laws.row_functions import device_functions, kept_force
from warpdyn.laws.spring import Spring

FARTHEST = wp.constant(wp.float64(1e16))  # m: damage that runs away stops there
# Before a force of 0 rules are asked again: the sign, which they go by, must not be that of what gliding rounded.
LEAST_FORCE = wp.constant(wp.float64(1e-3))
NO_END = wp.constant(wp.float64(1e30))


@wp.func
def hysteretic_backbone(x: Any, c: Any):
    """Force at a drift ahead, and the backbone's slope before it."""
    zero, one = type(x)(0.0), type(x)(1.0)
    second = x - one
    third = second - c[2]
    force = wp.min(x, one) + c[3] * wp.clamp(second, zero, c[2]) + c[4] * wp.clamp(third, zero, c[5])
    slope = wp.where(third <= c[5], c[4], zero)
    slope = wp.where(third <= zero, c[3], slope)
    return force, wp.where(second <= zero, one, slope)


@wp.func
def hysteretic_step(x: Any, memory: Any, c: Any, softer_ahead: Any, softer_behind: Any):
    """Where a step to a drift leads, as (force, slope, direction, farthest drift ahead, drift of no force behind).

    After them the slope of the line from there on, and the drift at which it ends. The force and the drifts are
    mirrored. `softer` is how far unloading is softer than at first, 1 or more.
    """
    zero, one = type(x)(0.0), type(x)(1.0)
    way = wp.where(x < memory[0], -one, one)
    is_up = way > zero
    ahead = wp.where(is_up, memory[2], memory[3])
    behind = wp.where(is_up, memory[3], memory[2])
    released = wp.where(is_up, memory[8], memory[9])
    here, last, before = way * x, way * memory[0], way * memory[1]
    moved = here - last
    releases = (way * memory[7] < zero) and (before <= zero)
    stored = type(x)(0.5) * before * before * softer_behind
    damage = wp.where(behind > one, c[11] * (memory[4] - stored) + c[10] * (behind - one), zero)
    released = wp.where(releases, last - before * softer_behind, released)
    target = wp.clamp(wp.where(releases, ahead * (one + damage), ahead), one, type(x)(FARTHEST) * c[0])
    strength, slope = hysteretic_backbone(target, c)
    # Behind a backbone that has come to no force there is none before the drift at which it did.
    gone = wp.where(behind <= one + c[2], c[6], c[7])
    start = wp.max(wp.where(behind <= one, released, -gone), released)
    pinched = c[9] * strength
    bend = start + (target - (strength - pinched) * softer_ahead - start) * c[8]
    is_first = here < bend
    length = wp.where(is_first, bend - start, target - bend)
    rise = wp.where(is_first, pinched, strength - pinched) / wp.where(length > zero, length, one)
    towards = wp.where(is_first, zero, pinched) + (here - wp.where(is_first, start, bend)) * rise
    elastic = before + moved / softer_ahead
    force = wp.min(elastic, towards)
    slope = wp.where(elastic < towards, one / softer_ahead, rise)
    # From here on no steeper than unloading, to the line aimed along or to its end.
    stiff = one / softer_ahead
    glides_by = wp.where(elastic < towards, stiff, wp.min(rise, stiff))
    end = wp.where(is_first, wp.min(bend, target), target)
    meets = elastic < towards and stiff > rise
    end = wp.where(meets, wp.min(here + (towards - elastic) / wp.where(meets, stiff - rise, one), end), end)
    is_gap = is_first and here <= start
    end = wp.where(is_gap, wp.min(end, start), end)
    end = wp.where(releases, here, end)  # what was damaged unloads softer from the next step on, and is aimed at so
    unloaded = before + moved / softer_behind
    is_unloading = here < released
    is_idle = wp.where(is_unloading, unloaded >= zero, is_gap)
    force = wp.where(is_unloading, unloaded, force)
    slope = wp.where(is_unloading, one / softer_behind, slope)
    force = wp.where(is_idle, zero, force)
    slope = wp.where(is_idle, zero, slope)
    glides_by = wp.where(is_unloading or is_idle, slope, glides_by)
    end = wp.where(is_unloading, released - type(x)(LEAST_FORCE) * softer_behind, end)
    on_backbone = here >= ahead
    full, steep = hysteretic_backbone(here, c)
    on_third = here >= one + c[2]
    is_last = here >= one + c[2] + c[5]
    slope_after = wp.where(on_third, wp.where(is_last, zero, c[4]), wp.where(here < one, one, c[3]))
    corner = wp.where(on_third, wp.where(is_last, type(x)(NO_END), one + c[2] + c[5]), one + c[2])
    corner = wp.where(here < one, one, corner)
    glides_by = wp.where(on_backbone, slope_after, glides_by)
    end = wp.where(on_backbone, corner, end)
    force = wp.where(on_backbone, full, force)
    slope = wp.where(on_backbone, steep, slope)
    target = wp.where(on_backbone, here, target)
    released = wp.where(on_backbone, wp.where(is_up, memory[8], memory[9]), released)
    return force, slope, way, target, released, glides_by, end


def _hysteretic(unloads_softer: bool, name: str) -> Spring:
    """Return the law with or without an exponent of unloading, which takes two powers a force."""
    SOFTENS = unloads_softer

    def softer(farthest: Any, c: Any):
        one = type(farthest)(1.0)
        if SOFTENS:
            # No softer than towards the origin; where the backbone is below yield no power is.
            reach = wp.max(farthest, one)
            strength, _slope = hysteretic_backbone(reach, c)
            return wp.min(power_of(reach, c[12]), reach / wp.max(strength, one))
        return one

    softer = device_functions(name, softer)["softer"]

    def step(drift: Any, memory: Any, c: Any):
        x = drift * c[0]
        above, below = softer(memory[2], c), softer(memory[3], c)
        is_up = x >= memory[0]
        return hysteretic_step(x, memory, c, wp.where(is_up, above, below), wp.where(is_up, below, above))

    step = device_functions(name, step)["step"]

    def force(drift: Any, memory: Any, c: Any):
        now, _slope, way, _ahead, _released, _glides_by, _end = step(drift, memory, c)
        return c[1] * wp.where(drift * c[0] == memory[0], memory[1], way * now)

    def decides(drift: Any, memory: Any, c: Any):
        x = drift * c[0]
        return x < memory[5] or x > memory[6]

    decides = device_functions(name, decides)["decides"]

    def glide(drift: Any, memory: Any, c: Any):
        x = drift * c[0]
        after = type(memory)()
        after[0] = x
        after[1] = memory[1] + memory[10] * (x - memory[0])
        # Only on the backbone is it farther than before.
        after[2] = wp.max(memory[2], x)
        after[3] = wp.max(memory[3], -x)
        after[4] = memory[4] + type(drift)(0.5) * (memory[1] + after[1]) * (x - memory[0])
        after[5] = wp.where(memory[5] == memory[0], x, memory[5])
        after[6] = wp.where(memory[6] == memory[0], x, memory[6])
        after[7] = memory[7]
        after[8] = memory[8]
        after[9] = memory[9]
        after[10] = memory[10]
        return after

    def evolve(drift: Any, memory: Any, c: Any):
        x = drift * c[0]
        now, _slope, way, ahead, released, glides_by, end = step(drift, memory, c)
        is_up = way > type(drift)(0.0)
        after = type(memory)()
        after[0] = x
        after[1] = way * now
        after[2] = wp.where(is_up, ahead, memory[2])
        after[3] = wp.where(is_up, memory[3], ahead)
        after[4] = memory[4] + type(drift)(0.5) * (memory[1] + after[1]) * (x - memory[0])
        after[7] = way
        after[8] = wp.where(is_up, released, memory[8])
        after[9] = wp.where(is_up, memory[9], released)
        # Both sides have been aimed at, and neither has yielded: the line leads both ways.
        one = type(drift)(1.0)
        is_elastic = after[2] == one and after[3] == one and wp.abs(x) < one
        after[5] = wp.where(is_elastic, -one, wp.where(is_up, x, -end))
        after[6] = wp.where(is_elastic, one, wp.where(is_up, end, x))
        after[10] = wp.where(is_elastic, one, glides_by)
        if not decides(drift, memory, c):
            after[5] = wp.where(memory[5] == memory[0], x, memory[5])
            after[6] = wp.where(memory[6] == memory[0], x, memory[6])
            after[10] = memory[10]
        stands = x == memory[0]
        for i in range(11):
            after[i] = wp.where(stands, memory[i], after[i])
        return after

    def recoverable(drift: Any, memory: Any, c: Any):
        farthest = wp.where(memory[1] > type(drift)(0.0), memory[2], memory[3])
        return type(drift)(0.5) * c[1] / c[0] * memory[1] * memory[1] * softer(farthest, c)

    def tangent(drift: Any, increment: Any, before: Any, after: Any, c: Any):
        _now, slope, _way, _ahead, _released, _glides_by, _end = step(drift, before, c)
        return c[0] * c[1] * slope

    def advance(drift: Any, increment: Any, memory: Any, c: Any):
        return evolve(drift, memory, c)

    functions = device_functions(name, force, evolve, glide, recoverable, tangent, advance)
    evolve = functions["evolve"]
    return Spring(
        coefficients=13 if SOFTENS else 12, memory=11, gliding=7, decides=decides, held=kept_force, **functions
    )


SPRINGS = {
    "hysteretic": _hysteretic(False, "hysteretic"),
    "hysteretic_softer_unloading": _hysteretic(True, "hysteretic_softer_unloading"),
}
