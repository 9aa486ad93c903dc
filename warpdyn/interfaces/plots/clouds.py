"""Figure of a cloud analysis: demands of unscaled motions against intensity, their regression, and collapses."""

from __future__ import annotations

from typing import Any

import numpy as np
import xarray as xr
from matplotlib.axes import Axes

from warpdyn.foundations.core.checks import check_dataset
from warpdyn.interfaces.plots.samples import demands_of
from warpdyn.interfaces.plots.style import (
    AMONG_POINTS,
    COLLAPSE_COLOUR,
    COLOURS,
    MOST_POINTS,
    PALE,
    Colours,
    Drawn,
    check_kept,
    colours_of,
    grid,
    legend,
    literal,
    panels,
    plain_numbers,
    set_scale,
    title,
)

_RUN = "draw a run of simulate() under ground motions"
_CURVES = "pass the result of fragility_of_cloud(run, limits)"
_FEW = 2000  # largest number of samples that are drawn with larger points


def cloud_regression(
    run: xr.Dataset, curves: xr.Dataset, *, colours: Colours = COLOURS, ax: Axes | None = None
) -> Drawn:
    """Draw a cloud analysis: demands against intensity, and the regression on which the fragility curves are based.

    A collapsed sample is a cross at the demand that it reached. For each limit, the median of its fragility curve is
    drawn. With the estimator "censored", this median is the intensity at which the regression reaches the limit. With
    the estimator "collapse", the median is lower, because collapsed samples also exceed the limit.

    Args:
        run: Result of `simulate` for unscaled ground motions (`Cloud`).
        curves: Result of `fragility_of_cloud` for the run.
        colours: Colour of each damage state: a list with the lightest state first, or a mapping by name.
        ax: Axes to draw into; None: a new figure.

    Returns:
        The new figure, or the axes that were given as `ax`.

    Raises:
        ValueError: If `run` or `curves` lacks a variable that is drawn.
        TypeError: If `run` or `curves` is not a Dataset.

    Example:
        >>> run = wd.simulate(wd.Scene(building, wd.Cloud(motions), scatter), structures=4)
        >>> figure = wd.plots.cloud_regression(run, wd.fragility_of_cloud(run, limits))
    """
    name = "cloud_regression"
    needed = ("regression_intercept", "regression_slope", "regression_deviation", "damage_limit", "fragility_median")
    check_dataset(f"plots.{name}", curves, *needed, advice=_CURVES)
    check_kept(name, "curves", curves, "damage_state")
    demand = str(curves["damage_limit"].attrs.get("demand", "peak_storey_drift_ratio"))
    drawn = demands_of(name, run, demand, _RUN)
    result, (axes,) = panels(name, ax, size=(6.6, 4.8))
    is_ratio = demand.endswith("drift_ratio")
    factor = 100.0 if is_ratio else 1.0
    level, values = drawn.level, factor * drawn.values.astype(np.float64)
    standing = np.flatnonzero(~drawn.collapsed & (values > 0))
    shown = np.random.default_rng(0).permutation(standing)[:MOST_POINTS]
    size = 4 if level.size > _FEW else 12
    axes.scatter(level[shown], values[shown], s=size, color=PALE, lw=0, rasterized=True, label="samples")
    if drawn.collapsed.any():
        words = f"collapsed: {drawn.collapsed.sum():,} of {level.size:,}"
        at = level[drawn.collapsed], values[drawn.collapsed]
        axes.scatter(*at, marker="x", s=14, lw=0.8, color=COLLAPSE_COLOUR, zorder=3, label=words)

    intercept, slope, deviation = (float(curves[each]) for each in needed[:3])
    along = np.geomspace(level.min(), level.max(), 50)
    line = factor * np.exp(intercept + slope * np.log(along))
    label = f"regression: slope {slope:.2f}, deviation {deviation:.2f}"
    axes.plot(along, line, color="black", lw=1.6, zorder=4, label=label)
    for number, side in enumerate((-1.0, 1.0)):
        words = "" if number else "± one deviation"
        axes.plot(along, line * np.exp(side * deviation), "--", color="black", lw=0.9, zorder=4, label=words)
    states = curves["damage_state"].values
    for colour, state in zip(colours_of(states, colours), states, strict=True):
        row = curves.sel(damage_state=state)
        limit, median = factor * float(row["damage_limit"]), float(row["fragility_median"])
        if not np.isfinite(limit):  # an infinite limit is exceeded only by collapse, which is drawn below
            continue
        axes.axhline(limit, color=colour, lw=1)
        name = literal(state)
        words = f"{name}: median {median:.3g}" if np.isfinite(median) else f"{name}, no fit"
        # The name is written at the left or right end of the line, whichever is farther from the median, because there
        # are few points near the line at this end.
        across, anchor = (0.99, "right") if median < np.sqrt(level.min() * level.max()) else (0.01, "left")
        where: dict[str, Any] = {"xycoords": axes.get_yaxis_transform(), "ha": anchor, "va": "bottom"}
        axes.annotate(words, (across, limit), color=colour, **where, **AMONG_POINTS)
        if np.isfinite(median):
            axes.plot(median, limit, "o", color=colour, ms=7, mec="white", zorder=5)
    if np.isfinite(float(curves.get("collapse_median", np.inf))):
        median = float(curves["collapse_median"])
        axes.axvline(median, color=COLLAPSE_COLOUR, ls=":", lw=1.2, label=f"median of collapse {median:.3g}")
    axes.set_yscale("log")
    set_scale(axes, "log", level.min(), level.max())
    plain_numbers(axes.yaxis)
    words = demand.replace("_", " ").removeprefix("peak ")
    units = "%" if is_ratio else str(run[demand].attrs.get("units", "1"))
    axes.set(xlabel=literal(drawn.measure), ylabel=f"Largest {words.removesuffix(' ratio')} [{units}]")
    grid(axes)
    legend(axes, loc="lower right")
    has_model = "collapse_median" in curves
    title(
        axes, "Regression without collapses, and model of collapse" if has_model else "Regression, collapses censored"
    )
    return result
