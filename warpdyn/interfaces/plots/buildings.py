"""Figures of buildings and their pushover curves."""

from __future__ import annotations

from collections.abc import Iterable

import numpy as np
import xarray as xr
from matplotlib import ticker
from matplotlib.axes import Axes
from matplotlib.patches import Rectangle

from warpdyn.foundations.core.checks import check_dataset, check_kind
from warpdyn.interfaces.plots.style import COLOURS, SMALL, Drawn, grid, panels, title
from warpdyn.model.structures.shear_building import ShearBuilding

ADDED_HEIGHT = 0.4  # drawn height of isolators and of a tuned mass damper, divided by the smallest storey height
MOST_IN_A_LINE = 75  # largest number of characters in a line of a title
MOST_LABELS = 10  # largest number of storeys that all have labels


def building(building: ShearBuilding, *, ax: Axes | None = None) -> Drawn:
    """Draw a building to scale, with stiffness and yield force of each storey, mass of each floor, and the first mode.

    The drawn heights of isolators and of a tuned mass damper are not to scale.

    Args:
        building: The building whose storeys and floors are drawn.
        ax: Axes to draw into; None: a new figure.

    Returns:
        The new figure, or the axes that were given as `ax`.

    Raises:
        TypeError: If `building` is not a ShearBuilding.

    Example:
        >>> figure = wd.plots.building(building)
        >>> figure.savefig("building.png")
    """
    check_kind("plots.building", "a ShearBuilding", building, ShearBuilding, argument="building")
    values, storeys = building.parameters, building.storeys
    own = building.own_storeys
    # The parameter `height` of isolators and of a tuned mass damper only defines their drift ratio. It is not a length.
    height = np.where(own, values["height"], ADDED_HEIGHT * values["height"][own].min())
    level = np.append(0.0, np.cumsum(height))
    width = 0.6 * max(level[-1], 3 * level[1])  # wide enough for the texts in the storeys
    result, (axes,) = panels("building", ax, size=(6.4, 5.6))
    # A stiffer storey has thicker columns, a heavier floor a thicker slab.
    thickness = 0.02 + 0.06 * values["stiffness"] / values["stiffness"].max()
    slab = min(0.012 * level[-1], 0.1 * height.min())
    depth = slab * (0.5 + values["mass"] / values["mass"].max())
    labelled = _storeys_labelled(storeys)
    for storey in range(storeys):
        for left in (0.0, width * (1 - thickness[storey])):
            corner, size = (left, level[storey]), (width * thickness[storey], height[storey])
            axes.add_patch(Rectangle(corner, *size, facecolor=COLOURS[5], edgecolor="none"))
        corner = (0.0, level[storey + 1] - depth[storey] / 2)
        axes.add_patch(Rectangle(corner, width, depth[storey], facecolor="0.25", edgecolor="none", zorder=3))
        if storey in labelled:
            spring = "" if own[storey] else f"{_added(storey, storeys)}: "
            spring += f"k = {_engineering(values['stiffness'][storey], 'N/m')}"
            if "yield_force" in values and not np.isnan(values["yield_force"][storey]):
                between = "\n" if storeys <= MOST_LABELS and own[storey] else ", "
                spring += f"{between}Fy = {_engineering(values['yield_force'][storey], 'N')}"
            middle = (level[storey] + level[storey + 1]) / 2
            paper = {
                "facecolor": "white",
                "edgecolor": "none",
                "pad": 1.5,
            }  # hides the slabs of a tall building behind the text
            axes.text(width / 2, middle, spring, ha="center", va="center", fontsize=SMALL, bbox=paper, zorder=4)
            mass = f"m = {_engineering(1000 * values['mass'][storey], 'g')}"
            axes.text(-0.04 * width, level[storey + 1], mass, ha="right", va="center", fontsize=SMALL)
    axes.plot([-0.25 * width, 1.15 * width], [0, 0], color="black", lw=2)
    first = building.modal().isel(mode=0)
    shape = np.append(0.0, first["shape"].values)
    line = 1.3 * width + 0.5 * width * shape
    axes.plot(np.full(storeys + 1, 1.3 * width), level, color="0.6", lw=0.8)
    axes.plot(line, level, "o-", color=COLOURS[3], ms=4, lw=1.4)
    share = 100 * float(first["effective_mass_ratio"])
    words = f"first mode\n{float(first['period']):.3g} s, {share:.0f} % of the mass"
    axes.text(1.55 * width, level[-1] * 1.03, words, ha="center", va="bottom", fontsize=SMALL, color=COLOURS[3])
    axes.set(aspect="equal", ylabel="Height above the ground [m]", xlim=(-0.45 * width, 2.0 * width))
    axes.set_ylim(-0.02 * level[-1], 1.16 * level[-1])
    axes.set_xticks([])
    axes.spines[["top", "right", "bottom"]].set_visible(False)
    storey_word = "storey" if own.sum() == 1 else "storeys"
    text = f"{own.sum()} {storey_word}, law {building.law!r}, damping {building.damping!r}"
    title(axes, text if len(text) <= MOST_IN_A_LINE else text.replace(", damping", ",\ndamping"))
    return result


def _added(storey: int, storeys: int) -> str:
    """Return what an additional storey (counted from 0) consists of: isolators or a tuned mass damper."""
    return "isolators" if storey == 0 else "tuned mass damper" if storey == storeys - 1 else "isolators at mid-height"


def _storeys_labelled(storeys: int) -> list[int]:
    """Return the storeys that get labels, counted from 0: all of them, or at most MOST_LABELS at equal distances."""
    return list(range(0, storeys, -(-storeys // MOST_LABELS)))


def _engineering(value: float, unit: str) -> str:
    """Return a number with its unit and an SI prefix as text, such as 866 MN/m for 8.66e8 N/m."""
    if unit == "g":  # masses in tonnes instead of megagrams
        return f"{value / 1e6:.4g} t"
    return ticker.EngFormatter(unit=unit, places=None).format_data(float(f"{value:.3g}"))


def pushover_curve(dataset: xr.Dataset, *, ax: Iterable[Axes] | None = None) -> Drawn:
    """Draw the pushover curve (base shear against roof displacement), and profiles of the storey drift over the height.

    For a lumped structure the curve has the displacement that was prescribed, and the profiles are the deformations of
    the springs that are translations.

    Args:
        dataset: Result of `pushover`.
        ax: Two axes to draw into, for the curve and the profiles; None: a new figure.

    Returns:
        The new figure, or the axes that were given as `ax`.

    Raises:
        ValueError: If the dataset lacks roof displacements, base shears or deformations, or has no steps.
        TypeError: If `dataset` is not a Dataset.

    Example:
        >>> figure = wd.plots.pushover_curve(wd.pushover(building, np.linspace(0.0, 0.1, 101)))
    """
    function, advice = "plots.pushover_curve", "draw the result of pushover(building, ...)"
    is_lumped = isinstance(dataset, xr.Dataset) and "spring_deformation" in dataset
    name, dim = ("spring_deformation", "spring") if is_lumped else ("storey_drift", "storey")
    check_dataset(function, dataset, "roof_displacement", "base_shear", name, advice=advice)
    if dataset[name].dims != ("step", dim):
        raise ValueError(f"{function}: select steps and {dim}s by isel(step=[...], {dim}=[...])")
    if not dataset["base_shear"].size:
        raise ValueError(f"{function}: the dataset has no steps: check the condition by which you selected steps")
    is_rotation = dataset["roof_displacement"].attrs.get("units") == "rad"
    factor, unit = (1.0, "rad") if is_rotation else (1000.0, "mm")
    roof, shear = factor * dataset["roof_displacement"].values, dataset["base_shear"].values / 1e6
    drifts = dataset[name]
    if "spring_unit" in drifts.coords:
        drifts = drifts[:, drifts["spring_unit"].values == "m"]
    drift, places = 1000 * drifts.values, np.arange(1, drifts[dim].size + 1) if is_lumped else drifts[dim].values
    result, (curve, profile) = panels("pushover_curve", ax, 2, size=(8.4, 4.2), width_ratios=(3, 2))
    curve.plot(np.append(0.0, roof), np.append(0.0, shear), color=COLOURS[0], lw=1.4)
    curve.axhline(0, color="0.6", lw=0.6)
    curve.axvline(0, color="0.6", lw=0.6)
    moved = f"Displacement of {dataset.attrs['control']}" if is_lumped else "Roof displacement"
    curve.set(xlabel=f"{moved} [{unit}]", ylabel="Base shear [MN]")
    # Profiles at 25, 50, 75 and 100 % of the largest displacement.
    farthest = int(np.abs(roof).argmax())
    for colour, share in zip(COLOURS[1:], (0.25, 0.5, 0.75, 1.0), strict=False):
        step = int(np.argmax(np.abs(roof[: farthest + 1]) >= share * abs(roof[farthest]) * (1 - 1e-9)))
        curve.plot(roof[step], shear[step], "o", color=colour, ms=6)
        if places.size:
            outline = np.append(drift[step, 0], drift[step]), np.append(0, places)
            profile.step(*outline, where="post", color=colour, label=f"{float(f'{roof[step]:.3g}'):g} {unit}")
    what = "Deformation" if is_lumped else "Storey drift"
    profile.set(xlabel=f"{what} [mm]", ylabel=dim.capitalize(), ylim=(0, places[-1] if places.size else 1))
    labels = _storeys_labelled(places.size)
    profile.set_yticks([places[at] - 0.5 for at in labels], [str(drifts[dim].values[at]) for at in labels])
    profile.legend(
        title=f"{dataset.attrs['control'] if is_lumped else 'roof'} at", fontsize=SMALL, title_fontsize=SMALL
    )
    grid(curve, profile)
    return result
