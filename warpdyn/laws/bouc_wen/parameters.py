"""Bouc-Wen storeys (Bouc 1967, Wen 1976): F = alpha k d + (1 - alpha) Fy z, |z| at most (beta + gamma)^(-1/n)."""

from __future__ import annotations

import numpy as np

from warpdyn.laws.bounds import first_place, place_of
from warpdyn.laws.law import HARDENING_RATIO, YIELD_FORCE, Law, Parameter, Values


def _bouc_wen_spring(p: Values) -> str:
    """Exponents 1 and 2 have kernels without a power, which is what most of the time would go to."""
    for exponent in (1, 2):
        if np.all(p["exponent"] == exponent):
            return f"bouc_wen_{exponent}"
    return "bouc_wen"


def _bouc_wen_coefficients(p: Values, spring: str) -> tuple[np.ndarray, ...]:
    stiffness, hardening, strength = p["stiffness"], p["hardening_ratio"], p["yield_force"]
    rate = stiffness / strength
    values = hardening * stiffness, (1 - hardening) * strength, rate, p["beta"] * rate, p["gamma"] * rate
    return (*values, p["exponent"]) if spring == "bouc_wen" else values


def _bouc_wen_problem(p: Values) -> str | None:
    """Beyond these bounds z grows without end, or gives back more energy than was put in (Erlicher and Point 2004)."""
    beta, gamma = np.broadcast_arrays(p["beta"], p["gamma"])
    bad = (gamma <= -beta) | (gamma > beta)
    if not np.any(bad):
        return None
    place = first_place(bad)
    return (
        f"gamma is {gamma[place]:g} where beta is {beta[place]:g} ({place_of(place)}); "
        "a Bouc-Wen storey needs -beta < gamma <= beta"
    )


def _bouc_wen_stiffest(p: Values) -> np.ndarray:
    """A storey is stiffest as it begins to unload from its bound, if gamma < beta; at rest otherwise.

    Unloading, uy dz/dd = 1 + (beta - gamma) |z|^n, and |z|^n is at most 1 / (beta + gamma). Loading it is at most 1.
    """
    beta, gamma, hardening = p["beta"], p["gamma"], p["hardening_ratio"]
    return p["stiffness"] * (1 + (1 - hardening) * (beta - gamma) / (beta + gamma))


BOUC_WEN = Law(
    {
        "yield_force": YIELD_FORCE,
        "hardening_ratio": HARDENING_RATIO,
        "beta": Parameter("1", "Bouc-Wen beta", low=0.0, low_open=True, default=0.5),
        "gamma": Parameter("1", "Bouc-Wen gamma", default=0.5),
        "exponent": Parameter("1", "Bouc-Wen exponent n", low=0.0, low_open=True, default=1.0),
    },
    _bouc_wen_spring,
    _bouc_wen_coefficients,
    _bouc_wen_problem,
    _bouc_wen_stiffest,
)

LAWS = {
    "bouc_wen": BOUC_WEN,
}
