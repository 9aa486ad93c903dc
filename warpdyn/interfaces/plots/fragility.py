"""Figures of fragility curves: of one building, and of several designs in comparison."""

from __future__ import annotations

from collections.abc import Iterable, Mapping

import numpy as np
import xarray as xr
from matplotlib import ticker
from matplotlib.axes import Axes

from warpdyn.foundations.core.checks import check_dataset
from warpdyn.foundations.core.output_variables import EXTRAPOLATED, MEDIAN_STATUS
from warpdyn.interfaces.plots.drifts import checked_designs
from warpdyn.interfaces.plots.samples import label_of_measure
from warpdyn.interfaces.plots.style import (
    COLOURS,
    SMALL,
    Colours,
    Drawn,
    Picture,
    check_kept,
    colours_of,
    grid,
    legend,
    literal,
    panels,
    set_scale,
    title,
)

_CURVES = (
    "draw the result of fragility(run, limits), or run.merge(fragility(run, limits), combine_attrs='no_conflicts')"
)
MOST_IN_A_ROW = 4  # largest number of entries in a row of the legend
LINE_STYLES = ("-", "--", "-.", ":")


def fragility_curves(
    dataset: xr.Dataset, *, colours: Colours = COLOURS, scale: str = "log", ax: Axes | None = None
) -> Drawn:
    """Draw fragility curves and, for stripes, the fractions of samples that exceed a state, with confidence intervals.

    Args:
        dataset: Result of `fragility`, `fragility_from_capacities` or `fragility_of_cloud`, or a run merged with this
            result.
        colours: Colour of each damage state: a list with the lightest state first, or a mapping by name.
        scale: Axis of the intensity measure: "log" or "linear".
        ax: Axes to draw into; None: a new figure.

    Returns:
        The new figure, or the axes that were given as `ax`.

    Raises:
        ValueError: If the dataset lacks the curves.
        TypeError: If `dataset` is not a Dataset.

    Example:
        >>> figure = wd.plots.fragility_curves(curves, colours={"slight": "tab:blue", "complete": "tab:red"})
        >>> figure.savefig("fragility.png")
    """
    _check_curves("fragility_curves", dataset)
    result, (axes,) = panels("fragility_curves", ax)
    states = dataset["damage_state"].values
    for colour, state in zip(colours_of(states, colours), states, strict=True):
        row = dataset.sel(damage_state=state)
        limit = _limit(row)
        _draw_curve(axes, row, colour, f"{literal(state)}{f' ({limit})' if limit else ''}{_without_fit(row)}")
    _finish(axes, _levels(dataset), scale)
    axes.set(xlabel=literal(label_of_measure(dataset)), ylabel="Probability of exceedance")
    legend(axes, loc="best")
    confidence = 100 * dataset.attrs["confidence"]
    title(
        axes,
        f"Fragility; bands and bars: {confidence:.0f} % intervals",
    )
    return result


def fragility_comparison(
    curves: Mapping[str, xr.Dataset],
    *,
    colours: Colours = COLOURS,
    scale: str = "log",
    ax: Iterable[Axes] | Axes | None = None,
) -> Drawn:
    """Draw the fragility curves of several designs for comparison, in one panel per damage state.

    Args:
        curves: For each design by name, the result of `fragility`, `fragility_from_capacities` or `fragility_of_cloud`,
            such as `{"existing": curves, "on isolators": others}`. All need the same intensity measure.
        colours: Colour of each design: a list, or a mapping by name.
        scale: Axis of the intensity measure: "log" or "linear".
        ax: Axes to draw into, one per damage state; None: a new figure.

    Returns:
        The new figure, or the axes that were given as `ax`.

    Raises:
        ValueError: If the dataset of a design has no curves, or if the designs have no common damage state or different
            intensity measures.
        TypeError: If the dataset of a design is not a Dataset.

    Example:
        >>> stiffer = wd.ShearBuilding(1e5, 6e7, 3.0, law=law, **damped)
        >>> others = wd.fragility(wd.simulate(wd.Scene(stiffer, stripes, scatter), structures=3), limits)
        >>> figure = wd.plots.fragility_comparison({"existing": curves, "stiffer": others})
    """
    function = "fragility_comparison"
    named = checked_designs(function, curves, "dataset of fragility curves")
    for dataset in named.values():
        _check_curves(function, dataset)
    first = next(iter(named.values()))
    of_each = {name: label_of_measure(dataset) for name, dataset in named.items()}
    if len(set(of_each.values())) > 1:
        listed = "; ".join(f"{name!r}: {measure}" for name, measure in of_each.items())
        raise ValueError(
            f"plots.{function}: the designs have different intensity measures ({listed}): run them with the same one"
        )
    common = [
        state
        for state in first["damage_state"].values
        if all(state in dataset["damage_state"].values for dataset in named.values())
    ]
    if not common:
        raise ValueError(
            f"plots.{function}: the designs have no common damage state: give the same limits to fragility()"
        )
    columns = 1 if len(common) == 1 else 2
    size = (7.0, 4.6) if columns == 1 else (3.6 * columns + 0.4, 2.6 * -(-len(common) // columns) + 0.4)
    result, all_axes = panels(function, ax, len(common), columns=columns, size=size, sharex=True, sharey=True)
    for axes, state in zip(all_axes, common, strict=True):
        limits: set[str] = set()
        chosen = zip(colours_of(named, colours), named.items(), strict=True)
        for number, (colour, (name, dataset)) in enumerate(chosen):
            row = dataset.sel(damage_state=state)
            limits.add(_limit(row))
            style = LINE_STYLES[number % len(LINE_STYLES)]
            _draw_curve(axes, row, colour, f"{literal(name)}{_without_fit(row)}", style=style)
        _finish(axes, np.concatenate([_levels(dataset) for dataset in named.values()]), scale)
        limit = limits.pop() if len(limits) == 1 else ""
        title(axes, f"{literal(state)}{f': {limit}' if limit else ''}")
    for axes in all_axes[-columns:]:
        axes.set_xlabel(literal(label_of_measure(first)))
    for axes in all_axes[::columns]:
        axes.set_ylabel("Probability of exceedance")
    if isinstance(result, Picture):
        handles = all_axes[0].get_legend_handles_labels()
        result.legend(*handles, loc="outside upper center", ncols=MOST_IN_A_ROW, frameon=False, fontsize=SMALL)
    else:
        legend(all_axes[0], loc="upper left")
    return result


def _check_curves(function: str, dataset: xr.Dataset) -> None:
    check_dataset(f"plots.{function}", dataset, "fragility_curve", "confidence", "damage_state", advice=_CURVES)
    of_stripes = (
        ("stripe",) if "exceedance_fraction" in dataset else ()
    )  # curves from capacities or from a cloud analysis have no stripes
    check_kept(function, "curves", dataset, "damage_state", *of_stripes, "intensity")


def _limit(row: xr.Dataset) -> str:
    """Return the limit of a damage state as text, such as "drift > 1 %"; "" if the state has no limit or several."""
    limit = row.get("damage_limit")
    if limit is None or limit.ndim:
        return ""
    if np.isinf(limit):
        return "collapse"
    demand, units = limit.attrs.get("demand", "demand"), limit.attrs.get("units", "1")
    if demand.endswith("drift_ratio"):
        name = "residual drift" if "residual" in demand else "drift"
        return f"{name} > {100 * float(limit):.2g} %"
    words = demand.removeprefix("peak_").replace("_", " ")
    in_units = "" if units == "1" else " " + units.replace("m s-2", "m/s²")
    return f"{words} > {float(limit):.3g}{in_units}"


def _without_fit(row: xr.Dataset) -> str:
    """Return a remark for the legend if a damage state has no fitted curve or an extrapolated median; else ""."""
    if not np.isfinite(row["fragility_median"]):
        return ", no fit"
    is_beyond = MEDIAN_STATUS in row and int(row[MEDIAN_STATUS]) == EXTRAPOLATED
    return ", extrapolated" if is_beyond else ""


def _draw_curve(axes: Axes, row: xr.Dataset, colour: str, label: str, style: str = "-") -> None:
    """Draw one fragility curve with its confidence band, and exceedance fractions of its stripes with error bars."""
    intensity = row["intensity"].values
    bounds = row["fragility_curve_lower"], row["fragility_curve_upper"]
    axes.fill_between(intensity, *bounds, color=colour, alpha=0.18, lw=0)
    axes.plot(intensity, row["fragility_curve"], style, color=colour, label=label)
    if "exceedance_fraction" not in row:
        return
    fraction = row["exceedance_fraction"].values
    error = [fraction - row["exceedance_fraction_lower"].values, row["exceedance_fraction_upper"].values - fraction]
    axes.errorbar(row["stripe"], fraction, yerr=np.maximum(error, 0), fmt="o", ms=3.5, color=colour, lw=0.8, capsize=2)


def _levels(dataset: xr.Dataset) -> np.ndarray:
    """Return the intensities of the stripes or, if a run has no stripes, those at which a curve rises, [stripe]."""
    if "exceedance_fraction" in dataset:
        return dataset["stripe"].values
    curve = dataset["fragility_curve"].transpose("damage_state", "intensity").values
    rises = ((curve > 0.001) & (curve < 0.999)).any(axis=0)
    intensity = dataset["intensity"].values
    return intensity[rises] if rises.any() else intensity[1:]


def _finish(axes: Axes, stripes: np.ndarray, scale: str) -> None:
    """Set scale and limits of the axes for intensity (horizontal) and probability (vertical)."""
    set_scale(axes, scale, stripes.min(), stripes.max())
    axes.set_ylim(-0.02, 1.02)
    axes.yaxis.set_major_formatter(ticker.PercentFormatter(1.0))
    grid(axes)
