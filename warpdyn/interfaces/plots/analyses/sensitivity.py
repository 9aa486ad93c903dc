"""Figure of a sensitivity analysis: tornado diagram, Sobol indices or correlation ratios."""

from __future__ import annotations

from collections.abc import Iterable

import numpy as np
import xarray as xr
from matplotlib.axes import Axes

from warpdyn.foundations.core.checks import check_dataset
from warpdyn.interfaces.plots.style import (
    COLOURS,
    DARK,
    Colours,
    Drawn,
    check_kept,
    colours_of,
    grid,
    legend,
    literal,
    panels,
    title,
)

BAR = 0.8  # height of the bars of an input, as a share of its row
SHARES = {"first_order": "first-order index", "total": "total index", "correlation_ratio": "correlation ratio"}
ADVICE = "give the result of sobol_indices(), tornado() or correlation_ratios()"


def sensitivity(dataset: xr.Dataset, *, colours: Colours = COLOURS, ax: Iterable[Axes] | Axes | None = None) -> Drawn:
    """Draw a sensitivity analysis as horizontal bars, the most important parameter on top, with intervals as lines.

    There is one panel per stripe or damage state; the first panel decides the order of the parameters. A tornado
    diagram has the output divided by the output of the median structure.

    Args:
        dataset: Result of `sobol_indices`, `tornado` or `correlation_ratios`; select stripes or damage states with
            `.sel(stripe=[0.2])` or `.sel(damage_state="slight")` before.
        colours: Colours of the two kinds of bars (low and high quantile, or first-order and total index).
        ax: Axes to draw into, one for each panel; None: a new figure.

    Returns:
        The new figure, or the axes that were given as `ax`.

    Raises:
        TypeError, ValueError: If `dataset` is not the result of one of the three functions, or is empty.

    Example:
        >>> figure = wd.plots.sensitivity(wd.tornado(scene).sel(stripe=0.4))
    """
    name = "sensitivity"
    check_dataset(f"plots.{name}", dataset, advice=ADVICE)
    kinds = [each for each in ("ratio", *SHARES) if each in dataset]
    if not kinds or "input" not in dataset.dims:
        raise ValueError(f"plots.{name}: the dataset has no indices and no swings of inputs: {ADVICE}")
    dim = next((each for each in ("stripe", "damage_state") if each in dataset.dims), "")
    check_kept(name, "results", dataset, "input", *([dim] if dim else []))
    parts = [dataset.isel({dim: place}) for place in range(dataset.sizes[dim])] if dim else [dataset]
    rows = dataset.sizes["input"]
    across = max(5.5, 3.2 * len(parts) + 1.5)
    result, axes = panels(name, ax, len(parts), size=(across, 1.5 + 0.42 * rows), sharey=True)
    is_tornado = "ratio" in dataset
    ranked = parts[0]["swing" if is_tornado else kinds[-1]].values
    order = np.argsort(ranked, kind="stable")  # the largest is drawn last, on top
    bars = list(dataset["bound"].values) if is_tornado else kinds
    for place, (part, each) in enumerate(zip(parts, axes, strict=True)):
        for number, (bar, colour) in enumerate(zip(bars, colours_of(bars, colours), strict=True)):
            found = part.sel(bound=bar) if is_tornado else part
            key = "ratio" if is_tornado else bar
            centre, low, high = (found[key + end].values[order] for end in ("", "_lower", "_upper"))
            offset, height = (0.0, BAR) if is_tornado else (BAR * (0.5 - (number + 0.5) / len(bars)), BAR / len(bars))
            at, start = np.arange(rows) + offset, 1.0 if is_tornado else 0.0
            words = f"{bar} quantile ({float(found['quantile']):g})" if is_tornado else SHARES[bar]
            each.barh(at, centre - start, height, left=start, color=colour, label=words)
            each.hlines(at + (0.12 * (2 * number - 1) if is_tornado else 0.0), low, high, color=DARK, lw=1.2, zorder=3)
        each.axvline(1.0 if is_tornado else 0.0, color="black", lw=0.8)
        each.set_xlabel("Ratio to median" if is_tornado else "Share of the variance")
        if place == 0:
            each.set_yticks(np.arange(rows), [literal(label) for label in dataset["input"].values[order]])
        grid(each)
        if dim:
            label, units = part[dim].item(), str(dataset[dim].attrs.get("units", ""))
            title(each, f"{label:g} {units}" if dim == "stripe" else literal(label))
    legend(axes[-1], outside=True)
    return result
