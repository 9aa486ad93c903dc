"""Report of a region (results of a range of structures), and its file in the checkpoint of a run."""

from __future__ import annotations

import json
from collections.abc import Iterable
from contextlib import suppress
from dataclasses import dataclass, field
from pathlib import Path
from typing import Any

import numpy as np

from warpdyn.campaigns.integration.dynamics import Arrays
from warpdyn.campaigns.integration.stability_guard import StabilityFindings
from warpdyn.foundations.files.checksums import load_arrays, save_arrays

OF_THE_RUN = ("samples", "method", "event")


@dataclass(kw_only=True)
class Report:
    """Results of a region, a range of structures that one process has integrated.

    Args:
        structures: Number of the region's first structure, and number of its last structure plus 1.
        findings: Findings on the stability of the samples, for each event, from `state_of`.
        errors: For each event, the results of its error estimate: a list of parts, each with arrays by demand.
        outcomes: Outcomes of the samples whose whole histories are returned, from `outcomes_of`.
        longest_period: Longest first period of the structures [s].
        seconds: Time spent for "sampling", for "integrating" and "in_kernels" [s].
        messages: Warnings.
        chunks: Digests of the files in a Zarr store that contain the samples, from `write_region`.
        statistics: Contribution of the region to the statistics of the run, from `Reduction.partial`.
        rows: Values of the samples by variable name, shape [sample, ...]. Empty if the samples are in a store, were
            reduced to statistics, or are already in the memory of the run.
    """

    structures: tuple[int, int]
    findings: list[dict[str, Any]]
    errors: list[list[Arrays]]
    outcomes: tuple[np.ndarray, ...]
    longest_period: float
    seconds: dict[str, float]
    messages: list[str] = field(default_factory=list)
    chunks: dict[str, str] = field(default_factory=dict)
    statistics: Arrays = field(default_factory=dict)
    rows: Arrays = field(default_factory=dict)

    def save(self, path: Path) -> None:
        """Write the report to a temporary file, and rename it to `path` when it is complete.

        If the scheduler of a cluster believes that a worker is dead, a second worker may write the same report at the
        same time. Each worker therefore writes to a separate temporary file.
        """
        plain = {name: getattr(self, name) for name in PLAIN} | {"errors": [len(each) for each in self.errors]}
        arrays: Arrays = {f"outcomes/{place}": values for place, values in enumerate(self.outcomes)}
        arrays |= {f"statistics/{name}": values for name, values in self.statistics.items()}
        arrays |= {f"rows/{name}": values for name, values in self.rows.items()}
        for event, found in enumerate(self.errors):
            for place, errors in enumerate(found):
                arrays |= {f"errors/{event}/{place}/{name}": values for name, values in errors.items()}
        save_arrays(path, {"header": json.dumps(plain)} | arrays)

    @classmethod
    def load(cls, path: Path) -> Report | None:
        """Read a report, except its samples, from a file; return None if the file is missing or damaged."""
        kept = load_arrays(path, without="rows/")
        if kept is None:
            return None
        with suppress(KeyError, ValueError, IndexError):
            header = json.loads(str(kept["header"]))
            errors: list[list[Arrays]] = [[{} for _ in range(count)] for count in header["errors"]]
            outcomes, statistics = {}, {}
            for name, values in kept.items():
                kind, *rest = name.split("/")
                if kind == "outcomes":
                    outcomes[int(rest[0])] = values
                elif kind == "statistics":
                    statistics["/".join(rest)] = values
                elif kind == "errors":
                    errors[int(rest[0])][int(rest[1])][rest[2]] = values
            plain = {name: header[name] for name in PLAIN}
            plain["structures"] = tuple(plain["structures"])
            taken = tuple(outcomes[place] for place in range(len(outcomes)))
            return cls(errors=errors, outcomes=taken, statistics=statistics, **plain)
        return None


PLAIN = ("structures", "findings", "longest_period", "seconds", "messages", "chunks")


class RowsOfRegions:
    """One variable of the samples of a run, read from the files of the run's regions.

    Args:
        name: Name of the variable.
        files: File of each region.
        first: Number of the first sample in each file.
        path: File that the run writes, for error messages.
    """

    def __init__(self, name: str, files: list[Path], first: list[int], path: Path) -> None:
        self.name, self.files, self.first, self.path = name, files, first, path

    def __getitem__(self, part: slice) -> np.ndarray:
        """Return the values of a range of samples, given as slice(start, stop), shape [sample, ...]."""
        begin, end = np.searchsorted(self.first, [part.start, part.stop - 1], side="right")
        found = []
        for place in range(begin - 1, end):
            first = self.first[place]
            found.append(rows_in(self.files[place], [self.name], self.path)[self.name][max(0, part.start - first) :])
        whole = found[0] if len(found) == 1 else np.concatenate(found)
        return whole[: part.stop - part.start]


def rows_in(file: Path, names: Iterable[str], path: Path) -> Arrays:
    """Read variables of the samples of one region from its file, and return them by name, shape [sample, ...].

    Args:
        file: File of the region.
        names: Names of the variables.
        path: File that the run writes, for error messages.

    Raises:
        OSError: If the file is damaged, although it was complete when the run checked it.
    """
    try:
        with np.load(file) as kept:
            return {name: kept[f"rows/{name}"] for name in names}
    except Exception as error:  # a damaged file may raise any error
        raise OSError(
            f"{file} was damaged while the run of {path} read it: make the same call again, which runs the structures "
            "of this file again"
        ) from error


def state_of(findings: StabilityFindings) -> dict[str, Any]:
    """Return findings on the stability of samples as a dictionary of types that JSON can represent."""
    held = {name: value for name, value in vars(findings).items() if name not in OF_THE_RUN}
    return held | {"failed": {str(code): count for code, count in findings.failed.items()}}


def merged(empty: StabilityFindings, states: Iterable[dict[str, Any]]) -> StabilityFindings:
    """Return the findings of a run, merged from the findings of its regions.

    Args:
        empty: Findings of no samples, of the same run.
        states: Findings of each region, from `state_of`, in the order of their samples.
    """
    found = empty.of_no_samples()
    for state in states:
        region = empty.of_no_samples()
        vars(region).update(state | {"failed": {int(code): count for code, count in state["failed"].items()}})
        found.include(region)
    return found
