"""Storey laws as data: the parameters a scene gives them, their bounds, and the coefficients a kernel reads."""

from __future__ import annotations

from collections.abc import Callable, Mapping
from dataclasses import dataclass, field

import numpy as np

Values = Mapping[str, np.ndarray]


@dataclass(frozen=True)
class Parameter:
    """What is known of one parameter of a structure.

    Args:
        units: UDUNITS string.
        long_name: What the dataset calls it.
        low: Lower bound.
        high: Upper bound.
        low_open: Whether the lower bound itself is refused.
        high_open: Whether the upper bound itself is refused.
        default: Value where the scene names none; None where it must.
    """

    units: str
    long_name: str
    low: float = -np.inf
    high: float = np.inf
    low_open: bool = False
    high_open: bool = False
    default: float | None = None

    def violations(self, values: np.ndarray) -> np.ndarray:
        """Return where values are not finite or out of bounds, as a mask of their shape."""
        below = values <= self.low if self.low_open else values < self.low
        above = values >= self.high if self.high_open else values > self.high
        return ~np.isfinite(values) | below | above

    @property
    def allowed(self) -> str:
        """The bounds in words."""
        bounds = []
        if np.isfinite(self.low):
            bounds.append(f"{'above' if self.low_open else 'at least'} {self.low:g}")
        if np.isfinite(self.high):
            bounds.append(f"{'below' if self.high_open else 'at most'} {self.high:g}")
        return " and ".join(["finite", *bounds])


@dataclass(frozen=True)
class Law:
    """A storey law: what a scene says of it, and what its kernel reads.

    Args:
        parameters: Parameters beside the storey stiffness, each one value a storey.
        spring: From the parameters to the row of the kernels' SPRINGS table that holds for all of them.
        coefficients: From the parameters, each [structure, storey], to what that row reads, in its order.
    """

    parameters: Mapping[str, Parameter] = field(default_factory=dict)
    spring: Callable[[Values], str] = lambda p: "elastic"
    coefficients: Callable[[Values], tuple[np.ndarray, ...]] = lambda p: (p["stiffness"],)


def _bilinear_coefficients(p: Values) -> tuple[np.ndarray, ...]:
    stiffness, hardening = p["stiffness"], p["hardening_ratio"]
    return hardening * stiffness, (1 - hardening) * stiffness, p["yield_force"] / stiffness


def _bouc_wen_spring(p: Values) -> str:
    """Exponents 1 and 2 have kernels without a power, which is what most of the time would go to."""
    for exponent in (1, 2):
        if np.all(p["exponent"] == exponent):
            return f"bouc_wen_{exponent}"
    return "bouc_wen"


def _bouc_wen_coefficients(p: Values) -> tuple[np.ndarray, ...]:
    stiffness, hardening, strength = p["stiffness"], p["hardening_ratio"], p["yield_force"]
    values = (hardening * stiffness, (1 - hardening) * strength, stiffness / strength, p["beta"], p["gamma"])
    return values if _bouc_wen_spring(p) != "bouc_wen" else (*values, p["exponent"])


YIELD_FORCE = Parameter("N", "storey yield force", low=0.0, low_open=True)
HARDENING_RATIO = Parameter("1", "ratio of post-yield to initial storey stiffness", low=0.0, high=1.0, high_open=True)

LAWS = {
    "elastic": Law(),
    "bilinear": Law(
        {"yield_force": YIELD_FORCE, "hardening_ratio": HARDENING_RATIO},
        lambda p: "bilinear",
        _bilinear_coefficients,
    ),
    # Bouc 1967, Wen 1976: F = alpha k d + (1 - alpha) Fy z; z is bounded by (beta + gamma)^(-1/n), 1 by default.
    "bouc_wen": Law(
        {
            "yield_force": YIELD_FORCE,
            "hardening_ratio": HARDENING_RATIO,
            "beta": Parameter("1", "Bouc-Wen beta", low=0.0, low_open=True, default=0.5),
            "gamma": Parameter("1", "Bouc-Wen gamma", default=0.5),
            "exponent": Parameter("1", "Bouc-Wen exponent n", low=0.0, low_open=True, default=1.0),
        },
        _bouc_wen_spring,
        _bouc_wen_coefficients,
    ),
}
