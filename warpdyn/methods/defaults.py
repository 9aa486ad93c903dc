"""The method that `simulate` takes where none is given, by storey law and device, from measured errors and costs."""

from __future__ import annotations

import re
from dataclasses import dataclass
from functools import cache

from warpdyn.files.packaged import packaged_rows
from warpdyn.methods.table import fitting_methods

TABLE = "default_methods.csv"
FALLBACK = "rk4"
# A method may take RK4's place if its errors are at most so many times RK4's, a tenth being less than their medians
# change from one law to the next; and if its cost is at most so much of RK4's, since timings scatter.
MOST_ERROR, MOST_COST = 1.1, 0.9
DEVICES = {"cpu": "a CPU", "cuda": "a GPU"}


@dataclass(frozen=True)
class DefaultMethod:
    """The default method of a structure.

    Args:
        method: Row of METHODS.
        steps: Steps that it takes in each of RK4's default steps.
        reason: Why it is the default, in one sentence.
    """

    method: str
    steps: int
    reason: str


@dataclass(frozen=True)
class Measured:
    """A row of the table: a method beside RK4 at its default step, in buildings of one storey law.

    Args:
        law: Storey law.
        method: Row of METHODS.
        steps: Steps that the method takes in each of RK4's.
        median_error: Error of the peak drift over RK4's, of the samples' medians.
        error_95: The same of what 95 % of the samples stay below.
        costs: Time over RK4's, by device; a device on which it has not been measured is not in it.
    """

    law: str
    method: str
    steps: int
    median_error: float
    error_95: float
    costs: dict[str, float]


@cache
def measured_methods() -> tuple[Measured, ...]:
    """Return the rows of the table, which `studies/default_methods.py` writes."""
    return tuple(
        Measured(
            row["law"],
            row["method"],
            int(row["steps"]),
            float(row["median_error"]),
            float(row["error_95"]),
            {device: float(row[f"cost_{device}"]) for device in DEVICES if row[f"cost_{device}"]},
        )
        for row in packaged_rows(TABLE)
    )


def default_method(law: str, damping: str = "none", *, is_gpu: bool = False) -> DefaultMethod:
    """Return the method that integrates structures of a law where the caller names neither method nor step.

    It is RK4, unless the table has a method that errs hardly more (`MOST_ERROR`) than RK4 at its default step in
    storeys of every law of the structure, fits them and costs less on the device. Of several laws the one that
    saves most tells the cost, since laws of many rules, which save most, take nearly all of the time.

    Args:
        law: Law of the structure, such as "bilinear|pinching4+gap".
        damping: Damping of the structure.
        is_gpu: Whether it is run on a GPU.
    """
    device = "cuda" if is_gpu else "cpu"
    where, names = DEVICES[device], list(dict.fromkeys(re.split(r"[|+]", law)))
    rows = [row for row in measured_methods() if row.law in names]
    unknown = [name for name in names if all(row.law != name for row in rows)]
    if unknown:
        return DefaultMethod(FALLBACK, 1, f"no other method has been measured for {_listed(unknown)}")
    best: DefaultMethod | None = None
    least = MOST_COST
    for method, steps in dict.fromkeys((row.method, row.steps) for row in rows):
        own = [row for row in rows if (row.method, row.steps) == (method, steps)]
        costs = [row.costs[device] for row in own if device in row.costs]
        errs = max(max(row.median_error, row.error_95) for row in own)
        is_known = len(own) == len(names) and len(costs) == len(names)
        if is_known and errs <= MOST_ERROR and min(costs) <= least and method in fitting_methods(law, damping):
            least = min(costs)
            reason = (
                f"{steps} steps of {method} for each default step of {FALLBACK} take {least:.2g} times as long on "
                f"{where} for {_listed(names)}, and its errors are at most {MOST_ERROR:g} times as large"
            )
            best = DefaultMethod(method, steps, reason)
    if best is not None:
        return best
    if not any(device in row.costs for row in rows):
        return DefaultMethod(FALLBACK, 1, f"no other method has been measured on {where}")
    return DefaultMethod(FALLBACK, 1, f"none is measured to be as accurate and cheaper on {where} for {_listed(names)}")


def _listed(names: list[str]) -> str:
    return "storeys of " + ", ".join(names)
