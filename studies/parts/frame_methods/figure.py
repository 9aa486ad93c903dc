"""Figure of the study frame_methods: error of each method against its step and against its processor time."""

from __future__ import annotations

import xarray as xr
from matplotlib.axes import Axes
from matplotlib.figure import Figure
from matplotlib.ticker import FuncFormatter, LogLocator, NullFormatter

# Colours of Okabe and Ito, which colour-blind readers can distinguish; markers distinguish the methods, too.
LOOKS = (("#0072B2", "o", "-"), ("#56B4E9", "s", "--"), ("#CC79A7", "v", "-"), ("#E69F00", "^", "-"))
LOOKS += (("#009E73", "D", "-"), ("black", "x", "-"))


def draw(result: xr.Dataset) -> Figure:
    """Return the figure of the study's dataset."""
    levels = [str(level) for level in result["level"].values]
    figure = Figure(figsize=(4.0 * len(levels) + 1, 7.6), layout="constrained")
    panels = figure.subplots(2, len(levels), sharey="col", squeeze=False)
    for (by_step, by_time), level in zip(panels.T, levels, strict=True):
        rows = result.sel(level=level)
        factor = float(rows["factor"])
        by_step.set_title(f"{level} (record x {factor:g})", fontsize=11)
        for (colour, marker, line), method in zip(LOOKS, rows["method"].values, strict=True):
            row = rows.sel({"method": method}).dropna("step")
            if "OpenSees" in str(method) and level != levels[0]:
                continue  # its errors depend on the settings of its solver
            look = {"color": colour, "marker": marker, "ls": line, "ms": 5, "label": str(method)}
            by_step.plot(1e3 * row["step"], row["error"], **look)
            by_time.plot(1e3 * row["seconds_per_history"], row["error"], **look)
        by_step.set_xlabel("Step [ms]")
        by_time.set_xlabel("Processor time per history [ms]")
    for axes in panels.flat:
        _finish(axes)
    for axes in panels[0]:
        axes.xaxis.set_major_locator(LogLocator(subs=(1.0, 2.0, 5.0)))
    for axes in panels[:, 0]:
        axes.set_ylabel("Largest error of the drifts")
    first = panels[0, 0]
    handles, labels = first.get_legend_handles_labels()
    figure.legend(handles, labels, loc="outside lower center", ncols=len(labels), frameon=False)
    return figure


def _finish(axes: Axes) -> None:
    axes.set(xscale="log", yscale="log")
    axes.xaxis.set_major_formatter(FuncFormatter(lambda value, _: f"{value:g}"))
    axes.yaxis.set_major_formatter(FuncFormatter(lambda value, _: f"{100 * value:g} %"))
    axes.yaxis.set_major_locator(LogLocator(numticks=12))
    for axis in (axes.xaxis, axes.yaxis):
        axis.set_minor_formatter(NullFormatter())
    axes.spines[["top", "right"]].set_visible(False)
    axes.grid(which="major", color="0.9", lw=0.7)
