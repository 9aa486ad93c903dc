"""Measure the run time and the peak drifts of a peer (another program that solves the same problems as warpdyn).

Usage, in the folder `studies`: python -m peers peers.PEER CPUS FOLDER.

The program reads every case-N.npz in the folder and writes measured-N.npz to it, with time [s], peak drifts [m] and a
note, or the reason of a failure. The process uses its first CPUS processors (0: all of them), except for compiling.
"""

from __future__ import annotations

import contextlib
import importlib
import os
import sys
from pathlib import Path

import numpy as np

from peers.case import Case, Missing


def main(peer: str, cpus: int, folder: Path) -> None:
    """Measure run time and peak drifts of a peer for all cases in a folder, and write one result file per case."""
    cases = {path.name.replace("case", "measured"): Case.read(path) for path in sorted(folder.glob("case-*.npz"))}
    with contextlib.suppress(Exception):  # `measure` raises the error again for each case
        importlib.import_module(peer).prepare(list(cases.values()))
    if cpus:
        os.sched_setaffinity(0, sorted(os.sched_getaffinity(0))[:cpus])
    for name, case in cases.items():
        found = {"seconds": np.nan, "peaks": np.zeros((0, case.storeys)), "note": "", "status": "measured"}
        try:
            measured = importlib.import_module(peer).measure(case)
            found |= {"seconds": measured.seconds, "peaks": measured.peak_storey_drift, "note": measured.note}
        except (ImportError, Missing) as error:
            found |= {"status": "missing", "note": in_one_line(str(error))}
        except Exception as error:  # measure the other cases after any error
            found |= {"status": "failed", "note": in_one_line(f"{type(error).__name__}: {error}")}
        temporary = folder / f".{name}"
        np.savez(temporary, **found)
        temporary.rename(folder / name)


def in_one_line(text: str) -> str:
    """Return a message with spaces instead of line breaks."""
    return " ".join(text.split())


if __name__ == "__main__":
    main(sys.argv[1], int(sys.argv[2]), Path(sys.argv[3]))
