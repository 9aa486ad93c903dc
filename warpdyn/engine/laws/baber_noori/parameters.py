"""Bouc-Wen storeys with degradation and pinching by dissipated energy (Baber and Wen 1981, Baber and Noori 1985).

The force is F = alpha k d + (1 - alpha) Fy z as in `bouc_wen`, with the hardening ratio alpha, the stiffness k, the
drift d, its velocity v and the yield force Fy. e is the energy dissipated by z, that is the integral of (1 - alpha) Fy
z dd, divided by Fy dy, where dy = Fy / k is the yield drift. With A = 1 - deltaA e, nu = 1 + deltaNu e and eta = 1 +
deltaEta e,

    dy dz/dt = h v (A - nu |z|^n (gamma + beta sign(v z))) / eta,
    h = 1 - zeta1 exp(-((z sign v - q zu) / zeta2)^2),    zu = (A / (nu (beta + gamma)))^(1/n),
    zeta1 = zetas (1 - exp(-p e)),    zeta2 = (psi + deltaPsi e) (lambda + zeta1)    (Foliente 1995).

OpenSees has the degradation in BoucWen and the pinching in BWBN. In OpenSees z is a deformation, dy times the z of
warpdyn, Ao is 1, and energies are in J. Its gamma and beta are the values of warpdyn times dy^-n; deltaA, deltaNu,
deltaEta and p are divided by Fy dy; Shi is multiplied by dy, and deltaShi divided by Fy.

Intended differences from OpenSees:

- A is at least 0. In OpenSees A can become negative; then z decreases while the drift increases, and the storey
  supplies energy.
- The bound zu of z degrades with A and nu as in Foliente (1995), so that degradation and pinching can be combined.
- OpenSees integrates a step by the backward Euler method, which is of first order.
"""

from __future__ import annotations

import enum

import numpy as np
from numpy.typing import ArrayLike

from warpdyn.engine.laws.bouc_wen.parameters import BoucWen
from warpdyn.engine.laws.law import Layout, Values, parameter


class Coefficient(Layout):
    """Coefficients of the device functions; storeys without pinching use only the coefficients before TOTAL_SLIP."""

    HARDENING_STIFFNESS = enum.auto()
    HYSTERETIC_FORCE = enum.auto()
    RATE = enum.auto()  # 1 / yield drift [1/m]
    BETA = enum.auto()
    GAMMA = enum.auto()
    EXPONENT = enum.auto()
    HYSTERETIC_SHARE = enum.auto()  # 1 - hardening ratio
    GROWTH_LOSS = enum.auto()  # deltaA
    STRENGTH_LOSS = enum.auto()  # deltaNu
    STIFFNESS_LOSS = enum.auto()  # deltaEta
    TOTAL_SLIP = enum.auto()  # zetas
    PINCHING_RATE = enum.auto()  # p
    PINCHING_SPREAD = enum.auto()  # psi
    PINCHING_SPREAD_RATE = enum.auto()  # deltaPsi
    PINCHING_COUPLING = enum.auto()  # lambda
    PINCHING_LEVEL = enum.auto()  # q
    INVERSE_EXPONENT = enum.auto()
    INVERSE_BETA_AND_GAMMA = enum.auto()  # 1 / (beta + gamma)


class BaberNoori(BoucWen):
    """A Bouc-Wen storey with degradation and pinching by dissipated energy (OpenSees: BoucWen and BWBN).

    The law follows Baber and Wen (1981), Baber and Noori (1985) and Foliente (1995). The docstring of the module
    `baber_noori.parameters` contains the equations and the differences from OpenSees. Losses and rates refer to the
    dissipated energy divided by Fy dy, yield force times yield drift (OpenSees: to the energy in J).

    Example:
        >>> wd.laws.BaberNoori(yield_force=1e6, hardening_ratio=0.05, strength_loss=0.02)
        BaberNoori(yield_force=1000000.0, hardening_ratio=0.05, strength_loss=0.02)
    """

    growth_loss: ArrayLike = parameter(
        "1", "deltaA: decrease of A per normalised energy", low=0.0, default=0.0, opensees="deltaA"
    )
    strength_loss: ArrayLike = parameter(
        "1", "deltaNu: growth of nu (loss of strength) per normalised energy", low=0.0, default=0.0, opensees="deltaNu"
    )
    stiffness_loss: ArrayLike = parameter(
        "1",
        "deltaEta: growth of eta (loss of stiffness) per normalised energy",
        low=0.0,
        default=0.0,
        opensees="deltaEta",
    )
    total_slip: ArrayLike = parameter(
        "1", "zetas: largest pinching", low=0.0, high=1.0, high_open=True, default=0.0, opensees="zetas"
    )
    pinching_rate: ArrayLike = parameter(
        "1", "p: rate at which pinching grows with normalised energy", low=0.0, default=0.0, opensees="p"
    )
    pinching_spread: ArrayLike = parameter(
        "1", "psi: breadth of pinching", low=0.0, low_open=True, default=0.1, opensees="Shi"
    )
    pinching_spread_rate: ArrayLike = parameter(
        "1", "deltaPsi: growth of psi per normalised energy", low=0.0, default=0.0, opensees="deltaShi"
    )
    pinching_coupling: ArrayLike = parameter(
        "1", "lambda: breadth without pinching", low=0.0, low_open=True, default=0.5, opensees="lamda"
    )
    pinching_level: ArrayLike = parameter(
        "1", "q: centre of pinching over the bound of z", low=0.0, high=1.0, default=0.0, opensees="q"
    )

    opensees = ("BWBN",)
    has_rate = True
    rows = {
        "baber_noori": Coefficient.names(Coefficient.TOTAL_SLIP),
        "baber_noori_1": Coefficient.names(Coefficient.TOTAL_SLIP),
        "baber_noori_pinching": Coefficient.names(),
        "baber_noori_pinching_1": Coefficient.names(),
    }

    @classmethod
    def spring(cls, p: Values) -> str:
        """Return the name of the fastest set of device functions for these parameters.

        Sets without pinching need no exponentials; sets for the exponent 1 need no powers.
        """
        name = "baber_noori_pinching" if np.any(p["total_slip"] > 0) else "baber_noori"
        return f"{name}_1" if np.all(p["exponent"] == 1) else name

    @staticmethod
    def named_coefficients(p: Values, row: str) -> dict[str, np.ndarray]:
        stiffness, hardening, strength = p["stiffness"], p["hardening_ratio"], p["yield_force"]
        values = {
            "hardening_stiffness": hardening * stiffness,
            "hysteretic_force": (1 - hardening) * strength,
            "rate": stiffness / strength,
            "beta": p["beta"],
            "gamma": p["gamma"],
            "exponent": p["exponent"],
            "hysteretic_share": 1 - hardening,
            "growth_loss": p["growth_loss"],
            "strength_loss": p["strength_loss"],
            "stiffness_loss": p["stiffness_loss"],
        }
        if "pinching" not in row:
            return values
        return values | {
            "total_slip": p["total_slip"],
            "pinching_rate": p["pinching_rate"],
            "pinching_spread": p["pinching_spread"],
            "pinching_spread_rate": p["pinching_spread_rate"],
            "pinching_coupling": p["pinching_coupling"],
            "pinching_level": p["pinching_level"],
            "inverse_exponent": 1 / p["exponent"],
            "inverse_beta_and_gamma": 1 / (p["beta"] + p["gamma"]),
        }
