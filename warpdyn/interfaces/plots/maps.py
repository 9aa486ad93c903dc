"""Maps of the damage or the losses of the buildings of a region."""

from __future__ import annotations

from typing import Any

import numpy as np
import pandas as pd
from matplotlib import ticker
from matplotlib.axes import Axes
from matplotlib.font_manager import FontProperties
from mpl_toolkits.axes_grid1.anchored_artists import AnchoredSizeBar

from warpdyn.answers.fragility.building_results import PROBABILITY, damage_states
from warpdyn.foundations.core.checks import check_kind, one_of, real_number
from warpdyn.interfaces.plots.style import SMALL, Drawn, literal, panels, title

MOST_BUILDINGS = 3000  # largest number of buildings that are drawn as points; more are averaged in cells
CELLS = 70  # number of cells along the longer side of the map
KILOMETRES_OF_A_DEGREE = 111.19  # length of a degree of latitude [km], on a sphere with the mean radius of the Earth
# The colours become darker as the value increases, so that the map is readable in grey and for colour-blind readers.
# The background differs from the palest colour.
COLOUR_MAP, GROUND = "YlOrRd", "0.87"
HIGHEST = 0.995  # quantile of the values with the darkest colour; without it, a few extreme cells make all others pale
_ADVICE = "draw the result of building_results(counted, stock, inventory)"


def damage_map(
    results: pd.DataFrame, state: str | None = None, *, cell: float | None = None, ax: Axes | None = None
) -> Drawn:
    """Draw a map of the mean loss ratio, or of the share of buildings in a given damage state or a heavier one.

    Up to 3,000 buildings are drawn as points, with the highest values on top. More buildings are averaged in square
    cells. The loss ratio of a cell is the expected loss of its buildings divided by their replacement cost. The share
    of a cell is weighted by `number`, the number of buildings that a row of the table represents. Buildings whose
    samples all failed have no value and are not drawn. The darkest colour is at the 99.5 % quantile of the points or
    cells; an arrow at the colour bar means that there are larger values.

    Args:
        results: Result of `building_results`, or some of its rows.
        state: Name of the damage state; None: loss ratios are drawn.
        cell: Side length of the square cells [km]. None: up to 3,000 buildings are points; more are averaged in cells
            of 1/70 of the longer side of the map.
        ax: Axes to draw into, such as axes that already show the trace of a fault; None: a new figure.

    Returns:
        The new figure, or the axes that were given as `ax`.

    Raises:
        ValueError: If the table is not a result of `building_results`; if it lacks the damage state, the losses or (for
            losses) the replacement costs; if no building has a value; or if `cell` is not above 0.
        TypeError: If `results` is not a DataFrame.

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
                "plots.damage_map: no building has a replacement_cost above 0, but the map weights loss ratios by it: "
                "add the column to the inventory, or draw a damage state: damage_map(results, state)"
            )
        raise ValueError(
            "plots.damage_map: no building has a value, because all samples failed: select "
            "other rows, or simulate with a smaller step="
        )
    value, weight, longitude, latitude = (each[known] for each in (value, weight, longitude, latitude))
    number = results["number"][known]
    if cell is not None:
        real_number("plots.damage_map: cell", cell, above=0)
    middle = 0.5 * (latitude.min() + latitude.max())
    shrink = np.cos(np.radians(middle))  # length of a degree of longitude divided by that of a degree of latitude
    shape = max(np.ptp(longitude), 1e-6) * shrink / max(np.ptp(latitude), 1e-6)
    result, (axes,) = panels("damage_map", ax, size=(float(np.clip(5.2 * shape, 2.5, 8.0)) + 2.2, 5.8))
    if cell is None and value.size <= MOST_BUILDINGS:
        order = np.argsort(value, kind="stable")
        size = 36.0 if value.size < 300 else 10.0
        shown = value
        drawn: Any = axes.scatter(
            longitude[order], latitude[order], size, value[order], cmap=COLOUR_MAP, linewidths=0.3, edgecolors="0.35"
        )
        what = _buildings(number)
    else:
        longer = max(np.ptp(longitude) * shrink, np.ptp(latitude)) * KILOMETRES_OF_A_DEGREE
        side = cell if cell is not None else max(longer / CELLS, 1e-3)
        east, north, means = _cells(longitude, latitude, value, weight, side, shrink)
        shown = means.compressed()
        drawn = axes.pcolormesh(east, north, means, cmap=COLOUR_MAP, linewidth=0, rasterized=True)
        what = f"{_buildings(number)}, cells of {side:.2g} km"
    top = float(np.quantile(shown, HIGHEST)) or float(shown.max())
    drawn.set_clim(0.0, top or 1.0)  # 1 if there is no damage
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
    _add_scale(axes, np.ptp(axes.get_xlim()) * shrink * KILOMETRES_OF_A_DEGREE, shrink)
    return result


def _add_scale(axes: Axes, width: float, shrink: float) -> None:
    """Draw a scale bar above the right end of the map: 1, 2 or 5 times a power of 10 [km], at most a quarter of it.

    Args:
        axes: Axes of the map.
        width: Width of the map [km].
        shrink: Length of a degree of longitude divided by that of a degree of latitude [1].
    """
    power = 10.0 ** np.floor(np.log10(width / 4))
    length = max(step * power for step in (1, 2, 5) if step * power <= width / 4)
    bar = AnchoredSizeBar(
        axes.transData,
        length / (shrink * KILOMETRES_OF_A_DEGREE),
        f"{length:g} km",
        "lower right",
        bbox_to_anchor=(1.0, 1.0),
        bbox_transform=axes.transAxes,
        frameon=False,
        label_top=True,
        pad=0.2,
        borderpad=0.0,
        sep=2,
        fontproperties=FontProperties(size=SMALL),
    )
    bar.set_clip_on(False)
    axes.add_artist(bar)


def _values_of(results: pd.DataFrame, state: str | None) -> tuple[np.ndarray, np.ndarray, str]:
    """Return the value of each building [1], its weight in the mean of a map cell, and the label of the colour bar."""
    missing = [name for name in ("longitude", "latitude", "number") if name not in results]
    if missing:
        raise ValueError(f"plots.damage_map: the table has no column {missing[0]!r}: {_ADVICE}")
    if state is None:
        if "expected_loss_ratio" not in results:
            raise ValueError(
                "plots.damage_map: the table has no losses: give state=, or give loss_ratios= to building_results"
            )
        if "replacement_cost" not in results:
            raise ValueError(f"plots.damage_map: the table has no column 'replacement_cost': {_ADVICE}")
        weight = results["replacement_cost"].to_numpy(dtype=np.float64)
        return results["expected_loss_ratio"].to_numpy(), weight, "Expected loss divided by replacement cost"
    states = damage_states(results)
    if not states:
        raise ValueError(f"plots.damage_map: the table has no probabilities of damage and standard errors: {_ADVICE}")
    one_of("damage state", state, states)
    place = states.index(state)
    value = results[[PROBABILITY + each for each in states[place:]]].sum(axis=1, skipna=False).to_numpy()
    words = f"Share of buildings in {literal(state)} damage" + (" or worse" if place < len(states) - 1 else "")
    return value, results["number"].to_numpy(dtype=np.float64), words


def _buildings(number: pd.Series) -> str:
    """Return the number of rows of the table and the number of buildings that they represent, as text."""
    total = float(number.sum())
    return f"{number.size:,} buildings" if total == number.size else f"{number.size:,} rows of {total:,.0f} buildings"


def _cells(
    longitude: np.ndarray, latitude: np.ndarray, value: np.ndarray, weight: np.ndarray, side: float, shrink: float
) -> tuple[np.ndarray, np.ndarray, np.ma.MaskedArray]:
    """Return east and north edges of square cells [degree], and the weighted mean in each cell, masked if it is empty.

    Args:
        longitude, latitude: Locations of the buildings [degree], shape [building].
        value, weight: Values that are averaged, and their weights, shape [building].
        side: Side length of a cell [km].
        shrink: Length of a degree of longitude divided by the length of a degree of latitude [1].
    """
    edges, cell = [], np.zeros(value.size, np.intp)
    for places, degree in ((latitude, KILOMETRES_OF_A_DEGREE), (longitude, KILOMETRES_OF_A_DEGREE * shrink)):
        step = side / degree
        count = max(1, int(np.ceil(np.ptp(places) / step)))
        middle = 0.5 * (places.min() + places.max())
        edges.append(middle + step * (np.arange(count + 1) - 0.5 * count))
        # A location that rounding puts outside the map is counted in the outermost cell.
        cell = cell * count + np.searchsorted(edges[-1][1:-1], places, side="right")
    north, east = edges
    shape = north.size - 1, east.size - 1
    total, of_all = (np.bincount(cell, each, shape[0] * shape[1]).reshape(shape) for each in (weight * value, weight))
    is_empty = of_all == 0
    return east, north, np.ma.masked_array(total / np.where(is_empty, 1.0, of_all), is_empty)
