"""Bilinear storeys with kinematic hardening, and elastic-perfectly-plastic storeys."""

from __future__ import annotations

import enum

import numpy as np
from numpy.typing import ArrayLike

from warpdyn.engine.laws.law import HARDENING_RATIO, YIELD_FORCE, Law, Layout, Values, shared


class Coefficient(Layout):
    """Coefficients of the device functions: an elastic (hardening) spring in parallel with a spring that yields."""

    HARDENING_STIFFNESS = enum.auto()
    YIELDING_STIFFNESS = enum.auto()
    YIELD_DRIFT = enum.auto()


class Bilinear(Law):
    """A bilinear storey with kinematic hardening (OpenSees: Steel01 without isotropic hardening).

    Example:
        >>> wd.laws.Bilinear(yield_force=1e6, hardening_ratio=0.05)
        Bilinear(yield_force=1000000.0, hardening_ratio=0.05)
    """

    yield_force: ArrayLike = shared(YIELD_FORCE, opensees="Fy")
    hardening_ratio: ArrayLike = shared(HARDENING_RATIO, opensees="b")

    opensees = ("Steel01",)
    rows = {"bilinear": Coefficient.names()}
    is_linear_until_yield = True

    @staticmethod
    def named_coefficients(p: Values, row: str) -> dict[str, np.ndarray]:
        stiffness, hardening = p["stiffness"], p["hardening_ratio"]
        return {
            "hardening_stiffness": hardening * stiffness,
            "yielding_stiffness": (1 - hardening) * stiffness,
            "yield_drift": p["yield_force"] / stiffness,
        }


class ElasticPerfectlyPlastic(Law):
    """An elastic-perfectly-plastic storey (OpenSees: ElasticPP; its epsyP is the yield force divided by the stiffness).

    Example:
        >>> wd.laws.ElasticPerfectlyPlastic(yield_force=[1.2e6, 0.8e6])
        ElasticPerfectlyPlastic(yield_force=(1200000.0, 800000.0))
    """

    yield_force: ArrayLike = shared(YIELD_FORCE, opensees="epsyP times E")

    opensees = ("ElasticPP",)
    variants = Bilinear.variants
    is_linear_until_yield = True

    @staticmethod
    def named_coefficients(p: Values, row: str) -> dict[str, np.ndarray]:
        return {
            "hardening_stiffness": np.zeros_like(p["stiffness"]),
            "yielding_stiffness": p["stiffness"],
            "yield_drift": p["yield_force"] / p["stiffness"],
        }
