"""Four-point backbone with pinching, and with damage (Lowes, Mitra and Altoontash 2003; OpenSees: Pinching4).

Everything is over the yield drift and the yield force, and mirrored so that the storey moves ahead: one set of rules
serves both directions. A storey is on its backbone, or on a path of three straight parts from where it last turned to
the farthest point ahead. The memory: last drift and force; the drift aimed at on a path, 1/2 on the backbone, with the
sign of the direction, and 0 before anything moved; drift and force of the last turn; how far the demands above and
below are beyond yield; slope of the straight part that the storey is on, and the drift at which it ends. Damage adds
loss of stiffness and of strength as of the last turn; loss of stiffness, growth of the drift aimed at and loss of
strength as of when the storey last went beyond its last corner; energy; and where they count, cycles, times four
farthest drifts. Up to that corner a turn works out what damage has come to: nothing asks for it before.

Coefficients: 1 / yield drift, yield force, three lengths and three slopes of the backbone's later parts, ratios of
reloading drift and force, and the forces unloaded to before and after the third corner. Damage adds for stiffness,
reloading and strength each its limit, factors of drift and of energy (or cycles) and their exponents; 1 / last
ductility; 1 / energy that may be spent.
"""

from typing import Any

import warp as wp

from warpdyn.device.exponentials import power_of
from warpdyn.laws.pinching4.backbone_and_paths import SLACK, pinching4_backbone, pinching4_corners, pinching4_release
from warpdyn.laws.row_functions import device_functions, kept_force
from warpdyn.laws.spring import Spring

# The storey is elastic, whatever its direction, until it passes this.
ELASTIC = wp.constant(wp.float64(1e-4))
# Paths aim at yield or farther: anything less tells the backbone from them.
ON_BACKBONE = wp.constant(wp.float64(0.5))
ON_PATH = wp.constant(wp.float64(0.75))
HEADING, SLOPE, END = (wp.constant(m) for m in (2, 7, 8))
STIFFNESS_LOSS, STRENGTH_LOSS, LOSSES, ENERGY, CYCLES = (wp.constant(m) for m in (9, 10, 11, 14, 15))


@wp.func
def pinching4_heading(x: Any, memory: Any):
    """Direction of a step, away from the middle before anything moved, and whether the storey turned to it."""
    zero, one = type(x)(0.0), type(x)(1.0)
    before = wp.where(memory[HEADING] == zero, zero, wp.sign(memory[HEADING]))
    turned = before * (x - memory[0]) < zero
    return wp.where(before == zero, wp.where(x < zero, -one, one), wp.where(turned, -before, before)), turned


@wp.func
def pinching4_loss(first: int, reach: Any, spent: Any, counts: bool, is_exhausted: bool, c: Any):
    """Loss or growth by its coefficients, from the first of them on."""
    lost = c[first + 1] * power_of(reach, c[first + 3])
    more = c[first + 2] * power_of(spent, c[first + 4])
    lost = wp.min(wp.where(counts, lost + more, lost), c[first])
    return wp.where(is_exhausted, c[first], lost)


def _pinching4(damage: str | None) -> Spring:
    """Return the law without damage, or with damage by "energy" or by "cycle"."""
    DAMAGES, BY_CYCLES, name = damage is not None, damage == "cycle", f"pinching4_{damage}_damage"
    M = 16 if BY_CYCLES else 15 if DAMAGES else 9

    def losses(memory: Any, c: Any):
        """Loss of stiffness, growth of the drift aimed at and loss of strength as of the last step."""
        zero, one = type(memory[0])(0.0), type(memory[0])(1.0)
        stored = type(memory[0])(0.5) * memory[1] * memory[1] / (one - memory[STIFFNESS_LOSS])
        above, below = one + memory[5], one + memory[6]
        farthest = wp.max(above, below)
        spent = wp.max(memory[ENERGY] - stored, zero) * c[28]
        counts = memory[ENERGY] > stored
        if BY_CYCLES:
            spent = memory[CYCLES] / (type(memory[0])(4.0) * farthest)
            counts = True
        is_exhausted = memory[ENERGY] * c[28] >= one
        strong, _slope, _end = pinching4_backbone(above, c)
        weak, _steep, _there = pinching4_backbone(below, c)
        secant = (one - memory[STRENGTH_LOSS]) * wp.max(strong / above, weak / below)
        softer = pinching4_loss(12, farthest * c[27], spent, counts, is_exhausted, c)
        softer = wp.min(softer, wp.max(one - secant, zero))  # unloading is no softer than the secant
        growth = pinching4_loss(17, farthest * c[27], spent, counts, is_exhausted, c)
        weaker = pinching4_loss(22, farthest * c[27], spent, counts, is_exhausted, c)
        stands = wp.abs(memory[0]) * c[27] >= one  # beyond the last corner damage waits
        softer = wp.where(stands, memory[LOSSES], softer)
        growth = wp.where(stands, memory[LOSSES + 1], growth)
        return softer, growth, wp.where(stands, memory[LOSSES + 2], weaker)

    losses = device_functions(name, losses)["losses"]

    def decides(drift: Any, memory: Any, c: Any):
        moved = drift * c[0] - memory[0]
        to_end = memory[END] - drift * c[0]
        return moved != type(drift)(0.0) and moved * to_end <= type(drift)(0.0)

    decides = device_functions(name, decides)["decides"]

    def follow(drift: Any, memory: Any, c: Any):
        """Memory after a step to a drift, and the slope there."""
        zero, one = type(drift)(0.0), type(drift)(1.0)
        x = drift * c[0]
        way, turned = pinching4_heading(x, memory)
        is_up = way > zero
        here = way * x
        was_on_path = wp.abs(memory[HEADING]) > type(x)(ON_PATH)
        ahead = one + wp.where(is_up, memory[5], memory[6])
        left = wp.where(is_up, memory[6], memory[5])
        aim = wp.where(turned, ahead, wp.abs(memory[HEADING]))
        # A turn from the backbone is a new demand on the side that the storey leaves.
        demand = wp.max(left, -way * memory[0] - one)
        stiffness, strength = one, one
        if DAMAGES:
            softer, growth, weaker = memory[LOSSES], memory[LOSSES + 1], memory[LOSSES + 2]
            stands = wp.abs(x) * c[27] >= one
            if turned or stands:
                softer, growth, weaker = losses(memory, c)
            aim = wp.where(turned, ahead * (one + growth), aim)
            demand = wp.max(demand, (one + left) * (one + growth) - one)
        demand = wp.where(turned and not was_on_path, demand, left)
        on_backbone = here > aim or not (turned or was_on_path)
        renews = turned and not (was_on_path and on_backbone)
        if DAMAGES:
            stiffness_loss = wp.where(renews, softer, memory[STIFFNESS_LOSS])
            strength_loss = wp.where(renews, weaker, memory[STRENGTH_LOSS])
            stiffness, strength = one - stiffness_loss, one - strength_loss
        target, _slope, _end = pinching4_backbone(aim, c)
        x_turn = wp.where(turned, memory[0], memory[3])
        f_turn = wp.where(turned, memory[1], memory[4])
        x0, f0 = way * x_turn, way * f_turn
        low = strength * wp.where(ahead > one + c[2] + c[3], c[11], c[10])
        top = strength * target
        x1, f1, x2, f2 = pinching4_corners(x0, f0, aim, top, low, stiffness, is_up, c)
        is_first = here < x1
        is_last = here >= x2
        xa = wp.where(is_first, x0, wp.where(is_last, x2, x1))
        fa = wp.where(is_first, f0, wp.where(is_last, f2, f1))
        end = wp.where(is_last, aim, wp.where(is_first, x1, x2))
        length = end - xa
        slope = (wp.where(is_last, top, wp.where(is_first, f1, f2)) - fa) / wp.where(length == zero, one, length)
        force = fa + (here - xa) * slope
        full, steep, corner = pinching4_backbone(here, c)
        force = wp.where(on_backbone, strength * full, force)
        slope = wp.where(on_backbone, strength * steep, slope)
        end = wp.where(on_backbone, corner, end)
        # Whatever the path, no step is stiffer than the first one: one that lags goes that way until it has caught up.
        steepest = way * memory[1] + (here - way * memory[0])
        lags = force > steepest
        behind = (force - steepest) / wp.where(slope < one, one - slope, one)
        end = wp.where(lags and slope < one, wp.min(end, here + behind), end)
        slope = wp.where(lags, one, slope)
        force = wp.min(force, steepest)
        is_elastic = memory[HEADING] == zero and here <= type(x)(ELASTIC)
        if DAMAGES:
            # A part ends where damage begins to wait: just before it, whatever the rounding.
            last = (one - type(x)(SLACK)) / c[27]
            end = wp.where(here < last, wp.min(end, last), wp.where(stands, end, here))
        after = type(memory)()
        after[0] = x
        after[1] = way * force
        after[HEADING] = wp.where(is_elastic, zero, way * wp.where(on_backbone, type(x)(ON_BACKBONE), aim))
        after[3] = x_turn
        after[4] = f_turn
        after[5] = wp.where(is_up, memory[5], demand)
        after[6] = wp.where(is_up, demand, memory[6])
        # Who glides keeps these two: rounding must not tell the ways apart.
        is_new = decides(drift, memory, c)
        after[SLOPE] = wp.where(is_new, wp.min(slope, one), memory[SLOPE])
        after[END] = wp.where(is_new, wp.where(is_elastic, x, way * end), memory[END])
        if DAMAGES:
            waits = stands and memory[HEADING] != zero
            after[STIFFNESS_LOSS] = stiffness_loss
            after[STRENGTH_LOSS] = strength_loss
            after[LOSSES] = wp.where(waits, softer, memory[LOSSES])
            after[LOSSES + 1] = wp.where(waits, growth, memory[LOSSES + 1])
            after[LOSSES + 2] = wp.where(waits, weaker, memory[LOSSES + 2])
            after[ENERGY] = memory[ENERGY] + type(x)(0.5) * (memory[1] + after[1]) * (x - memory[0])
            if BY_CYCLES:
                farther = wp.max(one + after[5], one + after[6]) / wp.max(one + memory[5], one + memory[6])
                after[CYCLES] = memory[CYCLES] * farther + wp.abs(x - memory[0])
        return after, slope

    follow = device_functions(name, follow)["follow"]

    def force(drift: Any, memory: Any, c: Any):
        after, _slope = follow(drift, memory, c)
        return c[1] * after[1]

    def evolve(drift: Any, memory: Any, c: Any):
        after, _slope = follow(drift, memory, c)
        return after

    def glide(drift: Any, memory: Any, c: Any):
        after = type(memory)()
        for m in range(M):
            after[m] = memory[m]
        moved = drift * c[0] - memory[0]
        after[0] = drift * c[0]
        after[1] = memory[1] + memory[SLOPE] * moved
        if DAMAGES:
            after[ENERGY] = memory[ENERGY] + type(drift)(0.5) * (memory[1] + after[1]) * moved
            if BY_CYCLES:
                after[CYCLES] = memory[CYCLES] + wp.abs(moved)
        return after

    def recoverable(drift: Any, memory: Any, c: Any):
        # What the path gives back that the storey is on, if it unloads, or else the path if it turned now.
        zero, one = type(drift)(0.0), type(drift)(1.0)
        way = wp.where(memory[1] > zero, -one, one)
        is_up = way > zero
        unloads = way * memory[HEADING] > type(drift)(ON_PATH)
        ahead = one + wp.where(is_up, memory[5], memory[6])
        aim, stiffness, strength = ahead, one, one
        if DAMAGES:
            softer, growth, weaker = losses(memory, c)
            aim = wp.where(unloads, way * memory[HEADING], ahead * (one + growth))
            stiffness = one - wp.where(unloads, memory[STIFFNESS_LOSS], softer)
            strength = one - wp.where(unloads, memory[STRENGTH_LOSS], weaker)
        target, _slope, _end = pinching4_backbone(aim, c)
        here, end = way * memory[0], strength * target
        x0 = wp.where(unloads, way * memory[3], here)
        f0 = way * wp.where(unloads, memory[4], memory[1])
        low = strength * wp.where(ahead > one + c[2] + c[3], c[11], c[10])
        x1, f1, x2, f2 = pinching4_corners(x0, f0, aim, end, low, stiffness, is_up, c)
        energy = pinching4_release(here, x0, f0, x1, f1) + pinching4_release(here, x1, f1, x2, f2)
        return c[1] / c[0] * (energy + pinching4_release(here, x2, f2, aim, end))

    def tangent(drift: Any, increment: Any, before: Any, after: Any, c: Any):
        _after, slope = follow(drift, before, c)
        return c[0] * c[1] * slope

    def advance(drift: Any, increment: Any, memory: Any, c: Any):
        after, _slope = follow(drift, memory, c)
        return after

    functions = device_functions(name, force, evolve, recoverable, tangent, advance, glide)
    return Spring(coefficients=29 if DAMAGES else 12, memory=M, decides=decides, held=kept_force, **functions)


SPRINGS = {
    "pinching4": _pinching4(None),
    "pinching4_energy_damage": _pinching4("energy"),
    "pinching4_cycle_damage": _pinching4("cycle"),
}
