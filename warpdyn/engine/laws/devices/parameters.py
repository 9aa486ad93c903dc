"""Parameters of dampers and stops (class `Device`), which act in parallel with the law of a storey.

In storeys without a damper or stop, its strength (force, stiffness or coefficient) is 0.
"""

from __future__ import annotations

import enum

import numpy as np
from numpy.typing import ArrayLike

from warpdyn.engine.laws.bounds import first_place, place_of
from warpdyn.engine.laws.law import Device, Layout, Values, parameter, shared
from warpdyn.engine.laws.parameter import Parameter

NO_STOP = 1e30  # m
CLEARANCE = Parameter("m", "clearance before the stop", low=0.0)
CONTACT_STIFFNESS = Parameter("N m-1", "stiffness of the stop in loading", low=0.0)
RESTITUTION = Parameter(
    "1", "coefficient of restitution of the stop", low=0.0, high=1.0, low_open=True, often_in_percent=True
)


class FrictionCoefficient(Layout):
    """Coefficients of the device functions of a friction damper."""

    BRACE_STIFFNESS = enum.auto()
    SLIP_DRIFT = enum.auto()  # drift at which the joint starts to slip


class StopCoefficient(Layout):
    """Coefficients of the device functions of a stop."""

    UNLOADING_STIFFNESS = enum.auto()
    CLEARANCE_AHEAD = enum.auto()
    CLEARANCE_BEHIND = enum.auto()
    ENERGY_LOST = enum.auto()  # fraction of the compression energy that is lost


class FrictionDamper(Device):
    """A friction damper: a brace in series with a joint that slips at a force (OpenSees: a parallel ElasticPP).

    Example:
        >>> wd.laws.FrictionDamper(slip_force=2e5, brace_stiffness=4e7)
        FrictionDamper(slip_force=200000.0, brace_stiffness=40000000.0)
    """

    slip_force: ArrayLike = parameter("N", "force at which the friction damper slips", low=0.0)
    brace_stiffness: ArrayLike = parameter("N m-1", "stiffness of the friction damper's brace", low=0.0, opensees="E")

    opensees = ("ElasticPP",)
    rows = {"friction_damper": FrictionCoefficient.names()}

    @staticmethod
    def named_coefficients(p: Values, row: str) -> dict[str, np.ndarray]:
        # If the slip force is 0, the brace has no force.
        brace = np.where(p["slip_force"] > 0, p["brace_stiffness"], 0.0)
        drift = np.divide(p["slip_force"], brace, out=np.zeros_like(brace), where=brace > 0)
        return {"brace_stiffness": brace, "slip_drift": drift}

    @staticmethod
    def problem(p: Values) -> str | None:
        slip, brace = np.broadcast_arrays(p["slip_force"], p["brace_stiffness"])
        bad = (slip > 0) & (brace == 0)
        if not bad.any():
            return None
        place = first_place(bad)
        return (
            f"brace_stiffness is 0 and slip_force is {slip[place]:g} N ({place_of(place)}): give a stiffness above 0, "
            "or set slip_force to 0 in a storey without this device"
        )

    @staticmethod
    def stiffest(p: Values) -> np.ndarray:
        return np.where(p["slip_force"] > 0, p["brace_stiffness"], 0.0)


class Gap(Device):
    """A stop that acts beyond a clearance, in both directions of the storey drift.

    In unloading, the stop returns a fraction of its compression energy: the square of the coefficient of restitution.

    Example:
        >>> wd.laws.Gap(clearance=0.05, contact_stiffness=5e8, restitution=0.6)
        Gap(clearance=0.05, contact_stiffness=500000000.0, restitution=0.6)
    """

    clearance: ArrayLike = shared(CLEARANCE, opensees="gap")
    contact_stiffness: ArrayLike = shared(CONTACT_STIFFNESS, opensees="E")
    restitution: ArrayLike = shared(RESTITUTION, default=1.0)

    rows = {"gap": StopCoefficient.names()}

    @classmethod
    def is_sensitive(cls, p: Values) -> bool:
        """Return True: a small change of the time of contact changes the rebound."""
        return True

    @staticmethod
    def named_coefficients(p: Values, row: str) -> dict[str, np.ndarray]:
        given_back = p["restitution"] ** 2  # fraction of the compression energy that is returned
        ahead = np.broadcast_to(p["clearance"], given_back.shape)
        return {
            "unloading_stiffness": p["contact_stiffness"] / given_back,
            "clearance_ahead": ahead,
            "clearance_behind": ahead,
            "energy_lost": 1 - given_back,
        }

    @staticmethod
    def stiffest(p: Values) -> np.ndarray:
        return p["contact_stiffness"] / p["restitution"] ** 2


class OneSidedGap(Gap):
    """A stop that acts at positive drifts only (with restitution 1: OpenSees' ElasticPPGap without yielding).

    Example:
        >>> wd.laws.OneSidedGap(clearance=0.05, contact_stiffness=5e8)
        OneSidedGap(clearance=0.05, contact_stiffness=500000000.0)
    """

    opensees = ("ElasticPPGap",)

    @staticmethod
    def named_coefficients(p: Values, row: str) -> dict[str, np.ndarray]:
        both = Gap.named_coefficients(p, row)
        return both | {"clearance_behind": np.full_like(both["clearance_ahead"], NO_STOP)}


class ViscousDamper(Device):
    """A viscous damper whose force is a power of the velocity (OpenSees: Viscous).

    Example:
        >>> wd.laws.ViscousDamper(damper_coefficient=2e6, velocity_exponent=0.5)
        ViscousDamper(damper_coefficient=2000000.0, velocity_exponent=0.5)
    """

    damper_coefficient: ArrayLike = parameter("N s m-1", "force of the viscous damper at 1 m/s", low=0.0, opensees="C")
    velocity_exponent: ArrayLike = parameter(
        "1",
        "velocity exponent of the viscous damper",
        low=0.0,
        high=1.0,
        low_open=True,
        default=1.0,
        opensees="alpha",
    )
    linear_velocity: ArrayLike = parameter(
        "m s-1",
        "velocity below which a viscous damper of an exponent below 1 is linear",
        low=0.0,
        low_open=True,
        default=0.01,
    )

    opensees = ("Viscous",)
    is_dashpot = True

    @staticmethod
    def stiffest(p: Values) -> np.ndarray:
        return np.zeros_like(p["stiffness"])


def kind_of_dampers(devices: tuple[str, ...], p: Values) -> str:
    """Return the kind of the viscous dampers of a building: "none", "linear" or "power".

    "power" means that the force of a damper is proportional to a power of the velocity other than 1.
    """
    if ViscousDamper.name not in devices:
        return "none"
    return "linear" if np.all(p["velocity_exponent"] == 1) else "power"


def damper_values(p: Values) -> tuple[np.ndarray, ...]:
    """Return the arrays that kernels need for viscous dampers, each [structure, storey].

    The arrays are the coefficient [N s/m], the velocity exponent minus 1, and the velocity [m/s] below which the damper
    is linear.
    """
    return p["damper_coefficient"], p["velocity_exponent"] - 1, p["linear_velocity"]


def steepest_damping(p: Values) -> np.ndarray:
    """Return the largest slope of the force of viscous dampers [N s/m], at velocity 0, shape [structure, storey]."""
    coefficient, exponent_less_1, velocity = damper_values(p)
    return coefficient * velocity**exponent_less_1
