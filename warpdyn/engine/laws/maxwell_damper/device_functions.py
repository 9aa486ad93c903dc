"""Device functions of viscous dampers in series with a brace.

The memory of a storey is the force divided by the damper coefficient [m/s].
"""

import enum
from typing import Any

import warp as wp

from warpdyn.engine.device.exponentials import power_of
from warpdyn.engine.laws.law import Layout
from warpdyn.engine.laws.maxwell_damper.parameters import Coefficient as C, MaxwellDamper
from warpdyn.engine.laws.row_functions import device_functions
from warpdyn.engine.laws.spring import Spring


class M(Layout):
    """Memory of a storey: the history variable that its damper keeps from step to step."""

    FORCE = enum.auto()  # force divided by the damper coefficient


def _maxwell_damper(row: str, POWER: bool) -> Spring:
    """Return the device functions of linear dampers (POWER is False) or of dampers with a velocity exponent."""

    def force(drift: Any, memory: Any, c: Any):
        return c[C.DAMPER_COEFFICIENT] * memory[M.FORCE]

    def elastic_energy(drift: Any, memory: Any, c: Any):
        return c[C.HALF_FLEXIBILITY] * memory[M.FORCE] * memory[M.FORCE]

    def rate(velocity: Any, memory: Any, c: Any):
        of_damper = memory[M.FORCE]
        if POWER:
            of_damper = wp.sign(memory[M.FORCE]) * power_of(wp.abs(memory[M.FORCE]), c[C.INVERSE_EXPONENT])
        slope = type(memory)()
        slope[M.FORCE] = c[C.STIFFNESS_RATIO] * (velocity - of_damper)
        return slope

    def relaxation_rate(velocity: Any, memory: Any, c: Any):
        fastest = c[C.STIFFNESS_RATIO]
        if POWER:
            one = type(velocity)(1.0)
            fastest *= c[C.INVERSE_EXPONENT] * power_of(wp.abs(memory[M.FORCE]), c[C.INVERSE_EXPONENT] - one)
        return fastest

    # In quasi-static analyses the force has relaxed to 0.
    def memory_after(drift: Any, increment: Any, memory: Any, c: Any):
        return type(memory)()

    def tangent(drift: Any, increment: Any, before: Any, after: Any, c: Any):
        return type(drift)(0.0)

    functions = device_functions(row, force, elastic_energy, rate, relaxation_rate, memory_after, tangent)
    return Spring(return_mapping=None, coefficients=len(MaxwellDamper.rows[row]), memory=len(M), **functions)


SPRINGS = {
    "maxwell_damper": _maxwell_damper("maxwell_damper", False),
    "maxwell_damper_power": _maxwell_damper("maxwell_damper_power", True),
}
