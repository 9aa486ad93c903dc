"""Elastic-perfectly-plastic storeys (OpenSees: ElasticPP, whose epsyP is the yield force over the stiffness)."""

from __future__ import annotations

import numpy as np

from warpdyn.laws.law import YIELD_FORCE, Law, Values


def _coefficients(p: Values, spring: str) -> tuple[np.ndarray, ...]:
    return np.zeros_like(p["stiffness"]), p["stiffness"], p["yield_force"] / p["stiffness"]


ELASTIC_PERFECTLY_PLASTIC = Law({"yield_force": YIELD_FORCE}, lambda p: "bilinear", _coefficients)
