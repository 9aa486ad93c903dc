"""Bouc-Wen that degrades and pinches with the energy it dissipated (Baber and Wen 1981, Baber and Noori 1985).

A hardening spring c0 stands beside a hysteretic force c1 z, as in `bouc_wen`. With A = 1 - c7 e, at least 0,
nu = 1 + c8 e, eta = 1 + c9 e and s the sign of the velocity,

    uy dz/dt = h v (A - nu |z|^n (gamma + beta s sign z)) / eta,    uy de/dt = (1 - alpha) z v,

where 1 / uy = c2, beta = c3, gamma = c4, n = c5 and 1 - alpha = c6. Without pinching h = 1. With it, as Foliente (1995)
has it, h = 1 - zeta1 exp(-((s z - q zu) / zeta2)^2), where zeta1 = c10 (1 - exp(-c11 e)),
zeta2 = (c12 + c13 e) (c14 + zeta1), q = c15, and zu = (A / (nu (beta + gamma)))^(1/n) is the bound of z, of
c16 = 1 / n and c17 = 1 / (beta + gamma). Rows with 1 at their end are for n = 1. The memory is z and e.
"""

from typing import Any

import numpy as np
import warp as wp

from warpdyn.device.exponentials import exponential, power_of
from warpdyn.laws.rate_law import along_drift
from warpdyn.laws.row_functions import device_functions
from warpdyn.laws.spring import Spring

# The steepest fall of exp(-x^2).
STEEPEST = wp.constant(wp.float64(0.8577638849607068))
# Less of A than this stores no more energy.
LEAST_A = wp.constant(wp.float64(1e-3))
# Gauss's rule on 0 to 1.
_POINTS, _SHARES = np.polynomial.legendre.leggauss(8)
NODES = wp.constant(wp.types.vector(length=8, dtype=wp.float64)((_POINTS + 1) / 2))
WEIGHTS = wp.constant(wp.types.vector(length=8, dtype=wp.float64)(_SHARES / 2))


@wp.func
def baber_noori_force(drift: Any, memory: Any, c: Any):
    return c[0] * drift + c[1] * memory[0]


def _baber_noori(name: str, PINCHES: bool, POWERS: bool) -> Spring:
    """Return the law with or without pinching; without powers, which are slow, its exponent is 1."""

    def rate(velocity: Any, memory: Any, c: Any):
        zero, one = type(velocity)(0.0), type(velocity)(1.0)
        z, energy = memory[0], memory[1]
        speed = velocity * c[2]
        growth = wp.max(one - c[7] * energy, zero)
        nu = one + c[8] * energy
        eta = one + c[9] * energy
        power = wp.abs(z)
        if POWERS:
            power = power_of(power, c[5])
        flow = growth * speed - nu * power * (c[4] * speed + c[3] * wp.abs(speed) * wp.sign(z))
        if PINCHES:
            zeta1 = c[10] * (one - exponential(-c[11] * energy))
            zeta2 = (c[12] + c[13] * energy) * (c[14] + zeta1)
            towards = wp.where(velocity < zero, -z, z)
            # One quotient serves both.
            share = one / (eta * nu * zeta2)
            apart = (nu * towards - c[15] * c[17] * growth) * (eta * share)
            if POWERS:
                apart = (towards - c[15] * power_of(growth / nu * c[17], c[16])) * (eta * nu * share)
            flow = flow * (nu * zeta2 * share) * (one - zeta1 * exponential(-apart * apart))
        else:
            flow = flow / eta
        slope = type(memory)()
        slope[0] = flow
        slope[1] = c[6] * z * speed
        return slope

    def recoverable(drift: Any, memory: Any, c: Any):
        """What z gives back as it unloads to 0, the integral of z over the drift; by quadrature where it pinches."""
        zero, one, half = type(drift)(0.0), type(drift)(1.0), type(drift)(0.5)
        z, energy = memory[0], memory[1]
        growth = wp.max(one - c[7] * energy, type(drift)(LEAST_A))
        area = half * z * z
        if PINCHES:
            bound = growth / (one + c[8] * energy) * c[17]
            if POWERS:
                bound = power_of(bound, c[16])
            zeta1 = c[10] * (one - exponential(-c[11] * energy))
            zeta2 = (c[12] + c[13] * energy) * (c[14] + zeta1)
            area = zero
            for k in range(8):
                node = type(drift)(NODES[k])
                apart = (wp.abs(z) * node * node + c[15] * bound) / zeta2
                share = type(drift)(WEIGHTS[k]) / (one - zeta1 * exponential(-apart * apart))
                area += type(drift)(2.0) * z * z * node * node * node * share
        return half * c[0] * drift * drift + c[1] / c[2] * (one + c[9] * energy) / growth * area

    def relaxation(velocity: Any, memory: Any, c: Any):
        """z settles at the rate of its equation's slope, at most; each part of it is taken at its steepest."""
        one = type(velocity)(1.0)
        energy = wp.max(memory[1], type(velocity)(0.0))
        slope = (one + c[8] * energy) * (c[3] + wp.abs(c[4]))
        if POWERS:
            size = wp.max(wp.abs(memory[0]), type(velocity)(1e-6))
            slope *= power_of(size, c[5]) / size * c[5]
        eta = one + c[9] * energy
        if PINCHES:
            zeta1 = c[10] * (one - exponential(-c[11] * energy))
            zeta2 = (c[12] + c[13] * energy) * (c[14] + zeta1)
            slope = slope * zeta2 + type(velocity)(STEEPEST) * zeta1
            eta *= zeta2
        return wp.abs(velocity) * c[2] * slope / eta

    own = device_functions(name, rate, relaxation, recoverable)
    return Spring(
        baber_noori_force,
        None,
        own["recoverable"],
        coefficients=18 if PINCHES else 10,
        memory=2,
        **along_drift(own["rate"], own["relaxation"]),
    )


SPRINGS = {
    "baber_noori": _baber_noori("baber_noori", False, True),
    "baber_noori_1": _baber_noori("baber_noori_1", False, False),
    "baber_noori_pinching": _baber_noori("baber_noori_pinching", True, True),
    "baber_noori_pinching_1": _baber_noori("baber_noori_pinching_1", True, False),
}
