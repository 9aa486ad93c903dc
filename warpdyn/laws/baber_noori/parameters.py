"""Bouc-Wen storeys that degrade and pinch with the energy they dissipated (Baber and Wen 1981, Baber and Noori 1985).

F = alpha k d + (1 - alpha) Fy z as in `bouc_wen`, and e is the energy that z took up, the integral of
(1 - alpha) Fy z dd, over that of yield, Fy dy, with the yield drift dy = Fy / k. With A = 1 - deltaA e,
nu = 1 + deltaNu e and eta = 1 + deltaEta e,

    dy dz/dt = h v (A - nu |z|^n (gamma + beta sign(v z))) / eta,
    h = 1 - zeta1 exp(-((z sign v - q zu) / zeta2)^2),    zu = (A / (nu (beta + gamma)))^(1/n),
    zeta1 = zetas (1 - exp(-p e)),    zeta2 = (psi + deltaPsi e) (lambda + zeta1)    (Foliente 1995).

OpenSees has the degradation in BoucWen and the pinching in BWBN, where z is a deformation dy times ours, Ao is 1, and
energies are in J: gamma and beta there are dy^-n times ours; deltaA = `growth_loss` / (Fy dy), deltaNu =
`strength_loss` / (Fy dy), deltaEta = `stiffness_loss` / (Fy dy), p = `pinching_rate` / (Fy dy), Shi =
`pinching_spread` dy, deltaShi = `pinching_spread_rate` / Fy, zetas = `total_slip`, q = `pinching_level`, lamda =
`pinching_coupling`.

These differ from OpenSees on purpose:

- A goes no lower than 0. In OpenSees it goes on below, and z turns against the velocity: the storey gives energy.
- The bound zu of z degrades with it as in Foliente (1995), so that both kinds go together.
- OpenSees goes along a step by Euler's backward rule, of first order.
"""

from __future__ import annotations

import numpy as np

from warpdyn.laws.bouc_wen.parameters import BOUC_WEN
from warpdyn.laws.law import Law, Parameter, Values


def _baber_noori_spring(p: Values) -> str:
    name = "baber_noori_pinching" if np.any(p["total_slip"] > 0) else "baber_noori"
    return f"{name}_1" if np.all(p["exponent"] == 1) else name


def _baber_noori_coefficients(p: Values, spring: str) -> tuple[np.ndarray, ...]:
    stiffness, hardening, strength = p["stiffness"], p["hardening_ratio"], p["yield_force"]
    values = (
        hardening * stiffness,
        (1 - hardening) * strength,
        stiffness / strength,
        p["beta"],
        p["gamma"],
        p["exponent"],
        1 - hardening,
        p["growth_loss"],
        p["strength_loss"],
        p["stiffness_loss"],
    )
    if "pinching" not in spring:
        return values
    return (
        *values,
        p["total_slip"],
        p["pinching_rate"],
        p["pinching_spread"],
        p["pinching_spread_rate"],
        p["pinching_coupling"],
        p["pinching_level"],
        1 / p["exponent"],
        1 / (p["beta"] + p["gamma"]),
    )


BABER_NOORI = Law(
    {
        **BOUC_WEN.parameters,
        "growth_loss": Parameter("1", "Baber-Wen deltaA: loss of A by energy over that of yield", low=0.0, default=0.0),
        "strength_loss": Parameter("1", "deltaNu: growth of nu, by which strength falls", low=0.0, default=0.0),
        "stiffness_loss": Parameter("1", "deltaEta: growth of eta, by which stiffness falls", low=0.0, default=0.0),
        "total_slip": Parameter("1", "zetas: largest pinching", low=0.0, high=1.0, high_open=True, default=0.0),
        "pinching_rate": Parameter("1", "p: rate at which pinching begins, by energy", low=0.0, default=0.0),
        "pinching_spread": Parameter("1", "psi: breadth of pinching", low=0.0, low_open=True, default=0.1),
        "pinching_spread_rate": Parameter("1", "deltaPsi: growth of that breadth, by energy", low=0.0, default=0.0),
        "pinching_coupling": Parameter("1", "lambda: breadth without pinching", low=0.0, low_open=True, default=0.5),
        "pinching_level": Parameter("1", "q: centre of pinching over the bound of z", low=0.0, high=1.0, default=0.0),
    },
    _baber_noori_spring,
    _baber_noori_coefficients,
    BOUC_WEN.problem,
    BOUC_WEN.stiffest,
)

LAWS = {
    "baber_noori": BABER_NOORI,
}
