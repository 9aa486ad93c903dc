"""Figure of a selection of records: spectra and standard deviations of the target and of the selection."""

from __future__ import annotations

from collections.abc import Iterable

import numpy as np
from matplotlib.axes import Axes
from matplotlib.collections import LineCollection

from warpdyn.foundations.core.checks import check_kind, whole_number
from warpdyn.interfaces.plots.style import (
    COLOURS,
    Colours,
    Drawn,
    colours_of,
    grid,
    legend,
    panels,
    plain_numbers,
    title,
)
from warpdyn.model.ground_motions.selection.result import RecordSelection

ADVICE = "give the result of select_records()"


def record_selection(
    selection: RecordSelection, level: int = 0, *, colours: Colours = COLOURS, ax: Iterable[Axes] | None = None
) -> Drawn:
    """Draw a selection of records against its target: scaled spectra, and standard deviations of ln Sa.

    The first panel contains the scaled spectra, the medians, and the 2.5 and 97.5 % quantiles of the target and of a
    normal distribution with the mean and standard deviation of the selection.

    Args:
        selection: Result of `select_records`.
        level: Index of the target.
        colours: Colours of the target and of the selection.
        ax: Two axes to draw into; None: a new figure.

    Returns:
        The new figure, or the axes that were given as `ax`.

    Raises:
        TypeError: If `selection` is not the result of `select_records`.
        ValueError: If there is no target with this index.

    Example:
        >>> spectra = wd.RecordSpectra.from_motions(motions, periods=[0.1, 0.3, 1.0])
        >>> target = wd.TargetSpectrum([0.1, 0.3, 1.0], [0.8, 0.4, 0.14], [0.3, 0.0, 0.4], wd.SpectralAcceleration(0.3))
        >>> figure = wd.plots.record_selection(wd.select_records(spectra, target, number=4))
    """
    check_kind("plots.record_selection", "a RecordSelection", selection, RecordSelection, ADVICE)
    level = whole_number("level", level, 0, len(selection.levels) - 1)
    target, scaled = selection.levels[level].target, selection.spectra(level)
    periods = np.asarray(target.periods)
    of_target, of_selection = colours_of(["target", "selection"], colours)
    result, (spectra, spread) = panels("record_selection", ax, 2, size=(9.2, 4.2))
    lines = [np.column_stack([periods, np.exp(row)]) for row in scaled]
    spectra.add_collection(LineCollection(lines, colors="0.75", linewidths=0.6, label=f"{len(scaled)} scaled records"))
    deviation = scaled.std(axis=0, ddof=1) if len(scaled) > 1 else np.zeros(periods.size)
    for colour, style, name, mean, sigma in (
        (of_target, "-", "target", target.mean, target.dispersion),
        (of_selection, "--", "selection", scaled.mean(axis=0), deviation),
    ):
        spectra.plot(periods, np.exp(mean), style, color=colour, lw=1.8, label=f"median of {name}")
        for sign, label in ((1, f"2.5 and 97.5 % of {name}"), (-1, None)):
            spectra.plot(periods, np.exp(mean + sign * 1.96 * sigma), style, color=colour, lw=0.9, label=label)
        spread.plot(periods, sigma, style, color=colour, lw=1.8, label=name)
    spectra.set(xscale="log", yscale="log", xlabel="Period [s]", ylabel="Spectral acceleration [g]")
    spread.set(xscale="log", ylim=(0, None), xlabel="Period [s]", ylabel="Standard deviation of ln Sa")
    spectra.autoscale_view()
    if target.conditioning is not None:
        title(spectra, f"{target.conditioning.name} = {target.level:.3g} g")
    plain_numbers(spectra.xaxis, spectra.yaxis)
    plain_numbers(spread.xaxis)
    grid(spectra, spread)
    legend(spectra, loc="lower left")
    legend(spread, loc="best")
    return result
