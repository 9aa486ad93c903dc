"""Figure of the study four_storey_frame: curves of the models, their error against their cost, rotations of hinges."""

from __future__ import annotations

import numpy as np
import xarray as xr
from matplotlib.axes import Axes
from matplotlib.axis import Axis
from matplotlib.figure import Figure
from matplotlib.ticker import FuncFormatter, LogLocator, NullFormatter

COLOURS = ("#0072B2", "#009E73", "#D55E00", "#CC79A7")
STATES = {"2 % drift": "--", "collapse": "-"}
HINGES = {"beams": ("B", "start"), "columns, lower end": ("C", "start"), "columns, upper end": ("C", "end")}


def draw(result: xr.Dataset) -> Figure:
    """Return the figure of the study's dataset."""
    figure = Figure(figsize=(13.0, 4.6), layout="constrained")
    curves, cost, height = figure.subplots(1, 3, width_ratios=(1.25, 1, 1))
    names = [str(name) for name in result["model"].values]
    colour = dict(zip(names, COLOURS, strict=False))
    _draw_curves(curves, result, colour)
    _draw_cost(cost, result, colour)
    _draw_rotations(height, result)
    for axes in (curves, cost, height):
        axes.spines[["top", "right"]].set_visible(False)
    return figure


def _draw_curves(axes: Axes, result: xr.Dataset, colour: dict[str, str]) -> None:
    for name, each in colour.items():
        for state, style in STATES.items():
            row = result.sel(model=name, damage_state=state)
            x = row["intensity"].values
            # The curves of frame and fish-bone nearly coincide: that of the frame is wider.
            width = 4.0 if name == "frame" else 1.5
            label = name if style == "-" else None
            axes.plot(x, row["fragility_curve"].values, color=each, ls=style, lw=width, label=label)
            lower, upper = (row[f"fragility_curve_{end}"].values for end in ("lower", "upper"))
            axes.fill_between(x, lower, upper, color=each, alpha=0.15, lw=0)
    axes.plot([], [], color="0.3", ls="--", label="2 % drift (dashed)")
    axes.set(xscale="log", xlim=(0.1, 4.0), xlabel="Sa(1.365 s, 5 %) [g]", ylabel="Probability")
    axes.set(ylim=(0, 1.3), yticks=np.linspace(0, 1, 6))  # space for the legend
    _label_decades(axes.xaxis)
    axes.legend(frameon=False, fontsize=8, loc="upper left", ncols=2)
    axes.set_title("Collapse (solid) and 2 % drift, 95 % intervals", fontsize=10)


def _draw_cost(axes: Axes, result: xr.Dataset, colour: dict[str, str]) -> None:
    samples = int(result.sizes["sample"])
    markers = {"elastic": "o", "yielding": "s", "near collapse": "^"}
    error = np.expm1(np.abs(np.log(result["drift_over_frame"])))
    for name, each in colour.items():
        seconds = 1e3 * float(result["processor_time"].sel(model=name)) / samples
        for place, marker in enumerate(markers.values()):
            value = 100 * float(error.sel(model=name)[place::3].median())
            axes.plot(seconds, value, marker, color=each, ms=8)
        axes.annotate(name, (seconds, 100 * float(error.sel(model=name)[0::3].median())), (6, -12),
                      textcoords="offset points", fontsize=8, color=each)  # fmt: skip
    for words, marker in markers.items():
        axes.plot([], [], marker, color="0.4", label=words)
    axes.set(xscale="log", yscale="log", xlabel="Processor time per history [ms]")
    axes.set_ylabel("Median error of peak drifts [%]")
    first, last = axes.get_xlim()
    axes.set_xlim(first, 4 * last)
    _label_decades(axes.xaxis)
    _label_decades(axes.yaxis)
    axes.legend(frameon=False, fontsize=8)
    axes.set_title("Error against the whole frame (OpenSees)", fontsize=10)


def _draw_rotations(axes: Axes, result: xr.Dataset) -> None:
    """Draw quantiles of the fish-bone's hinges, and the median of each hinge of the frame as a small marker."""
    for (words, (kind, end)), marker, shift in zip(HINGES.items(), "os^", (0.0, -0.12, 0.12), strict=True):
        for model in ("frame", "fish-bone"):
            row = result["hinge_rotation"].sel(model=model).dropna("hinge", how="all")
            names = [str(name) for name in row["hinge"].values]
            ends = (end,) if model == "fish-bone" or kind == "C" else ("start", "end")
            chosen = [name for name in names if name[0] == kind and name.endswith(ends)]
            floors = np.array([int(name.split()[0][1:].split("_")[0]) for name in chosen])
            place = floors - (end == "start" and kind == "C") + shift
            low, median, high = 100 * row.sel(hinge=chosen).values
            if model == "frame":
                axes.plot(median, place, marker, color="0.6", ms=3, zorder=1)
            else:
                axes.errorbar(median, place, xerr=[median - low, high - median], fmt=marker, capsize=2, label=words)
    axes.plot([], [], "o", color="0.6", ms=3, label="hinges of the frame, 50 %")
    axes.set(
        xlabel="Peak rotation of hinges [% rad]", ylabel="Floor", ylim=(-0.5, 5.7), yticks=range(5)
    )  # space for the legend
    axes.set_xlim(left=0)
    axes.legend(frameon=False, fontsize=8)
    axes.set_title("Hinges at 0.6 g (fish-bone: 16, 50, 84 %)", fontsize=10)


def _label_decades(axis: Axis) -> None:
    axis.set_major_locator(LogLocator(subs=(1.0, 2.0, 5.0)))
    axis.set_major_formatter(FuncFormatter(lambda value, _: f"{value:g}"))
    axis.set_minor_formatter(NullFormatter())
