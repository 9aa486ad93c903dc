"""The report of a region, and its file in the checkpoint of a run."""

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
    """Results of a region.

    Args:
        structures: Its first structure, and the one after its last.
        findings: Findings of each event, from `state_of`.
        errors: Results of the error estimates of each event, part by part, by demand.
        outcomes: Outcomes of the samples whose histories are kept, from `outcomes_of`.
        longest_period: The longest first period [s].
        seconds: Time of sampling, of integrating and in kernels [s].
        messages: Warnings.
        chunks: Digests of the files of its samples in a Zarr store, from `write_region`.
        statistics: Its contribution to the statistics, from `Reduction.partial`.
        rows: Values of the samples by name, unless they are in a store, reduced, or already in the run's memory.
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
        """Write the report to a temporary file, which is renamed when it is complete.

        Two workers may write it at the same time, if the scheduler believes that one of them is dead: each writes to a
        temporary file.
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
        """Return the report of a file, without its rows; None if it is missing or damaged: the region is run again."""
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
    """A variable of the samples of a run, in the files of its regions.

    Args:
        name: The variable.
        files: The files.
        first: First sample of each file.
        path: The file of the run, for messages.
    """

    def __init__(self, name: str, files: list[Path], first: list[int], path: Path) -> None:
        self.name, self.files, self.first, self.path = name, files, first, path

    def __getitem__(self, part: slice) -> np.ndarray:
        """Return the values of a range of samples, sample first."""
        begin, end = np.searchsorted(self.first, [part.start, part.stop - 1], side="right")
        found = []
        for place in range(begin - 1, end):
            first = self.first[place]
            found.append(rows_in(self.files[place], [self.name], self.path)[self.name][max(0, part.start - first) :])
        whole = found[0] if len(found) == 1 else np.concatenate(found)
        return whole[: part.stop - part.start]


def rows_in(file: Path, names: Iterable[str], path: Path) -> Arrays:
    """Return variables of the samples of a region.

    Args:
        file: The file of the region.
        names: The variables.
        path: The file of the run, for messages.

    Raises:
        OSError: If the file was damaged after the run found it to be whole.
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
    """Return the findings of some samples, in types that JSON can represent."""
    held = {name: value for name, value in vars(findings).items() if name not in OF_THE_RUN}
    return held | {"failed": {str(code): count for code, count in findings.failed.items()}}


def merged(empty: StabilityFindings, states: Iterable[dict[str, Any]]) -> StabilityFindings:
    """Return the findings of a run from those of its regions, in the order of their samples."""
    found = empty.of_no_samples()
    for state in states:
        region = empty.of_no_samples()
        vars(region).update(state | {"failed": {int(code): count for code, count in state["failed"].items()}})
        found.include(region)
    return found
