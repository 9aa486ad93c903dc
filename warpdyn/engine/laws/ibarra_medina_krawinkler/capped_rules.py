"""Device functions of the bilinear law of Ibarra, Medina and Krawinkler without deterioration, for hinges of frames.

The rules are those of `bilinear_rules.py` with infinite energy capacities, without branches, so that a CPU evaluates
16 samples at once. They hold for all values of the other parameters and for all rotations.
"""

import enum
from collections.abc import Collection, Mapping
from typing import Any

import numpy as np
import warp as wp

from warpdyn.engine.device.extrema import maximum
from warpdyn.engine.laws.ibarra_medina_krawinkler.deterioration import on_lines
from warpdyn.engine.laws.ibarra_medina_krawinkler.hinge_lines import line_rules
from warpdyn.engine.laws.ibarra_medina_krawinkler.parameters import Coefficient as C
from warpdyn.engine.laws.law import Layout
from warpdyn.engine.laws.row_functions import kept_force
from warpdyn.engine.laws.spring import Spring
from warpdyn.engine.laws.springs import Variant

NAME = "ibarra_medina_krawinkler_capped"
GENERAL = "ibarra_medina_krawinkler_bilinear"
CAPACITIES = ("strength_deterioration_drift", "post_capping_deterioration_drift", "unloading_deterioration_drift")
ALL = wp.constant(wp.float64(2.0))  # loss of slope of a side whose strength is lost


class M(Layout):
    """Memory of a hinge; drifts and forces are divided by yield drift and yield force."""

    DRIFT = enum.auto()
    FORCE = enum.auto()
    STIFFNESS_LOSS = enum.auto()  # 0.5 after the hinge has turned back from the residual force
    STATE = enum.auto()  # 1 after the residual force was reached; plus 4 on a backbone
    SLOPE_LOSS_ABOVE = enum.auto()  # of the hardening line of the positive side; ALL if its strength is lost
    SLOPE_LOSS_BELOW = enum.auto()
    LIFT = enum.auto()  # rise of the present hardening line above the line through the yield point


@wp.func
def capped_follow(drift: Any, memory: Any, c: Any):
    """Return the memory after a step, and the slope in yield forces per yield drift."""
    zero = type(drift)(0.0)
    one = type(drift)(1.0)
    half = type(drift)(0.5)
    four = type(drift)(4.0)
    u = drift * c[C.INVERSE_YIELD_DRIFT]
    moving = u != memory[M.DRIFT]
    up = u > memory[M.DRIFT] or (u == memory[M.DRIFT] and memory[M.FORCE] >= zero)
    side = wp.where(up, one, -one)
    x = side * u
    x_before = side * memory[M.DRIFT]
    f_before = side * memory[M.FORCE]
    was_on_backbone = memory[M.STATE] >= four
    seen = wp.where(was_on_backbone, memory[M.STATE] - four, memory[M.STATE])
    slope_loss = wp.where(up, memory[M.SLOPE_LOSS_ABOVE], memory[M.SLOPE_LOSS_BELOW])
    other_slope_loss = wp.where(up, memory[M.SLOPE_LOSS_BELOW], memory[M.SLOPE_LOSS_ABOVE])
    turns = moving and was_on_backbone and (f_before < zero or (f_before == zero and x_before <= zero))
    loss = wp.where(turns and seen > half, half, memory[M.STIFFNESS_LOSS])
    on_backbone = was_on_backbone and not turns
    stiffness = one - loss
    force = f_before + stiffness * (x - x_before)
    residual = c[C.RESIDUAL_FORCE]
    falling = c[C.FALLING_SLOPE] * (one - residual)
    slope = maximum(c[C.HARDENING_SLOPE] - slope_loss, zero)
    # If the hardening line is too steep, it starts where the hinge reaches the residual force.
    crosses = moving and not on_backbone and f_before <= zero and force >= zero
    cap_drift = (c[C.CAPPING_HEIGHT] - (one - slope)) / (slope + falling)
    cap_force = one - slope + slope * cap_drift
    way = cap_drift - x_before - (residual - f_before) * (one + loss + loss)  # 1 / stiffness: the loss is 0 or 0.5
    steep = crosses and way > zero and slope * way > cap_force - residual
    slope = wp.where(steep, (cap_force - residual) / wp.where(steep, way, one), slope)
    slope_loss = wp.where(steep, c[C.HARDENING_SLOPE] - slope, slope_loss)
    lift = wp.where(crosses, zero, memory[M.LIFT])
    lift = wp.where(steep, cap_force - slope * cap_drift - (one - slope), lift)
    bound, tangent = on_lines(x, one - slope + lift, slope, c[C.CAPPING_HEIGHT], falling, residual)
    is_lost = slope_loss > one
    any_lost = is_lost or other_slope_loss > one
    bound = wp.where(any_lost, wp.where(is_lost, zero, residual), bound)
    tangent = wp.where(any_lost, zero, tangent)
    meets = moving and force > bound
    tangent = wp.where(not meets and (moving or not on_backbone), stiffness, tangent)
    force = wp.where(meets, bound, force)
    on_backbone = on_backbone or meets
    at_residual = wp.where(falling > zero, c[C.CAPPING_HEIGHT] - falling * x <= residual, force == residual)
    loses = moving and (x >= c[C.ULTIMATE_DRIFT] or (on_backbone and force <= zero))
    force = wp.where(loses, zero, force)
    tangent = wp.where(loses, zero, tangent)
    slope_loss = wp.where(loses, type(drift)(ALL), slope_loss)
    seen = wp.where(at_residual or slope_loss > one or other_slope_loss > one, one, seen)
    after = type(memory)()
    after[M.DRIFT] = u
    after[M.FORCE] = side * force
    after[M.STIFFNESS_LOSS] = loss
    after[M.STATE] = wp.where(on_backbone, seen + four, seen)
    after[M.SLOPE_LOSS_ABOVE] = wp.where(up, slope_loss, other_slope_loss)
    after[M.SLOPE_LOSS_BELOW] = wp.where(up, other_slope_loss, slope_loss)
    after[M.LIFT] = lift
    return after, tangent


@wp.func
def capped_force(drift: Any, memory: Any, c: Any):
    after, _tangent = capped_follow(drift, memory, c)
    return c[C.YIELD_FORCE] * after[M.FORCE]


@wp.func
def capped_return_mapping(drift: Any, memory: Any, c: Any):
    after, _tangent = capped_follow(drift, memory, c)
    return after


@wp.func
def capped_memory_after(drift: Any, increment: Any, memory: Any, c: Any):
    after, _tangent = capped_follow(drift, memory, c)
    return after


@wp.func
def capped_tangent(drift: Any, increment: Any, before: Any, after: Any, c: Any):
    _after, slope = capped_follow(drift, before, c)
    return slope * c[C.INVERSE_YIELD_DRIFT] * c[C.YIELD_FORCE]


@wp.func
def capped_elastic_energy(drift: Any, memory: Any, c: Any):
    force = memory[M.FORCE]
    stiffness = type(drift)(1.0) - memory[M.STIFFNESS_LOSS]
    return type(drift)(0.5) * force * force / stiffness * c[C.YIELD_FORCE] / c[C.INVERSE_YIELD_DRIFT]


_line, _memory_along_line = line_rules(NAME, M, False)
SPRINGS = {
    NAME: Spring(
        capped_force,
        capped_return_mapping,
        capped_elastic_energy,
        coefficients=int(C.STRENGTH_CAPACITY),
        tangent=capped_tangent,
        memory=len(M),
        memory_after=capped_memory_after,
        force_at_accepted_state=kept_force,
        line=_line,
        memory_along_line=_memory_along_line,
    )
}


def variant() -> Variant:
    """Return the variant, which reads the first coefficients of the general one."""
    return Variant(NAME, C.names(C.STRENGTH_CAPACITY), __name__)


def applies(p: Mapping[str, np.ndarray], random: Collection[str]) -> bool:
    """Return whether no hinge deteriorates.

    Args:
        p: Parameters of the hinges, shape [structure, hinge].
        random: Names of the parameters that differ between structures.
    """
    return not any(name in random or np.any(p[name] > 0) for name in CAPACITIES)
