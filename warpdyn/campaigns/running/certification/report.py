"""Report of a certification: a table of checks and a figure."""

from __future__ import annotations

from dataclasses import dataclass
from typing import TYPE_CHECKING

import numpy as np

from warpdyn.foundations.core.description import html_table

if TYPE_CHECKING:
    from matplotlib.figure import Figure

HEADS = ("check", "measured", "bound", "passed")


@dataclass(frozen=True)
class Check:
    """One check.

    Args:
        name: Property that is checked.
        measured: Measured value; NaN if it was not measured, or if a law returns NaN, which fails.
        bound: Largest allowed value, or least one if `is_least`.
        is_least: Whether `bound` is the least allowed value.
        reason: Reason for a wider bound, or for a value that was not measured; "" without one.
        is_measured: Whether the value was measured.
    """

    name: str
    measured: float
    bound: float
    is_least: bool = False
    reason: str = ""
    is_measured: bool = True

    @property
    def holds(self) -> bool:
        """Whether the measured value is within the bound; False if it is not a number."""
        return self.measured >= self.bound if self.is_least else self.measured <= self.bound

    @property
    def passed(self) -> bool:
        """Whether the bound holds, or a reason is given for a value that was not measured."""
        return self.holds if self.is_measured else bool(self.reason)

    def cells(self) -> tuple[str, ...]:
        """Return the row of the table."""
        measured = f"{self.measured:.2g}" if self.is_measured else "not measured"
        word = "NO" if not self.passed else f"yes ({self.reason})" if self.reason else "yes"
        return self.name, measured, f"{'>=' if self.is_least else '<='} {self.bound:.2g}", word


@dataclass(frozen=True, eq=False)
class Certificate:
    """Result of `wd.laws.certify`.

    Args:
        law: The law or device as text.
        checks: The checks.
        drift: Drift [m] along cycles of growing size, [step].
        force: Force [N], [step].
        work: Work done on the storey [J], [step].
        elastic: Elastic energy [J], [step].
        steps: Integration steps of the convergence check [s].
        errors: Errors of the displacement at these steps [1].
    """

    law: str
    checks: tuple[Check, ...]
    drift: np.ndarray
    force: np.ndarray
    work: np.ndarray
    elastic: np.ndarray
    steps: np.ndarray
    errors: np.ndarray

    @property
    def passed(self) -> bool:
        """Whether all checks passed."""
        return all(check.passed for check in self.checks)

    def __str__(self) -> str:
        rows = [HEADS, *(check.cells() for check in self.checks)]
        widths = [max(len(row[place]) for row in rows) for place in range(len(HEADS))]
        lines = ["  ".join(cell.ljust(width) for cell, width in zip(row, widths, strict=True)).rstrip() for row in rows]
        failed = sum(not check.passed for check in self.checks)
        verdict = "all checks passed" if self.passed else f"{failed} of {len(self.checks)} checks failed"
        return "\n".join([f"{self.law}: {verdict}", *lines])

    __repr__ = __str__

    def _repr_html_(self) -> str:
        return html_table(self.law, [check.cells() for check in self.checks], HEADS)

    def figure(self) -> Figure:
        """Draw the force under cycles of growing drift, the energies, and the error by integration step."""
        from matplotlib.figure import Figure

        figure = Figure(figsize=(10, 3.4), layout="constrained")
        loops, energies, convergence = figure.subplots(1, 3)
        loops.plot(self.drift, self.force / 1e3)
        loops.set(xlabel="drift [m]", ylabel="force [kN]", title="cycles of growing drift")
        for name, values in (
            ("work", self.work),
            ("elastic", self.elastic),
            ("dissipated", self.work - self.elastic),
        ):
            energies.plot(values / 1e3, label=name)
        energies.set(xlabel="step", ylabel="energy [kJ]", title="energies")
        energies.legend()
        convergence.loglog(self.steps, self.errors, "o-")
        convergence.set(xlabel="step [s]", ylabel="error of the displacement [1]", title="convergence of rk4")
        return figure
