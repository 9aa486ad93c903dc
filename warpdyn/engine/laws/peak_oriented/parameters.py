"""Peak-oriented storeys: the laws of Clough and of Takeda, with a trilinear backbone (cracking and yield).

In `takeda` (Takeda, Sozen and Nielsen 1970), the unloading stiffness of a side decreases with its peak drift d:

- before yield, unloading leads towards the cracking point of the other side;
- after yield, the unloading stiffness is (yield drift / d)^`unloading_exponent` times that at the yield point, but at
  least the slope of the line to the origin.

Without cracking (default), `takeda` is the modified Takeda law, or Clough's law with degrading unloading stiffness
(Otani 1981). It equals OpenSees' Hysteretic with pinchX = pinchY = 1, no damage and beta as the unloading exponent,
with two exceptions: the lower bound of the unloading stiffness, and the step in which the force changes its sign, where
the force of Hysteretic depends on the length of the step.

With cracking, `takeda` differs from Hysteretic. Hysteretic unloads from the cracking point with (e1 / d)^beta times the
initial stiffness, and reloads an uncracked side towards its cracking point. In `takeda`, a storey that has yielded is
loaded on an uncracked side with the unloading stiffness up to the cracking force, and then towards the yield point.
Inner loops lead to the peak of their side, as in Hysteretic, not to the peak of the previous cycle.
"""

from __future__ import annotations

import enum

import numpy as np
from numpy.typing import ArrayLike

from warpdyn.engine.laws.bounds import first_bad
from warpdyn.engine.laws.law import HARDENING_RATIO, YIELD_FORCE, Law, Layout, Values, parameter, shared


class Coefficient(Layout):
    """Coefficients of the device functions, in units of yield drift and yield force; only Takeda has the last two."""

    INVERSE_YIELD_DRIFT = enum.auto()
    YIELD_FORCE = enum.auto()
    INITIAL_SLOPE = enum.auto()
    SECOND_HEIGHT = enum.auto()  # force of the second line of the backbone, extended to zero drift
    SECOND_SLOPE = enum.auto()
    THIRD_HEIGHT = enum.auto()
    THIRD_SLOPE = enum.auto()
    CRACKING_DRIFT = enum.auto()
    UNLOADING_EXPONENT = enum.auto()
    UNCRACKED = enum.auto()  # largest (peak - cracking drift) of an uncracked side: 0, or -1 if cracking is yield


class PeakOriented(Law):
    """A peak-oriented storey with cracking (Clough and Johnston 1966; Mahin and Bertero 1976).

    OpenSees: Hysteretic with pinchX = pinchY = 1, no damage and beta = 0; its points are cracking (s1, e1), yield (s2,
    e2) and any point beyond yield (s3, e3). Reloading after partial unloading follows Mahin and Bertero.

    Example:
        >>> wd.laws.PeakOriented(yield_force=1e6, cracking_ratio=0.4, cracked_stiffness_ratio=0.5, hardening_ratio=0.02)
        PeakOriented(yield_force=1000000.0, cracking_ratio=0.4, cracked_stiffness_ratio=0.5, hardening_ratio=0.02)
    """

    yield_force: ArrayLike = shared(YIELD_FORCE, opensees="s2")
    cracking_ratio: ArrayLike = parameter(
        "1",
        "ratio of cracking to yield force",
        low=0.0,
        high=1.0,
        low_open=True,
        default=1.0,
        opensees="s1 over s2",
    )
    cracked_stiffness_ratio: ArrayLike = parameter(
        "1",
        "ratio of the stiffness from cracking to yield to the initial storey stiffness",
        low=0.0,
        high=1.0,
        low_open=True,
        default=1.0,
    )
    hardening_ratio: ArrayLike = shared(HARDENING_RATIO)

    rows = {"peak_oriented": Coefficient.names(Coefficient.UNLOADING_EXPONENT)}

    @staticmethod
    def named_coefficients(p: Values, row: str) -> dict[str, np.ndarray]:
        cracking, cracked = p["cracking_ratio"], p["cracked_stiffness_ratio"]
        yield_drift = p["yield_force"] / p["stiffness"] * (cracking + (1 - cracking) / cracked)
        initial = p["stiffness"] * yield_drift / p["yield_force"]
        second, third = cracked * initial, p["hardening_ratio"] * initial
        return {
            "inverse_yield_drift": 1 / yield_drift,
            "yield_force": p["yield_force"],
            "initial_slope": initial,
            "second_height": 1 - second,
            "second_slope": second,
            "third_height": 1 - third,
            "third_slope": third,
            "cracking_drift": cracking / initial,
        }

    @staticmethod
    def problem(p: Values) -> str | None:
        hardening, cracked = p["hardening_ratio"], p["cracked_stiffness_ratio"]
        return first_bad(
            hardening > cracked, "hardening_ratio", hardening, "at most", cracked, "the cracked_stiffness_ratio"
        )


class Takeda(PeakOriented):
    """A peak-oriented storey whose unloading stiffness decreases with its peak drift (Takeda, Sozen and Nielsen 1970).

    The docstring of the module `peak_oriented.parameters` lists the unloading rules and the differences from OpenSees'
    Hysteretic.

    Example:
        >>> wd.laws.Takeda(yield_force=1e6, hardening_ratio=0.02, unloading_exponent=0.5)
        Takeda(yield_force=1000000.0, hardening_ratio=0.02, unloading_exponent=0.5)
    """

    unloading_exponent: ArrayLike = parameter(
        "1",
        "power of the peak ductility by which the unloading stiffness falls",
        low=0.0,
        high=0.5,
        default=0.4,
        opensees="beta",
    )

    rows = {"takeda": Coefficient.names()}

    @staticmethod
    def named_coefficients(p: Values, row: str) -> dict[str, np.ndarray]:
        return PeakOriented.named_coefficients(p, row) | {
            "unloading_exponent": p["unloading_exponent"],
            "uncracked": np.where(p["cracking_ratio"] < 1, 0.0, -1.0),
        }
