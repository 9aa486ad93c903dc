"""Device functions of the law of Ibarra, Medina and Krawinkler (2005) with bilinear hysteresis (OpenSees: IMKBilin).

The force changes with the unloading stiffness until it meets the backbone of the side (positive or negative) towards
which the storey moves. The backbone of a side deteriorates each time the force takes the sign of this side.
"""

import enum
from collections.abc import Callable
from typing import Any

import warp as wp

from warpdyn.engine.device.extrema import maximum, minimum
from warpdyn.engine.laws.ibarra_medina_krawinkler.deterioration import energy_rules, on_lines, side_rules, spring_of
from warpdyn.engine.laws.ibarra_medina_krawinkler.parameters import (
    Coefficient as C,
    IbarraMedinaKrawinklerBilinear,
    row_of,
)
from warpdyn.engine.laws.law import Layout
from warpdyn.engine.laws.row_functions import device_functions
from warpdyn.engine.laws.spring import Spring

ALL = wp.constant(
    wp.float64(2.0)
)  # stored if the strength has fallen to the residual force, or (as a loss of slope) if all strength is lost


class M(Layout):
    """Memory of a storey: the history variables that its law keeps from step to step; those of `Common` come first.

    Drifts and forces are divided by the yield drift and yield force of the positive side.
    """

    DRIFT = enum.auto()
    FORCE = enum.auto()
    STIFFNESS_LOSS = enum.auto()
    ENERGY = enum.auto()
    ENERGY_BEFORE = enum.auto()
    STATE = enum.auto()  # 0 elastic, 1 yielded, 2 at the residual force; plus 4 on a backbone
    STRENGTH_LOSS_ABOVE = enum.auto()  # on the positive side: losses of yield force, hardening slope and capping line
    SLOPE_LOSS_ABOVE = enum.auto()
    CAPPING_LOSS_ABOVE = enum.auto()
    STRENGTH_LOSS_BELOW = enum.auto()
    SLOPE_LOSS_BELOW = enum.auto()
    CAPPING_LOSS_BELOW = enum.auto()
    LIFT = enum.auto()  # rise of the present hardening line above the line that the strength alone gives


def _law(name: str, POWERS: bool, ASYMMETRIC: bool = False) -> Spring:
    """Return the device functions of a variant of the law.

    POWERS is False if the exponent of deterioration is 1. ASYMMETRIC is True if the backbones of the two sides differ.
    """
    names, exponent, first_negative = row_of(IbarraMedinaKrawinklerBilinear, POWERS, ASYMMETRIC)
    EXPONENT = wp.constant(exponent)
    of_side = side_rules(name, first_negative)
    deterioration, after_turning = energy_rules(POWERS)

    def turns_back(x_before: Any, f_before: Any):
        zero = type(x_before)(0.0)
        return f_before < zero or (f_before == zero and x_before <= zero)

    turns_back = device_functions(name, turns_back)["turns_back"]

    def leaves_line(drift: Any, memory: Any, c: Any):
        zero = type(drift)(0.0)
        u = drift * c[C.INVERSE_YIELD_DRIFT]
        side = wp.where(u > memory[M.DRIFT], type(drift)(1.0), -type(drift)(1.0))
        x_before = side * memory[M.DRIFT]
        f_before = side * memory[M.FORCE]
        force = f_before + (type(drift)(1.0) - memory[M.STIFFNESS_LOSS]) * (side * u - x_before)
        on_backbone = memory[M.STATE] >= type(drift)(4.0)
        turns = on_backbone and turns_back(x_before, f_before)
        crosses = not on_backbone and memory[M.STATE] > zero and f_before <= zero and force >= zero
        return u != memory[M.DRIFT] and (turns or crosses)

    def following(BY_RULES: bool) -> Callable:
        """Return the device function for a step: by all rules, or only for storeys that stay on their line."""

        def follow(drift: Any, memory: Any, c: Any):
            zero = type(drift)(0.0)
            one = type(drift)(1.0)
            two = type(drift)(2.0)
            # Warp defines a constant where it is first used. In a branch, it would be undefined after the branch.
            all_of_it = type(drift)(ALL)
            exponent = one
            if POWERS:
                exponent = c[EXPONENT]
            # Drifts and forces of this step are positive on the side towards which the storey moves.
            u = drift * c[C.INVERSE_YIELD_DRIFT]
            moving = u != memory[M.DRIFT]
            up = u > memory[M.DRIFT] or (u == memory[M.DRIFT] and memory[M.FORCE] >= zero)
            yields, hardening, falling_slope, height, residual, ultimate, rate = of_side(up, c)
            side = wp.where(up, one, -one)
            x = side * u
            x_before = side * memory[M.DRIFT]
            f_before = side * memory[M.FORCE]
            strength_loss = wp.where(up, memory[M.STRENGTH_LOSS_ABOVE], memory[M.STRENGTH_LOSS_BELOW])
            slope_loss = wp.where(up, memory[M.SLOPE_LOSS_ABOVE], memory[M.SLOPE_LOSS_BELOW])
            capping_loss = wp.where(up, memory[M.CAPPING_LOSS_ABOVE], memory[M.CAPPING_LOSS_BELOW])
            other_slope_loss = wp.where(up, memory[M.SLOPE_LOSS_BELOW], memory[M.SLOPE_LOSS_ABOVE])
            stiffness_loss = memory[M.STIFFNESS_LOSS]
            energy = memory[M.ENERGY]
            energy_before = memory[M.ENERGY_BEFORE]
            on_backbone = memory[M.STATE] >= type(drift)(4.0)
            seen = wp.where(on_backbone, memory[M.STATE] - type(drift)(4.0), memory[M.STATE])
            lift = memory[M.LIFT]
            strength = wp.where(strength_loss > yields, residual, yields - strength_loss)
            slope = maximum(hardening - slope_loss, zero)
            capping = height - capping_loss
            fails = bool(False)
            if BY_RULES:
                if moving and on_backbone and turns_back(x_before, f_before):
                    on_backbone = False
                    stiffness, fails = after_turning(f_before, one - stiffness_loss, energy, energy_before, exponent, c)
                    stiffness_loss = wp.where(seen >= two, type(drift)(0.5), one - stiffness)
            stiffness = one - stiffness_loss
            force = f_before + stiffness * (x - x_before)
            if not BY_RULES:
                # A force that passes zero by rounding alone crosses zero in the next step.
                nears = not on_backbone and f_before <= zero and seen > zero
                force = wp.where(nears, minimum(force, zero), force)
            if BY_RULES:
                if moving and not on_backbone and f_before <= zero and force >= zero and seen > zero:
                    spent = maximum(energy - energy_before, zero)
                    fails = fails or spent > c[C.STRENGTH_CAPACITY] - energy or spent > c[C.CAPPING_CAPACITY] - energy
                    weakening = one - rate * deterioration(spent, c[C.STRENGTH_CAPACITY] - energy, exponent)
                    lowering = one - rate * deterioration(spent, c[C.CAPPING_CAPACITY] - energy, exponent)
                    if ASYMMETRIC:  # the rate may be above 1
                        weakening = maximum(weakening, zero)
                        lowering = maximum(lowering, zero)
                    strength *= weakening
                    slope *= weakening
                    capping *= lowering
                    energy_before = energy
                    intercept = strength - slope * strength
                    steepness = slope + falling_slope * maximum(strength - residual, zero)
                    cap_drift = wp.where(steepness > zero, (capping - intercept) / steepness, zero)
                    cap_force = intercept + slope * cap_drift
                    lift = zero
                    strength_loss = yields - strength
                    if cap_force <= residual:
                        strength = residual
                        strength_loss = all_of_it * yields
                        slope = zero
                        capping = residual
                    # If the hardening line is too steep, it starts where the storey reaches the residual force.
                    way = cap_drift - x_before - (residual - f_before) / stiffness
                    if cap_force > residual and way > zero and slope * way > cap_force - residual:
                        slope = (cap_force - residual) / way
                        lift = cap_force - slope * cap_drift - (strength - slope * strength)
                    slope_loss = wp.where(slope_loss > one, slope_loss, hardening - slope)
                    capping_loss = height - capping
            falling = falling_slope * maximum(strength - residual, zero)
            bound, tangent = on_lines(x, strength - slope * strength + lift, slope, capping, falling, residual)
            is_lost = slope_loss > one
            other_is_lost = other_slope_loss > one
            if is_lost or other_is_lost:
                bound = wp.where(is_lost, zero, residual)
                tangent = zero
            if moving and force > bound:
                force = bound
                on_backbone = True
            elif moving or not on_backbone:  # the force may rise from zero to the backbone that it left
                tangent = stiffness
            is_at_residual = wp.where(falling > zero, capping - falling * x <= residual, force == residual)
            loses = moving and (x >= ultimate or (on_backbone and force <= zero))
            if loses or fails:
                force = zero
                tangent = zero
                slope_loss = all_of_it
            if fails:
                other_slope_loss = all_of_it
            if is_at_residual or slope_loss > one or other_slope_loss > one:
                seen = two
            elif on_backbone:
                seen = maximum(seen, one)
            after = type(memory)()
            after[M.DRIFT] = u
            after[M.FORCE] = side * force
            after[M.STIFFNESS_LOSS] = stiffness_loss
            after[M.ENERGY] = energy + type(drift)(0.5) * (force + f_before) * (x - x_before)
            after[M.ENERGY_BEFORE] = energy_before
            after[M.STATE] = wp.where(on_backbone, seen + type(drift)(4.0), seen)
            after[M.STRENGTH_LOSS_ABOVE] = wp.where(up, strength_loss, memory[M.STRENGTH_LOSS_ABOVE])
            after[M.SLOPE_LOSS_ABOVE] = wp.where(up, slope_loss, other_slope_loss)
            after[M.CAPPING_LOSS_ABOVE] = wp.where(up, capping_loss, memory[M.CAPPING_LOSS_ABOVE])
            after[M.STRENGTH_LOSS_BELOW] = wp.where(up, memory[M.STRENGTH_LOSS_BELOW], strength_loss)
            after[M.SLOPE_LOSS_BELOW] = wp.where(up, other_slope_loss, slope_loss)
            after[M.CAPPING_LOSS_BELOW] = wp.where(up, memory[M.CAPPING_LOSS_BELOW], capping_loss)
            after[M.LIFT] = lift
            return after, tangent

        return follow

    def unloading(memory: Any, c: Any):
        one = type(memory[M.DRIFT])(1.0)
        stiffness = one - memory[M.STIFFNESS_LOSS]
        exponent = one
        if POWERS:
            exponent = c[EXPONENT]
        holds = bool(True)
        if memory[M.STATE] >= type(memory[M.DRIFT])(4.0):
            stiffness, fails = after_turning(
                memory[M.FORCE], stiffness, memory[M.ENERGY], memory[M.ENERGY_BEFORE], exponent, c
            )
            holds = not fails
            if memory[M.STATE] > type(memory[M.DRIFT])(5.0):
                stiffness = type(memory[M.DRIFT])(0.5)
        return stiffness, holds

    functions = following(True), following(False), leaves_line, unloading, of_side
    return spring_of(name, *functions, len(M), None, len(names))


SPRINGS = {
    "ibarra_medina_krawinkler_bilinear": _law("imk_bilinear", False),
    "ibarra_medina_krawinkler_bilinear_power": _law("imk_bilinear_power", True),
    "ibarra_medina_krawinkler_bilinear_asymmetric": _law("imk_bilinear_asymmetric", True, True),
}
