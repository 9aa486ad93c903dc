"""Device functions of the law Hysteretic (as in OpenSees).

The law has a trilinear backbone, pinching, damage by ductility and energy, and an unloading stiffness that decreases.
Drifts and forces are divided by the yield drift and yield force of the positive side. Their signs are changed if the
storey moves in the negative direction, so that one set of rules serves both directions ("ahead" is the direction of
movement). A line of the loop has two ends; if the storey leaves it when it turns back, its end behind the storey is the
drift of the last step.
"""

import enum
from typing import Any

import warp as wp

from warpdyn.engine.device.exponentials import power_of
from warpdyn.engine.device.extrema import clamped, maximum, minimum
from warpdyn.engine.laws.hysteretic.parameters import Coefficient as C, Hysteretic
from warpdyn.engine.laws.law import Layout
from warpdyn.engine.laws.row_functions import device_functions, kept_force
from warpdyn.engine.laws.spring import Spring

FARTHEST = wp.constant(wp.float64(1e16))  # [m] limit of a target drift, which damage increases in each cycle
# A line ends just before zero force: the rules depend on the sign of the force, and rounding must not decide it.
LEAST_FORCE = wp.constant(wp.float64(1e-3))
NO_END = wp.constant(wp.float64(1e30))


class M(Layout):
    """Memory of a storey: the history variables that its law keeps from step to step.

    Drifts and forces are divided by those at yield on the positive side.
    """

    DRIFT = enum.auto()  # drift at the last step
    FORCE = enum.auto()
    FARTHEST_AHEAD = enum.auto()  # target drift of reloading on the positive side; damage increases it
    FARTHEST_BEHIND = enum.auto()
    WORK = enum.auto()
    LOWER_END = enum.auto()  # drifts between which the storey stays on its line
    UPPER_END = enum.auto()
    DIRECTION = enum.auto()  # direction of the last step
    RELEASED_BEHIND = enum.auto()  # drift at which the last unloading from the negative side reached zero force
    RELEASED_AHEAD = enum.auto()  # drift at which the last unloading from the positive side reached zero force
    LINE_SLOPE = enum.auto()


MEMORY = wp.constant(len(M))


@wp.func
def hysteretic_backbone(x: Any, c: Any):
    """Return the force of the backbone at a drift x >= 0, and its slope on the side of x nearer to zero drift.

    Drifts are divided by the yield drift, forces by the yield force, slopes by the initial stiffness.
    """
    zero, one = type(x)(0.0), type(x)(1.0)
    second = x - one
    third = second - c[C.SECOND_LENGTH]
    force = (
        minimum(x, one)
        + c[C.SECOND_SLOPE] * clamped(second, zero, c[C.SECOND_LENGTH])
        + c[C.THIRD_SLOPE] * clamped(third, zero, c[C.THIRD_LENGTH])
    )
    slope = wp.where(third <= c[C.THIRD_LENGTH], c[C.THIRD_SLOPE], zero)
    slope = wp.where(third <= zero, c[C.SECOND_SLOPE], slope)
    return force, wp.where(second <= zero, one, slope)


@wp.func
def hysteretic_backbone_of_side(x: Any, is_positive: bool, c: Any):
    """Return the force of the backbone of one side at a drift x, and its slope on the side of x nearer to zero drift.

    The backbones of the two sides differ. Drifts, forces and slopes are divided by yield drift, yield force and initial
    stiffness of the positive side.
    """
    zero = type(x)(0.0)
    stiffness = wp.where(is_positive, type(x)(1.0), c[C.STIFFNESS_NEGATIVE])
    yields = wp.where(is_positive, type(x)(1.0), c[C.YIELD_DRIFT_NEGATIVE])
    second_length = wp.where(is_positive, c[C.SECOND_LENGTH], c[C.SECOND_LENGTH_NEGATIVE])
    second_slope = wp.where(is_positive, c[C.SECOND_SLOPE], c[C.SECOND_SLOPE_NEGATIVE])
    third_length = wp.where(is_positive, c[C.THIRD_LENGTH], c[C.THIRD_LENGTH_NEGATIVE])
    third_slope = wp.where(is_positive, c[C.THIRD_SLOPE], c[C.THIRD_SLOPE_NEGATIVE])
    second = x - yields
    third = second - second_length
    force = stiffness * minimum(x, yields) + second_slope * clamped(second, zero, second_length)
    force += third_slope * clamped(third, zero, third_length)
    slope = wp.where(third <= third_length, third_slope, zero)
    slope = wp.where(third <= zero, second_slope, slope)
    return force, wp.where(second <= zero, stiffness, slope)


def _step_function(name: str, ASYMMETRIC: bool) -> wp.Function:
    """Return the device function of a step, for storeys with equal (symmetric) or different backbones on both sides."""

    def backbone(x: Any, is_positive: bool, c: Any):
        if ASYMMETRIC:
            return hysteretic_backbone_of_side(x, is_positive, c)
        return hysteretic_backbone(x, c)

    backbone = device_functions(name, backbone)["backbone"]

    def behind_yield(is_up: bool, c: Any):
        """Return the yield drift, and the drift at the end of the second segment, of the side that the storey leaves.

        A step in the positive direction leaves the negative side. Drifts are divided by the yield drift of the positive
        side.
        """
        if ASYMMETRIC:
            yields = wp.where(is_up, c[C.YIELD_DRIFT_NEGATIVE], type(c[0])(1.0))
            return yields, yields + wp.where(is_up, c[C.SECOND_LENGTH_NEGATIVE], c[C.SECOND_LENGTH])
        one = type(c[0])(1.0)
        return one, one + c[C.SECOND_LENGTH]

    behind_yield = device_functions(name, behind_yield)["behind_yield"]

    def hysteretic_step(x: Any, is_up: bool, memory: Any, c: Any, flexibility_ahead: Any, flexibility_behind: Any):
        """Return the state of a storey after a step to the drift x, upwards (in the positive direction) if `is_up`.

        The results are the force, the slope, the direction, the target drift ahead, and the drift at which unloading
        from behind reached zero force; then the slope of the line that the storey follows from there, and the drift at
        which this line ends. Force and drifts have changed signs if the storey moves in the negative direction. A
        flexibility is 1 / (unloading stiffness).
        """
        zero, one = type(x)(0.0), type(x)(1.0)
        way = wp.where(is_up, one, -one)
        ahead = wp.where(is_up, memory[M.FARTHEST_AHEAD], memory[M.FARTHEST_BEHIND])
        behind = wp.where(is_up, memory[M.FARTHEST_BEHIND], memory[M.FARTHEST_AHEAD])
        released = wp.where(is_up, memory[M.RELEASED_BEHIND], memory[M.RELEASED_AHEAD])
        here, last, before = way * x, way * memory[M.DRIFT], way * memory[M.FORCE]
        moved = here - last
        yields_ahead, second_slope, second_length = one, c[C.SECOND_SLOPE], c[C.SECOND_LENGTH]
        third_slope, third_length, first_slope = c[C.THIRD_SLOPE], c[C.THIRD_LENGTH], one
        second_is_gone, third_is_gone = c[C.SECOND_IS_GONE], c[C.THIRD_IS_GONE]
        if ASYMMETRIC:
            yields_ahead = wp.where(is_up, one, c[C.YIELD_DRIFT_NEGATIVE])
            first_slope = wp.where(is_up, one, c[C.STIFFNESS_NEGATIVE])
            second_slope = wp.where(is_up, second_slope, c[C.SECOND_SLOPE_NEGATIVE])
            second_length = wp.where(is_up, second_length, c[C.SECOND_LENGTH_NEGATIVE])
            third_slope = wp.where(is_up, third_slope, c[C.THIRD_SLOPE_NEGATIVE])
            third_length = wp.where(is_up, third_length, c[C.THIRD_LENGTH_NEGATIVE])
            # These values belong to the side that the storey leaves.
            second_is_gone = wp.where(is_up, c[C.SECOND_IS_GONE_NEGATIVE], second_is_gone)
            third_is_gone = wp.where(is_up, c[C.THIRD_IS_GONE_NEGATIVE], third_is_gone)
        yields_behind, third_behind = behind_yield(is_up, c)
        releases = (way * memory[M.DIRECTION] < zero) and (before <= zero)
        stored = type(x)(0.5) * before * before * flexibility_behind
        plastic = behind - yields_behind
        if ASYMMETRIC:
            plastic /= yields_behind
        damage = wp.where(
            behind > yields_behind,
            c[C.DAMAGE_BY_ENERGY] * (memory[M.WORK] - stored) + c[C.DAMAGE_BY_DUCTILITY] * plastic,
            zero,
        )
        released = wp.where(releases, last - before * flexibility_behind, released)
        target = clamped(
            wp.where(releases, ahead * (one + damage), ahead),
            yields_ahead,
            type(x)(FARTHEST) * c[C.INVERSE_YIELD_DRIFT],
        )
        strength, slope = backbone(target, is_up, c)
        # If the backbone of a side has fallen to zero force, the force is zero again until the drift at which it fell
        # to zero.
        gone = wp.where(behind <= third_behind, second_is_gone, third_is_gone)
        start = maximum(wp.where(behind <= yields_behind, released, -gone), released)
        pinched = c[C.PINCHING_FORCE] * strength
        bend = start + (target - (strength - pinched) * flexibility_ahead - start) * c[C.PINCHING_DRIFT]
        is_first = here < bend
        length = wp.where(is_first, bend - start, target - bend)
        rise = wp.where(is_first, pinched, strength - pinched) / wp.where(length > zero, length, one)
        towards = wp.where(is_first, zero, pinched) + (here - wp.where(is_first, start, bend)) * rise
        elastic = before + moved / flexibility_ahead
        force = minimum(elastic, towards)
        slope = wp.where(elastic < towards, one / flexibility_ahead, rise)
        # The line from this step on: no steeper than unloading, up to the reloading line or to its end.
        stiff = one / flexibility_ahead
        slope_from_here = wp.where(elastic < towards, stiff, minimum(rise, stiff))
        end = wp.where(is_first, minimum(bend, target), target)
        meets = elastic < towards and stiff > rise
        end = wp.where(meets, minimum(here + (towards - elastic) / wp.where(meets, stiff - rise, one), end), end)
        is_gap = is_first and here <= start
        end = wp.where(is_gap, minimum(end, start), end)
        end = wp.where(releases, here, end)  # a damaged side unloads more softly from the next step on
        unloaded = before + moved / flexibility_behind
        is_unloading = here < released
        is_idle = wp.where(is_unloading, unloaded >= zero, is_gap)
        force = wp.where(is_unloading, unloaded, force)
        slope = wp.where(is_unloading, one / flexibility_behind, slope)
        force = wp.where(is_idle, zero, force)
        slope = wp.where(is_idle, zero, slope)
        slope_from_here = wp.where(is_unloading or is_idle, slope, slope_from_here)
        end = wp.where(is_unloading, released - type(x)(LEAST_FORCE) * flexibility_behind, end)
        on_backbone = here >= ahead
        full, steep = backbone(here, is_up, c)
        on_third = here >= yields_ahead + second_length
        is_last = here >= yields_ahead + second_length + third_length
        slope_after = wp.where(
            on_third,
            wp.where(is_last, zero, third_slope),
            wp.where(here < yields_ahead, first_slope, second_slope),
        )
        corner = wp.where(
            on_third,
            wp.where(is_last, type(x)(NO_END), yields_ahead + second_length + third_length),
            yields_ahead + second_length,
        )
        corner = wp.where(here < yields_ahead, yields_ahead, corner)
        slope_from_here = wp.where(on_backbone, slope_after, slope_from_here)
        end = wp.where(on_backbone, corner, end)
        force = wp.where(on_backbone, full, force)
        slope = wp.where(on_backbone, steep, slope)
        target = wp.where(on_backbone, here, target)
        released = wp.where(on_backbone, wp.where(is_up, memory[M.RELEASED_BEHIND], memory[M.RELEASED_AHEAD]), released)
        return force, slope, way, target, released, slope_from_here, end

    return device_functions(name, hysteretic_step)["hysteretic_step"]


def _hysteretic(name: str, SOFTENS: bool, ASYMMETRIC: bool) -> Spring:
    """Return the device functions of a variant of the law.

    SOFTENS is True if the law has an unloading exponent, which needs two powers per force. ASYMMETRIC is True if the
    backbones of the two sides differ.
    """
    hysteretic_step = _step_function(name, ASYMMETRIC)

    def flexibility(farthest: Any, is_positive: bool, c: Any):
        """Return 1 / (unloading stiffness) of a side, for its farthest drift so far."""
        one = type(farthest)(1.0)
        if ASYMMETRIC:
            stiffness = wp.where(is_positive, one, c[C.STIFFNESS_NEGATIVE])
            yields = wp.where(is_positive, one, c[C.YIELD_DRIFT_NEGATIVE])
            reached = maximum(farthest, yields)
            strong, _slope = hysteretic_backbone_of_side(reached, is_positive, c)
            softened = power_of(reached / yields, c[C.UNLOADING_EXPONENT])
            return minimum(softened / stiffness, reached / maximum(strong, stiffness * yields))
        if SOFTENS:
            # The unloading stiffness is at least that of the line to the origin. If the backbone is below yield, it is
            # elastic.
            reach = maximum(farthest, one)
            strength, _steep = hysteretic_backbone(reach, c)
            return minimum(power_of(reach, c[C.UNLOADING_EXPONENT]), reach / maximum(strength, one))
        return one

    flexibility = device_functions(name, flexibility)["flexibility"]

    def step(drift: Any, memory: Any, c: Any):
        x = drift * c[C.INVERSE_YIELD_DRIFT]
        above = flexibility(memory[M.FARTHEST_AHEAD], True, c)
        below = flexibility(memory[M.FARTHEST_BEHIND], False, c)
        is_up = x >= memory[M.DRIFT]
        return hysteretic_step(x, is_up, memory, c, wp.where(is_up, above, below), wp.where(is_up, below, above))

    step = device_functions(name, step)["step"]

    def force(drift: Any, memory: Any, c: Any):
        now, _slope, way, _ahead, _released, _slope_from_here, _end = step(drift, memory, c)
        return c[C.YIELD_FORCE] * wp.where(
            drift * c[C.INVERSE_YIELD_DRIFT] == memory[M.DRIFT], memory[M.FORCE], way * now
        )

    def leaves_line(drift: Any, memory: Any, c: Any):
        x = drift * c[C.INVERSE_YIELD_DRIFT]
        return x < memory[M.LOWER_END] or x > memory[M.UPPER_END]

    leaves_line = device_functions(name, leaves_line)["leaves_line"]

    def memory_on_line(drift: Any, memory: Any, c: Any):
        x = drift * c[C.INVERSE_YIELD_DRIFT]
        after = type(memory)()
        after[M.DRIFT] = x
        after[M.FORCE] = memory[M.FORCE] + memory[M.LINE_SLOPE] * (x - memory[M.DRIFT])
        # The farthest drifts grow only on the backbone.
        after[M.FARTHEST_AHEAD] = maximum(memory[M.FARTHEST_AHEAD], x)
        after[M.FARTHEST_BEHIND] = maximum(memory[M.FARTHEST_BEHIND], -x)
        after[M.WORK] = memory[M.WORK] + type(drift)(0.5) * (memory[M.FORCE] + after[M.FORCE]) * (x - memory[M.DRIFT])
        after[M.LOWER_END] = wp.where(memory[M.LOWER_END] == memory[M.DRIFT], x, memory[M.LOWER_END])
        after[M.UPPER_END] = wp.where(memory[M.UPPER_END] == memory[M.DRIFT], x, memory[M.UPPER_END])
        after[M.DIRECTION] = memory[M.DIRECTION]
        after[M.RELEASED_BEHIND] = memory[M.RELEASED_BEHIND]
        after[M.RELEASED_AHEAD] = memory[M.RELEASED_AHEAD]
        after[M.LINE_SLOPE] = memory[M.LINE_SLOPE]
        return after

    def tangent_on_line(drift: Any, memory: Any, c: Any):
        # A line without length, such as the first one, has no slope: a storey that has not moved is elastic.
        is_empty = memory[M.LOWER_END] == memory[M.UPPER_END]
        slope = wp.where(is_empty, type(drift)(1.0), memory[M.LINE_SLOPE])
        return c[C.INVERSE_YIELD_DRIFT] * c[C.YIELD_FORCE] * slope

    def return_mapping(drift: Any, memory: Any, c: Any):
        x = drift * c[C.INVERSE_YIELD_DRIFT]
        now, _slope, way, ahead, released, slope_from_here, end = step(drift, memory, c)
        is_up = way > type(drift)(0.0)
        after = type(memory)()
        after[M.DRIFT] = x
        after[M.FORCE] = way * now
        after[M.FARTHEST_AHEAD] = wp.where(is_up, ahead, memory[M.FARTHEST_AHEAD])
        after[M.FARTHEST_BEHIND] = wp.where(is_up, memory[M.FARTHEST_BEHIND], ahead)
        after[M.WORK] = memory[M.WORK] + type(drift)(0.5) * (memory[M.FORCE] + after[M.FORCE]) * (x - memory[M.DRIFT])
        after[M.DIRECTION] = way
        after[M.RELEASED_BEHIND] = wp.where(is_up, released, memory[M.RELEASED_BEHIND])
        after[M.RELEASED_AHEAD] = wp.where(is_up, memory[M.RELEASED_AHEAD], released)
        # If both sides have a target drift and neither has yielded, the line continues in both directions.
        one = type(drift)(1.0)
        is_elastic = after[M.FARTHEST_AHEAD] == one and after[M.FARTHEST_BEHIND] == one and wp.abs(x) < one
        if ASYMMETRIC:
            is_elastic = False
        after[M.LOWER_END] = wp.where(is_elastic, -one, wp.where(is_up, x, -end))
        after[M.UPPER_END] = wp.where(is_elastic, one, wp.where(is_up, end, x))
        after[M.LINE_SLOPE] = wp.where(is_elastic, one, slope_from_here)
        if not leaves_line(drift, memory, c):
            after[M.LOWER_END] = wp.where(memory[M.LOWER_END] == memory[M.DRIFT], x, memory[M.LOWER_END])
            after[M.UPPER_END] = wp.where(memory[M.UPPER_END] == memory[M.DRIFT], x, memory[M.UPPER_END])
            after[M.LINE_SLOPE] = memory[M.LINE_SLOPE]
        stands = x == memory[M.DRIFT]
        for i in range(MEMORY):
            after[i] = wp.where(stands, memory[i], after[i])
        return after

    def elastic_energy(drift: Any, memory: Any, c: Any):
        farthest = wp.where(memory[M.FORCE] > type(drift)(0.0), memory[M.FARTHEST_AHEAD], memory[M.FARTHEST_BEHIND])
        return (
            type(drift)(0.5)
            * c[C.YIELD_FORCE]
            / c[C.INVERSE_YIELD_DRIFT]
            * memory[M.FORCE]
            * memory[M.FORCE]
            * flexibility(farthest, memory[M.FORCE] > type(drift)(0.0), c)
        )

    def tangent(drift: Any, increment: Any, before: Any, after: Any, c: Any):
        _now, slope, _way, _ahead, _released, _slope_from_here, _end = step(drift, before, c)
        return c[C.INVERSE_YIELD_DRIFT] * c[C.YIELD_FORCE] * slope

    def memory_after(drift: Any, increment: Any, memory: Any, c: Any):
        return return_mapping(drift, memory, c)

    functions = device_functions(
        name, force, return_mapping, memory_on_line, tangent_on_line, elastic_energy, tangent, memory_after
    )
    return_mapping = functions["return_mapping"]
    return Spring(
        coefficients=len(Hysteretic.rows[name]),
        memory=len(M),
        values_on_line=int(M.DIRECTION),
        leaves_line=leaves_line,
        force_at_accepted_state=kept_force,
        **functions,
    )


SPRINGS = {
    "hysteretic": _hysteretic("hysteretic", False, False),
    "hysteretic_softer_unloading": _hysteretic("hysteretic_softer_unloading", True, False),
    "hysteretic_asymmetric": _hysteretic("hysteretic_asymmetric", True, True),
}
