"""Table of the summary of checks (docs/verification/checks.md): errors that tests measure with independent references.

    python studies/validation.py --out docs/verification

The study runs the tests that use the fixture `measured` (tests/validation.py) on this machine, and writes measured.csv.
This file has one row per claim (statement on accuracy), with the reference, the largest error of all cases, the bound
of the error, and the test. The tables of the documentation are generated from this file, and the tests compare their
claims and bounds with it.
"""

from __future__ import annotations

import argparse
import csv
import datetime
import io
import json
import subprocess
import sys
import tempfile
from importlib.metadata import version
from pathlib import Path

from parts.benchmark.machine import processor

ROOT = Path(__file__).parents[1]
COLUMNS = ("claim", "truth", "value", "bound", "units", "cases", "test")


def rows_of(lines: list[str]) -> list[dict[str, object]]:
    """Return one table row per claim of accuracy, with the largest error of its cases, from the lines that tests print.

    Raises:
        ValueError: If two cases of a claim differ in reference, bound, units or test.
    """
    found: dict[str, list[dict[str, object]]] = {}
    for line in lines:
        row = json.loads(line)
        found.setdefault(row["claim"], []).append(row | {"bound": f"{row['bound']:.6g}"})
    rows = []
    for claim, cases in found.items():
        if len({tuple(case[key] for key in ("truth", "bound", "units", "test")) for case in cases}) > 1:
            raise ValueError(f"cases of {claim!r} differ in reference, bound, units or test: use different claims")
        rows.append(cases[0] | {"value": f"{max(case['value'] for case in cases):.2e}", "cases": len(cases)})
    return sorted(rows, key=lambda row: (row["test"], row["claim"]))


def main() -> None:
    """Run the study from the command line."""
    parser = argparse.ArgumentParser(description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter)
    parser.add_argument("--out", type=Path, default=Path("results"), help="folder for the results [%(default)s]")
    arguments = parser.parse_args()
    arguments.out.mkdir(parents=True, exist_ok=True)
    with tempfile.TemporaryDirectory() as folder:
        target = Path(folder) / "lines"
        done = subprocess.run([sys.executable, "-m", "pytest", "--validation", str(target)], cwd=ROOT, check=False)
        if done.returncode:
            raise SystemExit(
                "a claim does not hold, or a test failed (see above), so that no table was written: correct it, or the "
                "bound of the claim"
            )
        rows = rows_of(target.read_text(encoding="utf-8").splitlines())
    text = io.StringIO()
    text.write(f"# warpdyn {version('warpdyn')}, {processor()}, {datetime.date.today():%Y-%m-%d}\n")
    text.write("# Written by studies/validation.py.\n")
    writer = csv.DictWriter(text, COLUMNS, extrasaction="ignore", lineterminator="\n")
    writer.writeheader()
    writer.writerows(rows)
    (arguments.out / "measured.csv").write_text(text.getvalue(), encoding="utf-8")
    print(f"{len(rows)} claims of {len({row['test'] for row in rows})} tests")


if __name__ == "__main__":
    main()
