"""Sections of a report on fragility curves, and on the statistics of a run without single samples."""

from __future__ import annotations

from collections.abc import Sequence

import numpy as np
import xarray as xr

from warpdyn.foundations.core.output_variables import MEDIAN_MEANINGS, MEDIAN_STATUS
from warpdyn.interfaces.plots.fragility import fragility_curves
from warpdyn.interfaces.plots.samples import label_of_measure
from warpdyn.interfaces.reports.markup import Part, figure, heading, paragraph, table

MOST_VARIABLES = 80  # largest number of variables in the table of statistics


def fragility(dataset: xr.Dataset) -> list[Part]:
    """Return the section of a report on fragility curves; an empty list if the dataset has no curves.

    Args:
        dataset: Result of `simulate`, merged with the result of `fragility` if there are curves.
    """
    if "fragility_median" not in dataset or dataset["fragility_median"].dims != ("damage_state",):
        return []
    columns: list[tuple[str, Sequence[object]]] = [
        ("damage state", [str(state) for state in dataset["damage_state"].values])
    ]
    names = {"damage_limit": "limit"}
    for name, words in (("fragility_median", "median"), ("fragility_dispersion", "dispersion")):
        names |= {name: words, f"{name}_lower": "lower", f"{name}_upper": "upper"}
    for name, words in names.items():
        if name in dataset and dataset[name].dims == ("damage_state",):
            columns.append((words, dataset[name].values.astype(float).tolist()))
    if MEDIAN_STATUS in dataset:
        codes = dataset[MEDIAN_STATUS].values
        columns.append(("median is", [MEDIAN_MEANINGS[int(code)].replace("_", " ") for code in codes]))
    confidence = dataset.attrs.get("confidence")
    limits = f", with {float(confidence):.0%} intervals" if confidence is not None else ""
    measure = label_of_measure(dataset)
    demand = dataset.attrs.get("demand", "several demands")
    return [
        heading("Fragility"),
        paragraph(f"Intensity measure of the medians: {measure}. Demand of the limits: {demand}."),
        table(
            f"Fragility curves{limits}",
            [head for head, _ in columns],
            list(zip(*(values for _, values in columns), strict=True)),
        ),
        figure(fragility_curves(dataset), "Fragility curves, exceedance fractions of the stripes, and intervals."),
    ]


def statistics(dataset: xr.Dataset) -> list[Part]:
    """Return the section of a report on a run with `statistics=`: the range of every statistical variable.

    Args:
        dataset: Result of `simulate(scene, statistics=...)`.
    """
    rows: list[tuple[object, ...]] = []
    for name, variable in dataset.data_vars.items():
        if variable.dtype.kind not in "iuf" or not variable.size:
            continue
        finite = variable.values[np.isfinite(variable.values)].astype(np.float64)
        bounds = (float(finite.min()), float(finite.max())) if finite.size else (np.nan, np.nan)
        total = float(finite.sum()) if variable.dtype.kind in "iu" else np.nan  # a sum only for counts
        words = f"{variable.attrs.get('long_name', name)} [{variable.attrs.get('units', '1')}]"
        along = ", ".join(f"{dim} ({size:,})" for dim, size in variable.sizes.items()) or "one value"
        rows.append((words, along, *bounds, total))
    heads = ("statistic", "along", "smallest", "largest", "sum of counts")
    return [
        heading("Statistics"),
        table("Statistics counted during the run", heads, rows[:MOST_VARIABLES]),
    ]
