"""A page about a run, for an engineer's file."""

from __future__ import annotations

import datetime
import json
import os
from pathlib import Path

import xarray as xr

from warpdyn.campaigns.running.selections import select_event
from warpdyn.foundations.core.checks import check_dataset
from warpdyn.foundations.files.netcdf import trace
from warpdyn.interfaces.exchange.text_files import checked_path, write_text
from warpdyn.interfaces.reports import markup
from warpdyn.interfaces.reports.curves import fragility, statistics
from warpdyn.interfaces.reports.demands import demands
from warpdyn.interfaces.reports.outcome import outcome
from warpdyn.interfaces.reports.provenance import accuracy, provenance, what_was_run

ADVICE = "give report() what simulate() returned, alone or merged with its fragility, or read from its file"


def report(dataset: xr.Dataset, path: str | os.PathLike, *, title: str | None = None) -> Path:
    """Write a page about a run: what was run, its outcome, demands, fragility curves, accuracy and provenance.

    The page is one HTML file that needs no other: figures are inlined, and nothing is loaded from elsewhere. It prints
    on A4. Remarks name what limits the results: failed or sensitive samples, energies that do not balance, curves that
    are no plain fits. Of a sequence of events every event has its outcome and demands; a run that keeps no samples
    (`simulate(scene, statistics=...)`) has its statistics in their place.

    Args:
        dataset: What `simulate` returned, alone or merged with what `fragility` returned, or read from its file.
        path: The file, whose name ends in ".html" or ".htm"; an older one is replaced.
        title: Title of the page; None takes the dataset's own.

    Returns:
        The path.

    Raises:
        ValueError: If the dataset is no run or has no samples left, the file's name has another ending, or the title is
            empty.
        TypeError: If `dataset` is no Dataset, or `path` or `title` is of another kind.
        OSError: If the file cannot be written.

    Example:
        >>> both = run.merge(curves, combine_attrs="no_conflicts")
        >>> wd.report(both, "building.html", title="Three-storey building").name
        'building.html'
    """
    path = checked_path("report", path, ".html", ".htm")
    check_dataset("report", dataset, "scene", "seed", "method", "source", advice=ADVICE)
    if title is not None and not isinstance(title, str):
        raise TypeError(f"report: title must be text, got {title!r}")
    if title is not None and not title.strip():
        raise ValueError("report: title must not be empty")
    has_samples = "sample" in dataset.dims
    if has_samples:
        check_dataset("report", dataset, "status", "integration_step", advice=ADVICE)
        if not dataset.sizes["sample"]:
            raise ValueError("report: the run has no samples: the selection it was taken by left none")
    elif "status" in dataset:
        raise ValueError("report: the run has no dimension sample: select one by isel(sample=[number])")
    scene = json.loads(str(dataset.attrs["scene"]))
    name = title or str(dataset.attrs.get("title", "warpdyn ensemble"))
    written = f"{datetime.datetime.now(datetime.UTC):%Y-%m-%d %H:%M} UTC"
    body = [
        markup.heading(name, 1),
        markup.paragraph(f"{_size(dataset)} Written by warpdyn.report on {written}."),
        *what_was_run(scene),
    ]
    if not has_samples:
        body += statistics(dataset)
    elif "event" in dataset.dims:
        for event in dataset["event"].values.tolist():
            one = select_event(dataset, event)
            body += [markup.heading(f"Event: {event}"), *outcome(one), *demands(one), *accuracy(one)]
    else:
        body += [*outcome(dataset), *demands(dataset)]
    body += fragility(dataset)
    if has_samples and "event" not in dataset.dims:
        body += accuracy(dataset)
    return write_text(path, markup.page(name, trace(name, "report")["source"], [*body, *provenance(dataset)]))


def _size(dataset: xr.Dataset) -> str:
    """Return how many samples a run has, of how many structures under how many motions and levels."""
    if "sample" not in dataset.dims:
        return "A run that kept statistics, and no samples."
    parts = [f"{dataset.sizes['sample']:,} samples"]
    words = {"structure": "structures", "motion_index": "motions"}
    for name, what in words.items():
        if name in dataset and dataset[name].dims == ("sample",):
            parts.append(f"{len(set(dataset[name].values.tolist())):,} {what}")
    if dataset.sizes.get("stripe"):
        parts.append(f"{dataset.sizes['stripe']:,} levels")
    return f"{parts[0]}{' of ' if parts[1:] else ''}{', '.join(parts[1:])}."
