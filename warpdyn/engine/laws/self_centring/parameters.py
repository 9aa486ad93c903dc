"""Self-centring storeys: bilinear, with flag-shaped loops and no residual drift (OpenSees: SelfCentering).

Post-tensioned walls, rocking frames and self-centring braces behave in this way. The force follows the initial
stiffness up to the yield force, at which a gap opens, and then the hardening stiffness. In unloading, the gap closes
where the force is (1 - flag_height) times the yield force, plus the hardening force. For a flag height of 1 or less the
force is 0 at zero drift.

Two limits are optional. Beyond `bearing_drift`, the gap stops opening and a bearing adds its stiffness. Beyond
`slip_drift`, the whole assembly slips at a constant force, which leaves a residual drift; the bearing still acts at
`bearing_drift`, measured from the original position.

Differences from OpenSees:

- OpenSees' SelfCentering stores the branch of the last step, so its force jumps by up to (k1 - k2) du, where du is the
  step, if the storey leaves the point at which the gap closed. In warpdyn the force does not depend on the step.
  FlagShape has no such jump; its beta is half the flag height for the same loop.
- If a storey reaches the bearing drift while it reloads inside the flag, OpenSees' force jumps to the bearing line.
  In warpdyn the bearing adds its stiffness to the force that the storey has.
"""

from __future__ import annotations

import enum

import numpy as np
from numpy.typing import ArrayLike

from warpdyn.engine.laws.bounds import first_bad
from warpdyn.engine.laws.law import HARDENING_RATIO, YIELD_FORCE, Law, Layout, Values, parameter, shared

NEVER = 1e30  # m: a limit that no storey reaches


class Coefficient(Layout):
    """Coefficients that the device functions of the law read; storeys without slip and bearing need the first four."""

    HARDENING_STIFFNESS = enum.auto()
    GAP_STIFFNESS = enum.auto()  # initial less hardening stiffness, lost while the gap opens or closes
    YIELD_DRIFT = enum.auto()
    CLOSING_DRIFT = enum.auto()  # drift from the gap's position at which the gap closes
    SLIP_DRIFT = enum.auto()
    BEARING_DRIFT = enum.auto()
    BEARING_STIFFNESS = enum.auto()


class SelfCentring(Law):
    """A self-centring storey with flag-shaped loops, as in post-tensioned walls and frames (OpenSees: SelfCentering).

    The docstring of the module `self_centring.parameters` lists the rules and the differences from OpenSees. The storey
    stiffness is OpenSees' k1.

    Example:
        >>> wd.laws.SelfCentring(yield_force=1e6, hardening_ratio=0.05, flag_height=0.6)
        SelfCentring(yield_force=1000000.0, hardening_ratio=0.05, flag_height=0.6)
    """

    yield_force: ArrayLike = shared(YIELD_FORCE, opensees="sigAct")
    hardening_ratio: ArrayLike = shared(HARDENING_RATIO, opensees="k2 over k1")
    flag_height: ArrayLike = parameter(
        "1",
        "height of the flag: 1 less the ratio of closing to opening force of the gap",
        low=0.0,
        high=1.0,
        often_in_percent=True,
        opensees="beta",
    )
    bearing_drift: ArrayLike = parameter(
        "m", "drift beyond which a bearing acts, 0 for no bearing", low=0.0, default=0.0, opensees="epsBear"
    )
    bearing_stiffness_ratio: ArrayLike = parameter(
        "1", "ratio of bearing to initial storey stiffness", low=0.0, default=1.0, opensees="rBear"
    )
    slip_drift: ArrayLike = parameter(
        "m", "drift beyond which the storey slips, 0 for no slip", low=0.0, default=0.0, opensees="epsSlip"
    )

    opensees = ("SelfCentering",)
    rows = {
        "self_centring": Coefficient.names(Coefficient.SLIP_DRIFT),
        "self_centring_with_limits": Coefficient.names(),
    }
    is_linear_until_yield = True

    @classmethod
    def spring(cls, p: Values) -> str:
        has_limits = np.any(p["bearing_drift"] > 0) or np.any(p["slip_drift"] > 0)
        return "self_centring_with_limits" if has_limits else "self_centring"

    @classmethod
    def is_sensitive(cls, p: Values) -> bool:
        """Return whether the storeys have a bearing: a small change of the time of contact changes the rebound."""
        return bool(np.any(p["bearing_drift"] > 0))

    @staticmethod
    def named_coefficients(p: Values, row: str) -> dict[str, np.ndarray]:
        stiffness, hardening = p["stiffness"], p["hardening_ratio"]
        yield_drift = p["yield_force"] / stiffness
        values = {
            "hardening_stiffness": hardening * stiffness,
            "gap_stiffness": (1 - hardening) * stiffness,
            "yield_drift": yield_drift,
            "closing_drift": yield_drift * (1 - p["flag_height"]),
        }
        if row == "self_centring":
            return values
        limits = {
            name: np.where(p[name] > 0, p[name], NEVER) * np.ones_like(stiffness)
            for name in ("slip_drift", "bearing_drift")
        }
        return values | limits | {"bearing_stiffness": p["bearing_stiffness_ratio"] * stiffness}

    @staticmethod
    def problem(p: Values) -> str | None:
        yield_drift = p["yield_force"] / p["stiffness"]
        for name in ("bearing_drift", "slip_drift"):
            bad = (p[name] > 0) & (p[name] < yield_drift)
            words = f"0 for no {name.removesuffix('_drift')}, or at least"
            if problem := first_bad(bad, name, p[name], words, yield_drift, "the yield drift"):
                return problem
        return None

    @staticmethod
    def stiffest(p: Values) -> np.ndarray:
        has_bearing = p["bearing_drift"] > 0
        return p["stiffness"] * np.where(has_bearing, np.maximum(p["bearing_stiffness_ratio"], 1.0), 1.0)
