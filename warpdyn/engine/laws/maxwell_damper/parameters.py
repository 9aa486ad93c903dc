"""Viscous dampers in series with a flexible brace (Maxwell elements; OpenSees: ViscousDamper).

The force F of damper and brace follows F' = K (v - sign(F) (|F| / C)^(1 / alpha)), with the brace stiffness K, the
velocity v of the storey drift, the damper coefficient C and the velocity exponent alpha. F is 0 at the start. With
alpha = 1 and a constant velocity, F = C v (1 - exp(-K t / C)). For a rigid brace use `ViscousDamper`.

The force changes with time at a constant drift. This has two consequences:

- Only explicit methods such as `rk4` support these dampers, except `central_difference_lagged`.
- `storey_hysteresis` and `pushover` are quasi-static analyses; there the force is 0.

At the force F = C, which the damper has at 1 m/s, the force relaxes at the rate K / (alpha C). The default step is
short enough for this rate; for faster motions, each run checks the actual rate. `hysteretic_energy` contains the
dissipated energy.

Differences from OpenSees: its material ViscousDamper integrates the same equation in each step, as if the velocity were
constant in the step; its material Maxwell ignores alpha.
"""

from __future__ import annotations

import enum

import numpy as np
from numpy.typing import ArrayLike

from warpdyn.engine.laws.bounds import first_place, place_of
from warpdyn.engine.laws.law import Device, Layout, Values, parameter


class Coefficient(Layout):
    """Coefficients that the device functions of the damper read; linear dampers do not need the last one."""

    STIFFNESS_RATIO = enum.auto()  # brace stiffness divided by damper coefficient
    DAMPER_COEFFICIENT = enum.auto()
    HALF_FLEXIBILITY = enum.auto()  # C^2 / (2 K)
    INVERSE_EXPONENT = enum.auto()


class MaxwellDamper(Device):
    """A viscous damper in series with a brace (OpenSees: ViscousDamper).

    The docstring of the module `maxwell_damper.parameters` lists the rules and the differences from OpenSees.

    Example:
        >>> wd.laws.MaxwellDamper(damper_coefficient=2e5, velocity_exponent=0.35, brace_stiffness=5e7)
        MaxwellDamper(damper_coefficient=200000.0, velocity_exponent=0.35, brace_stiffness=50000000.0)
    """

    damper_coefficient: ArrayLike = parameter("N s m-1", "force of the damper at 1 m/s", low=0.0, opensees="C")
    velocity_exponent: ArrayLike = parameter(
        "1", "velocity exponent of the damper", low=0.0, high=1.0, low_open=True, default=1.0, opensees="alpha"
    )
    brace_stiffness: ArrayLike = parameter("N m-1", "stiffness of the damper's brace", low=0.0, opensees="K")

    opensees = ("ViscousDamper",)
    has_rate = True
    relaxes = True
    rows = {
        "maxwell_damper": Coefficient.names(Coefficient.INVERSE_EXPONENT),
        "maxwell_damper_power": Coefficient.names(),
    }

    @classmethod
    def spring(cls, p: Values) -> str:
        return "maxwell_damper" if np.all(p["velocity_exponent"] == 1) else "maxwell_damper_power"

    @staticmethod
    def named_coefficients(p: Values, row: str) -> dict[str, np.ndarray]:
        damper, brace = np.broadcast_arrays(p["damper_coefficient"], p["brace_stiffness"])
        has_damper = damper > 0
        ratio = np.divide(brace, damper, out=np.zeros_like(damper, dtype=float), where=has_damper)
        half = np.divide(damper**2, 2 * brace, out=np.zeros_like(damper, dtype=float), where=has_damper)
        values = {"stiffness_ratio": ratio, "damper_coefficient": damper, "half_flexibility": half}
        return values if row == "maxwell_damper" else values | {"inverse_exponent": 1 / p["velocity_exponent"]}

    @staticmethod
    def problem(p: Values) -> str | None:
        damper, brace = np.broadcast_arrays(p["damper_coefficient"], p["brace_stiffness"])
        bad = (damper > 0) & (brace == 0)
        if not bad.any():
            return None
        place = first_place(bad)
        return (
            f"brace_stiffness is 0 and damper_coefficient is {damper[place]:g} ({place_of(place)}): a damper without "
            "a brace has no force; give brace_stiffness above 0, or damper_coefficient=0 in this storey"
        )

    @staticmethod
    def stiffest(p: Values) -> np.ndarray:
        return np.where(p["damper_coefficient"] > 0, p["brace_stiffness"], 0.0)

    @classmethod
    def relaxation_rate(cls, p: Values) -> np.ndarray:
        ratio = cls.named_coefficients(p, "maxwell_damper")["stiffness_ratio"]
        return ratio / p["velocity_exponent"]
