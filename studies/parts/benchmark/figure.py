"""The figures of the study benchmark: other programs, scaling, and the start of a new process."""

from __future__ import annotations

from collections.abc import Iterable

import numpy as np
import pandas as pd
import xarray as xr
from matplotlib.axes import Axes
from matplotlib.figure import Figure
from matplotlib.ticker import FuncFormatter, NullFormatter

from parts.benchmark.cases import LABELS
from parts.benchmark.report import BY_HAND, beside_peers, measurements

# Colours by Okabe and Ito, distinct also for colour-blind readers.
ORANGE, BLUE, GREEN, PURPLE, SKY, YELLOW = "#D55E00", "#0072B2", "#009E73", "#CC79A7", "#56B4E9", "#E69F00"
PART_COLOURS = (SKY, BLUE, YELLOW, PURPLE, GREEN, ORANGE)
TITLE, TEXT = 15, 12  # font sizes
LAW, STOREYS, DTYPE = "bouc_wen", 5, "float32"  # the case of the figures
CASE = f"{STOREYS} Bouc-Wen storeys, {DTYPE}"
FULL = 0.75  # of the highest speed


def draw(result: xr.Dataset) -> dict[str, Figure]:
    """Return the figures by name; each has one message.

    Args:
        result: Dataset written by studies/benchmark.py.
    """
    result = result.isel(measurement=np.flatnonzero(result["method"] != "stoermer"))  # the figures are for RK4
    figures = {"benchmark": speed_of_others(result), "benchmark_scaling": scaling(measurements(result, "samples"))}
    return figures | {"benchmark_start": start(result)}


def speed_of_others(result: xr.Dataset) -> Figure:
    """Draw the run time of every program over that of warpdyn's kernel, as dots: one group per device."""
    groups = {device: _factors(result, device) for device in ("cuda:0", "cpu")}
    groups = {device: factors for device, factors in groups.items() if factors}
    rows = sum(len(factors) + 1 for factors in groups.values())
    figure = Figure(figsize=(10.0, 1.6 + 0.36 * max(rows, 3)), layout="constrained")
    axes = figure.subplots()
    place, places, names = 0.0, [], []
    for device, factors in groups.items():
        colour = BLUE if device == "cpu" else ORANGE
        axes.text(0.0, place, _device_words(device), transform=axes.get_yaxis_transform(), **_heading(colour))
        for name, factor in factors.items():
            place += 1
            axes.plot(factor, place, "o", color=colour, ms=9)
            offset, side = ((-9, 0), "right") if factor < 1 else ((9, 0), "left")
            axes.annotate(
                _plain(factor), (factor, place), offset, textcoords="offset points", va="center", ha=side, fontsize=TEXT
            )
            places.append(place)
            names.append(name)
        place += 1
    axes.axvline(1, color="0.2", lw=1.5)
    axes.text(1.08, -0.7, "warpdyn = 1", va="center", fontsize=TEXT, fontweight="bold")
    axes.set_yticks(places, names)
    axes.set(xscale="log", ylim=(place - 0.4, -1.1), xlabel="Run time divided by that of warpdyn (same motions)")
    every = [factor for factors in groups.values() for factor in factors.values()]
    axes.set_xlim(min([1.0, *every]) / 8, 4 * max([1.0, *every]))
    axes.xaxis.set_major_formatter(FuncFormatter(_whole))
    axes.grid(axis="x", alpha=0.3)
    _finish(figure, axes, _message(groups), f"{CASE}; peak drifts agree. {_machine(result)}")
    return figure


def _heading(colour: str) -> dict:
    return {"fontsize": TEXT, "fontweight": "bold", "color": colour, "va": "center", "ha": "left"}


def _message(groups: dict[str, dict[str, float]]) -> str:
    """Return the title: code written by hand, and the fastest and the slowest other program."""
    by_hand = {LABELS[name] for name in BY_HAND}
    factors = [(name, factor) for of_device in groups.values() for name, factor in of_device.items()]
    tools = [factor for name, factor in factors if name not in by_hand]
    hand = [factor for name, factor in factors if name in by_hand]
    told = f"Code written by hand takes {' and '.join(map(_plain, hand))} times as long as warpdyn" if hand else ""
    if not tools:
        return told or "Other programs and warpdyn"
    range_of_tools = " to ".join(dict.fromkeys(map(_plain, (min(tools), max(tools)))))
    if told:
        return f"{told},\nother programs {range_of_tools} times"
    return f"Other programs take {range_of_tools} times as long as warpdyn"


def _factors(result: xr.Dataset, device: str) -> dict[str, float]:
    """Return the run time of each program over warpdyn's at its whole step, the fastest first."""
    kernels = measurements(result, "kernels")
    own = kernels[(kernels["peer"] == "warpdyn") & (kernels["substeps"] == 1)]
    own, peers = (_of_case(table, device) for table in (own, beside_peers(result)))
    if own.empty:
        return {}
    speed = own["dof_steps_per_second"].iloc[0]
    # A peer that needs shorter steps does more work for the same motion.
    times = {_name(row): speed * row.substeps / row.dof_steps_per_second for row in peers.itertuples()}
    return dict(sorted(times.items(), key=lambda each: each[1]))


def _of_case(table: pd.DataFrame, device: str) -> pd.DataFrame:
    is_case = (table["law"] == LAW) & (table["dtype"] == DTYPE) & (table["recorders"] == "drift")
    is_case &= (table["device"] == device) & (table["status"] == "measured")
    storeys = table.loc[is_case, "storeys"]
    return table[is_case & (table["storeys"] == (STOREYS if (storeys == STOREYS).any() else storeys.min()))]


def _name(row: object) -> str:
    steps = "" if row.substeps == 1 else f" (steps of 1/{row.substeps})"
    return LABELS.get(row.peer, row.peer) + steps


def _plain(value: float) -> str:
    """Return a number in two digits."""
    return f"{float(f'{value:.2g}'):,g}"


def _device_words(device: str) -> str:
    return "one CPU core" if device == "cpu" else "one GPU"


def _whole(value: float, _: int) -> str:
    """Return a tick's number in words or digits."""
    return f"{value / 1e6:g} million" if value >= 1e6 else f"{value:,g}"


def _machine(result: xr.Dataset) -> str:
    gpu = "" if result.attrs["gpu"] == "none" else f"{result.attrs['gpu']}; "
    return f"{gpu}{result.attrs['processor']}"


def _finish(figure: Figure, axes: Axes, title: str, words: str) -> None:
    figure.suptitle(title, fontsize=TITLE, fontweight="bold", x=0.02, ha="left")
    axes.tick_params(labelsize=TEXT)
    axes.xaxis.label.set_size(TEXT)
    axes.yaxis.label.set_size(TEXT)
    axes.spines[["top", "right"]].set_visible(False)
    figure.supxlabel(words, fontsize=11, x=0.02, ha="left", color="0.35")


def scaling(table: pd.DataFrame) -> Figure:
    """Draw the histories per second over the number of samples: in kernels, and in the whole of simulate."""
    figure = Figure(figsize=(10.0, 5.5), layout="constrained")
    axes = figure.subplots()
    told = []
    for colour, (device, rows) in zip((BLUE, ORANGE), table.groupby("device", sort=False), strict=False):
        name = f"{rows['threads'].iloc[0]} CPU threads" if device == "cpu" else "one GPU"
        samples = rows["run_samples"].values
        for seconds, style, words in (("seconds", "o-", "kernels"), ("seconds_in_simulate", "o--", "simulate()")):
            rates = samples / rows[seconds].values
            axes.plot(samples, rates, style, color=colour, mfc=colour if style == "o-" else "white", lw=2, ms=6)
            offset = (8, 3) if style == "o-" else (8, -10)
            axes.annotate(
                f"{name}, {words}", (samples[-1], rates[-1]), offset, textcoords="offset points", color=colour,
                fontsize=TEXT,
            )  # fmt: skip
        rates = samples / rows["seconds"].values
        full = samples[rates >= FULL * rates.max()][0]
        told.append(f"{'A GPU' if device != 'cpu' else 'A CPU'} is busy from {full:,} samples on")
    axes.set(xlabel="Samples", ylabel="Histories per second", xscale="log", yscale="log")
    axes.set_xlim(table["run_samples"].min() / 1.3, table["run_samples"].max() * 30)
    axes.xaxis.set_major_formatter(FuncFormatter(_whole))
    axes.yaxis.set_major_formatter(FuncFormatter(_whole))
    axes.yaxis.set_minor_formatter(NullFormatter())
    axes.grid(alpha=0.3)
    steps = table["steps"].iloc[0]
    _finish(figure, axes, told[-1] if told else "Speed over samples", f"{CASE}; RK4, {steps:,} steps; peak drifts")
    return figure


def start(result: xr.Dataset) -> Figure:
    """Draw the time of a new process until its first run has finished, with an empty and a filled kernel cache."""
    figure = Figure(figsize=(10.0, 1.9 + 0.55 * result.sizes["start"]), layout="constrained")
    axes = figure.subplots()
    places = np.arange(result.sizes["start"])
    importing, first, second = (result[f"start_{name}"].values for name in ("importing", "first_run", "second_run"))
    left = np.zeros(places.size)
    parts = {"import": importing, "compile or load kernels": first - second, "run": second}
    for (name, seconds), colour in zip(parts.items(), (SKY, YELLOW, BLUE), strict=True):
        axes.barh(places, seconds, left=left, color=colour, label=name, height=0.6)
        left = left + seconds
    for place, total in zip(places, left, strict=True):
        axes.text(total, place, f"  {total:.1f} s", va="center", fontsize=TEXT)
    axes.set_yticks(places, list(_names_of_starts(result)))
    axes.set(xlabel="Time from the start of Python [s]", xlim=(0, 1.15 * left.max()), ylim=(places.size - 0.4, -0.6))
    axes.legend(fontsize=TEXT, ncols=3, loc="upper center", bbox_to_anchor=(0.5, -0.25), frameon=False)
    compiles = result["start_cache"].values == "empty cache"
    title = "Time until the first result of a new process"
    if compiles.any() and not compiles.all():
        title = (
            f"First result of a new process: after {left[~compiles].max():.0f} s, "
            f"and {left[compiles].max():.0f} s if kernels are compiled"
        )
    _finish(figure, axes, title, _machine(result))
    return figure


def _names_of_starts(result: xr.Dataset) -> Iterable[str]:
    for device, cache in zip(result["start_device"].values, result["start_cache"].values, strict=True):
        kernels = cache if cache == "empty cache" else "kernels compiled"
        yield f"{'CPU' if device == 'cpu' else 'GPU'}, {kernels}"
