"""A joint that slips: a brace of stiffness c0 in series with friction that holds up to the drift c1.

The memory is the slip; return mapping clamps it into the range around the drift in which friction holds.
"""

from typing import Any

import warp as wp

from warpdyn.kernels.springs.spring import Spring


@wp.func
def slip_evolve(drift: Any, memory: Any, c: Any):
    slip = type(memory)()
    slip[0] = wp.clamp(memory[0], drift - c[1], drift + c[1])
    return slip


@wp.func
def slip_force(drift: Any, memory: Any, c: Any):
    return c[0] * (drift - wp.clamp(memory[0], drift - c[1], drift + c[1]))


@wp.func
def slip_recoverable(drift: Any, memory: Any, c: Any):
    elastic = drift - memory[0]
    return type(drift)(0.5) * c[0] * elastic * elastic


@wp.func
def slip_tangent(drift: Any, increment: Any, before: Any, after: Any, c: Any):
    return wp.where(wp.abs(drift - before[0]) < c[1], c[0], type(drift)(0.0))


@wp.func
def slip_advance(drift: Any, increment: Any, memory: Any, c: Any):
    return slip_evolve(drift, memory, c)


SLIP = Spring(slip_force, slip_evolve, slip_recoverable, 2, slip_tangent, memory=1, advance=slip_advance)
