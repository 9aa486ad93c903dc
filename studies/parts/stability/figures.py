"""Figures of the study stability on single oscillators; each function draws one figure of the dataset."""

from __future__ import annotations

import numpy as np
import xarray as xr
from matplotlib.axes import Axes
from matplotlib.figure import Figure

# Colours of Okabe and Ito, which colour-blind readers can distinguish, and a grey.
COLOURS = ("#0072B2", "#D55E00", "#009E73", "#CC79A7", "#E69F00", "#56B4E9", "#000000", "0.55")
STYLES = ("-", "--", ":")
MEASURED, FAINT = "#F0E442", "0.6"
TITLE = 10
LEAST_DISTANCE = 0.2  # between labels
NAMES = {
    "heun": "Heun",
    "kutta3": "Kutta 3",
    "ssprk3": "SSPRK3",
    "rk4": "RK4",
    "three_eighths": "3/8 rule",
    "dormand_prince5": "Dormand-Prince 5",
    "nystroem4": "Nyström 4",
    "velocity_verlet": "velocity Verlet",
    "stoermer": "Störmer",
    "central_difference_lagged": "central difference, lagged",
    "newmark_average": "Newmark, average",
    "newmark_linear": "Newmark, linear",
    "hht_alpha": "HHT-$\\alpha$",
    "generalised_alpha": "generalised-$\\alpha$",
    "wilson_theta": "Wilson-$\\theta$",
}


def words(name: str) -> str:
    """Return the name of a method for figures."""
    return NAMES.get(name, name.replace("_", " "))


def growth(dataset: xr.Dataset) -> Figure:
    """Return a figure with a map of the growth per step of each method, and its measured and theoretical limits.

    Args:
        dataset: Dataset that studies/stability.py wrote.
    """
    figure = Figure(figsize=(15, 8.2), layout="constrained")
    axes = figure.subplots(3, 6, sharex=True, sharey=True)
    x, z = dataset["frequency_step"], dataset["damping_ratio"]
    limited = dataset["limited_method"].values.tolist()
    dots = {"ls": "", "marker": "o", "color": MEASURED, "mec": "black", "mew": 0.4, "ms": 2.6}
    for axis, name in zip(axes.flat, dataset["method"].values, strict=False):
        value = np.log2(np.maximum(dataset["growth_per_step"].sel({"method": name}).values, 1e-9))
        mesh = axis.pcolormesh(x, z, value, cmap="RdBu_r", vmin=-1, vmax=1, shading="nearest", rasterized=True)
        axis.set_title(words(name), fontsize=TITLE)
        if name in limited:
            row, ratio = dataset.sel(limited_method=name), dataset["limit_damping_ratio"]
            axis.plot(row["theoretical_limit"], ratio, color="black", lw=2.5)
            axis.plot(row["measured_limit"][::2], ratio[::2], **dots)
        else:
            axis.text(2.4, 1, "nothing\ngrows", ha="center", va="center", fontsize=9, color="white", weight="bold")
    axes[0, 0].set(xlim=(0, 4), ylim=(0, 2))
    for axis in axes[-1]:
        axis.set_xlabel("Frequency times step, $\\omega h$")
    for axis in axes[:, 0]:
        axis.set_ylabel("Damping ratio")
    last = axes.flat[-1]
    last.set_axis_off()
    last.plot([], [], color="black", lw=2.5, label="limit in theory")
    last.plot([], [], **dots, label="limit measured")
    last.legend(loc="center", fontsize=9, title="blue decays, red grows")
    bar = figure.colorbar(mesh, ax=axes, extend="both", aspect=45, pad=0.01)
    bar.set_ticks([-1, -0.5, 0, 0.5, 1], labels=["0.5", "0.71", "1", "1.41", "2"])
    bar.set_label("Factor of the free vibration in one step, measured from the kernels")
    figure.suptitle("Growth of a free vibration per step, by method, frequency times step, and damping")
    return figure


def limits(dataset: xr.Dataset) -> Figure:
    """Draw the stability limits over the damping ratio up to 1: theory as lines with labels, measurements as dots.

    Args:
        dataset: Dataset that studies/stability.py wrote.
    """
    figure = Figure(figsize=(10, 6.2), layout="constrained")
    axes = figure.subplots()
    dataset = dataset.sel(limit_damping_ratio=slice(0, 1))
    ratio = dataset["limit_damping_ratio"].values
    groups = equal_rows(dataset["theoretical_limit"])
    ends = dataset["theoretical_limit"].isel(limit_damping_ratio=-1)
    heights = _apart(np.array([ends.sel(limited_method=names[0]).item() for names in groups]), LEAST_DISTANCE)
    furthest = 0.0
    for i, (names, height) in enumerate(zip(groups, heights, strict=True)):
        row, colour = dataset.sel(limited_method=names), COLOURS[i % len(COLOURS)]
        theory, measured = (row[f"{kind}_limit"].values for kind in ("theoretical", "measured"))
        axes.plot(ratio, theory[0], STYLES[i // len(COLOURS)], color=colour, lw=2)
        axes.plot(ratio, measured.T, "o", color=colour, ms=4)
        label = ", ".join(map(words, names))
        axes.annotate(
            label, (ratio[-1], theory[0, -1]), (1.04, height), color=colour, fontsize=12, va="center",
            arrowprops={"arrowstyle": "-", "color": colour, "lw": 0.6},
        )  # fmt: skip
        with np.errstate(divide="ignore", invalid="ignore"):
            furthest = max(furthest, np.nanmax(np.abs(np.where(theory > 0, measured / theory - 1, np.nan))))
    axes.set(xlabel="Damping ratio of the oscillator", ylabel="Largest stable $\\omega h$", ylim=(0, 4), xlim=(0, 1.42))
    axes.set_xticks(np.linspace(0, 1, 6))
    for label in (axes.xaxis.label, axes.yaxis.label):
        label.set_size(12)
    axes.tick_params(labelsize=12)
    axes.spines[["top", "right"]].set_visible(False)
    axes.spines["bottom"].set_bounds(0, 1)
    rk4 = dataset["theoretical_limit"].sel(limited_method="rk4").min().item()
    message = f"RK4 is stable up to $\\bf{{\\omega h}}$ = {rk4:.1f} with any damping ratio up to 1"
    figure.suptitle(message, fontsize=15, fontweight="bold", x=0.02, ha="left")
    note = f"Lines: theory. Dots: measured with the kernels, at most {100 * furthest:.1g} % from theory"
    figure.supxlabel(note, fontsize=11, x=0.02, ha="left", color="0.35")
    return figure


def _apart(values: np.ndarray, least: float) -> np.ndarray:
    """Return heights of labels, as close to the values as possible, with at least a distance between neighbours."""
    order = np.argsort(values, kind="stable")
    heights = values[order].astype(float)
    for _ in range(100):
        overlap = np.maximum(least - np.diff(heights), 0) / 2
        heights[1:] += overlap
        heights[:-1] -= overlap
    found = np.empty_like(heights)
    found[order] = np.maximum(heights, 0.05)
    return found


def accuracy(dataset: xr.Dataset) -> Figure:
    """Return a figure of period error and numerical damping against the step divided by the period.

    Args:
        dataset: Dataset that studies/stability.py wrote.
    """
    figure = Figure(figsize=(14, 5.6), layout="constrained")
    left, right = figure.subplots(1, 2)
    part = dataset["accuracy_frequency_step"].values / (2 * np.pi)
    columns = {left: "numerical_period_elongation", right: "numerical_damping_ratio"}
    both = xr.concat([dataset[name] for name in columns.values()], "column").transpose("method", ...)
    for i, names in enumerate(equal_rows(both)):
        how = {"color": COLOURS[i % len(COLOURS)]}
        style, label = (
            STYLES[i // len(COLOURS)],
            "\n".join(map(words, names)) + (": no error" if names == ["exact"] else ""),
        )
        for axis, name in columns.items():
            row = 100 * dataset[name].sel({"method": names[0]}).values
            below = np.abs(row).max() < 1e-10
            axis.loglog(part, np.full_like(part, np.nan) if below else np.abs(row), style, lw=1.4, label=label, **how)
            if not below:
                negative = np.flatnonzero(row < 0)[::3]
                axis.loglog(part[negative], np.abs(row)[negative], "v", ms=4, **how)
    for axis in columns:
        axis.set(xlabel="Step over period, h / T", ylim=(1e-8, 1e2), xlim=(part[0], part[-1]))
        axis.set_xticks([0.01, 0.02, 0.05, 0.1, 0.2], ["1/100", "1/50", "1/20", "1/10", "1/5"])
        axis.minorticks_off()
    left.set_ylabel("Size of the period error [%]")
    left.set_title("Period error without damping (triangles: the period is too short)", fontsize=TITLE)
    right.set_ylabel("Size of the numerical damping ratio [%]")
    right.set_title("Damping that a method adds (triangles: it feeds the motion)", fontsize=TITLE)
    none = "no numerical damping:\ncentral differences, Verlet,\nNewmark's two, exact"
    right.text(0.02, 0.97, none, transform=right.transAxes, va="top", fontsize=8)
    figure.legend(*left.get_legend_handles_labels(), loc="outside right center", fontsize=8)
    grids(left, right)
    return figure


def rk4(dataset: xr.Dataset) -> Figure:
    """Return a figure of undamped motions with RK4 at steps slightly below and above its stability limit.

    Args:
        dataset: Dataset that studies/stability.py wrote.
    """
    figure = Figure(figsize=(13, 4.8), layout="constrained")
    left, right = figure.subplots(1, 2)
    step = dataset["rk4_step"].values
    for i, (product, size) in enumerate(zip(dataset["rk4_frequency_step"].values, dataset["rk4_size"], strict=True)):
        inside = product < 8**0.5
        label = f"$\\omega h$ = {product:g}, {'inside' if inside else 'outside'}"
        left.loglog(step[1:], size[1:], color=COLOURS[i], lw=1.8, ls="--" if inside else "-", label=label)
    for count in dataset["rk4_steps_to_thousandfold"].values:
        left.plot(count, 1e3, "o", color="black", ms=4)
        where = {"xytext": (-4, 4), "textcoords": "offset points", "ha": "right"}
        left.annotate(f"{count:.0f} steps", (count, 1e3), fontsize=8, **where)
    left.set(xlabel="Steps", ylabel="Size of the motion over its first", ylim=(1e-6, 1e6), xlim=(1, step[-1]))
    left.set_title("RK4 about its limit of $\\omega h$ = 2.8284 (dots: grown a thousandfold)", fontsize=TITLE)
    left.legend(fontsize=8, loc="lower left")
    first, product = 24, 2.82
    drift = dataset["rk4_displacement"].sel(rk4_frequency_step=product)[: first + 1]
    fine = np.linspace(0, first, 2000)
    right.plot(fine, np.cos(product * fine) + np.sin(product * fine) / product, color=FAINT, lw=1, label="exact")
    right.plot(step[: first + 1], drift, "o-", color=COLOURS[1], ms=4, lw=1.2, label=f"RK4, $\\omega h$ = {product:g}")
    right.set(xlabel="Steps", ylabel="Displacement [m]", xlim=(0, first), ylim=(-1.3, 1.6))
    right.set_title("Just inside nothing grows, and nothing is right: 2.2 steps a period", fontsize=TITLE)
    right.legend(fontsize=8, ncols=2, loc="upper right")
    grids(left, right)
    return figure


FIGURES = {"growth": growth, "limits": limits, "accuracy": accuracy, "rk4": rk4}


def equal_rows(values: xr.DataArray) -> list[list[str]]:
    """Return groups of names along the first dimension; the values of the names in a group are equal within 1e-4."""
    groups: dict[int, list[str]] = {}
    rows = values.values
    for i, name in enumerate(values[values.dims[0]].values.tolist()):
        first = next((j for j in groups if np.allclose(rows[i], rows[j], rtol=1e-4, atol=1e-10)), i)
        groups.setdefault(first, []).append(name)
    return list(groups.values())


def grids(*axes: Axes) -> None:
    """Draw a pale grid in each of the axes."""
    for axis in axes:
        axis.grid(alpha=0.3)
