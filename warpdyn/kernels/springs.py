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
        is_rate: Whether `evolve` returns a rate.
        relaxation: `(velocity, coefficients) -> rate [1/s]` at which the memory settles at its fastest. A step too long
            for it goes wrong without ever becoming infinite. None where the memory has no rate of its own.
    """

    force: Callable
    evolve: Callable | None
    recoverable: Callable
    coefficients: int
    is_rate: bool = False
    relaxation: Callable | None = None


@wp.func
def elastic_force(drift: Any, memory: Any, c: Any):
    return c[0] * drift


@wp.func
def elastic_recoverable(drift: Any, memory: Any, c: Any):
    return type(drift)(0.5) * c[0] * drift * drift


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


# Bouc-Wen: a hardening spring c0 beside a hysteretic force c1 z; uy dz/dt = v - |z|^n (beta |v| sign z + gamma v), with
# 1 / uy = c2, beta = c3, gamma = c4 and n = c5 where it is neither 1 nor 2 (powers are slow; most studies use these).
@wp.func
def bouc_wen_force(drift: Any, memory: Any, c: Any):
    return c[0] * drift + c[1] * memory[0]


@wp.func
def bouc_wen_recoverable(drift: Any, memory: Any, c: Any):
    return type(drift)(0.5) * (c[0] * drift * drift + c[1] / c[2] * memory[0] * memory[0])


# At its bound Z z settles at the rate n (beta + |gamma|) Z^(n-1) |v| / uy, which is its fastest; the factor of |v| is
# the last coefficient. It is taken at the bound wherever z is, since a step too long can hold z away from it.
@wp.func
def bouc_wen_whole_relaxation(velocity: Any, c: Any):
    return wp.abs(velocity) * c[5]


@wp.func
def bouc_wen_relaxation(velocity: Any, c: Any):
    return wp.abs(velocity) * c[6]


@wp.func
def bouc_wen_1_evolve(velocity: Any, memory: Any, c: Any):
    z = memory[0]
    rate = type(memory)()
    rate[0] = c[2] * (velocity - (c[3] * wp.abs(velocity) * z + c[4] * velocity * wp.abs(z)))
    return rate


@wp.func
def bouc_wen_2_evolve(velocity: Any, memory: Any, c: Any):
    z = memory[0]
    rate = type(memory)()
    rate[0] = c[2] * (velocity - wp.abs(z) * (c[3] * wp.abs(velocity) * z + c[4] * velocity * wp.abs(z)))
    return rate


@wp.func
def bouc_wen_evolve(velocity: Any, memory: Any, c: Any):
    z = memory[0]
    rate = type(memory)()
    power = wp.pow(wp.abs(z), c[5])
    rate[0] = c[2] * (velocity - power * (c[3] * wp.abs(velocity) * wp.sign(z) + c[4] * velocity))
    return rate


SPRINGS = {
    "elastic": Spring(elastic_force, None, elastic_recoverable, coefficients=1),
    "bilinear": Spring(bilinear_force, bilinear_evolve, bilinear_recoverable, coefficients=3),
    "bouc_wen_1": Spring(
        bouc_wen_force,
        bouc_wen_1_evolve,
        bouc_wen_recoverable,
        coefficients=6,
        is_rate=True,
        relaxation=bouc_wen_whole_relaxation,
    ),
    "bouc_wen_2": Spring(
        bouc_wen_force,
        bouc_wen_2_evolve,
        bouc_wen_recoverable,
        coefficients=6,
        is_rate=True,
        relaxation=bouc_wen_whole_relaxation,
    ),
    "bouc_wen": Spring(
        bouc_wen_force,
        bouc_wen_evolve,
        bouc_wen_recoverable,
        coefficients=7,
        is_rate=True,
        relaxation=bouc_wen_relaxation,
    ),
}
