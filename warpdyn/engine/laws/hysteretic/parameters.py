"""Trilinear storeys with pinching, damage and softer unloading (OpenSees: Hysteretic), as in SimCenter's MDOF-LU.

Beyond the last corner the backbone continues with its third slope if this slope is positive; otherwise the force is
constant. For damage by energy, the dissipated energy is divided by the energy under both sides of the backbone. The
negative side has the parameters of the positive side, except for the parameters whose names end in `_negative`.

Differences from OpenSees:

- No segment of a backbone may be stiffer than its first segment, and no corner may have a negative force.
- The unloading stiffness is at least that of the line to the origin. In OpenSees it can be smaller, with an exponent
  near 1 and a force above yield: unloading then ends beyond the origin, the force jumps in reloading, and cycles
  generate energy.
- A falling backbone has lost its strength at the drift where its line crosses zero force. OpenSees checks whether the
  rounded force there is above zero; if it is, OpenSees assumes that the storey never loses its strength.
"""

from __future__ import annotations

import enum

import numpy as np
from numpy.typing import ArrayLike

from warpdyn.engine.laws.backbone import (
    backbone_problem,
    corners,
    ductility,
    falls,
    force_ratio,
    has_negative_side,
    named_as_negative,
    negative_side,
)
from warpdyn.engine.laws.law import YIELD_FORCE, Law, Layout, Values, negative, parameter, shared
from warpdyn.engine.laws.parameter import Parameter

NEVER = 1e30  # yield drifts


class Coefficient(Layout):
    """Coefficients of the device functions; lengths and slopes are relative to the yield point of the positive side."""

    INVERSE_YIELD_DRIFT = enum.auto()
    YIELD_FORCE = enum.auto()
    SECOND_LENGTH = enum.auto()  # length of the second segment of the backbone
    SECOND_SLOPE = enum.auto()
    THIRD_SLOPE = enum.auto()
    THIRD_LENGTH = enum.auto()
    SECOND_IS_GONE = enum.auto()  # drift at which the second segment reaches zero force
    THIRD_IS_GONE = enum.auto()
    PINCHING_DRIFT = enum.auto()
    PINCHING_FORCE = enum.auto()
    DAMAGE_BY_DUCTILITY = enum.auto()
    DAMAGE_BY_ENERGY = enum.auto()
    UNLOADING_EXPONENT = enum.auto()
    STIFFNESS_NEGATIVE = enum.auto()
    YIELD_DRIFT_NEGATIVE = enum.auto()
    SECOND_LENGTH_NEGATIVE = enum.auto()
    SECOND_SLOPE_NEGATIVE = enum.auto()
    THIRD_SLOPE_NEGATIVE = enum.auto()
    THIRD_LENGTH_NEGATIVE = enum.auto()
    SECOND_IS_GONE_NEGATIVE = enum.auto()
    THIRD_IS_GONE_NEGATIVE = enum.auto()


STIFFNESS_RATIO = Parameter(
    "1", "ratio of the initial stiffness to the storey stiffness", low=0.0, low_open=True, optional="1"
)


class Hysteretic(Law):
    """A trilinear storey with pinching, damage and softer unloading (OpenSees: Hysteretic).

    The docstring of the module `hysteretic.parameters` lists the rules and the differences from OpenSees.

    Example:
        >>> wd.laws.Hysteretic(yield_force=1e6, ductility_2=4, force_ratio_2=1.2, ductility_3=10, force_ratio_3=0.6)
        Hysteretic(yield_force=1000000.0, ductility_2=4.0, force_ratio_2=1.2, ductility_3=10.0, force_ratio_3=0.6)
    """

    yield_force: ArrayLike = shared(YIELD_FORCE, opensees="s1p")
    ductility_2: ArrayLike = shared(ductility(2), opensees="e2p over e1p")
    force_ratio_2: ArrayLike = shared(force_ratio(2), opensees="s2p over s1p")
    ductility_3: ArrayLike = shared(ductility(3), opensees="e3p over e1p")
    force_ratio_3: ArrayLike = shared(force_ratio(3), opensees="s3p over s1p")
    pinching_drift: ArrayLike = parameter(
        "1", "pinching of drift in reloading (1: none)", low=0.0, high=1.0, default=1.0, opensees="pinchX"
    )
    pinching_force: ArrayLike = parameter(
        "1", "pinching of force in reloading (1: none)", low=0.0, high=1.0, default=1.0, opensees="pinchY"
    )
    damage_by_ductility: ArrayLike = parameter(
        "1", "growth of the reloading target drift by ductility", low=0.0, default=0.0, opensees="damage1"
    )
    damage_by_energy: ArrayLike = parameter(
        "1", "growth of the reloading target drift by energy", low=0.0, default=0.0, opensees="damage2"
    )
    unloading_exponent: ArrayLike = parameter(
        "1", "exponent of ductility in the unloading stiffness", low=0.0, high=1.0, default=0.0, opensees="beta"
    )

    yield_force_negative: ArrayLike = negative(YIELD_FORCE, "yield_force", opensees="s1n")
    stiffness_ratio_negative: ArrayLike = negative(STIFFNESS_RATIO, "stiffness")
    ductility_2_negative: ArrayLike = negative(ductility(2), "ductility_2", opensees="e2n over e1n")
    force_ratio_2_negative: ArrayLike = negative(force_ratio(2), "force_ratio_2", opensees="s2n over s1n")
    ductility_3_negative: ArrayLike = negative(ductility(3), "ductility_3", opensees="e3n over e1n")
    force_ratio_3_negative: ArrayLike = negative(force_ratio(3), "force_ratio_3", opensees="s3n over s1n")

    opensees = ("Hysteretic",)
    corners = 3
    rows = {
        "hysteretic": Coefficient.names(Coefficient.UNLOADING_EXPONENT),
        "hysteretic_softer_unloading": Coefficient.names(Coefficient.STIFFNESS_NEGATIVE),
        "hysteretic_asymmetric": Coefficient.names(),
    }

    @classmethod
    def spring(cls, p: Values) -> str:
        if has_negative_side(p):
            return "hysteretic_asymmetric"
        return "hysteretic_softer_unloading" if np.any(p["unloading_exponent"] > 0) else "hysteretic"

    @classmethod
    def counts_reversals(cls, p: Values) -> bool:
        """Return whether the storeys accumulate damage: then each reversal near zero force increases a target drift."""
        return bool(np.any(p["damage_by_ductility"] > 0) or np.any(p["damage_by_energy"] > 0))

    @classmethod
    def is_sensitive(cls, p: Values) -> bool:
        return cls.counts_reversals(p) or falls(p, 3) or falls(negative_side(p), 3)

    @staticmethod
    def named_coefficients(p: Values, row: str) -> dict[str, np.ndarray]:
        inverse = {"inverse_yield_drift": p["stiffness"] / p["yield_force"], "yield_force": p["yield_force"]}
        side, energy = _side(p)
        below = negative_side(p)
        side_below, energy_below = _side(below)
        force = below["yield_force"] / p["yield_force"]
        stiffness = p.get("stiffness_ratio_negative", np.ones_like(force))
        energy = energy + energy_below * force * force / stiffness
        values = (
            inverse
            | side
            | {"pinching_drift": p["pinching_drift"], "pinching_force": p["pinching_force"]}
            | {"damage_by_ductility": p["damage_by_ductility"], "damage_by_energy": p["damage_by_energy"] / energy}
        )
        if row == "hysteretic":
            return values
        values |= {"unloading_exponent": p["unloading_exponent"]}
        if row == "hysteretic_softer_unloading":
            return values
        drift = force / stiffness
        values |= {"stiffness_negative": stiffness, "yield_drift_negative": drift}
        for name, value in side_below.items():
            is_slope = name.endswith("_slope")
            values[f"{name}_negative"] = value * stiffness if is_slope else np.minimum(value * drift, NEVER)
        return values

    @staticmethod
    def problem(p: Values) -> str | None:
        return backbone_problem(p, 3) or named_as_negative(backbone_problem(negative_side(p), 3), p)

    @staticmethod
    def stiffest(p: Values) -> np.ndarray:
        return p["stiffness"] * np.maximum(p.get("stiffness_ratio_negative", 1.0), 1.0)


def _side(p: Values) -> tuple[dict[str, np.ndarray], np.ndarray]:
    """Return the coefficients of one side of the backbone: {name: array}, and the energy under the backbone.

    Drifts are divided by the yield drift of this side, forces by its yield force, and the energy by their product.
    """
    (_, d2, d3), (_, f2, f3) = corners(p, 3)
    second, third = (f2 - 1) / (d2 - 1), (f3 - f2) / (d3 - d2)
    side = {
        "second_length": d2 - 1,
        "second_slope": second,
        "third_slope": third,
        "third_length": np.where(third > 0, NEVER, d3 - d2),
        "second_is_gone": np.where((second < 0) & (f2 == 0), d2, NEVER),
        "third_is_gone": np.where((third < 0) & (f3 == 0), d3, NEVER),
    }
    return side, 0.5 + (d2 - 1) * (1 + f2) / 2 + (d3 - d2) * (f2 + f3) / 2
