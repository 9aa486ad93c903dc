"""Trilinear storeys with pinching, damage and softer unloading (OpenSees: Hysteretic), as SimCenter's MDOF-LU has them.

The backbone goes on with its third slope beyond the last corner if that rises, and level if not. With yield drift dy =
`yield_force` / `stiffness`, OpenSees' names are: s1p, e1p = `yield_force`, dy; s2p, e2p = `force_ratio_2` times the
yield force, `ductility_2` dy; s3p, e3p by `force_ratio_3` and `ductility_3`; the same with a minus sign for s1n to
e3n; pinchX = `pinching_drift`, pinchY = `pinching_force`; damage1 = `damage_by_ductility`, damage2 =
`damage_by_energy` (of the energy under both sides of the backbone); beta = `unloading_exponent`.

Three things differ from OpenSees on purpose. No part of the backbone may be stiffer than its first, and no corner have
a negative force. Unloading is no softer than towards the origin: where it is in OpenSees, which is with an exponent
near 1 and a force above yield, a storey pushes on beyond the origin, its force jumps in reloading, and cycles give
energy. And a backbone that comes to no force does so at the drift where its line crosses zero: OpenSees looks
there whether the rounded force is above zero, and if it is, takes the storey for one that never lost its strength.
"""

from __future__ import annotations

import numpy as np

from warpdyn.laws.backbone import backbone_problem, corner_parameters, corners
from warpdyn.laws.law import YIELD_FORCE, Law, Parameter, Values

NEVER = 1e30  # yield drifts


def _hysteretic_spring(p: Values) -> str:
    return "hysteretic_softer_unloading" if np.any(p["unloading_exponent"] > 0) else "hysteretic"


def _hysteretic_coefficients(p: Values, spring: str) -> tuple[np.ndarray, ...]:
    (_, d2, d3), (_, f2, f3) = corners(p, 3)
    second, third = (f2 - 1) / (d2 - 1), (f3 - f2) / (d3 - d2)
    # Where the parts' lines come to no force, if they do so before the next corner.
    falls = third < 0
    gone_second = np.where((second < 0) & (f2 == 0), d2, NEVER)
    gone_third = np.where(falls & (f3 == 0), d3, NEVER)
    energy = 2 * (0.5 + (d2 - 1) * (1 + f2) / 2 + (d3 - d2) * (f2 + f3) / 2)
    values = (
        p["stiffness"] / p["yield_force"],
        p["yield_force"],
        d2 - 1,
        second,
        third,
        np.where(third > 0, NEVER, d3 - d2),
        gone_second,
        gone_third,
        p["pinching_drift"],
        p["pinching_force"],
        p["damage_by_ductility"],
        p["damage_by_energy"] / energy,
    )
    return (*values, p["unloading_exponent"]) if spring == "hysteretic_softer_unloading" else values


HYSTERETIC = Law(
    {
        "yield_force": YIELD_FORCE,
        **corner_parameters(2),
        **corner_parameters(3),
        "pinching_drift": Parameter("1", "pinching of drift in reloading (1: none)", low=0.0, high=1.0, default=1.0),
        "pinching_force": Parameter("1", "pinching of force in reloading (1: none)", low=0.0, high=1.0, default=1.0),
        "damage_by_ductility": Parameter("1", "growth of the drift aimed at, by ductility", low=0.0, default=0.0),
        "damage_by_energy": Parameter("1", "growth of the drift aimed at, by energy", low=0.0, default=0.0),
        "unloading_exponent": Parameter(
            "1", "power of ductility by which unloading softens", low=0.0, high=1.0, default=0.0
        ),
    },
    _hysteretic_spring,
    _hysteretic_coefficients,
    lambda p: backbone_problem(p, 3),
)

LAWS = {
    "hysteretic": HYSTERETIC,
}
