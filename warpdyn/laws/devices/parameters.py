"""Devices that stand beside a storey's law, each with parameters of its own; 0 where a storey has none."""

from __future__ import annotations

import numpy as np

from warpdyn.laws.bounds import first_place, place_of
from warpdyn.laws.law import Law, Parameter, Values

NO_STOP = 1e30  # m


def _friction_coefficients(p: Values, spring: str) -> tuple[np.ndarray, ...]:
    # A brace that no joint holds is not there.
    brace = np.where(p["slip_force"] > 0, p["brace_stiffness"], 0.0)
    return brace, np.divide(p["slip_force"], brace, out=np.zeros_like(brace), where=brace > 0)


def _friction_problem(p: Values) -> str | None:
    slip, brace = np.broadcast_arrays(p["slip_force"], p["brace_stiffness"])
    bad = (slip > 0) & (brace == 0)
    if not bad.any():
        return None
    place = first_place(bad)
    return f"brace_stiffness is 0 where slip_force is {slip[place]:g} N ({place_of(place)}); it must be above 0 there"


def _stop_coefficients(p: Values, spring: str) -> tuple[np.ndarray, ...]:
    given_back = p["restitution"] ** 2  # of the energy
    ahead = np.broadcast_to(p["clearance"], given_back.shape)
    return p["contact_stiffness"] / given_back, ahead, ahead, 1 - given_back


def _one_sided_stop_coefficients(p: Values, spring: str) -> tuple[np.ndarray, ...]:
    stiffness, ahead, _, kept = _stop_coefficients(p, spring)
    return stiffness, ahead, np.full_like(ahead, NO_STOP), kept


def _stop_stiffest(p: Values) -> np.ndarray:
    return p["contact_stiffness"] / p["restitution"] ** 2


_STOP = {
    "clearance": Parameter("m", "clearance before the stop", low=0.0),
    "contact_stiffness": Parameter("N m-1", "stiffness of the stop as it is pressed in", low=0.0),
    "restitution": Parameter(
        "1", "coefficient of restitution of the stop", low=0.0, high=1.0, low_open=True, default=1.0
    ),
}
DEVICES = {
    # OpenSees: an ElasticPP beside the storey's own material.
    "friction_damper": Law(
        {
            "slip_force": Parameter("N", "force at which the friction damper slips", low=0.0),
            "brace_stiffness": Parameter("N m-1", "stiffness of the friction damper's brace", low=0.0),
        },
        lambda p: "slip",
        _friction_coefficients,
        _friction_problem,
        lambda p: np.where(p["slip_force"] > 0, p["brace_stiffness"], 0.0),
    ),
    # OpenSees: an ElasticPPGap that never yields, where all energy is given back.
    "gap": Law(_STOP, lambda p: "gap", _stop_coefficients, stiffest=_stop_stiffest),
    "one_sided_gap": Law(_STOP, lambda p: "gap", _one_sided_stop_coefficients, stiffest=_stop_stiffest),
    # OpenSees: Viscous, with the exponent. It has no spring: kernels have it among the dashpots.
    "viscous_damper": Law(
        {
            "damper_coefficient": Parameter("N s m-1", "force of the viscous damper at 1 m/s", low=0.0),
            "velocity_exponent": Parameter(
                "1", "velocity exponent of the viscous damper", low=0.0, high=1.0, low_open=True, default=1.0
            ),
            "linear_velocity": Parameter(
                "m s-1",
                "velocity below which a viscous damper of an exponent below 1 is linear",
                low=0.0,
                low_open=True,
                default=0.01,
            ),
        },
        lambda p: "",
        lambda p, spring: (),
        stiffest=lambda p: np.zeros_like(p["stiffness"]),
    ),
}


def kind_of_dampers(devices: tuple[str, ...], p: Values) -> str:
    """Return what a building's viscous dampers are: "none", "linear" or a "power" of the velocity."""
    if "viscous_damper" not in devices:
        return "none"
    return "linear" if np.all(p["velocity_exponent"] == 1) else "power"


def damper_values(p: Values) -> tuple[np.ndarray, ...]:
    """Return what kernels read of viscous dampers: coefficient, exponent less 1, linear velocity."""
    return p["damper_coefficient"], p["velocity_exponent"] - 1, p["linear_velocity"]


def steepest_damping(p: Values) -> np.ndarray:
    """Return the largest slope of the viscous dampers' force [N s/m]: that around rest."""
    coefficient, exponent_less_1, velocity = damper_values(p)
    return coefficient * velocity**exponent_less_1
