"""Device functions of the bilinear law with kinematic hardening.

A hardening spring acts in parallel with an elastic-perfectly-plastic spring. The memory is the plastic drift. The
return mapping limits the plastic drift to the range from (drift - yield drift) to (drift + yield drift).
"""

import enum
from typing import Any

import warp as wp

from warpdyn.engine.device.extrema import clamped
from warpdyn.engine.laws.bilinear.parameters import Coefficient as C
from warpdyn.engine.laws.law import Layout
from warpdyn.engine.laws.spring import Spring

FAR = wp.constant(wp.float64(1e30))  # a drift that no storey reaches


class M(Layout):
    """Memory of a storey: the history variable that its law keeps from step to step."""

    PLASTIC_DRIFT = enum.auto()


@wp.func
def bilinear_return_mapping(drift: Any, memory: Any, c: Any):
    plastic = type(memory)()
    plastic[M.PLASTIC_DRIFT] = clamped(memory[M.PLASTIC_DRIFT], drift - c[C.YIELD_DRIFT], drift + c[C.YIELD_DRIFT])
    return plastic


@wp.func
def bilinear_force(drift: Any, memory: Any, c: Any):
    # Warp compiles -y as a subtraction from zero, which costs more than this product.
    elastic = clamped(drift - memory[M.PLASTIC_DRIFT], type(drift)(-1.0) * c[C.YIELD_DRIFT], c[C.YIELD_DRIFT])
    return c[C.HARDENING_STIFFNESS] * drift + c[C.YIELDING_STIFFNESS] * elastic


@wp.func
def bilinear_force_after_mapping(drift: Any, memory: Any, c: Any):
    return c[C.HARDENING_STIFFNESS] * drift + c[C.YIELDING_STIFFNESS] * (drift - memory[M.PLASTIC_DRIFT])


@wp.func
def bilinear_elastic_energy(drift: Any, memory: Any, c: Any):
    elastic = drift - memory[M.PLASTIC_DRIFT]
    return type(drift)(0.5) * (c[C.HARDENING_STIFFNESS] * drift * drift + c[C.YIELDING_STIFFNESS] * elastic * elastic)


@wp.func
def bilinear_tangent(drift: Any, increment: Any, before: Any, after: Any, c: Any):
    stiffness = c[C.HARDENING_STIFFNESS]
    if wp.abs(drift - before[M.PLASTIC_DRIFT]) < c[C.YIELD_DRIFT]:
        stiffness += c[C.YIELDING_STIFFNESS]
    return stiffness


@wp.func
def bilinear_memory_after(drift: Any, increment: Any, memory: Any, c: Any):
    return bilinear_return_mapping(drift, memory, c)


@wp.func
def bilinear_line(drift: Any, memory: Any, c: Any):
    zero = type(drift)(0.0)
    far = type(drift)(FAR)
    plastic = memory[M.PLASTIC_DRIFT]
    # The return mapping has set the plastic drift to one of these values if the spring yields.
    yields_up = plastic <= drift - c[C.YIELD_DRIFT]
    yields_down = plastic >= drift + c[C.YIELD_DRIFT]
    side = wp.where(yields_up, type(drift)(1.0), wp.where(yields_down, -type(drift)(1.0), zero))
    slope = c[C.HARDENING_STIFFNESS] + wp.where(side == zero, c[C.YIELDING_STIFFNESS], zero)
    least = wp.where(yields_up, drift, wp.where(yields_down, -far, plastic - c[C.YIELD_DRIFT]))
    most = wp.where(yields_down, drift, wp.where(yields_up, far, plastic + c[C.YIELD_DRIFT]))
    return slope, least, most, side


@wp.func
def bilinear_memory_along_line(drift: Any, force: Any, memory: Any, c: Any):
    return bilinear_return_mapping(drift, memory, c)


SPRINGS = {
    "bilinear": Spring(
        bilinear_force,
        bilinear_return_mapping,
        bilinear_elastic_energy,
        coefficients=len(C),
        tangent=bilinear_tangent,
        memory=len(M),
        memory_after=bilinear_memory_after,
        force_after_mapping=bilinear_force_after_mapping,
        line=bilinear_line,
        memory_along_line=bilinear_memory_along_line,
    ),
}
