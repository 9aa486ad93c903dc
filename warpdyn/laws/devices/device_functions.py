"""Device functions of friction dampers and stops.

A friction damper is a brace of stiffness c0 in series with friction that holds up to the drift c1. Its memory is the
slip; return mapping clamps it into the range around the drift in which friction holds.

A stop stands at the end of a clearance, c1 ahead and c2 behind, and gives back a share of the energy that pressed it
in. Pressed in by p, the stop pushes back with the force (1 - c3) c0 p. Let go, it does so with the stiffness c0, and no
more once it is still in by c3 p: of the work put in it gives back the share 1 - c3. It is whole again once it is free.
Its memory is how far in it pushes no more.
"""

from typing import Any

import warp as wp

from warpdyn.laws.spring import Spring


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


@wp.func
def gap_pressed(drift: Any, c: Any):
    """How far the stop is pressed in."""
    clearance = wp.where(drift < type(drift)(0.0), c[2], c[1])
    return wp.max(wp.abs(drift) - clearance, type(drift)(0.0))


@wp.func
def gap_evolve(drift: Any, memory: Any, c: Any):
    pressed = gap_pressed(drift, c)
    lost = type(memory)()
    lost[0] = wp.clamp(memory[0], c[3] * pressed, pressed)
    return lost


@wp.func
def gap_force(drift: Any, memory: Any, c: Any):
    pressed = gap_pressed(drift, c)
    force = c[0] * (pressed - wp.clamp(memory[0], c[3] * pressed, pressed))
    return wp.where(drift < type(drift)(0.0), -force, force)


@wp.func
def gap_recoverable(drift: Any, memory: Any, c: Any):
    elastic = gap_pressed(drift, c) - memory[0]
    return type(drift)(0.5) * c[0] * elastic * elastic


@wp.func
def gap_tangent(drift: Any, increment: Any, before: Any, after: Any, c: Any):
    zero = type(drift)(0.0)
    pressed = gap_pressed(drift, c)
    stiffness = wp.where(before[0] < c[3] * pressed, c[0] * (type(drift)(1.0) - c[3]), c[0])
    return wp.where(before[0] < pressed, stiffness, zero)


@wp.func
def gap_advance(drift: Any, increment: Any, memory: Any, c: Any):
    return gap_evolve(drift, memory, c)


DEVICE_SPRINGS = {
    "slip": Spring(slip_force, slip_evolve, slip_recoverable, 2, slip_tangent, memory=1, advance=slip_advance),
    "gap": Spring(gap_force, gap_evolve, gap_recoverable, 4, gap_tangent, memory=1, advance=gap_advance),
}
