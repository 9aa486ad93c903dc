"""The three pictures of the front page, each for the light and the dark theme, as SVG."""

from __future__ import annotations

from dataclasses import dataclass
from pathlib import Path
from typing import Any

import matplotlib as mpl
import numpy as np
from matplotlib import patheffects
from matplotlib.axes import Axes
from matplotlib.figure import Figure

SIZE = (3.5, 3.1)  # inches; shown about 350 pixels wide, so that a point is 1.4 pixels
TEXT = 10  # points
SWAY = 12  # displacements are drawn times this factor
# Complete runs, histories per second: pages coming_from/r2d and tutorials/gpu.
ONE_CORE = {"OpenSees": 1000 / 33, "warpdyn": 1000 / 0.37}
FIRST_STUDY = {"2 CPU cores": 528_088 / 48, "NVIDIA H200": 528_088 / 0.24}


@dataclass(frozen=True)
class Theme:
    """Colours of a theme: the page, text, remarks, lines, and those of the damage states."""

    page: str
    text: str
    remark: str
    line: str
    accent: str
    states: tuple[str, ...]


# Of Okabe and Ito; lighter ones on a dark page.
LIGHT = Theme("#ffffff", "#14181e", "#48566b", "#9aa5b1", "#0072B2", ("#0072B2", "#00805e", "#a86f00", "#c04f00"))
DARK = Theme("#14181e", "#ced6dd", "#a8b3bf", "#6d7885", "#56B4E9", ("#56B4E9", "#2fc79b", "#E69F00", "#ff8a3c"))
THEMES = {"light": LIGHT, "dark": DARK}


def _axes(theme: Theme) -> tuple[Figure, Axes]:
    figure = Figure(figsize=SIZE, layout="constrained")
    axes = figure.subplots()
    axes.patch.set_alpha(0)
    axes.tick_params(colors=theme.text, labelsize=TEXT)
    for side, spine in axes.spines.items():
        spine.set_visible(side in ("left", "bottom"))
        spine.set_color(theme.line)
    return figure, axes


def _frame(axes: Axes, sway: np.ndarray, **style: Any) -> None:
    """Draw a frame whose floors have the displacements `sway`, in storey heights."""
    levels = np.arange(len(sway) + 1)
    shape = np.concatenate([[0.0], sway])
    for side in (0.0, 1.6):
        axes.plot(shape + side, levels, **style)
    for level, place in zip(levels[1:], shape[1:], strict=True):
        axes.plot([place, place + 1.6], [level, level], **style)


def building(numbers: dict[str, Any], theme: Theme) -> Figure:
    """Draw the variants of the building at one instant."""
    figure, axes = _axes(theme)
    sway = np.array(numbers["sway"]) * SWAY / 3.6  # in storey heights
    for variant in sway:
        _frame(axes, variant, color=theme.accent, lw=0.7, alpha=0.4)
    _frame(axes, np.median(sway, axis=0), color=theme.text, lw=2.4, solid_capstyle="round")
    axes.plot([-0.7, 2.9], [0, 0], color=theme.text, lw=1.5)
    axes.text(
        1.1,
        -0.25,
        f"{len(sway)} variants under one record\n({numbers['record'].rsplit(' ', 1)[0]}), same instant,\n"
        f"displacements times {SWAY}; bold: median",
        color=theme.remark,
        fontsize=TEXT - 0.5,
        ha="center",
        va="top",
    )
    axes.set(xlim=(-1.0, 3.2), ylim=(-1.75, 5.25), xticks=[], yticks=[])
    axes.spines[:].set_visible(False)
    return figure


def curves(numbers: dict[str, Any], theme: Theme) -> Figure:
    """Draw the fragility curves with their 95 % intervals."""
    figure, axes = _axes(theme)
    intensity = np.array(numbers["intensity"])
    shown = intensity > 0.08
    places = {"slight": 0.9, "moderate": 0.7, "extensive": 0.5, "complete": 0.28}
    for (state, row), colour in zip(numbers["states"].items(), theme.states, strict=True):
        lower, curve, upper = (100 * np.array(row[name])[shown] for name in ("lower", "curve", "upper"))
        axes.fill_between(intensity[shown], lower, upper, color=colour, alpha=0.25, lw=0)
        axes.plot(intensity[shown], curve, color=colour, lw=1.8)
        height = 100 * places[state]
        axes.text(
            float(np.interp(height, curve, intensity[shown])) * 1.1,
            height,
            state,
            color=colour,
            fontsize=TEXT,
            va="top",
            weight="bold",
            path_effects=[patheffects.withStroke(linewidth=3, foreground=theme.page)],
        )
    axes.set(xscale="log", xlim=(0.1, 6.5), ylim=(0, 100))
    axes.set_xticks([0.1, 0.2, 0.5, 1, 2, 5], ["0.1", "0.2", "0.5", "1", "2", "5"])
    axes.minorticks_off()
    axes.set_yticks([0, 25, 50, 75, 100], ["0", "25", "50", "75", "100 %"])
    axes.set_xlabel(f"Sa({numbers['period']:g} s) [g]", color=theme.text, fontsize=TEXT)
    axes.set_title("Probability of exceeding a damage state", loc="left", color=theme.text, fontsize=TEXT)
    return figure


def rate(value: float) -> str:
    """Return histories per second as text of two digits."""
    digits = float(f"{value:.2g}")
    return f"{digits / 1e6:.1f} million" if digits >= 1e6 else f"{digits:,.0f}"


def speed(theme: Theme) -> Figure:
    """Draw histories per second of complete runs as dots on a logarithmic axis."""
    figure, axes = _axes(theme)
    rows = [
        (4.6, "The same 20 buildings, one CPU core", None, False),
        (4.0, "OpenSees", ONE_CORE["OpenSees"], False),
        (3.4, "warpdyn", ONE_CORE["warpdyn"], True),
        (2.2, "A five-storey building, 528,088 histories", None, False),
        (1.6, "warpdyn, 2 CPU cores", FIRST_STUDY["2 CPU cores"], True),
        (1.0, "warpdyn, NVIDIA H200", FIRST_STUDY["NVIDIA H200"], True),
    ]
    axes.set_title("Histories per second, complete runs", loc="left", color=theme.text, fontsize=TEXT)
    for height, name, value, ours in rows:
        if value is None:
            axes.text(0, height, name, color=theme.remark, fontsize=TEXT - 0.5, va="center")
            continue
        length = np.log10(value) / 7
        colour = theme.accent if ours else theme.line
        axes.plot([0, length], [height - 0.27, height - 0.27], color=colour, lw=2)
        axes.plot([length], [height - 0.27], "o", color=colour, ms=6)
        axes.text(0, height, name, color=theme.text, fontsize=TEXT, va="center")
        axes.text(1, height, rate(value), color=theme.text, fontsize=TEXT, va="center", ha="right", weight="bold")
    axes.text(0, 0.25, "logarithmic scale from 1 to 10 million", color=theme.remark, fontsize=TEXT - 0.5, va="center")
    axes.set(xlim=(-0.01, 1.03), ylim=(0, 5), xticks=[], yticks=[])
    axes.spines[:].set_visible(False)
    return figure


def draw(numbers: dict[str, Any], folder: Path) -> None:
    """Write the pictures of both themes into a folder; the same numbers give the same files."""
    for name, theme in THEMES.items():
        pictures = {"building": building(numbers, theme), "curves": curves(numbers, theme), "speed": speed(theme)}
        for picture, figure in pictures.items():
            with mpl.rc_context({"svg.hashsalt": "warpdyn"}):
                figure.savefig(
                    folder / f"{picture}_{name}.svg", format="svg", metadata={"Date": None}, transparent=True
                )
