"""Figures of incremental dynamic analysis: the demand of each motion at growing intensities, up to collapse."""

from __future__ import annotations

import numpy as np
import xarray as xr
from matplotlib.axes import Axes
from matplotlib.collections import LineCollection

from warpdyn.core.checks import one_of
from warpdyn.plots.drifts import OF_STRIPES, limits_of
from warpdyn.plots.samples import SHARES, Demands, demands_of
from warpdyn.plots.style import (
    COLLAPSE_COLOUR,
    COLOURS,
    DARK,
    PALE,
    SCALES,
    SMALL,
    Drawn,
    grid,
    legend,
    panels,
    plain_numbers,
    title,
)

MOST_CURVES = 200  # drawn; fractiles are of all
APART = 0.04  # of the axis, between the names of two limits
BEYOND = 1.6  # how far the axis goes on beyond the largest drift, for the flat lines


def ida_curves(
    dataset: xr.Dataset, *, colour: str = COLOURS[0], scale: str = "linear", ax: Axes | None = None
) -> Drawn:
    """Draw the intensity measure against the largest peak drift ratio, for each motion, with 16, 50 and 84 % curves.

    A curve ends at its first collapse, with a cross, and is flat from there on. Fractiles are those of the drift at
    each level, where a collapsed sample exceeds every drift; each goes on to the first level that has none and
    is flat from there on. (The 84 % curve of the drift is the lowest.)

    Source: Vamvatsikos and Cornell (2002), "Incremental dynamic analysis", Earthquake Engineering and Structural
    Dynamics 31(3).

    Args:
        dataset: A run on stripes; each structure under each motion has a curve. Merged with its `fragility` it shows
            the limits.
        colour: Colour of the fractiles.
        scale: Axis of the drifts: "linear" or "log".
        ax: Axes to draw into; None for a figure of its own.

    Returns:
        The figure, or the axes given.

    Raises:
        ValueError: If the run is not on at least two stripes, or has no drifts, or the scale is unknown.
        TypeError: If `dataset` is no Dataset.
    """
    one_of("scale", scale, SCALES)
    drawn = demands_of("ida_curves", dataset, "peak_storey_drift_ratio", OF_STRIPES)
    if not drawn.is_striped or drawn.levels.size < 2:
        raise ValueError("plots.ida_curves: the run is not on two stripes or more, which make a curve for each motion")
    result, (axes,) = panels("ida_curves", ax, size=(6.4, 4.8))
    farthest = 100 * BEYOND * float(np.max(drawn.values)) or 1.0
    paths = _paths(drawn)
    shown = np.unique(np.linspace(0, len(paths) - 1, MOST_CURVES).astype(int))
    words = f"{len(paths):,} curves" + (f", {shown.size} drawn" if shown.size < len(paths) else "")
    points = np.stack([100 * drawn.values, drawn.level], axis=1)
    curves = [np.vstack([np.zeros((1, 2)), points[paths[i]]]) for i in shown]
    axes.add_collection(LineCollection(curves, colors=PALE, linewidths=0.5, label=words))
    ends = np.array([path[-1] for path in paths])
    collapses = points[ends[drawn.collapsed[ends]]]
    if len(collapses):
        flat = [
            np.array([curves[k][-1], (farthest, curves[k][-1, 1])])
            for k, i in enumerate(shown)
            if drawn.collapsed[ends[i]]
        ]
        axes.add_collection(LineCollection(flat, colors=PALE, linewidths=0.3))
        axes.plot(*np.unique(collapses, axis=0).T, "x", color=COLLAPSE_COLOUR, ms=4, mew=0.9)
        axes.plot([], [], "x", color=COLLAPSE_COLOUR, ms=4, label=f"collapse: {len(collapses):,}")
    for share, drift, style in zip(SHARES, 100 * drawn.fractiles().T, ("--", "-", ":"), strict=True):
        defined = np.isfinite(drift)
        width = 2.0 if share == 0.5 else 1.3
        # Up to the last level before the first that has none; what stands again above it is not drawn.
        last = int(np.argmin(defined)) if not defined.all() else defined.size
        line = np.append(0.0, drift[:last]), np.append(0.0, drawn.levels[:last])
        axes.plot(*line, style, color=colour, lw=width, label=f"{100 * share:.0f} % of the drifts")
        if 0 < last < defined.size:
            # As of each curve: up to the level at which so many have collapsed, and flat from there on.
            rise = (
                [drift[last - 1], collapses[:, 0].max(), farthest],
                [drawn.levels[last - 1], *2 * [drawn.levels[last]]],
            )
            axes.plot(*rise, style, color=colour, lw=width)
            axes.plot(drift[last - 1], drawn.levels[last - 1], "s", color=colour, ms=4)
    axes.set(xlabel="Largest peak storey drift ratio [%]", ylabel=drawn.measure, ylim=(0, 1.08 * drawn.levels[-1]))
    if scale == "log":
        positive = drawn.values[drawn.values > 0]
        axes.set(xlim=(80 * float(positive.min()) if positive.size else 0.1 * farthest, farthest), xscale="log")
        plain_numbers(axes.xaxis)
    else:
        axes.set_xlim(0, farthest)
    _draw_limits(axes, dataset)
    grid(axes)
    legend(axes, beside=True)
    title(axes, "Incremental dynamic analysis")
    return result


def _draw_limits(axes: Axes, dataset: xr.Dataset) -> None:
    """Draw the limits of damage states, and name those that stand apart from the one before."""
    across = axes.transAxes.inverted()
    before = -1.0
    for state, limit in limits_of(dataset):
        axes.axvline(100 * limit, color=DARK, ls=":", lw=0.8)
        at = float(across.transform(axes.transData.transform((100 * limit, 0.0)))[0])
        if at - before > APART and at > APART:
            place, where = (100 * limit, 0.98), axes.get_xaxis_transform()
            axes.annotate(state, place, xycoords=where, rotation=90, fontsize=SMALL, color=DARK, ha="right", va="top")
            before = at


def _paths(drawn: Demands) -> list[np.ndarray]:
    """Return the samples of each structure's curve under each motion, by their level up to its first collapse."""
    order = np.lexsort((drawn.level, drawn.motion, drawn.structure))
    is_first = np.append(True, (np.diff(drawn.structure[order]) != 0) | (np.diff(drawn.motion[order]) != 0))
    starts = np.flatnonzero(is_first)
    # How many collapses of the curve come before each sample.
    before = np.cumsum(drawn.collapsed[order]) - drawn.collapsed[order]
    before -= before[starts][np.cumsum(is_first) - 1]
    kept = before == 0
    return np.split(order[kept], np.flatnonzero(is_first[kept])[1:])
