"""Figures, one function each: it takes a dataset and returns a matplotlib Figure."""

from __future__ import annotations

from itertools import cycle

import numpy as np
import xarray as xr
from matplotlib import ticker
from matplotlib.collections import LineCollection
from matplotlib.figure import Figure

from warpdyn.core.checks import check_dataset
from warpdyn.core.output_variables import STRIPED
from warpdyn.core.units import STANDARD_GRAVITY
from warpdyn.plots.style import COLOURS, new_figure, storey_panels

__all__ = [
    "COLOURS",
    "drift_against_intensity",
    "drift_over_height",
    "fragility_curves",
    "hysteresis",
    "spectra",
]


def _measure(dataset: xr.Dataset) -> str:
    return dataset["im_level"].attrs.get("long_name", "intensity measure").removesuffix(" of the scaled motion")


_MERGED = "draw run.merge(fragility(run, limits), combine_attrs='no_conflicts')"


def fragility_curves(dataset: xr.Dataset) -> Figure:
    """Draw the fitted curves with their bootstrap bands, and the stripe fractions with their intervals.

    Args:
        dataset: A run merged with its `fragility`.

    Raises:
        ValueError: If the dataset lacks the curves.
        TypeError: If `dataset` is no Dataset.
    """
    check_dataset("plots.fragility_curves", dataset, "fragility_curve", "confidence", advice=_MERGED)
    figure = new_figure()
    axes = figure.subplots()
    intensity = dataset["intensity"].values
    for colour, state in zip(cycle(COLOURS), dataset["damage_state"].values, strict=False):
        row = dataset.sel(damage_state=state)
        axes.fill_between(
            intensity, row["fragility_curve_lower"], row["fragility_curve_upper"], color=colour, alpha=0.18, lw=0
        )
        limit = float(row["drift_ratio_limit"])
        axes.plot(intensity, row["fragility_curve"], color=colour, label=f"{state} (drift > {100 * limit:.2g} %)")
        fraction = row["exceedance_fraction"].values
        error = [fraction - row["exceedance_fraction_lower"].values, row["exceedance_fraction_upper"].values - fraction]
        axes.errorbar(
            row["stripe"], fraction, yerr=np.maximum(error, 0), fmt="o", ms=3.5, color=colour, lw=0.8, capsize=2
        )
    axes.set(xlabel=f"{_measure(dataset)} [g]", ylabel="Probability of exceedance", ylim=(-0.02, 1.02), xlim=(0, None))
    axes.yaxis.set_major_formatter(ticker.PercentFormatter(1.0))
    axes.grid(alpha=0.3)
    axes.legend(loc="lower right", frameon=True)
    confidence = 100 * dataset.attrs["confidence"]
    axes.set_title(
        f"Fragility, worst storey; bands: {confidence:.0f} % bootstrap over records, "
        f"bars: {confidence:.0f} % Clopper-Pearson",
        fontsize=9,
    )
    return figure


def _valid(dataset: xr.Dataset) -> xr.Dataset:
    """Return the samples that neither diverged nor had an unstable step."""
    return dataset.isel(sample=np.flatnonzero(dataset["status"].values <= 1))


def drift_over_height(dataset: xr.Dataset, levels: int = 5) -> Figure:
    """Draw the median peak drift ratio of each storey, with its 16 to 84 % range, for some of the stripes.

    Args:
        dataset: A run on stripes, merged with its `fragility` to show the limits.
        levels: Number of stripes drawn.

    Raises:
        ValueError: If the dataset has no drifts or no levels.
        TypeError: If `dataset` is no Dataset.
    """
    check_dataset(
        "plots.drift_over_height",
        dataset,
        "peak_storey_drift_ratio",
        "im_level",
        advice="draw a run of a ShearBuilding on stripes",
    )
    if dataset["im_level"].attrs.get("design") != STRIPED:
        raise ValueError("the run is not on stripes: drift_over_height draws one curve a stripe")
    valid = _valid(dataset)
    stripes = np.unique(valid["im_level"])
    stripes = stripes[np.unique(np.linspace(0, stripes.size - 1, levels).round().astype(int))]
    figure = new_figure(6.4, 4.6)
    axes = figure.subplots()
    storeys = valid["storey"].values
    for colour, level in zip(cycle(COLOURS), stripes, strict=False):
        drift = 100 * valid["peak_storey_drift_ratio"].values[valid["im_level"].values == level]
        low, median, high = np.quantile(drift, (0.16, 0.5, 0.84), axis=0)
        axes.fill_betweenx(storeys, low, high, color=colour, alpha=0.15, lw=0)
        axes.plot(median, storeys, "o-", color=colour, ms=4, label=f"{level:g}")
    for state, limit in _limits(dataset):
        axes.axvline(100 * limit, color="0.45", ls=":", lw=1)
        place = (100 * limit, storeys[-1] + 0.15)
        axes.annotate(state, place, rotation=90, fontsize=8, color="0.35", ha="right", va="bottom")
    axes.set(xscale="log", xlabel="Peak storey drift ratio [%]", ylabel="Storey", ylim=(0.6, storeys[-1] + 0.9))
    axes.yaxis.set_major_locator(ticker.MaxNLocator(integer=True))
    axes.xaxis.set_major_formatter(ticker.FormatStrFormatter("%g"))
    axes.grid(alpha=0.3)
    figure.legend(title=f"{_measure(dataset)} [g]", fontsize=8, title_fontsize=8, loc="outside right upper")
    axes.set_title("Peak drift over height: median and 16 to 84 %", fontsize=9)
    return figure


def _limits(dataset: xr.Dataset) -> list[tuple[str, float]]:
    """Return the damage states and their drift limits, if the dataset has any."""
    if "drift_ratio_limit" not in dataset:
        return []
    return list(zip(dataset["damage_state"].values, dataset["drift_ratio_limit"].values, strict=True))


def drift_against_intensity(dataset: xr.Dataset) -> Figure:
    """Draw the largest peak drift ratio of every sample against its intensity measure; on stripes, with quantiles.

    Args:
        dataset: A run of ground motions, merged with its `fragility` to show the limits.

    Raises:
        ValueError: If the dataset has no drifts or no levels.
        TypeError: If `dataset` is no Dataset.
    """
    check_dataset(
        "plots.drift_against_intensity",
        dataset,
        "peak_storey_drift_ratio",
        "im_level",
        advice="draw a run of a ShearBuilding under ground motions",
    )
    valid = _valid(dataset)
    level = valid["im_level"].values
    drift = 100 * valid["peak_storey_drift_ratio"].max("storey").values
    figure = new_figure(6.4, 4.6)
    axes = figure.subplots()
    shown = np.random.default_rng(0).permutation(level.size)[:20_000]  # more points than these only fill the stripes in
    axes.scatter(level[shown], drift[shown], s=3, color="0.7", lw=0, rasterized=True, label="samples")
    if dataset["im_level"].attrs.get("design") == STRIPED:
        stripes = np.unique(level)
        quantiles = np.array([np.quantile(drift[level == each], (0.16, 0.5, 0.84)) for each in stripes])
        axes.plot(stripes, quantiles[:, 1], "o-", color="black", ms=4, label="median")
        axes.plot(stripes, quantiles[:, [0, 2]], "--", color="black", lw=1, label=["16 and 84 %", None])
    for colour, (state, limit) in zip(cycle(COLOURS), _limits(dataset), strict=False):
        axes.axhline(100 * limit, color=colour, lw=1)
        axes.annotate(state, (level.min(), 100 * limit), fontsize=8, color=colour, va="bottom")
    axes.set(
        xscale="log",
        yscale="log",
        xlabel=f"{_measure(dataset)} [{dataset['im_level'].attrs.get('units', 'g')}]",
        ylabel="Largest peak storey drift ratio [%]",
    )
    for axis in (axes.xaxis, axes.yaxis):
        axis.set_major_formatter(ticker.FormatStrFormatter("%g"))
    axes.grid(alpha=0.3, which="both", lw=0.4)
    axes.legend(fontsize=8, loc="lower right")
    return figure


def spectra(dataset: xr.Dataset) -> Figure:
    """Draw the pseudo-spectral acceleration of every motion, the median and the 16 to 84 % range, by damping ratio.

    Args:
        dataset: What `response_spectra` returned.

    Raises:
        ValueError: If the dataset has no spectra.
        TypeError: If `dataset` is no Dataset.
    """
    check_dataset(
        "plots.spectra",
        dataset,
        "pseudo_spectral_acceleration",
        advice="draw what response_spectra(motions, periods) returned",
    )
    spectra = dataset["pseudo_spectral_acceleration"].transpose("damping_ratio", "motion", "period") / STANDARD_GRAVITY
    period, panels = dataset["period"].values, dataset.sizes["damping_ratio"]
    figure = new_figure(6.4 if panels == 1 else 1.0 + 3.4 * panels, 4.6)
    for axes, panel in zip(figure.subplots(1, panels, sharey=True, squeeze=False)[0], spectra, strict=True):
        lines = [np.column_stack([period, values]) for values in panel.values]
        axes.add_collection(LineCollection(lines, colors="0.6", linewidths=0.5, alpha=0.6, label="motions"))
        low, median, high = np.quantile(panel.values, (0.16, 0.5, 0.84), axis=0)
        axes.fill_between(period, low, high, color=COLOURS[0], alpha=0.25, lw=0, label="16 to 84 %")
        axes.plot(period, median, color=COLOURS[0], lw=1.8, label="median")
        axes.set(xscale="log", yscale="log", xlabel="Period [s]", xlim=(period.min(), period.max()))
        axes.set_title(f"{100 * float(panel['damping_ratio']):.3g} % damping", fontsize=9)
        for axis in (axes.xaxis, axes.yaxis):
            axis.set_major_locator(ticker.LogLocator(subs=(1, 3)))
            axis.set_major_formatter(ticker.FormatStrFormatter("%g"))
            axis.set_minor_formatter(ticker.NullFormatter())
        axes.grid(alpha=0.3, which="both", lw=0.4)
    figure.axes[0].set_ylabel("Pseudo-spectral acceleration [g]")
    figure.axes[0].legend(fontsize=8, loc="lower left")
    return figure


def hysteresis(dataset: xr.Dataset, history: int = 0) -> Figure:
    """Draw the storey force against the storey drift: of one sample's whole history, or of storeys pushed slowly.

    Args:
        dataset: A run of a ShearBuilding with histories, or what `storey_hysteresis` or `pushover` returned.
        history: Which of the histories.

    Raises:
        ValueError: If the dataset has no storey forces along a path.
        TypeError: If `dataset` is no Dataset.
    """
    advice = "run simulate(..., histories=Histories(...)) of a ShearBuilding"
    check_dataset("plots.hysteresis", dataset, advice=advice)
    if "storey_drift" in dataset:
        return storey_panels(dataset["storey_drift"].values, dataset["storey_force"].values)
    check_dataset("plots.hysteresis", dataset, "displacement", "storey_force", advice=advice)
    chosen = dataset.isel(history=history)
    figure = storey_panels(np.diff(chosen["displacement"].values, axis=1, prepend=0.0), chosen["storey_force"].values)
    at = dataset.isel(sample=int(chosen["history_sample"]))
    title = f"Sample {int(at['sample'])}"
    if "motion_index" in at.coords:
        title += f": {dataset['motion_name'].values[int(at['motion_index'])]}"
    if "im_level" in at.coords:
        title += f", {_measure(dataset)} = {float(at['im_level']):.3g} {at['im_level'].attrs.get('units', 'g')}"
    figure.suptitle(title, fontsize=10)
    return figure
