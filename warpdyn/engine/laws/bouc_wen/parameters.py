"""Bouc-Wen storeys (Bouc 1967, Wen 1976).

The force is F = alpha k d + (1 - alpha) Fy z with |z| <= (beta + gamma)^(-1/n), where alpha is the hardening ratio, k
the stiffness, d the drift, Fy the yield force and n the exponent.
"""

from __future__ import annotations

import enum

import numpy as np
from numpy.typing import ArrayLike

from warpdyn.engine.laws.bounds import first_place, place_of
from warpdyn.engine.laws.law import HARDENING_RATIO, YIELD_FORCE, Law, Layout, Values, parameter, shared


class Coefficient(Layout):
    """Coefficients of the device functions of a Bouc-Wen storey.

    EXPONENT is used only if it is neither 1 nor 2. BETA_RATE and GAMMA_RATE are used only if the exponent is not 1, or
    if beta and gamma differ.
    """

    HARDENING_STIFFNESS = enum.auto()
    HYSTERETIC_FORCE = enum.auto()
    RATE = enum.auto()  # 1 / yield drift
    BETA_RATE = enum.auto()  # beta / yield drift
    GAMMA_RATE = enum.auto()
    EXPONENT = enum.auto()


class BoucWen(Law):
    """A Bouc-Wen storey (Bouc 1967, Wen 1976): F = alpha k d + (1 - alpha) Fy z.

    alpha is the hardening ratio, k the stiffness, d the drift and Fy the yield force. `(Fy / k) dz/dt = v - |z|^n (beta
    |v| sign z + gamma v)`, where v is the drift velocity and n the exponent. -beta < gamma <= beta is required;
    otherwise z grows without bound, or the storey returns more energy than was put in (Erlicher and Point 2004). To
    obtain the same storey with OpenSees' BoucWen, multiply beta and gamma by (Fy / k)^-n and set Ao = 1; its z is a
    deformation, Fy / k times the z of this class.

    Example:
        >>> wd.laws.BoucWen(yield_force=1e6, hardening_ratio=0.05, exponent=2)
        BoucWen(yield_force=1000000.0, hardening_ratio=0.05, exponent=2.0)
    """

    yield_force: ArrayLike = shared(YIELD_FORCE)
    hardening_ratio: ArrayLike = shared(HARDENING_RATIO, opensees="alpha")
    beta: ArrayLike = parameter("1", "Bouc-Wen beta", low=0.0, low_open=True, default=0.5, opensees="beta")
    gamma: ArrayLike = parameter("1", "Bouc-Wen gamma, above -beta and at most beta", default=0.5, opensees="gamma")
    exponent: ArrayLike = parameter("1", "Bouc-Wen exponent n", low=0.0, low_open=True, default=1.0, opensees="n")

    opensees = ("BoucWen",)
    has_rate = True
    rows = {
        "bouc_wen_1_elastic_unloading": Coefficient.names(Coefficient.BETA_RATE),
        "bouc_wen_1": Coefficient.names(Coefficient.EXPONENT),
        "bouc_wen_2": Coefficient.names(Coefficient.EXPONENT),
        "bouc_wen": Coefficient.names(),
    }

    @classmethod
    def spring(cls, p: Values) -> str:
        """Return the name of the fastest set of device functions for these parameters.

        Exponents 1 and 2 need no power, which would take most of the time. Storeys with exponent 1 and beta = gamma
        need two coefficients less. Their set is used only if beta and gamma are the same constant in all storeys,
        because `p` contains only a few values of a random parameter.
        """
        beta = np.ravel(p["beta"])[0]
        if all(np.all(p[name] == value) for name, value in {"exponent": 1, "beta": beta, "gamma": beta}.items()):
            return "bouc_wen_1_elastic_unloading"
        for exponent in (1, 2):
            if np.all(p["exponent"] == exponent):
                return f"bouc_wen_{exponent}"
        return "bouc_wen"

    @staticmethod
    def named_coefficients(p: Values, row: str) -> dict[str, np.ndarray]:
        stiffness, hardening, strength = p["stiffness"], p["hardening_ratio"], p["yield_force"]
        rate = stiffness / strength
        if row == "bouc_wen_1_elastic_unloading":
            bound = 1 / (p["beta"] + p["gamma"])  # bound of |z|; the memory is z divided by this bound
            return {
                "hardening_stiffness": hardening * stiffness,
                "hysteretic_force": (1 - hardening) * strength * bound,
                "rate": rate / bound,
            }
        values = {
            "hardening_stiffness": hardening * stiffness,
            "hysteretic_force": (1 - hardening) * strength,
            "rate": rate,
            "beta_rate": p["beta"] * rate,
            "gamma_rate": p["gamma"] * rate,
        }
        return values | {"exponent": p["exponent"]} if row == "bouc_wen" else values

    @staticmethod
    def problem(p: Values) -> str | None:
        """Return a sentence about beta and gamma that contradict each other, or None."""
        beta, gamma = np.broadcast_arrays(p["beta"], p["gamma"])
        bad = (gamma <= -beta) | (gamma > beta)
        if not np.any(bad):
            return None
        place = first_place(bad)
        return (
            f"gamma is {gamma[place]:g} and beta is {beta[place]:g} ({place_of(place)}); "
            "a Bouc-Wen storey needs -beta < gamma <= beta"
        )

    @staticmethod
    def stiffest(p: Values) -> np.ndarray:
        """Return the largest tangent stiffness [N/m] of storeys, shape [structure, storey].

        The tangent stiffness is largest at the start of unloading from the bound of z. In unloading, (Fy / k) dz/dd = 1
        + (beta - gamma) |z|^n, where |z|^n is at most 1 / (beta + gamma). In loading, (Fy / k) dz/dd is at most 1.
        """
        beta, gamma, hardening = p["beta"], p["gamma"], p["hardening_ratio"]
        return p["stiffness"] * (1 + (1 - hardening) * (beta - gamma) / (beta + gamma))
