"""Trilinear storeys with pinching, damage and softer unloading (OpenSees: Hysteretic), as SimCenter's MDOF-LU has them.

The backbone goes on with its third slope beyond the last corner if that rises, and level if not. Drifts and
forces are alike both ways; damage by energy is over that under both sides of the backbone.

Three things differ from OpenSees on purpose. No part of the backbone may be stiffer than its first, and no corner have
a negative force. Unloading is no softer than towards the origin: where it is in OpenSees, which is with an exponent
near 1 and a force above yield, a storey pushes on beyond the origin, its force jumps in reloading, and cycles give
energy. And a backbone that comes to no force does so at the drift where its line crosses zero: OpenSees looks
there whether the rounded force is above zero, and if it is, takes the storey for one that never lost its strength.
"""

from __future__ import annotations

import enum

import numpy as np
from numpy.typing import ArrayLike

from warpdyn.engine.laws.backbone import backbone_problem, corners, ductility, falls, force_ratio
from warpdyn.engine.laws.law import YIELD_FORCE, Law, Layout, Values, parameter, shared

NEVER = 1e30  # yield drifts


class Coefficient(Layout):
    """What the device functions read, in yield drifts and yield forces."""

    INVERSE_YIELD_DRIFT = enum.auto()
    YIELD_FORCE = enum.auto()
    SECOND_LENGTH = enum.auto()  # of the backbone's second part
    SECOND_SLOPE = enum.auto()
    THIRD_SLOPE = enum.auto()
    THIRD_LENGTH = enum.auto()
    SECOND_IS_GONE = enum.auto()  # drift at which the second part comes to no force
    THIRD_IS_GONE = enum.auto()
    PINCHING_DRIFT = enum.auto()
    PINCHING_FORCE = enum.auto()
    DAMAGE_BY_DUCTILITY = enum.auto()
    DAMAGE_BY_ENERGY = enum.auto()
    UNLOADING_EXPONENT = enum.auto()


class Hysteretic(Law):
    """A trilinear storey with pinching, damage and softer unloading (OpenSees: Hysteretic, alike both ways).

    `warpdyn.engine.laws.hysteretic.parameters` says where OpenSees differs.

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
        "1", "growth of the drift aimed at, by ductility", low=0.0, default=0.0, opensees="damage1"
    )
    damage_by_energy: ArrayLike = parameter(
        "1", "growth of the drift aimed at, by energy", low=0.0, default=0.0, opensees="damage2"
    )
    unloading_exponent: ArrayLike = parameter(
        "1", "power of ductility by which unloading softens", low=0.0, high=1.0, default=0.0, opensees="beta"
    )

    opensees = ("Hysteretic",)
    rows = {
        "hysteretic": Coefficient.names(Coefficient.UNLOADING_EXPONENT),
        "hysteretic_softer_unloading": Coefficient.names(),
    }

    @classmethod
    def spring(cls, p: Values) -> str:
        return "hysteretic_softer_unloading" if np.any(p["unloading_exponent"] > 0) else "hysteretic"

    @classmethod
    def counts_reversals(cls, p: Values) -> bool:
        """Each reversal without force, or towards none, moves the drift aimed at away by the damage so far."""
        return bool(np.any(p["damage_by_ductility"] > 0) or np.any(p["damage_by_energy"] > 0))

    @classmethod
    def is_sensitive(cls, p: Values) -> bool:
        return cls.counts_reversals(p) or falls(p, 3)

    @staticmethod
    def named_coefficients(p: Values, row: str) -> dict[str, np.ndarray]:
        (_, d2, d3), (_, f2, f3) = corners(p, 3)
        second, third = (f2 - 1) / (d2 - 1), (f3 - f2) / (d3 - d2)
        # Where the parts' lines come to no force, if they do so before the next corner.
        falls = third < 0
        energy = 2 * (0.5 + (d2 - 1) * (1 + f2) / 2 + (d3 - d2) * (f2 + f3) / 2)
        values = {
            "inverse_yield_drift": p["stiffness"] / p["yield_force"],
            "yield_force": p["yield_force"],
            "second_length": d2 - 1,
            "second_slope": second,
            "third_slope": third,
            "third_length": np.where(third > 0, NEVER, d3 - d2),
            "second_is_gone": np.where((second < 0) & (f2 == 0), d2, NEVER),
            "third_is_gone": np.where(falls & (f3 == 0), d3, NEVER),
            "pinching_drift": p["pinching_drift"],
            "pinching_force": p["pinching_force"],
            "damage_by_ductility": p["damage_by_ductility"],
            "damage_by_energy": p["damage_by_energy"] / energy,
        }
        return values if row == "hysteretic" else values | {"unloading_exponent": p["unloading_exponent"]}

    @staticmethod
    def problem(p: Values) -> str | None:
        return backbone_problem(p, 3)
