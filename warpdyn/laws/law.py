"""What a storey law is to a scene: its parameters, their bounds, and the coefficients a kernel reads."""

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
        often_in_percent: Whether others give it in percent, so that a value above the upper bound may be meant so.
    """

    units: str
    long_name: str
    low: float = -np.inf
    high: float = np.inf
    low_open: bool = False
    high_open: bool = False
    default: float | None = None
    often_in_percent: bool = False

    def violations(self, values: np.ndarray) -> np.ndarray:
        """Return where values are not finite or out of bounds, as a mask of their shape."""
        below = values <= self.low if self.low_open else values < self.low
        above = values >= self.high if self.high_open else values > self.high
        return ~np.isfinite(values) | below | above

    def first_violation(
        self,
        name: str,
        values: np.ndarray,
        axes: tuple[str, ...],
        structures: np.ndarray | None = None,
        taken: np.ndarray | None = None,
    ) -> str | None:
        """Return a sentence on the first value out of bounds, with its place along `axes`, or None.

        Where `structures` is given, it holds the indices of the structures along the first axis; `taken` says at which
        storeys, the last axis, values count.
        """
        counted = values if taken is None else values[..., taken]
        if not self.violations(np.array([counted.min(), counted.max()])).any():  # bounds are of an interval
            return None
        bad = self.violations(values) & (True if taken is None else taken)
        place = np.argwhere(bad)[0]
        index = place if structures is None else [structures[place[0]], *place[1:]]
        where = ", ".join(f"{axis} {i + (axis == 'storey')}" for axis, i in zip(axes, index, strict=True))
        value = values[tuple(place)]
        is_percent = self.often_in_percent and structures is None and self.high < value <= 100  # no draw is meant so
        meant = f"; {value:g} % is {value / 100:g}" if is_percent else ""
        return f"{name} is {value:g}{' at ' if where else ''}{where}; it must be {self.allowed}{meant}"

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


YIELD_FORCE = Parameter("N", "storey yield force", low=0.0, low_open=True)
HARDENING_RATIO = Parameter("1", "ratio of post-yield to initial storey stiffness", low=0.0, high=1.0, high_open=True)
