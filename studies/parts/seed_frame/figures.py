"""Figures of the study seed_frame: each function draws one figure of the dataset of the study."""

from __future__ import annotations

import numpy as np
import xarray as xr
from matplotlib.axes import Axes
from matplotlib.figure import Figure

# Colours of Okabe and Ito, which colour-blind readers can distinguish; one per degree of freedom or storey.
COLOURS = ("#0072B2", "#E69F00", "#009E73")
PUBLISHED, MODAL, NEUTRAL = "#D55E00", "#CC79A7", "0.25"


def overview(dataset: xr.Dataset) -> Figure:
    """Return a figure of histories, drifts, phase plane, shapes, energies, modes, and computed and published peaks.

    Args:
        dataset: Dataset that studies/seed_frame.py wrote.
    """
    figure = Figure(figsize=(15, 11), layout="constrained")
    axes = figure.subplots(3, 3)
    draw = (_displacement, _velocity, _acceleration, _drift, _phase_plane, _shape, _energy, _modes, _peaks)
    for panel, axis in zip(draw, axes.flat, strict=True):
        panel(axis, dataset)
        axis.grid(alpha=0.3)
        axis.title.set_fontsize(10)
    figure.suptitle(f"{dataset.attrs['title']}: RK4 at {1000 * dataset.attrs['step']:g} ms, float64")
    return figure


def convergence(dataset: xr.Dataset) -> Figure:
    """Return a figure of the displacement error of RK4 over time, and of its largest value against the step.

    Args:
        dataset: Dataset that studies/seed_frame.py wrote.
    """
    figure = Figure(figsize=(11, 4.4), layout="constrained")
    over_time, over_step = figure.subplots(1, 2)
    error = (dataset["displacement"] - dataset["exact_displacement"]).values * 1e12
    for dof, colour in enumerate(COLOURS):
        over_time.plot(dataset["time"], error[:, dof], color=colour, lw=1, label=f"u{dof + 1}")
    over_time.set(xlabel="Time [s]", ylabel="RK4 less exact displacement [pm]", xlim=(0, float(dataset["time"][-1])))
    over_time.set_title(f"Error at a step of {1000 * dataset.attrs['step']:g} ms", fontsize=10)
    _legend_above(over_time, 3)
    step, largest = dataset["step"].values, dataset["convergence"].values
    over_step.loglog(step, largest, "o", color=COLOURS[0], label="RK4, largest error")
    over_step.loglog(step, largest[-1] * (step / step[-1]) ** 4, "--", color=NEUTRAL, lw=1, label="fourth order")
    over_step.set(xlabel="Step [s]", ylabel="Largest displacement error [m]")
    over_step.set_xticks(step, [f"{each:g}" for each in step])
    over_step.minorticks_off()
    over_step.set_title(f"Observed order {dataset.attrs['observed_order_overall']:.3f}", fontsize=10)
    over_step.legend(fontsize=8)
    for axis in (over_time, over_step):
        axis.grid(alpha=0.3)
    return figure


def _history(axis: Axes, dataset: xr.Dataset, name: str, title: str, label: str, factor: float) -> None:
    """Draw the history of each degree of freedom, with the exact history as a thin dotted line on top."""
    time = dataset["time"].values
    for dof, colour in enumerate(COLOURS):
        axis.plot(time, factor * dataset[name].values[:, dof], color=colour, lw=1.8, label=f"u{dof + 1}")
    for dof in range(3):
        exact = factor * dataset[f"exact_{name}"].values[:, dof]
        axis.plot(time, exact, ":", color="black", lw=0.8, label="exact" if dof == 2 else None)
    _time_axis(axis, dataset)
    axis.set(ylabel=label, title=title)


def _time_axis(axis: Axes, dataset: xr.Dataset) -> None:
    axis.set(xlabel="Time [s]", xlim=(0, float(dataset["time"][-1])))


def _legend_above(axis: Axes, columns: int) -> None:
    """Draw the legend in one row, and make space for it above the curves."""
    low, high = axis.get_ylim()
    axis.set_ylim(low, high + 0.22 * (high - low))
    axis.legend(ncols=columns, loc="upper center", fontsize=8, columnspacing=1.0, handlelength=1.4)


def _displacement(axis: Axes, dataset: xr.Dataset) -> None:
    _history(axis, dataset, "displacement", "Displacement: u3 = 2 u1", "Displacement [mm]", 1000)
    for dof, colour in enumerate(COLOURS):
        peak, time = (float(dataset[f"published_{name}"][dof]) for name in ("peak_displacement", "time_of_peak"))
        name = "published peaks" if dof == 2 else None
        axis.plot(time, 1000 * peak, "D", ms=4.5, mfc=colour, mec="black", mew=0.8, zorder=3, ls="", label=name)
    _legend_above(axis, 5)


def _velocity(axis: Axes, dataset: xr.Dataset) -> None:
    _history(axis, dataset, "velocity", "Velocity", "Velocity [m/s]", 1)
    _legend_above(axis, 4)


def _acceleration(axis: Axes, dataset: xr.Dataset) -> None:
    _history(axis, dataset, "acceleration", "Acceleration", "Acceleration [m/s$^2$]", 1)
    _legend_above(axis, 4)


def _drift(axis: Axes, dataset: xr.Dataset) -> None:
    for storey, colour in enumerate(COLOURS):
        drift = 1000 * dataset["storey_drift"].values[:, storey]
        axis.plot(dataset["time"], drift, color=colour, lw=1.5, label=f"storey {storey + 1}")
    _time_axis(axis, dataset)
    axis.set(ylabel="Storey drift [mm]", title="Storey drifts")
    _legend_above(axis, 3)


def _phase_plane(axis: Axes, dataset: xr.Dataset) -> None:
    displacement, velocity = 1000 * dataset["displacement"].values[:, 1], dataset["velocity"].values[:, 1]
    axis.plot(displacement, velocity, color=COLOURS[1], lw=1)
    axis.plot(displacement[0], velocity[0], "o", color="black", ms=5, label="at rest, t = 0")
    axis.plot(displacement[-1], velocity[-1], "s", color="black", ms=5, label=f"t = {float(dataset['time'][-1]):g} s")
    axis.set(xlabel="Displacement u2 [mm]", ylabel="Velocity of u2 [m/s]", title="Phase plane of degree of freedom 2")
    axis.legend(fontsize=8, loc="upper right")


def _shape(axis: Axes, dataset: xr.Dataset) -> None:
    floors = np.arange(4)
    peak_time = float(dataset["time_of_peak"][2])
    at_peak = dataset["displacement"].sel(time=peak_time, method="nearest").values
    shapes = {
        "force held at its amplitude": (dataset["static_displacement"].values, "s-", NEUTRAL),
        "steady state, in phase": (dataset["steady_state_in_phase"].values, "^--", COLOURS[0]),
        f"at the peak of u3, {peak_time:.3f} s": (at_peak, "o-", COLOURS[2]),
        "peaks, either way": (dataset["peak_displacement"].values, ":", MODAL),
    }
    for name, (shape, style, colour) in shapes.items():
        axis.plot(1000 * np.array([0, *shape]), floors, style, color=colour, ms=5, label=name)
    axis.plot(-1000 * np.array([0, *dataset["peak_displacement"].values]), floors, ":", color=MODAL)
    axis.axvline(0, color="black", lw=0.8)
    axis.set(xlabel="Displacement [mm]", ylabel="Degree of freedom (0: ground)", title="Static and dynamic shape")
    axis.set(yticks=floors, ylim=(0, 3.3))
    _legend_above(axis, 2)


def _energy(axis: Axes, dataset: xr.Dataset) -> None:
    energy = {name: dataset[f"{name}_energy"].values for name in ("viscous", "strain", "kinetic", "input")}
    parts = [energy["viscous"], energy["strain"], energy["kinetic"]]
    colours = (MODAL, COLOURS[2], COLOURS[1])
    names = ["damped", "stored: strain", "stored: kinetic"]
    axis.stackplot(dataset["time"], *parts, colors=colours, labels=names, lw=0, alpha=0.85)
    axis.plot(dataset["time"], energy["input"], color="black", lw=1, label="put in")
    _time_axis(axis, dataset)
    axis.set(ylabel="Energy [J]", title="Energy put in, damped and stored")
    _legend_above(axis, 4)


def _modes(axis: Axes, dataset: xr.Dataset) -> None:
    time, share = dataset["time"].values, 1000 * dataset["modal_displacement"].values[:, :, 2]
    for mode, colour in enumerate(COLOURS):
        name = f"mode {mode + 1} ({float(dataset['period'][mode]):.3g} s)"
        axis.plot(time, share[:, mode], color=colour, lw=1.2, label=name)
    axis.plot(time, 1000 * dataset["displacement"].values[:, 2], color="0.75", lw=3, zorder=1, label="RK4")
    axis.plot(time, share.sum(axis=1), ":", color="black", lw=0.9, label="sum of modes")
    _time_axis(axis, dataset)
    axis.set(ylabel="Displacement u3 [mm]", title="Modes of u3: mode 2 has a node where the force acts")
    _legend_above(axis, 3)


def _peaks(axis: Axes, dataset: xr.Dataset) -> None:
    bars = {
        "RK4": (dataset["peak_displacement"], COLOURS[0]),
        "exact": (dataset["exact_peak_displacement"], COLOURS[2]),
        "SRSS of the modes' peaks": (dataset["srss_peak_displacement"], MODAL),
        "published Table 1": (dataset["published_peak_displacement"], PUBLISHED),
    }
    width = 0.2
    for place, (name, (values, colour)) in enumerate(bars.items()):
        at = np.arange(3) + (place - 1.5) * width
        bar = axis.bar(at, 1000 * values.values, width * 0.92, color=colour, label=name)
        axis.bar_label(bar, fmt="%.1f", fontsize=8, padding=2)
    axis.set_xticks(np.arange(3), [f"u{dof}" for dof in dataset["dof"].values])
    axis.set(ylabel="Peak displacement [mm]")
    axis.set_title("Published peaks do not follow from the published parameters")
    _legend_above(axis, 2)
