"""Chart of the study decision: error of fragility medians against the time of `simulate`, one curve per machine."""

from __future__ import annotations

from collections.abc import Sequence

import numpy as np
import xarray as xr
from matplotlib.axes import Axes
from matplotlib.figure import Figure
from matplotlib.ticker import FuncFormatter, LogLocator, NullFormatter

COLOURS = ("#D55E00", "#0072B2", "#CC79A7")
OF_RECORDS = "#00734F"
DEFAULT = "nested, Sobol", 3  # design and size that `simulate` uses by default
LEAST_GAIN = 0.95  # a point is drawn if its error is below this fraction of the previous point's
INSIDE = {"textcoords": "offset points", "fontsize": 12}


def decision_chart(results: Sequence[xr.Dataset]) -> Figure:
    """Return a figure with the frontier of each machine, the error due to the records, and two calls of warpdyn.

    The calls are `simulate` with its default method and design, and `fragility_to`.


    Args:
        results: Datasets of the study, one per machine; the first also contains the error due to the records.
    """
    figure = Figure(figsize=(10.0, 5.4), layout="constrained")
    axes = figure.subplots()
    axes.set(xscale="log", yscale="log")
    for result, colour in zip(results, COLOURS, strict=False):
        _draw_machine(axes, result, colour)
    _draw_calls(axes, results)
    records = float(results[0]["record_error"])
    axes.axhline(records, color=OF_RECORDS, lw=2)
    axes.axhspan(1e-9, records, color=OF_RECORDS, alpha=0.08, lw=0)
    axes.annotate(
        f"{100 * records:.0f} %: uncertainty due to the choice of the records",
        (1.0, records),
        (-6, 6),
        xycoords=axes.get_yaxis_transform(),
        ha="right",
        color=OF_RECORDS,
        **INSIDE,
    )
    errors = np.concatenate([frontier_of(result)[1] for result in results])
    axes.set_ylim(0.6 * errors.min(), 2.5 * max(errors.max(), records))
    first, last = axes.get_xlim()
    axes.set_xlim(first, 1.6 * last)  # space for the labels
    axes.set_xlabel("Wall time of simulate() [s]", fontsize=12)
    axes.set_ylabel("Error of the fragility medians", fontsize=12)
    axes.xaxis.set_major_locator(LogLocator(subs=(1.0, 2.0, 5.0)))
    axes.yaxis.set_major_locator(LogLocator(subs=(1.0, 3.0)))
    for axis in (axes.xaxis, axes.yaxis):
        axis.set_minor_formatter(NullFormatter())
    axes.xaxis.set_major_formatter(FuncFormatter(lambda value, _: f"{value:g}"))
    axes.yaxis.set_major_formatter(FuncFormatter(lambda value, _: f"{100 * value:g} %"))
    axes.tick_params(labelsize=12)
    axes.spines[["top", "right"]].set_visible(False)
    axes.set_title(_title(results), fontsize=15, fontweight="bold", loc="left")
    return figure


def total_errors(result: xr.Dataset) -> xr.DataArray:
    """Return the error of integration and sampling together, with the dimensions method, dtype, step and plan."""
    return np.hypot(result["integration_error"], result["sampling_error"])


def frontier(seconds: np.ndarray, errors: np.ndarray) -> tuple[np.ndarray, np.ndarray]:
    """Return the points for which no other point is both faster and more accurate, sorted by increasing time."""
    order = np.lexsort((errors, seconds))
    seconds, errors = seconds[order], errors[order]
    is_best = errors < np.minimum.accumulate(np.concatenate([[np.inf], errors[:-1]]))
    return seconds[is_best], errors[is_best]


def frontier_of(result: xr.Dataset) -> tuple[np.ndarray, np.ndarray]:
    """Return times [s] and errors of the frontier of a machine, without points that gain less than 5 % in accuracy."""
    kept: list[tuple[float, float]] = []
    points = frontier(result["seconds"].values.ravel(), total_errors(result).values.ravel())
    for second, error in zip(*points, strict=True):
        if not kept or error < LEAST_GAIN * kept[-1][1]:
            kept.append((second, error))
    seconds, errors = np.transpose(kept)
    return seconds, errors


def _title(results: Sequence[xr.Dataset]) -> str:
    """Return the title: the time from which the error is below the error due to the records on every machine."""
    within = []
    for result in results:
        seconds, errors = frontier_of(result)
        within.append(np.min(seconds[errors <= float(results[0]["record_error"])], initial=np.inf))
    if not np.isfinite(max(within)):
        return "Accuracy of a fragility curve against computing time"
    return f"After {max(within):.2g} s, only more records make the fragility curve more certain"


def _draw_machine(axes: Axes, result: xr.Dataset, colour: str) -> None:
    seconds, errors = frontier_of(result)
    axes.plot(seconds, errors, "-o", color=colour, lw=2.5, ms=7)
    axes.annotate(
        machine_of(result),
        (seconds[-1], errors[-1]),
        (8, -4),
        color=colour,
        fontweight="bold",
        **INSIDE,
    )


def _draw_calls(axes: Axes, results: Sequence[xr.Dataset]) -> None:
    """Draw the default method and `fragility_to` on each machine; the label is at the slowest machine."""
    calls: dict[str, list[tuple[float, float, str]]] = {"*": [], "P": []}
    words = {"*": "default method and design"}
    for result, colour in zip(results, COLOURS, strict=False):
        is_default = (result["design"] == DEFAULT[0]) & (result["size"] == DEFAULT[1])
        for number in np.flatnonzero(is_default.values):
            error = float(np.hypot(result["integration_error_by_default"], result["sampling_error"][number]))
            calls["*"].append((float(result["seconds_by_default"][number]), error, colour))
        if "precision_seconds" in result:
            calls["P"].append((float(result["precision_seconds"]), float(result["precision_error"]), colour))
            words["P"] = f"fragility_to,\nprecision {100 * float(result['precision']):g} %"
    for marker, points in calls.items():
        for seconds, error, colour in points:
            axes.plot(seconds, error, marker, ms=19 if marker == "*" else 12, color=colour, mec="black", mew=0.8)
        if points:
            axes.annotate(words[marker], max(points)[:2], (12, -6), va="center", **INSIDE)


def machine_of(result: xr.Dataset) -> str:
    """Return the label of the machine of a dataset, such as "NVIDIA H100" or "2 CPU cores"."""
    device = str(result.attrs["device"])
    if device.startswith("cpu"):
        cores = int(result.attrs.get("cores", 0))
        return f"{cores} CPU cores" if cores else "CPU"
    return " ".join(device.partition("(")[2].rstrip(")").split()[:2])
