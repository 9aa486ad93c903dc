"""Wood-frame shear walls after the CUREE-Caltech project (Folz and Filiatrault 2001; OpenSees: SAWS).

With the initial stiffness S0, the force F0 (`yield_force`) and the ratios R1 to R4 of OpenSees, the rules are:

- The envelope is F = (F0 + R1 S0 d)(1 - exp(-S0 d / F0)) up to the drift DU at the peak force FU. Beyond DU, it is a
  line that falls with the slope R2 S0.
- Small drifts, up to 1.05 times the drift at which the envelope crosses the upper pinched line, load and unload along
  the envelope.
- Unloading has the slope R3 S0, down to the pinched line F = -FI + R4 S0 d, and then follows this line. In the other
  direction the pinched line is F = FI + R4 S0 d.
- Let dun be the farthest drift reached on the envelope of a side. Reloading follows the pinched line until it meets the
  line through (beta dun, F(beta dun)) with the slope S0 (F0 / (S0 beta dun))^alpha, then this line up to the envelope.
- A side that was never loaded beyond the small drifts is loaded along its envelope.
- The wall fails where the falling line reaches zero force or the lower pinched line; its force is then 0 for ever.

Differences from OpenSees, whose forces jump in these cases:

- A wall that unloads a little from the envelope returns along the same line to the envelope. OpenSees overshoots the
  envelope by one step there (5 % of the strength in steps of 0.3 mm).
- Reloading never passes above the envelope. In OpenSees it does so in two cases. If the reloading line meets the
  pinched line before the envelope does, as with a large R1 and a large alpha, the force jumps there from the pinched
  line to the reloading line (by a third of F0 with the R1 of 0.1 of a public parameter set). If dun is below DU and
  beta dun is beyond DU, the force falls back to the envelope at beta dun.
- No reloading line is steeper than unloading. In OpenSees a reloading line is steeper if beta dun is less than F0/S0.
- Once a wall has passed the small drifts on one side, the first loading of the other side counts once it reaches the
  envelope. OpenSees applies the rule of small drifts there.
- A failed wall has no force. OpenSees gives it a stiffness of 1e-8.
"""

from __future__ import annotations

import enum

import numpy as np
from numpy.typing import ArrayLike

from warpdyn.engine.laws.bounds import first_bad
from warpdyn.engine.laws.law import Law, Layout, Values, parameter
from warpdyn.engine.tracing.functions import define_function

BISECTIONS = 60  # enough for all digits of float64


class Coefficient(Layout):
    """Coefficients of the device functions, in units of F0 (force) and F0/S0 (drift)."""

    INVERSE_YIELD_DRIFT = enum.auto()
    YIELD_FORCE = enum.auto()
    HARDENING_SLOPE = enum.auto()  # R1
    FALLING_SLOPE = enum.auto()  # -R2
    UNLOADING_SLOPE = enum.auto()  # R3
    PINCHED_SLOPE = enum.auto()  # R4
    PINCHED_FORCE = enum.auto()  # FI
    PEAK_DRIFT = enum.auto()  # DU
    PEAK_FORCE = enum.auto()  # FU
    CROSSING_DRIFT = enum.auto()  # drift at which the envelope crosses the upper pinched line
    FAILURE_DRIFT = enum.auto()
    RELOADING_EXPONENT = enum.auto()  # alpha
    RELOADING_DRIFT_RATIO = enum.auto()  # beta


class Saws(Law):
    """A wood-frame shear wall with pinching and softening (Folz and Filiatrault 2001; OpenSees: SAWS).

    The docstring of the module `saws.parameters` lists the rules and the differences from OpenSees. The storey
    stiffness is OpenSees' S0.

    Example:
        >>> wall = wd.laws.Saws(
        ...     yield_force=8e3,
        ...     pinching_force_ratio=0.15,
        ...     drift_at_peak_force=0.015,
        ...     hardening_ratio=0.058,
        ...     softening_ratio=0.05,
        ...     pinching_stiffness_ratio=0.02,
        ... )
        >>> wall.reloading_exponent, wall.reloading_drift_ratio
        (0.8, 1.1)
    """

    yield_force: ArrayLike = parameter(
        "N", "force at zero drift of the line that the envelope approaches", low=0.0, low_open=True, opensees="F0"
    )
    pinching_force_ratio: ArrayLike = parameter(
        "1",
        "ratio of the pinched force at zero drift to the yield force",
        low=0.0,
        high=1.0,
        low_open=True,
        high_open=True,
        opensees="FI over F0",
    )
    drift_at_peak_force: ArrayLike = parameter(
        "m", "drift at which the envelope has its peak force", low=0.0, low_open=True, opensees="DU"
    )
    hardening_ratio: ArrayLike = parameter(
        "1",
        "ratio of the slope that the envelope approaches to the initial stiffness",
        low=0.0,
        high=0.5,
        opensees="R1",
    )
    softening_ratio: ArrayLike = parameter(
        "1",
        "ratio of the fall beyond the peak to the initial stiffness, as a positive number",
        low=0.0,
        high=1.0,
        low_open=True,
        opensees="R2",
    )
    unloading_stiffness_ratio: ArrayLike = parameter(
        "1", "ratio of unloading to initial stiffness", low=1.0, default=1.0, opensees="R3"
    )
    pinching_stiffness_ratio: ArrayLike = parameter(
        "1",
        "ratio of the pinched lines' slope to the initial stiffness",
        low=0.0,
        high=1.0,
        high_open=True,
        opensees="R4",
    )
    reloading_exponent: ArrayLike = parameter(
        "1", "exponent by which reloading softens with the drift", low=0.0, default=0.8, opensees="alpha"
    )
    reloading_drift_ratio: ArrayLike = parameter(
        "1",
        "ratio of the drift aimed at in reloading to the largest drift so far",
        low=1.0,
        default=1.1,
        opensees="beta",
    )

    opensees = ("SAWS",)
    rows = {"saws": Coefficient.names()}

    @classmethod
    def is_sensitive(cls, p: Values) -> bool:
        """Return True: the strength of a wall decreases beyond its peak."""
        return True

    @staticmethod
    def named_coefficients(p: Values, row: str) -> dict[str, np.ndarray]:
        rate = p["stiffness"] / p["yield_force"]
        peak_drift, peak_force, _rise = _peak(p)
        pinched, slope, falling = p["pinching_force_ratio"], p["pinching_stiffness_ratio"], p["softening_ratio"]
        # The falling line meets the lower pinched line or the line of zero force.
        meets = (peak_force + pinched + falling * peak_drift) / (slope + falling)
        return {
            "inverse_yield_drift": rate,
            "yield_force": p["yield_force"],
            "hardening_slope": p["hardening_ratio"],
            "falling_slope": falling,
            "unloading_slope": p["unloading_stiffness_ratio"],
            "pinched_slope": slope,
            "pinched_force": pinched,
            "peak_drift": peak_drift,
            "peak_force": peak_force,
            "crossing_drift": _crossing_drift(p["hardening_ratio"], pinched, slope, peak_drift),
            "failure_drift": np.minimum(peak_drift + peak_force / falling, meets),
            "reloading_exponent": p["reloading_exponent"],
            "reloading_drift_ratio": p["reloading_drift_ratio"],
        }

    @staticmethod
    def problem(p: Values) -> str | None:
        _, peak_force, rise = _peak(p)
        name, bound = "pinching_force_ratio", peak_force - rise
        reason = "or the pinched line crosses the envelope beyond its peak: reduce it, or pinching_stiffness_ratio"
        return first_bad(p[name] >= bound, name, p[name], "below", bound, reason)

    @staticmethod
    def stiffest(p: Values) -> np.ndarray:
        return p["stiffness"] * p["unloading_stiffness_ratio"]


def _envelope(drift: np.ndarray, hardening: np.ndarray) -> np.ndarray:
    """Return the force of the curved segment of the envelope, divided by F0, at a drift in units of F0/S0."""
    return -(1 + hardening * drift) * np.expm1(-drift)


def _peak(p: Values) -> tuple[np.ndarray, np.ndarray, np.ndarray]:
    """Return the drift and the force of the peak of the envelope, and the rise of the pinched line up to this drift.

    Drifts are in units of F0/S0 and forces in units of F0.
    """
    drift = p["drift_at_peak_force"] * p["stiffness"] / p["yield_force"]
    return drift, _envelope(drift, p["hardening_ratio"]), p["pinching_stiffness_ratio"] * drift


def _crossing(hardening: np.ndarray, force: np.ndarray, slope: np.ndarray, peak_drift: np.ndarray) -> np.ndarray:
    """Return the drift at which the envelope crosses the straight line `force + slope * drift`, by bisection.

    Drifts are in units of F0/S0 and forces in units of F0.
    """
    low, high = np.zeros_like(peak_drift * hardening), peak_drift * np.ones_like(hardening)
    for _ in range(BISECTIONS):
        middle = (low + high) / 2
        is_above = _envelope(middle, hardening) > force + slope * middle
        low, high = np.where(is_above, low, middle), np.where(is_above, middle, high)
    return high


# A kernel that prepares structures calls the device function: the text of 60 bisections would take long to compile.
_crossing_drift = define_function("saws_crossing_drift", f"{__package__}.device_functions", _crossing)
