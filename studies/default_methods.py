"""Errors and costs of methods relative to RK4 at its default step: the tables by which `simulate` chooses its method.

    python studies/default_methods.py --device cpu
    python studies/default_methods.py --device cpu --costs
    python studies/default_methods.py --device cuda:0 --costs
    python studies/default_methods.py --device cpu --scenes 200

If `--costs` is not given, the study measures errors and writes data/default_methods.csv, for each storey law, kind of
damping and number of storeys. Each has four buildings (two shapes of the stiffness over the height and two first
periods; for a single storey, four periods). They are subjected to the 44 far-field records at one, two and four times
the intensity at which the building yields.

With `--costs` the study measures computing times for each law, with peak drifts only and with all recorders and a
collapse limit. It writes the two columns of its processor (CPU or GPU) in data/default_method_costs.csv; run it once on
each of the two. With `--scenes` it draws random scenes instead. For each it prints the cost of the default method
divided by the least cost of the methods SEARCHED whose error is at most that of the default method.
"""

from __future__ import annotations

import argparse
import csv
import io
from collections.abc import Iterable
from dataclasses import replace
from itertools import product
from pathlib import Path

import numpy as np
from parts.default_methods.ensembles import PARABOLIC, TAPERED, Case, build_scene, records, seconds_of
from peers.storey_laws import LAWS

from warpdyn.engine.kernels.queues import checked_devices
from warpdyn.engine.methods.defaults import (
    ALL_RECORDERS,
    COLUMNS,
    COSTS,
    ERRORS,
    FALLBACK,
    LIGHT_RAYLEIGH,
    default_method,
    measured_costs,
)
from warpdyn.engine.methods.table import fitting_methods

ROOT = Path(__file__).parents[1]
CANDIDATES = (("stoermer", 1), ("stoermer", 2))  # method, and number of its steps in each step of RK4
LEVELS = (1.0, 2.0, 4.0)  # intensities divided by the intensity at which the building yields
# Buildings for the errors. Key: number of storeys. Values: shape of the stiffness over the height, first period [s].
BUILDINGS = {
    1: [(TAPERED, period) for period in (0.2, 0.5, 1.0, 2.0)],
    3: [(shape, period) for shape in (TAPERED, PARABOLIC) for period in (0.3, 0.8)],
    5: [(shape, period) for shape in (TAPERED, PARABOLIC) for period in (0.5, 1.2)],
    10: [(shape, period) for shape in (TAPERED, PARABOLIC) for period in (0.8, 2.0)],
    20: [(shape, period) for shape in (TAPERED, PARABOLIC) for period in (1.5, 3.0)],
}
DAMPINGS = (
    "none",
    "mass_proportional",
    LIGHT_RAYLEIGH,
    "stiffness_proportional",
    "rayleigh",
    "rayleigh_tangent",
    "modal",
    "storey",
)
STRUCTURES = 1  # number of structures: with 44 records and 3 levels, a building has 132 samples
FINER = 10  # reference steps per default step; the reference error is at most 1/100 of RK4's (order 2 or higher)
RESAMPLES = 200  # number of times that the records are drawn again with replacement
# Settings for the costs.
TIMED_STOREYS = 5
TIMED_PERIODS = (0.3, 1.0)  # first periods of the buildings [s]
TIMED_RECORDS = (0, 5, 12, 14, 20, 28, 33, 40)  # indices in the far-field set, with steps of 5, 10 and 20 ms
TIMED_STRUCTURES = {"cpu": 22, "cuda": 1365}  # number of structures: 528 samples on a CPU, 32,760 on a GPU
TIMED_RUNS = 5
COLLAPSE_DRIFT_RATIO = 0.1  # of the runs with all recorders; few samples reach it
ERRORS_HEAD = """\
# Errors of peak storey drifts by a method that takes `steps` steps in each default step of RK4, divided by those of RK4
# at its default step. Buildings of one law and one kind of damping: 5 % of critical in the first mode (Rayleigh
# damping: in the first two), "light_rayleigh" 2 % in modes 1 and 3 (the first two of fewer than three storeys),
# "storey" in dampers of the lower half of the storeys. Errors are those against RK4 in float64 at a tenth of the step.
# Four buildings of each number of storeys (two shapes of the stiffness and two periods; a single storey: four periods)
# of 132 samples each. median_error and error_95: ratio of the medians and of the 95 % quantiles of all 528 samples.
# largest_95: ratio of the 95 % quantiles in the building where it is largest. deviation_95: standard deviation of
# error_95 when the records are drawn again with replacement. Written by studies/default_methods.py.
"""
COSTS_HEAD = """\
# Time of the integration by a method that takes `steps` steps in each default step of RK4, divided by that of RK4 at
# its default step, for buildings of five storeys of one law with Rayleigh damping: with peak drifts only and, in the
# columns "..._with_all_recorders", with all recorders and a collapse limit. Empty where it was not measured. The costs
# on a CPU were measured on an AMD EPYC with AVX-512. Written by studies/default_methods.py --costs, on each device.
"""
# Methods and steps of the exhaustive search, without methods that cost more than RK4 or Verlet at the same order.
SEARCHED = ("rk4", "stoermer", "ssprk3", "kutta3", "velocity_verlet", "central_difference", "exact")
SEARCHED_STEPS = (0.5, 1.0, 1.5, 2.0, 3.0, 4.0)
BASE = (FALLBACK, 1)


def quantile(errors: np.ndarray, share: float) -> np.ndarray:
    """Return a quantile of errors over the last axis; it is one of the values, so infinite errors are allowed."""
    return np.quantile(errors, share, axis=-1, method="higher")


def measure_errors(law: str, damping: str, storeys: int) -> list[dict[str, object]]:
    """Measure the errors of methods for a law, a kind of damping and a number of storeys; return one row per method."""
    candidates = [BASE, *CANDIDATES]
    found: dict[tuple[str, int], list[np.ndarray]] = {key: [] for key in candidates}
    for shape, period in BUILDINGS[storeys]:
        scene = build_scene(law, storeys, period, list(records()), LEVELS, shape=shape, damping=damping)
        case = Case(scene, STRUCTURES, "cpu", finer=FINER)
        for key in candidates:
            # Samples are ordered by structure, then by level or record; the reshaped errors have one row per record.
            run = case.run(*key)
            errors = case.errors(run)
            order = np.argsort(run.assignment.motion, kind="stable")
            found[key].append(errors[order].reshape(len(records()), -1))
    rows: list[dict[str, object]] = []
    random = np.random.default_rng(0)
    drawn = random.integers(0, len(records()), (RESAMPLES, len(records())))
    base = np.array(found[BASE])  # [building, record, sample]
    for key in CANDIDATES:
        own = np.array(found[key])

        def ratio(share: float, which: object, own: np.ndarray = own, of: slice = slice(None)) -> float:
            """Return the ratio of a quantile of the errors to that of RK4, for some of the records and buildings."""
            above, below = (quantile(errors[of, which].ravel(), share) for errors in (own, base))
            return float(above / below)

        everything = slice(None)
        of_buildings = [ratio(0.95, everything, of=slice(b, b + 1)) for b in range(len(own))]
        deviation = np.std([ratio(0.95, which) for which in drawn])
        rows.append(
            {
                "law": law,
                "damping": damping,
                "storeys": storeys,
                "method": key[0],
                "steps": key[1],
                "median_error": f"{ratio(0.5, everything):.2f}",
                "error_95": f"{ratio(0.95, everything):.2f}",
                "largest_95": f"{max(of_buildings):.2f}",
                "deviation_95": f"{deviation:.2f}",
            }
        )
    return rows


def least_seconds(runs: Iterable) -> np.ndarray:
    """Return the shortest time of each run [s]; the runs are timed alternately, TIMED_RUNS times each."""
    runs = list(runs)
    return np.min([[seconds_of(run) for run in runs] for _ in range(TIMED_RUNS)], axis=0)


def measure_costs(law: str, device: str) -> list[dict[str, object]]:
    """Measure the run times of methods for a law on one device; return one table row per method and step."""
    rows: list[dict[str, object]] = [{"law": law, "method": method, "steps": steps} for method, steps in CANDIDATES]
    for end, recorders, limit in (("", ("drift",), None), (ALL_RECORDERS, None, COLLAPSE_DRIFT_RATIO)):
        ratios = []
        for period in TIMED_PERIODS:
            motions = [records()[i] for i in TIMED_RECORDS]
            scene = build_scene(law, TIMED_STOREYS, period, motions, LEVELS, recorders)
            scene = replace(scene, collapse_drift_ratio=limit)
            case = Case(scene, TIMED_STRUCTURES[device], "cpu" if device == "cpu" else "cuda:0")
            seconds = least_seconds([case.run(*key) for key in (BASE, *CANDIDATES)])
            ratios.append(seconds[1:] / seconds[0])
        for row, cost in zip(rows, np.exp(np.mean(np.log(ratios), axis=0)), strict=True):
            row[device + end] = f"{cost:.2f}"
    return rows


def write_table(name: str, head: str, columns: Iterable[str], rows: list[dict[str, object]]) -> None:
    """Write a table with a comment `head` as a CSV file to the folder `data`."""
    text = io.StringIO()
    writer = csv.DictWriter(text, list(columns), lineterminator="\n")
    writer.writeheader()
    writer.writerows(rows)
    (ROOT / "data" / name).write_text(head + text.getvalue(), encoding="utf-8")


def write_errors(laws: list[str], dampings: list[str]) -> None:
    """Measure the errors of laws with kinds of damping, and update the rows of these in the table of errors."""
    path = ROOT / "data" / ERRORS
    lines = path.read_text(encoding="utf-8").splitlines() if path.exists() else []
    before = list(csv.DictReader(line for line in lines if not line.startswith("#")))
    head = ("law", "damping", "storeys", "method", "steps")
    rows: dict[tuple[str, ...], dict[str, object]] = {tuple(row[name] for name in head): dict(row) for row in before}
    for law in laws:
        for damping, storeys in product(dampings, BUILDINGS):
            for row in measure_errors(law, damping, storeys):
                print(*row.values(), flush=True)
                rows[tuple(str(row[name]) for name in head)] = row
        order = sorted(rows, key=lambda key: (list(LAWS).index(key[0]), DAMPINGS.index(key[1]), int(key[2]), key[3:]))
        kept = [rows[key] for key in order]
        write_table(ERRORS, ERRORS_HEAD, kept[0], kept)  # type: ignore[arg-type]


def write_costs(laws: list[str], device: str) -> None:
    """Measure the costs of laws on a device, and update the columns of this device in the table of costs."""
    rows = []
    for law in LAWS:
        measured = measure_costs(law, device) if law in laws else [{} for _ in CANDIDATES]
        for (method, steps), row in zip(CANDIDATES, measured, strict=True):
            print(*row.values(), flush=True)
            before = measured_costs().get((law, method, steps), {})
            costs = {name: f"{cost:.2f}" for name, cost in before.items()}
            rows.append({"law": law, "method": method, "steps": steps} | costs | row)
    write_table(COSTS, COSTS_HEAD, ["law", "method", "steps", *COLUMNS], rows)


def search(number: int, device: str) -> tuple[str, float, float]:
    """Return the cost and error of the default method relative to the best method found for a random scene.

    Returns:
        The scene as text, the cost of the default method divided by the least cost found, and the error of the default
        method divided by the error of RK4.
    """
    random = np.random.default_rng([17, number])
    law = str(random.choice(list(LAWS)))
    storeys = int(random.choice([1, 5]))
    period = float(np.exp(random.uniform(np.log(0.2), np.log(3.0))))
    motions = [records()[i] for i in random.choice(len(records()), 4, replace=False)]
    levels = tuple(np.sort(np.exp(random.uniform(np.log(0.5), np.log(6.0), 2))))
    recorders = ("drift",) if storeys > 1 or random.random() < 0.5 else ("acceleration", "drift", "residual")
    scene = build_scene(law, storeys, period, motions, levels, recorders)
    case = Case(scene, TIMED_STRUCTURES[device], "cpu" if device == "cpu" else "cuda:0")
    default = default_method(
        scene.structure.storey_law.forces(),
        (scene.structure.damping,),
        is_gpu=device != "cpu",
        records_only_drifts=recorders == ("drift",),
    )
    chosen = case.run(default.method, default.steps)

    def error_of(run: object) -> float:
        return float(quantile(case.errors(run), 0.95))  # type: ignore[arg-type]

    given, today = error_of(chosen), error_of(case.run(FALLBACK, 1))
    fitting = fitting_methods(scene.structure.storey_law.forces(), scene.structure.damping)
    names = [name for name in SEARCHED if name in fitting]
    within = [run for name in names for steps in SEARCHED_STEPS if error_of(run := case.run(name, steps)) <= given]
    seconds = least_seconds([chosen, *within])
    words = f"{law} {storeys} storeys {period:.2f} s {'+'.join(recorders)}: {default.method}"
    return words, float(seconds[0] / seconds.min()), given / today


def main() -> None:
    """Run the study from the command line."""
    parser = argparse.ArgumentParser(description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter)
    parser.add_argument("--device", help="cpu or cuda:0 [the first GPU, or the CPU]")
    parser.add_argument("--costs", action="store_true", help="measure the costs on the device instead of the errors")
    parser.add_argument("--dampings", default=",".join(DAMPINGS), help="kinds of damping, with commas [all]")
    parser.add_argument("--laws", default=",".join(LAWS), help="laws to measure, with commas [all]")
    parser.add_argument("--scenes", type=int, default=0, help="number of random scenes to search [%(default)s]")
    arguments = parser.parse_args()
    device = "cpu" if checked_devices(arguments.device)[0] == "cpu" else "cuda"
    if arguments.costs:
        write_costs(arguments.laws.split(","), device)
        return
    if not arguments.scenes:
        write_errors(arguments.laws.split(","), arguments.dampings.split(","))
        return
    found = []
    for number in range(arguments.scenes):
        found.append(search(number, device))
        print(
            f"{number} {found[-1][0]} cost over best {found[-1][1]:.2f}, error over RK4's {found[-1][2]:.2f}",
            flush=True,
        )
    cost, error = (np.array([row[place] for row in found]) for place in (1, 2))
    print(f"cost over best: median {np.median(cost):.2f}, 95 % {np.quantile(cost, 0.95):.2f}, worst {cost.max():.2f}")
    print(
        f"within 1.5: {np.mean(cost <= 1.5):.1%}; error over RK4's: median {np.median(error):.2f}, "
        f"worst {error.max():.2f}"
    )


if __name__ == "__main__":
    main()
