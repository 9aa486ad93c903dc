"""Device functions of the Bouc-Wen law with degradation and pinching (Baber and Wen 1981, Baber and Noori 1985).

A hardening spring is parallel to a hysteretic force that is proportional to z, as in `bouc_wen`. Let e be the energy
dissipated by z, divided by yield force times yield drift, v the drift velocity and s its sign. With A = 1 - deltaA e
(at least 0), nu = 1 + deltaNu e and eta = 1 + deltaEta e,

    uy dz/dt = h v (A - nu |z|^n (gamma + beta s sign z)) / eta,    uy de/dt = (1 - alpha) z v,

where uy is the yield drift and alpha the hardening ratio. Without pinching h = 1. With pinching (Foliente 1995), h = 1
- zeta1 exp(-((s z - q zu) / zeta2)^2), where zeta1 = zetas (1 - exp(-p e)), zeta2 = (psi + deltaPsi e) (lambda +
  zeta1), and zu = (A / (nu (beta + gamma)))^(1/n) is the bound of z. Functions whose names end in 1 are for n = 1.
"""

import enum
from typing import Any

import numpy as np
import warp as wp

from warpdyn.engine.device.exponentials import exponential, power_of
from warpdyn.engine.device.extrema import maximum
from warpdyn.engine.laws.baber_noori.parameters import BaberNoori, Coefficient as C
from warpdyn.engine.laws.law import Layout
from warpdyn.engine.laws.rate_law import along_drift
from warpdyn.engine.laws.row_functions import device_functions
from warpdyn.engine.laws.spring import Spring

# Largest slope of exp(-x^2).
STEEPEST = wp.constant(wp.float64(0.8577638849607068))
# Smallest A that is used in the elastic energy, to avoid a division by 0.
LEAST_A = wp.constant(wp.float64(1e-3))
# Points and weights of Gauss quadrature on the interval 0 to 1.
_POINTS, _SHARES = np.polynomial.legendre.leggauss(8)
NODES = wp.constant(wp.types.vector(length=8, dtype=wp.float64)((_POINTS + 1) / 2))
WEIGHTS = wp.constant(wp.types.vector(length=8, dtype=wp.float64)(_SHARES / 2))


class M(Layout):
    """Memory of a storey: the history variables that its law keeps from step to step."""

    Z = enum.auto()
    ENERGY = enum.auto()  # e: energy dissipated by z, divided by yield force times yield drift


@wp.func
def baber_noori_force(drift: Any, memory: Any, c: Any):
    return c[C.HARDENING_STIFFNESS] * drift + c[C.HYSTERETIC_FORCE] * memory[M.Z]


def _baber_noori(name: str, PINCHES: bool, POWERS: bool) -> Spring:
    """Return the device functions of the law, with or without pinching.

    POWERS is False if the exponent n is 1; then the functions need no powers, which are slow.
    """

    def rate(velocity: Any, memory: Any, c: Any):
        zero, one = type(velocity)(0.0), type(velocity)(1.0)
        z, energy = memory[M.Z], memory[M.ENERGY]
        speed = velocity * c[C.RATE]
        growth = maximum(one - c[C.GROWTH_LOSS] * energy, zero)
        nu = one + c[C.STRENGTH_LOSS] * energy
        eta = one + c[C.STIFFNESS_LOSS] * energy
        power = wp.abs(z)
        if POWERS:
            power = power_of(power, c[C.EXPONENT])
        flow = growth * speed - nu * power * (c[C.GAMMA] * speed + c[C.BETA] * wp.abs(speed) * wp.sign(z))
        if PINCHES:
            zeta1 = c[C.TOTAL_SLIP] * (one - exponential(-c[C.PINCHING_RATE] * energy))
            zeta2 = (c[C.PINCHING_SPREAD] + c[C.PINCHING_SPREAD_RATE] * energy) * (c[C.PINCHING_COUPLING] + zeta1)
            towards = wp.where(velocity < zero, -z, z)
            # One division serves the two terms.
            share = one / (eta * nu * zeta2)
            apart = (nu * towards - c[C.PINCHING_LEVEL] * c[C.INVERSE_BETA_AND_GAMMA] * growth) * (eta * share)
            if POWERS:
                apart = (
                    towards
                    - c[C.PINCHING_LEVEL] * power_of(growth / nu * c[C.INVERSE_BETA_AND_GAMMA], c[C.INVERSE_EXPONENT])
                ) * (eta * nu * share)
            flow = flow * (nu * zeta2 * share) * (one - zeta1 * exponential(-apart * apart))
        else:
            flow = flow / eta
        slope = type(memory)()
        slope[M.Z] = flow
        slope[M.ENERGY] = c[C.HYSTERETIC_SHARE] * z * speed
        return slope

    def elastic_energy(drift: Any, memory: Any, c: Any):
        """Return the energy [J] that the storey returns in unloading: that of the hardening spring and that of z.

        The energy of z is an integral over z. With pinching, Gauss quadrature computes it.
        """
        zero, one, half = type(drift)(0.0), type(drift)(1.0), type(drift)(0.5)
        z, energy = memory[M.Z], memory[M.ENERGY]
        growth = maximum(one - c[C.GROWTH_LOSS] * energy, type(drift)(LEAST_A))
        area = half * z * z
        if PINCHES:
            bound = growth / (one + c[C.STRENGTH_LOSS] * energy) * c[C.INVERSE_BETA_AND_GAMMA]
            if POWERS:
                bound = power_of(bound, c[C.INVERSE_EXPONENT])
            zeta1 = c[C.TOTAL_SLIP] * (one - exponential(-c[C.PINCHING_RATE] * energy))
            zeta2 = (c[C.PINCHING_SPREAD] + c[C.PINCHING_SPREAD_RATE] * energy) * (c[C.PINCHING_COUPLING] + zeta1)
            area = zero
            for k in range(8):
                node = type(drift)(NODES[k])
                apart = (wp.abs(z) * node * node + c[C.PINCHING_LEVEL] * bound) / zeta2
                share = type(drift)(WEIGHTS[k]) / (one - zeta1 * exponential(-apart * apart))
                area += type(drift)(2.0) * z * z * node * node * node * share
        return (
            half * c[C.HARDENING_STIFFNESS] * drift * drift
            + c[C.HYSTERETIC_FORCE] / c[C.RATE] * (one + c[C.STIFFNESS_LOSS] * energy) / growth * area
        )

    def relaxation_rate(velocity: Any, memory: Any, c: Any):
        """Return an upper bound of the rate [1/s] at which a deviation of z decays: the steepest slope of dz/dt."""
        one = type(velocity)(1.0)
        energy = maximum(memory[M.ENERGY], type(velocity)(0.0))
        slope = (one + c[C.STRENGTH_LOSS] * energy) * (c[C.BETA] + wp.abs(c[C.GAMMA]))
        if POWERS:
            size = maximum(wp.abs(memory[M.Z]), type(velocity)(1e-6))
            slope *= power_of(size, c[C.EXPONENT]) / size * c[C.EXPONENT]
        eta = one + c[C.STIFFNESS_LOSS] * energy
        if PINCHES:
            zeta1 = c[C.TOTAL_SLIP] * (one - exponential(-c[C.PINCHING_RATE] * energy))
            zeta2 = (c[C.PINCHING_SPREAD] + c[C.PINCHING_SPREAD_RATE] * energy) * (c[C.PINCHING_COUPLING] + zeta1)
            slope = slope * zeta2 + type(velocity)(STEEPEST) * zeta1
            eta *= zeta2
        return wp.abs(velocity) * c[C.RATE] * slope / eta

    own = device_functions(name, rate, relaxation_rate, elastic_energy)
    return Spring(
        baber_noori_force,
        None,
        own["elastic_energy"],
        coefficients=len(BaberNoori.rows[name]),
        memory=len(M),
        **along_drift(own["rate"], own["relaxation_rate"]),
    )


SPRINGS = {
    "baber_noori": _baber_noori("baber_noori", False, True),
    "baber_noori_1": _baber_noori("baber_noori_1", False, False),
    "baber_noori_pinching": _baber_noori("baber_noori_pinching", True, True),
    "baber_noori_pinching_1": _baber_noori("baber_noori_pinching_1", True, False),
}
