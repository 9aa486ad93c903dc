"""The straight line through an accepted state of a hinge with the bilinear law of Ibarra, Medina and Krawinkler.

Rules and memory are those of `capped_rules.py` and `branchless_rules.py`. Drifts and forces in the functions are
divided by the yield drift and yield force. Limits lie slightly within the range of the line, so that a hinge that is
evaluated at a limit is certainly still on its line.
"""

from collections.abc import Callable
from typing import Any

import warp as wp

from warpdyn.engine.device.extrema import maximum, minimum
from warpdyn.engine.laws.ibarra_medina_krawinkler.deterioration import SMALLEST
from warpdyn.engine.laws.ibarra_medina_krawinkler.parameters import Coefficient as C
from warpdyn.engine.laws.row_functions import device_functions

FAR = wp.constant(wp.float64(1e30))  # a drift that no hinge reaches
MARGIN = wp.constant(wp.float64(1e-4))  # distance of a limit from the end of a line, in yield drifts
SHARE = wp.constant(wp.float64(1e-6))  # the same distance, as a share of the drift at the end of the line


@wp.func
def drift_of_backbone(
    drift: Any, force: Any, stiffness: Any, intercept: Any, slope: Any, capping: Any, falling: Any, residual: Any
):
    """Return the drift at which an elastic line meets the backbone (see `on_lines`) of the side of positive forces."""
    far = type(drift)(FAR)
    offset = stiffness * drift - force
    to_hardening = wp.where(stiffness > slope, (intercept + offset) / (stiffness - slope), far)
    to_capping = (capping + offset) / (stiffness + falling)
    return maximum(minimum(to_hardening, to_capping), (residual + offset) / stiffness)


@wp.func
def end_of_segment(drift: Any, intercept: Any, slope: Any, capping: Any, falling: Any, residual: Any):
    """Return the slope of the backbone at a drift and the drift at which this segment ends (the drift: unknown)."""
    zero = type(drift)(0.0)
    far = type(drift)(FAR)
    hardening = intercept + slope * drift
    capped = capping - falling * drift
    tangent = wp.where(hardening < capped, slope, -falling)
    smallest = type(drift)(SMALLEST)
    bend = slope + falling
    cap_drift = wp.where(bend > zero, (capping - intercept) / maximum(bend, smallest), far)
    residual_drift = wp.where(falling > zero, (capping - residual) / maximum(falling, smallest), far)
    end = wp.where(hardening < capped, minimum(cap_drift, residual_drift), residual_drift)
    is_at_residual = minimum(hardening, capped) <= residual
    end = wp.where(is_at_residual, wp.where(capped <= residual, far, drift), end)
    return wp.where(is_at_residual, zero, tangent), end


@wp.func
def is_steep(
    drift: Any, force: Any, stiffness: Any, intercept: Any, slope: Any, capping: Any, falling: Any, residual: Any
):
    """Return whether the hardening line changes when the force on an elastic line takes the sign of this side."""
    zero = type(drift)(0.0)
    cap_drift = (capping - intercept) / maximum(slope + falling, type(drift)(SMALLEST))
    cap_force = intercept + slope * cap_drift
    way = cap_drift - drift - (residual - force) / stiffness  # from the residual force to the capping point
    return way > zero and slope * way > cap_force - residual


def line_rules(name: str, M: Any, DETERIORATES: bool) -> tuple[Callable, Callable]:
    """Return the device functions `line` and `memory_along_line` of a variant of the law (see `Spring`).

    Args:
        name: Prefix of the name of the device function.
        M: Layout of the memory.
        DETERIORATES: Whether the backbone of a side changes each time the force takes the sign of this side.
    """

    def side_of(up: bool, present: bool, memory: Any, c: Any):
        one = type(memory[M.DRIFT])(1.0)
        residual = c[C.RESIDUAL_FORCE]
        strength = one
        capping = c[C.CAPPING_HEIGHT]
        slope_loss = wp.where(up, memory[M.SLOPE_LOSS_ABOVE], memory[M.SLOPE_LOSS_BELOW])
        if DETERIORATES:
            strength_loss = wp.where(up, memory[M.STRENGTH_LOSS_ABOVE], memory[M.STRENGTH_LOSS_BELOW])
            strength = wp.where(strength_loss > one, residual, one - strength_loss)
            capping -= wp.where(up, memory[M.CAPPING_LOSS_ABOVE], memory[M.CAPPING_LOSS_BELOW])
        slope = maximum(c[C.HARDENING_SLOPE] - slope_loss, one - one)
        falling = c[C.FALLING_SLOPE] * maximum(strength - residual, one - one)
        lift = wp.where(present, memory[M.LIFT], one - one)
        return strength - slope * strength + lift, slope, capping, falling, residual

    side_of = device_functions(name, side_of)["side_of"]

    def line(drift: Any, memory: Any, c: Any):
        zero = type(drift)(0.0)
        one = type(drift)(1.0)
        four = type(drift)(4.0)
        far = type(drift)(FAR)
        margin = type(drift)(MARGIN)
        share = type(drift)(SHARE)
        u = memory[M.DRIFT]
        force = memory[M.FORCE]
        stiffness = one - memory[M.STIFFNESS_LOSS]
        on_backbone = memory[M.STATE] >= four
        seen = wp.where(on_backbone, memory[M.STATE] - four, memory[M.STATE])
        up = force >= zero
        way = wp.where(up, one, -one)
        # On a backbone: the segment in the direction of the force.
        intercept, slope, capping, falling, residual = side_of(up, True, memory, c)
        tangent, end = end_of_segment(way * u, intercept, slope, capping, falling, residual)
        end = minimum(end, c[C.ULTIMATE_DRIFT])
        end = maximum(end - margin - share * wp.abs(end), way * u)
        steep = is_steep(way * u, way * force, stiffness, intercept - memory[M.LIFT], slope, capping, falling, residual)
        # On an elastic line: from the backbone of one side to that of the other side.
        far_above = drift_of_backbone(way * u, way * force, stiffness, intercept, slope, capping, falling, residual)
        far_above = minimum(far_above, c[C.ULTIMATE_DRIFT])
        far_above = maximum(far_above - margin - share * wp.abs(far_above), way * u)
        intercept, slope, capping, falling, residual = side_of(not up, force == zero, memory, c)
        far_below = drift_of_backbone(-way * u, -way * force, stiffness, intercept, slope, capping, falling, residual)
        far_below = minimum(far_below, c[C.ULTIMATE_DRIFT])
        # The line ends at zero force if the backbone of the other side changes there, or if that of this side changes
        # when the hinge comes back, without being evaluated on the other side.
        to_zero = way * force / stiffness - way * u
        changes = is_steep(-way * u, -way * force, stiffness, intercept, slope, capping, falling, residual)
        changes = changes or steep or memory[M.LIFT] != zero
        if DETERIORATES:
            changes = changes or seen > zero
        far_below = wp.where(changes, minimum(far_below, to_zero), far_below)
        far_below -= margin + share * wp.abs(far_below)
        ends_here = on_backbone or far_below <= -way * u  # on the side of smaller forces
        far_below = maximum(far_below, -way * u)
        most = wp.where(on_backbone, end, far_above)
        least = wp.where(on_backbone, way * u, -far_below)
        side = wp.where(on_backbone, way, zero)
        is_lost = memory[M.SLOPE_LOSS_ABOVE] > one or memory[M.SLOPE_LOSS_BELOW] > one
        is_unknown = is_lost or (force == zero and (seen > zero or memory[M.LIFT] != zero or on_backbone))
        scale = one / c[C.INVERSE_YIELD_DRIFT]
        lower = wp.where(is_unknown, drift, scale * wp.where(up, least, -most))
        upper = wp.where(is_unknown, -far, scale * wp.where(up, most, -least))
        # The drift itself, whose product with the inverse yield drift was rounded, is within the limits. If it is one,
        # no rounding may move the limit beyond it, because the force may change its sign there.
        lower = wp.where(ends_here and up and not is_unknown, drift, minimum(lower, drift))
        upper = wp.where(
            ends_here and not up and not is_unknown, drift, wp.where(is_unknown, upper, maximum(upper, drift))
        )
        side = wp.where(is_unknown, zero, side)
        slope_now = wp.where(on_backbone, tangent, stiffness)
        slope_now = wp.where(is_lost and force == zero, zero, slope_now)
        return slope_now * c[C.INVERSE_YIELD_DRIFT] * c[C.YIELD_FORCE], lower, upper, side

    def memory_along_line(drift: Any, force: Any, memory: Any, c: Any):
        after = type(memory)(memory)
        u = drift * c[C.INVERSE_YIELD_DRIFT]
        # On an elastic line the force must not change its sign by rounding of the line's force.
        stiffness = type(drift)(1.0) - memory[M.STIFFNESS_LOSS]
        on_elastic_line = memory[M.FORCE] + stiffness * (u - memory[M.DRIFT])
        relative_force = wp.where(memory[M.STATE] < type(drift)(4.0), on_elastic_line, force / c[C.YIELD_FORCE])
        if DETERIORATES:
            mean_force = type(drift)(0.5) * (relative_force + memory[M.FORCE])
            after[M.ENERGY] = memory[M.ENERGY] + mean_force * (u - memory[M.DRIFT])
        turned = relative_force * memory[M.FORCE] < type(drift)(0.0)  # the line passes through zero force
        after[M.LIFT] = wp.where(turned, type(drift)(0.0), memory[M.LIFT])
        after[M.DRIFT] = u
        after[M.FORCE] = relative_force
        return after

    functions = device_functions(name, line, memory_along_line)
    return functions["line"], functions["memory_along_line"]
