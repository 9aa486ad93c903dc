"""One warning of what is implausible in an input, and how to say that it is meant."""

from __future__ import annotations

from collections.abc import Callable, Mapping, Sequence
from contextvars import ContextVar, Token
from functools import wraps
from typing import Any, TypeVar, cast

import numpy as np
from numpy.typing import ArrayLike

from warpdyn.foundations.core.checks import one_of
from warpdyn.foundations.core.messages import warn_caller
from warpdyn.foundations.core.plausible_bands import BANDS

MOST_TOLD = 5  # findings in one warning; the first ones are what the others follow from
OUTSIDE = 1 + 1e-9  # times a bound, beyond which a value is outside

F = TypeVar("F", bound=Callable[..., Any])

_meant: ContextVar[frozenset[str]] = ContextVar("meant_as_given", default=frozenset())


class meant_as_given:  # it reads as a word of the language: `with meant_as_given(...):`
    """Give no warning of implausible values of these quantities within a `with` block, or a function that it decorates.

    Args:
        quantities: Names of the quantities, as the warning tells them.

    Raises:
        ValueError: If there is none, or a name is unknown.

    Example:
        >>> with wd.meant_as_given("storey_height", "no_damping"):
        ...     machine = wd.ShearBuilding(mass=100.0, stiffness=4e4, height=0.2)
    """

    _is_idle = False  # until the names are checked

    def __init__(self, *quantities: str) -> None:
        if not quantities:
            raise ValueError(f"meant_as_given() takes the names of quantities, of {', '.join(map(repr, BANDS))}")
        for name in quantities:
            one_of("quantity", name, BANDS)
        self._quantities = quantities
        self._before: list[Token[frozenset[str]]] = []
        self._is_idle = True

    def __enter__(self) -> None:
        self._is_idle = False
        self._before.append(_meant.set(_meant.get() | set(self._quantities)))

    def __exit__(self, *raised: object) -> None:
        _meant.reset(self._before.pop())

    def __call__(self, function: F) -> F:
        """Return a function that runs within a block of its own, in whichever thread it is called."""
        self._is_idle = False
        quantities = self._quantities

        @wraps(function)
        def within(*arguments: Any, **named: Any) -> Any:
            with meant_as_given(*quantities):
                return function(*arguments, **named)

        return cast("F", within)

    def __del__(self) -> None:
        if self._is_idle:
            names = ", ".join(map(repr, self._quantities))
            warn_caller(
                f"meant_as_given({names}) does nothing by itself: write `with warpdyn.meant_as_given({names}):`"
            )


def _times_outside(values: np.ndarray, low: float, high: float) -> np.ndarray:
    """Return how many times values are beyond a bound, NaN where there is none; up to 1 within the bounds."""
    with np.errstate(divide="ignore", invalid="ignore"):
        outside = np.fmax(values / high, low / values if low > 0 else -np.inf)
    return np.where(values < low, np.fmax(outside, 2.0), outside)  # zero and below


class PlausibilityFindings:
    """What is implausible in one input, one sentence a quantity."""

    def __init__(self) -> None:
        self._found: dict[str, str] = {}
        self._others: dict[str, int] = {}

    def add(self, name: str, values: ArrayLike, where: str = "", *, along: str = "", high: float | None = None) -> bool:
        """Add a sentence on the value that is furthest outside its band, if one is; return whether.

        Args:
            name: The quantity, of BANDS.
            values: Values; NaN where there is none.
            where: What has them, as " of motion 'A'".
            along: What the last axis counts from 1, such as "storey", if its place is told.
            high: Upper bound in place of the band's.
        """
        if name in _meant.get():
            return False
        band, array = BANDS[name], np.asarray(values, dtype=np.float64)
        high = band.high if high is None else high
        outside = _times_outside(array, band.low, high)
        if not (outside > OUTSIDE).any():
            return False
        if name in self._found:
            self._others[name] = self._others.get(name, 0) + 1
            return True
        place = np.unravel_index(int(np.nanargmax(outside)), array.shape)
        counted = f" at {along} {place[-1] + 1}" if along and array.shape[-1:] != (1,) else ""
        self._found[name] = band.finding(float(array[place]), f"{where}{counted}", high)
        return True

    def add_each(self, name: str, values: Sequence[float], where: Callable[[int], str]) -> None:
        """Add what is outside its band among many values, each by where it is; all others are looked at together."""
        outside = _times_outside(np.asarray(values, dtype=np.float64), BANDS[name].low, BANDS[name].high)
        for place in np.flatnonzero(outside > OUTSIDE).tolist():
            self.add(name, values[place], where(place))

    def warn(self) -> None:
        """Give one warning of all that was found, as of the line that called warpdyn."""
        if not self._found:
            return
        names = sorted(self._found, key=list(BANDS).index)
        told = [
            self._found[name] + (f" (and {self._others[name]} more of the kind)" if name in self._others else "")
            for name in names[:MOST_TOLD]
        ]
        if len(names) > MOST_TOLD:
            told.append(f"and {', '.join(names[MOST_TOLD:])}")
        switch = ", ".join(repr(name) for name in names)
        warn_caller(
            f"implausible input: {'; '.join(told)}. Values are taken in kg, m, s and N; if they are meant as they are, "
            f"say so: `with warpdyn.meant_as_given({switch}):`"
        )


def warn_of_implausible_limits(limits: Mapping[str, float], of: str = "drift_limit") -> None:
    """Give one warning of implausible limits, each by the words for whose it is, such as " of 'slight'".

    Infinite ones, which collapse alone passes, are in any unit.
    """
    findings = PlausibilityFindings()
    for where, limit in limits.items():
        if np.isfinite(limit):
            findings.add(of, limit, where)
    findings.warn()
