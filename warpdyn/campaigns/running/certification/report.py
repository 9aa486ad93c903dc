"""Report of `certify`, which checks a storey law: a table of checks and a figure."""

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
    """One check of a storey law, damper or stop: a measured value and the bound that it must not exceed.

    Args:
        name: Property of the law that is checked, such as "passivity".
        measured: Measured value; NaN if it was not measured, or if the law returned NaN (the check then fails).
        bound: Largest allowed value; smallest allowed value if `is_least`.
        is_least: Whether `bound` is the smallest allowed value.
        reason: Reason why the bound is wider than usual, or why the value was not measured; otherwise "".
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
        """Whether the measured value is within the bound; False if the value is NaN."""
        return self.measured >= self.bound if self.is_least else self.measured <= self.bound

    @property
    def passed(self) -> bool:
        """Whether the value is within the bound or, if it was not measured, whether a reason is given."""
        return self.holds if self.is_measured else bool(self.reason)

    def cells(self) -> tuple[str, ...]:
        """Return the check as a row of the table: name, measured value, bound, and whether it passed."""
        measured = f"{self.measured:.2g}" if self.is_measured else "not measured"
        word = "NO" if not self.passed else f"yes ({self.reason})" if self.reason else "yes"
        return self.name, measured, f"{'>=' if self.is_least else '<='} {self.bound:.2g}", word


@dataclass(frozen=True, eq=False)
class Certificate:
    """Result of `wd.laws.certify`, the checks of a storey law, damper or stop.

    Args:
        law: The law, damper or stop as text.
        checks: The checks.
        drift: Drift along cycles of increasing amplitude [m], shape [step].
        force: Force along these cycles [N], shape [step].
        work: Work done on the storey along these cycles [J], shape [step].
        elastic: Stored elastic energy along these cycles [J], shape [step].
        steps: Integration steps of the convergence check [s].
        errors: Relative error of the displacement for each integration step [1].
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
        """Whether all checks of the law, damper or stop passed."""
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
        """Return a figure of the hysteresis loops, the energies, and the error against the integration step."""
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
