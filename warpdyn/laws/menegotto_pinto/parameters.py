"""Menegotto-Pinto storeys (Menegotto and Pinto 1973; Filippou, Popov and Bertero 1983; OpenSees: Steel02).

Names in OpenSees: `yield_force` Fy, `stiffness` E0, `hardening_ratio` b, `transition_curvature` R0,
`curvature_reduction` cR1, `curvature_reduction_ductility` cR2, `isotropic_hardening` a1 and a3,
`isotropic_hardening_ductility` a2 and a4: a storey hardens alike both ways. Steel02 has no initial force here.
"""

from __future__ import annotations

import numpy as np

from warpdyn.laws.bounds import above, first_bad
from warpdyn.laws.law import HARDENING_RATIO, YIELD_FORCE, Law, Parameter, Values


def _spring(p: Values) -> str:
    """Isotropic hardening takes a power more and a value of memory."""
    return "menegotto_pinto_isotropic" if np.any(p["isotropic_hardening"]) else "menegotto_pinto"


def _coefficients(p: Values, spring: str) -> tuple[np.ndarray, ...]:
    stiffness, hardening, strength = p["stiffness"], p["hardening_ratio"], p["yield_force"]
    curve = p["transition_curvature"], p["curvature_reduction"], p["curvature_reduction_ductility"]
    values = (stiffness / strength, (1 - hardening) * strength, hardening * stiffness, *curve)
    if spring == "menegotto_pinto":
        return values
    return (*values, p["isotropic_hardening"], 0.5 / p["isotropic_hardening_ductility"])


def _problem(p: Values) -> str | None:
    """Below an exponent of 1 the storey yields before it moves, and what it stores has no converging series."""
    exponent, reduction = p["transition_curvature"], p["curvature_reduction"]
    least = 1 / (1 - reduction)
    reason = "1 / (1 - curvature_reduction): the exponent of no later transition may be below 1"
    return first_bad(above(least, exponent), "transition_curvature", exponent, "at least", least, reason)


MENEGOTTO_PINTO = Law(
    {
        "yield_force": YIELD_FORCE,
        "hardening_ratio": HARDENING_RATIO,
        "transition_curvature": Parameter(
            "1", "exponent R0 of the first transition from elastic to hardening", low=0.0, low_open=True, default=20.0
        ),
        "curvature_reduction": Parameter(
            "1", "largest share cR1 that the exponent loses", low=0.0, high=1.0, high_open=True, default=0.925
        ),
        "curvature_reduction_ductility": Parameter(
            "1", "plastic excursion cR2 over yield drift at half that loss", low=0.0, low_open=True, default=0.15
        ),
        "isotropic_hardening": Parameter(
            "1", "rise of the yield force over itself at the isotropic hardening ductility", low=0.0, default=0.0
        ),
        "isotropic_hardening_ductility": Parameter(
            "1", "half the range of drift over yield drift of that rise", low=0.0, low_open=True, default=1.0
        ),
    },
    _spring,
    _coefficients,
    _problem,
)

LAWS = {
    "menegotto_pinto": MENEGOTTO_PINTO,
}
