"""Seismic isolators as storey laws, in the terms of those who specify them; both are bilinear to a kernel."""

from __future__ import annotations

import numpy as np

from warpdyn.laws.bounds import first_place, place_of
from warpdyn.laws.law import YIELD_FORCE, Law, Parameter, Values


def _lead_rubber_coefficients(p: Values, spring: str) -> tuple[np.ndarray, ...]:
    stiffness, after = p["stiffness"], p["post_yield_stiffness"]
    return after, stiffness - after, p["yield_force"] / stiffness


def _lead_rubber_problem(p: Values) -> str | None:
    return _not_below(p, "post_yield_stiffness", p["post_yield_stiffness"], "the stiffness before yield")


def _pendulum_stiffness(p: Values) -> np.ndarray:
    return p["weight"] / p["radius"]


def _friction_pendulum_coefficients(p: Values, spring: str) -> tuple[np.ndarray, ...]:
    restoring = _pendulum_stiffness(p)
    return restoring, p["stiffness"] - restoring, p["friction_coefficient"] * p["weight"] / (p["stiffness"] - restoring)


def _friction_pendulum_problem(p: Values) -> str | None:
    return _not_below(p, "weight over radius", _pendulum_stiffness(p), "the stiffness before sliding")


def _not_below(p: Values, name: str, values: np.ndarray, of_what: str) -> str | None:
    """Return a sentence on the first value that is not below the initial stiffness."""
    values, stiffness = np.broadcast_arrays(values, p["stiffness"])
    bad = values >= stiffness
    if not bad.any():
        return None
    place = first_place(bad)
    return f"{name} is {values[place]:g} N/m ({place_of(place)}); it must be below {of_what}, {stiffness[place]:g} N/m"


# OpenSees: elastomericBearingPlasticity with kInit, qd = yield force times (1 - k2 / kInit), and alpha1 = k2 / kInit.
LEAD_RUBBER_BEARING = Law(
    {
        "yield_force": YIELD_FORCE,
        "post_yield_stiffness": Parameter("N m-1", "stiffness of the bearings after yield", low=0.0),
    },
    lambda p: "bilinear",
    _lead_rubber_coefficients,
    _lead_rubber_problem,
)
# OpenSees: singleFPBearing with Coulomb friction mu, Reff and kInit, under a weight that stays as it is.
FRICTION_PENDULUM = Law(
    {
        "friction_coefficient": Parameter(
            "1", "friction coefficient of the sliding surface", low=0.0, high=1.0, high_open=True, often_in_percent=True
        ),
        "radius": Parameter("m", "effective radius of the sliding surface", low=0.0, low_open=True),
        "weight": Parameter("N", "weight that the sliding bearings carry", low=0.0, low_open=True),
    },
    lambda p: "bilinear",
    _friction_pendulum_coefficients,
    _friction_pendulum_problem,
)

LAWS = {
    "lead_rubber_bearing": LEAD_RUBBER_BEARING,
    "friction_pendulum": FRICTION_PENDULUM,
}
