"""Bilinear storeys with kinematic hardening (OpenSees: Steel01 without isotropic hardening)."""

from __future__ import annotations

import numpy as np

from warpdyn.laws.law import HARDENING_RATIO, YIELD_FORCE, Law, Values


def _bilinear_coefficients(p: Values, spring: str) -> tuple[np.ndarray, ...]:
    stiffness, hardening = p["stiffness"], p["hardening_ratio"]
    return hardening * stiffness, (1 - hardening) * stiffness, p["yield_force"] / stiffness


BILINEAR = Law(
    {"yield_force": YIELD_FORCE, "hardening_ratio": HARDENING_RATIO},
    lambda p: "bilinear",
    _bilinear_coefficients,
)
