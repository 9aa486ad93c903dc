"""Peak-oriented storeys: Clough's law and Takeda's, on a trilinear backbone of cracking and yield.

`peak_oriented` is the law of Clough and Johnston (1966), with cracking and with Mahin and Bertero's reloading after
partial unloading (1976). OpenSees: Hysteretic with pinchX = pinchY = 1, no damage and beta = 0; its points are those
of cracking (s1, e1), of yield (s2, e2) and any further one (s3, e3).

`takeda` (Takeda, Sozen and Nielsen 1970) unloads the softer the farther the peak drift d of its side is:

- up to yield towards the cracking point of the other side;
- beyond it by (yield drift / d)^`unloading_exponent` of that slope at yield, but no softer than towards the origin.

Where the storey yields as it cracks, as by default, that is what is called modified Takeda, or Clough with degrading
unloading stiffness (Otani 1981). OpenSees: Hysteretic as above with beta the unloading exponent, but for the origin,
and in the one step in which the force changes its sign: there Hysteretic's force depends on the length of the step.

With cracking it differs. Hysteretic unloads from the cracking point on by (e1 / d)^beta of the initial stiffness, and
aims at the cracking point of a side that has not cracked. Takeda's storey, once it has yielded, is loaded on such a
side by the slope of unloading up to the cracking force, and aims at the yield point from there. Inner loops aim at
the peak of their side, as Hysteretic's do, not at that of the cycle before.
"""

from __future__ import annotations

import numpy as np

from warpdyn.laws.bounds import first_bad
from warpdyn.laws.law import HARDENING_RATIO, YIELD_FORCE, Law, Parameter, Values

BACKBONE = {
    "yield_force": YIELD_FORCE,
    "cracking_ratio": Parameter("1", "ratio of cracking to yield force", low=0.0, high=1.0, low_open=True, default=1.0),
    "cracked_stiffness_ratio": Parameter(
        "1",
        "ratio of the stiffness from cracking to yield to the initial storey stiffness",
        low=0.0,
        high=1.0,
        low_open=True,
        default=1.0,
    ),
    "hardening_ratio": HARDENING_RATIO,
}
UNLOADING_EXPONENT = Parameter(
    "1", "power of the peak ductility by which the unloading stiffness falls", low=0.0, high=0.5, default=0.4
)


def _backbone_coefficients(p: Values, spring: str) -> tuple[np.ndarray, ...]:
    cracking, cracked = p["cracking_ratio"], p["cracked_stiffness_ratio"]
    yield_drift = p["yield_force"] / p["stiffness"] * (cracking + (1 - cracking) / cracked)
    initial = p["stiffness"] * yield_drift / p["yield_force"]
    second, third = cracked * initial, p["hardening_ratio"] * initial
    return 1 / yield_drift, p["yield_force"], initial, 1 - second, second, 1 - third, third, cracking / initial


def _takeda_coefficients(p: Values, spring: str) -> tuple[np.ndarray, ...]:
    uncracked = np.where(p["cracking_ratio"] < 1, 0.0, -1.0)
    return *_backbone_coefficients(p, spring), p["unloading_exponent"], uncracked


def _problem(p: Values) -> str | None:
    hardening, cracked = p["hardening_ratio"], p["cracked_stiffness_ratio"]
    return first_bad(
        hardening > cracked, "hardening_ratio", hardening, "at most", cracked, "the cracked_stiffness_ratio there"
    )


PEAK_ORIENTED = Law(BACKBONE, lambda p: "peak_oriented", _backbone_coefficients, _problem)
TAKEDA = Law(BACKBONE | {"unloading_exponent": UNLOADING_EXPONENT}, lambda p: "takeda", _takeda_coefficients, _problem)

LAWS = {
    "peak_oriented": PEAK_ORIENTED,
    "takeda": TAKEDA,
}
