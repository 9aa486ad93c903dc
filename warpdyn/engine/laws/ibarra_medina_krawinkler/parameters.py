"""Storeys after Ibarra, Medina and Krawinkler (2005), as modified by Lignos and Krawinkler (2011).

A backbone rises from yield to a capping point, falls to the residual force and ends at the ultimate drift, where the
storey loses its strength. The negative side has the backbone of the positive side, except for the parameters whose
names end in `_negative`; the initial stiffness is the same. An ultimate drift or a Lambda of 0 means infinity.

Dissipated energy deteriorates the storey. Let E be the energy dissipated so far, Ei the energy dissipated since the
last change of the sign of the force, Fy the yield force of the positive side, and beta = (Ei / (Lambda Fy - E))^c. Each
mode of deterioration has its own Lambda, a drift. D is the rate of deterioration and c its exponent.

- Each time the force changes its sign, the backbone of the new side deteriorates: its yield force, hardening slope and
  capping line decrease by the fraction D beta, and the drift of its farthest peak increases by the fraction D beta.
- Each time the storey turns back, the unloading stiffness decreases by the fraction beta, without D.

The rules are those of OpenSees' IMKBilin, IMKPeakOriented and IMKPinching (of 2022 and 2023). Two of them are less
known. When a bilinear storey has reached its residual force, its unloading stiffness is half the initial stiffness. A
bilinear storey that has lost its strength in one direction keeps the residual force in the other direction; the other
laws lose all strength at once.

Differences from OpenSees:

- When the dissipated energy reaches Lambda Fy, the storey has no force any more, as in the paper. In OpenSees, if a
  single excursion increases E beyond Lambda Fy, the storey continues without further deterioration.
- The reloading stiffness is at most the initial stiffness. In OpenSees the force jumps if the target peak is close to
  the point where the force changed its sign, or behind this point.
- The residual force is a lower bound of the whole backbone. In OpenSees' IMKPeakOriented and IMKPinching it is a lower
  bound only beyond the capping point, and the force jumps if deterioration has lowered the hardening line below it.
- Lambda = 0 means no deterioration; OpenSees needs a large Lambda instead. An excursion that returns more energy than
  was put into it causes no deterioration; OpenSees raises the negative energy to the exponent, which gives NaN for 1.5.
- A storey that turns back from its backbone returns at most the energy that was put into it since the force last
  changed its sign. This limits how small the unloading stiffness becomes. In OpenSees the stiffness approaches zero,
  and the storey unloads over hundreds of yield drifts.
- A rate D above 1 reduces a strength to zero at most. In OpenSees strengths can become negative.
"""

from __future__ import annotations

import enum

import numpy as np
from numpy.typing import ArrayLike

from warpdyn.engine.laws.backbone import has_negative_side, named_as_negative, negative_side
from warpdyn.engine.laws.bounds import first_place, place_of
from warpdyn.engine.laws.law import YIELD_FORCE, Law, Layout, Values, negative, shared
from warpdyn.engine.laws.parameter import Parameter


class Coefficient(Layout):
    """Coefficients of the device functions, in units of yield drift and yield force of the positive side.

    The coefficients of a variant are those of this list that the law needs, then the exponent of deterioration if it
    may differ from 1, then the coefficients of the negative side if it may differ from the positive side.
    """

    INVERSE_YIELD_DRIFT = enum.auto()
    YIELD_FORCE = enum.auto()
    HARDENING_SLOPE = enum.auto()
    FALLING_SLOPE = enum.auto()  # slope of the capping line
    CAPPING_HEIGHT = enum.auto()  # force of the capping line at zero drift
    RESIDUAL_FORCE = enum.auto()
    ULTIMATE_DRIFT = enum.auto()
    STRENGTH_CAPACITY = enum.auto()  # energy at which the yield force is exhausted; infinite without deterioration
    CAPPING_CAPACITY = enum.auto()
    UNLOADING_CAPACITY = enum.auto()
    DETERIORATION_RATE = enum.auto()  # D
    RELOADING_CAPACITY = enum.auto()
    PINCHING_FORCE_RATIO = enum.auto()
    PINCHING_DRIFT_SHARE = enum.auto()  # 1 - kappaD


class Negative(Layout):
    """Coefficients of the negative side, in units of yield drift and yield force of the positive side."""

    YIELD_FORCE = enum.auto()
    HARDENING_SLOPE = enum.auto()
    FALLING_SLOPE = enum.auto()
    CAPPING_HEIGHT = enum.auto()
    RESIDUAL_FORCE = enum.auto()
    ULTIMATE_DRIFT = enum.auto()
    DETERIORATION_RATE = enum.auto()


def _capacity(of: str, opensees: str) -> Parameter:
    words = f"energy over yield force that exhausts the {of}, 0: no deterioration"
    return Parameter("m", words, low=0.0, opensees=opensees)


PLASTIC_DRIFT = Parameter("m", "drift from yield to the capping point", low=0.0, low_open=True, opensees="Up")
POST_CAPPING_DRIFT = Parameter(
    "m", "drift from the capping point to zero force", low=0.0, low_open=True, opensees="Upc"
)
CAPPING_FORCE = Parameter("1", "ratio of the force at the capping point to the yield force", low=1.0, opensees="FmaxFy")
RESIDUAL_FORCE = Parameter(
    *("1", "ratio of residual to yield force", 0.0, 1.0), high_open=True, often_in_percent=True, opensees="ResF"
)
ULTIMATE_DRIFT = Parameter("m", "drift at which all strength is lost, 0: never", low=0.0, opensees="Uu")
STRENGTH_CAPACITY = _capacity("yield force", "LAMBDA_S")
POST_CAPPING_CAPACITY = _capacity("post-capping strength", "LAMBDA_C")
UNLOADING_CAPACITY = _capacity("unloading stiffness", "LAMBDA_K")
RELOADING_CAPACITY = _capacity("reloading stiffness", "LAMBDA_A")
PINCHING_FORCE = Parameter(
    "1", "ratio of the pinching point's force to that of no pinching", 0.0, 1.0, opensees="kappaF"
)
PINCHING_DRIFT = Parameter("1", "share of the plastic drift before the pinching point", 0.0, 1.0, opensees="kappaD")
EXPONENT = Parameter("1", "exponent c of deterioration", low=1.0, opensees="c_S, c_C, c_A and c_K")
RATE = Parameter("1", "rate D of deterioration", low=0.0, low_open=True, high=2.0, opensees="D_pos")


def _rows(kind: str, count: int) -> dict[str, tuple[str, ...]]:
    """Return the variants of a law and the names of their coefficients: {variant: names}.

    The law has three variants: without powers (which are slow on CPUs), with powers, and with powers and two different
    backbones.
    """
    names = Coefficient.names(count)
    power = (*names, "deterioration_exponent")
    return {
        f"ibarra_medina_krawinkler_{kind}": names,
        f"ibarra_medina_krawinkler_{kind}_power": power,
        f"ibarra_medina_krawinkler_{kind}_asymmetric": (*power, *(f"{name}_negative" for name in Negative.names())),
    }


def row_of(law: type[Law], powers: bool, asymmetric: bool) -> tuple[tuple[str, ...], int, int | None]:
    """Return the names of a variant's coefficients, and the indices of the exponent and of the first negative-side one.

    The two indices are those of the exponent of deterioration and of the first coefficient of the negative side (None
    if the sides are equal).

    Args:
        law: Class of the law.
        powers: Whether the exponent of deterioration may differ from 1.
        asymmetric: Whether the backbones of the two sides may differ.
    """
    names = law.rows[law.name + ("_asymmetric" if asymmetric else "_power" * powers)]
    common = len(law.rows[law.name])
    return names, common if powers else common - 1, common + 1 if asymmetric else None


class _IbarraMedinaKrawinkler(Law):
    """Base class of the three laws of Ibarra, Medina and Krawinkler."""

    is_linear_until_yield = True
    corners = 3  # yield point, capping point and start of the residual strength

    @classmethod
    def spring(cls, p: Values) -> str:
        linear, power, asymmetric = cls.rows
        if has_negative_side(p) or np.any(p["deterioration_rate"] > 1):
            return asymmetric
        return linear if np.all(p["deterioration_exponent"] == 1) else power

    @classmethod
    def counts_reversals(cls, p: Values) -> bool:
        """Return True: these storeys lose stiffness or strength at each reversal."""
        return True

    @staticmethod
    def named_coefficients(p: Values, row: str) -> dict[str, np.ndarray]:
        return _coefficients(p, row)

    @staticmethod
    def problem(p: Values) -> str | None:
        return _problem(p)


class IbarraMedinaKrawinklerBilinear(_IbarraMedinaKrawinkler):
    """A storey with a capping point and cyclic deterioration, bilinear (OpenSees: IMKBilin).

    The law follows Ibarra, Medina and Krawinkler (2005) and Lignos and Krawinkler (2011). The docstring of the module
    `ibarra_medina_krawinkler.parameters` lists the rules and the differences from OpenSees. The storey stiffness is
    OpenSees' Ke.

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
    yield_force_negative: ArrayLike = negative(YIELD_FORCE, "yield_force", opensees="Fy_neg")
    plastic_drift_to_capping_negative: ArrayLike = negative(
        PLASTIC_DRIFT, "plastic_drift_to_capping", opensees="Up_neg"
    )
    post_capping_drift_negative: ArrayLike = negative(POST_CAPPING_DRIFT, "post_capping_drift", opensees="Upc_neg")
    capping_force_ratio_negative: ArrayLike = negative(CAPPING_FORCE, "capping_force_ratio", opensees="FmaxFy_neg")
    residual_force_ratio_negative: ArrayLike = negative(RESIDUAL_FORCE, "residual_force_ratio", opensees="ResF_neg")
    ultimate_drift_negative: ArrayLike = negative(ULTIMATE_DRIFT, "ultimate_drift", opensees="Uu_neg")
    deterioration_rate_negative: ArrayLike = negative(RATE, "deterioration_rate", opensees="D_neg")

    opensees = ("IMKBilin",)
    rows = _rows("bilinear", Coefficient.RELOADING_CAPACITY)

    @staticmethod
    def named_coefficients(p: Values, row: str) -> dict[str, np.ndarray]:
        found = _coefficients(p, row)
        # The slope of the capping line is proportional to the strength above the residual force.
        found["falling_slope"] = found["falling_slope"] / (1 - p["residual_force_ratio"])
        if "falling_slope_negative" in found:
            above = found["yield_force_negative"] - found["residual_force_negative"]
            found["falling_slope_negative"] = found["falling_slope_negative"] / above
        return found


class IbarraMedinaKrawinklerPeakOriented(_IbarraMedinaKrawinkler):
    """A storey with a capping point and cyclic deterioration that reloads towards peaks (OpenSees: IMKPeakOriented).

    The law follows Ibarra, Medina and Krawinkler (2005) and Lignos and Krawinkler (2011). The docstring of the module
    `ibarra_medina_krawinkler.parameters` lists the rules and the differences from OpenSees. The storey stiffness is
    OpenSees' Ke.

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
    yield_force_negative: ArrayLike = negative(YIELD_FORCE, "yield_force", opensees="Fy_neg")
    plastic_drift_to_capping_negative: ArrayLike = negative(
        PLASTIC_DRIFT, "plastic_drift_to_capping", opensees="Up_neg"
    )
    post_capping_drift_negative: ArrayLike = negative(POST_CAPPING_DRIFT, "post_capping_drift", opensees="Upc_neg")
    capping_force_ratio_negative: ArrayLike = negative(CAPPING_FORCE, "capping_force_ratio", opensees="FmaxFy_neg")
    residual_force_ratio_negative: ArrayLike = negative(RESIDUAL_FORCE, "residual_force_ratio", opensees="ResF_neg")
    ultimate_drift_negative: ArrayLike = negative(ULTIMATE_DRIFT, "ultimate_drift", opensees="Uu_neg")
    deterioration_rate_negative: ArrayLike = negative(RATE, "deterioration_rate", opensees="D_neg")

    opensees = ("IMKPeakOriented",)
    rows = _rows("peak_oriented", Coefficient.PINCHING_FORCE_RATIO)


class IbarraMedinaKrawinklerPinching(_IbarraMedinaKrawinkler):
    """A storey with a capping point, cyclic deterioration and pinching (OpenSees: IMKPinching).

    The law follows Ibarra, Medina and Krawinkler (2005) and Lignos and Krawinkler (2011). The docstring of the module
    `ibarra_medina_krawinkler.parameters` lists the rules and the differences from OpenSees. The storey stiffness is
    OpenSees' Ke.

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
    yield_force_negative: ArrayLike = negative(YIELD_FORCE, "yield_force", opensees="Fy_neg")
    plastic_drift_to_capping_negative: ArrayLike = negative(
        PLASTIC_DRIFT, "plastic_drift_to_capping", opensees="Up_neg"
    )
    post_capping_drift_negative: ArrayLike = negative(POST_CAPPING_DRIFT, "post_capping_drift", opensees="Upc_neg")
    capping_force_ratio_negative: ArrayLike = negative(CAPPING_FORCE, "capping_force_ratio", opensees="FmaxFy_neg")
    residual_force_ratio_negative: ArrayLike = negative(RESIDUAL_FORCE, "residual_force_ratio", opensees="ResF_neg")
    ultimate_drift_negative: ArrayLike = negative(ULTIMATE_DRIFT, "ultimate_drift", opensees="Uu_neg")
    deterioration_rate_negative: ArrayLike = negative(RATE, "deterioration_rate", opensees="D_neg")

    opensees = ("IMKPinching",)
    rows = _rows("pinching", len(Coefficient))

    @staticmethod
    def named_coefficients(p: Values, row: str) -> dict[str, np.ndarray]:
        return _coefficients(p, row) | {
            "pinching_force_ratio": p["pinching_force_ratio"],
            "pinching_drift_share": 1 - p["pinching_drift_ratio"],
        }


def _coefficients(p: Values, row: str) -> dict[str, np.ndarray]:
    """Return the coefficients that all laws of this folder need: {name: array}.

    Drifts and forces are divided by the yield drift and yield force of the positive side.
    """
    rate = p["stiffness"] / p["yield_force"]

    def capacity(name: str) -> np.ndarray:
        return np.where(p[name] > 0, p[name] * rate, np.inf)

    found = {
        "inverse_yield_drift": rate,
        "yield_force": p["yield_force"],
        **_side(p, rate, 1.0),
        "strength_capacity": capacity("strength_deterioration_drift"),
        "capping_capacity": capacity("post_capping_deterioration_drift"),
        "unloading_capacity": capacity("unloading_deterioration_drift"),
    }
    if "bilinear" not in row:
        found["reloading_capacity"] = capacity("reloading_deterioration_drift")
    if row.endswith(("_power", "_asymmetric")):
        found["deterioration_exponent"] = p["deterioration_exponent"]
    if row.endswith("_asymmetric"):
        below = negative_side(p)
        force = below["yield_force"] / p["yield_force"]
        side = {"yield_force": force, **_side(below, rate, force)}
        found |= {f"{name}_negative": value for name, value in side.items()}
    return found


def _side(p: Values, rate: np.ndarray, force: float | np.ndarray) -> dict[str, np.ndarray]:
    """Return the coefficients of the backbone of one side: {name: array}.

    Args:
        p: Parameters of this side, under the names of the positive side.
        rate: 1 / yield drift of the positive side [1/m].
        force: Yield force of this side, divided by that of the positive side.
    """
    peak, to_capping = p["capping_force_ratio"] * force, p["plastic_drift_to_capping"] * rate
    falling = peak / (p["post_capping_drift"] * rate)
    return {
        "hardening_slope": (peak - force) / to_capping,
        "falling_slope": falling,
        "capping_height": peak + falling * (force + to_capping),
        "residual_force": p["residual_force_ratio"] * force,
        "ultimate_drift": np.where(p["ultimate_drift"] > 0, p["ultimate_drift"] * rate, np.inf),
        "deterioration_rate": p["deterioration_rate"],
    }


def _problem(p: Values) -> str | None:
    """Return a sentence about parameters of a storey that contradict each other, or None."""
    return _side_problem(p) or named_as_negative(_side_problem(negative_side(p)), p)


def _side_problem(p: Values) -> str | None:
    read = ("stiffness", "yield_force", "plastic_drift_to_capping", "capping_force_ratio", "ultimate_drift")
    # Other parameters of the building, such as the damping ratio, have other shapes.
    p = dict(zip(read, np.broadcast_arrays(*(p[name] for name in read)), strict=True))
    yield_drift = p["yield_force"] / p["stiffness"]
    rise = 1 + p["plastic_drift_to_capping"] / yield_drift
    low = (p["ultimate_drift"] > 0) & (p["ultimate_drift"] <= yield_drift)
    for name, bad, bound, words in (
        (
            "capping_force_ratio",
            p["capping_force_ratio"] >= rise,
            rise,
            "below {:g}, because the hardening line must be less stiff than the elastic line",
        ),
        ("ultimate_drift", low, yield_drift, "0 (strength is never lost), or above the yield drift of {:g} m"),
    ):
        if np.any(bad):
            place = first_place(bad)
            return f"{name} is {p[name][place]:g} ({place_of(place)}); it must be {words.format(bound[place])}"
    return None
