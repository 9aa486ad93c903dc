"""Fragility curves of a run in a table and a figure, and statistics of runs that keep no samples."""

from __future__ import annotations

import numpy as np
import xarray as xr

from warpdyn.foundations.core.output_variables import MEDIAN_MEANINGS, MEDIAN_STATUS
from warpdyn.interfaces.plots.fragility import fragility_curves
from warpdyn.interfaces.plots.samples import label_of_measure
from warpdyn.interfaces.reports.markup import figure, heading, paragraph, table

MOST_VARIABLES = 80


def fragility(dataset: xr.Dataset) -> list[str]:
    """Return the section on the fragility curves that a dataset has, or nothing.

    Args:
        dataset: A run merged with its fragility.
    """
    if "fragility_median" not in dataset or dataset["fragility_median"].dims != ("damage_state",):
        return []
    rows = []
    for number, state in enumerate(dataset["damage_state"].values):
        values: list[object] = [str(state)]
        if "damage_limit" in dataset and dataset["damage_limit"].dims == ("damage_state",):
            values.append(float(dataset["damage_limit"].values[number]))
        for name in ("fragility_median", "fragility_dispersion"):
            values.append(float(dataset[name].values[number]))
            if f"{name}_lower" in dataset:
                values += [float(dataset[f"{name}_{side}"].values[number]) for side in ("lower", "upper")]
        if MEDIAN_STATUS in dataset:
            values.append(MEDIAN_MEANINGS[int(dataset[MEDIAN_STATUS].values[number])].replace("_", " "))
        rows.append(values)
    heads = ["damage state"]
    if "damage_limit" in dataset and dataset["damage_limit"].dims == ("damage_state",):
        heads.append("limit")
    for name, words in (("fragility_median", "median"), ("fragility_dispersion", "dispersion")):
        heads += [words, *(["lower", "upper"] if f"{name}_lower" in dataset else [])]
    heads += ["median is"] if MEDIAN_STATUS in dataset else []
    confidence = dataset.attrs.get("confidence")
    limits = f", with {float(confidence):.0%} intervals" if confidence is not None else ""
    measure = label_of_measure(dataset)
    demand = dataset.attrs.get("demand", "several demands")
    return [
        heading("Fragility"),
        paragraph(f"Medians are of the intensity measure {measure}; the limits are of {demand}."),
        table(f"Fragility curves{limits}", heads, rows),
        figure(fragility_curves(dataset), "Fragility curves, the stripes' fractions and their intervals."),
    ]


def statistics(dataset: xr.Dataset) -> list[str]:
    """Return the section on what a run that keeps no samples counted: every variable with its range.

    Args:
        dataset: What `simulate(scene, statistics=...)` returned.
    """
    rows: list[tuple[object, ...]] = []
    for name, variable in dataset.data_vars.items():
        if variable.dtype.kind not in "iuf" or not variable.size:
            continue
        finite = variable.values[np.isfinite(variable.values)].astype(np.float64)
        bounds = (float(finite.min()), float(finite.max())) if finite.size else (np.nan, np.nan)
        total = float(finite.sum()) if variable.dtype.kind in "iu" else np.nan  # of counts alone
        words = f"{variable.attrs.get('long_name', name)} [{variable.attrs.get('units', '1')}]"
        along = ", ".join(f"{dim} ({size:,})" for dim, size in variable.sizes.items()) or "one value"
        rows.append((words, along, *bounds, total))
    heads = ("statistic", "along", "smallest", "largest", "sum of counts")
    return [
        heading("Statistics"),
        table("Statistics that were counted while the run went on", heads, rows[:MOST_VARIABLES]),
    ]
