"""Bouc-Wen storeys (Bouc 1967, Wen 1976): F = alpha k d + (1 - alpha) Fy z, |z| at most (beta + gamma)^(-1/n)."""

from __future__ import annotations

import enum

import numpy as np
from numpy.typing import ArrayLike

from warpdyn.engine.laws.bounds import first_place, place_of
from warpdyn.engine.laws.law import HARDENING_RATIO, YIELD_FORCE, Law, Layout, Values, parameter, shared


class Coefficient(Layout):
    """Coefficients of the device functions.

    EXPONENT is read only if it is neither 1 nor 2, BETA_RATE and GAMMA_RATE only if beta and gamma differ.
    """

    HARDENING_STIFFNESS = enum.auto()
    HYSTERETIC_FORCE = enum.auto()
    RATE = enum.auto()  # 1 / yield drift
    BETA_RATE = enum.auto()  # beta / yield drift
    GAMMA_RATE = enum.auto()
    EXPONENT = enum.auto()


class BoucWen(Law):
    """A Bouc-Wen storey (Bouc 1967, Wen 1976): F = alpha k d + (1 - alpha) Fy z.

    Here `(Fy / k) dz/dt = v - |z|^n (beta |v| sign z + gamma v)`, with -beta < gamma <= beta: otherwise z grows without
    bound, or returns more energy than was put in (Erlicher and Point 2004). In OpenSees' BoucWen, z is a deformation,
    Fy / k times the z here, Ao is 1, and beta and gamma are (Fy / k)^-n times those here.

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
        """Return the quickest variant: exponents 1 and 2 need no power, which would take most of the time.

        Storeys with exponent 1 and beta = gamma have two coefficients less. Beta and gamma must then be the same
        constant in all storeys, because `p` has only a few values of a scattered parameter.
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
            bound = 1 / (p["beta"] + p["gamma"])  # of z, by which z is divided
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
        """Return a sentence on beta and gamma that contradict each other, or None."""
        beta, gamma = np.broadcast_arrays(p["beta"], p["gamma"])
        bad = (gamma <= -beta) | (gamma > beta)
        if not np.any(bad):
            return None
        place = first_place(bad)
        return (
            f"gamma is {gamma[place]:g} where beta is {beta[place]:g} ({place_of(place)}); "
            "a Bouc-Wen storey needs -beta < gamma <= beta"
        )

    @staticmethod
    def stiffest(p: Values) -> np.ndarray:
        """Return the stiffness at the beginning of unloading from the bound of z, or at rest if gamma = beta.

        Unloading, (Fy / k) dz/dd = 1 + (beta - gamma) |z|^n, and |z|^n is at most 1 / (beta + gamma). Loading it is at
        most 1.
        """
        beta, gamma, hardening = p["beta"], p["gamma"], p["hardening_ratio"]
        return p["stiffness"] * (1 + (1 - hardening) * (beta - gamma) / (beta + gamma))
