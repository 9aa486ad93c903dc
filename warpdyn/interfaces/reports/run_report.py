"""Writer of the report of a run, as one HTML file."""

from __future__ import annotations

import datetime
import json
import os
from pathlib import Path

import xarray as xr

from warpdyn.campaigns.running.selections import select_event
from warpdyn.foundations.core.checks import check_dataset
from warpdyn.foundations.files.netcdf import trace
from warpdyn.interfaces.exchange.text_files import check_same_format, checked_path, write_text
from warpdyn.interfaces.reports import markup
from warpdyn.interfaces.reports.curves import fragility, statistics
from warpdyn.interfaces.reports.demands import demands
from warpdyn.interfaces.reports.outcome import outcome
from warpdyn.interfaces.reports.provenance import accuracy, provenance, scene_parts

ADVICE = "pass the result of simulate(), alone or merged with fragility(), or read from its file"

WRITTEN = '<meta name="generator" content="warpdyn '  # text in page.html that identifies a report of warpdyn


def report(dataset: xr.Dataset, path: str | os.PathLike, *, title: str | None = None, overwrite: bool = False) -> Path:
    """Write a report of a run as one HTML file: scene, outcome, demands, fragility curves, accuracy and provenance.

    The file contains its figures, loads no other file and can be printed on A4. Remarks describe limitations of the
    results: failed or sensitive samples, energies that do not balance, and fragility curves without a regular fit. A
    report on a sequence of events has one section per event on the outcome and the demands. A report on a run without
    single samples (`simulate(scene, statistics=...)`) has a section on the statistics instead.

    Args:
        dataset: Result of `simulate`, alone or merged with the result of `fragility`, or a dataset that was read from
            the file of such a result.
        path: Path of the file that is written; its name ends in ".html" or ".htm".
        title: Title of the page; None: the title of the dataset.
        overwrite: If True, replace an existing file of any content. If False, replace only a report that warpdyn wrote.

    Returns:
        Path of the written file.

    Raises:
        ValueError: If the dataset is not the result of `simulate` or has no samples, if the name has another ending, or
            if the title is empty.
        TypeError: If `dataset` is not a Dataset, or `path` or `title` has another type.
        OSError: If the file cannot be written, or exists with other content and `overwrite` is False.

    Example:
        >>> both = run.merge(curves, combine_attrs="no_conflicts")
        >>> wd.report(both, "building.html", title="Three-storey building").name
        'building.html'
    """
    path = checked_path("report", path, ".html", ".htm")
    check_same_format("report", path, WRITTEN, "a report of warpdyn", overwrite)
    check_dataset("report", dataset, "scene", "seed", "method", "source", advice=ADVICE)
    if title is not None and not isinstance(title, str):
        raise TypeError(f"report: title must be text, got {title!r}: give title='...' or remove it")
    if title is not None and not title.strip():
        raise ValueError("report: title must not be empty: give title='...', or remove it to use the title of the run")
    has_samples = "sample" in dataset.dims
    if has_samples:
        check_dataset("report", dataset, "status", "integration_step", advice=ADVICE)
        if not dataset.sizes["sample"]:
            raise ValueError("report: the run has no samples: check the condition by which you selected samples")
    elif "status" in dataset:
        raise ValueError("report: the run has no dimension sample: select a single sample by isel(sample=[number])")
    scene = json.loads(str(dataset.attrs["scene"]))
    name = title or str(dataset.attrs.get("title", "warpdyn ensemble"))
    written = f"{datetime.datetime.now(datetime.UTC):%Y-%m-%d %H:%M} UTC"
    body = [
        markup.heading(name, 1),
        markup.paragraph(f"{_size(dataset)} Written by warpdyn.report on {written}."),
        *scene_parts(scene),
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
    """Return a sentence with the numbers of samples, structures, motions and intensity levels of a run."""
    if "sample" not in dataset.dims:
        return "A run with statistics instead of samples."
    parts = [f"{dataset.sizes['sample']:,} samples"]
    words = {"structure": "structures", "motion_index": "motions"}
    for name, plural in words.items():
        if name in dataset and dataset[name].dims == ("sample",):
            parts.append(f"{len(set(dataset[name].values.tolist())):,} {plural}")
    if dataset.sizes.get("stripe"):
        parts.append(f"{dataset.sizes['stripe']:,} levels")
    return f"{parts[0]}{' of ' if parts[1:] else ''}{', '.join(parts[1:])}."
