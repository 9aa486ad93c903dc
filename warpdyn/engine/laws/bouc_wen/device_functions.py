"""Device functions of the Bouc-Wen law: a hardening spring in parallel with a hysteretic force proportional to z.

uy dz/dt = v - |z|^n (beta |v| sign z + gamma v), where uy is the yield drift and v the drift velocity. Powers are slow,
so there are separate functions for the exponents n = 1 and 2. In the usual case n = 1 and beta = gamma, storeys unload
along a straight line; the functions for this case use z divided by its bound 1 / (2 beta), so that they do not need
beta and gamma.
"""

from typing import Any

import warp as wp

from warpdyn.engine.device.exponentials import power_of
from warpdyn.engine.device.extrema import maximum
from warpdyn.engine.laws.bouc_wen.parameters import BoucWen, Coefficient as C
from warpdyn.engine.laws.rate_law import Memory as M, along_drift
from warpdyn.engine.laws.spring import Spring


@wp.func
def bouc_wen_force(drift: Any, memory: Any, c: Any):
    return c[C.HARDENING_STIFFNESS] * drift + c[C.HYSTERETIC_FORCE] * memory[M.Z]


@wp.func
def bouc_wen_elastic_energy(drift: Any, memory: Any, c: Any):
    return type(drift)(0.5) * (
        c[C.HARDENING_STIFFNESS] * drift * drift + c[C.HYSTERETIC_FORCE] / c[C.RATE] * memory[M.Z] * memory[M.Z]
    )


# Rate at which deviations of z decay, at most: n (beta + |gamma|) |z|^(n-1) |v| / uy. If this rate depends on z, it is
# computed in every stage, because a step that is too long moves z beyond its bound, where the rate is higher.
@wp.func
def bouc_wen_1_elastic_unloading_relaxation_rate(velocity: Any, memory: Any, c: Any):
    return wp.abs(velocity) * c[C.RATE]


@wp.func
def bouc_wen_1_relaxation_rate(velocity: Any, memory: Any, c: Any):
    return wp.abs(velocity) * (c[C.BETA_RATE] + wp.abs(c[C.GAMMA_RATE]))


@wp.func
def bouc_wen_2_relaxation_rate(velocity: Any, memory: Any, c: Any):
    return wp.abs(velocity * memory[M.Z]) * (type(velocity)(2.0) * (c[C.BETA_RATE] + wp.abs(c[C.GAMMA_RATE])))


@wp.func
def bouc_wen_relaxation_rate(velocity: Any, memory: Any, c: Any):
    size = maximum(wp.abs(memory[M.Z]), type(velocity)(1e-6))
    return (
        wp.abs(velocity)
        * power_of(size, c[C.EXPONENT])
        / size
        * c[C.EXPONENT]
        * (c[C.BETA_RATE] + wp.abs(c[C.GAMMA_RATE]))
    )


@wp.func
def bouc_wen_1_elastic_unloading_rate(velocity: Any, memory: Any, c: Any):
    z = memory[M.Z]
    slope = type(memory)()
    slope[M.Z] = c[C.RATE] * (velocity - type(velocity)(0.5) * (velocity * wp.abs(z) + wp.abs(velocity) * z))
    return slope


@wp.func
def bouc_wen_1_rate(velocity: Any, memory: Any, c: Any):
    z = memory[M.Z]
    slope = type(memory)()
    slope[M.Z] = velocity * (c[C.RATE] - c[C.GAMMA_RATE] * wp.abs(z)) - c[C.BETA_RATE] * z * wp.abs(velocity)
    return slope


@wp.func
def bouc_wen_2_rate(velocity: Any, memory: Any, c: Any):
    z = memory[M.Z]
    slope = type(memory)()
    slope[M.Z] = velocity * (c[C.RATE] - c[C.GAMMA_RATE] * z * z) - c[C.BETA_RATE] * z * wp.abs(z * velocity)
    return slope


@wp.func
def bouc_wen_rate(velocity: Any, memory: Any, c: Any):
    z = memory[M.Z]
    slope = type(memory)()
    power = power_of(wp.abs(z), c[C.EXPONENT])
    slope[M.Z] = velocity * (c[C.RATE] - c[C.GAMMA_RATE] * power) - power * c[C.BETA_RATE] * wp.abs(velocity) * wp.sign(
        z
    )
    return slope


def _row(name: str, rate: wp.Function, relaxation_rate: wp.Function, *, relaxes_by_velocity: bool = False) -> Spring:
    """Return the device functions of a variant of the law; the variants differ in the function for dz/dt."""
    return Spring(
        bouc_wen_force,
        None,
        bouc_wen_elastic_energy,
        coefficients=len(BoucWen.rows[name]),
        memory=len(M),
        relaxes_by_velocity=relaxes_by_velocity,
        **along_drift(rate, relaxation_rate),
    )


SPRINGS = {
    "bouc_wen_1_elastic_unloading": _row(
        "bouc_wen_1_elastic_unloading",
        bouc_wen_1_elastic_unloading_rate,
        bouc_wen_1_elastic_unloading_relaxation_rate,
        relaxes_by_velocity=True,
    ),
    "bouc_wen_1": _row("bouc_wen_1", bouc_wen_1_rate, bouc_wen_1_relaxation_rate, relaxes_by_velocity=True),
    "bouc_wen_2": _row("bouc_wen_2", bouc_wen_2_rate, bouc_wen_2_relaxation_rate),
    "bouc_wen": _row("bouc_wen", bouc_wen_rate, bouc_wen_relaxation_rate),
}
