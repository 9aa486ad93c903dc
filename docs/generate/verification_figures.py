"""Figures of the verification manual: the independent curve, that of warpdyn, and printed values."""

from __future__ import annotations

from pathlib import Path
from typing import Any

import numpy as np
from matplotlib.figure import Figure

from generate.theory_style import BLUE, GREY, INK, ORANGE, save

SIZE = (8.6, 3.8)
FEW = 25  # points that are drawn as marks


def draw_curve(problem: Any, figure: str, pair: list[list[list[float]]], path: Path) -> None:
    """Draw a figure of a problem: both curves, and the printed values as dots."""
    canvas = Figure(figsize=SIZE, layout="constrained")
    axes = canvas.subplots()
    (x, y), (own_x, own_y) = (np.array(curve) for curve in pair)
    axes.plot(x, y, color=GREY, lw=5, alpha=0.6, label="independent", solid_capstyle="round")
    style = {"marker": "o", "ls": "", "ms": 6} if len(own_x) < FEW and len(own_x) < len(x) else {"lw": 1.5}
    axes.plot(own_x, own_y, color=BLUE, label="warpdyn", **style)
    if figure in problem.marks:
        points, first = problem.marks[figure]
        printed = [problem.rows[first + i].printed for i in range(len(points))]
        axes.plot(points, printed, "x", color=ORANGE, ms=8, mew=2, label="printed", zorder=3)
    axes.axhline(0, color=INK, lw=0.6)
    axes.set_title(f"{problem.number}: {figure}", loc="left")
    axes.set(xlabel=problem.axes[figure][0], ylabel=problem.axes[figure][1])
    canvas.legend(loc="outside lower center", ncols=3, frameon=False)
    save(canvas, path)
