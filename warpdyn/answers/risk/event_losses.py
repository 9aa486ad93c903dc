"""Total loss of many buildings in each event, and its annual rate of exceedance."""

from __future__ import annotations

from collections.abc import Sequence

import numpy as np
import xarray as xr
from numpy.typing import ArrayLike

from warpdyn.answers.fragility.curve_variables import variable
from warpdyn.answers.fragility.reduced_counts import archetype_counts
from warpdyn.answers.risk.losses import RETURN_PERIODS, checked_periods
from warpdyn.foundations.core.checks import check_dataset, finite_numbers
from warpdyn.foundations.core.output_variables import LARGEST_EXCLUDED_FRACTION
from warpdyn.foundations.core.plausibility import PlausibilityFindings

_FUNCTION = "event_losses"
EARTHQUAKE = "earthquake"  # dimension of MotionsAtSites: a building may have several draws of each earthquake
MONEY = {"units": "1", "comment": "in the unit of replacement_values"}


def event_losses(
    counted: xr.Dataset, *, event_rates: ArrayLike | None = None, return_periods: Sequence[float] = RETURN_PERIODS
) -> xr.Dataset:
    """Return the total loss of all buildings in each event, and how often this loss is exceeded.

    Each building counts with its replacement value. If an inventory row represents several buildings, its value is the
    value of all of them.

    Args:
        counted: The result of `simulate` with `statistics=[DamageLoss(..., over="event")]`, or with over="motion" if
            each motion is one event. Each building must have one sample per event. For MotionsAtSites use
            `over="earthquake"`: a building then has one sample in each draw of an earthquake, and the loss is the mean
            over the draws. If several motions are components of one record, give `DamageLoss(events=...)`, so that the
            worse component counts; otherwise each component counts as a draw.
        event_rates: Annual rate of each event [1/year], shape [event], in the order of the losses (earthquakes in the
            order of the design); or a DataArray with the dimension `event` (or `earthquake`), whose labels are matched.
            None: the events are equally likely draws of one earthquake.
        return_periods: Return periods of the loss [year]; used only if `event_rates` is given.

    Returns:
        `loss(event)` [currency]; `loss_deviation(event)` [currency], the standard deviation caused by the scatter of
        the loss ratios, which are independent between buildings (with several draws: of one draw);
        `counted_buildings(event)` and `failed_buildings(event)`; failed buildings are not included in the loss (with
        several draws, both numbers are means over the draws). The dimension is the one given to `over`. If no rates are
        given: `exceedance_probability(event)` [1], the share of events with a larger loss. With rates:
        `expected_annual_loss` [currency/year]; `loss_exceedance_rate(event)` [1/year], the annual rate of losses above
        the loss of the event; and `return_period_loss(return_period)` [currency], the smallest loss of an event that is
        exceeded at most once per return period on average (0 if events are rarer). `plots.loss_exceedance` draws the
        exceedance probability or rate.

    Raises:
        ValueError: If there are no losses by event, events have different numbers of samples, a building has several
            samples in an event, an earthquake has no draw, more than 1 % of an event's samples failed, or rates are
            negative or do not have one value per event.
        TypeError: If `counted` is not a Dataset.

    Example:
        >>> costs = stock.replacement_costs(inventory)
        >>> asked = wd.DamageLoss(stock.limits, wd.hazus_loss_ratios("RES1"), costs, over="motion")
        >>> losses = wd.event_losses(wd.simulate(region, statistics=asked), event_rates=[0.001] * len(motions))
        >>> float(losses["expected_annual_loss"].round())
        406.0
    """
    advice = "give what simulate(..., statistics=[DamageLoss(..., over='event')]) returned"
    check_dataset(_FUNCTION, counted, advice=advice, argument="counted")
    along = next((dim for dim in (EARTHQUAKE, "event", "motion") if f"loss_sum_by_{dim}" in counted), "")
    if not along or counted[f"loss_sum_by_{along}"].dims != (along,):
        raise ValueError(
            f"{_FUNCTION}: the dataset has no losses by event, motion or earthquake alone: {advice}; for "
            f"MotionsAtSites over={EARTHQUAKE!r}"
        )
    buildings, failed = counted[f"counted_count_by_{along}"], counted[f"failed_count_by_{along}"].sum("failure")
    draws = _draws_of_events(counted, along, buildings.values, failed.values)
    loss, buildings, failed = counted[f"loss_sum_by_{along}"] / draws, buildings / draws, failed / draws
    variables = {
        "loss": loss.assign_attrs(MONEY, long_name="loss of all buildings"),
        "loss_deviation": ((counted[f"loss_scatter_variance_by_{along}"] / draws) ** 0.5).assign_attrs(
            MONEY, long_name="standard deviation of the loss by the scatter of the loss ratios"
        ),
        "counted_buildings": buildings.assign_attrs(units="1", long_name="buildings with a loss"),
        "failed_buildings": failed.assign_attrs(units="1", long_name="buildings whose integration failed"),
    }
    about = {name: text for name, text in counted.attrs.items() if name in ("title", "history", "seed")}
    result = xr.Dataset(variables, attrs=about)
    if event_rates is not None:
        rates = checked_event_rates(_FUNCTION, loss, event_rates)
        return result.merge(rates_of_losses(loss, rates, return_periods))
    larger = (loss.values[:, None] < loss.values).mean(axis=1)
    return result.assign(exceedance_probability=variable(along, larger, "share of the events with a larger loss"))


def checked_event_rates(function: str, loss: xr.DataArray, event_rates: ArrayLike) -> np.ndarray:
    """Return the annual rates of events [1/year] in the order of `loss`, after a check; errors: see `event_losses`.

    Args:
        function: Name of the public function, for messages.
        loss: Loss of each event.
        event_rates: Rates from the user: a sequence in the order of the losses, or a DataArray with labels.
    """
    (along,) = map(str, loss.dims)
    if isinstance(event_rates, xr.DataArray) and along in event_rates.coords and event_rates.dims == (along,):
        if not loss.indexes[along].is_unique:
            raise ValueError(
                f"{function}: two {along}s have one name: give event_rates in the order of the {along}s, without names"
            )
        if set(event_rates[along].values.tolist()) != set(loss[along].values.tolist()):
            raise ValueError(
                f"{function}: event_rates have the {along}s {event_rates[along].values.tolist()}, but the losses have "
                f"{loss[along].values.tolist()}: give one rate for each {along} of the losses"
            )
        event_rates = event_rates.sel({along: loss[along].values})  # in the order of the losses
    rates = np.atleast_1d(finite_numbers("event_rates", event_rates))
    if rates.shape != loss.shape or np.any(rates < 0):
        raise ValueError(
            f"{function}: event_rates must have one annual rate of at least 0 for each of the {loss.size} events, got "
            f"{rates}"
        )
    findings = PlausibilityFindings()
    findings.add("event_rate", rates)
    findings.warn()
    return rates


def rates_of_losses(loss: xr.DataArray, rates: np.ndarray, return_periods: Sequence[float]) -> xr.Dataset:
    """Return the expected annual loss, the exceedance rates of the losses and the losses of return periods.

    Args:
        loss: Loss of each event [currency].
        rates: Annual rates of the events [1/year].
        return_periods: Return periods [year].
    """
    (along,) = map(str, loss.dims)
    periods = checked_periods(return_periods)
    values = loss.values
    exceeded = rates @ (values[:, None] > values[None, :])
    ordered = np.sort(np.append(values, 0.0))
    rate_above = rates @ (values[:, None] > ordered[None, :])
    at_periods = [ordered[np.argmax(rate_above <= 1 / period)] for period in periods]
    exceedance = "annual rate of losses above that of the event"
    at_least = "least loss of an event exceeded at most once per return period"
    return xr.Dataset(
        {
            "expected_annual_loss": variable((), rates @ values, "expected annual loss", **MONEY),
            "loss_exceedance_rate": variable(along, exceeded, exceedance, units="year-1"),
            "return_period_loss": variable("return_period", at_periods, at_least, **MONEY),
        },
        {"return_period": variable("return_period", periods, "return period", units="year")},
    )


def _draws_of_events(counted: xr.Dataset, along: str, buildings: np.ndarray, failed: np.ndarray) -> np.ndarray:
    """Return the number of samples of each building in each event, shape [event].

    Args:
        counted: The statistics of the run.
        along: Dimension of the events: "earthquake", "event" or "motion".
        buildings: Number of counted samples in each event.
        failed: Number of failed samples in each event.

    Raises:
        ValueError: If the numbers of samples differ between buildings, or too many samples failed.
    """
    total, counts = buildings + failed, archetype_counts(counted)
    least, most = int(total.min()), int(total.max())
    if along == EARTHQUAKE:
        size = 0 if counts is None else sum(counts.values())
        if not size or not least or np.any(total % size):
            raise ValueError(
                f"{_FUNCTION}: earthquakes have {least:,} to {most:,} samples of {size:,} buildings; each building of "
                "a portfolio must have the same number of draws, and at least one, of each earthquake: correct "
                "earthquake= of MotionsAtSites"
            )
    elif least < most or (counts is not None and most != sum(counts.values())):
        raise ValueError(
            f"{_FUNCTION}: {along}s have {least:,} to {most:,} samples; each building must have one sample in each "
            f"{along}. If several motions belong to one event, give DamageLoss(events=...); run the levels of stripes "
            f"one by one; for MotionsAtSites give DamageLoss(over={EARTHQUAKE!r})"
        )
    many = failed > LARGEST_EXCLUDED_FRACTION * total
    if many.any():
        place = int(many.argmax())
        units = "samples" if along == EARTHQUAKE else "buildings"
        raise ValueError(
            f"{_FUNCTION}: {failed[place]:,} of {total[place]:,} {units} failed in {along} "
            f"{counted[along].values[place].item()!r}; at most {100 * LARGEST_EXCLUDED_FRACTION:g} % may fail: "
            "simulate with a smaller step= or another method="
        )
    return total // size if along == EARTHQUAKE else np.ones_like(total)
