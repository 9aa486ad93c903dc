"""Errors and costs of methods beside RK4 at its default step, by storey law: the table of default methods.

    python studies/default_methods.py --device cpu
    python studies/default_methods.py --device cuda:0
    python studies/default_methods.py --device cpu --scenes 200

Buildings of five storeys and of two first periods stand for each law, under eight far-field records at one, two and
four times the level at which they yield. Writes data/default_methods.csv, of whose costs it fills the column of its
device: run it once on each. With `--scenes` it draws random scenes instead and prints, of each, the cost of the default
method over the least cost of any of SEARCHED within the error that the default gives.
"""

from __future__ import annotations

import argparse
import csv
import io
from collections.abc import Iterable
from pathlib import Path

import numpy as np
from parts.default_methods.ensembles import Case, build_scene, records, seconds_of
from peers.storey_laws import LAWS

from warpdyn.kernels.queues import checked_devices
from warpdyn.methods.defaults import DEVICES, FALLBACK, TABLE, default_method, measured_methods
from warpdyn.methods.table import fitting_methods

ROOT = Path(__file__).parents[1]
CANDIDATES = (("velocity_verlet", 2),)  # method, and steps in each of RK4's
STOREYS, PERIODS, LEVELS = 5, (0.3, 1.0), (1.0, 2.0, 4.0)
RECORDS = (0, 5, 12, 14, 20, 28, 33, 40)  # of the far-field set, recorded every 5, 10 and 20 ms
STRUCTURES = {"cpu": 22, "cuda": 1365}  # 528 samples, or 32,760
TIMED_RUNS = 5
HEAD = """\
# Errors and times of methods over those of RK4 at its default step, of shear buildings of five storeys of one law each,
# where the method takes so many steps in each of RK4's. median_error and error_95: error of the peak storey drifts
# against RK4 in float64 at a sixteenth of the step, median of the samples and what 95 % of them stay below, over RK4's.
# cost_cpu and cost_cuda: time of the integration over RK4's; empty where it has not been measured.
# Written by studies/default_methods.py, once on each device.
"""
# Methods and steps of the exhaustive search; those that share RK4's or Verlet's order and cost more are left out.
SEARCHED = ("rk4", "ssprk3", "kutta3", "velocity_verlet", "central_difference", "exact")
SEARCHED_STEPS = (0.5, 1.0, 1.5, 2.0, 3.0, 4.0)


def least_seconds(runs: Iterable) -> np.ndarray:
    """Return the least times of runs [s], which are timed in turn."""
    runs = list(runs)
    return np.min([[seconds_of(run) for run in runs] for _ in range(TIMED_RUNS)], axis=0)


def measure(law: str, device: str) -> list[dict[str, object]]:
    """Return a law's rows, with the cost on one device."""
    candidates = [(FALLBACK, 1), *CANDIDATES]
    errors: dict[tuple[str, int], list[np.ndarray]] = {key: [] for key in candidates}
    ratios = []
    for period in PERIODS:
        scene = build_scene(law, STOREYS, period, [records()[i] for i in RECORDS], LEVELS)
        case = Case(scene, STRUCTURES[device], "cpu" if device == "cpu" else "cuda:0")
        runs = {key: case.run(*key) for key in candidates}
        for key, run in runs.items():
            errors[key].append(case.errors(run))
        seconds = least_seconds(runs.values())
        ratios.append(seconds / seconds[0])
    costs = np.exp(np.mean(np.log(ratios), axis=0))
    middle, most = (
        {key: float(np.quantile(np.concatenate(found), share, method="higher")) for key, found in errors.items()}
        for share in (0.5, 0.95)
    )
    base = (FALLBACK, 1)
    return [
        {
            "law": law,
            "method": key[0],
            "steps": key[1],
            "median_error": f"{middle[key] / middle[base]:.2f}",
            "error_95": f"{most[key] / most[base]:.2f}",
            f"cost_{device}": f"{costs[candidates.index(key)]:.2f}",
        }
        for key in CANDIDATES
    ]


def write_table(rows: list[dict[str, object]], device: str) -> None:
    """Write the table, with the costs on other devices as they stand in it; errors are those of the last run."""
    known = {(row.law, row.method, row.steps): row.costs for row in measured_methods()}
    text = io.StringIO()
    names = ["law", "method", "steps", "median_error", "error_95", *(f"cost_{name}" for name in DEVICES)]
    writer = csv.DictWriter(text, names, lineterminator="\n")
    writer.writeheader()
    for row in rows:
        before = known.get((row["law"], row["method"], row["steps"]), {})  # type: ignore[arg-type]
        writer.writerow({f"cost_{name}": cost for name, cost in before.items() if name != device} | row)
    (ROOT / "data" / TABLE).write_text(HEAD + text.getvalue(), encoding="utf-8")


def search(number: int, device: str) -> tuple[str, float, float]:
    """Return a random scene in words, its default's cost over the best found, and its error over RK4's."""
    random = np.random.default_rng([17, number])
    law = str(random.choice(list(LAWS)))
    storeys = int(random.choice([1, 5]))
    period = float(np.exp(random.uniform(np.log(0.2), np.log(3.0))))
    motions = [records()[i] for i in random.choice(len(records()), 4, replace=False)]
    levels = tuple(np.sort(np.exp(random.uniform(np.log(0.5), np.log(6.0), 2))))
    recorders = ("drift",) if storeys > 1 or random.random() < 0.5 else ("acceleration", "drift", "residual")
    scene = build_scene(law, storeys, period, motions, levels, recorders)
    case = Case(scene, STRUCTURES[device], "cpu" if device == "cpu" else "cuda:0")
    default = default_method(law, scene.structure.damping, is_gpu=device != "cpu")
    chosen = case.run(default.method, default.steps)

    def error_of(run: object) -> float:
        return float(np.quantile(case.errors(run), 0.95, method="higher"))  # type: ignore[arg-type]

    given, today = error_of(chosen), error_of(case.run(FALLBACK, 1))
    names = [name for name in SEARCHED if name in fitting_methods(law, scene.structure.damping)]
    within = [run for name in names for steps in SEARCHED_STEPS if error_of(run := case.run(name, steps)) <= given]
    seconds = least_seconds([chosen, *within])
    words = f"{law} {storeys} storeys {period:.2f} s {'+'.join(recorders)}: {default.method}"
    return words, float(seconds[0] / seconds.min()), given / today


def main() -> None:
    """Run the study."""
    parser = argparse.ArgumentParser(description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter)
    parser.add_argument("--device", help="cpu or cuda:0 [the first GPU, or the CPU]")
    parser.add_argument(
        "--scenes", type=int, default=0, help="number of random scenes; 0 writes the table [%(default)s]"
    )
    arguments = parser.parse_args()
    device = "cpu" if checked_devices(arguments.device)[0] == "cpu" else "cuda"
    if not arguments.scenes:
        rows = []
        for law in LAWS:
            rows += measure(law, device)
            print(*rows[-1].values(), flush=True)
        write_table(rows, device)
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
