"""Figures of incremental dynamic analysis (IDA): drifts at increasing intensities up to collapse, and capacities."""

from __future__ import annotations

import numpy as np
import xarray as xr
from matplotlib.axes import Axes
from matplotlib.collections import LineCollection

from warpdyn.answers.fragility.demands import refuse_portfolio
from warpdyn.foundations.core.checks import check_dataset, one_of
from warpdyn.interfaces.plots.drifts import OF_STRIPES, limits_of
from warpdyn.interfaces.plots.samples import SHARES, Demands, demands_of, fractiles
from warpdyn.interfaces.plots.style import (
    AMONG_POINTS,
    COLLAPSE_COLOUR,
    COLOURS,
    DARK,
    PALE,
    SCALES,
    Drawn,
    check_colour,
    check_kept,
    grid,
    legend,
    literal,
    panels,
    plain_numbers,
    title,
)

MOST_CURVES = 200  # largest number of curves that are drawn; the fractiles use all curves
APART = 0.04  # smallest distance between the names of two limits, divided by the length of the axis
BEYOND = 1.6  # end of the axis divided by the largest drift; leaves space for the horizontal lines after collapse


def ida_curves(
    dataset: xr.Dataset, *, colour: str = COLOURS[0], scale: str = "linear", ax: Axes | None = None
) -> Drawn:
    """Draw IDA curves (intensity over the largest peak drift ratio), and their 16, 50 and 84 % fractile curves.

    There is one IDA curve per pair of structure and motion. A curve has a cross at its first collapse and is horizontal
    after it. Fractiles are those of the drift ratio at each intensity level; a collapsed sample counts as exceeding
    every drift. A fractile curve becomes horizontal at the first level at which the fractile is undefined, because too
    many samples collapsed. The 84 % fractile of the drift is the lowest curve.

    Source: Vamvatsikos and Cornell (2002), "Incremental dynamic analysis", Earthquake Engineering and Structural
    Dynamics 31(3).

    Args:
        dataset: Result of `simulate` on stripes. If it is merged with the result of `fragility`, the limits of the
            damage states are also drawn.
        colour: Colour of the fractile curves.
        scale: Scale of the axis of drifts: "linear" or "log".
        ax: Axes to draw into; None: a new figure.

    Returns:
        The new figure, or the axes that were given as `ax`.

    Raises:
        ValueError: If the run has several archetypes, fewer than two stripes or no drifts, or if the scale is unknown.
        TypeError: If `dataset` is not a Dataset.

    Example:
        >>> result = run.merge(curves, combine_attrs="no_conflicts")  # with the limits
        >>> figure = wd.plots.ida_curves(result)
    """
    one_of("scale", scale, SCALES)
    check_colour(colour)
    if isinstance(dataset, xr.Dataset):
        refuse_portfolio("plots.ida_curves", dataset)
    drawn = demands_of("ida_curves", dataset, "peak_storey_drift_ratio", OF_STRIPES)
    if not drawn.is_striped or drawn.levels.size < 2:
        raise ValueError(
            "plots.ida_curves: a curve needs at least two levels, but the run has fewer: simulate wd.Stripes(...)"
        )
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
        # A fractile curve is drawn up to the first level at which the fractile is undefined.
        last = int(np.argmin(defined)) if not defined.all() else defined.size
        line = np.append(0.0, drift[:last]), np.append(0.0, drawn.levels[:last])
        axes.plot(*line, style, color=colour, lw=width, label=f"{100 * share:.0f} % of the drifts")
        if 0 < last < defined.size:
            # From its last point, the curve rises to the level at which this share of the samples has collapsed, and
            # continues horizontally.
            rise = (
                [drift[last - 1], collapses[:, 0].max(), farthest],
                [drawn.levels[last - 1], *2 * [drawn.levels[last]]],
            )
            axes.plot(*rise, style, color=colour, lw=width)
            axes.plot(drift[last - 1], drawn.levels[last - 1], "s", color=colour, ms=4)
    axes.set(
        xlabel="Largest peak storey drift ratio [%]", ylabel=literal(drawn.measure), ylim=(0, 1.08 * drawn.levels[-1])
    )
    if scale == "log":
        positive = drawn.values[drawn.values > 0]
        axes.set(xlim=(80 * float(positive.min()) if positive.size else 0.1 * farthest, farthest), xscale="log")
        plain_numbers(axes.xaxis)
    else:
        axes.set_xlim(0, farthest)
    _name_limits(axes, [(state, 100 * limit) for state, limit in limits_of(dataset)])
    grid(axes)
    legend(axes, outside=True)
    title(axes, "Incremental dynamic analysis")
    return result


def capacities(dataset: xr.Dataset, *, colour: str = COLOURS[0], scale: str = "log", ax: Axes | None = None) -> Drawn:
    """Draw the 16, 50 and 84 % fractiles of the capacities for each limit, and the IDA curves if they were kept.

    A capacity is the intensity at which a pair of structure and motion first exceeds a limit, so the fractiles are
    those of the intensity at a given demand (Vamvatsikos and Cornell 2002). Capacities above the highest analysed level
    are infinite and not drawn. A state that only collapse exceeds is drawn at the right end.

    Args:
        dataset: Result of `capacities`. If it was computed with `keep_curves=True`, the IDA curves are also drawn.
        colour: Colour of the fractile curves.
        scale: Scale of the axes of demand and intensity: "log" or "linear".
        ax: Axes to draw into; None: a new figure.

    Returns:
        The new figure, or the axes that were given as `ax`.

    Raises:
        ValueError: If the dataset has no capacities, or no capacity is finite.
        TypeError: If `dataset` is not a Dataset.

    Example:
        >>> found = wd.capacities(scene, limits, structures=2, keep_curves=True)
        >>> figure = wd.plots.capacities(found)
    """
    advice = "draw the result of capacities(scene, limits)"
    check_dataset("plots.capacities", dataset, "capacity", "damage_limit", advice=advice)
    check_kept("capacities", "capacities", dataset, "structure", "motion", "damage_state")
    capacity = dataset["capacity"].transpose("structure", "motion", "damage_state")
    values = capacity.values.reshape(-1, capacity.sizes["damage_state"])
    values = values[~np.isnan(values).any(axis=1)]
    if not np.isfinite(values).any():
        raise ValueError("plots.capacities: no capacity is finite: give a higher highest= to capacities()")
    limit = dataset["damage_limit"]
    is_ratio = limit.attrs["demand"] == "peak_storey_drift_ratio"
    factor, units = (100, "%") if is_ratio else (1, limit.attrs["units"])
    at = factor * limit.values.astype(float)
    result, (axes,) = panels("capacities", ax, size=(6.4, 4.8))
    farthest = BEYOND * float(at[np.isfinite(at)].max(initial=0.0))
    demand = str(limit.attrs["demand"])
    if demand in dataset:
        farthest = max(farthest, 1.3 * factor * float(np.nanmax(dataset[demand].values)))
        _draw_kept_curves(axes, dataset, demand, factor, farthest)
    farthest = farthest or 1.0
    axes.set(xscale=scale, yscale=scale)
    at = np.where(np.isfinite(at), at, farthest)
    for share, row, style in zip(SHARES, fractiles(values), ("--", "-", ":"), strict=True):
        width = 2.0 if share == 0.5 else 1.3
        axes.plot(
            at, row, style, marker="o", ms=3.5, color=colour, lw=width, label=f"{100 * share:.0f} % of capacities"
        )
    axes.set_xlim(0 if scale == "linear" else 0.3 * float(at.min()), 1.02 * farthest)
    finite = values[np.isfinite(values)]
    axes.set_ylim(0 if scale == "linear" else 0.5 * float(finite.min()), 1.2 * float(finite.max()))
    words = "Largest peak storey drift ratio" if is_ratio else demand.replace("_", " ").capitalize()
    measure = f"{dataset.attrs['intensity_measure']} [{capacity.attrs['units']}]"
    axes.set(xlabel=f"{words} [{units}]", ylabel=literal(measure))
    plain_numbers(axes.xaxis, axes.yaxis)
    _name_limits(axes, list(zip(dataset["damage_state"].values, at, strict=True)))
    grid(axes)
    legend(axes, outside=True)
    title(axes, f"Capacities of {len(values):,} pairs of structure and motion")
    return result


def _draw_kept_curves(axes: Axes, dataset: xr.Dataset, demand: str, factor: float, farthest: float) -> None:
    """Draw at most MOST_CURVES kept IDA curves, each of a pair of structure and motion, horizontal after collapse."""
    structure, motion = dataset["structure_index"].values, dataset["motion_index"].values
    level, values = dataset["im_level"].values, factor * dataset[demand].values
    collapsed = dataset["status"].values == 1
    starts = np.flatnonzero(np.append(True, (np.diff(structure) != 0) | (np.diff(motion) != 0)))
    rows = np.split(np.arange(level.size), starts[1:])
    shown = [rows[i] for i in np.unique(np.linspace(0, len(rows) - 1, MOST_CURVES).astype(int))]
    words = f"{len(rows):,} curves" + (f", {len(shown)} drawn" if len(shown) < len(rows) else "")
    lines, ends = [], []
    for samples in shown:
        first = int(collapsed[samples].argmax()) if collapsed[samples].any() else samples.size
        points = np.stack([values[samples[:first]], level[samples[:first]]], axis=1)
        if first < samples.size:
            ends.append((points[-1, 0] if first else 0.0, level[samples[first]]))
            points = np.vstack([points, ends[-1], (farthest, ends[-1][1])])
        lines.append(points)
    axes.add_collection(LineCollection(lines, colors=PALE, linewidths=0.4, label=words))
    if ends:
        axes.plot(*np.array(ends).T, "x", color=COLLAPSE_COLOUR, ms=4, mew=0.9, label="first collapse")


def _name_limits(axes: Axes, limits: list[tuple[str, float]]) -> None:
    """Draw limits as vertical lines [units of the axis]; names that would overlap the previous name are not written."""
    across = axes.transAxes.inverted()
    before = -1.0
    for state, limit in limits:
        axes.axvline(limit, color=DARK, ls=":", lw=0.8)
        at = float(across.transform(axes.transData.transform((limit, axes.get_ylim()[1])))[0])
        if at - before > APART and at > APART:
            end, where = (limit, 0.98), axes.get_xaxis_transform()
            axes.annotate(
                literal(state), end, xycoords=where, rotation=90, color=DARK, ha="right", va="top", **AMONG_POINTS
            )
            before = at


def _paths(drawn: Demands) -> list[np.ndarray]:
    """Return the sample indices of each IDA curve, sorted by level and ending at the first collapse of the curve."""
    order = np.lexsort((drawn.level, drawn.motion, drawn.structure))
    is_first = np.append(True, (np.diff(drawn.structure[order]) != 0) | (np.diff(drawn.motion[order]) != 0))
    starts = np.flatnonzero(is_first)
    # Number of collapsed samples at lower levels of the same IDA curve.
    before = np.cumsum(drawn.collapsed[order]) - drawn.collapsed[order]
    before -= before[starts][np.cumsum(is_first) - 1]
    kept = before == 0
    return np.split(order[kept], np.flatnonzero(is_first[kept])[1:])
