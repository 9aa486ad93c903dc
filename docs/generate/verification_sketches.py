"""Sketches of the verification manual: oscillators, chains of masses, isolated buildings, devices, loops, curves."""

from __future__ import annotations

from collections.abc import Callable, Mapping
from pathlib import Path
from typing import Any

import numpy as np
from matplotlib.axes import Axes
from matplotlib.figure import Figure
from matplotlib.patches import Rectangle
from scipy.special import ndtr

from generate.theory_style import BLUE, GREEN, GREY, INK, ORANGE, save

SIZE = (8.6, 2.3)


def _spring(axes: Axes, start: float, end: float, y: float, words: str = "") -> None:
    """Draw a horizontal spring."""
    x = np.array([0, 0.15, *np.linspace(0.2, 0.8, 9), 0.85, 1]) * (end - start) + start
    side = np.array([0, 0, *np.tile([0.12, -0.12], 4), 0.12, 0, 0])
    axes.plot(x, y + side, color=INK, lw=1.5)
    axes.text((start + end) / 2, y + 0.2, words, ha="center", va="bottom")


def _dashpot(axes: Axes, start: float, end: float, y: float, words: str = "") -> None:
    """Draw a horizontal dashpot."""
    a, b = start + 0.4 * (end - start), start + 0.65 * (end - start)
    axes.plot([start, a], [y, y], color=INK, lw=1.5)
    axes.plot([b, a, a, b], [y + 0.14, y + 0.14, y - 0.14, y - 0.14], color=INK, lw=1.5)
    middle = (a + b) / 2
    axes.plot([middle, middle], [y - 0.1, y + 0.1], color=INK, lw=1.5)
    axes.plot([middle, end], [y, y], color=INK, lw=1.5)
    axes.text((start + end) / 2, y - 0.22, words, ha="center", va="top")


def _wall(axes: Axes, x: float, side: int = -1, low: float = -0.6, high: float = 0.6) -> None:
    """Draw a fixed end with hatching on one side."""
    axes.plot([x, x], [low, high], color=INK, lw=2)
    for y in np.linspace(low, high, 6):
        axes.plot([x, x + 0.15 * side], [y, y + 0.15], color=INK, lw=1)


def _mass(axes: Axes, x: float, words: str, width: float = 0.7, y: float = 0.0, height: float = 0.9) -> None:
    """Draw a mass with its name."""
    axes.add_patch(Rectangle((x, y - height / 2), width, height, facecolor="#DDE8F2", edgecolor=INK, lw=1.5))
    axes.text(x + width / 2, y, words, ha="center", va="center")


def _arrow(axes: Axes, start: tuple[float, float], end: tuple[float, float], words: str, colour: str = ORANGE) -> None:
    """Draw an arrow with a name at its end."""
    axes.annotate("", end, start, arrowprops={"arrowstyle": "->", "color": colour, "lw": 2})
    axes.text(end[0] + 0.08, end[1], words, color=colour, va="center")


def oscillator(axes: Axes, damper: bool = True, load: str = "", law: str = "") -> None:
    """Draw a mass on a spring and a dashpot, with a force or a base motion, and the loop of a yielding spring."""
    _wall(axes, 0)
    _spring(axes, 0, 2, 0.25 if damper else 0, "k")
    if damper:
        _dashpot(axes, 0, 2, -0.25, "c")
    _mass(axes, 2, "m")
    if load == "a_g(t)":
        _arrow(axes, (-0.4, -0.85), (0.4, -0.85), "base acceleration a_g(t)", GREEN)
    elif load:
        _arrow(axes, (2.7, 0), (3.5, 0), load)
    axes.plot([2.35, 2.35], [0.5, 0.85], color=BLUE, lw=1)
    _arrow(axes, (2.35, 0.8), (2.95, 0.8), "u(t)", BLUE)
    if law:
        _loop(axes, law, 5.6, 0.0, 0.9)


def chain(
    axes: Axes, masses: int = 3, fixed_top: bool = False, load: int = 0, motion: bool = False, equipment: bool = False
) -> None:
    """Draw masses in a row, from the base at the left to the top at the right."""
    shown = masses if masses <= 5 else 4
    pitch = 1.35
    _wall(axes, 0)
    x = 0.0
    labels = [str(i + 1) for i in range(shown)]
    if masses > 5:
        labels = ["1", "2", "…", str(masses)]
    for i, label in enumerate(labels):
        _spring(axes, x, x + pitch - 0.55, 0)
        _mass(axes, x + pitch - 0.55, f"m{label}" if label != "…" else "…", 0.55)
        if load and label == str(load):
            _arrow(axes, (x + pitch - 0.3, 0.95), (x + pitch + 0.3, 0.95), "p(t)")
        if load and masses > 5 and i == 2:
            _arrow(axes, (x + pitch - 0.3, 0.95), (x + pitch + 0.3, 0.95), f"p(t) on mass {load}")
        x += pitch
    if equipment:
        _spring(axes, x, x + 0.8, 0.18)
        _dashpot(axes, x, x + 0.8, -0.2)
        _mass(axes, x + 0.8, "mₑ", 0.45, height=0.7)
    if fixed_top:
        _spring(axes, x, x + 0.8, 0)
        _wall(axes, x + 0.8, 1)
    if motion:
        _arrow(axes, (-0.4, -0.85), (0.4, -0.85), "base acceleration a_g(t)", GREEN)


def device(axes: Axes, kind: str = "viscous") -> None:
    """Draw a mass with a spring and a device."""
    if kind == "stop":
        _mass(axes, 1.4, "m")
        _arrow(axes, (2.1, 0), (2.7, 0), "")
        _spring(axes, 3.4, 4.6, 0)
        axes.text(4.0, 0.75, "contact stiffness", ha="center")
        _wall(axes, 4.6, 1)
        axes.plot([3.4, 3.4], [-0.4, 0.4], color=INK, lw=2)
        axes.annotate("", (3.4, -0.6), (2.1, -0.6), arrowprops={"arrowstyle": "<->", "color": GREY})
        axes.text(2.75, -0.9, "clearance", ha="center")
        return
    _wall(axes, 0)
    _spring(axes, 0, 3, 0.3, "k")
    if kind == "viscous":
        _dashpot(axes, 0, 3, -0.3, "c, exponent a")
    elif kind == "maxwell":
        _dashpot(axes, 0, 1.5, -0.3, "c")
        _spring(axes, 1.5, 3, -0.3)
        axes.text(2.25, -0.5, "brace", ha="center", va="top")
    else:
        axes.plot([0, 1.2], [-0.3, -0.3], color=INK, lw=1.5)
        axes.add_patch(Rectangle((1.2, -0.42), 0.6, 0.24, facecolor=GREY, edgecolor=INK))
        _spring(axes, 1.8, 3, -0.3)
        axes.text(1.5, -0.55, "friction F, brace", ha="center", va="top")
    _mass(axes, 3, "m")
    _arrow(axes, (3.7, 0), (4.5, 0), "u(t)", BLUE)


def isolated(axes: Axes) -> None:
    """Draw a building on isolators."""
    axes.plot([-0.5, 4.5], [-0.9, -0.9], color=INK, lw=2)
    for x in (0.4, 3.2):
        axes.add_patch(Rectangle((x, -0.9), 0.5, 0.3, facecolor=ORANGE, edgecolor=INK))
    axes.add_patch(Rectangle((0, -0.6), 4, 0.2, facecolor="#DDE8F2", edgecolor=INK))
    axes.add_patch(Rectangle((0.3, -0.4), 3.4, 1.2, facecolor="#DDE8F2", edgecolor=INK))
    axes.text(2, 0.2, "mass m", ha="center", va="center")
    axes.text(4.2, -0.68, "isolators")
    _arrow(axes, (4.0, 0.3), (4.8, 0.3), "u(t)", BLUE)


def plan(axes: Axes) -> None:
    """Draw the plan of a deck with an eccentric frame."""
    axes.add_patch(Rectangle((0, -0.9), 3.6, 1.8, facecolor="#DDE8F2", edgecolor=INK))
    axes.plot([2.1, 2.1], [-0.9, 0.9], color=ORANGE, lw=3)
    axes.text(2.16, 0.62, "A", color=ORANGE)
    for y, name in ((0.85, "B"), (-0.85, "C")):
        axes.plot([0, 3.6], [y, y], color=BLUE, lw=3)
        axes.text(3.7, y, name, color=BLUE, va="center")
    axes.plot(1.8, 0, "o", color=INK)
    axes.text(1.7, 0, "centre of mass", ha="right", va="center")
    axes.text(2.2, -0.25, "e")
    _arrow(axes, (-0.5, -0.4), (-0.5, 0.4), "", GREEN)
    axes.text(-0.6, 0, "base\nmotion", ha="right", va="center", color=GREEN)


def frames(axes: Axes) -> None:
    """Draw the plan of a storey with two frames along x and three along y, under both components."""
    axes.add_patch(Rectangle((0, -0.9), 3.0, 1.8, facecolor="#DDE8F2", edgecolor=INK))
    for y in (0.75, -0.75):
        axes.plot([0.4, 2.6], [y, y], color=BLUE, lw=3)
    for x, width in ((0.15, 5), (1.5, 2.5), (2.85, 2.5)):
        axes.plot([x, x], [-0.6, 0.6], color=ORANGE, lw=width)
    axes.text(3.2, 0.6, "frames along x", color=BLUE, va="center")
    axes.text(3.2, -0.1, "frames along y, the left one stiffer", color=ORANGE, va="center")
    _arrow(axes, (-0.9, -0.9), (-0.2, -0.9), "", GREEN)
    _arrow(axes, (-0.9, -0.9), (-0.9, -0.2), "", GREEN)
    axes.text(-1.0, 0.0, "base\nmotion", ha="center", va="bottom", color=GREEN)


def incidence(axes: Axes) -> None:
    """Draw a square plan that is turned below a pair of motions."""
    turn, half = np.radians(25), 0.75
    corners = half * np.array([[-1, -1], [1, -1], [1, 1], [-1, 1], [-1, -1]])
    turned = corners @ np.array([[np.cos(turn), np.sin(turn)], [-np.sin(turn), np.cos(turn)]])
    axes.fill(1.2 + turned[:, 0], turned[:, 1], facecolor="#DDE8F2", edgecolor=INK, lw=1.5)
    _arrow(axes, (1.2, 0), (3.2, 0), "first component", GREEN)
    end = 1.2 + 2.0 * np.cos(turn), 2.0 * np.sin(turn)
    _arrow(axes, (1.2, 0), end, "x axis of the structure", BLUE)
    arc = np.linspace(0, turn, 20)
    axes.plot(1.2 + 1.5 * np.cos(arc), 1.5 * np.sin(arc), color=GREY)
    axes.text(2.78, 0.28, "t", va="center")


def pounding(axes: Axes) -> None:
    """Draw two oscillators with a gap between them."""
    _wall(axes, 0)
    _spring(axes, 0, 1.4, 0.2)
    _dashpot(axes, 0, 1.4, -0.2)
    _mass(axes, 1.4, "m₁")
    _mass(axes, 3.0, "m₂")
    axes.annotate("", (3.0, -0.6), (2.1, -0.6), arrowprops={"arrowstyle": "<->", "color": GREY})
    axes.text(2.55, -0.9, "gap", ha="center")
    _spring(axes, 3.7, 5.1, 0.2)
    _dashpot(axes, 3.7, 5.1, -0.2)
    _wall(axes, 5.1, 1)
    _arrow(axes, (2.0, 1.0), (3.0, 1.0), "base acceleration a_g(t)", GREEN)


def bridge(axes: Axes) -> None:
    """Draw a deck on a pier with a bearing, between two abutments with gaps."""
    axes.add_patch(Rectangle((0.4, 0.2), 5.2, 0.3, facecolor="#DDE8F2", edgecolor=INK, lw=1.5))
    axes.text(1.5, 0.35, "deck", ha="center", va="center")
    axes.plot([3, 3], [-0.95, 0.0], color=INK, lw=6)
    axes.add_patch(Rectangle((2.8, 0.02), 0.4, 0.16, facecolor=ORANGE, edgecolor=INK))
    axes.text(3.3, -0.35, "pier", va="center")
    axes.text(3.3, 0.08, "bearing", va="center", color=ORANGE)
    for x, side in ((0.15, -1), (5.85, 1)):
        axes.plot([x, x], [-0.95, 0.6], color=INK, lw=2)
        axes.plot([x, x + 0.25 * side], [0.6, 0.6], color=INK, lw=2)
        axes.plot([x - 0.25 * side, x - 0.55 * side], [0.1, 0.1], color=GREY, lw=4)
    axes.text(5.95, 0.35, "gap, then stop")
    axes.plot([-0.5, 6.5], [-0.95, -0.95], color=INK, lw=1.5)
    _arrow(axes, (2.4, 0.95), (3.4, 0.95), "base acceleration a_g(t)", GREEN)


def rocking(axes: Axes) -> None:
    """Draw an oscillator on a foundation with sway and rocking springs."""
    axes.plot([2, 2], [-0.5, 0.7], color=INK, lw=3)
    _mass(axes, 1.6, "m", 0.8, 0.85, 0.45)
    axes.add_patch(Rectangle((1.1, -0.7), 1.8, 0.25, facecolor=GREY, edgecolor=INK))
    _wall(axes, -0.2, low=-0.9, high=-0.2)
    _spring(axes, -0.2, 1.1, -0.57)
    axes.text(0.4, -0.3, "Kx, cx", ha="center")
    axes.text(3.0, -0.62, "Kr, cr (rocking)")
    axes.text(2.15, 0.1, "k, c, height h")
    _arrow(axes, (1.1, -1.05), (1.9, -1.05), "base acceleration a_g(t)", GREEN)


def p_delta(axes: Axes) -> None:
    """Draw a displaced column with its gravity load."""
    axes.plot([0, 4], [-0.95, -0.95], color=INK, lw=2)
    y = np.linspace(-0.95, 0.7, 30)
    axes.plot(np.full(30, 1.5), y, color=GREY, lw=1, ls="--")
    axes.plot(1.5 + 0.7 * ((y + 0.95) / 1.65) ** 2, y, color=BLUE, lw=3)
    _arrow(axes, (2.2, 1.25), (2.2, 0.75), "")
    axes.text(2.3, 1.05, "P", color=ORANGE)
    _arrow(axes, (1.4, 0.7), (2.1, 0.7), "")
    axes.text(1.2, 0.7, "H", color=ORANGE, va="center")
    axes.annotate("", (2.2, 0.45), (1.5, 0.45), arrowprops={"arrowstyle": "<->", "color": GREY})
    axes.text(1.85, 0.2, "u", ha="center")
    axes.text(2.4, -0.2, "lateral force of the storey: (k - P/L) u")


def _loop(axes: Axes, shape: str, x: float, y: float, size: float) -> None:
    """Draw a small loop of force and displacement."""
    points = {
        "plastic": [(-1, -0.7), (-0.3, 0.7), (1, 0.7), (0.3, -0.7), (-1, -0.7)],
        "flag": [(0, 0), (0.25, 0.6), (1, 0.75), (0.85, 0.35), (0.12, 0.2), (0, 0), (-0.25, -0.6), (-1, -0.75)],
        "degrading": [(-1, -0.5), (-0.75, -0.05), (0, 0.12), (1, 0.6), (0.75, 0.05), (0, -0.12), (-1, -0.5)],
    }
    if shape == "flag":
        points["flag"] += [(-0.85, -0.35), (-0.12, -0.2), (0, 0)]
    axes.plot([x - 1.2 * size, x + 1.2 * size], [y, y], color=GREY, lw=1)
    axes.plot([x, x], [y - 0.95 * size, y + 0.95 * size], color=GREY, lw=1)
    if shape == "smooth":
        t = np.linspace(-1, 1, 50)
        up = 0.75 * np.tanh(3.2 * (t + 0.42))
        axes.plot(x + size * np.append(t, -t), y + size * np.append(up, -up), color=BLUE, lw=2)
    else:
        px, py = np.array(points[shape]).T
        axes.plot(x + size * px, y + size * py, color=BLUE, lw=2)
    axes.text(x + 1.25 * size, y, "drift", va="center")
    axes.text(x + 0.08, y + 0.95 * size, "force", va="bottom")


def law(axes: Axes, shape: str = "plastic") -> None:
    """Draw a storey under an imposed drift, and its loop."""
    axes.plot([0, 2.6], [-0.95, -0.95], color=INK, lw=2)
    for x in (0.5, 2.1):
        axes.plot([x, x + 0.5], [-0.95, 0.6], color=BLUE, lw=2.5)
    axes.plot([0.7, 2.9], [0.65, 0.65], color=INK, lw=6)
    _arrow(axes, (2.9, 0.65), (3.6, 0.65), "imposed drift")
    _loop(axes, shape, 6.4, -0.1, 0.95)


def cantilever(axes: Axes) -> None:
    """Draw a column under an axial and a lateral force, and its deflected shape."""
    height = np.linspace(0, 1, 40)
    axes.plot([1.5, 2.5], [-1, -1], color=INK, lw=2)
    axes.plot(np.full(40, 2.0), -1 + 1.7 * height, color=GREY, lw=1.5, ls="--")
    axes.plot(2 + 0.7 * (1 - np.cos(np.pi * height / 2)), -1 + 1.7 * height, color=INK, lw=2.5)
    _arrow(axes, (2.7, 1.4), (2.7, 0.75), "P")
    _arrow(axes, (1.5, 0.7), (2.6, 0.7), "")
    axes.text(1.2, 0.7, "H", color=ORANGE, va="center")
    axes.text(3.2, -0.3, "P acts on the displacement of the tip (P-Delta)\nand on the curvature (P-delta)", va="center")


def portal(axes: Axes, motion: bool = False) -> None:
    """Draw a portal with plastic hinges and a leaning column, pushed or under a base motion."""
    for x in (1.0, 3.6):
        axes.plot([x, x], [-0.9, 0.7], color=INK, lw=2.5)
        axes.plot([x - 0.25, x + 0.25], [-0.9, -0.9], color=INK, lw=2)
        axes.plot(x, -0.75, "o", color=BLUE, ms=8)
    axes.plot([1.0, 3.6], [0.7, 0.7], color=INK, lw=2.5)
    axes.plot([1.2, 3.4], [0.7, 0.7], "o", color=BLUE, ms=8)
    if motion:
        axes.plot([1.0, 3.6], [0.5, 0.5], "o", color=BLUE, ms=8)
        _arrow(axes, (0.6, -1.2), (1.6, -1.2), "base motion")
    else:
        _arrow(axes, (0.0, 0.7), (0.9, 0.7), "")
    axes.plot([3.6, 5.4], [0.7, 0.7], color=GREY, lw=1.5)
    axes.plot([5.4, 5.4], [-0.9, 0.7], "o-", color=GREY, lw=2.5, mfc="white")
    _arrow(axes, (5.4, 1.35), (5.4, 0.8), "weight")
    axes.text(5.7, -0.2, "leaning column (P-Delta)", color=GREY, va="center")
    axes.text(1.3, -0.3, "plastic hinges", color=BLUE, va="center")


def fragility(axes: Axes) -> None:
    """Draw a fragility curve with observed fractions."""
    x = np.linspace(0.02, 2, 100)
    axes.plot([0, 0, 4], [1, -0.9, -0.9], color=INK, lw=1)
    axes.plot(2 * x, -0.9 + 1.7 * ndtr(np.log(x / 0.8) / 0.4), color=BLUE, lw=2)
    levels = np.array([0.4, 0.6, 0.8, 1.0, 1.4])
    axes.plot(2 * levels, -0.9 + 1.7 * np.array([0.08, 0.2, 0.52, 0.68, 0.95]), "o", color=INK)
    axes.text(4.1, -0.9, "intensity", va="center")
    axes.text(0.1, 1.0, "probability of exceedance", va="center")


def hazard(axes: Axes) -> None:
    """Draw a hazard curve and a fragility curve."""
    x = np.linspace(0.1, 2, 100)
    axes.plot([0, 0, 4], [1, -0.9, -0.9], color=INK, lw=1)
    axes.plot(2 * x, -0.9 + 1.8 * (x / 0.1) ** -0.9, color=GREEN, lw=2)
    axes.plot(2 * x, -0.9 + 1.6 * ndtr(np.log(x / 0.9) / 0.4), color=BLUE, lw=2)
    axes.text(0.55, 0.4, "hazard", color=GREEN)
    axes.text(2.9, 0.2, "fragility or loss", color=BLUE)
    axes.text(4.1, -0.9, "intensity", va="center")


SKETCHES: dict[str, Callable[..., None]] = {
    each.__name__: each
    for each in (
        *(oscillator, chain, device, isolated, plan, frames, incidence, pounding, bridge, rocking, p_delta, law),
        *(cantilever, portal, fragility, hazard),
    )
}


def draw_sketch(name: str, arguments: Mapping[str, Any], path: Path) -> None:
    """Draw a sketch by its name."""
    figure = Figure(figsize=SIZE, layout="constrained")
    axes = figure.subplots()
    SKETCHES[name](axes, **arguments)
    axes.set(aspect="equal", xlim=(-1.2, 9.0), ylim=(-1.3, 1.45))
    axes.set_axis_off()
    save(figure, path)
