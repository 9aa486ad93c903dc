"""Trilinear and quadrilinear backbones with kinematic hardening (OpenSees: MultiLinear).

OpenSees' points e1 s1, e2 s2, ... are the corners: the first is that of `yield_force`; the further ones are given by
drift over yield drift and force over yield force, so that a backbone keeps its shape where stiffness and yield force
are scattered. `hardening_ratio` leads on from the last corner.
"""

from __future__ import annotations

import numpy as np

from warpdyn.laws.bounds import above, first_bad
from warpdyn.laws.law import HARDENING_RATIO, YIELD_FORCE, Law, Parameter, Values


def _corner_parameters(corner: int) -> dict[str, Parameter]:
    where = f"at corner {corner} of the backbone, counted from the one at yield,"
    return {
        f"ductility_{corner}": Parameter("1", f"drift {where} over yield drift", low=1.0, low_open=True),
        f"force_ratio_{corner}": Parameter("1", f"force {where} over yield force", low=1.0),
    }


def _slopes(p: Values, corners: int) -> list[np.ndarray]:
    """Return the slopes of the backbone over the initial stiffness, the first of them 1."""
    slopes, ductility, force = [np.ones_like(p["yield_force"])], 1.0, 1.0
    for corner in range(2, corners + 1):
        further, stronger = p[f"ductility_{corner}"], p[f"force_ratio_{corner}"]
        slopes.append((stronger - force) / (further - ductility))
        ductility, force = further, stronger
    return [*slopes, p["hardening_ratio"]]


def _coefficients(p: Values, corners: int) -> tuple[np.ndarray, ...]:
    """Return the hardening stiffness, then for each corner what stiffness is lost there and its drift."""
    slopes = _slopes(p, corners)
    yield_drift = p["yield_force"] / p["stiffness"]
    drifts = [yield_drift, *(p[f"ductility_{corner}"] * yield_drift for corner in range(2, corners + 1))]
    values = [p["stiffness"] * slopes[-1]]
    for before, after, drift in zip(slopes, slopes[1:], drifts, strict=False):
        values += [p["stiffness"] * (before - after), drift]
    return tuple(values)


def _problem(p: Values, corners: int) -> str | None:
    """Return what is wrong with a backbone, which must lead on and bend down at each corner."""
    ductility, force = np.ones_like(p["yield_force"]), 1.0
    for corner in range(2, corners + 1):
        names = f"ductility_{corner}", f"force_ratio_{corner}"
        further, stronger = (p[name] for name in names)
        problem = first_bad(further <= ductility, names[0], further, "above", ductility, f"that of corner {corner - 1}")
        if problem:
            return problem
        # The line after the last corner may not fall (hardening_ratio), so that none before it can.
        problem = first_bad(stronger < force, names[1], stronger, "at least", force, f"that of corner {corner - 1}")
        if problem:
            return problem
        slope = _slopes(p, corners)[corner - 2]
        straight = force + slope * (further - ductility)
        reason = f"which lies on the line that leads to corner {corner - 1}"
        problem = first_bad(above(stronger, straight), names[1], stronger, "at most", straight, reason)
        if problem:
            return problem
        ductility, force = further, stronger
    slope, hardening = _slopes(p, corners)[-2], p["hardening_ratio"]
    reason = f"the slope to corner {corners} over the initial stiffness"
    return first_bad(above(hardening, slope), "hardening_ratio", hardening, "at most", slope, reason)


def _backbone(corners: int) -> Law:
    """Return the law of a backbone of so many corners."""
    further = [_corner_parameters(corner) for corner in range(2, corners + 1)]
    own = {name: parameter for corner in further for name, parameter in corner.items()}
    return Law(
        {"yield_force": YIELD_FORCE, **own, "hardening_ratio": HARDENING_RATIO},
        lambda p: f"multilinear_{corners}",
        lambda p, spring: _coefficients(p, corners),
        lambda p: _problem(p, corners),
    )


TRILINEAR = _backbone(2)
QUADRILINEAR = _backbone(3)

LAWS = {
    "trilinear": TRILINEAR,
    "quadrilinear": QUADRILINEAR,
}
