"""Device functions of the bilinear law of Ibarra, Medina and Krawinkler with deterioration, for hinges of frames.

The rules and the memory are those of `bilinear_rules.py` with equal sides and the exponent 1, without branches, so that
a CPU evaluates 16 samples at once.
"""

from dataclasses import replace
from typing import Any

import warp as wp

from warpdyn.engine.device.extrema import maximum, minimum
from warpdyn.engine.laws.ibarra_medina_krawinkler.bilinear_rules import ALL, SPRINGS as WITH_BRANCHES, M
from warpdyn.engine.laws.ibarra_medina_krawinkler.deterioration import SMALLEST, on_lines
from warpdyn.engine.laws.ibarra_medina_krawinkler.hinge_lines import line_rules
from warpdyn.engine.laws.ibarra_medina_krawinkler.parameters import Coefficient as C
from warpdyn.engine.laws.row_functions import device_functions
from warpdyn.engine.laws.springs import Variant

NAME = "ibarra_medina_krawinkler_branchless"
GENERAL = "ibarra_medina_krawinkler_bilinear"


@wp.func
def lost_share(spent: Any, left: Any):
    """Return the share of a strength or stiffness that an excursion costs."""
    return minimum(spent / maximum(left, type(spent)(SMALLEST)), type(spent)(1.0))


@wp.func
def branchless_follow(drift: Any, memory: Any, c: Any):
    """Return the memory after a step, and the slope in yield forces per yield drift."""
    zero = type(drift)(0.0)
    one = type(drift)(1.0)
    half = type(drift)(0.5)
    two = type(drift)(2.0)
    four = type(drift)(4.0)
    smallest = type(drift)(SMALLEST)
    all_of_it = type(drift)(ALL)
    u = drift * c[C.INVERSE_YIELD_DRIFT]
    moving = u != memory[M.DRIFT]
    up = u > memory[M.DRIFT] or (u == memory[M.DRIFT] and memory[M.FORCE] >= zero)
    side = wp.where(up, one, -one)
    x = side * u
    x_before = side * memory[M.DRIFT]
    f_before = side * memory[M.FORCE]
    strength_loss = wp.where(up, memory[M.STRENGTH_LOSS_ABOVE], memory[M.STRENGTH_LOSS_BELOW])
    slope_loss = wp.where(up, memory[M.SLOPE_LOSS_ABOVE], memory[M.SLOPE_LOSS_BELOW])
    capping_loss = wp.where(up, memory[M.CAPPING_LOSS_ABOVE], memory[M.CAPPING_LOSS_BELOW])
    other_slope_loss = wp.where(up, memory[M.SLOPE_LOSS_BELOW], memory[M.SLOPE_LOSS_ABOVE])
    energy = memory[M.ENERGY]
    energy_before = memory[M.ENERGY_BEFORE]
    was_on_backbone = memory[M.STATE] >= four
    seen = wp.where(was_on_backbone, memory[M.STATE] - four, memory[M.STATE])
    residual = c[C.RESIDUAL_FORCE]
    strength = wp.where(strength_loss > one, residual, one - strength_loss)
    slope = maximum(c[C.HARDENING_SLOPE] - slope_loss, zero)
    capping = c[C.CAPPING_HEIGHT] - capping_loss
    # Unloading stiffness, if the hinge turns back from a backbone.
    turns = moving and was_on_backbone and (f_before < zero or (f_before == zero and x_before <= zero))
    stiffness_then = one - memory[M.STIFFNESS_LOSS]
    elastic = half * f_before * f_before / maximum(stiffness_then, smallest)
    unloading_spent = maximum(energy - energy_before - elastic, zero)
    unloading_left = c[C.UNLOADING_CAPACITY] - (energy - elastic)
    given = maximum(two * (energy - energy_before), smallest)
    least = minimum(f_before * f_before / given, stiffness_then)
    turned = maximum(stiffness_then * (one - lost_share(unloading_spent, unloading_left)), least)
    turned_loss = wp.where(seen >= two, half, one - turned)
    stiffness_loss = wp.where(turns, turned_loss, memory[M.STIFFNESS_LOSS])
    fails = turns and unloading_spent > unloading_left
    on_backbone = was_on_backbone and not turns
    stiffness = one - stiffness_loss
    force = f_before + stiffness * (x - x_before)
    # Strength, hardening slope and capping line, if the force changes its sign.
    crosses = moving and not on_backbone and f_before <= zero and force >= zero and seen > zero
    spent = maximum(energy - energy_before, zero)
    strength_left = c[C.STRENGTH_CAPACITY] - energy
    capping_left = c[C.CAPPING_CAPACITY] - energy
    fails = fails or (crosses and (spent > strength_left or spent > capping_left))
    weakening = one - c[C.DETERIORATION_RATE] * lost_share(spent, strength_left)
    lowering = one - c[C.DETERIORATION_RATE] * lost_share(spent, capping_left)
    strength = wp.where(crosses, strength * weakening, strength)
    slope = wp.where(crosses, slope * weakening, slope)
    capping = wp.where(crosses, capping * lowering, capping)
    energy_before = wp.where(crosses, energy, energy_before)
    strength_loss = wp.where(crosses, one - strength, strength_loss)
    intercept = strength - slope * strength
    steepness = slope + c[C.FALLING_SLOPE] * maximum(strength - residual, zero)
    cap_drift = wp.where(steepness > zero, (capping - intercept) / maximum(steepness, smallest), zero)
    cap_force = intercept + slope * cap_drift
    weak = crosses and cap_force <= residual
    strength = wp.where(weak, residual, strength)
    strength_loss = wp.where(weak, all_of_it, strength_loss)
    slope = wp.where(weak, zero, slope)
    capping = wp.where(weak, residual, capping)
    # If the hardening line is too steep, it starts where the hinge reaches the residual force.
    way = cap_drift - x_before - (residual - f_before) / maximum(stiffness, smallest)
    steep = crosses and cap_force > residual and way > zero and slope * way > cap_force - residual
    slope = wp.where(steep, (cap_force - residual) / wp.where(steep, way, one), slope)
    lift = wp.where(crosses, zero, memory[M.LIFT])
    lift = wp.where(steep, cap_force - slope * cap_drift - (strength - slope * strength), lift)
    slope_loss = wp.where(crosses and slope_loss <= one, c[C.HARDENING_SLOPE] - slope, slope_loss)
    capping_loss = wp.where(crosses, c[C.CAPPING_HEIGHT] - capping, capping_loss)
    falling = c[C.FALLING_SLOPE] * maximum(strength - residual, zero)
    bound, tangent = on_lines(x, strength - slope * strength + lift, slope, capping, falling, residual)
    is_lost = slope_loss > one
    any_lost = is_lost or other_slope_loss > one
    bound = wp.where(any_lost, wp.where(is_lost, zero, residual), bound)
    tangent = wp.where(any_lost, zero, tangent)
    meets = moving and force > bound
    tangent = wp.where(not meets and (moving or not on_backbone), stiffness, tangent)
    force = wp.where(meets, bound, force)
    on_backbone = on_backbone or meets
    at_residual = wp.where(falling > zero, capping - falling * x <= residual, force == residual)
    loses = fails or (moving and (x >= c[C.ULTIMATE_DRIFT] or (on_backbone and force <= zero)))
    force = wp.where(loses, zero, force)
    tangent = wp.where(loses, zero, tangent)
    slope_loss = wp.where(loses, all_of_it, slope_loss)
    other_slope_loss = wp.where(fails, all_of_it, other_slope_loss)
    is_at_end = at_residual or slope_loss > one or other_slope_loss > one
    seen = wp.where(is_at_end, two, wp.where(on_backbone, maximum(seen, one), seen))
    after = type(memory)()
    after[M.DRIFT] = u
    after[M.FORCE] = side * force
    after[M.STIFFNESS_LOSS] = stiffness_loss
    after[M.ENERGY] = energy + half * (force + f_before) * (x - x_before)
    after[M.ENERGY_BEFORE] = energy_before
    after[M.STATE] = wp.where(on_backbone, seen + four, seen)
    after[M.STRENGTH_LOSS_ABOVE] = wp.where(up, strength_loss, memory[M.STRENGTH_LOSS_ABOVE])
    after[M.SLOPE_LOSS_ABOVE] = wp.where(up, slope_loss, other_slope_loss)
    after[M.CAPPING_LOSS_ABOVE] = wp.where(up, capping_loss, memory[M.CAPPING_LOSS_ABOVE])
    after[M.STRENGTH_LOSS_BELOW] = wp.where(up, memory[M.STRENGTH_LOSS_BELOW], strength_loss)
    after[M.SLOPE_LOSS_BELOW] = wp.where(up, other_slope_loss, slope_loss)
    after[M.CAPPING_LOSS_BELOW] = wp.where(up, memory[M.CAPPING_LOSS_BELOW], capping_loss)
    after[M.LIFT] = lift
    return after, tangent


def force(drift: Any, memory: Any, c: Any):
    after, _ = branchless_follow(drift, memory, c)
    return c[C.YIELD_FORCE] * after[M.FORCE]


def return_mapping(drift: Any, memory: Any, c: Any):
    after, _ = branchless_follow(drift, memory, c)
    return after


def memory_after(drift: Any, increment: Any, memory: Any, c: Any):
    after, _ = branchless_follow(drift, memory, c)
    return after


def tangent(drift: Any, increment: Any, before: Any, after: Any, c: Any):
    _, slope = branchless_follow(drift, before, c)
    return slope * c[C.INVERSE_YIELD_DRIFT] * c[C.YIELD_FORCE]


_own = device_functions(NAME, force, return_mapping, memory_after, tangent)
_line, _memory_along_line = line_rules(NAME, M, True)
SPRINGS = {
    NAME: replace(
        WITH_BRANCHES[GENERAL],
        force=_own["force"],
        return_mapping=_own["return_mapping"],
        memory_after=_own["memory_after"],
        tangent=_own["tangent"],
        memory_on_line=None,
        tangent_on_line=None,
        leaves_line=None,
        line=_line,
        memory_along_line=_memory_along_line,
    )
}


def variant(general: Variant) -> Variant:
    """Return the variant, which reads the coefficients of the general one."""
    return Variant(NAME, general.coefficients, __name__)
