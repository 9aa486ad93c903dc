"""Device functions of friction dampers and of stops (gap elements).

A friction damper is a brace in series with a friction joint. The memory is the slip of the joint. The joint sticks if
the slip differs from the drift by at most the slip drift; the return mapping limits the slip to this range.

A stop acts beyond a clearance and returns a part of its compression energy. Let k be its unloading stiffness, l the
fraction of the energy that is lost, and p the compression. In loading, the force is (1 - l) k p. In unloading, it
decreases with the stiffness k and reaches zero at the compression l times the largest p. After the contact ends, the
stop recovers its shape. The memory is the compression at which the force is zero.
"""

import enum
from typing import Any

import warp as wp

from warpdyn.engine.device.extrema import clamped, maximum
from warpdyn.engine.laws.devices.parameters import FrictionCoefficient as Friction, StopCoefficient as Stop
from warpdyn.engine.laws.law import Layout
from warpdyn.engine.laws.spring import Spring


class FrictionMemory(Layout):
    """Memory of a friction damper: the history variable that it keeps from step to step."""

    SLIP = enum.auto()  # slip of the joint


class StopMemory(Layout):
    """Memory of a stop: the history variable that it keeps from step to step."""

    LOST = enum.auto()  # compression at which the force is zero


@wp.func
def friction_damper_return_mapping(drift: Any, memory: Any, c: Any):
    slip = type(memory)()
    slip[FrictionMemory.SLIP] = clamped(
        memory[FrictionMemory.SLIP], drift - c[Friction.SLIP_DRIFT], drift + c[Friction.SLIP_DRIFT]
    )
    return slip


@wp.func
def friction_damper_force(drift: Any, memory: Any, c: Any):
    held = drift - memory[FrictionMemory.SLIP]
    return c[Friction.BRACE_STIFFNESS] * clamped(
        held, type(drift)(-1.0) * c[Friction.SLIP_DRIFT], c[Friction.SLIP_DRIFT]
    )


@wp.func
def friction_damper_elastic_energy(drift: Any, memory: Any, c: Any):
    elastic = drift - memory[FrictionMemory.SLIP]
    return type(drift)(0.5) * c[Friction.BRACE_STIFFNESS] * elastic * elastic


@wp.func
def friction_damper_tangent(drift: Any, increment: Any, before: Any, after: Any, c: Any):
    return wp.where(
        wp.abs(drift - before[FrictionMemory.SLIP]) < c[Friction.SLIP_DRIFT],
        c[Friction.BRACE_STIFFNESS],
        type(drift)(0.0),
    )


@wp.func
def friction_damper_memory_after(drift: Any, increment: Any, memory: Any, c: Any):
    return friction_damper_return_mapping(drift, memory, c)


@wp.func
def gap_pressed(drift: Any, c: Any):
    """Return the compression of the stop at a drift [m]; 0 without contact."""
    clearance = wp.where(drift < type(drift)(0.0), c[Stop.CLEARANCE_BEHIND], c[Stop.CLEARANCE_AHEAD])
    return maximum(wp.abs(drift) - clearance, type(drift)(0.0))


@wp.func
def gap_return_mapping(drift: Any, memory: Any, c: Any):
    pressed = gap_pressed(drift, c)
    lost = type(memory)()
    lost[StopMemory.LOST] = clamped(memory[StopMemory.LOST], c[Stop.ENERGY_LOST] * pressed, pressed)
    return lost


@wp.func
def gap_force(drift: Any, memory: Any, c: Any):
    pressed = gap_pressed(drift, c)
    force = c[Stop.UNLOADING_STIFFNESS] * (
        pressed - clamped(memory[StopMemory.LOST], c[Stop.ENERGY_LOST] * pressed, pressed)
    )
    return wp.where(drift < type(drift)(0.0), -force, force)


@wp.func
def gap_elastic_energy(drift: Any, memory: Any, c: Any):
    elastic = gap_pressed(drift, c) - memory[StopMemory.LOST]
    return type(drift)(0.5) * c[Stop.UNLOADING_STIFFNESS] * elastic * elastic


@wp.func
def gap_tangent(drift: Any, increment: Any, before: Any, after: Any, c: Any):
    zero = type(drift)(0.0)
    pressed = gap_pressed(drift, c)
    stiffness = wp.where(
        before[StopMemory.LOST] < c[Stop.ENERGY_LOST] * pressed,
        c[Stop.UNLOADING_STIFFNESS] * (type(drift)(1.0) - c[Stop.ENERGY_LOST]),
        c[Stop.UNLOADING_STIFFNESS],
    )
    return wp.where(before[StopMemory.LOST] < pressed, stiffness, zero)


@wp.func
def gap_memory_after(drift: Any, increment: Any, memory: Any, c: Any):
    return gap_return_mapping(drift, memory, c)


SPRINGS = {
    "friction_damper": Spring(
        friction_damper_force,
        friction_damper_return_mapping,
        friction_damper_elastic_energy,
        len(Friction),
        friction_damper_tangent,
        len(FrictionMemory),
        memory_after=friction_damper_memory_after,
    ),
    "gap": Spring(
        gap_force,
        gap_return_mapping,
        gap_elastic_energy,
        len(Stop),
        gap_tangent,
        len(StopMemory),
        memory_after=gap_memory_after,
    ),
}
