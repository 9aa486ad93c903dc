"""Maps of the damage and the losses of a region's buildings."""

from __future__ import annotations

from typing import Any

import numpy as np
import pandas as pd
from matplotlib import ticker
from matplotlib.axes import Axes

from warpdyn.answers.fragility.building_results import PROBABILITY, damage_states
from warpdyn.foundations.core.checks import check_kind, one_of, real_number
from warpdyn.interfaces.plots.style import SMALL, Drawn, literal, panels, title

MOST_BUILDINGS = 3000  # that are drawn as points; more are put together in cells
CELLS = 70  # along the longer side of the map
KILOMETRES_OF_A_DEGREE = 111.19  # of latitude, on a sphere of the Earth's mean radius
# It darkens all the way, so that colour-blind readers and grey prints see the same; the ground differs from its palest.
COLOUR_MAP, GROUND = "YlOrRd", "0.87"
HIGHEST = 0.995  # quantile at which the colours end: a lone building in a cell of its own would leave the others pale
_ADVICE = "draw what building_results(counted, stock, inventory) returned"


def damage_map(
    results: pd.DataFrame, state: str | None = None, *, cell: float | None = None, ax: Axes | None = None
) -> Drawn:
    """Draw a map of the mean loss ratio of buildings, or of the share of them in a damage state or a heavier one.

    Up to 3,000 buildings are points, those with the highest values on top; more are put together in square cells. A
    cell's loss ratio is the expected loss of its buildings over their replacement cost; its share is of the buildings
    that its rows stand for (`number`). Buildings without a value, as all their samples failed, are left out. The
    colours end at the value that 0.5 % of the points or cells are above, and the colour bar's arrow says so.

    Args:
        results: What `building_results` returned, or some of its rows.
        state: The damage state; None for loss ratios.
        cell: Side of the cells [km]; None for points where there are few buildings, and else for a 70th of the map's
            longer side.
        ax: Axes to draw into, such as those of a map with a fault's trace; None for a figure of its own.

    Returns:
        The figure, or the axes given.

    Raises:
        ValueError: If the table is none of `building_results`, has no such state or no losses, holds no building with a
            value (or a replacement cost, for losses), or the side is not above 0.
        TypeError: If `results` is no DataFrame.

    Example:
        >>> figure = wd.plots.damage_map(results)  # mean loss ratios
        >>> figure = wd.plots.damage_map(results, "slight", cell=5.0)  # km
    """
    check_kind("plots.damage_map", "a DataFrame", results, pd.DataFrame, _ADVICE, argument="results")
    value, weight, words = _values_of(results, state)
    longitude, latitude = (results[name].to_numpy(dtype=np.float64) for name in ("longitude", "latitude"))
    known = np.isfinite(value) & np.isfinite(longitude) & np.isfinite(latitude) & (weight > 0)
    if not known.any():
        if state is None and not (weight > 0).any():
            raise ValueError(
                "plots.damage_map: no building has a replacement_cost above 0, which a cell's loss ratio is weighed by"
            )
        raise ValueError("plots.damage_map: no building has a value: select others")
    value, weight, longitude, latitude = (each[known] for each in (value, weight, longitude, latitude))
    number = results["number"][known]
    if cell is not None:
        real_number("plots.damage_map: cell", cell, above=0)
    middle = 0.5 * (latitude.min() + latitude.max())
    shrink = np.cos(np.radians(middle))  # a degree of longitude is so much shorter than one of latitude
    shape = max(np.ptp(longitude), 1e-6) * shrink / max(np.ptp(latitude), 1e-6)
    result, (axes,) = panels("damage_map", ax, size=(float(np.clip(5.2 * shape, 2.5, 8.0)) + 2.2, 5.8))
    if cell is None and value.size <= MOST_BUILDINGS:
        order = np.argsort(value, kind="stable")
        size = 36.0 if value.size < 300 else 10.0
        shown = value
        drawn: Any = axes.scatter(
            longitude[order], latitude[order], size, value[order], cmap=COLOUR_MAP, linewidths=0.3, edgecolors="0.35"
        )
        what = f"{_buildings(number)}, points"
    else:
        longer = max(np.ptp(longitude) * shrink, np.ptp(latitude)) * KILOMETRES_OF_A_DEGREE
        side = cell if cell is not None else max(longer / CELLS, 1e-3)
        east, north, means = _cells(longitude, latitude, value, weight, side, shrink)
        shown = means.compressed()
        drawn = axes.pcolormesh(east, north, means, cmap=COLOUR_MAP, linewidth=0, rasterized=True)
        what = f"{_buildings(number)}, cells of {side:.2g} km"
    top = float(np.quantile(shown, HIGHEST)) or float(shown.max())
    drawn.set_clim(0.0, top or 1.0)  # 1 where nothing is damaged
    axes.set_facecolor(GROUND)
    axes.set_aspect(1 / shrink)
    axes.set(xlabel="Longitude [degree]", ylabel="Latitude [degree]")
    for axis, most in ((axes.xaxis, 4 if shape > 0.7 else 3), (axes.yaxis, 6)):
        axis.set_major_locator(ticker.MaxNLocator(most, steps=[1, 2, 5, 10]))
        axis.set_major_formatter(ticker.ScalarFormatter(useOffset=False))
    beyond = "max" if shown.max() > top > 0 else "neither"
    bar = axes.figure.colorbar(drawn, ax=axes, label=words, shrink=0.85, extend=beyond)
    bar.ax.yaxis.set_major_formatter(ticker.FuncFormatter(lambda share, _: f"{100 * share:.3g} %"))
    bar.ax.tick_params(labelsize=SMALL)
    title(axes, what)
    return result


def _values_of(results: pd.DataFrame, state: str | None) -> tuple[np.ndarray, np.ndarray, str]:
    """Return what is drawn of each building, its weight in a mean, and what the colours are called."""
    missing = [name for name in ("longitude", "latitude", "number") if name not in results]
    if missing:
        raise ValueError(f"plots.damage_map: the table has no column {missing[0]!r}: {_ADVICE}")
    if state is None:
        if "expected_loss_ratio" not in results:
            raise ValueError(
                "plots.damage_map: the table has no losses; name a damage state, or give building_results loss ratios"
            )
        if "replacement_cost" not in results:
            raise ValueError(f"plots.damage_map: the table has no column 'replacement_cost': {_ADVICE}")
        weight = results["replacement_cost"].to_numpy(dtype=np.float64)
        return results["expected_loss_ratio"].to_numpy(), weight, "Expected loss over replacement cost"
    states = damage_states(results)
    if not states:
        raise ValueError(f"plots.damage_map: the table has no probabilities of damage and standard errors: {_ADVICE}")
    one_of("damage state", state, states)
    place = states.index(state)
    value = results[[PROBABILITY + each for each in states[place:]]].sum(axis=1, skipna=False).to_numpy()
    words = f"Share of buildings in {literal(state)} damage" + (" or worse" if place < len(states) - 1 else "")
    return value, results["number"].to_numpy(dtype=np.float64), words


def _buildings(number: pd.Series) -> str:
    """Return how many buildings a map is of, and how many they stand for."""
    total = float(number.sum())
    return f"{number.size:,} buildings" if total == number.size else f"{number.size:,} rows of {total:,.0f} buildings"


def _cells(
    longitude: np.ndarray, latitude: np.ndarray, value: np.ndarray, weight: np.ndarray, side: float, shrink: float
) -> tuple[np.ndarray, np.ndarray, np.ma.MaskedArray]:
    """Return the edges of square cells and the weighted mean in each of them, masked where there is no building.

    Args:
        longitude, latitude: Places [degree].
        value, weight: What is averaged, and its weights.
        side: Side of a cell [km].
        shrink: Length of a degree of longitude over that of one of latitude.
    """
    edges, cell = [], np.zeros(value.size, np.intp)
    for places, degree in ((latitude, KILOMETRES_OF_A_DEGREE), (longitude, KILOMETRES_OF_A_DEGREE * shrink)):
        step = side / degree
        count = max(1, int(np.ceil(np.ptp(places) / step)))
        middle = 0.5 * (places.min() + places.max())
        edges.append(middle + step * (np.arange(count + 1) - 0.5 * count))
        # What rounding puts beyond the outer edges is in the outer cells.
        cell = cell * count + np.searchsorted(edges[-1][1:-1], places, side="right")
    north, east = edges
    shape = north.size - 1, east.size - 1
    total, of_all = (np.bincount(cell, each, shape[0] * shape[1]).reshape(shape) for each in (weight * value, weight))
    is_empty = of_all == 0
    return east, north, np.ma.masked_array(total / np.where(is_empty, 1.0, of_all), is_empty)
