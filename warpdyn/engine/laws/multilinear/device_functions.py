"""Kinematic backbones of several corners: elastic-perfectly-plastic springs side by side (Iwan 1967; Masing 1926).

A hardening spring stands beside as many yielding ones as the backbone has corners; the k-th yields at the drift of its
corner. The memory is the plastic drift of each.
"""

from typing import Any

import warp as wp

from warpdyn.engine.device.extrema import clamped
from warpdyn.engine.laws.law import Law
from warpdyn.engine.laws.multilinear.parameters import Coefficient as C, Quadrilinear, Trilinear
from warpdyn.engine.laws.row_functions import device_functions
from warpdyn.engine.laws.spring import Spring


def _multilinear(law: type[Law], corners: int) -> Spring:
    """Return the row of backbones of so many corners."""
    name = f"multilinear_{corners}"
    CORNERS = wp.constant(corners)

    def return_mapping(drift: Any, memory: Any, c: Any):
        plastic = type(memory)()
        for k in range(CORNERS):
            plastic[k] = clamped(memory[k], drift - c[2 * k + C.YIELD_DRIFT_1], drift + c[2 * k + C.YIELD_DRIFT_1])
        return plastic

    def force(drift: Any, memory: Any, c: Any):
        total = c[C.HARDENING_STIFFNESS] * drift
        for k in range(CORNERS):
            total += c[2 * k + C.STIFFNESS_1] * (
                drift - clamped(memory[k], drift - c[2 * k + C.YIELD_DRIFT_1], drift + c[2 * k + C.YIELD_DRIFT_1])
            )
        return total

    def elastic_energy(drift: Any, memory: Any, c: Any):
        total = c[C.HARDENING_STIFFNESS] * drift * drift
        for k in range(CORNERS):
            total += c[2 * k + C.STIFFNESS_1] * (drift - memory[k]) * (drift - memory[k])
        return type(drift)(0.5) * total

    def tangent(drift: Any, increment: Any, before: Any, after: Any, c: Any):
        stiffness = c[C.HARDENING_STIFFNESS]
        for k in range(CORNERS):
            if wp.abs(drift - before[k]) < c[2 * k + C.YIELD_DRIFT_1]:
                stiffness += c[2 * k + C.STIFFNESS_1]
        return stiffness

    def memory_after(drift: Any, increment: Any, memory: Any, c: Any):
        return return_mapping(drift, memory, c)

    functions = device_functions(name, return_mapping, force, elastic_energy, tangent, memory_after)
    return_mapping = functions["return_mapping"]
    return Spring(coefficients=len(law.rows[name]), memory=corners, **functions)


SPRINGS = {
    "multilinear_2": _multilinear(Trilinear, 2),
    "multilinear_3": _multilinear(Quadrilinear, 3),
}
