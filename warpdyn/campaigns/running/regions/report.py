"""What a region tells of its run besides its samples, in a file that says that the region is done."""

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
from warpdyn.campaigns.running.regions.rerun_budget import Decisions
from warpdyn.foundations.files.checksums import load_arrays, save_arrays

OF_THE_RUN = ("samples", "method", "event")


@dataclass(kw_only=True)
class Report:
    """What a region tells.

    Args:
        structures: Its first structure, and the one after its last.
        histories: Number of histories, over all events.
        findings: What `state_of` returns of the findings of each event.
        decisions: Which failed samples were run again, for each event, and then for the error estimates of each.
        errors: What the error estimates of each event found, part by part, by demand.
        outcomes: What `outcomes_of` returns of the samples whose histories are kept.
        longest_period: The longest first period [s].
        seconds: Time of sampling, integrating and in kernels [s].
        messages: Warnings.
        chunks: What `write_region` returned, where samples are written to a Zarr store: digests of their files.
        statistics: What `Reduction.partial` returns of the region, where samples are reduced to statistics.
        rows: Values of the samples by name, where they are neither in a store nor reduced.
    """

    structures: tuple[int, int]
    histories: int
    findings: list[dict[str, Any]]
    decisions: list[list[Decisions]]
    errors: list[list[Arrays]]
    outcomes: tuple[np.ndarray, ...]
    longest_period: float
    seconds: dict[str, float]
    messages: list[str]
    chunks: dict[str, str] = field(default_factory=dict)
    statistics: Arrays = field(default_factory=dict)
    rows: Arrays = field(default_factory=dict)

    def save(self, path: Path) -> None:
        """Write all but the rows to a file, which appears whole."""
        plain = {name: getattr(self, name) for name in PLAIN}
        counts = {"decisions": [len(each) for each in self.decisions], "errors": [len(each) for each in self.errors]}
        arrays: Arrays = {f"outcomes/{place}": values for place, values in enumerate(self.outcomes)}
        arrays |= {f"statistics/{name}": values for name, values in self.statistics.items()}
        for slot, made in enumerate(self.decisions):
            for place, one in enumerate(made):
                arrays |= {f"decisions/{slot}/{place}/{name}": values for name, values in one.arrays.items()}
        for slot, found in enumerate(self.errors):
            for place, errors in enumerate(found):
                arrays |= {f"errors/{slot}/{place}/{name}": values for name, values in errors.items()}
        # Two workers may write it at a time, one of which the scheduler takes for dead: each writes a file of its own.
        save_arrays(path, {"header": json.dumps(plain | counts)} | arrays)

    @classmethod
    def load(cls, path: Path) -> Report | None:
        """Return the report of a file; None if it is missing or damaged, so that the region is run again."""
        kept = load_arrays(path)
        if kept is None:
            return None
        with suppress(KeyError, ValueError, IndexError):
            header = json.loads(str(kept["header"]))
            parts: dict[str, list[list[Arrays]]] = {
                kind: [[{} for _ in range(count)] for count in header[kind]] for kind in ("decisions", "errors")
            }
            outcomes, statistics = {}, {}
            for name, values in kept.items():
                kind, *rest = name.split("/")
                if kind == "outcomes":
                    outcomes[int(rest[0])] = values
                elif kind == "statistics":
                    statistics["/".join(rest)] = values
                elif kind in parts:
                    parts[kind][int(rest[0])][int(rest[1])][rest[2]] = values
            plain = {name: header[name] for name in PLAIN}
            plain["structures"] = tuple(plain["structures"])
            decisions = [[Decisions.of_arrays(one) for one in made] for made in parts["decisions"]]
            taken = tuple(outcomes[place] for place in range(len(outcomes)))
            errors = parts["errors"]
            return cls(decisions=decisions, errors=errors, outcomes=taken, statistics=statistics, **plain)
        return None


PLAIN = ("structures", "histories", "findings", "longest_period", "seconds", "messages", "chunks")


def state_of(findings: StabilityFindings) -> dict[str, Any]:
    """Return what findings hold of some samples, as JSON can."""
    held = {name: value for name, value in vars(findings).items() if name not in OF_THE_RUN}
    return held | {"failed": {str(code): count for code, count in findings.failed.items()}}


def include(findings: StabilityFindings, states: Iterable[dict[str, Any]]) -> None:
    """Add what regions found, in the order of their samples, to the findings of the run."""
    for state in states:
        region = findings.of_no_samples()
        vars(region).update(state | {"failed": {int(code): count for code, count in state["failed"].items()}})
        findings.include(region)
