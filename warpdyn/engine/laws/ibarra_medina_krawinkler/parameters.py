"""Storeys after Ibarra, Medina and Krawinkler (2005), as modified by Lignos and Krawinkler (2011).

A backbone, the same both ways, rises from yield to a capping point, falls to the residual force and ends at the
ultimate drift, where the storey loses its strength. Energy deteriorates it: each time the force changes its sign, the
backbone of the side it changes to loses the shares D (E_i / (Lambda Fy - E))^c of its yield force and hardening slope
and of the force of its capping line, and its farthest peak moves on by such a share; each time the storey turns back,
the unloading stiffness loses a share, without D. E is the energy taken so far, E_i that since the last change of sign;
each of the four has a Lambda of its own, a drift. 0 means none, of Lambda and of the ultimate drift.

The rules are those of OpenSees' IMKBilin, IMKPeakOriented and IMKPinching (of 2022 and 2023), so that the unloading
stiffness of a bilinear storey that has come to its residual force is half the initial one, and one that has lost its
strength one way has the residual force the other way; the others lose all at once.

Ours differ on purpose:

- Once more energy was spent than was left of Lambda Fy, the storey is exhausted and its force is gone, as Ibarra and
  others have it. OpenSees' go on for ever, and deteriorate no more, if a single excursion takes E beyond Lambda Fy.
- A storey never reloads more steeply than at its initial stiffness. OpenSees' forces jump where the peak that they go
  for lies close to where the force changed its sign, or behind it.
- The residual force bounds a backbone everywhere. With OpenSees' IMKPeakOriented and IMKPinching it does so beyond the
  capping point alone, and the force jumps where deterioration has taken hardening below it.
- Without deterioration, Lambda is 0; OpenSees needs a large one. An excursion that has given back more than it took
  deteriorates nothing; OpenSees raises the negative energy to the exponent, which with 1.5 gives no number at all.
- A storey that turns back from its backbone gives back no more than was put in since the force last changed its sign:
  where the unloading stiffness is about exhausted it is as low as that allows. In OpenSees it comes close to zero, and
  the storey pushes on for hundreds of yield drifts.
"""

from __future__ import annotations

import enum

import numpy as np
from numpy.typing import ArrayLike

from warpdyn.engine.laws.bounds import first_place, place_of
from warpdyn.engine.laws.law import YIELD_FORCE, Law, Layout, Values, shared
from warpdyn.engine.laws.parameter import Parameter


class Coefficient(Layout):
    """What the device functions read, in yield drifts and yield forces.

    A row has as many of them as its kind needs, and the exponent of deterioration behind them where that is not 1.
    """

    INVERSE_YIELD_DRIFT = enum.auto()
    YIELD_FORCE = enum.auto()
    HARDENING_SLOPE = enum.auto()
    FALLING_SLOPE = enum.auto()  # of the capping line
    CAPPING_HEIGHT = enum.auto()  # of that line at no drift
    RESIDUAL_FORCE = enum.auto()
    ULTIMATE_DRIFT = enum.auto()
    STRENGTH_CAPACITY = enum.auto()  # energy that exhausts a storey; infinite where nothing deteriorates
    CAPPING_CAPACITY = enum.auto()
    UNLOADING_CAPACITY = enum.auto()
    DETERIORATION_RATE = enum.auto()  # D
    RELOADING_CAPACITY = enum.auto()
    PINCHING_FORCE_RATIO = enum.auto()
    PINCHING_DRIFT_SHARE = enum.auto()  # 1 - kappaD


def _capacity(of: str, opensees: str) -> Parameter:
    words = f"energy over yield force that exhausts the {of}, 0 for no deterioration"
    return Parameter("m", words, low=0.0, opensees=opensees)


PLASTIC_DRIFT = Parameter("m", "drift from yield to the capping point", low=0.0, low_open=True, opensees="Up")
POST_CAPPING_DRIFT = Parameter("m", "drift from the capping point to no force", low=0.0, low_open=True, opensees="Upc")
CAPPING_FORCE = Parameter("1", "ratio of the force at the capping point to the yield force", low=1.0, opensees="FmaxFy")
RESIDUAL_FORCE = Parameter("1", "ratio of residual to yield force", low=0.0, high=1.0, high_open=True, opensees="ResF")
ULTIMATE_DRIFT = Parameter("m", "drift at which all strength is lost, 0 for none", low=0.0, opensees="Uu")
STRENGTH_CAPACITY = _capacity("yield force", "LAMBDA_S")
POST_CAPPING_CAPACITY = _capacity("post-capping strength", "LAMBDA_C")
UNLOADING_CAPACITY = _capacity("unloading stiffness", "LAMBDA_K")
RELOADING_CAPACITY = _capacity("reloading stiffness", "LAMBDA_A")
PINCHING_FORCE = Parameter(
    "1", "ratio of the pinching point's force to that of no pinching", 0.0, 1.0, opensees="kappaF"
)
PINCHING_DRIFT = Parameter("1", "share of the plastic drift before the pinching point", 0.0, 1.0, opensees="kappaD")
EXPONENT = Parameter("1", "exponent c of deterioration", low=1.0, opensees="c_S, c_C, c_A and c_K")
RATE = Parameter("1", "rate D of deterioration", low=0.0, low_open=True, high=1.0, opensees="D_pos and D_neg")


def _rows(kind: str, count: int) -> dict[str, tuple[str, ...]]:
    """Return the rows of a kind of storey: without powers, of which CPUs take one at a time, and with them."""
    names = Coefficient.names(count)
    return {
        f"ibarra_medina_krawinkler_{kind}": names,
        f"ibarra_medina_krawinkler_{kind}_power": (*names, "deterioration_exponent"),
    }


def _row(law: type[Law], p: Values) -> str:
    """Return the row of storeys: that without powers if all of them have the exponent 1."""
    linear, power = law.rows
    return linear if np.all(p["deterioration_exponent"] == 1) else power


class IbarraMedinaKrawinklerBilinear(Law):
    """A storey with a capping point and cyclic deterioration, bilinear (OpenSees: IMKBilin).

    After Ibarra, Medina and Krawinkler (2005) and Lignos and Krawinkler (2011); the help of its module has the rules,
    and where OpenSees differs. The stiffness is OpenSees' Ke.

    Example:
        >>> wd.laws.IbarraMedinaKrawinklerBilinear(
        ...     yield_force=1e6, plastic_drift_to_capping=0.06, post_capping_drift=0.3, capping_force_ratio=1.1
        ... ).residual_force_ratio
        0.0
    """

    yield_force: ArrayLike = shared(YIELD_FORCE, opensees="Fy")
    plastic_drift_to_capping: ArrayLike = shared(PLASTIC_DRIFT)
    post_capping_drift: ArrayLike = shared(POST_CAPPING_DRIFT)
    capping_force_ratio: ArrayLike = shared(CAPPING_FORCE)
    residual_force_ratio: ArrayLike = shared(RESIDUAL_FORCE, default=0.0)
    ultimate_drift: ArrayLike = shared(ULTIMATE_DRIFT, default=0.0)
    strength_deterioration_drift: ArrayLike = shared(STRENGTH_CAPACITY, default=0.0)
    post_capping_deterioration_drift: ArrayLike = shared(POST_CAPPING_CAPACITY, default=0.0)
    unloading_deterioration_drift: ArrayLike = shared(UNLOADING_CAPACITY, default=0.0)
    deterioration_exponent: ArrayLike = shared(EXPONENT, default=1.0)
    deterioration_rate: ArrayLike = shared(RATE, default=1.0)

    opensees = ("IMKBilin",)
    rows = _rows("bilinear", Coefficient.RELOADING_CAPACITY)
    is_linear_until_yield = True

    @classmethod
    def spring(cls, p: Values) -> str:
        return _row(cls, p)

    @classmethod
    def counts_reversals(cls, p: Values) -> bool:
        """Storeys lose stiffness or strength at each reversal."""
        return True

    @staticmethod
    def named_coefficients(p: Values, row: str) -> dict[str, np.ndarray]:
        found = _coefficients(p, row)
        # Its capping line falls the less the weaker the storey is.
        return found | {"falling_slope": found["falling_slope"] / (1 - p["residual_force_ratio"])}

    @staticmethod
    def problem(p: Values) -> str | None:
        return _problem(p)


class IbarraMedinaKrawinklerPeakOriented(Law):
    """A storey with a capping point and cyclic deterioration that reloads towards peaks (OpenSees: IMKPeakOriented).

    After Ibarra, Medina and Krawinkler (2005) and Lignos and Krawinkler (2011); the help of its module has the rules,
    and where OpenSees differs. The stiffness is OpenSees' Ke.

    Example:
        >>> wd.laws.IbarraMedinaKrawinklerPeakOriented(
        ...     yield_force=1e6, plastic_drift_to_capping=0.06, post_capping_drift=0.3, capping_force_ratio=1.1
        ... ).deterioration_rate
        1.0
    """

    yield_force: ArrayLike = shared(YIELD_FORCE, opensees="Fy")
    plastic_drift_to_capping: ArrayLike = shared(PLASTIC_DRIFT)
    post_capping_drift: ArrayLike = shared(POST_CAPPING_DRIFT)
    capping_force_ratio: ArrayLike = shared(CAPPING_FORCE)
    residual_force_ratio: ArrayLike = shared(RESIDUAL_FORCE, default=0.0)
    ultimate_drift: ArrayLike = shared(ULTIMATE_DRIFT, default=0.0)
    strength_deterioration_drift: ArrayLike = shared(STRENGTH_CAPACITY, default=0.0)
    post_capping_deterioration_drift: ArrayLike = shared(POST_CAPPING_CAPACITY, default=0.0)
    unloading_deterioration_drift: ArrayLike = shared(UNLOADING_CAPACITY, default=0.0)
    reloading_deterioration_drift: ArrayLike = shared(RELOADING_CAPACITY, default=0.0)
    deterioration_exponent: ArrayLike = shared(EXPONENT, default=1.0)
    deterioration_rate: ArrayLike = shared(RATE, default=1.0)

    opensees = ("IMKPeakOriented",)
    rows = _rows("peak_oriented", Coefficient.PINCHING_FORCE_RATIO)
    is_linear_until_yield = True

    @classmethod
    def spring(cls, p: Values) -> str:
        return _row(cls, p)

    @classmethod
    def counts_reversals(cls, p: Values) -> bool:
        """Storeys lose stiffness or strength at each reversal."""
        return True

    @staticmethod
    def named_coefficients(p: Values, row: str) -> dict[str, np.ndarray]:
        return _coefficients(p, row)

    @staticmethod
    def problem(p: Values) -> str | None:
        return _problem(p)


class IbarraMedinaKrawinklerPinching(Law):
    """A storey with a capping point and cyclic deterioration that pinches (OpenSees: IMKPinching).

    After Ibarra, Medina and Krawinkler (2005) and Lignos and Krawinkler (2011); the help of its module has the rules,
    and where OpenSees differs. The stiffness is OpenSees' Ke.

    Example:
        >>> law = wd.laws.IbarraMedinaKrawinklerPinching(
        ...     yield_force=1e6,
        ...     plastic_drift_to_capping=0.06,
        ...     post_capping_drift=0.3,
        ...     capping_force_ratio=1.1,
        ...     pinching_force_ratio=0.4,
        ...     pinching_drift_ratio=0.5,
        ... )
    """

    yield_force: ArrayLike = shared(YIELD_FORCE, opensees="Fy")
    plastic_drift_to_capping: ArrayLike = shared(PLASTIC_DRIFT)
    post_capping_drift: ArrayLike = shared(POST_CAPPING_DRIFT)
    capping_force_ratio: ArrayLike = shared(CAPPING_FORCE)
    residual_force_ratio: ArrayLike = shared(RESIDUAL_FORCE, default=0.0)
    ultimate_drift: ArrayLike = shared(ULTIMATE_DRIFT, default=0.0)
    strength_deterioration_drift: ArrayLike = shared(STRENGTH_CAPACITY, default=0.0)
    post_capping_deterioration_drift: ArrayLike = shared(POST_CAPPING_CAPACITY, default=0.0)
    unloading_deterioration_drift: ArrayLike = shared(UNLOADING_CAPACITY, default=0.0)
    reloading_deterioration_drift: ArrayLike = shared(RELOADING_CAPACITY, default=0.0)
    pinching_force_ratio: ArrayLike = shared(PINCHING_FORCE)
    pinching_drift_ratio: ArrayLike = shared(PINCHING_DRIFT)
    deterioration_exponent: ArrayLike = shared(EXPONENT, default=1.0)
    deterioration_rate: ArrayLike = shared(RATE, default=1.0)

    opensees = ("IMKPinching",)
    rows = _rows("pinching", len(Coefficient))
    is_linear_until_yield = True

    @classmethod
    def spring(cls, p: Values) -> str:
        return _row(cls, p)

    @classmethod
    def counts_reversals(cls, p: Values) -> bool:
        """Storeys lose stiffness or strength at each reversal."""
        return True

    @staticmethod
    def named_coefficients(p: Values, row: str) -> dict[str, np.ndarray]:
        return _coefficients(p, row) | {
            "pinching_force_ratio": p["pinching_force_ratio"],
            "pinching_drift_share": 1 - p["pinching_drift_ratio"],
        }

    @staticmethod
    def problem(p: Values) -> str | None:
        return _problem(p)


def _coefficients(p: Values, row: str) -> dict[str, np.ndarray]:
    """Return what all kinds read, in units of yield drift and force."""
    rate = p["stiffness"] / p["yield_force"]

    def capacity(name: str) -> np.ndarray:
        return np.where(p[name] > 0, p[name] * rate, np.inf)

    peak, to_capping = p["capping_force_ratio"], p["plastic_drift_to_capping"] * rate
    falling = peak / (p["post_capping_drift"] * rate)
    found = {
        "inverse_yield_drift": rate,
        "yield_force": p["yield_force"],
        "hardening_slope": (peak - 1) / to_capping,
        "falling_slope": falling,
        "capping_height": peak + falling * (1 + to_capping),
        "residual_force": p["residual_force_ratio"],
        "ultimate_drift": capacity("ultimate_drift"),
        "strength_capacity": capacity("strength_deterioration_drift"),
        "capping_capacity": capacity("post_capping_deterioration_drift"),
        "unloading_capacity": capacity("unloading_deterioration_drift"),
        "deterioration_rate": p["deterioration_rate"],
    }
    if "bilinear" not in row:
        found["reloading_capacity"] = capacity("reloading_deterioration_drift")
    if row.endswith("_power"):
        found["deterioration_exponent"] = p["deterioration_exponent"]
    return found


def _problem(p: Values) -> str | None:
    """Return what is wrong between the parameters of a backbone."""
    read = ("stiffness", "yield_force", "plastic_drift_to_capping", "capping_force_ratio", "ultimate_drift")
    # A building's other parameters, such as its damping ratio, have shapes of their own.
    p = dict(zip(read, np.broadcast_arrays(*(p[name] for name in read)), strict=True))
    yield_drift = p["yield_force"] / p["stiffness"]
    rise = 1 + p["plastic_drift_to_capping"] / yield_drift
    low = (p["ultimate_drift"] > 0) & (p["ultimate_drift"] <= yield_drift)
    for name, bad, bound, words in (
        (
            "capping_force_ratio",
            p["capping_force_ratio"] >= rise,
            rise,
            "below {:g}, or hardening is no less than elastic",
        ),
        ("ultimate_drift", low, yield_drift, "0 for none, or above the yield drift of {:g} m"),
    ):
        if np.any(bad):
            place = first_place(bad)
            return f"{name} is {p[name][place]:g} ({place_of(place)}); it must be {words.format(bound[place])}"
    return None
