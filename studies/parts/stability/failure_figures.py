"""Figures of the study stability on chains, storey laws and time; each function draws one figure."""

from __future__ import annotations

import numpy as np
import xarray as xr
from matplotlib.figure import Figure

from parts.stability.figures import COLOURS, TITLE, grids, words


def chain(dataset: xr.Dataset) -> Figure:
    """Return a figure of the longest stable steps of a 20-storey chain with four kinds of damping.

    The right panel shows motions of a chain near the limit with stiffness-proportional damping.


    Args:
        dataset: Dataset that studies/stability.py wrote.
    """
    figure = Figure(figsize=(13, 4.6), layout="constrained")
    left, right = figure.subplots(1, 2)
    names = (
        "no damping",
        "5 % in\nevery mode",
        "Rayleigh, 5 % in\nmodes 1 and 3",
        "stiffness-proportional,\n5 % in mode 1",
    )
    place = np.arange(len(names))
    measured = 1e3 * dataset["measured_chain_step"].values
    left.bar(place, 1e3 * dataset["theoretical_chain_step"], 0.6, color="0.85", label="theory")
    left.plot(place, measured, "o", color=COLOURS[1], ms=6, label="measured from the kernel")
    left.plot(place, 1e3 * dataset["guarded_chain_step"], "_", color="black", ms=26, mew=1.6, label="what a run allows")
    above = {"xytext": (0, 7), "textcoords": "offset points", "ha": "center", "fontsize": 9}
    for at, value in zip(place, measured, strict=True):
        left.annotate(f"{value:.2f} ms", (at, value), **above)
    left.set_xticks(place, names, fontsize=8)
    left.set(ylabel="Longest step that holds [ms]", ylim=(0, 47))
    left.set_title("RK4 on a uniform chain of 20 storeys, first period 2 s", fontsize=TITLE)
    left.legend(fontsize=8, ncols=3, loc="upper center")
    step = dataset["chain_step"].values
    for share, size, colour in zip(dataset["chain_share"].values, dataset["chain_size"], COLOURS, strict=False):
        note = ", which holds with the other dampings" if share > 1.5 else ""
        right.semilogy(step, np.minimum(size, 1e20), color=colour, lw=1.5, label=f"{share:g} times the limit{note}")
        if share < 1.5:
            after = float(size.sel(chain_step=2000))
            right.plot(2000, after, "o", color=colour, ms=4)
            where = {"xytext": (6, -12 if share > 1 else 8), "textcoords": "offset points"}
            right.annotate(f"{after:.2g} after 2000 steps", (2000, after), fontsize=8, **where)
    right.set(xlabel="Steps", ylabel="Size of the motion over its first", xlim=(-60, 3000), ylim=(1e-5, 1e10))
    right.set_title("With stiffness-proportional damping, about its limit of 15.96 ms", fontsize=TITLE)
    right.legend(fontsize=8, loc="upper right")
    grids(left, right)
    return figure


def bouc_wen(dataset: xr.Dataset) -> Figure:
    """Return a figure of z of a pushed Bouc-Wen storey, and of its distance from the bound, for several steps.

    Args:
        dataset: Dataset that studies/stability.py wrote.
    """
    figure = Figure(figsize=(13, 4.8), layout="constrained")
    left, right = figure.subplots(1, 2)
    first = 30
    step = dataset["push_step"].values[: first + 1]
    for ratio, z, colour in zip(dataset["shown_push_ratio"].values, dataset["pushed_memory"], COLOURS, strict=False):
        left.plot(step, z[: first + 1], ".-", color=colour, lw=1, ms=5, label=f"{ratio:g} of the limit")
    left.axhline(1, color="black", lw=0.8)
    left.set(xlabel="Steps", ylabel="Hysteretic variable z", xlim=(0, first), ylim=(-1.4, 1.6))
    left.set_title("A storey of n = 2 pushed at a constant velocity under RK4: exact limit of z: 1", fontsize=TITLE)
    left.legend(fontsize=8, ncols=3, loc="upper center")
    ratio = dataset["push_ratio"].values
    rows = zip(dataset["exponent"].values, dataset["unsettled"].values, dataset["push_status"].values, strict=True)
    for (n, off, status), colour in zip(rows, COLOURS, strict=False):
        right.plot(ratio, off, color=colour, lw=1.4, label=f"n = {n:g}")
        right.plot(ratio[status == 3], off[status == 3], "o", color=colour, ms=3)
    right.axvline(1, color="black", lw=0.8)
    right.set(xlabel="Step over the limit, 2.785 $u_y$ / (n |v|)", ylabel="Largest |z - 1| at the end")
    right.set(xlim=(0.5, 2), ylim=(-0.1, 4))
    right.set_title("Beyond the limit z stays finite and wrong (dots: status unstable_step)", fontsize=TITLE)
    right.legend(fontsize=8, loc="upper left")
    grids(left, right)
    return figure


def yielding(dataset: xr.Dataset) -> Figure:
    """Return a figure of peak drifts of yielding storeys with two Newmark methods, and of histories that stay finite.

    Args:
        dataset: Dataset that studies/stability.py wrote.
    """
    figure = Figure(figsize=(13, 8.4), layout="constrained")
    axes = figure.subplots(2, 2)
    names = {
        "elastic": "elastic",
        "elastic_perfectly_plastic": "elastic-perfectly plastic",
        "bouc_wen": "softening (Bouc-Wen, n = 1)",
    }
    x = dataset["yielding_frequency_step"].values
    for axis, method in zip(axes[0], dataset["yielding_method"].values, strict=True):
        for (law, label), colour in zip(names.items(), COLOURS, strict=False):
            row = dataset.sel(yielding_method=method, yielding_law=law)
            peak, flagged = row["yielding_peak"].values, row["yielding_status"].values > 0
            peak = np.minimum(peak, 1e6)
            axis.loglog(x, peak, color=colour, lw=1.6, label=label)
            axis.loglog(x[flagged], np.minimum(peak, 7e3)[flagged], "o", color=colour, ms=3)
        axis.set(xlabel="Initial frequency times step, $\\omega h$", ylabel="Peak drift over the exact one")
        axis.set(xlim=(0.1, 10), ylim=(0.7, 1e4))
        limit = "no limit" if method == "newmark_average" else "limit $\\omega h = 2\\sqrt{3}$"
        title = f"{words(method)}: {limit} on linear systems (dots: flagged while it ran)"
        axis.set_title(title, fontsize=TITLE)
        if method == "newmark_linear":
            axis.axvline(2 * 3**0.5, color="black", lw=0.8)
        axis.legend(fontsize=8, loc="upper left")
    step, (fine, coarse) = dataset["yielding_step"].values, dataset["shown_yielding_step"].values
    law = "elastic_perfectly_plastic"
    told = ("bounded, status ok, wrong", "finite, and it ratchets on without end")
    for axis, method, what in zip(axes[1], dataset["yielding_method"].values, told, strict=True):
        rows = dataset["yielding_drift"].sel(yielding_method=method, yielding_law=law)
        for value, colour, style in ((fine, "black", "-"), (coarse, COLOURS[1], ".-")):
            time = value * step / (2 * np.pi)
            axis.plot(
                time, rows.sel(shown_yielding_step=value), style, color=colour, lw=1, label=f"$\\omega h$ = {value:g}"
            )
        axis.set(xlabel="Time over the initial period", ylabel="Drift over yield drift", xlim=(0, 20))
        axis.set_title(f"{words(method)}, {names[law]}: {what}", fontsize=TITLE)
        top = 1.1 * float(rows[-1, : int(20 * 2 * np.pi / coarse) + 1].max())
        axis.set_ylim(-0.05 * top, top)
        axis.legend(fontsize=8)
    figure.suptitle("Free vibration of storeys whose elastic amplitude is three yield drifts")
    grids(*axes.flat)
    return figure


def clock(dataset: xr.Dataset) -> Figure:
    """Return a figure of the error of the frame of studies/seed_frame.py against the step, and of accumulated time.

    The errors are those in float32 and float64.


    Args:
        dataset: Dataset that studies/stability.py wrote.
    """
    figure = Figure(figsize=(13, 4.8), layout="constrained")
    left, right = figure.subplots(1, 2)
    step = dataset["clock_step"].values
    lines = {
        "float32_accumulated_time": ("float32, time added up (numpy)", "s-", COLOURS[1]),
        "float32": ("float32, steps counted (kernel)", "o-", COLOURS[0]),
        "float32_in_numpy": ("float32, steps counted (numpy)", "o:", COLOURS[5]),
        "float64": ("float64, steps counted (kernel)", "^-", COLOURS[2]),
    }
    for name, (label, style, colour) in lines.items():
        left.loglog(step, dataset[f"{name}_error"], style, color=colour, ms=5, label=label)
    left.set(xlabel="Step [s]", ylabel="Largest error over the peak", ylim=(1e-14, 10))
    left.set_title("Published three-storey frame over 10 s under RK4", fontsize=TITLE)
    left.legend(fontsize=8, loc="lower right")
    for each, off, colour in zip(step, dataset["clock_error"].values, COLOURS, strict=False):
        right.semilogy(dataset["clock_time"], 1e3 * np.abs(off), color=colour, lw=1.4, label=f"h = {each:g} s")
    right.set(xlabel="Time [s]", ylabel="Size of clock less time [ms]", xlim=(0, 10), ylim=(1e-5, 1e3))
    right.set_title("A float32 clock to which the step is added", fontsize=TITLE)
    right.legend(fontsize=8, loc="lower right", ncols=2)
    grids(left, right)
    return figure


FIGURES = {"chain": chain, "bouc_wen": bouc_wen, "yielding": yielding, "clock": clock}
