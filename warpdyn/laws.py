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

    def first_violation(
        self, name: str, values: np.ndarray, axes: tuple[str, ...], structures: np.ndarray | None = None
    ) -> str | None:
        """Return a sentence on the first value out of bounds, with its place along `axes`, or None.

        Where `structures` is given, it holds the indices of the structures along the first axis.
        """
        if not self.violations(np.array([values.min(), values.max()])).any():  # bounds are of an interval
            return None
        bad = self.violations(values)
        place = np.argwhere(bad)[0]
        index = place if structures is None else [structures[place[0]], *place[1:]]
        where = ", ".join(f"{axis} {i + (axis == 'storey')}" for axis, i in zip(axes, index, strict=True))
        return f"{name} is {values[tuple(place)]:g}{' at ' if where else ''}{where}; it must be {self.allowed}"

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
        coefficients: From the parameters, each [structure, storey], and the row's name to what it reads, in its order.
        problem: From the parameters to a sentence on what is wrong between them, if anything is.
        stiffest: From the parameters to the largest tangent stiffness [N/m] a storey can come to, [structure, storey].
    """

    parameters: Mapping[str, Parameter] = field(default_factory=dict)
    spring: Callable[[Values], str] = lambda p: "elastic"
    coefficients: Callable[[Values, str], tuple[np.ndarray, ...]] = lambda p, spring: (p["stiffness"],)
    problem: Callable[[Values], str | None] = lambda p: None
    stiffest: Callable[[Values], np.ndarray] = lambda p: p["stiffness"]


def _bilinear_coefficients(p: Values, spring: str) -> tuple[np.ndarray, ...]:
    stiffness, hardening = p["stiffness"], p["hardening_ratio"]
    return hardening * stiffness, (1 - hardening) * stiffness, p["yield_force"] / stiffness


def _bouc_wen_spring(p: Values) -> str:
    """Exponents 1 and 2 have kernels without a power, which is what most of the time would go to."""
    for exponent in (1, 2):
        if np.all(p["exponent"] == exponent):
            return f"bouc_wen_{exponent}"
    return "bouc_wen"


def _bouc_wen_coefficients(p: Values, spring: str) -> tuple[np.ndarray, ...]:
    stiffness, hardening, strength = p["stiffness"], p["hardening_ratio"], p["yield_force"]
    rate = stiffness / strength
    values = hardening * stiffness, (1 - hardening) * strength, rate, p["beta"] * rate, p["gamma"] * rate
    return (*values, p["exponent"]) if spring == "bouc_wen" else values


def _bouc_wen_problem(p: Values) -> str | None:
    """Beyond these bounds z grows without end, or gives back more energy than was put in (Erlicher and Point 2004)."""
    beta, gamma = np.broadcast_arrays(p["beta"], p["gamma"])
    bad = (gamma <= -beta) | (gamma > beta)
    if not np.any(bad):
        return None
    place = tuple(np.argwhere(bad)[0])
    where = ", ".join([f"structure {i}" for i in place[:-1]] + [f"storey {place[-1] + 1}"])
    return (
        f"gamma is {gamma[place]:g} where beta is {beta[place]:g} ({where}); "
        "a Bouc-Wen storey needs -beta < gamma <= beta"
    )


def _bouc_wen_stiffest(p: Values) -> np.ndarray:
    """A storey is stiffest as it begins to unload from its bound, if gamma < beta; at rest otherwise.

    Unloading, uy dz/dd = 1 + (beta - gamma) |z|^n, and |z|^n is at most 1 / (beta + gamma). Loading it is at most 1.
    """
    beta, gamma, hardening = p["beta"], p["gamma"], p["hardening_ratio"]
    return p["stiffness"] * (1 + (1 - hardening) * (beta - gamma) / (beta + gamma))


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
        _bouc_wen_problem,
        _bouc_wen_stiffest,
    ),
}
