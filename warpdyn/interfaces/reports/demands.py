"""Section of a report on demands: tables of fractiles for all samples and for each intensity level, and figures."""

from __future__ import annotations

import numpy as np
import xarray as xr

from warpdyn.answers.fragility.stripe_counts import decoded_status
from warpdyn.campaigns.running.selections import of_building, without_added_places
from warpdyn.foundations.core.output_variables import COLLAPSED, STRIPED
from warpdyn.interfaces.plots.drifts import drift_against_intensity, drift_over_height, residual_drifts
from warpdyn.interfaces.plots.histories import histories
from warpdyn.interfaces.plots.samples import fractiles, label_of_measure
from warpdyn.interfaces.plots.style import COLOURS, Drawn, grid, legend, new_figure, plain_numbers
from warpdyn.interfaces.reports.markup import Part, figure, heading, paragraph, table

SHARES = (0.16, 0.5, 0.84, 0.95)  # fractiles in the tables
# Demands in the order of the table. The recorders of a run determine which of them it contains.
DEMANDS = (
    "peak_storey_drift_ratio",
    "peak_storey_drift",
    "residual_drift_ratio",
    "peak_floor_acceleration",
    "peak_base_shear",
    "peak_spring_deformation",
    "peak_spring_force",
    "peak_output",
    "residual_deformation",
    "peak_displacement",
    "peak_acceleration",
    "input_energy",
    "viscous_energy",
    "hysteretic_energy",
)
BY_LEVEL = (
    *("peak_storey_drift_ratio", "peak_floor_acceleration", "residual_drift_ratio", "peak_spring_deformation"),
    *("peak_output", "peak_displacement"),
)
MOST_LEVELS = 40  # largest number of intensity levels (rows) in a table
MOST_LINES = len(COLOURS)  # largest number of lines in a figure


def of_one_unit(run: xr.Dataset, name: str) -> list[tuple[str, xr.Dataset]]:
    """Return the parts of a run in which the places of a demand have the same unit, with the unit of the demand.

    Degrees of freedom and springs of a lumped structure are divided into translations and rotations. Outputs are
    divided by their units; if these are unknown, each output is a part, with its name instead of a unit.

    Args:
        run: Result of `simulate`, for one event, without equipment, absorbers, soil and contacts.
        name: Name of the demand.
    """
    units = str(run[name].attrs.get("units", ""))
    for dim in ("dof", "spring", "output"):
        unit = f"{dim}_unit"
        if dim not in run[name].dims:
            continue
        if unit not in run.coords:
            if dim != "output":
                return [(units, run)]
            return [(f"output {place!s}", run.isel(output=[i])) for i, place in enumerate(run["output"].values)]
        kinds = run[unit].values
        found = [(str(kind), run.isel({dim: np.flatnonzero(kinds == kind)})) for kind in dict.fromkeys(kinds.tolist())]
        if dim == "output":
            return found
        of_translation, _, of_rotation = units.removesuffix(" for rotations)").partition(" (")
        return [(of_rotation or of_translation if kind == "rad" else of_translation, part) for kind, part in found]
    return [(units, run)]


def largest_of(run: xr.Dataset, name: str, status: np.ndarray) -> np.ndarray:
    """Return the largest magnitude of a demand over the storeys, floors or degrees of freedom of each sample.

    Args:
        run: Result of `simulate`, for one event.
        name: Name of the demand.
        status: Status of each sample as a number (index in STATUS_MEANINGS), shape [sample].

    Returns:
        Largest magnitudes in the unit of the demand, infinite for collapsed samples, without failed samples, shape
        [sample].
    """
    kept = status <= COLLAPSED
    values = np.abs(of_building(run, name).transpose("sample", ...).values[kept].astype(np.float64))
    if values.ndim > 1:
        values = np.fmax.reduce(values, axis=1)  # ignores NaN of storeys that a building of a portfolio lacks
    return np.where(status[kept] == COLLAPSED, np.inf, values)


def demands(run: xr.Dataset) -> list[Part]:
    """Return the section of a report on the demands of one event; an empty list if the run has no demands.

    Args:
        run: Result of `simulate` for one event, with the dimension `sample`.
    """
    status = decoded_status(run["status"])
    names = [name for name in DEMANDS if name in run and "sample" in run[name].dims]
    if not names or not np.any(status <= COLLAPSED):
        return []
    own = without_added_places(run)
    values = {(name, units): largest_of(part, name, status) for name in names for units, part in of_one_unit(own, name)}
    rows = []
    for (name, units), found in values.items():
        standing = found[np.isfinite(found)]
        largest = standing.max() if standing.size else np.nan
        words = f"{run[name].attrs.get('long_name', name)} [{units}]"
        rows.append((words, *map(float, fractiles(found, SHARES)), float(largest)))
    heads = ("demand", *(f"{share:.0%}" for share in SHARES), "largest without collapse")
    parts = [
        heading("Demands"),
        paragraph(
            "A demand is the largest magnitude over the storeys, floors, degrees of freedom, springs or outputs of a "
            "sample; places of different units have separate rows. The columns contain fractiles: 84% of the samples "
            "do not exceed the value in the column 84%. Storeys of isolators or of a tuned mass damper, equipment, "
            "absorbers, soil and contacts do not count. A collapsed sample exceeds every value, so a fractile is empty "
            "if too many samples collapsed. Failed samples are excluded."
        ),
        table("Demands of all samples", heads, rows),
    ]
    is_striped = "im_level" in run and run["im_level"].attrs.get("design") == STRIPED
    if is_striped:
        for name in BY_LEVEL:
            for units in [units for known, units in values if known == name]:
                parts.append(_by_level(run, name, units, values[name, units], status))
    return [*parts, *_figures(run, {name: found for (name, _), found in values.items()}, status, is_striped)]


def _by_level(run: xr.Dataset, name: str, units: str, values: np.ndarray, status: np.ndarray) -> Part:
    """Return a table of the fractiles of a demand, with one row per intensity level (at most MOST_LEVELS rows)."""
    levels, kept = run["im_level"].values, status <= COLLAPSED
    rows = []
    for level in np.unique(levels)[:MOST_LEVELS]:
        own = values[levels[kept] == level]
        failed = int(np.count_nonzero(~kept & (levels == level)))
        found = fractiles(own, SHARES) if own.size else np.full(len(SHARES), np.nan)
        rows.append((float(level), own.size, int(np.isinf(own).sum()), failed, *map(float, found)))
    heads = (label_of_measure(run), "samples", "collapsed", "failed", *(f"{share:.0%}" for share in SHARES))
    return table(f"{run[name].attrs.get('long_name', name)} [{units}], by level", heads, rows)


def _figures(run: xr.Dataset, values: dict[str, np.ndarray], status: np.ndarray, is_striped: bool) -> list[Part]:
    """Return the figures of the demands; a figure is left out if the run lacks its variables."""
    parts = []
    drift = "peak_storey_drift_ratio"
    if drift in values:
        if "im_level" in run:
            words = "Largest peak drift ratio of every sample against the intensity measure. Crosses are collapses."
            parts.append(figure(drift_against_intensity(run), words))
        words = "Share of the samples whose largest peak drift ratio is below a value; collapsed samples exceed all."
        parts.append(figure(_distribution(run, values[drift], status, is_striped), words))
        has_all_storeys = "storey" in run[drift].dims and not np.isnan(run[drift].values[status <= COLLAPSED]).any()
        if is_striped and has_all_storeys and run.sizes["storey"] > 1:
            words = "Median peak drift ratio of each storey and the range of the 16 to 84 % fractiles, for some levels."
            parts.append(figure(drift_over_height(run), words))
    if "residual_drift_ratio" in values and "im_level" in run and np.isfinite(values["residual_drift_ratio"]).any():
        words = "Largest residual drift ratio of every sample against the intensity measure."
        parts.append(figure(residual_drifts(run), words))
    if "history" in run.dims and "displacement" in run:
        parts.append(figure(histories(run), "The first of the recorded histories."))
    return parts


def _distribution(run: xr.Dataset, values: np.ndarray, status: np.ndarray, is_striped: bool) -> Drawn:
    """Draw the distribution of the largest peak drift ratio: one curve for all samples, or one per intensity level."""
    drawn = new_figure(6.4, 4.0)
    axes = drawn.subplots()
    groups = {"all samples": values}
    if is_striped:
        levels = run["im_level"].values[status <= COLLAPSED]
        unit = run["im_level"].attrs.get("units", "g")
        distinct = np.unique(levels)
        shown = distinct[np.unique(np.linspace(0, distinct.size - 1, MOST_LINES).round().astype(int))]
        groups = {f"{level:.3g} {unit}": values[levels == level] for level in shown}
    for number, (label, found) in enumerate(groups.items()):
        order = np.sort(found)
        share = np.arange(1, order.size + 1) / order.size
        standing = np.isfinite(order) & (order > 0)
        colour = COLOURS[number % len(COLOURS)]
        axes.step(100 * order[standing], share[standing], where="post", lw=1.3, color=colour, label=label)
    axes.set(
        xscale="log", xlabel="Largest peak storey drift ratio [%]", ylabel="Share of the samples below", ylim=(0, 1)
    )
    plain_numbers(axes.xaxis)
    grid(axes)
    legend(axes)
    return drawn
