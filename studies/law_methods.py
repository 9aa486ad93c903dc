"""Errors and times of integration methods for every storey law: tables for the pages on laws and methods.

    python studies/law_methods.py --out docs/reference/laws

Each building has five storeys of the same law and a first period of 0.6 s. It is analysed under the strong parts of
eight far-field records, scaled to one, two and four times the intensity at which it yields. All methods have the same
step, the default step of RK4. The error of a sample is the largest error of its peak storey drifts, divided by its
largest peak drift. The reference for errors is RK4 in float64 at a sixteenth of the step. Bilinear storeys are analysed
with every method that has a given step, other laws with five methods.

The time of a method is the shortest processor time of several runs. Runs of bilinear storeys with RK4 alternate with
the runs of the method, so that changes of the speed of the machine affect both. The study writes measured.csv.
"""

from __future__ import annotations

import argparse
import csv
import datetime
import io
from importlib.metadata import version
from pathlib import Path

import numpy as np
from parts.benchmark.machine import processor
from parts.default_methods.ensembles import Case, build_scene, records, seconds_of
from peers.storey_laws import LAWS

from warpdyn import laws
from warpdyn.engine.methods.table import METHODS, fitting_methods

YARDSTICK = "bilinear"  # law whose time with RK4 is the unit of all times
SHOWN = ("rk4", "velocity_verlet", "heun", "central_difference", "newmark_average")  # methods for other laws
STOREYS, PERIOD, LEVELS = 5, 0.6, (1.0, 2.0, 4.0)  # period in s; levels are multiples of the intensity at yield
RECORDS = (0, 5, 12, 14, 20, 28, 33, 40)  # indices in the far-field set; the records have steps of 5, 10 and 20 ms
TIMED_RUNS = 5  # number of timed runs; the shortest counts
COLUMNS = ("law", "method", "median_error", "error_95", "time_over_bilinear_rk4")


def case_of(law: str, structures: int) -> Case:
    """Return the ensemble of buildings with a storey law, for a number of structures."""
    return Case(build_scene(law, STOREYS, PERIOD, [records()[i] for i in RECORDS], LEVELS), structures, "cpu")


def measure(law: str, structures: int, yardstick: object) -> list[dict[str, str]]:
    """Return one row per method for a law: errors of the peak drift, and time relative to bilinear storeys with RK4."""
    case = case_of(law, structures)
    tried = [name for name in METHODS if not METHODS[name].is_adaptive and (law == YARDSTICK or name in SHOWN)]
    methods = [name for name in tried if name in fitting_methods(laws.LAWS[law].forces, "rayleigh")]
    runs = [case.run(name, 1) for name in methods]
    errors = [case.errors(run) for run in runs]
    seconds = np.min([[seconds_of(run) for run in (yardstick, *runs)] for _ in range(TIMED_RUNS)], axis=0)
    return [
        {
            "law": law,
            "method": name,
            "median_error": f"{np.quantile(error, 0.5):.2e}",
            "error_95": f"{np.quantile(error, 0.95):.2e}",
            "time_over_bilinear_rk4": f"{took / seconds[0]:.2f}",
        }
        for name, error, took in zip(methods, errors, seconds[1:], strict=True)
    ]


def main() -> None:
    """Run the study from the command line, and write measured.csv."""
    parser = argparse.ArgumentParser(description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter)
    parser.add_argument("--out", type=Path, default=Path("results"), help="folder for the results [%(default)s]")
    parser.add_argument("--structures", type=int, default=22, help="structures under each motion [%(default)s]")
    arguments = parser.parse_args()
    arguments.out.mkdir(parents=True, exist_ok=True)
    yardstick = case_of(YARDSTICK, arguments.structures).run("rk4", 1)
    rows = []
    for law in LAWS:
        rows += measure(law, arguments.structures, yardstick)
        print(*(tuple(row.values()) for row in rows[-len(SHOWN) :]), sep="\n", flush=True)
    text = io.StringIO()
    text.write(f"# warpdyn {version('warpdyn')}, {processor()}, one of them used, {datetime.date.today():%Y-%m-%d}\n")
    text.write("# Written by studies/law_methods.py; its docstring describes the measurement.\n")
    writer = csv.DictWriter(text, COLUMNS, lineterminator="\n")
    writer.writeheader()
    writer.writerows(rows)
    (arguments.out / "measured.csv").write_text(text.getvalue(), encoding="utf-8")


if __name__ == "__main__":
    main()
