"""Device functions of backbones with several corners and kinematic hardening.

The storey consists of springs in parallel (Iwan 1967; Masing 1926): an elastic spring with the hardening stiffness, and
one elastic-perfectly-plastic spring for each corner of the backbone, which yields at the drift of its corner. The
memory is the plastic drift of each yielding spring. In an asymmetric storey, a spring yields at a different drift in
each direction.
"""

from typing import Any

import warp as wp

from warpdyn.engine.device.extrema import clamped
from warpdyn.engine.laws.law import Law
from warpdyn.engine.laws.multilinear.parameters import Coefficient as C, Quadrilinear, Trilinear
from warpdyn.engine.laws.row_functions import device_functions
from warpdyn.engine.laws.spring import Spring


def _multilinear(law: type[Law], corners: int) -> Spring:
    """Return the device functions of storeys with the same backbone on both sides, with this number of corners."""
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


def _asymmetric(law: type[Law], corners: int) -> Spring:
    """Return the device functions of storeys with different backbones on both sides, each with `corners` corners."""
    name = f"multilinear_{corners}_asymmetric"
    names = law.rows[name]
    SPRINGS_IN_PARALLEL = wp.constant(len(names) // 3)

    def plastic_drift(drift: Any, before: Any, above: Any, below: Any):
        return clamped(before, drift - above, drift + below)

    plastic_drift = device_functions(name, plastic_drift)["plastic_drift"]

    def return_mapping(drift: Any, memory: Any, c: Any):
        plastic = type(memory)()
        for k in range(SPRINGS_IN_PARALLEL):
            plastic[k] = plastic_drift(drift, memory[k], c[3 * k + 2], c[3 * k + 3])
        return plastic

    def force(drift: Any, memory: Any, c: Any):
        total = c[C.HARDENING_STIFFNESS] * drift
        for k in range(SPRINGS_IN_PARALLEL):
            total += c[3 * k + 1] * (drift - plastic_drift(drift, memory[k], c[3 * k + 2], c[3 * k + 3]))
        return total

    def elastic_energy(drift: Any, memory: Any, c: Any):
        total = c[C.HARDENING_STIFFNESS] * drift * drift
        for k in range(SPRINGS_IN_PARALLEL):
            total += c[3 * k + 1] * (drift - memory[k]) * (drift - memory[k])
        return type(drift)(0.5) * total

    def tangent(drift: Any, increment: Any, before: Any, after: Any, c: Any):
        stiffness = c[C.HARDENING_STIFFNESS]
        for k in range(SPRINGS_IN_PARALLEL):
            elastic = drift - before[k]
            if elastic < c[3 * k + 2] and elastic > -c[3 * k + 3]:
                stiffness += c[3 * k + 1]
        return stiffness

    def memory_after(drift: Any, increment: Any, memory: Any, c: Any):
        return return_mapping(drift, memory, c)

    functions = device_functions(name, return_mapping, force, elastic_energy, tangent, memory_after)
    return_mapping = functions["return_mapping"]
    return Spring(coefficients=len(names), memory=len(names) // 3, **functions)


SPRINGS = {
    "multilinear_2": _multilinear(Trilinear, 2),
    "multilinear_3": _multilinear(Quadrilinear, 3),
    "multilinear_2_asymmetric": _asymmetric(Trilinear, 2),
    "multilinear_3_asymmetric": _asymmetric(Quadrilinear, 3),
}
