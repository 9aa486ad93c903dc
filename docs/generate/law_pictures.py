"""Pictures of the pages on laws: loops under the standard cycles, and the backbone in one push, with its corners."""

from __future__ import annotations

from collections.abc import Mapping
from pathlib import Path

import numpy as np
import xarray as xr
from matplotlib.axes import Axes
from matplotlib.figure import Figure

from warpdyn.interfaces.plots.style import COLOURS

DPI = 110


def draw_law(curves: xr.Dataset, yield_drift: float, parameters: Mapping[str, float], path: Path) -> None:
    """Draw the loops of a law or device, and next to them its path in one push.

    Args:
        curves: Its part of cycles.nc.
        yield_drift: Yield drift of the storeys in the cycles [m].
        parameters: Parameters of the law, for the corners of its backbone.
        path: File of the picture.
    """
    figure = Figure(figsize=(8.6, 3.7), layout="constrained")
    loops, push = figure.subplots(1, 2, width_ratios=(1.35, 1))
    loops.plot(curves["ductility"], curves["force"], color=COLOURS[0], lw=0.8)
    loops.set_title("Two cycles at each of eight growing drifts", fontsize=10)
    push.plot(curves["pushed_ductility"], curves["pushed_force"], color=COLOURS[0], lw=1.6)
    push.set_title("Pushed once from rest", fontsize=10)
    for drift, force, words in corners(yield_drift, parameters).values():
        push.plot(drift, force, "o", color=COLOURS[3], ms=5, zorder=3)
        # Above the corner, because the backbone, or the curve of a smooth law, continues below it.
        push.annotate(words, (drift, force), (0, 6), textcoords="offset points", fontsize=8, ha="center")
    push.margins(y=0.12)
    for axes in (loops, push):
        _frame(axes)
    path.parent.mkdir(exist_ok=True)
    figure.savefig(path, dpi=DPI)


def corners(yield_drift: float, parameters: Mapping[str, float]) -> dict[int, tuple[float, float, str]]:
    """Return the corners of a backbone that its parameters name: drift and force over those of yield, and words."""
    found = {}
    if "yield_force" in parameters:
        found[0] = (1.0, 1.0, "yield")
    for corner in (2, 3, 4):
        if f"ductility_{corner}" in parameters:
            place = parameters[f"ductility_{corner}"], parameters[f"force_ratio_{corner}"]
            if place[0] <= 10:
                found[corner] = (*place, f"corner {corner}")
    if "plastic_drift_to_capping" in parameters:
        drift = 1 + parameters["plastic_drift_to_capping"] / yield_drift
        found[2] = (drift, parameters["capping_force_ratio"], "capping point")
    return found


def draw_viscous_damper(exponents: tuple[float, ...], path: Path) -> None:
    """Draw the force of viscous dampers against velocity and, in harmonic motion, against drift.

    The force is C |v|^a, and below the velocity v0 = 0.01 m/s linear, C v0^(a - 1) v, as in the class ViscousDamper.
    """
    figure = Figure(figsize=(8.6, 3.7), layout="constrained")
    loops, law = figure.subplots(1, 2, width_ratios=(1.35, 1))
    phase = np.linspace(0, 2 * np.pi, 400)
    for exponent, colour in zip(exponents, COLOURS, strict=False):
        for axes, drift, velocity in (
            (loops, 0.1 * np.sin(phase), 0.5 * np.cos(phase)),
            (law, np.linspace(-0.5, 0.5, 401), np.linspace(-0.5, 0.5, 401)),
        ):
            slope = np.maximum(np.abs(velocity), 0.01) ** (exponent - 1)
            axes.plot(drift, slope * velocity, color=colour, lw=1.4, label=f"velocity exponent {exponent:g}")
    loops.set_title("Harmonic motion: 0.1 m at 5 rad/s", fontsize=10)
    law.set_title("Force and velocity", fontsize=10)
    for axes, words in ((loops, "Storey drift [m]"), (law, "Storey velocity [m/s]")):
        _frame(axes)
        axes.set(xlabel=words, ylabel="Force over the force at 1 m/s")
    loops.set_xticks(np.linspace(-0.1, 0.1, 5))
    law.legend(fontsize=8)
    path.parent.mkdir(exist_ok=True)
    figure.savefig(path, dpi=DPI)


def draw_maxwell_damper(exponents: tuple[float, ...], path: Path) -> None:
    """Draw the force of dampers with a brace in harmonic motion, and over time at a constant velocity.

    The force over that at 1 m/s, q, follows q' = r (v - sign(q) |q|^(1/a)), with r = K/C = 40 1/s.
    """
    figure = Figure(figsize=(8.6, 3.7), layout="constrained")
    loops, start = figure.subplots(1, 2, width_ratios=(1.35, 1))
    ratio, step = 40.0, 2e-4
    time = np.arange(0, 4 * np.pi / 5, step)  # two cycles at 5 rad/s
    for exponent, colour in zip(exponents, COLOURS, strict=False):
        for axes, place, velocity in (
            (loops, 0.1 * np.sin(5 * time), 0.5 * np.cos(5 * time)),
            (start, time, np.full(time.size, 0.5)),
        ):
            force = np.zeros(time.size)
            for k in range(time.size - 1):
                force[k + 1] = force[k] + step * ratio * (
                    velocity[k] - np.sign(force[k]) * np.abs(force[k]) ** (1 / exponent)
                )
            shown = slice(None) if axes is loops else time < 0.3
            axes.plot(place[shown], force[shown], color=colour, lw=1.4, label=f"velocity exponent {exponent:g}")
    loops.set_title("Harmonic motion from rest: 0.1 m at 5 rad/s", fontsize=10)
    start.set_title("Constant velocity of 0.5 m/s", fontsize=10)
    for axes, words in ((loops, "Storey drift [m]"), (start, "Time [s]")):
        _frame(axes)
        axes.set(xlabel=words, ylabel="Force over the damper's force at 1 m/s")
    loops.set_xticks(np.linspace(-0.1, 0.1, 5))
    start.legend(fontsize=8)
    path.parent.mkdir(exist_ok=True)
    figure.savefig(path, dpi=DPI)


def _frame(axes: Axes) -> None:
    axes.set(xlabel="Storey drift over yield drift", ylabel="Force over yield force")
    axes.axhline(0, color="0.6", lw=0.6, zorder=0)
    axes.axvline(0, color="0.6", lw=0.6, zorder=0)
    axes.grid(alpha=0.25)
    axes.tick_params(labelsize=9)
