"""Style of the figures of the theory manual: colours of the project, text of 11 points, SVG without a date."""

from __future__ import annotations

from pathlib import Path

import matplotlib as mpl
from matplotlib.figure import Figure

from warpdyn.interfaces.plots.style import COLOURS

BLUE, GREEN, YELLOW, ORANGE, PINK, PALE_BLUE, INK = COLOURS
GREY = "0.6"
TEXT = 11  # points: a figure of 8.6 inches is shown 1,400 pixels wide, so this is 25 pixels
_STYLE = {
    "svg.hashsalt": "warpdyn",
    "font.size": TEXT,
    "axes.titlesize": TEXT + 1,
    "axes.spines.top": False,
    "axes.spines.right": False,
    "legend.fontsize": TEXT - 1,
}


def save(figure: Figure, path: Path) -> None:
    """Write a figure as SVG; the same figure gives the same bytes."""
    for axes in figure.axes:
        for text in (axes.title, axes.xaxis.label, axes.yaxis.label):
            text.set_fontsize(TEXT + (text is axes.title))
        axes.tick_params(labelsize=TEXT - 1)
        axes.spines[["top", "right"]].set_visible(False)
        for note in axes.texts:
            note.set_fontsize(TEXT - 0.5)
    path.parent.mkdir(parents=True, exist_ok=True)
    with mpl.rc_context(_STYLE):
        figure.savefig(path, format="svg", metadata={"Date": None})
