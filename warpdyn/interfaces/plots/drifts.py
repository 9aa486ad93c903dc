"""Figures of storey drift ratios: over the height, against the intensity, and as distributions of several runs."""

from __future__ import annotations

from collections.abc import Iterable, Mapping
from typing import Any

import numpy as np
import xarray as xr
from matplotlib import ticker
from matplotlib.axes import Axes

from warpdyn.campaigns.running.selections import without_added_storeys
from warpdyn.foundations.core.checks import real_number, whole_number
from warpdyn.interfaces.plots.samples import Demands, demands_of, percent
from warpdyn.interfaces.plots.style import (
    AMONG_POINTS,
    COLLAPSE_COLOUR,
    COLOURS,
    DARK,
    MOST_POINTS,
    PALE,
    SMALL,
    Colours,
    Drawn,
    colours_of,
    grid,
    legend,
    literal,
    logarithmic,
    panels,
    plain_numbers,
    set_scale,
    title,
)

OF_STRIPES = "draw a run of a ShearBuilding on stripes"
OF_MOTIONS = "draw a run of a ShearBuilding under ground motions"


def drift_over_height(
    dataset: xr.Dataset, levels: int = 5, *, colours: Colours = COLOURS, ax: Axes | None = None
) -> Drawn:
    """Draw the median and the 16 to 84 % range of the peak drift ratio of each storey, for some intensity levels.

    A collapsed sample counts as exceeding every drift in the storey that collapsed. In other storeys, its peak drift
    before the collapse counts. The median of a storey is not drawn if more than half of the samples at a level
    collapsed in it, and the range is not drawn if more than 16 % did. The legend shows the share of collapsed samples.

    Args:
        dataset: Result of `simulate` on stripes (intensity levels). If it is merged with the result of `fragility`, the
            limits of the damage states are also drawn.
        levels: Largest number of stripes that are drawn.
        colours: Colours of the stripes, beginning with the lowest intensity.
        ax: Axes to draw into; None: a new figure.

    Returns:
        The new figure, or the axes that were given as `ax`.

    Raises:
        ValueError: If the dataset has no drifts or no intensity levels.
        TypeError: If `dataset` is not a Dataset.

    Example:
        >>> figure = wd.plots.drift_over_height(run, levels=3)
    """
    levels = whole_number("levels", levels, 1)
    drawn = demands_of("drift_over_height", dataset, "peak_storey_drift_ratio", OF_STRIPES, by_storey=True)
    if not drawn.is_striped:
        raise ValueError(
            "drift_over_height draws one curve per stripe, but the run has no stripes: simulate wd.Stripes(...)"
        )
    chosen = np.unique(np.linspace(0, drawn.levels.size - 1, min(levels, drawn.levels.size)).round().astype(int))
    result, (axes,) = panels("drift_over_height", ax, size=(7.0, 4.6))
    storeys = without_added_storeys(dataset)["storey"].values
    shares, table = drawn.collapsed_share()[chosen], 100 * drawn.fractiles()[chosen]
    stripes = drawn.levels[chosen]
    for colour, level, share, (low, median, high) in zip(
        colours_of(stripes, colours), stripes, shares, table, strict=True
    ):
        if np.isfinite(low + high).any():
            axes.fill_betweenx(storeys, low, high, color=colour, alpha=0.15, lw=0)
        for bound in (low, high) if np.isnan(high).any() else ():
            axes.plot(bound, storeys, "--", color=colour, lw=1)
        remark = f", {percent(share)} collapsed" if share else ""
        axes.plot(median, storeys, "o-", color=colour, ms=4, label=f"{level:g}{remark}")
    logarithmic(axes, "x", table)
    axes.set(xlabel="Peak storey drift ratio [%]", ylabel="Storey", ylim=(0.6, storeys[-1] + 0.4))
    plain_numbers(axes.xaxis)
    axes.yaxis.set_major_locator(ticker.MaxNLocator(integer=True))
    limits = limits_of(dataset)
    for _, limit in limits:
        axes.axvline(100 * limit, color=DARK, ls=":", lw=1)
    if limits:  # names of the limits are on a second axis, below the title
        above = axes.secondary_xaxis("top")
        above.xaxis.set_minor_locator(ticker.NullLocator())
        names, values = [literal(state) for state, _ in limits], [100 * limit for _, limit in limits]
        above.set_xticks(
            values, labels=names, fontsize=SMALL, color=DARK, rotation=25, ha="left", rotation_mode="anchor"
        )
    grid(axes)
    legend(axes, outside=True, title=literal(drawn.measure))
    title(axes, "Peak drift over height: median, 16 and 84 % fractiles")
    return result


def limits_of(dataset: xr.Dataset) -> list[tuple[str, float]]:
    """Return name and drift ratio limit [1] of each damage state with a finite limit; [] without such limits."""
    if "damage_limit" not in dataset or dataset["damage_limit"].attrs.get("demand") != "peak_storey_drift_ratio":
        return []
    found = zip(dataset["damage_state"].values, dataset["damage_limit"].values, strict=True)
    return [(state, limit) for state, limit in found if np.isfinite(limit)]


def drift_against_intensity(
    dataset: xr.Dataset, *, colours: Colours = COLOURS, scale: str = "log", ax: Axes | None = None
) -> Drawn:
    """Draw the largest peak drift ratio of every sample against the intensity; for stripes, also median and fractiles.

    A collapsed sample is a cross at the drift that it reached. It counts as exceeding every drift, so the curve of the
    median ends at the last stripe in which at most half of the samples collapsed.

    Args:
        dataset: Result of `simulate` under ground motions. If it is merged with the result of `fragility`, the limits
            of the damage states are also drawn.
        colours: Colours of the damage states, as a list or a mapping by name.
        scale: Axis of the intensity measure: "log" or "linear".
        ax: Axes to draw into; None: a new figure.

    Returns:
        The new figure, or the axes that were given as `ax`.

    Raises:
        ValueError: If the dataset has no drifts or no intensities.
        TypeError: If `dataset` is not a Dataset.

    Example:
        >>> result = run.merge(curves, combine_attrs="no_conflicts")  # with the limits
        >>> figure = wd.plots.drift_against_intensity(result)
    """
    name = "drift_against_intensity"
    drawn = demands_of(name, dataset, "peak_storey_drift_ratio", OF_MOTIONS)
    result, (axes,) = panels(name, ax, size=(6.4, 4.6))
    _draw_against_intensity(axes, drawn, scale, where_collapsed=drawn.values)
    limits = limits_of(dataset)
    for colour, (state, limit) in zip(colours_of([state for state, _ in limits], colours), limits, strict=True):
        axes.axhline(100 * limit, color=colour, lw=1)
        at = (0.01, 100 * limit)
        axes.annotate(
            literal(state), at, xycoords=axes.get_yaxis_transform(), color=colour, va="bottom", **AMONG_POINTS
        )
    axes.set_ylabel("Largest peak storey drift ratio [%]")
    return result


def residual_drifts(dataset: xr.Dataset, *, scale: str = "log", ax: Axes | None = None) -> Drawn:
    """Draw the largest residual drift ratio of every sample against the intensity; for stripes, also the fractiles.

    A collapsed sample has no residual drift and is drawn as a cross at the upper edge. It counts as exceeding every
    residual drift, so the curve of the median ends at the last stripe in which at most half of the samples collapsed.

    Args:
        dataset: Result of `simulate` under ground motions, with the recorder "residual".
        scale: Axis of the intensity measure: "log" or "linear".
        ax: Axes to draw into; None: a new figure.

    Returns:
        The new figure, or the axes that were given as `ax`.

    Raises:
        ValueError: If the dataset has no residual drifts or no intensities.
        TypeError: If `dataset` is not a Dataset.

    Example:
        >>> figure = wd.plots.residual_drifts(run)
    """
    advice = "draw a run of a ShearBuilding under ground motions with the recorder 'residual'"
    drawn = demands_of("residual_drifts", dataset, "residual_drift_ratio", advice)
    result, (axes,) = panels("residual_drifts", ax, size=(6.4, 4.6))
    _draw_against_intensity(axes, drawn, scale, where_collapsed=None)
    axes.set_ylabel("Largest residual storey drift ratio [%]")
    return result


FEW = 2000  # largest number of samples that are drawn with larger points
LEAST_DRAWN = 1e-3  # smallest value on a logarithmic axis, divided by the largest value


def _draw_against_intensity(axes: Axes, drawn: Demands, scale: str, where_collapsed: np.ndarray | None) -> None:
    """Draw samples, fractiles of stripes, and collapsed samples into axes.

    Collapsed samples are drawn at the drift ratios `where_collapsed` [1]; None: at the upper edge.
    """
    level, demand = drawn.level, 100 * drawn.values
    stands = np.flatnonzero(~drawn.collapsed)
    shown = np.random.default_rng(0).permutation(stands)[:MOST_POINTS]
    size = 3 if level.size > FEW else 10
    axes.scatter(level[shown], demand[shown], s=size, color=PALE, lw=0, rasterized=True, label="samples")
    if drawn.is_striped:
        low, median, high = 100 * drawn.fractiles().T
        axes.plot(drawn.levels, median, "o-", color="black", ms=4, label="median")
        axes.plot(drawn.levels, low, "--", color="black", lw=1, label="16 and 84 %")
        axes.plot(drawn.levels, high, "--", color="black", lw=1)
    logarithmic(axes, "y", demand if where_collapsed is not None else demand[stands])
    largest = np.max(demand[np.isfinite(demand)], initial=0.0)
    if largest > 0 and axes.get_ylim()[0] < LEAST_DRAWN * largest:
        axes.set_ylim(LEAST_DRAWN * largest, 2 * largest)
    if drawn.collapsed.any():
        those = np.flatnonzero(drawn.collapsed)
        look: dict[str, Any] = {
            "marker": "x",
            "s": 16,
            "color": COLLAPSE_COLOUR,
            "lw": 0.9,
            "zorder": 3,
            "label": f"collapsed: {those.size:,} of {level.size:,}",
        }
        if where_collapsed is None:
            each = np.unique(level[those])
            edge = np.full(each.size, 0.98)
            axes.scatter(each, edge, transform=axes.get_xaxis_transform(), clip_on=False, **look)
        else:
            each, at = np.unique(np.stack([level[those], 100 * where_collapsed[those]]), axis=1)
            axes.scatter(each, at, **look)
    axes.set_xlabel(literal(drawn.measure))
    set_scale(axes, scale, level.min(), level.max())
    plain_numbers(axes.yaxis)
    grid(axes)
    legend(axes, loc="lower right")


def drift_distributions(
    runs: Mapping[str, xr.Dataset], *, level: float | None = None, colours: Colours = COLOURS, ax: Axes | None = None
) -> Drawn:
    """Draw, for each run, the share of samples whose largest peak drift ratio of all storeys is below each drift ratio.

    A collapsed sample counts as exceeding every drift. The curve of a run with collapses ends with a cross at the share
    of samples without collapse.

    Args:
        runs: Result of `simulate` for each design, as a mapping such as `{"existing": run, "with dampers": other}`.
        level: Intensity level of the stripe that is drawn [unit of the levels]; required if a run has several stripes.
        colours: Colour of each design, as a list or a mapping by name.
        ax: Axes to draw into; None: a new figure.

    Returns:
        The new figure, or the axes that were given as `ax`.

    Raises:
        ValueError: If `runs` is empty, if a run has no drifts, or if `level` is missing.
        TypeError: If a run is not a Dataset.

    Example:
        >>> other = wd.simulate(scene, structures=3, seed=2)
        >>> figure = wd.plots.drift_distributions({"seed 1": run, "seed 2": other}, level=0.6)  # g
    """
    named = checked_designs("drift_distributions", runs, "run")
    result, (axes,) = panels("drift_distributions", ax, size=(6.4, 4.6))
    demands = {}
    for name, run in named.items():
        drawn = demands_of("drift_distributions", run, "peak_storey_drift_ratio", OF_MOTIONS, by_level=False)
        demands[name] = _on_one_level(name, drawn, level) if drawn.is_striped else drawn
    stripes = {name: _stripe_of(drawn) if drawn.is_striped else "" for name, drawn in demands.items()}
    is_same = len(set(stripes.values())) == 1
    for colour, (name, drawn) in zip(colours_of(named, colours), demands.items(), strict=True):
        drift = np.sort(drawn.unlimited)
        stands = np.flatnonzero(np.isfinite(drift))
        below = np.arange(1, drift.size + 1) / drift.size
        share = drawn.collapsed.mean()
        remarks = [stripes[name]] * (not is_same and bool(stripes[name]))
        remarks += [f"{percent(share)} collapsed"] * bool(share)
        words = f"{literal(name)}: {', '.join(remarks)}" if remarks else literal(name)
        across = np.append(100 * drift[stands[:1]], 100 * drift[stands])
        axes.step(across, np.append(0.0, below[stands])[: across.size], where="post", color=colour, label=words)
        if share and stands.size:
            axes.plot(across[-1], below[stands[-1]], "x", color=colour, ms=7, mew=1.6)
        elif share:
            axes.plot([], [], "x", color=colour)
    logarithmic(axes, "x", np.concatenate([drawn.values[~drawn.collapsed] for drawn in demands.values()]))
    axes.set(ylim=(-0.02, 1.02), xlabel="Largest peak storey drift ratio [%]", ylabel="Share of samples")
    plain_numbers(axes.xaxis)
    axes.yaxis.set_major_formatter(ticker.PercentFormatter(1.0))
    grid(axes)
    legend(axes, loc="best")
    if is_same:
        title(axes, next(iter(stripes.values())))
    return result


def checked_designs(function: str, designs: object, what: str) -> dict[str, xr.Dataset]:
    """Return a mapping from design names to datasets; raise an error unless it contains at least one Dataset."""
    if not isinstance(designs, Mapping) or isinstance(designs, xr.Dataset):  # a Dataset is a mapping, too
        raise TypeError(
            f"plots.{function}() needs a mapping from the name of each design to a {what}, got "
            f"{type(designs).__name__}: give {{'existing': ..., 'with dampers': ...}}"
        )
    for name, dataset in designs.items():
        if not isinstance(dataset, xr.Dataset):
            raise TypeError(
                f"plots.{function}(): design {name!r} must be a Dataset, got {type(dataset).__name__}: give a {what}"
            )
    if not designs:
        raise ValueError(
            f"plots.{function}() needs at least one {what}, but the mapping is empty: give {{'existing': ...}}"
        )
    return {str(name): dataset for name, dataset in designs.items()}


def _on_one_level(name: str, drawn: Demands, level: float | None) -> Demands:
    """Return the demands of the samples of one stripe; raise an error if `level` is not a stripe of the run."""
    stripes, units = drawn.levels, drawn.units
    listed = f"{', '.join(f'{each:g}' for each in stripes)} {units}"
    if level is None and stripes.size > 1:
        raise ValueError(f"run {name!r} has several stripes: give level=, one of {listed}")
    chosen = stripes[0] if level is None else real_number("level", level)
    here = np.isclose(drawn.level, chosen, rtol=1e-6)
    if not here.any():
        raise ValueError(f"run {name!r} has no stripe at {chosen!r} {units}: level= may be {listed}")
    parts: Iterable[str] = ("values", "collapsed", "level", "structure", "motion", "beyond")
    return Demands(**vars(drawn) | {each: getattr(drawn, each)[here] for each in parts})


def _stripe_of(drawn: Demands) -> str:
    """Return intensity measure and level of a stripe as text, such as "PGA = 0.4 g"."""
    return f"{literal(drawn.measure_name)} = {drawn.level[0]:g} {drawn.units}"
