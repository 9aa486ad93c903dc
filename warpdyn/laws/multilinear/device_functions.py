"""Kinematic backbones of several corners: elastic-perfectly-plastic springs side by side (Iwan 1967; Masing 1926).

A hardening spring c0 stands beside as many sliding ones as the backbone has corners; the k-th has the stiffness c(2k
- 1) and yields at the drift c(2k) of its corner. The memory is the plastic drift of each.
"""

from typing import Any

import warp as wp

from warpdyn.laws.row_functions import device_functions
from warpdyn.laws.spring import Spring


def _multilinear(corners: int) -> Spring:
    """Return the row of backbones of so many corners."""
    CORNERS = wp.constant(corners)

    def evolve(drift: Any, memory: Any, c: Any):
        plastic = type(memory)()
        for k in range(CORNERS):
            plastic[k] = wp.clamp(memory[k], drift - c[2 * k + 2], drift + c[2 * k + 2])
        return plastic

    def force(drift: Any, memory: Any, c: Any):
        total = c[0] * drift
        for k in range(CORNERS):
            total += c[2 * k + 1] * (drift - wp.clamp(memory[k], drift - c[2 * k + 2], drift + c[2 * k + 2]))
        return total

    def recoverable(drift: Any, memory: Any, c: Any):
        total = c[0] * drift * drift
        for k in range(CORNERS):
            total += c[2 * k + 1] * (drift - memory[k]) * (drift - memory[k])
        return type(drift)(0.5) * total

    def tangent(drift: Any, increment: Any, before: Any, after: Any, c: Any):
        stiffness = c[0]
        for k in range(CORNERS):
            if wp.abs(drift - before[k]) < c[2 * k + 2]:
                stiffness += c[2 * k + 1]
        return stiffness

    def advance(drift: Any, increment: Any, memory: Any, c: Any):
        return evolve(drift, memory, c)

    functions = device_functions(f"multilinear_{corners}", evolve, force, recoverable, tangent, advance)
    evolve = functions["evolve"]
    return Spring(coefficients=2 * corners + 1, memory=corners, **functions)


SPRINGS = {
    "multilinear_2": _multilinear(2),
    "multilinear_3": _multilinear(3),
}
