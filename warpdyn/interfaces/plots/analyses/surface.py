"""Figure of a fragility surface of two intensity measures."""

from __future__ import annotations

from collections.abc import Iterable

import numpy as np
import xarray as xr
from matplotlib.axes import Axes

from warpdyn.foundations.core.checks import check_dataset
from warpdyn.interfaces.plots.style import SMALL, Drawn, check_kept, literal, panels, plain_numbers, title

SHARES = np.linspace(0.0, 1.0, 11)  # probabilities of the contours


def fragility_surface(dataset: xr.Dataset, *, ax: Iterable[Axes] | Axes | None = None) -> Drawn:
    """Draw fragility surfaces as contours of the probability over two intensities, one panel per damage state.

    If the contours are vertical, the second measure adds no information to the first.

    Args:
        dataset: Result of `fragility_surface`; select damage states with `.sel(damage_state=["complete"])`.
        ax: Axes to draw into, one for each damage state; None: a new figure.

    Returns:
        The new figure, or the axes that were given as `ax`.

    Raises:
        TypeError, ValueError: If `dataset` is not the result of `fragility_surface`, or is empty.

    Example:
        >>> both = wd.SpectralAcceleration(0.7), wd.SpectralAcceleration(1.4)
        >>> surface = wd.fragility_surface(run, {"slight": 0.005}, motions, both)
        >>> figure = wd.plots.fragility_surface(surface)
    """
    name, along = "fragility_surface", ("first_intensity", "second_intensity")
    advice = "give the result of fragility_surface(run, limits, motions, measures)"
    check_dataset(f"plots.{name}", dataset, "probability", "damage_state", *along, advice=advice)
    check_kept(name, "surfaces", dataset, "damage_state", *along)
    states = dataset["damage_state"].values
    result, axes = panels(name, ax, len(states), size=(4.2 * len(states) + 0.8, 4.0), sharey=True)
    for state, each in zip(states, axes, strict=True):
        values = dataset["probability"].sel(damage_state=state).transpose(*along).values.T
        filled = each.contourf(*(dataset[dim].values for dim in along), values, SHARES, cmap="viridis")
        lines = each.contour(*(dataset[dim].values for dim in along), values, [0.1, 0.5, 0.9], colors="white")
        each.clabel(lines, fmt=lambda share: f"{100 * share:.0f} %", fontsize=SMALL)
        each.set(xscale="log", yscale="log")
        plain_numbers(each.xaxis, each.yaxis)
        labels = [
            f"{literal(dataset.attrs.get(f'{dim[:-10]}_measure', dim))} [{dataset[dim].attrs.get('units', '1')}]"
            for dim in along
        ]
        each.set_xlabel(labels[0])
        if each is axes[0]:
            each.set_ylabel(labels[1])
        title(each, literal(state))
    axes[-1].figure.colorbar(filled, ax=axes, label="Probability of exceedance", format="{x:.0%}", shrink=0.9)
    return result
