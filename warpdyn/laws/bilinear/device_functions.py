"""Bilinear with kinematic hardening.

A hardening spring c0 stands beside an elastic-perfectly-plastic one of stiffness c1 and yield drift c2. The memory is
the plastic drift; return mapping clamps it into the elastic range around the drift.
"""

from typing import Any

import warp as wp

from warpdyn.laws.spring import Spring


@wp.func
def bilinear_evolve(drift: Any, memory: Any, c: Any):
    plastic = type(memory)()
    plastic[0] = wp.clamp(memory[0], drift - c[2], drift + c[2])
    return plastic


@wp.func
def bilinear_force(drift: Any, memory: Any, c: Any):
    return c[0] * drift + c[1] * (drift - wp.clamp(memory[0], drift - c[2], drift + c[2]))


@wp.func
def bilinear_recoverable(drift: Any, memory: Any, c: Any):
    elastic = drift - memory[0]
    return type(drift)(0.5) * (c[0] * drift * drift + c[1] * elastic * elastic)


@wp.func
def bilinear_tangent(drift: Any, increment: Any, before: Any, after: Any, c: Any):
    stiffness = c[0]
    if wp.abs(drift - before[0]) < c[2]:
        stiffness += c[1]
    return stiffness


@wp.func
def bilinear_advance(drift: Any, increment: Any, memory: Any, c: Any):
    return bilinear_evolve(drift, memory, c)


SPRINGS = {
    "bilinear": Spring(
        bilinear_force,
        bilinear_evolve,
        bilinear_recoverable,
        coefficients=3,
        tangent=bilinear_tangent,
        memory=1,
        advance=bilinear_advance,
    ),
}
