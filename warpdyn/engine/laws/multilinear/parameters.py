"""Storeys with trilinear and quadrilinear backbones and kinematic hardening (OpenSees: MultiLinear).

The corners are OpenSees' points (e1, s1), (e2, s2), ... The first corner is the yield point. The drifts and forces of
the other corners are divided by the yield drift and the yield force, so that the backbone keeps its shape if stiffness
and yield force are random. Beyond the last corner the slope is `hardening_ratio` times the stiffness.

The negative side has the backbone of the positive side, except for the parameters whose names end in `_negative`; the
stiffness and the hardening ratio are the same on both sides. The storey consists of springs in parallel. With two
different backbones, each spring yields at a different drift in each direction; the spring that yields first in one
direction also yields first in the other direction. OpenSees has no such material; a single spring is its ElasticPP with
two yield strains.
"""

from __future__ import annotations

import enum

import numpy as np
from numpy.typing import ArrayLike

from warpdyn.engine.laws.backbone import has_negative_side, named_as_negative, negative_side
from warpdyn.engine.laws.bounds import above, first_bad
from warpdyn.engine.laws.law import HARDENING_RATIO, YIELD_FORCE, Law, Layout, Values, negative, shared
from warpdyn.engine.laws.parameter import Parameter


class Coefficient(Layout):
    """Coefficients of the device functions: an elastic spring, then one yielding spring for each corner."""

    HARDENING_STIFFNESS = enum.auto()
    STIFFNESS_1 = enum.auto()
    YIELD_DRIFT_1 = enum.auto()
    STIFFNESS_2 = enum.auto()
    YIELD_DRIFT_2 = enum.auto()
    STIFFNESS_3 = enum.auto()
    YIELD_DRIFT_3 = enum.auto()


def _ductility(corner: int) -> Parameter:
    where = f"at corner {corner} of the backbone, counted from the one at yield,"
    return Parameter("1", f"drift {where} over yield drift", low=1.0, low_open=True, opensees=f"e{corner} over e1")


def _force_ratio(corner: int) -> Parameter:
    where = f"at corner {corner} of the backbone, counted from the one at yield,"
    return Parameter("1", f"force {where} over yield force", low=1.0, opensees=f"s{corner} over s1")


def _rows(corners: int) -> dict[str, tuple[str, ...]]:
    """Return the variants for n corners and the names of their coefficients: {variant: names}.

    The storey has n springs that yield, or 2 n - 1 springs if the two sides differ.
    """
    springs = [(f"stiffness_{k}", f"yield_drift_{k}", f"yield_drift_below_{k}") for k in range(1, 2 * corners)]
    return {
        f"multilinear_{corners}": Coefficient.names(2 * corners + 1),
        f"multilinear_{corners}_asymmetric": ("hardening_stiffness", *(name for each in springs for name in each)),
    }


class _Multilinear(Law):
    """Base class of the laws whose backbones have several corners."""

    opensees = ("MultiLinear",)
    is_linear_until_yield = True

    @classmethod
    def spring(cls, p: Values) -> str:
        return f"multilinear_{cls.corners}{'_asymmetric' * has_negative_side(p)}"

    @classmethod
    def named_coefficients(cls, p: Values, row: str) -> dict[str, np.ndarray]:
        return (_coefficients_of_sides if row.endswith("_asymmetric") else _coefficients)(p, cls.corners)

    @classmethod
    def problem(cls, p: Values) -> str | None:
        return _problem(p, cls.corners) or named_as_negative(_problem(negative_side(p), cls.corners), p)


class Trilinear(_Multilinear):
    """A trilinear storey (two corners) with kinematic hardening (OpenSees: MultiLinear; Iwan 1967, Masing 1926).

    Example:
        >>> wd.laws.Trilinear(yield_force=1e6, ductility_2=4, force_ratio_2=1.5, hardening_ratio=0.02)
        Trilinear(yield_force=1000000.0, ductility_2=4.0, force_ratio_2=1.5, hardening_ratio=0.02)
    """

    yield_force: ArrayLike = shared(YIELD_FORCE, opensees="s1")
    ductility_2: ArrayLike = shared(_ductility(2))
    force_ratio_2: ArrayLike = shared(_force_ratio(2))
    hardening_ratio: ArrayLike = shared(HARDENING_RATIO)

    yield_force_negative: ArrayLike = negative(YIELD_FORCE, "yield_force")
    ductility_2_negative: ArrayLike = negative(_ductility(2), "ductility_2")
    force_ratio_2_negative: ArrayLike = negative(_force_ratio(2), "force_ratio_2")

    corners = 2
    rows = _rows(2)


class Quadrilinear(_Multilinear):
    """A quadrilinear storey (three corners) with kinematic hardening (OpenSees: MultiLinear; Iwan 1967, Masing 1926).

    Example:
        >>> law = wd.laws.Quadrilinear(
        ...     yield_force=1e6, ductility_2=2, force_ratio_2=1.4, ductility_3=5, force_ratio_3=1.7, hardening_ratio=0
        ... )
    """

    yield_force: ArrayLike = shared(YIELD_FORCE, opensees="s1")
    ductility_2: ArrayLike = shared(_ductility(2))
    force_ratio_2: ArrayLike = shared(_force_ratio(2))
    ductility_3: ArrayLike = shared(_ductility(3))
    force_ratio_3: ArrayLike = shared(_force_ratio(3))
    hardening_ratio: ArrayLike = shared(HARDENING_RATIO)

    yield_force_negative: ArrayLike = negative(YIELD_FORCE, "yield_force")
    ductility_2_negative: ArrayLike = negative(_ductility(2), "ductility_2")
    force_ratio_2_negative: ArrayLike = negative(_force_ratio(2), "force_ratio_2")
    ductility_3_negative: ArrayLike = negative(_ductility(3), "ductility_3")
    force_ratio_3_negative: ArrayLike = negative(_force_ratio(3), "force_ratio_3")

    corners = 3
    rows = _rows(3)


def _slopes(p: Values, corners: int) -> list[np.ndarray]:
    """Return the slopes of the segments of the backbone, divided by the initial stiffness; the first slope is 1."""
    slopes = [np.ones_like(p["yield_force"])]
    ductility: float | np.ndarray = 1.0
    force: float | np.ndarray = 1.0
    for corner in range(2, corners + 1):
        further, stronger = p[f"ductility_{corner}"], p[f"force_ratio_{corner}"]
        slopes.append((stronger - force) / (further - ductility))
        ductility, force = further, stronger
    return [*slopes, p["hardening_ratio"]]


def _coefficients(p: Values, corners: int) -> dict[str, np.ndarray]:
    """Return the coefficients for equal sides: {name: array}.

    The coefficients are the hardening stiffness, then for each corner the loss of stiffness and the drift.
    """
    slopes = _slopes(p, corners)
    yield_drift = p["yield_force"] / p["stiffness"]
    drifts = [yield_drift, *(p[f"ductility_{corner}"] * yield_drift for corner in range(2, corners + 1))]
    values = {"hardening_stiffness": p["stiffness"] * slopes[-1]}
    for corner, (before, after, drift) in enumerate(zip(slopes, slopes[1:], drifts, strict=False), start=1):
        values |= {f"stiffness_{corner}": p["stiffness"] * (before - after), f"yield_drift_{corner}": drift}
    return values


def _coefficients_of_sides(p: Values, corners: int) -> dict[str, np.ndarray]:
    """Return the coefficients of springs that yield at a different drift in each direction: {name: array}.

    The stiffness decreases at the corners of each side, by the same total but in different steps. The steps of both
    sides together divide this total into the stiffnesses of the springs.
    """
    sides = [_coefficients(side, corners) for side in (p, negative_side(p))]
    lost, drift = (
        [np.stack(np.broadcast_arrays(*(side[f"{name}_{k}"] for k in range(1, corners + 1)))) for side in sides]
        for name in ("stiffness", "yield_drift")
    )
    lost[0], lost[1] = np.broadcast_arrays(*(np.cumsum(each, axis=0) for each in lost))
    lost_so_far = np.sort(np.concatenate([lost[0], lost[1][:-1]]), axis=0)
    stiffness = np.diff(lost_so_far, axis=0, prepend=0.0)
    values = {"hardening_stiffness": sides[0]["hardening_stiffness"]}
    for k in range(2 * corners - 1):
        middle = lost_so_far[k] - stiffness[k] / 2
        values[f"stiffness_{k + 1}"] = stiffness[k]
        for name, side, drifts in zip(("yield_drift", "yield_drift_below"), lost, drift, strict=True):
            corner = np.minimum((side < middle).sum(axis=0), corners - 1)
            drifts = np.broadcast_to(drifts, side.shape)
            values[f"{name}_{k + 1}"] = np.take_along_axis(drifts, corner[None], axis=0)[0]
    return values


def _problem(p: Values, corners: int) -> str | None:
    """Return a sentence about a backbone that falls, or whose slope increases at a corner; None if it is possible."""
    ductility = np.ones_like(p["yield_force"])
    force: float | np.ndarray = 1.0
    for corner in range(2, corners + 1):
        names = f"ductility_{corner}", f"force_ratio_{corner}"
        further, stronger = (p[name] for name in names)
        problem = first_bad(
            further <= ductility, names[0], further, "above", ductility, f"the value at corner {corner - 1}"
        )
        if problem:
            return problem
        # The hardening ratio is at least 0, so no line before the last corner may fall.
        problem = first_bad(
            stronger < force, names[1], stronger, "at least", force, f"the value at corner {corner - 1}"
        )
        if problem:
            return problem
        slope = _slopes(p, corners)[corner - 2]
        straight = force + slope * (further - ductility)
        reason = f"the extension of the line to corner {corner - 1}: no segment may be stiffer than the one before"
        problem = first_bad(above(stronger, straight), names[1], stronger, "at most", straight, reason)
        if problem:
            return problem
        ductility, force = further, stronger
    slope, hardening = _slopes(p, corners)[-2], p["hardening_ratio"]
    reason = f"the slope of the line to corner {corners} divided by the initial stiffness"
    return first_bad(above(hardening, slope), "hardening_ratio", hardening, "at most", slope, reason)
