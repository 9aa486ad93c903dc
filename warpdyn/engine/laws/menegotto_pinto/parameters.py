"""Menegotto-Pinto storeys (OpenSees: Steel02)."""

from __future__ import annotations

import enum

import numpy as np
from numpy.typing import ArrayLike

from warpdyn.engine.laws.bounds import above, first_bad
from warpdyn.engine.laws.law import HARDENING_RATIO, YIELD_FORCE, Law, Layout, Values, parameter, shared


class Coefficient(Layout):
    """Coefficients that the device functions of the law read; the last two exist only with isotropic hardening."""

    INVERSE_YIELD_DRIFT = enum.auto()
    TRANSITION_FORCE = enum.auto()  # transition force at h = 1
    HARDENING_STIFFNESS = enum.auto()
    TRANSITION_CURVATURE = enum.auto()  # R0
    CURVATURE_REDUCTION = enum.auto()  # cR1
    CURVATURE_REDUCTION_DUCTILITY = enum.auto()  # cR2
    ISOTROPIC_HARDENING = enum.auto()
    HALF_INVERSE_DUCTILITY = enum.auto()  # 0.5 / isotropic hardening ductility


class MenegottoPinto(Law):
    """A Menegotto-Pinto storey (Menegotto and Pinto 1973; Filippou, Popov and Bertero 1983; OpenSees: Steel02).

    The storey stiffness is OpenSees' E0. Isotropic hardening is the same in both directions; there is no initial force.

    Example:
        >>> wd.laws.MenegottoPinto(yield_force=1e6, hardening_ratio=0.02, transition_curvature=18)
        MenegottoPinto(yield_force=1000000.0, hardening_ratio=0.02, transition_curvature=18.0)
    """

    yield_force: ArrayLike = shared(YIELD_FORCE, opensees="Fy")
    hardening_ratio: ArrayLike = shared(HARDENING_RATIO, opensees="b")
    transition_curvature: ArrayLike = parameter(
        "1",
        "exponent R0 of the first transition from elastic to hardening",
        low=0.0,
        low_open=True,
        default=20.0,
        opensees="R0",
    )
    curvature_reduction: ArrayLike = parameter(
        "1",
        "largest relative decrease cR1 of the exponent",
        low=0.0,
        high=1.0,
        high_open=True,
        default=0.925,
        opensees="cR1",
    )
    curvature_reduction_ductility: ArrayLike = parameter(
        "1",
        "plastic excursion over yield drift, cR2, at which half of the largest decrease occurs",
        low=0.0,
        low_open=True,
        default=0.15,
        opensees="cR2",
    )
    isotropic_hardening: ArrayLike = parameter(
        "1",
        "relative rise of the yield force at the isotropic hardening ductility",
        low=0.0,
        default=0.0,
        opensees="a1 and a3",
    )
    isotropic_hardening_ductility: ArrayLike = parameter(
        "1",
        "half the range of drifts over yield drift at which the isotropic hardening ratio is reached",
        low=0.0,
        low_open=True,
        default=1.0,
        opensees="a2 and a4",
    )

    opensees = ("Steel02",)
    rows = {
        "menegotto_pinto": Coefficient.names(Coefficient.ISOTROPIC_HARDENING),
        "menegotto_pinto_isotropic": Coefficient.names(),
    }

    @classmethod
    def spring(cls, p: Values) -> str:
        """Return the name of the set of device functions for these parameters.

        The set with isotropic hardening needs one more power and one more memory value.
        """
        return "menegotto_pinto_isotropic" if np.any(p["isotropic_hardening"]) else "menegotto_pinto"

    @classmethod
    def counts_reversals(cls, p: Values) -> bool:
        """Return whether storeys have isotropic hardening: then each reversal shifts the line of the next branch."""
        return cls.spring(p) == "menegotto_pinto_isotropic"

    @staticmethod
    def named_coefficients(p: Values, row: str) -> dict[str, np.ndarray]:
        stiffness, hardening, strength = p["stiffness"], p["hardening_ratio"], p["yield_force"]
        values = {
            "inverse_yield_drift": stiffness / strength,
            "transition_force": (1 - hardening) * strength,
            "hardening_stiffness": hardening * stiffness,
            "transition_curvature": p["transition_curvature"],
            "curvature_reduction": p["curvature_reduction"],
            "curvature_reduction_ductility": p["curvature_reduction_ductility"],
        }
        if row == "menegotto_pinto":
            return values
        return values | {
            "isotropic_hardening": p["isotropic_hardening"],
            "half_inverse_ductility": 0.5 / p["isotropic_hardening_ductility"],
        }

    @staticmethod
    def problem(p: Values) -> str | None:
        """Return a sentence about an exponent that may fall below 1 (the storey would yield at once), or None."""
        exponent, reduction = p["transition_curvature"], p["curvature_reduction"]
        least = 1 / (1 - reduction)
        reason = "1 / (1 - curvature_reduction): the exponent of later transitions must be at least 1"
        return first_bad(above(least, exponent), "transition_curvature", exponent, "at least", least, reason)
