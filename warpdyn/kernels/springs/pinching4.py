"""Four-point backbone with pinching, and with damage (Lowes, Mitra and Altoontash 2003; OpenSees: Pinching4).

Everything is over the yield drift and the yield force, and mirrored so that the storey moves ahead: one set of rules
serves both directions. A storey is on its backbone, or on a path of three straight parts from where it last turned to
the farthest point ahead. The memory: last drift and force; the state, 0 before anything moved, 1 on the backbone and 2
on a path, with the sign of the direction; drift and force of the last turn; and how far the demands above and below
are beyond yield. Damage adds the drift aimed at; loss of stiffness and of strength as of the last turn; loss of
stiffness, growth of the drift aimed at and loss of strength up to now; energy; and where they count, cycles.

Coefficients: 1 / yield drift, yield force, three lengths and three slopes of the backbone's later parts, ratios of
reloading drift and force, and the forces unloaded to before and after the third corner. Damage adds for stiffness,
reloading and strength each its limit, factors of drift and of energy (or cycles) and their exponents; 1 / last
ductility; 1 / energy that may be spent.
"""

from typing import Any

import warp as wp

from warpdyn.kernels.exponentials import power_of
from warpdyn.kernels.springs.named import device_functions
from warpdyn.kernels.springs.pinching4_path import pinching4_backbone, pinching4_corners, pinching4_release
from warpdyn.kernels.springs.spring import Spring

# The storey is elastic, whatever its direction, until it passes this.
ELASTIC = wp.constant(wp.float64(1e-4))


@wp.func
def pinching4_heading(x: Any, memory: Any):
    """Direction of a step, away from the middle before anything moved, and whether the storey turned to it."""
    zero, one = type(x)(0.0), type(x)(1.0)
    before = wp.where(memory[2] == zero, zero, wp.sign(memory[2]))
    turned = before * (x - memory[0]) < zero
    return wp.where(before == zero, wp.where(x < zero, -one, one), wp.where(turned, -before, before)), turned


def _pinching4(damage: str | None) -> Spring:
    """Return the law without damage, or with damage by "energy" or by "cycle"."""
    DAMAGES, BY_CYCLES, name = damage is not None, damage == "cycle", f"pinching4_{damage}_damage"

    def step(x: Any, memory: Any, c: Any):
        """Where a step to a drift leads: (force, slope, state, whether the turn renews the loss of stiffness)."""
        zero, one = type(x)(0.0), type(x)(1.0)
        way, turned = pinching4_heading(x, memory)
        is_up = way > zero
        here = way * x
        was_on_path = wp.abs(memory[2]) > type(x)(1.5)
        ahead = one + wp.where(is_up, memory[5], memory[6])
        aim, stiffness, strength = ahead, one, one
        if DAMAGES:
            aim = wp.where(turned, ahead * (one + memory[11]), memory[7])
        on_backbone = here > aim or not (turned or was_on_path)
        renews = turned and not (was_on_path and on_backbone)
        if DAMAGES:
            stiffness = one - wp.where(renews, memory[10], memory[8])
            strength = one - wp.where(renews, memory[12], memory[9])
        target, _slope = pinching4_backbone(aim, c)
        x0 = way * wp.where(turned, memory[0], memory[3])
        f0 = way * wp.where(turned, memory[1], memory[4])
        low = strength * wp.where(ahead > one + c[2] + c[3], c[11], c[10])
        end = strength * target
        x1, f1, x2, f2 = pinching4_corners(x0, f0, aim, end, low, stiffness, is_up, c)
        is_first = here < x1
        is_last = here >= x2
        xa = wp.where(is_first, x0, wp.where(is_last, x2, x1))
        fa = wp.where(is_first, f0, wp.where(is_last, f2, f1))
        length = wp.where(is_last, aim, wp.where(is_first, x1, x2)) - xa
        slope = (wp.where(is_last, end, wp.where(is_first, f1, f2)) - fa) / wp.where(length == zero, one, length)
        force = fa + (here - xa) * slope
        full, steep = pinching4_backbone(here, c)
        force = wp.where(on_backbone, strength * full, force)
        slope = wp.where(on_backbone, strength * steep, slope)
        # Whatever the path, no step is stiffer than the first one.
        steepest = way * memory[1] + (here - way * memory[0])
        slope = wp.where(force > steepest, one, slope)
        force = wp.min(force, steepest)
        state = wp.where(on_backbone, way, way + way)
        is_elastic = memory[2] == zero and here <= type(x)(ELASTIC)
        return way * force, slope, wp.where(is_elastic, zero, state), renews

    def force(drift: Any, memory: Any, c: Any):
        now, _slope, _state, _renews = step(drift * c[0], memory, c)
        return c[1] * now

    def held(drift: Any, memory: Any, c: Any):
        return c[1] * memory[1]

    def evolve(drift: Any, memory: Any, c: Any):
        zero, one = type(drift)(0.0), type(drift)(1.0)
        x = drift * c[0]
        now, _slope, state, renews = step(x, memory, c)
        way, turned = pinching4_heading(x, memory)
        is_up = way > zero
        after = type(memory)()
        after[0] = x
        after[1] = now
        after[2] = state
        after[3] = wp.where(turned, memory[0], memory[3])
        after[4] = wp.where(turned, memory[1], memory[4])
        # A turn from the backbone is a new demand on the side that the storey leaves.
        left = wp.where(is_up, memory[6], memory[5])
        demand = wp.max(left, -way * memory[0] - one)
        if DAMAGES:
            demand = wp.max(demand, (one + left) * (one + memory[11]) - one)
        demand = wp.where(turned and wp.abs(memory[2]) < type(drift)(1.5), demand, left)
        after[5] = wp.where(is_up, memory[5], demand)
        after[6] = wp.where(is_up, demand, memory[6])
        if DAMAGES:
            after[7] = wp.where(turned, (one + wp.where(is_up, memory[5], memory[6])) * (one + memory[11]), memory[7])
            after[8] = wp.where(renews, memory[10], memory[8])
            after[9] = wp.where(renews, memory[12], memory[9])
            after[13] = memory[13] + type(drift)(0.5) * (memory[1] + now) * (x - memory[0])
            stored = type(drift)(0.5) * now * now / (one - after[8])
            above, below = one + after[5], one + after[6]
            farthest = wp.max(above, below)
            spent = wp.max(after[13] - stored, zero) * c[28]
            counts = after[13] > stored
            if BY_CYCLES:
                after[14] = memory[14] + wp.abs(x - memory[0]) / (type(drift)(4.0) * farthest)
                spent = after[14]
                counts = True
            is_exhausted = after[13] * c[28] >= one
            reach = farthest * c[27]
            strong, _slope = pinching4_backbone(above, c)
            weak, _steep = pinching4_backbone(below, c)
            secant = (one - after[9]) * wp.max(strong / above, weak / below)
            stands = wp.abs(x) * c[27] >= one  # beyond the last corner damage waits
            for kind in range(3):
                limit = c[12 + 5 * kind]
                lost = c[13 + 5 * kind] * power_of(reach, c[15 + 5 * kind])
                more = c[14 + 5 * kind] * power_of(spent, c[16 + 5 * kind])
                lost = wp.min(wp.where(counts, lost + more, lost), limit)
                lost = wp.where(is_exhausted, limit, lost)
                if kind == 0:
                    lost = wp.min(lost, wp.max(one - secant, zero))  # unloading is no softer than the secant
                after[10 + kind] = wp.where(stands, memory[10 + kind], lost)
        return after

    def recoverable(drift: Any, memory: Any, c: Any):
        # What the path gives back that the storey is on, if it unloads, or else the path if it turned now.
        zero, one = type(drift)(0.0), type(drift)(1.0)
        way = wp.where(memory[1] > zero, -one, one)
        is_up = way > zero
        unloads = way * memory[2] > type(drift)(1.5)
        ahead = one + wp.where(is_up, memory[5], memory[6])
        aim, stiffness, strength = ahead, one, one
        if DAMAGES:
            aim = wp.where(unloads, memory[7], ahead * (one + memory[11]))
            stiffness = one - wp.where(unloads, memory[8], memory[10])
            strength = one - wp.where(unloads, memory[9], memory[12])
        target, _slope = pinching4_backbone(aim, c)
        here, end = way * memory[0], strength * target
        x0 = wp.where(unloads, way * memory[3], here)
        f0 = way * wp.where(unloads, memory[4], memory[1])
        low = strength * wp.where(ahead > one + c[2] + c[3], c[11], c[10])
        x1, f1, x2, f2 = pinching4_corners(x0, f0, aim, end, low, stiffness, is_up, c)
        energy = pinching4_release(here, x0, f0, x1, f1) + pinching4_release(here, x1, f1, x2, f2)
        return c[1] / c[0] * (energy + pinching4_release(here, x2, f2, aim, end))

    def tangent(drift: Any, increment: Any, before: Any, after: Any, c: Any):
        _now, slope, _state, _renews = step(drift * c[0], before, c)
        return c[0] * c[1] * slope

    def advance(drift: Any, increment: Any, memory: Any, c: Any):
        return evolve(drift, memory, c)

    step = device_functions(name, step)["step"]
    functions = device_functions(name, force, held, evolve, recoverable, tangent, advance)
    evolve = functions["evolve"]
    memory = 15 if BY_CYCLES else 14 if DAMAGES else 7
    return Spring(coefficients=29 if DAMAGES else 12, memory=memory, **functions)


PINCHING4 = _pinching4(None)
PINCHING4_ENERGY = _pinching4("energy")
PINCHING4_CYCLE = _pinching4("cycle")
