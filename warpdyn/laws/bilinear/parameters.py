"""Bilinear storeys with kinematic hardening, and elastic-perfectly-plastic ones.

OpenSees: Steel01 without isotropic hardening; ElasticPP, whose epsyP is the yield force over the stiffness.
"""

from __future__ import annotations

import numpy as np

from warpdyn.laws.law import HARDENING_RATIO, YIELD_FORCE, Law, Values


def _bilinear_coefficients(p: Values, spring: str) -> tuple[np.ndarray, ...]:
    stiffness, hardening = p["stiffness"], p["hardening_ratio"]
    return hardening * stiffness, (1 - hardening) * stiffness, p["yield_force"] / stiffness


def _perfectly_plastic_coefficients(p: Values, spring: str) -> tuple[np.ndarray, ...]:
    return np.zeros_like(p["stiffness"]), p["stiffness"], p["yield_force"] / p["stiffness"]


BILINEAR = Law(
    {"yield_force": YIELD_FORCE, "hardening_ratio": HARDENING_RATIO},
    lambda p: "bilinear",
    _bilinear_coefficients,
)
ELASTIC_PERFECTLY_PLASTIC = Law({"yield_force": YIELD_FORCE}, lambda p: "bilinear", _perfectly_plastic_coefficients)

LAWS = {
    "bilinear": BILINEAR,
    "elastic_perfectly_plastic": ELASTIC_PERFECTLY_PLASTIC,
}
