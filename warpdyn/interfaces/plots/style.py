"""Colours, sizes, axes and checks that the functions for figures have in common."""

from __future__ import annotations

import io
from collections.abc import Iterable, Mapping, Sequence
from itertools import cycle, islice
from typing import Any, TypeAlias

import numpy as np
import xarray as xr
from matplotlib import patheffects, ticker
from matplotlib.axes import Axes
from matplotlib.colors import is_color_like
from matplotlib.figure import Figure
from numpy.typing import ArrayLike

from warpdyn.foundations.core.checks import one_of, shortened

# Colours of Okabe and Ito, which colour-blind readers can distinguish. The first colour is for the lightest state.
COLOURS = ("#0072B2", "#009E73", "#E69F00", "#D55E00", "#CC79A7", "#56B4E9", "#000000")
COLLAPSE_COLOUR = "#D55E00"
PALE, DARK = "0.7", "0.35"  # greys: PALE for background data, DARK for remarks
SMALL = 8  # font size of legends and remarks [pt]
TITLE = 9  # font size of titles [pt]
LONGEST_NAME = 60  # largest number of characters of a name in a figure
NO_WIDTH = "\N{ZERO WIDTH SPACE}"
# Style of names among points or curves: drawn on top of them, with a white outline around the letters.
AMONG_POINTS: dict[str, Any] = {
    "fontsize": SMALL,
    "path_effects": [patheffects.withStroke(linewidth=3, foreground="white")],
    "zorder": 6,
}
MOST_POINTS = 20_000  # largest number of samples that are drawn as points
SCALES = ("log", "linear")
# Result of a function for figures: a new figure, or the given axes. The type of the axes is `Any`, so that type
# checkers accept the result as a figure in calls without `ax`.
Drawn: TypeAlias = Figure | Any
Colours: TypeAlias = str | Sequence[str] | Mapping[str, str]


class Picture(Figure):
    """Figure that a notebook displays as the result of a cell; made without pyplot, which would keep it in memory."""

    def _repr_png_(self) -> bytes:
        file = io.BytesIO()
        self.savefig(file, format="png")
        return file.getvalue()


def new_figure(width: float = 7.0, height: float = 4.6) -> Figure:
    """Return an empty figure; its width and height are in inches."""
    return Picture(figsize=(width, height), layout="constrained")


def panels(
    function: str,
    ax: Axes | Iterable[Axes] | None,
    count: int = 1,
    *,
    columns: int | None = None,
    size: tuple[float, float] = (7.0, 4.6),
    **layout: Any,
) -> tuple[Drawn, list[Axes]]:
    """Return the result of a function for figures (a new figure or the given axes), and a list of its axes.

    Args:
        function: Name of the plot function, for error messages.
        ax: Axes that the user gave, one per panel; None: a new figure.
        count: Number of panels.
        columns: Number of panels in a row; None: all panels in one row.
        size: Width and height of a new figure [inch].
        layout: Further arguments of `Figure.subplots`.

    Raises:
        TypeError: If `ax` does not consist of matplotlib axes.
        ValueError: If the number of axes differs from the number of panels.
    """
    if ax is None:
        columns = columns or count
        figure = new_figure(*size)
        grid = figure.subplots(-(-count // columns), columns, squeeze=False, **layout).ravel()
        for empty in grid[count:]:
            empty.set_axis_off()
        return figure, list(grid[:count])
    given = list(np.ravel(np.array(ax, dtype=object)))
    for each in given:
        if not isinstance(each, Axes):
            raise TypeError(
                f"plots.{function}: ax must be matplotlib axes, got {type(each).__name__}: make them by "
                "figure, ax = plt.subplots()"
            )
    if len(given) != count:
        one = "1 panel" if count == 1 else f"{count} panels"
        raise ValueError(f"plots.{function} draws {one}: give one axes for each as ax=, got {len(given)}")
    return ax, given


def colours_of(names: Iterable[object], colours: Colours) -> list[str]:
    """Return the colour of each name, from a mapping by name or from a list, which is repeated if it is too short.

    Raises:
        ValueError: If a name has no colour, or matplotlib does not know a colour.
    """
    wanted = [str(name) for name in names]
    if isinstance(colours, Mapping):
        missing = [name for name in wanted if name not in colours]
        if missing:
            raise ValueError(f"colours has no colour for {missing[0]!r}; give one for each of {', '.join(wanted)}")
        found = [colours[name] for name in wanted]
    else:
        given = [colours] if isinstance(colours, str) else list(colours)
        if not given:
            raise ValueError("colours is empty: give at least one colour, such as colours=['#0072B2']")
        found = list(islice(cycle(given), len(wanted)))
    for colour in found:
        if not is_color_like(colour):
            raise ValueError(
                f"colours contains {colour!r}, which is not a colour of matplotlib; use a name or '#0072B2'"
            )
    return found


def check_colour(colour: object) -> None:
    """Raise a ValueError unless the argument is a colour that matplotlib knows."""
    if not isinstance(colour, str | tuple) or not is_color_like(colour):
        raise ValueError(
            f"colour must be a colour that matplotlib knows, got {shortened(colour)}: give colour='#0072B2'"
        )


def logarithmic(axes: Axes, which: str, values: ArrayLike) -> None:
    """Make an axis ("x" or "y") logarithmic. If no value is positive, its range is 0.1 to 10."""
    if not np.any(np.asarray(values) > 0):
        axes.set(**{f"{which}lim": (0.1, 10.0)})
    axes.set(**{f"{which}scale": "log"})


def plain_numbers(*axes: Any) -> None:
    """Label logarithmic axes (XAxis or YAxis) with numbers such as 0.1, 1, 10; a short range gets more labels."""
    for axis in axes:
        if axis.get_scale() != "log":
            continue
        low, high = axis.get_view_interval()
        decades = np.log10(high / low) if high > low > 0 else 0.0
        between = (1, 2, 3, 4, 6, 8) if decades < 1 else (1, 2, 5) if decades < 2.5 else (1,)
        axis.set_major_locator(ticker.LogLocator(subs=between))
        axis.set_major_formatter(ticker.FormatStrFormatter("%g"))
        axis.set_minor_formatter(ticker.NullFormatter())


def set_scale(axes: Axes, scale: str, lowest: float, highest: float) -> None:
    """Set scale ("log" or "linear") and range of the horizontal axis, for intensities from `lowest` to `highest`.

    Raises:
        ValueError: If the scale is unknown.
    """
    one_of("scale", scale, SCALES)
    if scale == "log":
        axes.set(xscale="log", xlim=(lowest / 1.15, highest * 1.15))
        plain_numbers(axes.xaxis)
    else:
        axes.set_xlim(0, highest * 1.02)


def check_kept(function: str, what: str, dataset: xr.Dataset, *dims: str) -> None:
    """Raise a ValueError if a dimension of a dataset is missing or empty, for example after a selection.

    Args:
        function: Name of the plot function, for error messages.
        what: Noun in the plural for the content of the dataset, for error messages.
        dataset: The dataset whose dimensions are checked.
        dims: Names of the dimensions.
    """
    for dim in dims:
        if not dataset.sizes.get(dim):
            raise ValueError(f"plots.{function}: the {what} have no {dim} left: select some by isel({dim}=[...])")


def grid(*axes: Axes) -> None:
    """Draw a pale grid behind the data of each of the axes."""
    for each in axes:
        is_log = "log" in (each.get_xscale(), each.get_yscale())
        each.grid(alpha=0.3, which="both" if is_log else "major", lw=0.4 if is_log else 0.8)


def literal(name: object) -> str:
    """Return a name from the user as text that matplotlib draws unchanged and in one line.

    If a name were not changed in this way, text between two "$" would become a formula, legends would omit a label that
    begins with "_", and a very long name would leave no space for the axes.
    """
    words = " ".join(str(name).split()) or "(no name)"
    if len(words) > LONGEST_NAME:
        words = f"{words[: LONGEST_NAME - 3]}..."
    words = words.replace("$", r"\$")
    return f"{NO_WIDTH}{words}" if words.startswith("_") else words


def title(axes: Axes, text: str) -> None:
    """Write the title of a panel in the font size TITLE."""
    axes.set_title(text, fontsize=TITLE)


def legend(axes: Axes, *, outside: bool = False, **how: Any) -> None:
    """Draw the legend of a panel: inside it or, if `outside` is True, at its right side."""
    where = {"loc": "upper left", "bbox_to_anchor": (1.01, 1.0), "borderaxespad": 0.0} if outside else {}
    axes.legend(**{"fontsize": SMALL, "title_fontsize": SMALL} | where | how)
