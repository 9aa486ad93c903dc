"""Provenance of the results of these scripts: versions, kind of machine, and date."""

from __future__ import annotations

import csv
import json
import os
import platform
from collections.abc import Iterable, Sequence
from datetime import UTC, datetime
from importlib.metadata import version
from pathlib import Path

FOLDER = Path(__file__).parents[1]
RESULTS, FIGURES = FOLDER / "results", FOLDER / "figures"


def provenance(*packages: str, **others: str) -> dict[str, str]:
    """Return versions of packages and other tools, the kind of machine and the date.

    Args:
        *packages: Distributions whose versions are added to those of warpdyn, Warp and NumPy.
        **others: Versions of tools that are not installed as packages.
    """
    named = ("warpdyn", "warp-lang", "numpy", *packages)
    return {
        "date": datetime.now(UTC).date().isoformat(),
        "machine": f"{_processor()}, {os.cpu_count()} cores, {platform.system()}",
        "python": platform.python_version(),
        **{name: version(name) for name in named},
        **others,
    }


def _processor() -> str:
    """Return the model of the processor, or its architecture if the model is not known."""
    file = Path("/proc/cpuinfo")
    lines = file.read_text(encoding="utf-8").splitlines() if file.exists() else []
    return next((line.partition(":")[2].strip() for line in lines if line.startswith("model name")), platform.machine())


def write_json(name: str, values: dict) -> None:
    """Write results/NAME.json."""
    RESULTS.mkdir(exist_ok=True)
    (RESULTS / f"{name}.json").write_text(json.dumps(values, indent=1) + "\n", encoding="utf-8")


def write_csv(name: str, header: Sequence[str], rows: Iterable[Sequence[object]]) -> None:
    """Write results/NAME.csv."""
    RESULTS.mkdir(exist_ok=True)
    with (RESULTS / f"{name}.csv").open("w", encoding="utf-8", newline="") as file:
        csv.writer(file, lineterminator="\n").writerows([header, *rows])
