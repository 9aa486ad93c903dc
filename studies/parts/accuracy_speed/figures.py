"""Figures of the study accuracy_speed: each function draws one figure of the dataset of the study."""

from __future__ import annotations

import numpy as np
import xarray as xr
from matplotlib.axes import Axes
from matplotlib.figure import Figure
from matplotlib.lines import Line2D
from matplotlib.ticker import FuncFormatter, LogLocator, NullFormatter

from parts.accuracy_speed.promises import FACTOR, agreement

# One colour per family of methods (Okabe and Ito, distinct for colour-blind readers), one marker per method.
FAMILIES = {
    "exact for linear structures": ("black", {"exact": "*"}),
    "Runge-Kutta, order 4 and 5": (
        "#0072B2",
        {"rk4": "o", "three_eighths": "s", "nystroem4": "^", "dormand_prince5": "D"},
    ),
    "Runge-Kutta, order 2 and 3": ("#56B4E9", {"heun": "o", "midpoint": "s", "kutta3": "^", "ssprk3": "D"}),
    "adaptive": ("#CC79A7", {"dormand_prince54": "P"}),
    "multistep, order 3": ("#E69F00", {"stoermer": "o"}),
    "central differences": (
        "#009E73",
        {"central_difference": "o", "velocity_verlet": "s", "central_difference_lagged": "^"},
    ),
    "implicit": (
        "#D55E00",
        {
            "newmark_average": "o",
            "newmark_linear": "s",
            "hht_alpha": "^",
            "generalised_alpha": "D",
            "wilson_theta": "v",
        },
    ),
}
LOOKS = {method: (colour, marker) for colour, family in FAMILIES.values() for method, marker in family.items()}
SCENE_COLOURS = ("black", "#0072B2", "#D55E00", "#009E73", "#CC79A7")


def work_precision(dataset: xr.Dataset) -> Figure:
    """Return a figure of the time per sample against the error of the peak drift, with one panel per ensemble.

    Args:
        dataset: Dataset that studies/accuracy_speed.py wrote.
    """
    figure = Figure(figsize=(15, 9.5), layout="constrained")
    axes = figure.subplots(2, 3)
    for axis, scene in zip(axes.flat, dataset["scene"].values, strict=False):
        _diagram(axis, dataset.sel(scene=scene, demand="peak_storey_drift", statistic="95 %"))
        axis.set_title(str(dataset["scene_label"].sel(scene=scene).item()), fontsize=11)
        axis.set_xlabel("Error of the peak storey drift, 95 % of the samples")
    _legend(axes.flat[-1])
    figure.suptitle(
        f"Accuracy and computing time: {dataset.attrs['samples']:,} samples per ensemble on {dataset.attrs['device']}"
    )
    return figure


def residual_drift(dataset: xr.Dataset) -> Figure:
    """Return a figure of time per sample against errors of residual drifts, and against median errors of peak drifts.

    Args:
        dataset: Dataset that studies/accuracy_speed.py wrote. Only ensembles that yield are drawn.
    """
    recorded = np.isfinite(dataset["error"].sel(demand="residual_drift_ratio")).any(
        ["method", "dtype", "step", "statistic"]
    )
    scenes = dataset["scene"].values[recorded.values]
    rows = {
        ("residual_drift_ratio", "95 %"): "Error of the residual drift, 95 %",
        ("peak_storey_drift", "median"): "Error of the peak drift, median",
    }
    figure = Figure(figsize=(5 * len(scenes) + 1.5, 9), layout="constrained")
    axes = figure.subplots(2, len(scenes), squeeze=False)
    for row, ((demand, statistic), text) in zip(axes, rows.items(), strict=True):
        for axis, scene in zip(row, scenes, strict=True):
            _diagram(axis, dataset.sel(scene=scene, demand=demand, statistic=statistic))
            axis.set_title(str(dataset["scene_label"].sel(scene=scene).item()), fontsize=11)
            axis.set_xlabel(text)
    handles = [Line2D([], [], color=colour, lw=2, label=name) for name, (colour, _) in FAMILIES.items()]
    figure.legend(handles=handles, loc="outside lower center", ncols=len(handles), fontsize=9)
    figure.suptitle("Errors of residual drifts, relative to the peak drift, and median errors of the peaks")
    return figure


def _diagram(axis: Axes, rows: xr.Dataset) -> None:
    """Draw one curve per method and dtype, and name the fastest method within each target error."""
    error, seconds = rows["error"], 1e6 * rows["seconds_per_sample"]
    for method, (colour, marker) in LOOKS.items():
        for dtype, style in (("float64", {"ls": ":", "mfc": "white", "lw": 0.9}), ("float32", {"ls": "-", "lw": 1.2})):
            x, y = (values.sel({"method": method, "dtype": dtype}).values for values in (error, seconds))
            held = np.isfinite(x) & (x > 0)
            axis.plot(x[held], y[held], color=colour, marker=marker, ms=4, alpha=0.85, **style)
    table = xr.Dataset({"x": error, "y": seconds}).stack(point=("method", "dtype", "step"))
    table = table.isel(point=np.flatnonzero(np.isfinite(table["x"]) & (table["x"] > 0))).sortby("y")
    best = np.minimum.accumulate(table["x"].values)
    front = table.isel(point=np.flatnonzero(table["x"].values <= best))
    axis.plot(front["x"], front["y"], color="gold", lw=7, alpha=0.5, zorder=0, solid_capstyle="round")
    axis.set(xscale="log", yscale="log", ylabel="Time a sample [µs]")
    (low, high), (least, most) = axis.get_xlim(), axis.get_ylim()
    axis.set_ylim(least * (least / most) ** 0.6, most)  # space for the names of the methods below
    for target in (each for each in rows["target"].values if low < each < high):
        held = front.isel(point=np.flatnonzero(front["x"].values <= target)[:1])
        if not held.sizes["point"]:
            continue
        name, dtype, step = (held[key].values[0] for key in ("method", "dtype", "step"))
        axis.axvline(target, color="0.5", lw=0.8, ls="--", zorder=0)
        axis.annotate(
            f"{name.replace('_', ' ')}, {1e3 * step:g} ms" + (", float64" if dtype == "float64" else ""),
            (target, 0.02),
            xycoords=("data", "axes fraction"),
            textcoords="offset points",
            xytext=(-2, 0),
            rotation=90,
            ha="right",
            fontsize=8.5,
            color=LOOKS[name][0],
        )
    _decades(axis)


def _decades(axis: Axes) -> None:
    axis.xaxis.set_major_locator(LogLocator(numticks=8))
    axis.yaxis.set_major_locator(LogLocator(subs=(1.0, 2.0, 5.0), numticks=12))
    axis.yaxis.set_major_formatter(FuncFormatter(lambda value, _: f"{value:g}"))
    for side in (axis.xaxis, axis.yaxis):
        side.set_minor_formatter(NullFormatter())
    axis.grid(alpha=0.3)


def _legend(axis: Axes) -> None:
    """Fill an empty panel with a legend of the methods, grouped by family."""
    axis.axis("off")
    handles = []
    for family, (colour, methods) in FAMILIES.items():
        handles.append(Line2D([], [], ls="", label=family))
        handles += [
            Line2D([], [], color=colour, marker=marker, ms=5, label=name.replace("_", " "))
            for name, marker in methods.items()
        ]
    handles += [
        Line2D([], [], ls="", label="all families"),
        Line2D([], [], color="0.3", marker="o", ms=5, label="float32"),
        Line2D([], [], color="0.3", marker="o", ms=5, mfc="white", ls=":", label="float64"),
        Line2D([], [], color="gold", lw=7, alpha=0.5, label="cheapest, named at targets"),
    ]
    legend = axis.legend(handles=handles, ncols=2, loc="center", fontsize=9, frameon=False, handlelength=2.2)
    for text in legend.get_texts():
        if text.get_text() in (*FAMILIES, "all families"):
            text.set_weight("bold")
    axis.text(0.5, -0.02, "left and low is better", ha="center", transform=axis.transAxes, fontsize=10)


def promises(dataset: xr.Dataset) -> Figure:
    """Return a figure of estimated against true errors, and of the choices of `plan` against the best charted points.

    Args:
        dataset: Dataset that studies/accuracy_speed.py wrote.
    """
    figure = Figure(figsize=(13, 5.6), layout="constrained")
    left, right = figure.subplots(1, 2)
    held = dataset["error"].where(np.isfinite(dataset["estimated_error"])).values
    span = np.nanmin(held[held > 0]) / 2, np.nanmax(held[np.isfinite(held)]) * 2
    for scene, colour in zip(dataset["scene"].values, SCENE_COLOURS, strict=False):
        rows = dataset.sel(scene=scene)
        true, estimated = (rows[name].values.ravel() for name in ("error", "estimated_error"))
        label = str(rows["scene_label"].item())
        left.loglog(true, estimated, "o", color=colour, ms=4, alpha=0.7, label=label)
        far = estimated < span[0]  # points below the lower edge are drawn on the edge
        left.plot(true[far], np.full(far.sum(), 1.2 * span[0]), "v", color=colour, ms=7)
        ratio = rows["plan_seconds_per_sample"] / rows["best_seconds_per_sample"]
        for target, marker in zip(dataset["target"].values, "osD", strict=False):
            at = (float(rows["plan_error"].sel(target=target) / target), float(ratio.sel(target=target)))
            right.plot(*at, marker, color=colour, ms=8)
    ends = np.array([1e-7, 1.0])
    left.plot(ends, ends, color="0.4", lw=1)
    left.fill_between(ends, ends / FACTOR, ends * FACTOR, color="0.85", zorder=0)
    left.set(xlim=span, ylim=span, xlabel="True relative error", ylabel="Error as check estimates it")
    ratio, within = agreement(dataset)
    left.set_title(f"check: {100 * within:.1f} % of {ratio.size} within a factor of {FACTOR:g} (grey)", fontsize=11)
    left.legend(fontsize=8, loc="upper left")
    right.axhspan(0, 2, color="0.92", zorder=0)
    right.axvline(1, color="0.4", lw=1)
    right.axhline(2, color="0.4", lw=1)
    right.set(xlabel="True 95 % error over its target", ylabel="Time over that of the best charted point")
    right.set(xlim=(0, max(1.1, right.get_xlim()[1])), ylim=(0, max(2.2, right.get_ylim()[1])))
    markers = [
        Line2D([], [], color="0.3", marker=marker, ls="", label=f"target {target:g}")
        for target, marker in zip(dataset["target"].values, "osD", strict=False)
    ]
    right.legend(handles=markers, fontsize=9, loc="lower left")
    right.set_title("plan: left of 1 the target is met, below 2 the time is as promised", fontsize=11)
    for axis in (left, right):
        axis.grid(alpha=0.3)
    return figure
