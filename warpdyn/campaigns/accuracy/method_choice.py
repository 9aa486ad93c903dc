"""Result of a pilot run (`plan`): the chosen method, the other candidates, and the cost of the scene."""

from __future__ import annotations

from dataclasses import dataclass

import xarray as xr

from warpdyn.foundations.core.description import Text


@dataclass(frozen=True)
class MethodChoice:
    """Result of `plan`: the cheapest method, step and number type (dtype) whose error is below the target.

    Args:
        method: Integration method.
        dtype: "float32" or "float64".
        longest_step: Longest integration step [s]. The step of each motion is divided into the smallest number of equal
            steps that are not longer.
        table: All candidates, along the dimension `candidate`: method, dtype, longest step, errors, time per sample.
        carried: Registers, memory traffic, steps and time of the scene with this choice; each key contains the unit,
            such as "expected integration time [s]".

    Example:
        >>> scene = wd.Scene(building, wd.Cloud(motions), scatter)
        >>> choice = wd.plan(scene, 0.02, method="rk4", dtype="float32")
        >>> run = wd.simulate(scene, method=choice.method, dtype=choice.dtype, longest_step=choice.longest_step)
        >>> run.attrs["method"]
        'rk4'
    """

    method: str
    dtype: str
    longest_step: float
    table: xr.Dataset
    carried: dict[str, float]

    def __str__(self) -> str:
        names = ("method", "dtype", "longest step [s]", "95 % error", "worst", "time per sample [s]")
        lines = ["{:<26} {:<8} {:>16} {:>11} {:>9} {:>19}".format(*names)]
        for row in range(self.table.sizes["candidate"]):
            entry = self.table.isel(candidate=row)
            is_chosen = (entry.method.item(), entry.dtype.item()) == (self.method, self.dtype)
            lines.append(
                f"{entry.method.item():<26} {entry.dtype.item():<8} {entry.longest_step.item():>16.4g} "
                f"{entry.error.item():>11.2e} {entry.worst_error.item():>9.2e} "
                f"{entry.seconds_per_sample.item():>19.2e}{' *' if is_chosen else ''}"
            )
        lines.append(f"* the cheapest within {self.table.attrs['target_error']:g}")
        lines += [f"{name:<52} {value:,.6g}" for name, value in self.carried.items()]
        return "\n".join(lines)

    def _repr_html_(self) -> str:
        return Text(self)._repr_html_()
