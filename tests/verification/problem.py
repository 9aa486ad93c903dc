"""Description of a verification problem, and the comparison of warpdyn's values with the independent result."""

from __future__ import annotations

from collections.abc import Callable, Mapping, Sequence
from dataclasses import dataclass, field
from typing import Any

import numpy as np

Curve = tuple[np.ndarray, np.ndarray]
CLOSED, PUBLISHED, OPENSEES, SCIPY, STORED = (
    "closed form",
    "published value",
    "OpenSees",
    "SciPy",
    "stored event-exact solution",
)


@dataclass(frozen=True)
class Row:
    """A quantity of a problem.

    Args:
        name: Its name, such as "u(0.1 s)".
        unit: Its unit; "1" if it has none.
        printed: The number printed in the source, if it could be read; never used for the verdict.
        tolerance: Largest allowed difference, if it is not that of the problem.
    """

    name: str
    unit: str
    printed: float | None = None
    tolerance: float | None = None


@dataclass(frozen=True)
class Outcome:
    """Values of all rows of a problem, by warpdyn or by the independent method.

    Args:
        values: One value per row, in the order of the rows.
        curves: Name of a figure -> abscissas and ordinates.
    """

    values: Sequence[float] | np.ndarray
    curves: Mapping[str, Curve] = field(default_factory=dict)


@dataclass(frozen=True)
class Problem:
    """A numbered problem of the verification manual.

    Args:
        number: Such as "V01".
        title: Title of the page.
        group: Heading in the list of problems.
        kind: Kind of the independent result, one of the constants of this module.
        source: Publication or program, with example, table or test name.
        statement: What is computed, and why it tests warpdyn.
        inputs: Name, value and unit of each input.
        rows: The quantities that are compared.
        sketch: Name of a drawing of docs/generate/verification_sketches.py, and its arguments.
        reference: Function of a module without warpdyn that returns the independent result.
        computed: Function that returns the same quantities by warpdyn.
        tolerance: Largest allowed difference: relative, or in standard errors.
        reason: Why the tolerance has this size.
        scale: What differences are divided by: "value" (the independent value of the row), "largest" (the largest
            independent value with the same unit), or "error" (the standard error that `reference` lists).
        axes: Name of a figure -> labels of its axes; an entry for each curve.
        marks: Name of a figure -> rows whose printed values are drawn, as (abscissas, first row).
        notes: Remarks, such as an explanation of printed numbers that are wrong.
    """

    number: str
    title: str
    group: str
    kind: str
    source: str
    statement: str
    inputs: Sequence[tuple[str, str, str]]
    rows: Sequence[Row]
    sketch: tuple[str, Mapping[str, Any]]
    reference: Callable[[], Outcome]
    computed: Callable[[], Outcome]
    tolerance: float
    reason: str
    scale: str = "largest"
    axes: Mapping[str, tuple[str, str]] = field(default_factory=dict)
    marks: Mapping[str, tuple[Sequence[float], int]] = field(default_factory=dict)
    notes: str = ""


@dataclass(frozen=True)
class Verdict:
    """The comparison of a problem's rows.

    Args:
        problem: The problem.
        independent: Values of the independent method, shape [row].
        found: Values of warpdyn, shape [row].
        differences: found - independent, over the scale of the row, shape [row].
        curves: Name of a figure -> independent curve and curve of warpdyn.
    """

    problem: Problem
    independent: np.ndarray
    found: np.ndarray
    differences: np.ndarray
    curves: Mapping[str, tuple[Curve, Curve]]

    @property
    def largest(self) -> float:
        """Largest absolute difference of a row."""
        return float(np.abs(self.differences).max())

    @property
    def is_passed(self) -> bool:
        """Whether every row is within the tolerance."""
        return bool(np.all(np.abs(self.differences) <= self.tolerances))  # NaN is not

    @property
    def tolerances(self) -> np.ndarray:
        """Allowed difference of each row."""
        allowed = self.problem.tolerance
        return np.array([allowed if row.tolerance is None else row.tolerance for row in self.problem.rows])


def series(name: str, points: Sequence[float], unit: str, printed: Sequence[float] | None = None) -> list[Row]:
    """Return a row for each point; `{}` in the name is replaced by the point."""
    numbers = [None] * len(points) if printed is None else printed
    return [Row(name.format(f"{p:g}"), unit, n) for p, n in zip(points, numbers, strict=True)]


def scales_of(problem: Problem, independent: np.ndarray, errors: np.ndarray | None) -> np.ndarray:
    """Return what the differences of the rows are divided by, shape [row]."""
    size = np.abs(independent)
    if problem.scale == "value":
        return size
    if problem.scale == "error":
        assert errors is not None, f"{problem.number}: the independent result has no standard errors"
        return errors
    assert problem.scale == "largest", problem.scale
    units = np.array([row.unit for row in problem.rows])
    return np.array([size[units == unit].max() for unit in units])


def judge(problem: Problem) -> Verdict:
    """Run a problem by both ways and compare them."""
    reference, computed = problem.reference(), problem.computed()
    independent, found = (np.asarray(each.values, np.float64) for each in (reference, computed))
    errors = None
    if problem.scale == "error":  # the values are followed by their standard errors
        independent, errors = np.split(independent, 2)
    assert independent.shape == found.shape == (len(problem.rows),), (problem.number, independent.shape, found.shape)
    assert reference.curves.keys() == computed.curves.keys() == problem.axes.keys(), problem.number
    differences = (found - independent) / scales_of(problem, independent, errors)
    curves = {name: (reference.curves[name], computed.curves[name]) for name in problem.axes}
    return Verdict(problem, independent, found, differences, curves)
