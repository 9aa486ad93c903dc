"""Bouc-Wen: a hardening spring c0 beside a hysteretic force c1 z.

uy dz/dt = v - |z|^n (beta |v| sign z + gamma v), with 1 / uy = c2, beta / uy = c3, gamma / uy = c4, and n = c5 where it
is neither 1 nor 2: powers are slow, and most use these.
"""

from typing import Any

import warp as wp

from warpdyn.device.exponentials import power_of
from warpdyn.laws.rate_law import along_drift
from warpdyn.laws.spring import Spring


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
    return wp.abs(velocity) * power_of(size, c[5]) / size * c[5] * (c[3] + wp.abs(c[4]))


@wp.func
def bouc_wen_1_rate(velocity: Any, memory: Any, c: Any):
    z = memory[0]
    slope = type(memory)()
    slope[0] = velocity * (c[2] - c[4] * wp.abs(z)) - c[3] * z * wp.abs(velocity)
    return slope


@wp.func
def bouc_wen_2_rate(velocity: Any, memory: Any, c: Any):
    z = memory[0]
    slope = type(memory)()
    slope[0] = velocity * (c[2] - c[4] * z * z) - c[3] * z * wp.abs(z * velocity)
    return slope


@wp.func
def bouc_wen_rate(velocity: Any, memory: Any, c: Any):
    z = memory[0]
    slope = type(memory)()
    power = power_of(wp.abs(z), c[5])
    slope[0] = velocity * (c[2] - c[4] * power) - power * c[3] * wp.abs(velocity) * wp.sign(z)
    return slope


SPRINGS = {
    "bouc_wen_1": Spring(
        bouc_wen_force,
        None,
        bouc_wen_recoverable,
        coefficients=5,
        memory=1,
        settles_by_velocity=True,
        **along_drift(bouc_wen_1_rate, bouc_wen_1_relaxation),
    ),
    "bouc_wen_2": Spring(
        bouc_wen_force,
        None,
        bouc_wen_recoverable,
        coefficients=5,
        memory=1,
        **along_drift(bouc_wen_2_rate, bouc_wen_2_relaxation),
    ),
    "bouc_wen": Spring(
        bouc_wen_force,
        None,
        bouc_wen_recoverable,
        coefficients=6,
        memory=1,
        **along_drift(bouc_wen_rate, bouc_wen_relaxation),
    ),
}
