"""Figures of seismic risk: hazard and annual rates, disaggregation, vulnerability, and loss exceedance."""

from __future__ import annotations

from collections.abc import Iterable

import numpy as np
import xarray as xr
from matplotlib import ticker
from matplotlib.axes import Axes
from scipy.special import betaincinv

from warpdyn.answers.risk.annual_rates import warned_shares
from warpdyn.answers.risk.curves.curve_set import CurveSet
from warpdyn.answers.risk.disaggregation import contributions
from warpdyn.answers.risk.hazard_curves import Hazard, branches_of
from warpdyn.foundations.core.checks import check_dataset, check_kind
from warpdyn.interfaces.plots.style import (
    COLOURS,
    DARK,
    PALE,
    SMALL,
    Colours,
    Drawn,
    check_colour,
    check_kept,
    colours_of,
    grid,
    legend,
    literal,
    panels,
    plain_numbers,
    set_scale,
    title,
)

SHARES = (0.16, 0.84)  # fractiles between which the range of losses is shaded
BINS = 120  # number of intensity bins of the contributions to the annual rates, which are drawn as areas
_POINTS = 300  # number of points of each drawn curve
LARGE_AMOUNTS = (1e9, "billion"), (1e6, "million")  # units of an axis of losses, if the largest loss is above them


def hazard_and_rates(
    curves: xr.Dataset, hazard: Hazard, *, colours: Colours = COLOURS, ax: Iterable[Axes] | Axes | None = None
) -> Drawn:
    """Draw a hazard curve, fragility curves, and the contribution of each intensity to the annual rates.

    Areas show the contributions to the annual rate of each damage state per unit of ln(intensity), scaled to a maximum
    of 1. The legend contains the annual rates. For a logic tree, each branch is a pale curve and their mean is black.

    Args:
        curves: Result of `fragility`.
        hazard: Hazard curve or logic tree of the site, for the intensity measure of the curves.
        colours: Colour of each damage state: a list with the lightest state first, or a mapping by name.
        ax: Two axes to draw into, one for the hazard and one for the fragility; None: a new figure.

    Returns:
        The new figure, or the axes that were given as `ax`.

    Raises:
        TypeError, ValueError: If `curves` and `hazard` are not valid arguments of `annual_rates`.

    Example:
        >>> figure = wd.plots.hazard_and_rates(curves, hazard)
    """
    tree = branches_of("plots.hazard_and_rates", hazard)
    found = CurveSet.from_dataset("plots.hazard_and_rates", curves, tree)
    rates = tree.weights @ found.rates(tree)
    warned_shares(found, tree, rates)
    parts = contributions(found, tree, bins=BINS)
    result, (upper, lower) = panels("hazard_and_rates", ax, 2, columns=1, size=(6.4, 6.4), sharex=True)
    low, high = float(parts["intensity_lower"][0]), float(parts["intensity_upper"][-1])
    levels = np.geomspace(low, high, _POINTS)
    if len(tree.curves) > 1:
        for i, each in enumerate(tree.curves):
            upper.plot(levels, each.rate_of(levels), color=PALE, lw=0.8, label="branches" if i == 0 else None)
    else:
        upper.plot(tree.curves[0].intensity, tree.curves[0].annual_rate, "o", color=DARK, ms=3.5, label="points")
    upper.plot(levels, tree.rate_of(levels), color="black", label="mean" if len(tree.curves) > 1 else "hazard curve")
    upper.set(ylabel="Annual rate of exceedance [1/year]", xscale="log", yscale="log", xlim=(low, high))
    legend(upper)
    title(upper, "Hazard")

    density, exceedance = parts["contribution_density"].values, found.probability(levels)
    for i, colour in enumerate(colours_of(found.names, colours)):
        words = f"{literal(found.names[i])}: {_rate_in_words(rates[i])}"
        lower.plot(levels, exceedance[i], color=colour, label=words)
        lower.fill_between(parts["intensity"], density[i] / density[i].max(), color=colour, alpha=0.15, lw=0)
    name = found.measure or tree.measure or "intensity measure"  # as in figures of the curves alone
    lower.set(
        xlabel=f"{literal(name)} [{tree.units}]", ylabel="Probability of exceedance", xscale="log", ylim=(-0.02, 1.02)
    )
    lower.yaxis.set_major_formatter(ticker.PercentFormatter(1.0))
    # The legend of the fragility curves is in the upper panel, because there is space below the hazard curve.
    first = upper.get_legend()
    legend(upper, handles=lower.get_lines(), loc="lower left", title="annual rates")
    if first is not None:
        upper.add_artist(first)
    title(lower, "Fragility; areas: contribution of the intensities to the annual rate")
    plain_numbers(lower.xaxis)
    grid(upper, lower)
    return result


def disaggregation(dataset: xr.Dataset, *, colours: Colours = COLOURS, ax: Axes | None = None) -> Drawn:
    """Draw the disaggregation of annual rates: for each damage state, the share of each range of intensities.

    Args:
        dataset: Result of `disaggregate`.
        colours: Colour of each damage state: a list with the lightest state first, or a mapping by name.
        ax: Axes to draw into; None: a new figure.

    Returns:
        The new figure, or the axes that were given as `ax`.

    Raises:
        ValueError: If the dataset lacks the contributions or the dimension `damage_state`.
        TypeError: If `dataset` is not a Dataset.

    Example:
        >>> figure = wd.plots.disaggregation(wd.disaggregate(curves, hazard))
    """
    needed = "contribution", "intensity_lower", "intensity_upper", "modal_intensity", "annual_rate", "damage_state"
    check_dataset("plots.disaggregation", dataset, *needed, advice="draw the result of disaggregate(curves, hazard)")
    check_kept("disaggregation", "contributions", dataset, "damage_state", "intensity")
    result, (axes,) = panels("disaggregation", ax, size=(6.4, 4.2))
    edges = np.append(dataset["intensity_lower"].values, dataset["intensity_upper"].values[-1])
    units = dataset["intensity"].attrs.get("units", "g")
    states = dataset["damage_state"].values
    for colour, state in zip(colours_of(states, colours), states, strict=True):
        row = dataset.sel(damage_state=state)
        mode = float(row["modal_intensity"])
        words = f"{literal(state)}: {_rate_in_words(float(row['annual_rate']))}, mode {mode:.2g} {units}"
        axes.stairs(row["contribution"].values, edges, color=colour, lw=1.5, label=words)
        axes.stairs(row["contribution"].values, edges, color=colour, alpha=0.12, fill=True)
        axes.axvline(mode, color=colour, ls=":", lw=0.9)
    name = dataset.attrs.get("intensity_measure") or "intensity measure"
    axes.set(
        xlabel=f"{literal(name)} [{units}]", ylabel="Share of the annual rate", xscale="log", xlim=(edges[0], edges[-1])
    )
    # Space for the legend above the bars.
    axes.set_ylim(0, (1.1 + 0.09 * states.size) * float(dataset["contribution"].max()))
    axes.yaxis.set_major_formatter(ticker.PercentFormatter(1.0))
    plain_numbers(axes.xaxis)
    grid(axes)
    legend(axes, loc="upper left")
    title(axes, "Contribution of the intensities to the annual rate of each damage state")
    return result


def vulnerability(
    dataset: xr.Dataset, *, colour: str = COLOURS[0], scale: str = "log", ax: Axes | None = None
) -> Drawn:
    """Draw a vulnerability function: mean loss ratio with its interval, and 16 to 84 % range of the loss ratio.

    The 16 to 84 % range is that of a beta distribution with the mean and the coefficient of variation at each
    intensity.

    Args:
        dataset: Result of `vulnerability`.
        colour: Colour of the curve of the mean loss ratio.
        scale: Scale of the axis of the intensity measure: "log" or "linear".
        ax: Axes to draw into; None: a new figure.

    Returns:
        The new figure, or the axes that were given as `ax`.

    Raises:
        ValueError: If the dataset lacks the mean loss ratio or its coefficient of variation.
        TypeError: If `dataset` is not a Dataset.

    Example:
        >>> figure = wd.plots.vulnerability(wd.vulnerability(curves, {"slight": (0.05, 0.5), "complete": (1.0, 0.0)}))
    """
    needed = "mean_loss_ratio", "coefficient_of_variation", "intensity"
    check_dataset("plots.vulnerability", dataset, *needed, advice="draw the result of vulnerability(curves, ratios)")
    check_colour(colour)
    check_kept("vulnerability", "loss ratios", dataset, "intensity")
    result, (axes,) = panels("vulnerability", ax, size=(6.4, 4.2))
    levels, mean = dataset["intensity"].values, dataset["mean_loss_ratio"].values
    low, high = _beta_range(mean, dataset["coefficient_of_variation"].values)
    share = "16 to 84 % of the losses (beta distribution)"
    axes.fill_between(levels, low, high, color=PALE, alpha=0.5, lw=0, label=share)
    if "mean_loss_ratio_lower" in dataset and np.isfinite(dataset["mean_loss_ratio_lower"]).any():
        bounds = dataset["mean_loss_ratio_lower"], dataset["mean_loss_ratio_upper"]
        words = f"{100 * dataset.attrs.get('confidence', 0.95):.0f} % interval of the mean"
        axes.fill_between(levels, *bounds, color=colour, alpha=0.3, lw=0, label=words)
    axes.plot(levels, mean, color=colour, label="mean loss ratio")
    name = dataset.attrs.get("intensity_measure") or "intensity measure"
    units = dataset["intensity"].attrs.get("units", "g")
    axes.set(xlabel=f"{literal(name)} [{units}]", ylabel="Loss ratio", ylim=(-0.02, 1.02))
    set_scale(axes, scale, levels[levels > 0].min(), levels.max())
    axes.yaxis.set_major_formatter(ticker.PercentFormatter(1.0))
    grid(axes)
    legend(axes, loc="upper left" if scale == "log" else "lower right")
    title(axes, "Vulnerability")
    return result


def loss_exceedance(
    dataset: xr.Dataset, *, currency: str = "", colour: str = COLOURS[0], ax: Axes | None = None
) -> Drawn:
    """Draw the annual rate of exceedance of a loss, its confidence interval, and the losses for the return periods.

    For losses of single events, the curve has one step per event. For draws of the loss of one earthquake there are no
    annual rates; the figure then shows the share of draws with a larger loss.

    Args:
        dataset: Result of `annual_losses`, `event_losses` or `portfolio_losses`.
        currency: Currency of the losses for the labels, such as "EUR"; "": none is shown.
        colour: Colour of the curve.
        ax: Axes to draw into; None: a new figure.

    Returns:
        The new figure, or the axes that were given as `ax`.

    Raises:
        ValueError: If the dataset lacks the losses or their rates of exceedance.
        TypeError: If `dataset` is not a Dataset.

    Example:
        >>> losses = wd.annual_losses(curves, hazard, {"slight": (0.05, 0.5), "complete": (1.0, 0.0)})
        >>> figure = wd.plots.loss_exceedance(losses)
    """
    check_colour(colour)
    check_kind("plots.loss_exceedance", "a text", currency, str, 'give currency="EUR"', argument="currency")
    if isinstance(dataset, xr.Dataset) and "loss" in dataset.data_vars:
        return _loss_exceedance_of_events(dataset, currency, colour, ax)
    needed = "loss_exceedance_rate", "return_period_loss", "expected_annual_loss", "loss"
    advice = "draw the result of annual_losses(curves, hazard, ratios)"
    check_dataset("plots.loss_exceedance", dataset, *needed, advice=advice)
    check_kept("loss_exceedance", "losses", dataset, "loss", "return_period")
    result, (axes,) = panels("loss_exceedance", ax, size=(6.4, 4.2))
    losses, rate = dataset["loss"].values, dataset["loss_exceedance_rate"].values
    shown = rate > 0
    lowest = float(rate[shown].min()) if shown.any() else 1e-6
    if shown.any() and np.isfinite(dataset["loss_exceedance_rate_lower"]).all():
        low, high = (np.maximum(dataset[f"loss_exceedance_rate_{side}"], 1e-12) for side in ("lower", "upper"))
        words = f"{100 * dataset.attrs.get('confidence', 0.95):.0f} % interval"
        axes.fill_between(losses[shown], low[shown], high[shown], color=colour, alpha=0.2, lw=0, label=words)
        lowest = min(lowest, max(float(low[shown].min()), 0.01 * lowest))
    mean = float(dataset["expected_annual_loss"])
    value = float(dataset.attrs.get("replacement_value", 1.0))
    money = "" if value == 1 else currency
    axes.plot(losses[shown], rate[shown], color=colour, label=f"expected annual loss: {_amount(mean, money)}")
    _mark_return_periods(axes, dataset)
    axes.set(xlabel="Loss ratio", ylabel="Annual rate of exceedance [1/year]", yscale="log")
    if value != 1:
        _label_losses(axes, float(losses[-1]), money)
    axes.set(xlim=(0, 1.02 * losses[-1]), ylim=(0.5 * lowest, 2 * max(float(rate.max()), lowest)))
    grid(axes)
    legend(axes, loc="upper right")
    title(axes, "Loss exceedance; points: losses of the return periods")
    return result


def _loss_exceedance_of_events(dataset: xr.Dataset, currency: str, colour: str, ax: Axes | None) -> Drawn:
    """Draw the losses of events against their annual rate of exceedance or, if it is missing, their probability."""
    has_rates = "loss_exceedance_rate" in dataset
    name = "loss_exceedance_rate" if has_rates else "exceedance_probability"
    advice = "draw the result of event_losses(counted), or of portfolio_losses with event_rates="
    check_dataset("plots.loss_exceedance", dataset, name, advice=advice)
    (along,) = dataset["loss"].dims
    check_kept("loss_exceedance", "losses", dataset, str(along))
    result, (axes,) = panels("loss_exceedance", ax, size=(6.4, 4.2))
    order = np.argsort(dataset["loss"].values, kind="stable")
    losses, exceeded = dataset["loss"].values[order], dataset[name].values[order]
    if has_rates:
        rate = float(dataset["expected_annual_loss"])
        words = f"expected annual loss: {_amount(rate, currency)}"
        least_rate = exceeded[exceeded > 0].min() if (exceeded > 0).any() else 1e-6
        axes.step(losses, np.where(exceeded > 0, exceeded, 0.5 * least_rate), where="post", color=colour, label=words)
        _mark_return_periods(axes, dataset)
        axes.set(ylabel="Annual rate of exceedance [1/year]", yscale="log")
        title(axes, "Loss exceedance by event; points: losses of the return periods")
    else:
        words = f"{losses.size} {literal(along)}s; median {_amount(float(np.median(losses)), currency)}"
        axes.step(np.append(0.0, losses), np.append(1.0, exceeded), where="post", color=colour, label=words)
        axes.set(ylabel=f"Share of the {literal(along)}s with a larger loss", ylim=(0, 1.02))
        axes.yaxis.set_major_formatter(ticker.PercentFormatter(1.0))
        title(axes, f"Loss exceedance of {losses.size} {literal(along)}s")
    margin = 1.15 if has_rates else 1.02  # space for the name of the longest return period
    axes.set(xlim=(0, margin * losses[-1] if losses[-1] > 0 else 1.0))
    _label_losses(axes, float(losses[-1]), currency)
    grid(axes)
    legend(axes, loc="upper right")
    return result


def _mark_return_periods(axes: Axes, dataset: xr.Dataset) -> None:
    """Mark the loss for each return period by a point with a text, such as "475 years"."""
    for period, loss in zip(dataset["return_period"].values, dataset["return_period_loss"].values, strict=True):
        if loss > 0:
            axes.plot(loss, 1 / period, "o", color=DARK, ms=4)
            axes.annotate(
                f"{period:g} years", (loss, 1 / period), (6, 3), textcoords="offset points", fontsize=SMALL, color=DARK
            )


def _rate_in_words(rate: float) -> str:
    """Return an annual rate and its return period as text; only the rate if the return period is below 1 year."""
    period = 1 / rate
    rounded = float(f"{period:.2g}")
    return f"{rate:.2g} per year (every {rounded:,.0f} years)" if period >= 1 else f"{rate:.2g} per year"


def _label_losses(axes: Axes, largest: float, currency: str) -> None:
    """Label an axis of losses with their currency, in millions or billions if the largest loss is that large."""
    divisor, word = next(((size, name) for size, name in LARGE_AMOUNTS if largest > size), (1.0, ""))
    unit = " ".join(part for part in (word, literal(currency)) if part)
    axes.set_xlabel(f"Loss [{unit}]" if unit else "Loss")
    axes.xaxis.set_major_formatter(ticker.FuncFormatter(lambda loss, _: _amount(loss / divisor)))


def _amount(value: float, currency: str = "") -> str:
    """Return an amount as text with its currency, rounded to three digits and without an exponent."""
    text = f"{float(f'{value:.3g}'):,.0f}" if value >= 100 else f"{value:.3g}"
    return f"{text} {literal(currency)}" if currency else text


def _beta_range(mean: np.ndarray, variation: np.ndarray) -> tuple[np.ndarray, np.ndarray]:
    """Return the 16 and 84 % fractiles of beta distributions with these means and coefficients of variation."""
    certain = ~((mean > 0) & (mean < 1) & (variation > 0))
    m = np.where(certain, 0.5, mean)
    size = m * (1 - m) / np.where(certain, 0.1, variation * mean) ** 2 - 1
    size = np.maximum(size, 1e-6)  # 0 for the largest possible variance (losses of only 0 and 1)
    fractiles = [np.where(certain, mean, betaincinv(m * size, (1 - m) * size, share)) for share in SHARES]
    return fractiles[0], fractiles[1]
