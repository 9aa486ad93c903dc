"""Device functions of the law Pinching4 (Lowes, Mitra and Altoontash 2003; OpenSees: Pinching4).

The law has a four-point backbone, pinching and damage. Drifts and forces are divided by the yield drift and yield force
of the positive side. Their signs are changed if the storey moves in the negative direction, so that one set of rules
serves both directions. A storey is on its backbone, or on a path of three straight segments from its last turning point
to the farthest point ahead. Damage is computed and used at turning points only; beyond the last corner of the backbone
it does not change.
"""

import enum
from typing import Any

import warp as wp

from warpdyn.engine.device.exponentials import power_of
from warpdyn.engine.device.extrema import maximum, minimum
from warpdyn.engine.laws.law import Layout
from warpdyn.engine.laws.pinching4.backbone_and_paths import (
    SLACK,
    pinching4_corners,
    pinching4_release,
    side_functions,
)
from warpdyn.engine.laws.pinching4.parameters import Coefficient as C, Negative as N, Pinching4
from warpdyn.engine.laws.row_functions import device_functions, kept_force
from warpdyn.engine.laws.spring import Spring

# The storey is elastic in both directions until its drift passes this value.
ELASTIC = wp.constant(wp.float64(1e-4))
# The target drift of a path is at least the smaller yield drift. A smaller value means that the storey is on its
# backbone.
ON_BACKBONE = wp.constant(wp.float64(0.5))
ON_PATH = wp.constant(wp.float64(0.75))


class M(Layout):
    """Memory of a storey: the history variables that its law keeps, in units of yield drift and yield force.

    The variables after LINE_END exist only with damage; CYCLES exists only if damage depends on the number of cycles.
    """

    DRIFT = enum.auto()  # drift at the last step
    FORCE = enum.auto()
    HEADING = enum.auto()  # signed: target drift of a path, or 1/2 on the backbone; 0 before the first step
    TURN_DRIFT = enum.auto()  # drift at the last turn
    TURN_FORCE = enum.auto()
    DEMAND_ABOVE = enum.auto()  # largest drift beyond yield
    DEMAND_BELOW = enum.auto()
    LINE_SLOPE = enum.auto()  # slope of the present straight segment
    LINE_END = enum.auto()
    STIFFNESS_LOSS = enum.auto()  # loss of the unloading stiffness at the last turn
    STRENGTH_LOSS = enum.auto()
    WAITING_STIFFNESS_LOSS = enum.auto()  # loss when the drift last passed the last corner
    WAITING_GROWTH = enum.auto()  # growth of the target drift when the drift last passed the last corner
    WAITING_STRENGTH_LOSS = enum.auto()
    ENERGY = enum.auto()
    CYCLES = enum.auto()  # number of cycles times 4 times the farthest drift


class Damage(Layout):
    """Coefficients of one kind of damage, in their order; LIMIT is the first of them."""

    LIMIT = enum.auto()
    BY_DRIFT = enum.auto()
    BY_USE = enum.auto()
    DRIFT_EXPONENT = enum.auto()
    USE_EXPONENT = enum.auto()


@wp.func
def pinching4_heading(x: Any, memory: Any):
    """Return the direction of a step to the drift x (1 or -1), and whether the storey has turned (changed direction).

    The direction of the first step is away from zero drift.
    """
    zero, one = type(x)(0.0), type(x)(1.0)
    before = wp.where(memory[M.HEADING] == zero, zero, wp.sign(memory[M.HEADING]))
    turned = before * (x - memory[M.DRIFT]) < zero
    return wp.where(before == zero, wp.where(x < zero, -one, one), wp.where(turned, -before, before)), turned


@wp.func
def pinching4_loss(first: int, reach: Any, spent: Any, counts: bool, is_exhausted: bool, c: Any):
    """Return the loss (or the growth) due to one kind of damage, a fraction.

    Args:
        first: Index of the first coefficient of this kind of damage.
        reach: Largest drift so far, divided by the drift at the last corner of the backbone.
        spent: Dissipated energy divided by the energy capacity, or number of cycles.
        counts: Whether `spent` contributes to the damage.
        is_exhausted: Whether the energy capacity is exhausted; then the loss is the limit of this kind of damage.
        c: Coefficients.
    """
    lost = c[first + Damage.BY_DRIFT] * power_of(reach, c[first + Damage.DRIFT_EXPONENT])
    more = c[first + Damage.BY_USE] * power_of(spent, c[first + Damage.USE_EXPONENT])
    lost = minimum(wp.where(counts, lost + more, lost), c[first])
    return wp.where(is_exhausted, c[first], lost)


def _pinching4(damage: str | None, ASYMMETRIC: bool = False) -> Spring:
    """Return the device functions of a variant of the law.

    `damage` is None without damage, "energy" if damage depends on the dissipated energy, or "cycle" if it depends on
    the number of cycles. ASYMMETRIC is True if the two sides differ.
    """
    DAMAGES, BY_CYCLES, name = damage is not None, damage == "cycle", f"pinching4_{damage}_damage"
    VALUES = len(M) if BY_CYCLES else int(M.CYCLES) if DAMAGES else int(M.STIFFNESS_LOSS)
    row = (name if DAMAGES else "pinching4") + "_asymmetric" * ASYMMETRIC
    name += "_asymmetric" * ASYMMETRIC
    backbone, of_side = side_functions(name, len(Pinching4.rows[row]) - len(N) if ASYMMETRIC else None)

    def losses(memory: Any, c: Any):
        """Return three fractions after the last step: stiffness loss, growth of the target drift, strength loss."""
        zero, one = type(memory[M.DRIFT])(0.0), type(memory[M.DRIFT])(1.0)
        stored = type(memory[M.DRIFT])(0.5) * memory[M.FORCE] * memory[M.FORCE] / (one - memory[M.STIFFNESS_LOSS])
        above, below = one + memory[M.DEMAND_ABOVE], one + memory[M.DEMAND_BELOW]
        if ASYMMETRIC:
            yields, _third, _drift, _force, _unloaded, _beyond = of_side(False, c)
            below = yields + memory[M.DEMAND_BELOW]
        farthest = maximum(above, below)
        spent = maximum(memory[M.ENERGY] - stored, zero) * c[C.INVERSE_ENERGY]
        counts = memory[M.ENERGY] > stored
        if BY_CYCLES:
            spent = memory[M.CYCLES] / (type(memory[M.DRIFT])(4.0) * farthest)
            counts = True
        is_exhausted = memory[M.ENERGY] * c[C.INVERSE_ENERGY] >= one
        strong, _slope, _end = backbone(above, True, c)
        weak, _steep, _there = backbone(below, False, c)
        secant = (one - memory[M.STRENGTH_LOSS]) * maximum(strong / above, weak / below)
        softer = pinching4_loss(
            C.STIFFNESS_DAMAGE_LIMIT, farthest * c[C.INVERSE_LAST_DUCTILITY], spent, counts, is_exhausted, c
        )
        softer = minimum(softer, maximum(one - secant, zero))  # unloading is at least as stiff as the secant
        growth = pinching4_loss(
            C.RELOADING_DAMAGE_LIMIT, farthest * c[C.INVERSE_LAST_DUCTILITY], spent, counts, is_exhausted, c
        )
        weaker = pinching4_loss(
            C.STRENGTH_DAMAGE_LIMIT, farthest * c[C.INVERSE_LAST_DUCTILITY], spent, counts, is_exhausted, c
        )
        stands = (
            wp.abs(memory[M.DRIFT]) * c[C.INVERSE_LAST_DUCTILITY] >= one
        )  # damage does not change beyond the last corner
        softer = wp.where(stands, memory[M.WAITING_STIFFNESS_LOSS], softer)
        growth = wp.where(stands, memory[M.WAITING_GROWTH], growth)
        return softer, growth, wp.where(stands, memory[M.WAITING_STRENGTH_LOSS], weaker)

    losses = device_functions(name, losses)["losses"]

    def leaves_line(drift: Any, memory: Any, c: Any):
        moved = drift * c[C.INVERSE_YIELD_DRIFT] - memory[M.DRIFT]
        to_end = memory[M.LINE_END] - drift * c[C.INVERSE_YIELD_DRIFT]
        return moved != type(drift)(0.0) and moved * to_end <= type(drift)(0.0)

    leaves_line = device_functions(name, leaves_line)["leaves_line"]

    def follow(drift: Any, memory: Any, c: Any):
        """Return the memory after a step to a drift, and the slope of the force there."""
        zero, one = type(drift)(0.0), type(drift)(1.0)
        x = drift * c[C.INVERSE_YIELD_DRIFT]
        way, turned = pinching4_heading(x, memory)
        is_up = way > zero
        here = way * x
        on_path, heading_on_backbone = type(x)(ON_PATH), type(x)(ON_BACKBONE)
        if ASYMMETRIC:
            yields_below, _third, _drift, _force, _unloaded, _beyond = of_side(False, c)
            on_path *= minimum(one, yields_below)
            heading_on_backbone *= minimum(one, yields_below)
        was_on_path = wp.abs(memory[M.HEADING]) > on_path
        yields, third_corner, reloading_drift, reloading_force, unloaded, unloaded_beyond = of_side(is_up, c)
        yields_left = one
        if ASYMMETRIC:
            yields_left, _third, _drift, _force, _unloaded, _beyond = of_side(not is_up, c)
        ahead = yields + wp.where(is_up, memory[M.DEMAND_ABOVE], memory[M.DEMAND_BELOW])
        left = wp.where(is_up, memory[M.DEMAND_BELOW], memory[M.DEMAND_ABOVE])
        aim = wp.where(turned, ahead, wp.abs(memory[M.HEADING]))
        # A turn from the backbone may increase the demand on the side that the storey leaves.
        demand = maximum(left, -way * memory[M.DRIFT] - yields_left)
        stiffness, strength = one, one
        if DAMAGES:
            softer, growth, weaker = (
                memory[M.WAITING_STIFFNESS_LOSS],
                memory[M.WAITING_GROWTH],
                memory[M.WAITING_STRENGTH_LOSS],
            )
            stands = wp.abs(x) * c[C.INVERSE_LAST_DUCTILITY] >= one
            if turned or stands:
                softer, growth, weaker = losses(memory, c)
            aim = wp.where(turned, ahead * (one + growth), aim)
            demand = maximum(demand, (yields_left + left) * (one + growth) - yields_left)
        demand = wp.where(turned and not was_on_path, demand, left)
        on_backbone = here > aim or not (turned or was_on_path)
        renews = turned and not (was_on_path and on_backbone)
        if DAMAGES:
            stiffness_loss = wp.where(renews, softer, memory[M.STIFFNESS_LOSS])
            strength_loss = wp.where(renews, weaker, memory[M.STRENGTH_LOSS])
            stiffness, strength = one - stiffness_loss, one - strength_loss
        target, _slope, _end = backbone(aim, is_up, c)
        x_turn = wp.where(turned, memory[M.DRIFT], memory[M.TURN_DRIFT])
        f_turn = wp.where(turned, memory[M.FORCE], memory[M.TURN_FORCE])
        x0, f0 = way * x_turn, way * f_turn
        low = strength * wp.where(ahead > third_corner, unloaded_beyond, unloaded)
        top = strength * target
        x1, f1, x2, f2 = pinching4_corners(x0, f0, aim, top, low, stiffness, is_up, reloading_drift, reloading_force)
        is_first = here < x1
        is_last = here >= x2
        xa = wp.where(is_first, x0, wp.where(is_last, x2, x1))
        fa = wp.where(is_first, f0, wp.where(is_last, f2, f1))
        end = wp.where(is_last, aim, wp.where(is_first, x1, x2))
        length = end - xa
        slope = (wp.where(is_last, top, wp.where(is_first, f1, f2)) - fa) / wp.where(length == zero, one, length)
        force = fa + (here - xa) * slope
        full, steep, corner = backbone(here, is_up, c)
        force = wp.where(on_backbone, strength * full, force)
        slope = wp.where(on_backbone, strength * steep, slope)
        end = wp.where(on_backbone, corner, end)
        # No segment of a path is stiffer than the first segment of the backbone. A force that is behind its path
        # changes with that stiffness until it reaches the path.
        steepest = way * memory[M.FORCE] + (here - way * memory[M.DRIFT])
        lags = force > steepest
        behind = (force - steepest) / wp.where(slope < one, one - slope, one)
        end = wp.where(lags and slope < one, minimum(end, here + behind), end)
        slope = wp.where(lags, one, slope)
        force = minimum(force, steepest)
        elastic = type(x)(ELASTIC)
        if ASYMMETRIC:
            elastic *= maximum(yields, yields_left)
        is_elastic = memory[M.HEADING] == zero and here <= elastic
        if DAMAGES:
            # A segment ends just before the drift beyond which damage does not change, so that rounding does not
            # matter.
            last = (one - type(x)(SLACK)) / c[C.INVERSE_LAST_DUCTILITY]
            end = wp.where(here < last, minimum(end, last), wp.where(stands, end, here))
        after = type(memory)()
        after[M.DRIFT] = x
        after[M.FORCE] = way * force
        after[M.HEADING] = wp.where(is_elastic, zero, way * wp.where(on_backbone, heading_on_backbone, aim))
        after[M.TURN_DRIFT] = x_turn
        after[M.TURN_FORCE] = f_turn
        after[M.DEMAND_ABOVE] = wp.where(is_up, memory[M.DEMAND_ABOVE], demand)
        after[M.DEMAND_BELOW] = wp.where(is_up, demand, memory[M.DEMAND_BELOW])
        # These two values are constant along a line: rounding must not change them.
        is_new = leaves_line(drift, memory, c)
        after[M.LINE_SLOPE] = wp.where(is_new, minimum(slope, one), memory[M.LINE_SLOPE])
        after[M.LINE_END] = wp.where(is_new, wp.where(is_elastic, x, way * end), memory[M.LINE_END])
        if DAMAGES:
            waits = stands and memory[M.HEADING] != zero
            after[M.STIFFNESS_LOSS] = stiffness_loss
            after[M.STRENGTH_LOSS] = strength_loss
            after[M.WAITING_STIFFNESS_LOSS] = wp.where(waits, softer, memory[M.WAITING_STIFFNESS_LOSS])
            after[M.WAITING_GROWTH] = wp.where(waits, growth, memory[M.WAITING_GROWTH])
            after[M.WAITING_STRENGTH_LOSS] = wp.where(waits, weaker, memory[M.WAITING_STRENGTH_LOSS])
            after[M.ENERGY] = memory[M.ENERGY] + type(x)(0.5) * (memory[M.FORCE] + after[M.FORCE]) * (
                x - memory[M.DRIFT]
            )
            if BY_CYCLES:
                below = one
                if ASYMMETRIC:
                    below = yields_below
                farther = maximum(one + after[M.DEMAND_ABOVE], below + after[M.DEMAND_BELOW]) / maximum(
                    one + memory[M.DEMAND_ABOVE], below + memory[M.DEMAND_BELOW]
                )
                after[M.CYCLES] = memory[M.CYCLES] * farther + wp.abs(x - memory[M.DRIFT])
        return after, slope

    follow = device_functions(name, follow)["follow"]

    def force(drift: Any, memory: Any, c: Any):
        after, _slope = follow(drift, memory, c)
        return c[C.YIELD_FORCE] * after[M.FORCE]

    def return_mapping(drift: Any, memory: Any, c: Any):
        after, _slope = follow(drift, memory, c)
        return after

    def memory_on_line(drift: Any, memory: Any, c: Any):
        after = type(memory)()
        for m in range(VALUES):
            after[m] = memory[m]
        moved = drift * c[C.INVERSE_YIELD_DRIFT] - memory[M.DRIFT]
        after[M.DRIFT] = drift * c[C.INVERSE_YIELD_DRIFT]
        after[M.FORCE] = memory[M.FORCE] + memory[M.LINE_SLOPE] * moved
        if DAMAGES:
            after[M.ENERGY] = memory[M.ENERGY] + type(drift)(0.5) * (memory[M.FORCE] + after[M.FORCE]) * moved
            if BY_CYCLES:
                after[M.CYCLES] = memory[M.CYCLES] + wp.abs(moved)
        return after

    def tangent_on_line(drift: Any, memory: Any, c: Any):
        # There is no line before the first step.
        slope = wp.where(memory[M.HEADING] == type(drift)(0.0), type(drift)(1.0), memory[M.LINE_SLOPE])
        return c[C.INVERSE_YIELD_DRIFT] * c[C.YIELD_FORCE] * slope

    def elastic_energy(drift: Any, memory: Any, c: Any):
        # Energy that unloading returns: along the present path, or along the path after a reversal at this drift.
        zero, one = type(drift)(0.0), type(drift)(1.0)
        way = wp.where(memory[M.FORCE] > zero, -one, one)
        is_up = way > zero
        on_path = type(drift)(ON_PATH)
        if ASYMMETRIC:
            yields_below, _third, _drift, _force, _unloaded, _beyond = of_side(False, c)
            on_path *= minimum(one, yields_below)
        unloads = way * memory[M.HEADING] > on_path
        yields, third_corner, reloading_drift, reloading_force, unloaded, unloaded_beyond = of_side(is_up, c)
        ahead = yields + wp.where(is_up, memory[M.DEMAND_ABOVE], memory[M.DEMAND_BELOW])
        aim, stiffness, strength = ahead, one, one
        if DAMAGES:
            softer, growth, weaker = losses(memory, c)
            aim = wp.where(unloads, way * memory[M.HEADING], ahead * (one + growth))
            stiffness = one - wp.where(unloads, memory[M.STIFFNESS_LOSS], softer)
            strength = one - wp.where(unloads, memory[M.STRENGTH_LOSS], weaker)
        target, _slope, _end = backbone(aim, is_up, c)
        here, end = way * memory[M.DRIFT], strength * target
        x0 = wp.where(unloads, way * memory[M.TURN_DRIFT], here)
        f0 = way * wp.where(unloads, memory[M.TURN_FORCE], memory[M.FORCE])
        low = strength * wp.where(ahead > third_corner, unloaded_beyond, unloaded)
        x1, f1, x2, f2 = pinching4_corners(x0, f0, aim, end, low, stiffness, is_up, reloading_drift, reloading_force)
        energy = pinching4_release(here, x0, f0, x1, f1) + pinching4_release(here, x1, f1, x2, f2)
        return c[C.YIELD_FORCE] / c[C.INVERSE_YIELD_DRIFT] * (energy + pinching4_release(here, x2, f2, aim, end))

    def tangent(drift: Any, increment: Any, before: Any, after: Any, c: Any):
        _after, slope = follow(drift, before, c)
        return c[C.INVERSE_YIELD_DRIFT] * c[C.YIELD_FORCE] * slope

    def memory_after(drift: Any, increment: Any, memory: Any, c: Any):
        after, _slope = follow(drift, memory, c)
        return after

    functions = device_functions(
        name, force, return_mapping, elastic_energy, tangent, memory_after, memory_on_line, tangent_on_line
    )
    return Spring(
        coefficients=len(Pinching4.rows[row]),
        memory=VALUES,
        leaves_line=leaves_line,
        force_at_accepted_state=kept_force,
        **functions,
    )


SPRINGS = {
    "pinching4": _pinching4(None),
    "pinching4_energy_damage": _pinching4("energy"),
    "pinching4_cycle_damage": _pinching4("cycle"),
    "pinching4_asymmetric": _pinching4(None, True),
    "pinching4_energy_damage_asymmetric": _pinching4("energy", True),
    "pinching4_cycle_damage_asymmetric": _pinching4("cycle", True),
}
