"""Seismic isolators as storey laws: usual parameters of isolators, with the device functions of the bilinear law."""

from __future__ import annotations

import numpy as np
from numpy.typing import ArrayLike

from warpdyn.engine.laws.bilinear.parameters import Bilinear
from warpdyn.engine.laws.bounds import first_place, place_of
from warpdyn.engine.laws.law import YIELD_FORCE, Law, Values, parameter, shared


class LeadRubberBearing(Law):
    """Lead-rubber bearings under a building; the stiffness before yield is the `stiffness` of their storey.

    OpenSees: elastomericBearingPlasticity with kInit, qd = yield force times (1 - k2 / kInit), and alpha1 = k2 / kInit,
    where kInit is the stiffness before yield and k2 the stiffness after yield.

    Example:
        >>> wd.laws.LeadRubberBearing(yield_force=6e5, post_yield_stiffness=8e6)
        LeadRubberBearing(yield_force=600000.0, post_yield_stiffness=8000000.0)
    """

    yield_force: ArrayLike = shared(YIELD_FORCE)
    post_yield_stiffness: ArrayLike = parameter("N m-1", "stiffness of the bearings after yield", low=0.0)

    opensees = ("elastomericBearingPlasticity",)
    variants = Bilinear.variants

    @staticmethod
    def named_coefficients(p: Values, row: str) -> dict[str, np.ndarray]:
        stiffness, after = p["stiffness"], p["post_yield_stiffness"]
        return {
            "hardening_stiffness": after,
            "yielding_stiffness": stiffness - after,
            "yield_drift": p["yield_force"] / stiffness,
        }

    @staticmethod
    def problem(p: Values) -> str | None:
        return _not_below(p, "post_yield_stiffness", p["post_yield_stiffness"], "the stiffness before yield")


class FrictionPendulum(Law):
    """Friction pendulum bearings under a building; the stiffness before sliding is the `stiffness` of their storey.

    OpenSees: singleFPBearing with Coulomb friction, under a constant weight.

    Example:
        >>> wd.laws.FrictionPendulum(friction_coefficient=0.06, radius=2.2, weight=9e6)
        FrictionPendulum(friction_coefficient=0.06, radius=2.2, weight=9000000.0)
    """

    friction_coefficient: ArrayLike = parameter(
        "1",
        "friction coefficient of the sliding surface",
        low=0.0,
        high=1.0,
        high_open=True,
        often_in_percent=True,
        opensees="mu",
    )
    radius: ArrayLike = parameter(
        "m", "effective radius of the sliding surface", low=0.0, low_open=True, opensees="Reff"
    )
    weight: ArrayLike = parameter("N", "weight that the sliding bearings carry", low=0.0, low_open=True)

    opensees = ("singleFPBearing",)
    variants = Bilinear.variants

    @staticmethod
    def named_coefficients(p: Values, row: str) -> dict[str, np.ndarray]:
        restoring = _pendulum_stiffness(p)
        return {
            "hardening_stiffness": restoring,
            "yielding_stiffness": p["stiffness"] - restoring,
            "yield_drift": p["friction_coefficient"] * p["weight"] / (p["stiffness"] - restoring),
        }

    @staticmethod
    def problem(p: Values) -> str | None:
        return _not_below(p, "weight over radius", _pendulum_stiffness(p), "the stiffness before sliding")


def _pendulum_stiffness(p: Values) -> np.ndarray:
    return p["weight"] / p["radius"]


def _not_below(p: Values, name: str, values: np.ndarray, of_what: str) -> str | None:
    """Return a sentence about the first value [N/m] that is not below the initial stiffness of its storey, or None."""
    values, stiffness = np.broadcast_arrays(values, p["stiffness"])
    bad = values >= stiffness
    if not bad.any():
        return None
    place = first_place(bad)
    return (
        f"{name} is {values[place]:g} N/m ({place_of(place)}); it must be below {of_what}, {stiffness[place]:g} N/m: "
        "increase the stiffness of this storey"
    )
