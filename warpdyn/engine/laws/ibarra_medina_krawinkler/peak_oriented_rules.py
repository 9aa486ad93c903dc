"""Device functions of the laws of Ibarra, Medina and Krawinkler (2005) that reload towards peaks, as in OpenSees.

IMKPeakOriented: when the force has changed its sign, the storey reloads towards the last peak or the farthest peak of
the new side; it chooses the peak with the steeper line. IMKPinching: the storey first reloads towards a lower point,
the pinching point. Each time the force changes its sign, the backbone of the new side deteriorates, and the drift of
its farthest peak increases. The force at the farthest peak is the force of the backbone there.
"""

import enum
from collections.abc import Callable
from typing import Any

import warp as wp

from warpdyn.engine.device.extrema import maximum, minimum
from warpdyn.engine.laws.ibarra_medina_krawinkler.deterioration import (
    SMALLEST,
    energy_rules,
    on_lines,
    side_rules,
    spring_of,
)
from warpdyn.engine.laws.ibarra_medina_krawinkler.parameters import (
    Coefficient as C,
    IbarraMedinaKrawinklerPeakOriented,
    IbarraMedinaKrawinklerPinching,
    row_of,
)
from warpdyn.engine.laws.law import Layout
from warpdyn.engine.laws.spring import Spring

ELASTIC, UNLOADING, TO_PINCH, TO_LAST, TO_FARTHEST, ON_BACKBONE, FAILED = (
    wp.constant(wp.float64(branch)) for branch in range(7)
)


class M(Layout):
    """Memory of a storey: the history variables that its law keeps from step to step; those of `Common` come first.

    Drifts and forces are divided by the yield drift and yield force of the positive side. The last two variables exist
    only with pinching.
    """

    DRIFT = enum.auto()
    FORCE = enum.auto()
    STIFFNESS_LOSS = enum.auto()
    ENERGY = enum.auto()
    ENERGY_BEFORE = enum.auto()
    BRANCH = enum.auto()  # number of the branch (ELASTIC to FAILED); negative on the negative side
    STRENGTH_LOSS_ABOVE = enum.auto()  # loss of the yield force of the positive side
    CAPPING_LOSS_ABOVE = enum.auto()
    FARTHEST_ABOVE = enum.auto()  # drift of the farthest peak
    LAST_DRIFT_ABOVE = enum.auto()  # drift of the last peak on the positive side
    LAST_FORCE_ABOVE = enum.auto()
    STRENGTH_LOSS_BELOW = enum.auto()
    CAPPING_LOSS_BELOW = enum.auto()
    FARTHEST_BELOW = enum.auto()
    LAST_DRIFT_BELOW = enum.auto()
    LAST_FORCE_BELOW = enum.auto()
    PINCHING_DRIFT = enum.auto()  # drift of the pinching point of the present side
    PINCHING_FORCE = enum.auto()


# Peaks are stored without subtracting the yield drift, which would make equal peaks differ by rounding. 0 means that
# the peak is the first yield point.
@wp.func
def recalled(value: Any, yields: Any):
    return wp.where(value == type(value)(0.0), yields, value)


@wp.func
def kept(value: Any):
    return wp.where(value == type(value)(0.0), type(value)(SMALLEST), value)


def _law(name: str, PINCHES: bool, POWERS: bool, ASYMMETRIC: bool = False) -> Spring:
    """Return the device functions of a variant of the law.

    PINCHES is True if the law pinches, POWERS is False if the exponent of deterioration is 1, and ASYMMETRIC is True if
    the backbones of the two sides differ.
    """
    deterioration, after_turning = energy_rules(POWERS)
    law = IbarraMedinaKrawinklerPinching if PINCHES else IbarraMedinaKrawinklerPeakOriented
    names, exponent, first_negative = row_of(law, POWERS, ASYMMETRIC)
    EXPONENT = wp.constant(exponent)
    of_side = side_rules(name, first_negative)
    values = len(M) if PINCHES else int(M.PINCHING_DRIFT)

    def leaves_line(drift: Any, memory: Any, c: Any):
        zero = type(drift)(0.0)
        elastic, unloading, failed = type(drift)(ELASTIC), type(drift)(UNLOADING), type(drift)(FAILED)
        to_pinch, to_last, to_farthest = type(drift)(TO_PINCH), type(drift)(TO_LAST), type(drift)(TO_FARTHEST)
        u = drift * c[C.INVERSE_YIELD_DRIFT]
        up = u > memory[M.DRIFT]
        side = wp.where(up, type(drift)(1.0), -type(drift)(1.0))
        x = side * u
        f_before = side * memory[M.FORCE]
        way = side * memory[M.BRANCH]
        yields, _hardening, _falling, _height, _residual, _ultimate, _rate = of_side(up, c)
        x_last = recalled(wp.where(up, memory[M.LAST_DRIFT_ABOVE], memory[M.LAST_DRIFT_BELOW]), yields)
        branch = wp.abs(way)
        crosses = (
            f_before <= zero
            and f_before + (type(drift)(1.0) - memory[M.STIFFNESS_LOSS]) * (x - side * memory[M.DRIFT]) >= zero
        )
        passes = branch == elastic and x > yields
        passes = passes or (branch == unloading and (crosses or (f_before > zero and x > x_last)))
        passes = passes or (way == to_last and x > x_last)
        farthest = recalled(wp.where(up, memory[M.FARTHEST_ABOVE], memory[M.FARTHEST_BELOW]), yields)
        passes = passes or (way == to_farthest and x > farthest)
        if PINCHES:
            passes = passes or (way == to_pinch and x > memory[M.PINCHING_DRIFT])
        turns = way <= -to_pinch and way > -failed
        return u != memory[M.DRIFT] and (turns or passes)

    def following(BY_RULES: bool) -> Callable:
        """Return the device function for a step: by all rules, or only for storeys that stay on their line."""

        def follow(drift: Any, memory: Any, c: Any):
            zero = type(drift)(0.0)
            one = type(drift)(1.0)
            exponent = one
            if POWERS:
                exponent = c[EXPONENT]
            # Warp defines a constant where it is first used. In a branch, it would be undefined after the branch.
            elastic = type(drift)(ELASTIC)
            unloading = type(drift)(UNLOADING)
            on_backbone = type(drift)(ON_BACKBONE)
            failed = type(drift)(FAILED)
            to_pinch = type(drift)(TO_PINCH)
            to_last = type(drift)(TO_LAST)
            to_farthest = type(drift)(TO_FARTHEST)
            # Drifts and forces of this step are positive on the side towards which the storey moves.
            u = drift * c[C.INVERSE_YIELD_DRIFT]
            moving = u != memory[M.DRIFT]
            up = u > memory[M.DRIFT] or (u == memory[M.DRIFT] and memory[M.BRANCH] >= zero)
            side = wp.where(up, one, -one)
            x = side * u
            x_before = side * memory[M.DRIFT]
            f_before = side * memory[M.FORCE]
            strength_loss = wp.where(up, memory[M.STRENGTH_LOSS_ABOVE], memory[M.STRENGTH_LOSS_BELOW])
            capping_loss = wp.where(up, memory[M.CAPPING_LOSS_ABOVE], memory[M.CAPPING_LOSS_BELOW])
            yields, hardening, falling, height, residual, ultimate, rate = of_side(up, c)
            other_yields = one
            if ASYMMETRIC:
                other_yields, _o1, _o2, _o3, _o4, _o5, _o6 = of_side(not up, c)
            farthest = recalled(wp.where(up, memory[M.FARTHEST_ABOVE], memory[M.FARTHEST_BELOW]), yields)
            x_last = recalled(wp.where(up, memory[M.LAST_DRIFT_ABOVE], memory[M.LAST_DRIFT_BELOW]), yields)
            f_last = recalled(wp.where(up, memory[M.LAST_FORCE_ABOVE], memory[M.LAST_FORCE_BELOW]), yields)
            other_farthest = recalled(wp.where(up, memory[M.FARTHEST_BELOW], memory[M.FARTHEST_ABOVE]), other_yields)
            other_x_last = recalled(wp.where(up, memory[M.LAST_DRIFT_BELOW], memory[M.LAST_DRIFT_ABOVE]), other_yields)
            other_f_last = recalled(wp.where(up, memory[M.LAST_FORCE_BELOW], memory[M.LAST_FORCE_ABOVE]), other_yields)
            x_pinch = zero
            f_pinch = zero
            if PINCHES:
                x_pinch = memory[M.PINCHING_DRIFT]
                f_pinch = memory[M.PINCHING_FORCE]
            stiffness_loss = memory[M.STIFFNESS_LOSS]
            energy = memory[M.ENERGY]
            energy_before = memory[M.ENERGY_BEFORE]
            way = side * memory[M.BRANCH]
            fails = wp.abs(way) == failed
            branch = wp.abs(way)
            if BY_RULES:
                if way <= -to_pinch and not fails:
                    branch = unloading
                    other_x_last = -x_before
                    other_f_last = -f_before
                    other_farthest = maximum(other_farthest, other_x_last)
                    stiffness, fails = after_turning(f_before, one - stiffness_loss, energy, energy_before, exponent, c)
                    stiffness_loss = one - stiffness
            stiffness = maximum(one - stiffness_loss, type(drift)(SMALLEST))
            unloaded = f_before + stiffness * (x - x_before)
            if not BY_RULES:
                # A force that passes zero by rounding alone crosses zero in the next step.
                unloaded = wp.where(f_before <= zero, minimum(unloaded, zero), unloaded)
            # (x_from, f_from): first point of the line of this step. If reloading starts in this step, it is the point
            # at which the unloading line reaches zero force.
            x_from = x_before
            f_from = f_before
            if BY_RULES:
                starts = moving and branch == unloading and f_before <= zero and unloaded >= zero
                if starts:
                    spent = maximum(energy - energy_before, zero)
                    fails = (
                        fails
                        or spent > c[C.STRENGTH_CAPACITY] - energy
                        or spent > c[C.CAPPING_CAPACITY] - energy
                        or spent > c[C.RELOADING_CAPACITY] - energy
                    )
                    strength_loss += (
                        (one - strength_loss) * rate * deterioration(spent, c[C.STRENGTH_CAPACITY] - energy, exponent)
                    )
                    capping_loss += (
                        (one - capping_loss) * rate * deterioration(spent, c[C.CAPPING_CAPACITY] - energy, exponent)
                    )
                    farthest += farthest * rate * deterioration(spent, c[C.RELOADING_CAPACITY] - energy, exponent)
                    if ASYMMETRIC:  # the rate may be above 1
                        strength_loss = minimum(strength_loss, one)
                        capping_loss = minimum(capping_loss, one)
                    energy_before = energy
                    x_from = x_before - f_before / stiffness
                    f_from = zero
            x_loading = x_from
            f_loading = f_from
            strength = yields * (one - strength_loss)
            slope = hardening * (one - strength_loss)
            capping = height * (one - capping_loss)
            intercept = strength - slope * strength
            f_farthest, _ = on_lines(farthest, intercept, slope, capping, falling, residual)
            if BY_RULES:
                if starts:
                    fails = fails or f_farthest <= zero
                    is_steeper = x_from < x_last and f_last < f_farthest
                    is_steeper = is_steeper and f_last * (farthest - x_from) > f_farthest * (x_last - x_from)
                    branch = wp.where(is_steeper, to_last, to_farthest)
                    if PINCHES:
                        x_pinch = c[C.PINCHING_DRIFT_SHARE] * (farthest - f_farthest / stiffness)
                        f_pinch = c[C.PINCHING_FORCE_RATIO] * f_farthest * (x_pinch - x_from) / (farthest - x_from)
                        branch = wp.where(x_from < x_pinch, to_pinch, branch)
                if branch == elastic and x > yields:
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
            tangent = (f_to - f_from) / maximum(x_to - x_from, type(drift)(SMALLEST))
            force = f_to - tangent * (x_to - x)
            if branch == on_backbone:
                force, tangent = on_lines(x, intercept, slope, capping, falling, residual)
            steepest = f_loading + (x - x_loading)
            if force > steepest:
                force = steepest
                tangent = one
            if branch <= unloading:
                force = wp.where(branch == elastic, x, unloaded)
                tangent = stiffness
            if not moving:
                force = f_before
            fails = fails or (moving and x >= ultimate) or (branch == on_backbone and force <= zero)
            if fails:
                branch = failed
                force = zero
                tangent = zero
            after = type(memory)()
            after[M.DRIFT] = u
            after[M.FORCE] = side * force
            after[M.STIFFNESS_LOSS] = stiffness_loss
            after[M.ENERGY] = energy + type(drift)(0.5) * (force + f_before) * (x - x_before)
            after[M.ENERGY_BEFORE] = energy_before
            after[M.BRANCH] = wp.where(branch <= unloading, branch, side * branch)
            after[M.STRENGTH_LOSS_ABOVE] = wp.where(up, strength_loss, memory[M.STRENGTH_LOSS_ABOVE])
            after[M.CAPPING_LOSS_ABOVE] = wp.where(up, capping_loss, memory[M.CAPPING_LOSS_ABOVE])
            after[M.FARTHEST_ABOVE] = kept(wp.where(up, farthest, other_farthest))
            after[M.LAST_DRIFT_ABOVE] = kept(wp.where(up, x_last, other_x_last))
            after[M.LAST_FORCE_ABOVE] = kept(wp.where(up, f_last, other_f_last))
            after[M.STRENGTH_LOSS_BELOW] = wp.where(up, memory[M.STRENGTH_LOSS_BELOW], strength_loss)
            after[M.CAPPING_LOSS_BELOW] = wp.where(up, memory[M.CAPPING_LOSS_BELOW], capping_loss)
            after[M.FARTHEST_BELOW] = kept(wp.where(up, other_farthest, farthest))
            after[M.LAST_DRIFT_BELOW] = kept(wp.where(up, other_x_last, x_last))
            after[M.LAST_FORCE_BELOW] = kept(wp.where(up, other_f_last, f_last))
            if PINCHES:
                after[M.PINCHING_DRIFT] = x_pinch
                after[M.PINCHING_FORCE] = f_pinch
            return after, tangent

        return follow

    def unloading(memory: Any, c: Any):
        one = type(memory[M.DRIFT])(1.0)
        stiffness = one - memory[M.STIFFNESS_LOSS]
        exponent = one
        if POWERS:
            exponent = c[EXPONENT]
        holds = bool(True)
        if wp.abs(memory[M.BRANCH]) >= type(memory[M.DRIFT])(TO_PINCH):
            stiffness, fails = after_turning(
                memory[M.FORCE], stiffness, memory[M.ENERGY], memory[M.ENERGY_BEFORE], exponent, c
            )
            holds = not fails
        return stiffness, holds

    functions = following(True), following(False), leaves_line, unloading, of_side
    return spring_of(name, *functions, values, int(M.STRENGTH_LOSS_ABOVE), len(names))


SPRINGS = {
    "ibarra_medina_krawinkler_peak_oriented": _law("imk_peak_oriented", False, False),
    "ibarra_medina_krawinkler_peak_oriented_power": _law("imk_peak_oriented_power", False, True),
    "ibarra_medina_krawinkler_peak_oriented_asymmetric": _law("imk_peak_oriented_asymmetric", False, True, True),
    "ibarra_medina_krawinkler_pinching_asymmetric": _law("imk_pinching_asymmetric", True, True, True),
    "ibarra_medina_krawinkler_pinching": _law("imk_pinching", True, False),
    "ibarra_medina_krawinkler_pinching_power": _law("imk_pinching_power", True, True),
}
