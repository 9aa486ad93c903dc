"""Trilinear and quadrilinear backbones with kinematic hardening (OpenSees: MultiLinear).

OpenSees' points e1 s1, e2 s2, ... are the corners: the first is that of `yield_force`; the further ones are given by
drift over yield drift and force over yield force, so that a backbone keeps its shape where stiffness and yield force
are scattered. `hardening_ratio` leads on from the last corner.
"""

from __future__ import annotations

import enum

import numpy as np
from numpy.typing import ArrayLike

from warpdyn.engine.laws.bounds import above, first_bad
from warpdyn.engine.laws.law import HARDENING_RATIO, YIELD_FORCE, Law, Layout, Values, shared
from warpdyn.engine.laws.parameter import Parameter


class Coefficient(Layout):
    """What the device functions read: a hardening spring, then one that yields for each corner."""

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


class Trilinear(Law):
    """A storey of two corners with kinematic hardening (OpenSees: MultiLinear; Iwan 1967, Masing 1926).

    Example:
        >>> wd.laws.Trilinear(yield_force=1e6, ductility_2=4, force_ratio_2=1.5, hardening_ratio=0.02)
        Trilinear(yield_force=1000000.0, ductility_2=4.0, force_ratio_2=1.5, hardening_ratio=0.02)
    """

    yield_force: ArrayLike = shared(YIELD_FORCE, opensees="s1")
    ductility_2: ArrayLike = shared(_ductility(2))
    force_ratio_2: ArrayLike = shared(_force_ratio(2))
    hardening_ratio: ArrayLike = shared(HARDENING_RATIO)

    opensees = ("MultiLinear",)
    rows = {"multilinear_2": Coefficient.names(Coefficient.STIFFNESS_3)}
    is_linear_until_yield = True

    @staticmethod
    def named_coefficients(p: Values, row: str) -> dict[str, np.ndarray]:
        return _coefficients(p, 2)

    @staticmethod
    def problem(p: Values) -> str | None:
        return _problem(p, 2)


class Quadrilinear(Law):
    """A storey of three corners with kinematic hardening (OpenSees: MultiLinear; Iwan 1967, Masing 1926).

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

    opensees = ("MultiLinear",)
    rows = {"multilinear_3": Coefficient.names()}
    is_linear_until_yield = True

    @staticmethod
    def named_coefficients(p: Values, row: str) -> dict[str, np.ndarray]:
        return _coefficients(p, 3)

    @staticmethod
    def problem(p: Values) -> str | None:
        return _problem(p, 3)


def _slopes(p: Values, corners: int) -> list[np.ndarray]:
    """Return the slopes of the backbone over the initial stiffness, the first of them 1."""
    slopes = [np.ones_like(p["yield_force"])]
    ductility: float | np.ndarray = 1.0
    force: float | np.ndarray = 1.0
    for corner in range(2, corners + 1):
        further, stronger = p[f"ductility_{corner}"], p[f"force_ratio_{corner}"]
        slopes.append((stronger - force) / (further - ductility))
        ductility, force = further, stronger
    return [*slopes, p["hardening_ratio"]]


def _coefficients(p: Values, corners: int) -> dict[str, np.ndarray]:
    """Return the hardening stiffness, then for each corner what stiffness is lost there and its drift."""
    slopes = _slopes(p, corners)
    yield_drift = p["yield_force"] / p["stiffness"]
    drifts = [yield_drift, *(p[f"ductility_{corner}"] * yield_drift for corner in range(2, corners + 1))]
    values = {"hardening_stiffness": p["stiffness"] * slopes[-1]}
    for corner, (before, after, drift) in enumerate(zip(slopes, slopes[1:], drifts, strict=False), start=1):
        values |= {f"stiffness_{corner}": p["stiffness"] * (before - after), f"yield_drift_{corner}": drift}
    return values


def _problem(p: Values, corners: int) -> str | None:
    """Return what is wrong with a backbone, which must lead on and bend down at each corner."""
    ductility = np.ones_like(p["yield_force"])
    force: float | np.ndarray = 1.0
    for corner in range(2, corners + 1):
        names = f"ductility_{corner}", f"force_ratio_{corner}"
        further, stronger = (p[name] for name in names)
        problem = first_bad(further <= ductility, names[0], further, "above", ductility, f"that of corner {corner - 1}")
        if problem:
            return problem
        # The line after the last corner may not fall (hardening_ratio), so that none before it can.
        problem = first_bad(stronger < force, names[1], stronger, "at least", force, f"that of corner {corner - 1}")
        if problem:
            return problem
        slope = _slopes(p, corners)[corner - 2]
        straight = force + slope * (further - ductility)
        reason = f"which lies on the line that leads to corner {corner - 1}"
        problem = first_bad(above(stronger, straight), names[1], stronger, "at most", straight, reason)
        if problem:
            return problem
        ductility, force = further, stronger
    slope, hardening = _slopes(p, corners)[-2], p["hardening_ratio"]
    reason = f"the slope to corner {corners} over the initial stiffness"
    return first_bad(above(hardening, slope), "hardening_ratio", hardening, "at most", slope, reason)
