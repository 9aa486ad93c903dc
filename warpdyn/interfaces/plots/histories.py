"""Figures of the response history of one sample: displacements, drifts and base shear, and hysteresis loops."""

from __future__ import annotations

from collections.abc import Iterable

import numpy as np
import xarray as xr
from matplotlib import colormaps
from matplotlib.axes import Axes

from warpdyn.answers.fragility.stripe_counts import decoded_status
from warpdyn.foundations.core.checks import check_dataset, whole_number
from warpdyn.foundations.core.output_variables import COLLAPSED, measure_name
from warpdyn.interfaces.plots.samples import check_run
from warpdyn.interfaces.plots.style import (
    COLLAPSE_COLOUR,
    COLOURS,
    SMALL,
    TITLE,
    Drawn,
    Picture,
    grid,
    legend,
    literal,
    panels,
    title,
)

PANELS_IN_A_ROW = 5  # largest number of panels next to each other
MOST_LINES_NAMED = 10  # largest number of storeys that are all named in the legend
BEYOND = 1.1  # end of the time axis, divided by the time of collapse
_HISTORIES = "draw a run of simulate(..., histories=wd.Histories([0]))"


def histories(dataset: xr.Dataset, history: int = 0, *, ax: Iterable[Axes] | None = None) -> Drawn:
    """Draw displacements [mm], storey drifts [mm] and base shear [MN] of one sample over time, up to a collapse.

    Args:
        dataset: Result of `simulate` with histories. For a LinearSystem only the displacements are drawn.
        history: Index of the history that is drawn, counted from 0.
        ax: Axes to draw into: three for a ShearBuilding, one for a LinearSystem. None: a new figure.

    Returns:
        The new figure, or the axes that were given as `ax`.

    Raises:
        ValueError: If the dataset has no such history.
        TypeError: If `dataset` is not a Dataset.

    Example:
        >>> run = wd.simulate(scene, structures=3, histories=wd.Histories([0]))
        >>> figure = wd.plots.histories(run)
    """
    chosen = chosen_history("histories", dataset, history, "displacement")
    time, displacement = chosen["time"].values, chosen["displacement"].values
    rows = [("Displacement [mm]", 1000 * displacement)]
    is_chain = "storey_force" in chosen
    if is_chain:
        rows += [
            ("Storey drift [mm]", 1000 * np.diff(displacement, axis=1, prepend=0.0)),
            ("Base shear [MN]", chosen["storey_force"].values[:, :1] / 1e6),
        ]
    size = (7.4, 1.6 + 1.5 * len(rows))
    result, all_axes = panels("histories", ax, len(rows), columns=1, size=size, sharex=True)
    count = displacement.shape[1]
    shades = colormaps["viridis"](np.linspace(0, 0.85, count)) if count > 1 else [COLOURS[0]]
    every = -(-count // MOST_LINES_NAMED)
    for axes, (label, values) in zip(all_axes, rows, strict=True):
        words = ("storey" if "drift" in label else "floor") if is_chain else "degree of freedom"
        for i, line in enumerate(values.T):
            name = f"{words} {i + 1}" if values.shape[1] > 1 and i % every == 0 else None
            axes.plot(time, line, color=shades[i] if values.shape[1] > 1 else COLOURS[0], lw=0.8, label=name)
        axes.axhline(0, color="0.6", lw=0.6)
        axes.set_ylabel(label)
        grid(axes)
    collapse = time_of_collapse(dataset, chosen)
    if collapse:
        at, words = collapse
        for axes in all_axes:
            axes.axvline(at, color=COLLAPSE_COLOUR, lw=1, ls="--", label=words)
        time = time[time <= max(BEYOND * at, time[1])]  # the history ends at the collapse
    if count > 1 or collapse:
        for axes in all_axes[:2]:
            legend(axes, outside=True)
    for axes in all_axes:
        axes.set_xlim(time[0], time[-1])
    all_axes[-1].set_xlabel("Time [s]")
    title(all_axes[0], sample_title(dataset, chosen))
    return result


def hysteresis(dataset: xr.Dataset, history: int = 0, *, ax: Iterable[Axes] | Axes | None = None) -> Drawn:
    """Draw hysteresis loops: storey force [MN] against storey drift [mm], from a response history or a static test.

    To compare a loop with a test, draw the measured values in the same units: `axes.plot(1000 * drift, force / 1e6)`.

    Args:
        dataset: Result of `simulate` for a ShearBuilding with histories, or of `storey_hysteresis` or `pushover`.
        history: Index of the history that is drawn, counted from 0; ignored for static tests.
        ax: Axes to draw into, one per storey; None: a new figure.

    Returns:
        The new figure, or the axes that were given as `ax`.

    Raises:
        ValueError: If the dataset has no storey forces.
        TypeError: If `dataset` is not a Dataset.

    Example:
        >>> figure = wd.plots.hysteresis(wd.storey_hysteresis(building, [0.0, 0.02, -0.02, 0.02]))
    """
    check_dataset("plots.hysteresis", dataset, advice=f"{_HISTORIES} of a ShearBuilding")
    if "storey_drift" in dataset and "storey_force" in dataset:
        if dataset["storey_force"].dims != ("step", "storey"):
            raise ValueError("plots.hysteresis: select steps and storeys by isel(step=[...], storey=[...])")
        storeys = dataset["storey"].values if "storey" in dataset.coords else None
        return _loops(dataset["storey_drift"].values, dataset["storey_force"].values, ax, storeys)[0]
    chosen = chosen_history("hysteresis", dataset, history, "displacement", "storey_force")
    drift = np.diff(chosen["displacement"].values, axis=1, prepend=0.0)
    result, all_axes = _loops(drift, chosen["storey_force"].values, ax)
    collapse = time_of_collapse(dataset, chosen)
    if collapse:
        last = np.flatnonzero(np.isfinite(drift).all(axis=1))[-1]
        for storey, axes in enumerate(all_axes):
            end = 1000 * drift[last, storey], chosen["storey_force"].values[last, storey] / 1e6
            axes.plot(*end, "x", color=COLLAPSE_COLOUR, ms=6, mew=1.5)
    if isinstance(result, Picture):
        result.suptitle(sample_title(dataset, chosen) + (f" ({collapse[1]})" if collapse else ""), fontsize=10)
    return result


def _loops(
    drift: np.ndarray, force: np.ndarray, ax: Iterable[Axes] | Axes | None, numbers: np.ndarray | None = None
) -> tuple[Drawn, list[Axes]]:
    """Draw the force [N] against the drift [m], both of shape [step, storey], in one panel per storey.

    Args:
        drift: Storey drifts [m].
        force: Storey forces [N].
        ax: Axes to draw into.
        numbers: Numbers of the storeys in the titles; None: from 1.
    """
    storeys = force.shape[1]
    numbers = np.arange(1, storeys + 1) if numbers is None else numbers
    columns = min(storeys, PANELS_IN_A_ROW)
    size = (2.2 * columns + 0.6, 2.9 * -(-storeys // columns))
    result, all_axes = panels("hysteresis", ax, storeys, columns=columns, size=size, sharex=True, sharey=True)
    for storey, axes in enumerate(all_axes):
        axes.plot(1000 * drift[:, storey], force[:, storey] / 1e6, color=COLOURS[0], lw=0.7)
        title(axes, f"storey {numbers[storey]}")
        grid(axes)
    if isinstance(result, Picture):
        result.supxlabel("Storey drift [mm]", fontsize=TITLE)
        result.supylabel("Storey force [MN]", fontsize=TITLE)
    else:
        for axes in all_axes:
            axes.set_xlabel("Storey drift [mm]", fontsize=SMALL)
        all_axes[0].set_ylabel("Storey force [MN]", fontsize=SMALL)
    return result, all_axes


def chosen_history(function: str, dataset: xr.Dataset, history: int, *names: str) -> xr.Dataset:
    """Return the part of a run for one history; raise an error if the history does not exist or its sample failed."""
    kind = " of a ShearBuilding" if "storey_force" in names else ""
    check_run(function, dataset, *names, "history_sample", advice=_HISTORIES + kind)
    if "history" in dataset.dims:
        count = dataset.sizes["history"]
        if whole_number("history", history, 0) >= count:
            raise ValueError(f"plots.{function}: history={history} does not exist; give 0 to {count - 1}")
        dataset = dataset.isel(history=history)
    if not np.isfinite(dataset["displacement"].values).any():
        raise ValueError(
            f"plots.{function}: sample {number_of_sample(dataset)} failed, so its history is NaN: choose another "
            "history="
        )
    return dataset


def number_of_sample(chosen: xr.Dataset) -> int:
    return int(chosen["history_sample"])


def _of_sample(dataset: xr.Dataset, chosen: xr.Dataset) -> xr.Dataset | None:
    """Return the values of the sample of a history; None if the run no longer contains the sample after a selection."""
    if "sample" not in dataset.dims:
        return None
    numbers = dataset["sample"].values if "sample" in dataset.coords else np.arange(0)
    found = np.flatnonzero(numbers == number_of_sample(chosen))
    return dataset.isel(sample=int(found[0])) if found.size else None


def time_of_collapse(dataset: xr.Dataset, chosen: xr.Dataset) -> tuple[float, str] | None:
    """Return the time of collapse [s] in a history, and a text for the legend; None if the sample did not collapse."""
    own = _of_sample(dataset, chosen)
    if own is None or "status" not in own or decoded_status(own["status"].expand_dims("sample"))[0] != COLLAPSED:
        return None
    if "time_of_collapse" in own:
        at = float(own["time_of_collapse"])
        return at, f"collapse of storey {int(own['storey_of_collapse'])} at {at:.3g} s"
    finite = np.flatnonzero(np.isfinite(chosen["displacement"].values).all(axis=1))
    at = float(chosen["time"].values[finite[-1]])
    return at, f"collapse at {at:.3g} s"


def sample_title(dataset: xr.Dataset, chosen: xr.Dataset) -> str:
    """Return a title with the number of the sample of a history, its ground motion and its intensity level."""
    text, own = f"Sample {number_of_sample(chosen)}", _of_sample(dataset, chosen)
    if own is None:
        return text
    if "motion_index" in own.coords and "motion_name" in dataset:
        text += f": {literal(dataset['motion_name'].values[int(own['motion_index'])])}"
    if "im_level" in own.coords:
        units = dataset["im_level"].attrs.get("units", "g")
        text += f", {literal(measure_name(dataset))} = {float(own['im_level']):.3g} {units}"
    return text
