<<<<<<< HEAD
"""The figures of the study benchmark: other programs, scaling, and the start of the main job."""
=======
"""Figure of the study benchmark: speeds, peers, scaling, main job and start times."""
>>>>>>> h/lang_docs

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

<<<<<<< HEAD
# Colours by Okabe and Ito, distinct also for colour-blind readers.
ORANGE, BLUE, GREEN, PURPLE, SKY, YELLOW = "#D55E00", "#0072B2", "#009E73", "#CC79A7", "#56B4E9", "#E69F00"
=======
# Colours of Okabe and Ito, which colour-blind readers can distinguish.
BLACK, ORANGE, BLUE, GREEN, PURPLE, SKY, YELLOW = (
    "black",
    "#D55E00",
    "#0072B2",
    "#009E73",
    "#CC79A7",
    "#56B4E9",
    "#E69F00",
)
LAW_COLOURS = {"elastic": GREEN, "bilinear": PURPLE, "bouc_wen": BLUE}
LAW_NAMES = {"elastic": "elastic", "bilinear": "bilinear", "bouc_wen": "Bouc-Wen"}
DTYPE_STYLES = {"float32": "o-", "float64": "s:"}
HAND_NAMES = {"cpu": "C++ by hand", "cuda": "CUDA by hand"}
SHARES = (0.3, 0.5, 0.7, 1, 1.5, 2, 3, 5, 10, 20)  # ticks of the axis of relative speeds
FULL = 0.75  # share of the highest speed at which a device counts as busy
USUAL_STOREYS = 20  # in taller buildings, the hand-written CUDA code needs more registers than there are (float32)
TITLE, SMALL = 11, 9  # font sizes
>>>>>>> h/lang_docs
PART_COLOURS = (SKY, BLUE, YELLOW, PURPLE, GREEN, ORANGE)
TITLE, TEXT = 15, 12  # font sizes
LAW, STOREYS, DTYPE = "bouc_wen", 5, "float32"  # the case of the figures
CASE = f"{STOREYS} Bouc-Wen storeys, {DTYPE}"
FULL = 0.75  # of the highest speed


<<<<<<< HEAD
def draw(result: xr.Dataset) -> dict[str, Figure]:
    """Return the figures by name; each has one message.
=======
def draw(result: xr.Dataset) -> Figure:
    """Return the figure: speed of kernels and peers on each device, scaling, parts of the main job, and start times.
>>>>>>> h/lang_docs

    Args:
        result: Dataset that studies/benchmark.py wrote.
    """
<<<<<<< HEAD
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
=======
    result = result.isel(measurement=np.flatnonzero(result["method"] != "stoermer"))  # all panels show RK4
    kernels = measurements(result, "kernels")
    peers, own = beside_peers(result), kernels[kernels["peer"] == "warpdyn"]
    devices = [device for device in ("cuda:0", "cpu") if device in set(own["device"])]
    panels = []
    for device in devices:
        panels.append([lambda axis, d=device: _kernels(axis, kernels[kernels["device"] == d], d)])
        panels[-1].append(lambda axis, d=device: _peers(axis, peers[peers["device"] == d], own[own["device"] == d], d))
    scaling = [lambda axis: _samples(axis, measurements(result, "samples")), lambda axis: _devices(axis, result)]
    last = [lambda axis: _jobs(axis, result), lambda axis: _starts(axis, result)]
    columns = [*zip(*panels, strict=True), scaling, last] if len(devices) > 1 else [panels[0], scaling, last]
    figure = Figure(figsize=(5.2 * len(columns), 9.5), layout="constrained")
    for column, drawers in zip(figure.subplots(2, len(columns)).T, columns, strict=True):
        for axis, drawer in zip(column, drawers, strict=True):
            drawer(axis)
    gpu = "" if result.attrs["gpu"] == "none" else f"{result.attrs['gpu']}; "
    figure.suptitle(f"warpdyn and its peers on one machine: {gpu}{result.attrs['processor']}", fontsize=13)
    figure.supxlabel(result.attrs["source"], fontsize=SMALL)
>>>>>>> h/lang_docs
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


<<<<<<< HEAD
def _whole(value: float, _: int) -> str:
    """Return a tick's number in words or digits."""
    return f"{value / 1e6:g} million" if value >= 1e6 else f"{value:,g}"


def _machine(result: xr.Dataset) -> str:
    gpu = "" if result.attrs["gpu"] == "none" else f"{result.attrs['gpu']}; "
    return f"{gpu}{result.attrs['processor']}"
=======
def _kernels(axis: Axes, table: pd.DataFrame, device: str) -> None:
    """Draw the speed against the number of storeys, relative to hand-written code, or in DOF-steps/s without it."""
    table = table[(table["status"] == "measured") & (table["substeps"] == 1) & (table["recorders"] == "drift")]
    keys = ["law", "dtype", "storeys"]
    own = table[table["peer"] == "warpdyn"].set_index(keys)["dof_steps_per_second"]
    hand = table[table["peer"].isin(BY_HAND)].set_index(keys)["dof_steps_per_second"]
    shares = (own / hand).dropna()
    is_share = not shares.empty
    shown = shares if is_share else own
    for (law, dtype), values in shown.groupby(level=["law", "dtype"]):
        values = values.droplevel(["law", "dtype"]).sort_index()
        axis.plot(values.index, values, DTYPE_STYLES[dtype], color=LAW_COLOURS[law], ms=4)
    for law, colour in LAW_COLOURS.items():
        axis.plot([], [], color=colour, lw=2, label=LAW_NAMES[law])
    for dtype, style in DTYPE_STYLES.items():
        axis.plot([], [], style, color="0.3", ms=4, label=dtype)
    storeys = sorted(shown.index.unique("storeys"))
    axis.set(xscale="log", yscale="log", xlabel="Storeys", xticks=storeys)
    axis.xaxis.set_major_formatter(ScalarFormatter())
    axis.xaxis.set_minor_formatter(NullFormatter())
    least, most = axis.get_ylim()
    axis.set_ylim(least, most * (most / least) ** 0.2)  # space for the legend at the top
    axis.legend(fontsize=SMALL, ncols=2, loc="upper left")
    axis.grid(alpha=0.3, which="both")
    if not is_share:
        axis.set_ylabel("DOF-steps/s, RK4")
        axis.set_title(f"Kernels on {_device_words(device)}: up to {_plain(shown.max())} DOF-steps/s", fontsize=TITLE)
        return
    name = HAND_NAMES[device.split(":")[0]]
    axis.axhline(1, color="black", lw=1)
    axis.set_ylabel(f"Speed over that of {name}, RK4")
    axis.set_yticks([share for share in SHARES if 0.8 * shown.min() < share < 1.25 * shown.max()])
    axis.yaxis.set_major_formatter(FuncFormatter(lambda value, _: f"{value:g}"))
    axis.yaxis.set_minor_formatter(NullFormatter())
    levels = shown.index.get_level_values
    usual = shown[(levels("storeys") <= USUAL_STOREYS) & (levels("dtype") == "float32")]
    if usual.empty:
        axis.set_title(f"Kernels on {_device_words(device)} and {name}", fontsize=TITLE)
        return
    axis.set_title(
        f"Kernels on {_device_words(device)} have {usual.min():.2f} to {usual.max():.2f} of the speed of\n"
        f"{name} up to {USUAL_STOREYS} storeys in float32, {usual.median():.2f} in the median",
        fontsize=TITLE,
    )


def _peers(axis: Axes, peers: pd.DataFrame, own: pd.DataFrame, device: str) -> None:
    """Draw one bar per peer, for 5 storeys if measured, with the ratio of the speed of warpdyn to its speed."""
    chosen = peers[(peers["law"] == "bouc_wen") & (peers["dtype"] == "float32") & (peers["status"] == "measured")]
    chosen = chosen[chosen["recorders"] == "drift"]
    if chosen.empty:
        axis.set_title(f"The same work by others on {_device_words(device)}", fontsize=TITLE)
        axis.text(0.5, 0.5, "no peer is installed", ha="center", transform=axis.transAxes)
        return
    storeys = 5 if 5 in set(chosen["storeys"]) else chosen["storeys"].iloc[0]
    chosen = chosen[chosen["storeys"] == storeys].sort_values("dof_steps_per_second")
    same = own[(own["law"] == "bouc_wen") & (own["dtype"] == "float32") & (own["recorders"] == "drift")]
    speed = same[(same["storeys"] == storeys) & (same["substeps"] == 1)]["dof_steps_per_second"].iloc[0]
    names = [_name(row) for row in chosen.itertuples()] + ["warpdyn"]
    speeds = [*chosen["dof_steps_per_second"], speed]
    axis.barh(names, speeds, color=["0.65"] * len(chosen) + [BLUE])
    texts = [
        rf" {_plain(row.dof_steps_per_second)}, warpdyn {_plain(speed / row.dof_steps_per_second)}$\times$"
        for row in chosen.itertuples()
    ]
    for place, (length, text) in enumerate(zip(speeds, [*texts, f" {_plain(speed)}"], strict=True)):
        axis.text(length, place, text, va="center", fontsize=SMALL)
    tools = chosen[~chosen["peer"].isin(BY_HAND)]
    if tools.empty:
        axis.set_title(f"The same work by hand on {_device_words(device)}", fontsize=TITLE)
    else:
        nearest = tools.iloc[-1]
        axis.set_title(
            f"On {_device_words(device)} {LABELS.get(nearest.peer, nearest.peer)}, the nearest tool,\n"
            f"takes {_plain(speed / nearest.dof_steps_per_second)} times as long as warpdyn",
            fontsize=TITLE,
        )
    decades = np.log10(max(speeds) / min(speeds)) + 0.5
    axis.set(xscale="log", xlabel=f"DOF-steps/s, {storeys} storeys, Bouc-Wen, float32")
    axis.set_xlim(min(speeds) / 3, max(speeds) * 10 ** (0.9 * decades))  # space for the texts right of the bars
    axis.grid(alpha=0.3, axis="x")
>>>>>>> h/lang_docs


def _finish(figure: Figure, axes: Axes, title: str, words: str) -> None:
    figure.suptitle(title, fontsize=TITLE, fontweight="bold", x=0.02, ha="left")
    axes.tick_params(labelsize=TEXT)
    axes.xaxis.label.set_size(TEXT)
    axes.yaxis.label.set_size(TEXT)
    axes.spines[["top", "right"]].set_visible(False)
    figure.supxlabel(words, fontsize=11, x=0.02, ha="left", color="0.35")


<<<<<<< HEAD
def scaling(table: pd.DataFrame) -> Figure:
    """Draw the histories per second over the number of samples: in kernels, and in the whole of simulate."""
    figure = Figure(figsize=(10.0, 5.5), layout="constrained")
    axes = figure.subplots()
    told = []
=======
def _plain(value: float) -> str:
    """Return a number with two digits as text; very large and very small numbers are written with powers of ten."""
    if 0.01 <= value < 1e5:
        return f"{float(f'{value:.2g}'):,g}"
    mantissa, exponent = f"{value:.1e}".split("e")
    return rf"${mantissa}\cdot10^{{{int(exponent)}}}$"


def _samples(axis: Axes, table: pd.DataFrame) -> None:
    """Draw the speed [DOF-steps/s] against the number of samples, for the kernels alone and for all of `simulate`."""
>>>>>>> h/lang_docs
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


<<<<<<< HEAD
def start(result: xr.Dataset) -> Figure:
    """Draw the time of a new process until its first run has finished, with an empty and a filled kernel cache."""
    figure = Figure(figsize=(10.0, 1.9 + 0.55 * result.sizes["start"]), layout="constrained")
    axes = figure.subplots()
    places = np.arange(result.sizes["start"])
=======
def _devices(axis: Axes, result: xr.Dataset) -> None:
    """Draw the speed of several CPU threads and of several GPUs, divided by the speed of one."""
    largest, told, names = 1, [], {"threads": "CPU threads", "gpus": "GPUs"}
    for part, column, colour in (("threads", "threads", ORANGE), ("gpus", "gpus", BLUE)):
        table = measurements(result, part)
        table = table[table["status"] == "measured"]
        if len(table) < (1 if part == "threads" else 2):
            continue
        speed = table["dof_steps_per_second"] / table["dof_steps_per_second"].iloc[0]
        axis.plot(table[column], speed, "o-", color=colour, label=names[part])
        for count, times in zip(table[column], speed, strict=True):
            axis.annotate(f"{times:.2f}", (count, times), textcoords="offset points", xytext=(4, -11), fontsize=SMALL)
        largest = max(largest, table[column].max())
        told.append(f"{table[column].iloc[-1]} {names[part]} run {speed.iloc[-1]:.2g} times as fast as one")
    axis.plot([1, largest], [1, largest], color="0.6", lw=0.8, ls=":", label="in proportion")
    axis.set(xlabel="Threads, or GPUs", ylabel="Times as fast as one")
    axis.set_xscale("log", base=2)
    axis.set_yscale("log", base=2)
    for side in (axis.xaxis, axis.yaxis):
        side.set_major_formatter(FuncFormatter(lambda value, _: f"{value:g}"))
    axis.set_title("\n".join(told) or "More threads and GPUs", fontsize=TITLE)
    axis.legend(fontsize=SMALL)
    axis.grid(alpha=0.3)


def _jobs(axis: Axes, result: xr.Dataset) -> None:
    """Draw the share of each part of the main job in its time [%]."""
    names, left = [], np.zeros(result.sizes["job"])
    seconds = result["seconds_of_part"].values
    shares = 100 * np.maximum(seconds, 0) / np.maximum(seconds, 0).sum(axis=1, keepdims=True)
    places = np.arange(result.sizes["job"])[::-1]
    for part, share, colour in zip(result["job_part"].values, shares.T, PART_COLOURS, strict=True):
        axis.barh(places, share, left=left, color=colour, label=part, height=0.5)
        left += share
    for job in range(result.sizes["job"]):
        row = result.isel(job=job)
        names.append(f"{row['job_device'].item()}\n{row['job_histories'].item():,}\nhistories")
        text = (
            f"{row['seconds_of_part'].sum().item():.2f} s in all, kernels "
            f"{row['seconds_of_part'].sel(job_part='kernels').item():.3g} s\n"
            f"to the dataset {row['ratio_to_dataset'].item():.2f} times that, "
            f"to netCDF {row['ratio_to_netcdf'].item():.2f}"
        )
        axis.text(0, places[job] + 0.28, text, fontsize=SMALL, va="bottom")
    axis.set_yticks(places, names, fontsize=SMALL)
    axis.set(xlabel="Share of the time [%]", ylim=(-0.9, len(names)))
    axis.legend(fontsize=SMALL - 0.5, ncols=3, loc="lower center")
    kernels = shares[:, list(result["job_part"].values).index("kernels")]
    axis.set_title(
        "The main job, from its scene to a file:\n"
        f"kernels take {kernels.min():.0f} to {kernels.max():.0f} % of the time",
        fontsize=TITLE,
    )


def _starts(axis: Axes, result: xr.Dataset) -> None:
    """Draw the time from the start of a new process to the end of its first run [s]."""
    places = np.arange(result.sizes["start"])[::-1]
>>>>>>> h/lang_docs
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
