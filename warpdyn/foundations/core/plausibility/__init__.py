"""One warning that lists all implausible values of an input, and `meant_as_given`, which turns checks off."""

from __future__ import annotations

from collections.abc import Callable, Mapping, Sequence
from contextvars import ContextVar, Token
from dataclasses import replace
from functools import wraps
from typing import Any, TypeVar, cast

import numpy as np
from numpy.typing import ArrayLike

from warpdyn.foundations.core.checks import one_of
from warpdyn.foundations.core.messages import warn_caller
from warpdyn.foundations.core.plausibility.check import Mistakes
from warpdyn.foundations.core.plausibility.table import CHECKS

MOST_FINDINGS = 5  # sentences in one warning; further implausible values usually follow from the first ones
OUTSIDE = 1 + 1e-9  # a value is implausible if it is beyond a bound by more than this factor (rounding)

F = TypeVar("F", bound=Callable[..., Any])

_meant: ContextVar[frozenset[str]] = ContextVar("meant_as_given", default=frozenset())


class meant_as_given:  # lower case, because it reads as a keyword: `with meant_as_given(...):`
    """Turn off warnings of implausible values of some quantities, in a `with` block or a decorated function.

    Args:
        quantities: Names of the quantities, as in the warning.

    Raises:
        ValueError: If no name is given, or a name is unknown.

    Example:
        >>> with wd.meant_as_given("storey_height", "no_damping"):
        ...     machine = wd.ShearBuilding(mass=100.0, stiffness=4e4, height=0.2)
    """

    _is_unused = False  # becomes True after the names are checked, and False once the object is used

    def __init__(self, *quantities: str) -> None:
        if not quantities:
            raise ValueError(f"meant_as_given() takes the names of quantities: {', '.join(map(repr, CHECKS))}")
        for name in quantities:
            one_of("quantity", name, CHECKS)
        self._quantities = quantities
        self._before: list[Token[frozenset[str]]] = []
        self._is_unused = True

    def __enter__(self) -> None:
        self._is_unused = False
        self._before.append(_meant.set(_meant.get() | set(self._quantities)))

    def __exit__(self, *raised: object) -> None:
        _meant.reset(self._before.pop())

    def __call__(self, function: F) -> F:
        """Return the decorated function. Each call enters a new `with` block, so that threads do not share a block."""
        self._is_unused = False
        quantities = self._quantities

        @wraps(function)
        def within(*arguments: Any, **named: Any) -> Any:
            with meant_as_given(*quantities):
                return function(*arguments, **named)

        return cast("F", within)

    def __del__(self) -> None:
        if self._is_unused:
            names = ", ".join(map(repr, self._quantities))
            warn_caller(f"meant_as_given({names}) has no effect alone: write `with warpdyn.meant_as_given({names}):`")


def _times_outside(values: np.ndarray, low: float, high: float) -> np.ndarray:
    """Return how many times each value is outside of its bounds: the larger of value / `high` and `low` / value.

    The result is above 1 for values outside of the bounds, also for zero and negative values, and NaN for NaN.
    """
    with np.errstate(divide="ignore", invalid="ignore"):
        outside = np.fmax(values / high, low / values if low > 0 else -np.inf)
    return np.where(values < low, np.fmax(outside, 2.0), outside)  # zero and negative values: at least 2


class PlausibilityFindings:
    """Collects implausible values of one input, such as a scene; each quantity gets one sentence in the warning."""

    def __init__(self) -> None:
        self._found: dict[str, str] = {}
        self._others: dict[str, int] = {}

    def add(
        self,
        name: str,
        values: ArrayLike,
        where: str = "",
        *,
        along: str = "",
        high: float | None = None,
        mistakes: Mistakes | None = None,
    ) -> bool:
        """Add a sentence about the value that is farthest outside the usual values, if there is one.

        Args:
            name: Name of the quantity, a key of CHECKS.
            values: Values of the quantity; NaN values are not checked.
            where: Words that follow the quantity in the sentence, such as " of motion 'A'".
            along: Name of the last dimension, such as "storey", if the sentence gives its number (from 1); "": no.
            high: Largest usual value; None: the value in CHECKS.
            mistakes: Likely mistakes; None: those in CHECKS.

        Returns:
            Whether a value is implausible.
        """
        if name in _meant.get():
            return False
        check, array = CHECKS[name], np.asarray(values, dtype=np.float64)
        check = check if mistakes is None else replace(check, mistakes=mistakes)
        high = check.high if high is None else high
        outside = _times_outside(array, check.low, high)
        if not (outside > OUTSIDE).any():
            return False
        if name in self._found:
            self._others[name] = self._others.get(name, 0) + 1
            return True
        place = np.unravel_index(int(np.nanargmax(outside)), array.shape)
        counted = f" at {along} {place[-1] + 1}" if along and array.shape[-1:] != (1,) else ""
        self._found[name] = check.finding(float(array[place]), f"{where}{counted}", high)
        return True

    def add_each(
        self, name: str, values: Sequence[float], where: Callable[[int], str], *, mistakes: Mistakes | None = None
    ) -> None:
        """Add one sentence for each implausible value to the warning.

        Args:
            name: Name of the check.
            values: The values that are checked.
            where: Function that returns the words for the place of a value, such as " of motion 'A'".
            mistakes: Likely mistakes; None: those in CHECKS.
        """
        outside = _times_outside(np.asarray(values, dtype=np.float64), CHECKS[name].low, CHECKS[name].high)
        for place in np.flatnonzero(outside > OUTSIDE).tolist():
            self.add(name, values[place], where(place), mistakes=mistakes)

    def warn(self) -> None:
        """Give one warning of all implausible values, at the line of the user's code that called warpdyn."""
        if not self._found:
            return
        names = sorted(self._found, key=list(CHECKS).index)
        sentences = [
            self._found[name] + (f" (and {self._others[name]} more of the kind)" if name in self._others else "")
            for name in names[:MOST_FINDINGS]
        ]
        if len(names) > MOST_FINDINGS:
            sentences.append(f"and {', '.join(names[MOST_FINDINGS:])}")
        switch = ", ".join(map(repr, names))
        warn_caller(
            f"implausible input: {'; '.join(sentences)}. warpdyn's units are kg, m, s and N. If the values are right, "
            f"put the call into a block `with warpdyn.meant_as_given({switch}):`"
        )


def warn_of_implausible_limits(limits: Mapping[str, float], of: str = "drift_limit") -> None:
    """Give one warning that lists all implausible limits, such as drift limits of damage states.

    Args:
        limits: Words that follow the quantity, such as " of 'slight'" -> limit. Infinite limits, which only a collapse
            exceeds, are not checked.
        of: Name of the quantity, a key of CHECKS.
    """
    findings = PlausibilityFindings()
    for where, limit in limits.items():
        if np.isfinite(limit):
            findings.add(of, limit, where)
    findings.warn()
