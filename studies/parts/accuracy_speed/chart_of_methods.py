"""Chart of the error of the peak drift against the time per sample, for six methods and one ensemble."""

from __future__ import annotations

import numpy as np
import xarray as xr
from matplotlib.figure import Figure
from matplotlib.ticker import FuncFormatter, LogLocator, NullFormatter

SCENE = "bilinear"  # ensemble of the chart
# Colours of Okabe and Ito, which colour-blind readers can distinguish.
COLOURS = {
    "rk4": "#0072B2",
    "stoermer": "#D55E00",
    "central_difference": "#009E73",
    "velocity_verlet": "#E69F00",
    "newmark_average": "#CC79A7",
    "dormand_prince54": "#555555",
}
LABELLED_AT_START = ("velocity_verlet",)  # methods whose label is at the start, because a curve crosses the end
TARGET = 0.001  # relative error at which the title compares the methods


def chart_of_methods(dataset: xr.Dataset) -> Figure:
    """Return a figure of the errors and times of six methods in float32, with a label on each curve.

    Args:
        dataset: Dataset that studies/accuracy_speed.py wrote.
    """
    rows = dataset.sel(scene=SCENE, dtype="float32", demand="peak_storey_drift", statistic="95 %")
    figure = Figure(figsize=(10.0, 6.0), layout="constrained")
    axes = figure.subplots()
    axes.set(xscale="log", yscale="log")
    for method, colour in COLOURS.items():
        seconds, errors = curve(rows, method)
        axes.plot(1e6 * seconds, errors, "-o", color=colour, lw=2.5 if method in ("rk4", "stoermer") else 1.5, ms=6)
        if seconds.size:
            at, offset = (0, (-8, 14)) if method in LABELLED_AT_START else (-1, (8, -3))
            place = 1e6 * seconds[at], errors[at]
            axes.annotate(method, place, offset, textcoords="offset points", fontsize=12, color=colour)
    axes.margins(x=0.15, y=0.09)
    axes.set_xlabel("Integration time per sample [µs]", fontsize=12)
    axes.set_ylabel("Error of the peak storey drift, 95 % quantile", fontsize=12)
    axes.xaxis.set_major_locator(LogLocator(subs=(1.0, 2.0, 5.0)))
    axes.xaxis.set_major_formatter(FuncFormatter(lambda value, _: f"{value:g}"))
    axes.yaxis.set_major_formatter(FuncFormatter(lambda value, _: f"{100 * value:g} %"))
    for axis in (axes.xaxis, axes.yaxis):
        axis.set_minor_formatter(NullFormatter())
    axes.tick_params(labelsize=12)
    axes.spines[["top", "right"]].set_visible(False)
    axes.set_title(_title(rows), fontsize=15, fontweight="bold", loc="left")
    label, device = dataset["scene_label"].sel(scene=SCENE).item(), dataset.attrs["device"].split(" (")[-1].rstrip(")")
    words = (
        f"{label}; {dataset.attrs['samples']:,} samples on {device}; float32. Each point has half the step of the last"
    )
    figure.supxlabel(words, fontsize=11, x=0.02, ha="left", color="0.35")
    return figure


def curve(rows: xr.Dataset, method: str) -> tuple[np.ndarray, np.ndarray]:
    """Return times per sample [s] and relative errors of the points of a method, beginning with the longest step."""
    points = rows.sel({"method": method})
    seconds, errors = points["seconds_per_sample"].values, points["error"].values
    held = np.isfinite(seconds) & np.isfinite(errors) & (errors > 0)
    return seconds[held], errors[held]


def _title(rows: xr.Dataset) -> str:
    """Return the title of the chart: the fastest method within the target error, compared with rk4."""
    within = {}
    for method in COLOURS:
        seconds, errors = curve(rows, method)
        if (errors <= TARGET).any():
            within[method] = seconds[errors <= TARGET].min()
    if "rk4" not in within:
        return "Accuracy and computing time of six methods"
    best = min(within, key=lambda method: within[method])
    if best == "rk4":
        return f"rk4 reaches an error of {100 * TARGET:g} % in the least time"
    ratio = within["rk4"] / within[best]
    return f"{best} reaches an error of {100 * TARGET:g} % in the least time, rk4 in {ratio:.1f} times that"
