"""Storey laws as scalar device functions, one row each in SPRINGS.

A law sees the storey drift [m], its own memory and its coefficients, both as short vectors, and returns a force [N].
The coefficients are prepared once per structure (`warpdyn.laws`), so that no division stands in the time loop.
"""

from collections.abc import Callable
from dataclasses import dataclass
from typing import Any

import warp as wp


@dataclass(frozen=True)
class Spring:
    """One storey law: its functions, and how its memory moves.

    Args:
        force: `(drift, memory, coefficients) -> force [N]`.
        evolve: For a rate law `(velocity, memory, coefficients) -> d(memory)/dt`, integrated with the motion; for a
            return-mapping law `(drift, memory, coefficients) -> memory`, applied once a step to the accepted drift.
        recoverable: `(drift, memory, coefficients) -> elastic energy [J]` that unloading would give back.
        coefficients: Number of coefficients a storey.
        tangent: `(drift, increment, before, after, coefficients) -> d(force)/d(drift) [N/m]` at the end of a step that
            came to `drift` by `increment`, the memory going from `before` to `after`.
        advance: `(drift, increment, memory, coefficients) -> memory` after such a step, for methods that know no
            velocity within it. None where there is no memory.
        is_rate: Whether `evolve` returns a rate.
        relaxation: `(velocity, memory, coefficients) -> rate [1/s]` at which the memory settles, at its fastest. A step
            too long for it goes wrong without ever becoming infinite. None where the memory has no rate of its own.
        settles_by_velocity: Whether that rate depends on the velocity alone, so that one look a step tells it.
        relaxation_along: `(increment, memory, coefficients) -> the same times the step`, within the step of `advance`.
    """

    force: Callable
    evolve: Callable | None
    recoverable: Callable
    coefficients: int
    tangent: Callable
    advance: Callable | None = None
    is_rate: bool = False
    relaxation: Callable | None = None
    settles_by_velocity: bool = False
    relaxation_along: Callable | None = None


@wp.func
def elastic_force(drift: Any, memory: Any, c: Any):
    return c[0] * drift


@wp.func
def elastic_recoverable(drift: Any, memory: Any, c: Any):
    return type(drift)(0.5) * c[0] * drift * drift


@wp.func
def elastic_tangent(drift: Any, increment: Any, before: Any, after: Any, c: Any):
    return c[0]


# Bilinear with kinematic hardening: a hardening spring c0 beside an elastic-perfectly-plastic one of stiffness c1 and
# yield drift c2. The memory is the plastic drift; return mapping clamps it into the elastic range around the drift.
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


# Bouc-Wen: a hardening spring c0 beside a hysteretic force c1 z; uy dz/dt = v - |z|^n (beta |v| sign z + gamma v), with
# 1 / uy = c2, beta / uy = c3, gamma / uy = c4, and n = c5 where it is neither 1 nor 2: powers are slow, and most use
# these.
@wp.func
def bouc_wen_force(drift: Any, memory: Any, c: Any):
    return c[0] * drift + c[1] * memory[0]


@wp.func
def bouc_wen_recoverable(drift: Any, memory: Any, c: Any):
    return type(drift)(0.5) * (c[0] * drift * drift + c[1] / c[2] * memory[0] * memory[0])


# Where it is, z settles at the rate n (beta + |gamma|) |z|^(n-1) |v| / uy at the fastest. Every stage is looked at if z
# has a say: a step too long throws z beyond its bound, where the rate is higher.
@wp.func
def bouc_wen_1_relaxation(velocity: Any, memory: Any, c: Any):
    return wp.abs(velocity) * (c[3] + wp.abs(c[4]))


@wp.func
def bouc_wen_2_relaxation(velocity: Any, memory: Any, c: Any):
    return wp.abs(velocity * memory[0]) * (type(velocity)(2.0) * (c[3] + wp.abs(c[4])))


@wp.func
def bouc_wen_relaxation(velocity: Any, memory: Any, c: Any):
    size = wp.max(wp.abs(memory[0]), type(velocity)(1e-6))
    return wp.abs(velocity) * wp.pow(size, c[5]) / size * c[5] * (c[3] + wp.abs(c[4]))


@wp.func
def bouc_wen_1_evolve(velocity: Any, memory: Any, c: Any):
    z = memory[0]
    rate = type(memory)()
    rate[0] = velocity * (c[2] - c[4] * wp.abs(z)) - c[3] * z * wp.abs(velocity)
    return rate


@wp.func
def bouc_wen_2_evolve(velocity: Any, memory: Any, c: Any):
    z = memory[0]
    rate = type(memory)()
    rate[0] = velocity * (c[2] - c[4] * z * z) - c[3] * z * wp.abs(z * velocity)
    return rate


@wp.func
def bouc_wen_evolve(velocity: Any, memory: Any, c: Any):
    z = memory[0]
    rate = type(memory)()
    power = wp.pow(wp.abs(z), c[5])
    rate[0] = velocity * (c[2] - c[4] * power) - power * c[3] * wp.abs(velocity) * wp.sign(z)
    return rate


def _along_drift(evolve: Callable, relaxation: Callable) -> dict[str, Callable]:
    """Return what a law whose memory has a rate that is proportional to the velocity does over a step: its fields.

    Such a memory depends on the path of the drift, not on its speed: it goes along an increment in one step of RK4.
    """

    def advance(drift: Any, increment: Any, memory: Any, c: Any):
        half = type(increment)(0.5)
        k1 = evolve(increment, memory, c)
        k2 = evolve(increment, memory + half * k1, c)
        k3 = evolve(increment, memory + half * k2, c)
        k4 = evolve(increment, memory + k3, c)
        return memory + (k1 + type(increment)(2.0) * (k2 + k3) + k4) / type(increment)(6.0)

    def tangent(drift: Any, increment: Any, before: Any, after: Any, c: Any):
        direction = type(increment)(1.0)
        if increment < type(increment)(0.0):
            direction = -direction
        slope = evolve(direction, after, c)
        return c[0] + c[1] * direction * slope[0]

    def relaxation_along(increment: Any, memory: Any, c: Any):
        half = type(increment)(0.5)
        first = memory + half * evolve(increment, memory, c)
        second = memory + half * evolve(increment, first, c)
        third = memory + evolve(increment, second, c)
        outer = wp.max(relaxation(increment, memory, c), relaxation(increment, third, c))
        return wp.max(outer, wp.max(relaxation(increment, first, c), relaxation(increment, second, c)))

    fields = {}
    for function in (advance, tangent, relaxation_along):
        # Warp tells functions apart by name: those of two laws must not share one.
        function.__qualname__ = f"{evolve.key}_{function.__name__}"
        fields[function.__name__] = wp.func(function)
    return fields | {"is_rate": True, "relaxation": relaxation}


# A step too long for the rate at which a memory settles makes its deviation from there grow instead. One such step in
# passing does no harm; where deviations have grown this many times, the memory has lost its way.
LARGEST_DEVIATION = 10.0
LARGEST_GROWTH = wp.constant(wp.float64(1e30))
POWERS = wp.constant(8)  # of a settling polynomial, zeros included


@wp.func
def deviation_after(deviation: Any, rate_step: Any, polynomial: Any):
    """Return a memory's deviation after a step of this rate times its length, over the least it is taken to be, 1."""
    growth = type(rate_step)(0.0)
    for k in range(POWERS):
        growth = polynomial[POWERS - 1 - k] - rate_step * growth
    if not wp.isfinite(growth):  # a rate without bounds
        growth = type(rate_step)(LARGEST_GROWTH)
    return wp.max(wp.max(deviation, type(deviation)(1.0)) * wp.abs(growth), type(deviation)(1.0))


SPRINGS = {
    "elastic": Spring(elastic_force, None, elastic_recoverable, coefficients=1, tangent=elastic_tangent),
    "bilinear": Spring(
        bilinear_force,
        bilinear_evolve,
        bilinear_recoverable,
        coefficients=3,
        tangent=bilinear_tangent,
        advance=bilinear_advance,
    ),
    "bouc_wen_1": Spring(
        bouc_wen_force,
        bouc_wen_1_evolve,
        bouc_wen_recoverable,
        coefficients=5,
        settles_by_velocity=True,
        **_along_drift(bouc_wen_1_evolve, bouc_wen_1_relaxation),
    ),
    "bouc_wen_2": Spring(
        bouc_wen_force,
        bouc_wen_2_evolve,
        bouc_wen_recoverable,
        coefficients=5,
        **_along_drift(bouc_wen_2_evolve, bouc_wen_2_relaxation),
    ),
    "bouc_wen": Spring(
        bouc_wen_force,
        bouc_wen_evolve,
        bouc_wen_recoverable,
        coefficients=6,
        **_along_drift(bouc_wen_evolve, bouc_wen_relaxation),
    ),
}
