"""The chart of the decision: error of fragility medians against seconds, a panel for each device."""

from __future__ import annotations

from collections.abc import Sequence

import numpy as np
import xarray as xr
from matplotlib.axes import Axes
from matplotlib.figure import Figure
from matplotlib.ticker import FuncFormatter, LogLocator, NullFormatter

COLOURS = {"crossed, Monte Carlo": "#D55E00", "crossed, Sobol": "#0072B2", "nested, Sobol": "#009E73"}
WORDS = {
    "crossed, Monte Carlo": "same structures under all records, Monte Carlo",
    "crossed, Sobol": "same structures under all records, Sobol",
    "nested, Sobol": "separate structures for each record, Sobol",
}
DEFAULT = "crossed, Sobol", 64


def decision_chart(results: Sequence[xr.Dataset]) -> Figure:
    """Draw total error against seconds.

    Args:
        results: Datasets of the study from each device.
    """
    figure = Figure(figsize=(6.4 * len(results) + 0.8, 6.6), layout="constrained")
    all_axes = figure.subplots(1, len(results), sharey=True, squeeze=False)[0]
    for axes, result in zip(all_axes, results, strict=True):
        _panel(axes, result)
    all_axes[0].set_ylabel("Error of a fragility median (root mean square of four states)")
    handles, labels = all_axes[0].get_legend_handles_labels()
    figure.legend(handles, labels, loc="outside lower center", ncols=2, frameon=False, fontsize=9)
    figure.suptitle("Accuracy and computing time: five storeys, 44 records;\nmethods, steps, number types and designs")
    return figure


def total_errors(result: xr.Dataset) -> xr.DataArray:
    """Return the error of integration and sampling together, over method, dtype, step and plan."""
    return np.hypot(result["integration_error"], result["sampling_error"])


def frontier(seconds: np.ndarray, errors: np.ndarray) -> tuple[np.ndarray, np.ndarray]:
    """Return the points that no other point is both faster and more accurate than, by increasing time."""
    order = np.lexsort((errors, seconds))
    seconds, errors = seconds[order], errors[order]
    is_best = errors < np.minimum.accumulate(np.concatenate([[np.inf], errors[:-1]]))
    return seconds[is_best], errors[is_best]


def _panel(axes: Axes, result: xr.Dataset) -> None:
    errors = total_errors(result)
    for design, colour in COLOURS.items():
        chosen = (result["design"] == design).values
        seconds = result["seconds"].values[..., chosen].ravel()
        axes.plot(seconds, errors.values[..., chosen].ravel(), ".", ms=4, color=colour, alpha=0.45, label=WORDS[design])
    for name, style, label in (
        ("seconds", "-", "frontier, wall time of simulate()"),
        ("seconds_in_kernels", ":", "frontier, time of the kernels alone"),
    ):
        axes.plot(
            *frontier(result[name].values.ravel(), errors.values.ravel()), style, color="black", lw=1.6, label=label
        )
    records = float(result["record_error"])
    axes.axhline(records, color="0.4", lw=1, ls="--", label="what 44 records leave: below, more work buys nothing")
    axes.axhspan(axes.get_ylim()[0] * 1e-3, records, color="0.5", alpha=0.08, lw=0)
    for number in np.flatnonzero((result["design"] == DEFAULT[0]).values & (result["size"] == DEFAULT[1]).values):
        error = np.hypot(result["integration_error_by_default"], result["sampling_error"][number])
        place = float(result["seconds_by_default"][number]), float(error)
        axes.plot(*place, "*", ms=15, color="#E69F00", mec="black", mew=0.8, label="defaults, 64 structures")
    if "precision_seconds" in result:
        place = float(result["precision_seconds"]), float(result["precision_error"])
        label = f"fragility_to(precision={float(result['precision']):g}), pilot and plan included"
        axes.plot(*place, "P", ms=11, color="#CC79A7", mec="black", mew=0.8, label=label)
    _wasted(axes, result)
    axes.set(xscale="log", yscale="log", xlabel="Seconds", title=_device(result))
    finite = errors.values[np.isfinite(errors.values)]
    axes.set_ylim(0.6 * finite.min(), min(1.5, 1.6 * finite.max()))
    for axis in (axes.xaxis, axes.yaxis):
        axis.set_major_locator(LogLocator(subs=(1.0, 2.0, 5.0)))
        axis.set_minor_formatter(NullFormatter())
    axes.xaxis.set_major_formatter(FuncFormatter(lambda value, _: f"{value:g}"))
    axes.yaxis.set_major_formatter(FuncFormatter(lambda value, _: f"{100 * value:g} %"))
    axes.tick_params(labelsize=8)
    axes.grid(which="major", alpha=0.25)


def _wasted(axes: Axes, result: xr.Dataset) -> None:
    """Draw one design at every step: at short steps the number of structures determines the error."""
    for design, size, words in ((*DEFAULT, "64 structures"), ("nested, Sobol", 2, "2 for each record")):
        chosen = np.flatnonzero((result["design"] == design).values & (result["size"] == size).values)
        if not chosen.size:
            continue
        part = result.isel(plan=int(chosen[0])).sel({"method": "rk4", "dtype": "float32"})
        seconds, errors = part["seconds"].values, np.hypot(part["integration_error"], part["sampling_error"]).values
        axes.plot(seconds, errors, "-o", ms=3.5, lw=1, color=COLOURS[design])
        at = int(np.argmax(seconds))
        words = f"{words}: shorter steps\nbuy nothing here"
        axes.annotate(
            words, (seconds[at], errors[at]), (4, 4), textcoords="offset points", fontsize=8, color=COLOURS[design]
        )


def _device(result: xr.Dataset) -> str:
    return str(result.attrs["device"])
