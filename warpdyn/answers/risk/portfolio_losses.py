"""Losses of a portfolio in each event, from damage shares, loss ratios and replacement values."""

from __future__ import annotations

from collections.abc import Mapping, Sequence

import numpy as np
import xarray as xr
from numpy.typing import ArrayLike
from scipy.special import stdtrit

from warpdyn.answers.fragility.curve_variables import variable
from warpdyn.answers.fragility.lognormal_fit import check_confidence
from warpdyn.answers.risk.event_losses import MONEY, checked_event_rates, rates_of_losses
from warpdyn.answers.risk.losses import RETURN_PERIODS
from warpdyn.campaigns.reductions.damage.loss_ratios import Ratios, check_archetypes, ratios_of_archetypes
from warpdyn.campaigns.reductions.limits import NO_DAMAGE
from warpdyn.foundations.core.checks import check_dataset, real_number
from warpdyn.foundations.core.output_variables import measure_of_dataset

_FUNCTION = "portfolio_losses"


def portfolio_losses(
    shares: xr.Dataset,
    loss_ratios: Ratios | Mapping[str, Ratios],
    replacement_values: Mapping[str, float],
    *,
    event_rates: ArrayLike | None = None,
    return_periods: Sequence[float] = RETURN_PERIODS,
    confidence: float = 0.95,
) -> xr.Dataset:
    """Return the losses of a portfolio in each event, by archetype and in total, and annual losses if rates are given.

    All buildings of an archetype have the same value. Undamaged buildings have no loss.

    Args:
        shares: The result of `damage_shares`.
        loss_ratios: Loss ratio of each damage state: its mean [1], or (mean, coefficient of variation). Either one such
            mapping for all archetypes, or such a mapping for each archetype.
        replacement_values: Total value of all buildings of each archetype [currency], by the name of the archetype.
        event_rates: Annual rate of each event (or motion) [1/year], shape [event], in the order of the shares; or a
            DataArray over the events, whose labels are matched. None: no annual losses are computed.
        return_periods: Return periods of the total loss [year]; used only if `event_rates` is given.
        confidence: Probability that the interval of the mean loss ratio covers the true value [1]; for runs on stripes.

    Returns:
        `archetype_loss_ratio(archetype, event)` [1] and `archetype_loss(archetype, event)` [currency]; `loss(event)`
        [currency] and `loss_ratio(event)` [1] of the portfolio; `loss_deviation(event)` [currency], the standard
        deviation caused by the scatter of the loss ratios, which are independent between buildings. A run on stripes
        adds the dimension `stripe`, and the vulnerability function of the portfolio: `mean_loss_ratio(intensity)` [1],
        the mean of `loss_ratio` over the events, with `_lower` and `_upper` (NaN with one event, or if all events have
        the same loss ratio, such as 0), and its `coefficient_of_variation(intensity)` [1] (of the events and of the
        loss ratios). The interval is that of the
        mean of independent events, by the t distribution, limited to 0 to 1; it does not include the scatter of other
        portfolios with the same distributions. `expected_annual_loss` integrates it over a hazard curve, and
        `plots.vulnerability` draws it. If `event_rates` is given: `archetype_expected_annual_loss(archetype)` and
        `expected_annual_loss` [currency/year]; `loss_exceedance_rate(event)`, the annual rate of losses above the loss
        of the event [1/year]; and `return_period_loss(return_period)` [currency], the smallest loss of an event that is
        exceeded at most once per return period on average (0 if events are rarer).

    Raises:
        TypeError: If `shares` is not a Dataset, or ratios or values are not mappings.
        ValueError: If a state or an archetype is missing or unknown, a value is not positive, an archetype has no
            counted building in an event, or rates are negative, do not have one value per event, or are given for a run
            on stripes.

    Example:
        >>> shares = wd.damage_shares(wd.simulate(region), stock.limits)
        >>> losses = wd.portfolio_losses(shares, wd.hazus_loss_ratios("RES1"), stock.replacement_values(inventory))
        >>> float(losses["loss_ratio"].mean().round(3))
        0.011
    """
    needed = "archetype_damage_share", "counted_buildings"
    check_dataset(_FUNCTION, shares, *needed, advice="give the result of damage_shares(run, limits)", argument="shares")
    check_confidence(confidence)
    names = [str(name) for name in shares["archetype"].values]
    states = [str(state) for state in shares["damage_state"].values if str(state) != NO_DAMAGE]
    ratios = ratios_of_archetypes(_FUNCTION, names, states, loss_ratios)
    values = _checked_values(names, replacement_values)
    share = shares["archetype_damage_share"].sel(damage_state=states)
    along = str(share.dims[1])  # event or motion
    counted = shares["counted_buildings"]
    if not (counted > 0).all():
        archetype, event = (int(place[0]) for place in np.nonzero(~(counted > 0).values)[:2])
        raise ValueError(
            f"{_FUNCTION}: archetype {names[archetype]!r} has no building with a valid result in {along} {event}, "
            f"so its loss is unknown: simulate with a smaller step=, or remove this {along} from shares"
        )

    def by_state(rows: np.ndarray) -> xr.DataArray:
        return xr.DataArray(rows, dims=("archetype", "damage_state"))

    means, variances = (np.stack(part) for part in zip(*((r.mean, r.deviation**2) for r in ratios), strict=True))
    value = xr.DataArray(values, dims="archetype")
    plain = share.drop_vars(list(share.coords))
    of_archetype = (plain * by_state(means)).sum("damage_state")
    loss = of_archetype * value
    total = loss.sum("archetype")
    each_variance = (plain * by_state(variances)).sum("damage_state") / counted.drop_vars(list(counted.coords))
    deviation = (each_variance * value**2).sum("archetype") ** 0.5
    money, unit = MONEY, {"units": "1"}
    result = xr.Dataset(
        {
            "archetype_loss_ratio": of_archetype.assign_attrs(unit, long_name="mean loss ratio of the archetype"),
            "archetype_loss": loss.assign_attrs(money, long_name="loss of the archetype's buildings"),
            "loss": total.assign_attrs(money, long_name="loss of the portfolio"),
            "loss_ratio": (total / values.sum()).assign_attrs(unit, long_name="loss over the portfolio's value"),
            "loss_deviation": deviation.assign_attrs(
                money, long_name="standard deviation of the loss by the scatter of the loss ratios"
            ),
            "replacement_value": value.assign_attrs(money, long_name="value of the archetype's buildings"),
        },
        {name: shares[name] for name in ("archetype", along, "stripe") if name in shares.coords},
        {name: text for name, text in shares.attrs.items() if name in ("title", "history", "seed")},
    )
    if "stripe" in total.dims:
        result = _with_vulnerability(result, shares, along, confidence)
    if event_rates is None:
        return result
    if "stripe" in total.dims:
        raise ValueError(
            f"{_FUNCTION}: event_rates cannot be used for shares of a run on stripes: remove event_rates=, and compute "
            "expected_annual_loss(losses, hazard) with a hazard curve"
        )
    per_event = total.assign_coords({along: shares[along]})
    rates = checked_event_rates(_FUNCTION, per_event, event_rates)
    of_archetypes = (loss * xr.DataArray(rates, dims=along)).sum(along)
    return result.assign(
        archetype_expected_annual_loss=of_archetypes.assign_attrs(
            money, long_name="expected annual loss of the archetype's buildings"
        )
    ).merge(rates_of_losses(per_event, rates, return_periods))


def _with_vulnerability(losses: xr.Dataset, shares: xr.Dataset, along: str, confidence: float) -> xr.Dataset:
    """Return the losses of a run on stripes with the vulnerability function of the portfolio.

    Args:
        losses: `loss_ratio` [1], dimensions `along` and "stripe".
        shares: The damage shares, with the levels of the stripes.
        along: "event" or "motion"; all of them have equal weights in the mean.
        confidence: Probability that the interval covers the true mean [1].
    """
    each = losses["loss_ratio"]
    mean, count = each.mean(along), each.sizes[along]
    variance = each.var(along, ddof=1) if count > 1 else np.nan * mean
    # The buildings are the same in all events, so that only the events are a sample.
    half = (variance / count) ** 0.5 * stdtrit(count - 1, (1 + confidence) / 2)
    half = half.where(each.max(along) > each.min(along))  # equal values, such as 0, do not show how far others are
    of_ratios = ((losses["loss_deviation"] / losses["replacement_value"].sum()) ** 2).mean(along)
    spread = (variance + of_ratios) ** 0.5
    variation = (spread / mean).where(mean > 0)
    functions = {
        "mean_loss_ratio": variable("intensity", mean.values, "mean loss ratio of the portfolio"),
        "mean_loss_ratio_lower": variable(
            "intensity", (mean - half).clip(min=0.0).values, "mean loss ratio, lower bound"
        ),
        "mean_loss_ratio_upper": variable(
            "intensity", (mean + half).clip(max=1.0).values, "mean loss ratio, upper bound"
        ),
        "coefficient_of_variation": variable(
            "intensity", variation.values, "coefficient of variation of the portfolio's loss ratio"
        ),
    }
    level = ("intensity", shares["stripe"].values, shares["stripe"].attrs)
    about = {"confidence": float(confidence), "interval_method": f"t distribution of the mean over the {along}s"}
    return losses.assign(functions).assign_coords(intensity=level).assign_attrs(measure_of_dataset(shares) | about)


def _checked_values(names: Sequence[str], given: Mapping[str, float]) -> np.ndarray:
    if not isinstance(given, Mapping):
        raise TypeError(
            f"{_FUNCTION}: replacement_values must map each archetype to its value, such as {{'houses': 1e6}}, got "
            f"{given!r}"
        )
    check_archetypes(_FUNCTION, names, given, "replacement_values")
    return np.array([real_number(f"replacement value of {name!r}", given[name], above=0) for name in names])
