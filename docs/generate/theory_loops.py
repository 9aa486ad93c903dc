"""Annotated loops of the theory manual: for each storey law and device, one cycle with the names of its parts."""

from __future__ import annotations

from dataclasses import dataclass
from pathlib import Path

import numpy as np
import xarray as xr
from matplotlib.axes import Axes
from matplotlib.figure import Figure

from generate.theory_style import BLUE, GREY, INK, ORANGE, save

DRIFTS = "drift over yield drift"


@dataclass(frozen=True)
class Note:
    """A remark at a point of a curve.

    Args:
        words: Text.
        at: "push", or "cycle".
        where: Drift over yield drift in the push; or the position in the shown cycle: 0 to 1 is the way to the positive
            peak, 1 to 3 the way to the negative peak, 3 to 4 the way back to the start.
        shift: Offset of the text [points].
    """

    words: str
    at: str
    where: float
    shift: tuple[float, float]


@dataclass(frozen=True)
class Loop:
    """The figure of a law.

    Args:
        title: The message of the figure.
        peak: Amplitude of the shown cycle, the second of its amplitude [yield drifts].
        notes: Remarks on the curves.
    """

    title: str
    peak: float
    notes: tuple[Note, ...]


def push(words: str, where: float, x: float, y: float) -> Note:
    """Return a remark at a drift of the push."""
    return Note(words, "push", where, (x, y))


def cycle(words: str, where: float, x: float, y: float) -> Note:
    """Return a remark at a position in the cycle."""
    return Note(words, "cycle", where, (x, y))


_HARDENS = "hardening slope"
LOOPS = {
    "elastic": Loop("An elastic storey follows one line", 6, (push("slope k", 5, 12, -18),)),
    "elastic_perfectly_plastic": Loop(
        "The elastic part of the drift is clamped to the yield drift",
        6,
        (push("yield force", 1, -62, 6), cycle("unloading with slope k", 1.15, -150, -20)),
    ),
    "bilinear": Loop(
        "The yield range keeps its width 2 Fy and moves with the drift (kinematic hardening)",
        6,
        (
            push("yield point", 1, -66, 8),
            push(_HARDENS, 5, -120, 22),
            cycle("unloading with slope k", 1.15, -150, -24),
            cycle("yields again after 2 yield drifts", 1.34, 14, -34),
        ),
    ),
    "trilinear": Loop(
        "Each corner of the backbone is the yield point of one spring in parallel",
        6,
        (push("yield point", 1, -66, 8), push("corner 2", 3, -30, 16), cycle("twice the backbone", 1.7, 20, -28)),
    ),
    "quadrilinear": Loop(
        "Each corner of the backbone is the yield point of one spring in parallel",
        8,
        (
            push("yield point", 1, -66, 8),
            push("corner 2", 2, -58, 12),
            push("corner 3", 5, -30, 16),
            cycle("twice the backbone", 1.7, 20, -28),
        ),
    ),
    "self_centring": Loop(
        "The gap opens at the yield force and closes at (1 - flag height) times it",
        6,
        (
            push("gap opens", 1, -58, 14),
            push(_HARDENS, 5, -130, 20),
            cycle("unloading with slope k", 1.05, 12, -26),
            cycle("gap closes", 1.6, 10, -30),
            cycle("no residual drift", 2.0, 14, -26),
        ),
    ),
    "menegotto_pinto": Loop(
        "Each branch is a curve between the elastic line and the hardening line",
        6,
        (
            push("first curve: exponent R0", 1.2, -20, 30),
            cycle("reversal: a new branch", 1.0, 6, -26),
            cycle("softer curve: exponent R < R0", 1.4, 18, -30),
        ),
    ),
    "bouc_wen": Loop(
        "The internal variable z approaches its bound; with beta = gamma, unloading is straight",
        6,
        (push("z near its bound", 4, -110, 22), cycle("straight unloading", 1.12, -140, -22)),
    ),
    "baber_noori": Loop(
        "Dissipated energy lets the storey slip: the loop pinches near z = q z_u",
        8,
        (push("without earlier energy", 5, -160, 16), cycle("slip", 3.15, 20, -32), cycle("unloading", 1.08, -90, -20)),
    ),
    "peak_oriented": Loop(
        "After zero force, the storey reloads towards its farthest peak on the new side",
        6,
        (
            push("backbone", 7.5, -30, 18),
            cycle("unloading with slope k", 1.08, 14, -24),
            cycle("zero force: aim at the peak", 1.2, 20, -30),
            cycle("farthest peak", 3.0, -20, -22),
        ),
    ),
    "takeda": Loop(
        "The unloading stiffness decreases with the farthest peak",
        6,
        (
            push("backbone", 7.5, -30, 18),
            cycle("unloading with slope k / μ^β", 1.12, 14, -22),
            cycle("zero force: aim at the peak", 1.42, 20, -30),
        ),
    ),
    "hysteretic": Loop(
        "Reloading leads over the pinching point to a target that damage moves outward",
        6,
        (
            push("corner 2", 4, -30, 14),
            push("third part", 7, 4, 14),
            cycle("softer unloading", 1.08, -110, -12),
            cycle("towards the pinching point", 3.6, 30, -24),
        ),
    ),
    "pinching4": Loop(
        "A path of three straight parts leads from the reversal to the peak of the other side",
        6,
        (
            push("corner 3", 6, 0, 14),
            cycle("reversal", 1.0, 8, 10),
            cycle("end of unloading", 1.3, 16, -34),
            cycle("reloading point", 2.5, -120, 16),
        ),
    ),
    "saws": Loop(
        "Reloading follows the pinched line, then a line towards a point of the envelope",
        8,
        (
            push("exponential envelope", 3, -150, 22),
            cycle("unloading with slope R3 k", 1.05, -170, -10),
            cycle("pinched line", 3.3, 26, -34),
            cycle("reloading line", 0.94, -110, 26),
        ),
    ),
    "ibarra_medina_krawinkler_bilinear": Loop(
        "Strength, capping line and unloading stiffness deteriorate with the dissipated energy",
        8,
        (
            push("capping point", 5, -40, 14),
            push("capping line", 8, 2, 12),
            cycle("lower yield force", 2.3, 10, -26),
            cycle("unloading with the lost stiffness", 1.06, -215, -16),
        ),
    ),
    "ibarra_medina_krawinkler_peak_oriented": Loop(
        "Reloading aims at the farthest peak, whose drift grows with the dissipated energy",
        6,
        (
            push("capping point", 5, -40, 14),
            cycle("zero force: aim at the peak", 1.2, 20, -36),
            cycle("unloading", 1.05, -84, -12),
        ),
    ),
    "ibarra_medina_krawinkler_pinching": Loop(
        "Reloading first aims at the pinching point, then at the farthest peak",
        6,
        (
            push("capping point", 5, -40, 14),
            cycle("towards the pinching point", 3.7, 30, -30),
            cycle("towards the peak", 0.9, -140, 16),
        ),
    ),
    "lead_rubber_bearing": Loop(
        "A lead-rubber bearing is bilinear: stiffness k before yield, k2 after it",
        6,
        (push("slope k2", 6, -20, 18), cycle("unloading with slope k", 1.15, -150, -20)),
    ),
    "friction_pendulum": Loop(
        "A pendulum slides at the friction force plus the restoring force W u / R",
        6,
        (push("slope W / R", 6, -20, 18), cycle("friction reverses: 2 μ W", 1.2, 14, -26)),
    ),
    "friction_damper": Loop(
        "A friction damper slips at a constant force",
        4,
        (push("slips", 3, -10, 12), cycle("brace unloads", 1.1, -120, -18)),
    ),
    "gap": Loop(
        "A stop acts beyond its clearance and returns the share e² of its energy",
        8,
        (push("contact", 5, -64, 12), cycle("unloading with slope k / e²", 1.05, 12, -40)),
    ),
    "one_sided_gap": Loop(
        "A one-sided stop acts at positive drifts only",
        8,
        (push("contact", 5, -64, 12), cycle("unloading with slope k / e²", 1.05, 12, -40)),
    ),
    "viscous_damper": Loop("The smaller the exponent, the fuller the loop of a viscous damper", 0, ()),
    "maxwell_damper": Loop("A flexible brace tilts the loop of a damper", 0, ()),
}


def alternative_text(name: str) -> str:
    """Return the text that screen readers read for a figure."""
    loop = LOOPS[name]
    parts = "; ".join(note.words for note in loop.notes)
    return f"Force of {name} against drift. {loop.title}.{f' Marked: {parts}.' if parts else ''}"


def draw_loop(name: str, curves: xr.Dataset, path: Path) -> None:
    """Draw the annotated loop of a law or device.

    Args:
        name: The law or device.
        curves: Content of docs/reference/laws/cycles.nc.
        path: File of the figure.
    """
    loop = LOOPS[name]
    figure = Figure(figsize=(8.6, 4.3), layout="constrained")
    axes = figure.subplots()
    if name in ("viscous_damper", "maxwell_damper"):
        _damper(axes, brace=name == "maxwell_damper")
    else:
        _of_cycles(axes, loop, curves, curves.sel(element=name))
    axes.set_title(loop.title, loc="left")
    axes.axhline(0, color=GREY, lw=0.7, zorder=0)
    axes.axvline(0, color=GREY, lw=0.7, zorder=0)
    figure.legend(loc="outside lower center", ncols=3, frameon=False)
    save(figure, path)


def _of_cycles(axes: Axes, loop: Loop, curves: xr.Dataset, own: xr.Dataset) -> None:
    drift, force = curves["ductility"].values, own["force"].values
    axes.plot(curves["pushed_ductility"], own["pushed_force"], color=ORANGE, lw=1.6, label="pushed once from rest")
    begin, middle, end = _cycle_of(drift, loop.peak)
    axes.plot(drift[: begin + 1], force[: begin + 1], color="0.8", lw=0.7, zorder=1, label="earlier cycles")
    shown = slice(begin, end + 1)
    axes.plot(drift[shown], force[shown], color=BLUE, lw=1.9, label=f"cycle of ±{loop.peak:g} yield drifts")
    axes.set(xlabel=DRIFTS, ylabel="force over yield force")
    for note in loop.notes:
        if note.at == "push":
            point = note.where, float(np.interp(note.where, curves["pushed_ductility"], own["pushed_force"]))
        else:
            # 0 to 1: to the positive peak; 1 to 3: to the negative one; 3 to 4: back.
            ends = [begin, middle[0], middle[1], end]
            place = round(float(np.interp(note.where, [0, 1, 3, 4], ends)))
            point = float(drift[place]), float(force[place])
        axes.plot(*point, "o", color=INK, ms=4.5, zorder=5)
        axes.annotate(note.words, point, note.shift, textcoords="offset points", arrowprops={"arrowstyle": "-"})
    reach = 1.3 * max(loop.peak, *(note.where / 1.2 for note in loop.notes if note.at == "push"))
    seen = np.abs(curves["pushed_ductility"].values) <= reach
    largest = max(np.abs(force[: end + 1]).max(), np.abs(own["pushed_force"].values[seen]).max())
    axes.set(xlim=(-reach, reach), ylim=(-1.25 * largest, 1.25 * largest))


def _cycle_of(drift: np.ndarray, peak: float) -> tuple[int, tuple[int, int], int]:
    """Return where the second cycle of an amplitude begins (at zero drift), has its peaks, and ends."""
    turns = np.flatnonzero(np.diff(np.sign(np.diff(drift)))) + 1
    top = int(turns[np.isclose(drift[turns], peak)][-1])
    bottom = int(turns[np.isclose(drift[turns], -peak)][-1])
    is_upward = np.diff(drift, prepend=0.0) > 0
    zeros = np.flatnonzero(is_upward & (drift >= 0) & (np.roll(drift, 1) < 0))
    return int(zeros[zeros < top].max()), (top, bottom), int(zeros[zeros > bottom].min())


def _damper(axes: Axes, *, brace: bool) -> None:
    """Draw the force of dampers in harmonic motion of 0.1 m at 5 rad/s, over the largest force without a brace."""
    frequency, size, steps = 5.0, 0.1, 4000
    time = np.linspace(0, 6 * np.pi / frequency, 3 * steps)
    drift, velocity = size * np.sin(frequency * time), size * frequency * np.cos(frequency * time)
    coefficient, linear = 1.0e5, 0.01
    for exponent, colour in ((1.0, BLUE), (0.4, ORANGE), (0.2, INK)):
        force = coefficient * velocity * np.maximum(np.abs(velocity), linear) ** (exponent - 1)
        if brace:
            stiffness, step = 2.0e6, time[1]
            force = np.zeros_like(time)
            for k in range(time.size - 1):
                flow = np.sign(force[k]) * (np.abs(force[k]) / coefficient) ** (1 / exponent)
                force[k + 1] = force[k] + step * stiffness * (velocity[k] - flow)
        largest = coefficient * (size * frequency) ** exponent
        last = slice(2 * steps, None)
        axes.plot(drift[last], force[last] / largest, color=colour, lw=1.9, label=f"velocity exponent {exponent:g}")
    axes.set(xlabel="drift [m]", ylabel="force over largest damper force")
