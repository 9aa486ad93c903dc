"""The default integration method of `simulate`, which is used if neither method nor step is given.

The default method is chosen from tables of measured errors and costs. studies/default_methods.py measures the errors
for each storey law and kind of damping (data/default_methods.csv), and the costs for each storey law on a CPU and on a
GPU (data/default_method_costs.csv): with peak drifts only, and with all recorders and a collapse limit. Recorders need
a larger share of the time of methods with short, cheap steps.
"""

from __future__ import annotations

from dataclasses import dataclass
from functools import cache

from warpdyn.engine.methods.table import StoreyForces, fitting_methods
from warpdyn.foundations.files.packaged import packaged_rows

ERRORS, COSTS = "default_methods.csv", "default_method_costs.csv"
FALLBACK = "rk4"
# A method replaces RK4 if the 95 % quantile of its errors is at most MOST_ERROR times that of RK4, for each measured
# number of storeys, and its cost at most MOST_COST times that of RK4. Measured costs scatter by a few percent, so a
# smaller gain is not significant.
MOST_ERROR, MOST_COST = 1.0, 0.9
# Number of steps of a multistep method per default step of RK4. It is also used if the user chooses the method but no
# step: with one step, the 95 % quantile of its errors is larger than that of RK4 for most laws.
STEPS_OF_MULTISTEP = 2
# Damping ratio of the buildings with which methods were measured: 5 % in the first mode or the first two, and in
# "light_rayleigh" 2 % in modes 1 and 3. With less damping of the higher modes, other methods lose more accuracy than
# RK4.
MEASURED_DAMPING_RATIO = 0.05
LIGHT_RAYLEIGH, LIGHT_RATIO, HIGHEST_LIGHT_MODE = "light_rayleigh", 0.02, 3
# A building with less damping than the measured ones counts as undamped.
WORDS = {
    "none": "little or no damping",
    LIGHT_RAYLEIGH: "rayleigh damping of less than 5 % in the first two modes",
}
DEVICES = {"cpu": "a CPU", "cuda": "a GPU"}
ALL_RECORDERS = "_with_all_recorders"  # end of the names of columns with costs of runs with all recorders
COLUMNS = tuple(device + end for device in DEVICES for end in ("", ALL_RECORDERS))


@dataclass(frozen=True)
class DefaultMethod:
    """The default integration method of a structure.

    Args:
        method: Name of the method.
        steps: Number of steps of this method per default step of RK4.
        reason: Why it is the default, in one sentence.
    """

    method: str
    steps: int
    reason: str


@dataclass(frozen=True)
class Measured:
    """A row of the table of errors: a method compared with RK4 for a storey law, a damping and a number of storeys.

    Args:
        law: Storey law.
        damping: Kind of damping.
        storeys: Number of storeys of the measured buildings.
        method: Name of the method.
        steps: Number of steps of this method per default step of RK4.
        median_error: Median error of the peak drifts divided by that of RK4.
        error_95: 95 % quantile of the error of the peak drifts divided by that of RK4.
    """

    law: str
    damping: str
    storeys: int
    method: str
    steps: int
    median_error: float
    error_95: float


@cache
def measured_methods() -> tuple[Measured, ...]:
    """Return the rows of the table of measured errors."""
    return tuple(
        Measured(
            row["law"],
            row["damping"],
            int(row["storeys"]),
            row["method"],
            int(row["steps"]),
            float(row["median_error"]),
            float(row["error_95"]),
        )
        for row in packaged_rows(ERRORS)
    )


@cache
def measured_costs() -> dict[tuple[str, str, int], dict[str, float]]:
    """Return the measured costs of methods: {(law, method, steps): {column: run time divided by that of RK4}}."""
    return {
        (row["law"], row["method"], int(row["steps"])): {
            column: float(row[column]) for column in COLUMNS if row[column]
        }
        for row in packaged_rows(COSTS)
    }


def default_method(
    forces: StoreyForces,
    dampings: tuple[str, ...] = ("none",),
    *,
    is_gpu: bool = False,
    records_only_drifts: bool = True,
    is_noise: bool = False,
    is_grid: bool = False,
) -> DefaultMethod:
    """Return the method that `simulate` uses if neither method nor step is given.

    The default is RK4, unless the tables contain a cheaper method whose error is at most MOST_ERROR times that of RK4.
    If a building has several laws or kinds of damping, the largest of their errors and the smallest of their cost
    ratios decide: laws with many rules need nearly all of the time, and for these laws the cheaper method saves the
    most time.

    Args:
        forces: Storey forces of the structure.
        dampings: Kinds of damping of the structure, as in the table of errors.
        is_gpu: Whether the structure is simulated on a GPU.
        records_only_drifts: Whether the run records only peak drifts and has no collapse limit. Otherwise the costs
            with all recorders decide; where these were not measured, the costs with peak drifts only.
        is_noise: Whether the load is random noise, whose rate jumps at every node.
        is_grid: Whether the kernel of grids applies to the structure, a frame with hinges.
    """
    if is_grid and not is_noise:
        return DefaultMethod("leapfrog", 2, "frames whose members all have hinges have a fast kernel for it")
    if forces.is_lumped:
        return DefaultMethod(FALLBACK, 1, "other methods were not measured with lumped structures")
    if is_noise:  # multistep methods assume a smooth load: their error of the input energy was 0.3 to 275 %
        return DefaultMethod(FALLBACK, 1, "other methods were not measured with random noise")
    device = "cuda" if is_gpu else "cpu"
    names = forces.names
    words = " and ".join(WORDS.get(damping, f"{damping} damping") for damping in dampings)
    where, what = DEVICES[device], f"storeys of {', '.join(names)} with {words}"
    column = device + ALL_RECORDERS
    rows_of_laws = {name: [each for key, each in measured_costs().items() if key[0] == name] for name in names}
    if records_only_drifts or not all(rows and all(column in each for each in rows) for rows in rows_of_laws.values()):
        column = device
    if all(rows_of_laws.values()):  # each law was measured
        what += " (peak drifts only)" if column == device else " (all recorders and a collapse limit)"
    rows = [row for row in measured_methods() if row.law in names and row.damping in dampings]
    best = None
    least = MOST_COST
    for method, steps in dict.fromkeys((row.method, row.steps) for row in rows):
        own = [row for row in rows if (row.method, row.steps) == (method, steps)]
        found = [measured_costs().get((name, method, steps), {}) for name in names]
        costs = [each[column] for each in found if column in each]
        pairs = {(row.law, row.damping) for row in own}
        is_measured = len(pairs) == len(set(names)) * len(set(dampings)) and len(costs) == len(names)
        if not is_measured or max(row.error_95 for row in own) > MOST_ERROR or min(costs) > least:
            continue
        if all(method in fitting_methods(forces, damping) for damping in dampings):
            least = min(costs)
            reason = (
                f"{steps} steps of {method} for each default step of {FALLBACK} take {least:.2g} times as long on "
                f"{where} for {what}, and their peak drifts are at least as accurate (95 % quantile of the errors)"
            )
            best = DefaultMethod(method, steps, reason)
    if best is not None:
        return best
    reason = f"no method that was measured on {where} is as accurate and cheaper for {what}"
    return DefaultMethod(FALLBACK, 1, reason)
