"""Figures of ground motions: accelerations and Arias intensity over time, and response spectra."""

from __future__ import annotations

from collections.abc import Iterable, Sequence

import numpy as np
import xarray as xr
from matplotlib import ticker
from matplotlib.axes import Axes
from matplotlib.collections import LineCollection

from warpdyn.foundations.core.checks import check_dataset, real_number
from warpdyn.foundations.core.units import STANDARD_GRAVITY
from warpdyn.interfaces.plots.style import (
    COLOURS,
    DARK,
    SMALL,
    Colours,
    Drawn,
    colours_of,
    grid,
    legend,
    literal,
    panels,
    plain_numbers,
    title,
)
from warpdyn.model.ground_motions.measures.integrals import arias_intensity, husid
from warpdyn.model.ground_motions.motions import GroundMotion, checked_motions
from warpdyn.model.ground_motions.response_spectra import response_spectra

PERIODS = np.geomspace(0.05, 5.0, 100)  # periods of the drawn response spectra [s]
MOST_NAMED = 8  # largest number of motions whose names are in the legend


def ground_motions(
    motions: GroundMotion | Sequence[GroundMotion],
    *,
    damping_ratio: float = 0.05,
    colours: Colours = COLOURS,
    ax: Iterable[Axes] | None = None,
) -> Drawn:
    """Draw ground motions: accelerations, growth of the Arias intensity over time (Husid plot), and response spectra.

    For a single motion, its peak, Arias intensity and significant duration (5 to 95 %) are written into the figure.

    Args:
        motions: One ground motion, or a sequence of them.
        damping_ratio: Damping ratio of the response spectra [1].
        colours: Colours of the motions, as a list or a mapping by name.
        ax: Three axes to draw into; None: a new figure.

    Returns:
        The new figure, or the axes that were given as `ax`.

    Raises:
        ValueError: If `motions` is empty, or the damping ratio is out of range.
        TypeError: If a motion is not a GroundMotion.

    Example:
        >>> figure = wd.plots.ground_motions(motions[:2])
    """
    drawn = checked_motions(motions)
    real_number("damping_ratio", damping_ratio, least=0)
    result, (history, growth, spectrum) = panels("ground_motions", ax, 3, columns=1, size=(7.0, 7.4))
    spectra = response_spectra(drawn, PERIODS, damping_ratio, device="cpu")["pseudo_spectral_acceleration"].values[:, 0]
    is_crowd = len(drawn) > MOST_NAMED and colours is COLOURS  # the motions are too many for distinct colours
    chosen = colours_of([motion.name for motion in drawn], DARK if is_crowd else colours)
    for motion, colour, acceleration in zip(drawn, chosen, spectra / STANDARD_GRAVITY, strict=True):
        time = motion.step * np.arange(motion.acceleration.size)
        name = literal(motion.name) if len(drawn) <= MOST_NAMED else None
        history.plot(time, motion.acceleration / STANDARD_GRAVITY, color=colour, lw=0.6, label=name)
        width = 1.2 if len(drawn) <= MOST_NAMED else 0.5
        growth.plot(time, husid(motion), color=colour, lw=width)
        spectrum.plot(PERIODS, acceleration, color=colour, lw=width)
    history.set(xlabel="Time [s]", ylabel="Acceleration [g]")
    growth.set(xlabel="Time [s]", ylabel="Share of Arias intensity", ylim=(-0.02, 1.02))
    growth.yaxis.set_major_formatter(ticker.PercentFormatter(1.0))
    spectrum.set(xscale="log", xlabel="Period [s]", ylabel=f"Sa, {100 * damping_ratio:g} % damping [g]", ylim=(0, None))
    plain_numbers(spectrum.xaxis)
    if len(drawn) == 1:
        _describe(drawn[0], history, growth, chosen[0])
    elif len(drawn) <= MOST_NAMED:
        legend(history, outside=True)
    else:
        title(history, f"{len(drawn)} ground motions, and the median of their spectra")
        median = np.median(spectra / STANDARD_GRAVITY, axis=0)
        spectrum.plot(PERIODS, median, color=COLOURS[0] if is_crowd else "black", lw=2.2)
    grid(history, growth, spectrum)
    return result


def _describe(motion: GroundMotion, history: Axes, growth: Axes, colour: str) -> None:
    """Mark the peak and the significant duration of a single motion, and write their values into the figure."""
    peak = int(np.abs(motion.acceleration).argmax())
    at = peak * motion.step, motion.acceleration[peak] / STANDARD_GRAVITY
    history.plot(*at, "o", color=colour, ms=4)
    title(history, f"{literal(motion.name)}: PGA {abs(at[1]):.3g} g at {at[0]:.4g} s, {motion.duration:.4g} s long")
    share = husid(motion)
    if not np.isfinite(share).all():
        return
    first, last = (motion.step * float(np.interp(each, share, np.arange(share.size))) for each in (0.05, 0.95))
    growth.axvspan(first, last, color=colour, alpha=0.12, lw=0)
    words = f"5 to 95 %: {last - first:.3g} s\nArias intensity {arias_intensity(motion):.3g} m/s"
    growth.annotate(words, (0.985, 0.06), xycoords="axes fraction", ha="right", va="bottom", fontsize=SMALL, color=DARK)


def spectra(dataset: xr.Dataset, *, colours: Colours = COLOURS, ax: Iterable[Axes] | Axes | None = None) -> Drawn:
    """Draw pseudo-spectral accelerations [g] over the period: each motion, their median and their 16 to 84 % range.

    Args:
        dataset: Result of `response_spectra`.
        colours: Colours of the median and its range, one per damping ratio.
        ax: Axes to draw into, one per damping ratio; None: a new figure.

    Returns:
        The new figure, or the axes that were given as `ax`.

    Raises:
        ValueError: If the dataset has no spectra.
        TypeError: If `dataset` is not a Dataset.

    Example:
        >>> figure = wd.plots.spectra(wd.response_spectra(motions, periods=np.geomspace(0.1, 2.0, 20)))
    """
    advice = "draw the result of response_spectra(motions, periods)"
    check_dataset("plots.spectra", dataset, "pseudo_spectral_acceleration", "period", advice=advice)
    table = dataset["pseudo_spectral_acceleration"] / STANDARD_GRAVITY
    for dim in ("motion", "damping_ratio", "period"):
        table = table if dim in table.dims else table.expand_dims(dim)  # the user selected one value of it
        if not table.sizes[dim]:
            raise ValueError(f"plots.spectra: the dataset has no {dim}: check the condition by which you selected it")
    table = table.transpose("damping_ratio", "motion", "period")
    period, count = table["period"].values, table.sizes["damping_ratio"]
    size = (6.4 if count == 1 else 1.0 + 3.4 * count, 4.6)
    result, all_axes = panels("spectra", ax, count, size=size, sharey=True)
    row = colours_of(table["damping_ratio"].values, colours if not isinstance(colours, tuple) else colours[0])
    for axes, colour, panel in zip(all_axes, row, table, strict=True):
        lines = [np.column_stack([period, values]) for values in panel.values]
        axes.add_collection(LineCollection(lines, colors="0.6", linewidths=0.5, alpha=0.6, label="motions"))
        low, median, high = np.quantile(panel.values, (0.16, 0.5, 0.84), axis=0)
        axes.fill_between(period, low, high, color=colour, alpha=0.25, lw=0, label="16 to 84 %")
        axes.plot(period, median, color=colour, lw=1.8, label="median")
        axes.set(xscale="log", yscale="log", xlabel="Period [s]")
        if period.size > 1:
            axes.set_xlim(period.min(), period.max())
        axes.autoscale_view(scalex=False)
        title(axes, f"{100 * float(panel['damping_ratio']):.3g} % damping")
        plain_numbers(axes.xaxis, axes.yaxis)
        grid(axes)
    all_axes[0].set_ylabel("Pseudo-spectral acceleration [g]")
    legend(all_axes[0], loc="lower left")
    return result
