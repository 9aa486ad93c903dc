"""Device functions of contacts. `force` is the part without the rate of deformation, `viscous_force` the rest.

A Hertz-damp contact remembers the relative speed at the first touch. It is found by linear interpolation between the
last accepted state before the touch and the first one after it; its error is proportional to the square of the step.
"""

import enum
from typing import Any

import warp as wp

from warpdyn.engine.device.extrema import maximum, minimum
from warpdyn.engine.laws.contacts.parameters import DAMPED, UNDAMPED, Coefficient as C
from warpdyn.engine.laws.law import Layout
from warpdyn.engine.laws.row_functions import device_functions
from warpdyn.engine.laws.spring import Spring


class M(Layout):
    """The memory of a Hertz-damp contact."""

    TOUCH_SPEED = enum.auto()  # of the present contact; 0 without contact
    DISTANCE = enum.auto()  # to the contact in the last accepted state without contact
    SPEED = enum.auto()  # in that state


@wp.func
def penetration(drift: Any, c: Any):
    return maximum(drift - c[C.CLEARANCE], type(drift)(0.0))


@wp.func
def hertz_force(drift: Any, memory: Any, c: Any):
    pressed = penetration(drift, c)
    return c[C.STIFFNESS] * pressed * wp.sqrt(pressed)


@wp.func
def hertz_elastic_energy(drift: Any, memory: Any, c: Any):
    pressed = penetration(drift, c)
    return type(drift)(0.4) * c[C.STIFFNESS] * pressed * pressed * wp.sqrt(pressed)


@wp.func
def hertz_tangent(drift: Any, increment: Any, before: Any, after: Any, c: Any):
    return type(drift)(1.5) * c[C.STIFFNESS] * wp.sqrt(penetration(drift, c))


@wp.func
def linear_contact_force(drift: Any, memory: Any, c: Any):
    return c[C.STIFFNESS] * penetration(drift, c)


@wp.func
def linear_contact_elastic_energy(drift: Any, memory: Any, c: Any):
    pressed = penetration(drift, c)
    return type(drift)(0.5) * c[C.STIFFNESS] * pressed * pressed


@wp.func
def linear_contact_tangent(drift: Any, increment: Any, before: Any, after: Any, c: Any):
    return wp.where(drift > c[C.CLEARANCE], c[C.STIFFNESS], type(drift)(0.0))


def _kelvin_voigt(row: str, TENSION: bool) -> Spring:
    """Return the device functions of Kelvin-Voigt contacts with or without tension."""

    def viscous_force(drift: Any, velocity: Any, memory: Any, c: Any):
        pressed = penetration(drift, c)
        force = c[C.DAMPING] * velocity
        if not TENSION:
            force = maximum(force, -c[C.STIFFNESS] * pressed)
        return wp.where(pressed > type(drift)(0.0), force, type(drift)(0.0))

    return Spring(
        linear_contact_force,
        None,
        linear_contact_elastic_energy,
        len(DAMPED),
        linear_contact_tangent,
        **device_functions(row, viscous_force),
    )


@wp.func
def jankowski_viscous_force(drift: Any, velocity: Any, memory: Any, c: Any):
    approach = maximum(velocity, type(drift)(0.0))
    return c[C.DAMPING] * wp.sqrt(wp.sqrt(penetration(drift, c))) * approach


@wp.func
def hertz_damp_viscous_force(drift: Any, velocity: Any, memory: Any, c: Any):
    # In the step of the first touch, the speed at the touch is not yet known.
    speed = memory[M.TOUCH_SPEED]
    if speed == type(drift)(0.0):
        speed = maximum(maximum(memory[M.SPEED], velocity), c[C.LEAST_SPEED])
    return hertz_force(drift, memory, c) * maximum(c[C.DAMPING] * velocity / speed, type(drift)(-1.0))


@wp.func
def hertz_damp_memory_at_velocity(drift: Any, velocity: Any, memory: Any, c: Any):
    zero = type(drift)(0.0)
    after = memory
    pressed = drift - c[C.CLEARANCE]
    if pressed > zero:
        if memory[M.TOUCH_SPEED] == zero:
            speed = velocity
            if memory[M.DISTANCE] > zero:
                share = memory[M.DISTANCE] / (memory[M.DISTANCE] + pressed)
                speed = memory[M.SPEED] + share * (velocity - memory[M.SPEED])
            after[M.TOUCH_SPEED] = maximum(speed, c[C.LEAST_SPEED])
    else:
        after[M.TOUCH_SPEED] = zero
        after[M.DISTANCE] = -pressed
        after[M.SPEED] = velocity
    return after


@wp.func
def hertz_damp_memory_after(drift: Any, increment: Any, memory: Any, c: Any):
    return hertz_damp_memory_at_velocity(drift, type(drift)(0.0), memory, c)


@wp.func
def preloaded_force(drift: Any, memory: Any, c: Any):
    return c[C.STIFFNESS] * minimum(drift, c[C.CLEARANCE])


@wp.func
def preloaded_viscous_force(drift: Any, velocity: Any, memory: Any, c: Any):
    elastic = preloaded_force(drift, memory, c)
    whole = c[C.STIFFNESS] * drift + c[C.DAMPING] * velocity
    return minimum(whole, c[C.STIFFNESS] * c[C.CLEARANCE]) - elastic


@wp.func
def preloaded_elastic_energy(drift: Any, memory: Any, c: Any):
    pressed = minimum(drift, c[C.CLEARANCE])
    return c[C.STIFFNESS] * pressed * (drift - type(drift)(0.5) * pressed)


@wp.func
def preloaded_tangent(drift: Any, increment: Any, before: Any, after: Any, c: Any):
    return wp.where(drift < c[C.CLEARANCE], c[C.STIFFNESS], type(drift)(0.0))


SPRINGS = {
    "kelvin_voigt_contact": _kelvin_voigt("kelvin_voigt_contact", False),
    "kelvin_voigt_contact_with_tension": _kelvin_voigt("kelvin_voigt_contact_with_tension", True),
    "hertz_contact": Spring(hertz_force, None, hertz_elastic_energy, len(UNDAMPED), hertz_tangent),
    "jankowski_contact": Spring(
        hertz_force,
        None,
        hertz_elastic_energy,
        len(DAMPED),
        hertz_tangent,
        viscous_force=jankowski_viscous_force,
    ),
    "preloaded_contact": Spring(
        preloaded_force,
        None,
        preloaded_elastic_energy,
        len(DAMPED),
        preloaded_tangent,
        viscous_force=preloaded_viscous_force,
    ),
    "hertz_damp_contact": Spring(
        hertz_force,
        None,
        hertz_elastic_energy,
        len(C),
        hertz_tangent,
        len(M),
        memory_after=hertz_damp_memory_after,
        viscous_force=hertz_damp_viscous_force,
        memory_at_velocity=hertz_damp_memory_at_velocity,
    ),
}
