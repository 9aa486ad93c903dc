"""Figure of state-dependent fragility: how earlier damage moves the curve of each damage state."""

from __future__ import annotations

from collections.abc import Iterable

import numpy as np
import xarray as xr
from matplotlib import ticker
from matplotlib.axes import Axes

from warpdyn.answers.fragility.lognormal_fit import probability
from warpdyn.foundations.core.checks import check_dataset
from warpdyn.interfaces.plots.style import (
    COLOURS,
    Colours,
    Drawn,
    check_kept,
    colours_of,
    grid,
    legend,
    literal,
    panels,
    set_scale,
    title,
)

_POINTS = 200  # number of points of each drawn curve


def state_dependent_fragility(
    dataset: xr.Dataset, *, colours: Colours = COLOURS, ax: Iterable[Axes] | Axes | None = None
) -> Drawn:
    """Draw the fragility curves of each damage state, one curve for each state that earlier events have left.

    There is one panel per damage state. Points are fractions of samples; the legend contains the medians.

    Args:
        dataset: Result of `state_dependent_fragility`; select damage states with `.sel(damage_state=["complete"])`.
        colours: Colour of each earlier state: a list with "none" first, or a mapping by name.
        ax: Axes to draw into, one for each damage state; None: a new figure.

    Returns:
        The new figure, or the axes that were given as `ax`.

    Raises:
        TypeError, ValueError: If `dataset` is not the result of `state_dependent_fragility`, or is empty.

    Example:
        >>> mainshock = wd.Stripes(motions[:4], [0.15, 0.8], wd.PeakGroundAcceleration())  # g
        >>> sequence = wd.EventSequence({"mainshock": mainshock, "aftershock": stripes})
        >>> shocks = wd.simulate(wd.Scene(building, sequence, scatter, recorders=("drift",)), structures=8)
        >>> damaged = wd.state_dependent_fragility(shocks, {"slight": 0.004, "complete": 0.015})
        >>> figure = wd.plots.state_dependent_fragility(damaged)
    """
    name = "state_dependent_fragility"
    needed = ("from_state", "damage_state", "stripe", "fragility_median", "exceedance_fraction")
    check_dataset(f"plots.{name}", dataset, *needed, advice="give the result of state_dependent_fragility(run, limits)")
    check_kept(name, "curves", dataset, "from_state", "damage_state")
    states, origins = dataset["damage_state"].values, dataset["from_state"].values
    columns = min(2, len(states))
    rows = -(-len(states) // columns)
    size = (4.2 * columns + 0.6, 3.0 * rows + 0.4)
    result, axes = panels(name, ax, len(states), columns=columns, size=size, sharex=True, sharey=True)
    levels = dataset["stripe"].values
    along = np.geomspace(levels.min(), levels.max(), _POINTS)
    for state, each in zip(states, axes, strict=True):
        for origin, colour in zip(origins, colours_of(origins, colours), strict=True):
            row = dataset.sel(from_state=origin, damage_state=state)
            fraction, median = row["exceedance_fraction"].values, float(row["fragility_median"])
            if np.isnan(fraction).all():
                continue
            each.plot(levels, fraction, "o", color=colour, ms=3)
            words = f"{literal(origin)}: no fit"
            if np.isfinite(median):
                words = f"{literal(origin)}: {median:.3g}"
                each.plot(along, probability(along, median, float(row["fragility_dispersion"])), color=colour)
            each.plot([], [], "-o", color=colour, ms=3, label=words)
        set_scale(each, "log", levels.min(), levels.max())
        each.yaxis.set_major_formatter(ticker.PercentFormatter(1.0))
        each.set_ylim(-0.02, 1.02)
        grid(each)
        if each.get_legend_handles_labels()[0]:
            legend(each, title="state before: median")
        title(each, f"reaches {literal(state)}")
    measure = str(dataset.attrs.get("intensity_measure", "")) or "intensity"
    for each in axes[-columns:]:
        each.set_xlabel(f"{literal(measure)} [{dataset['stripe'].attrs.get('units', 'g')}]")
    for each in axes[::columns]:
        each.set_ylabel("Probability of exceedance")
    return result
