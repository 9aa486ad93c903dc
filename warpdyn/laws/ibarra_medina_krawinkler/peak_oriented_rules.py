"""The laws of Ibarra, Medina and Krawinkler (2005) that reload towards peaks, by the rules of OpenSees' materials.

IMKPeakOriented: once the force has changed its sign the storey goes for the last peak of that side if the way there is
steeper, else for the farthest one. IMKPinching: it first goes for a point that lies lower. Whenever the force changes
its sign towards a side, that side's backbone deteriorates and its farthest peak moves on.

The memory: what the family's has in common; the branch, signed by its side; for either side what the yield force and
the capping line have lost as shares, the drifts of the farthest peak and of the last one, and the last one's force;
with pinching, the pinching point of the present side. The force of the farthest peak is the backbone's.
"""

from collections.abc import Callable
from typing import Any

import warp as wp

from warpdyn.laws.ibarra_medina_krawinkler.deterioration import SMALLEST, energy_rules, on_lines, spring_of
from warpdyn.laws.spring import Spring

BRANCH = wp.constant(5)
SIDES = wp.constant(6)  # five values each: losses of yield force and capping line, farthest peak, last peak, its force
PINCH = wp.constant(16)  # drift and force
ELASTIC, UNLOADING, TO_PINCH, TO_LAST, TO_FARTHEST, ON_BACKBONE, FAILED = (
    wp.constant(wp.float64(branch)) for branch in range(7)
)


# Peaks are kept as they are: an offset's rounding would tell apart what is the same. 0 stands for first yield, at 1.
@wp.func
def recalled(value: Any):
    return wp.where(value == type(value)(0.0), type(value)(1.0), value)


@wp.func
def kept(value: Any):
    return wp.where(value == type(value)(0.0), type(value)(SMALLEST), value)


def _law(name: str, PINCHES: bool, POWERS: bool) -> Spring:
    """Return the law, with or without pinching; without powers its exponent of deterioration is 1."""
    deterioration, after_turning = energy_rules(POWERS)
    memory_values, coefficients = (18, 14) if PINCHES else (16, 12)
    EXPONENT = wp.constant(coefficients)

    def decides(drift: Any, memory: Any, c: Any):
        zero = type(drift)(0.0)
        elastic, unloading, failed = type(drift)(ELASTIC), type(drift)(UNLOADING), type(drift)(FAILED)
        to_pinch, to_last, to_farthest = type(drift)(TO_PINCH), type(drift)(TO_LAST), type(drift)(TO_FARTHEST)
        u = drift * c[0]
        up = u > memory[0]
        side = wp.where(up, type(drift)(1.0), -type(drift)(1.0))
        x = side * u
        f_before = side * memory[1]
        way = side * memory[BRANCH]
        x_last = recalled(wp.where(up, memory[SIDES + 3], memory[SIDES + 8]))
        branch = wp.abs(way)
        crosses = f_before <= zero and f_before + (type(drift)(1.0) - memory[2]) * (x - side * memory[0]) >= zero
        passes = branch == elastic and x > type(drift)(1.0)
        passes = passes or (branch == unloading and (crosses or (f_before > zero and x > x_last)))
        passes = passes or (way == to_last and x > x_last)
        farthest = recalled(wp.where(up, memory[SIDES + 2], memory[SIDES + 7]))
        passes = passes or (way == to_farthest and x > farthest)
        if PINCHES:
            passes = passes or (way == to_pinch and x > memory[PINCH])
        turns = way <= -to_pinch and way > -failed
        return u != memory[0] and (turns or passes)

    def following(DECIDES: bool) -> Callable:
        """Return the function that follows the path, of all storeys or of those that decide nothing."""

        def follow(drift: Any, memory: Any, c: Any):
            zero = type(drift)(0.0)
            one = type(drift)(1.0)
            exponent = one
            if POWERS:
                exponent = c[EXPONENT]
            # Warp sets a constant where it is first read: inside a branch, it would not be set for what comes after.
            elastic = type(drift)(ELASTIC)
            unloading = type(drift)(UNLOADING)
            on_backbone = type(drift)(ON_BACKBONE)
            failed = type(drift)(FAILED)
            to_pinch = type(drift)(TO_PINCH)
            to_last = type(drift)(TO_LAST)
            to_farthest = type(drift)(TO_FARTHEST)
            # All of a step is seen from the side that the storey moves to.
            u = drift * c[0]
            moving = u != memory[0]
            up = u > memory[0] or (u == memory[0] and memory[BRANCH] >= zero)
            side = wp.where(up, one, -one)
            x = side * u
            x_before = side * memory[0]
            f_before = side * memory[1]
            strength_loss = wp.where(up, memory[SIDES], memory[SIDES + 5])
            capping_loss = wp.where(up, memory[SIDES + 1], memory[SIDES + 6])
            farthest = recalled(wp.where(up, memory[SIDES + 2], memory[SIDES + 7]))
            x_last = recalled(wp.where(up, memory[SIDES + 3], memory[SIDES + 8]))
            f_last = recalled(wp.where(up, memory[SIDES + 4], memory[SIDES + 9]))
            other_farthest = recalled(wp.where(up, memory[SIDES + 7], memory[SIDES + 2]))
            other_x_last = recalled(wp.where(up, memory[SIDES + 8], memory[SIDES + 3]))
            other_f_last = recalled(wp.where(up, memory[SIDES + 9], memory[SIDES + 4]))
            x_pinch = zero
            f_pinch = zero
            if PINCHES:
                x_pinch = memory[PINCH]
                f_pinch = memory[PINCH + 1]
            stiffness_loss = memory[2]
            energy = memory[3]
            energy_before = memory[4]
            way = side * memory[BRANCH]
            fails = wp.abs(way) == failed
            branch = wp.abs(way)
            if DECIDES:
                if way <= -to_pinch and not fails:
                    branch = unloading
                    other_x_last = -x_before
                    other_f_last = -f_before
                    other_farthest = wp.max(other_farthest, other_x_last)
                    stiffness, fails = after_turning(f_before, one - stiffness_loss, energy, energy_before, exponent, c)
                    stiffness_loss = one - stiffness
            stiffness = wp.max(one - stiffness_loss, type(drift)(SMALLEST))
            unloaded = f_before + stiffness * (x - x_before)
            if not DECIDES:
                # What rounding alone takes past no force crosses it in the next step.
                unloaded = wp.where(f_before <= zero, wp.min(unloaded, zero), unloaded)
            # Where the line of a branch begins, and where the storey begins to load along it.
            x_from = x_before
            f_from = f_before
            if DECIDES:
                starts = moving and branch == unloading and f_before <= zero and unloaded >= zero
                if starts:
                    spent = wp.max(energy - energy_before, zero)
                    fails = fails or spent > c[7] - energy or spent > c[8] - energy or spent > c[11] - energy
                    strength_loss += (one - strength_loss) * c[10] * deterioration(spent, c[7] - energy, exponent)
                    capping_loss += (one - capping_loss) * c[10] * deterioration(spent, c[8] - energy, exponent)
                    farthest += farthest * c[10] * deterioration(spent, c[11] - energy, exponent)
                    energy_before = energy
                    x_from = x_before - f_before / stiffness
                    f_from = zero
            x_loading = x_from
            f_loading = f_from
            strength = one - strength_loss
            slope = c[2] * strength
            capping = c[4] * (one - capping_loss)
            intercept = strength - slope * strength
            f_farthest, _ = on_lines(farthest, intercept, slope, capping, c[3], c[5])
            if DECIDES:
                if starts:
                    fails = fails or f_farthest <= zero
                    is_steeper = x_from < x_last and f_last < f_farthest
                    is_steeper = is_steeper and f_last * (farthest - x_from) > f_farthest * (x_last - x_from)
                    branch = wp.where(is_steeper, to_last, to_farthest)
                    if PINCHES:
                        x_pinch = c[13] * (farthest - f_farthest / stiffness)
                        f_pinch = c[12] * f_farthest * (x_pinch - x_from) / (farthest - x_from)
                        branch = wp.where(x_from < x_pinch, to_pinch, branch)
                if branch == elastic and x > one:
                    branch = on_backbone
                if branch == unloading and f_before > zero and x > x_last:
                    branch = to_farthest
                    x_from = x_last
                    f_from = f_last
                    if PINCHES:
                        is_ahead = x_last < x_pinch and f_last < f_pinch and x_pinch < farthest and f_pinch < f_farthest
                        to_it = (f_pinch - f_last) * (farthest - x_last)
                        if is_ahead and to_it < (f_farthest - f_last) * (x_pinch - x_last):
                            branch = to_pinch
                if PINCHES:
                    if branch == to_pinch and x > x_pinch:
                        is_steeper = x_pinch < x_last and f_pinch < f_last and f_last < f_farthest
                        to_it = (f_last - f_pinch) * (farthest - x_pinch)
                        is_steeper = is_steeper and to_it > (f_farthest - f_pinch) * (x_last - x_pinch)
                        branch = wp.where(is_steeper, to_last, to_farthest)
                        x_from = x_pinch
                        f_from = f_pinch
                if branch == to_last and x > x_last:
                    branch = to_farthest
                    x_from = x_last
                    f_from = f_last
                if branch == to_farthest and x > farthest:
                    branch = on_backbone
            x_to = wp.where(branch == to_last, x_last, farthest)
            f_to = wp.where(branch == to_last, f_last, f_farthest)
            if PINCHES:
                x_to = wp.where(branch == to_pinch, x_pinch, x_to)
                f_to = wp.where(branch == to_pinch, f_pinch, f_to)
            tangent = (f_to - f_from) / wp.max(x_to - x_from, type(drift)(SMALLEST))
            force = f_to - tangent * (x_to - x)
            if branch == on_backbone:
                force, tangent = on_lines(x, intercept, slope, capping, c[3], c[5])
            steepest = f_loading + (x - x_loading)
            if force > steepest:
                force = steepest
                tangent = one
            if branch <= unloading:
                force = wp.where(branch == elastic, x, unloaded)
                tangent = stiffness
            if not moving:
                force = f_before
            fails = fails or (moving and x >= c[6]) or (branch == on_backbone and force <= zero)
            if fails:
                branch = failed
                force = zero
                tangent = zero
            after = type(memory)()
            after[0] = u
            after[1] = side * force
            after[2] = stiffness_loss
            after[3] = energy + type(drift)(0.5) * (force + f_before) * (x - x_before)
            after[4] = energy_before
            after[BRANCH] = wp.where(branch <= unloading, branch, side * branch)
            after[SIDES] = wp.where(up, strength_loss, memory[SIDES])
            after[SIDES + 1] = wp.where(up, capping_loss, memory[SIDES + 1])
            after[SIDES + 2] = kept(wp.where(up, farthest, other_farthest))
            after[SIDES + 3] = kept(wp.where(up, x_last, other_x_last))
            after[SIDES + 4] = kept(wp.where(up, f_last, other_f_last))
            after[SIDES + 5] = wp.where(up, memory[SIDES + 5], strength_loss)
            after[SIDES + 6] = wp.where(up, memory[SIDES + 6], capping_loss)
            after[SIDES + 7] = kept(wp.where(up, other_farthest, farthest))
            after[SIDES + 8] = kept(wp.where(up, other_x_last, x_last))
            after[SIDES + 9] = kept(wp.where(up, other_f_last, f_last))
            if PINCHES:
                after[PINCH] = x_pinch
                after[PINCH + 1] = f_pinch
            return after, tangent

        return follow

    def unloading(memory: Any, c: Any):
        one = type(memory[0])(1.0)
        stiffness = one - memory[2]
        exponent = one
        if POWERS:
            exponent = c[EXPONENT]
        holds = bool(True)
        if wp.abs(memory[BRANCH]) >= type(memory[0])(TO_PINCH):
            stiffness, fails = after_turning(memory[1], stiffness, memory[3], memory[4], exponent, c)
            holds = not fails
        return stiffness, holds

    return spring_of(
        name, following(True), following(False), decides, unloading, memory_values, SIDES, coefficients + POWERS
    )


SPRINGS = {
    "ibarra_medina_krawinkler_peak_oriented": _law("imk_peak_oriented", False, False),
    "ibarra_medina_krawinkler_peak_oriented_power": _law("imk_peak_oriented_power", False, True),
    "ibarra_medina_krawinkler_pinching": _law("imk_pinching", True, False),
    "ibarra_medina_krawinkler_pinching_power": _law("imk_pinching_power", True, True),
}
