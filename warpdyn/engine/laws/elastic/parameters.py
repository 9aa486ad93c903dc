"""Linear elastic storeys."""

from __future__ import annotations

import enum

import numpy as np

from warpdyn.engine.laws.law import Law, Layout, Values


class Coefficient(Layout):
    """Coefficients of the device functions of a linear elastic storey."""

    STIFFNESS = enum.auto()


class Elastic(Law):
    """A linear elastic storey: force = stiffness * drift.

    Example:
        >>> wd.laws.Elastic()
        Elastic()
    """

    opensees = ("Elastic",)
    rows = {"elastic": Coefficient.names()}
    is_linear = is_linear_until_yield = True

    @staticmethod
    def named_coefficients(p: Values, row: str) -> dict[str, np.ndarray]:
        return {"stiffness": p["stiffness"]}
