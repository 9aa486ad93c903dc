"""The law of Ibarra, Medina and Krawinkler (2005) with bilinear hysteresis, by the rules of OpenSees' IMKBilin.

The storey moves along its unloading stiffness until it meets the backbone of the side it moves to. A side's backbone
deteriorates whenever the force changes its sign towards it.

The memory: what the family's has in common; how far the storey has come, 0 elastic, 1 yielded, 2 to the residual force,
plus 4 on a backbone; for either side what its yield force, its hardening slope and its capping line have lost; and how
far the hardening line of the present side lies above where strength alone puts it.
"""

from collections.abc import Callable
from typing import Any

import warp as wp

from warpdyn.laws.ibarra_medina_krawinkler.deterioration import energy_rules, on_lines, spring_of
from warpdyn.laws.row_functions import device_functions
from warpdyn.laws.spring import Spring

STATE = wp.constant(5)
SIDES = wp.constant(6)  # three values each: losses of yield force, hardening slope, capping line
LIFT = wp.constant(12)
MEMORY, COEFFICIENTS = 13, 11
EXPONENT = wp.constant(COEFFICIENTS)
ALL = wp.constant(wp.float64(2.0))  # a loss of strength to the residual force, or of slope with all strength


def _law(name: str, POWERS: bool) -> Spring:
    """Return the law; without powers its exponent of deterioration is 1."""
    deterioration, after_turning = energy_rules(POWERS)

    def turns_back(x_before: Any, f_before: Any):
        zero = type(x_before)(0.0)
        return f_before < zero or (f_before == zero and x_before <= zero)

    turns_back = device_functions(name, turns_back)["turns_back"]

    def decides(drift: Any, memory: Any, c: Any):
        zero = type(drift)(0.0)
        u = drift * c[0]
        side = wp.where(u > memory[0], type(drift)(1.0), -type(drift)(1.0))
        x_before = side * memory[0]
        f_before = side * memory[1]
        force = f_before + (type(drift)(1.0) - memory[2]) * (side * u - x_before)
        on_backbone = memory[STATE] >= type(drift)(4.0)
        turns = on_backbone and turns_back(x_before, f_before)
        crosses = not on_backbone and memory[STATE] > zero and f_before <= zero and force >= zero
        return u != memory[0] and (turns or crosses)

    def following(DECIDES: bool) -> Callable:
        """Return the function that follows the path, of all storeys or of those that decide nothing."""

        def follow(drift: Any, memory: Any, c: Any):
            zero = type(drift)(0.0)
            one = type(drift)(1.0)
            two = type(drift)(2.0)
            # Warp sets a constant where it is first read: inside a branch, it would not be set for what comes after.
            all_of_it = type(drift)(ALL)
            residual = c[5]
            exponent = one
            if POWERS:
                exponent = c[EXPONENT]
            # All of a step is seen from the side that the storey moves to.
            u = drift * c[0]
            moving = u != memory[0]
            up = u > memory[0] or (u == memory[0] and memory[1] >= zero)
            side = wp.where(up, one, -one)
            x = side * u
            x_before = side * memory[0]
            f_before = side * memory[1]
            strength_loss = wp.where(up, memory[SIDES], memory[SIDES + 3])
            slope_loss = wp.where(up, memory[SIDES + 1], memory[SIDES + 4])
            capping_loss = wp.where(up, memory[SIDES + 2], memory[SIDES + 5])
            other_slope_loss = wp.where(up, memory[SIDES + 4], memory[SIDES + 1])
            stiffness_loss = memory[2]
            energy = memory[3]
            energy_before = memory[4]
            on_backbone = memory[STATE] >= type(drift)(4.0)
            seen = wp.where(on_backbone, memory[STATE] - type(drift)(4.0), memory[STATE])
            lift = memory[LIFT]
            strength = wp.where(strength_loss > one, residual, one - strength_loss)
            slope = wp.max(c[2] - slope_loss, zero)
            capping = c[4] - capping_loss
            fails = bool(False)
            if DECIDES:
                if moving and on_backbone and turns_back(x_before, f_before):
                    on_backbone = False
                    stiffness, fails = after_turning(f_before, one - stiffness_loss, energy, energy_before, exponent, c)
                    stiffness_loss = wp.where(seen >= two, type(drift)(0.5), one - stiffness)
            stiffness = one - stiffness_loss
            force = f_before + stiffness * (x - x_before)
            if not DECIDES:
                # What rounding alone takes past no force crosses it in the next step.
                nears = not on_backbone and f_before <= zero and seen > zero
                force = wp.where(nears, wp.min(force, zero), force)
            if DECIDES:
                if moving and not on_backbone and f_before <= zero and force >= zero and seen > zero:
                    spent = wp.max(energy - energy_before, zero)
                    fails = fails or spent > c[7] - energy or spent > c[8] - energy
                    weakening = one - c[10] * deterioration(spent, c[7] - energy, exponent)
                    strength *= weakening
                    slope *= weakening
                    capping *= one - c[10] * deterioration(spent, c[8] - energy, exponent)
                    energy_before = energy
                    intercept = strength - slope * strength
                    steepness = slope + c[3] * wp.max(strength - residual, zero)
                    cap_drift = wp.where(steepness > zero, (capping - intercept) / steepness, zero)
                    cap_force = intercept + slope * cap_drift
                    lift = zero
                    strength_loss = one - strength
                    if cap_force <= residual:
                        strength = residual
                        strength_loss = all_of_it
                        slope = zero
                        capping = residual
                    # The hardening line starts from where the storey comes to the residual force, if that is above it.
                    way = cap_drift - x_before - (residual - f_before) / stiffness
                    if cap_force > residual and way > zero and slope * way > cap_force - residual:
                        slope = (cap_force - residual) / way
                        lift = cap_force - slope * cap_drift - (strength - slope * strength)
                    slope_loss = wp.where(slope_loss > one, slope_loss, c[2] - slope)
                    capping_loss = c[4] - capping
            falling = c[3] * wp.max(strength - residual, zero)
            bound, tangent = on_lines(x, strength - slope * strength + lift, slope, capping, falling, residual)
            is_lost = slope_loss > one
            other_is_lost = other_slope_loss > one
            if is_lost or other_is_lost:
                bound = wp.where(is_lost, zero, residual)
                tangent = zero
            if moving and force > bound:
                force = bound
                on_backbone = True
            elif not on_backbone:
                tangent = stiffness
            is_at_residual = wp.where(falling > zero, capping - falling * x <= residual, force == residual)
            loses = moving and (x >= c[6] or (on_backbone and force <= zero))
            if loses or fails:
                force = zero
                tangent = zero
                slope_loss = all_of_it
            if fails:
                other_slope_loss = all_of_it
            if is_at_residual or slope_loss > one or other_slope_loss > one:
                seen = two
            elif on_backbone:
                seen = wp.max(seen, one)
            after = type(memory)()
            after[0] = u
            after[1] = side * force
            after[2] = stiffness_loss
            after[3] = energy + type(drift)(0.5) * (force + f_before) * (x - x_before)
            after[4] = energy_before
            after[STATE] = wp.where(on_backbone, seen + type(drift)(4.0), seen)
            after[SIDES] = wp.where(up, strength_loss, memory[SIDES])
            after[SIDES + 1] = wp.where(up, slope_loss, other_slope_loss)
            after[SIDES + 2] = wp.where(up, capping_loss, memory[SIDES + 2])
            after[SIDES + 3] = wp.where(up, memory[SIDES + 3], strength_loss)
            after[SIDES + 4] = wp.where(up, other_slope_loss, slope_loss)
            after[SIDES + 5] = wp.where(up, memory[SIDES + 5], capping_loss)
            after[LIFT] = lift
            return after, tangent

        return follow

    def unloading(memory: Any, c: Any):
        one = type(memory[0])(1.0)
        stiffness = one - memory[2]
        exponent = one
        if POWERS:
            exponent = c[EXPONENT]
        holds = bool(True)
        if memory[STATE] >= type(memory[0])(4.0):
            stiffness, fails = after_turning(memory[1], stiffness, memory[3], memory[4], exponent, c)
            holds = not fails
            if memory[STATE] > type(memory[0])(5.0):
                stiffness = type(memory[0])(0.5)
        return stiffness, holds

    functions = following(True), following(False), decides, unloading
    return spring_of(name, *functions, MEMORY, None, COEFFICIENTS + POWERS)


SPRINGS = {
    "ibarra_medina_krawinkler_bilinear": _law("imk_bilinear", False),
    "ibarra_medina_krawinkler_bilinear_power": _law("imk_bilinear_power", True),
}
