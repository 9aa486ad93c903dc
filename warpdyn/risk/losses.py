"""Losses of a building: vulnerability by intensity, expected annual loss, loss exceedance, return-period losses."""

from __future__ import annotations

from collections.abc import Callable, Sequence
from functools import partial

import numpy as np
import xarray as xr
from numpy.typing import ArrayLike

from warpdyn.core.checks import finite_numbers, real_number
from warpdyn.core.messages import warn_caller
from warpdyn.risk.annual_rates import annual_rates, weighted_bounds
from warpdyn.risk.curves import Curves, curves_of, interval_attributes
from warpdyn.risk.hazard_curves import Hazard, branches_of
from warpdyn.risk.integrals import rates_by_segment
from warpdyn.risk.loss_ratios import Ratios, checked_ratios
from warpdyn.statistics.lognormal_fit import check_confidence, probability

RETURN_PERIODS = (10.0, 25.0, 50.0, 100.0, 250.0, 475.0, 1000.0, 2500.0)
CROSSING = 0.01  # probability by which a heavier state may be likelier than a lighter one, without a warning
_POINTS = 201  # of a loss exceedance curve
_HALVINGS = 30  # of half a per cent of the replacement value, to find a return-period loss


def vulnerability(
    curves: xr.Dataset,
    loss_ratios: Ratios,
    *,
    intensity: ArrayLike | None = None,
    confidence: float = 0.95,
) -> xr.Dataset:
    """Return the mean loss ratio of a building and its coefficient of variation by intensity.

    By the law of total variance over the damage states: the mean is that of the states' means, the variance that of
    the states' variances plus the variance of their means. A heavier state is never likelier than a lighter one: where
    fitted curves cross, the lower probability holds for both.

    Args:
        curves: What `fragility` returned, with replicates for an interval.
        loss_ratios: Of each damage state the mean loss ratio [1], or mean and coefficient of variation, as in
            `hazus_loss_ratios("COM4")` or `{"slight": (0.02, 0.5), "complete": (1.0, 0.0)}`.
        intensity: Intensities [units of the curves], increasing; by default from three dispersions below the lowest
            median to three above the highest.
        confidence: Probability that the interval covers.

    Returns:
        Along `intensity`: `mean_loss_ratio` [1] with `_lower` and `_upper` (NaN without replicates),
        `coefficient_of_variation` of the loss ratio [1] (NaN where the mean is 0), and `probability_of_state(
        damage_state, intensity)` of being in the state [1].

    Raises:
        TypeError, ValueError: If a state has no fit or no loss ratio, ratios are not from 0 to 1 or fall, or a
            coefficient of variation is too large for a beta distribution.

    Example:
        >>> wd.vulnerability(curves, wd.hazus_loss_ratios("RES3"))["mean_loss_ratio"]
    """
    found = curves_of("vulnerability", curves)
    ratios = checked_ratios("vulnerability", loss_ratios, found.names)
    check_confidence(confidence)
    _warn_of_crossing(found)
    if intensity is None:
        ends = (found.median * np.exp(-3 * found.dispersion)).min(), (found.median * np.exp(3 * found.dispersion)).max()
        levels = np.geomspace(*ends, _POINTS)
    else:
        levels = np.atleast_1d(finite_numbers("intensity", intensity))
        if levels.ndim != 1 or np.any(levels < 0) or np.any(np.diff(levels) <= 0):
            raise ValueError("intensity must be a row of increasing intensities, none below 0")
    in_state = _probability_of_states(levels, found.median, found.dispersion)
    mean = in_state @ ratios.mean
    variance = in_state @ (ratios.mean**2 + ratios.deviation**2) - mean**2
    with np.errstate(invalid="ignore", divide="ignore"):
        variation = np.sqrt(np.maximum(variance, 0.0)) / mean
    bounds = np.full((2, levels.size), np.nan)
    if found.replicate_median is not None and found.replicate_dispersion is not None:
        sampled = _probability_of_states(levels, found.replicate_median, found.replicate_dispersion) @ ratios.mean
        bounds = weighted_bounds(sampled[:, None], np.ones(1), confidence)
    unit = {"units": "1"}
    attributes = {"long_name": "mean loss ratio, of the replacement value"} | unit
    variables = {
        "mean_loss_ratio": ("intensity", mean, attributes),
        "mean_loss_ratio_lower": ("intensity", bounds[0], attributes | {"long_name": "mean loss ratio, lower bound"}),
        "mean_loss_ratio_upper": ("intensity", bounds[1], attributes | {"long_name": "mean loss ratio, upper bound"}),
        "coefficient_of_variation": (
            "intensity",
            np.where(mean > 0, variation, np.nan),
            unit | {"long_name": "coefficient of variation of the loss ratio"},
        ),
        "probability_of_state": (
            ("damage_state", "intensity"),
            in_state.T,
            unit | {"long_name": "probability of being in the damage state"},
        ),
        "loss_ratio_of_state": ("damage_state", ratios.mean, unit | {"long_name": "mean loss ratio of the state"}),
        "loss_ratio_deviation_of_state": (
            "damage_state",
            ratios.deviation,
            unit | {"long_name": "standard deviation of the loss ratio of the state"},
        ),
    }
    coordinates = {
        "intensity": ("intensity", levels, {"units": found.units, "long_name": "intensity"}),
        "damage_state": ("damage_state", np.array(found.names), {"long_name": "damage state"}),
    }
    return xr.Dataset(
        variables,
        coordinates,
        {"intensity_measure": found.measure, **interval_attributes(found, 1, confidence)},
    )


def annual_losses(
    curves: xr.Dataset,
    hazard: Hazard,
    loss_ratios: Ratios,
    *,
    replacement_value: float = 1.0,
    return_periods: Sequence[float] = RETURN_PERIODS,
    confidence: float = 0.95,
) -> xr.Dataset:
    """Return the expected annual loss of a building, its loss exceedance curve and the losses of return periods.

    Losses follow from the annual rates of the damage states: the expected loss is the sum of rate times mean ratio of
    each state, and the rate at which a loss is exceeded the sum of rate times probability of exceedance, by the beta
    distribution of the state's ratio. Ratios without a coefficient of variation make a curve of steps. Occurrences are
    a Poisson process, and the building is repaired between them. Intervals are those of `annual_rates`.

    Args:
        curves: What `fragility` returned.
        hazard: The hazard of the curves' intensity measure.
        loss_ratios: As of `vulnerability`.
        replacement_value: Value of the building, in the currency in which losses are wanted; 1 for loss ratios.
        return_periods: Return periods [year], such as 475.
        confidence: Probability that the intervals cover.

    Returns:
        `expected_annual_loss` and `deviation_of_annual_loss` [as the value, a year]; `contribution(damage_state)`, the
        share of each state in the expected loss [1], and `annual_rate_of_state(damage_state)`, of damage that comes to
        this state and no further [1/year]; `loss_exceedance_rate(loss)` [1/year];
        `return_period_loss(return_period)` [as the value], the least loss that is exceeded no more often (0 where
        damage is rarer). Losses, rates and return-period losses with `_lower` and `_upper`.

    Raises:
        TypeError, ValueError: As of `annual_rates` and `vulnerability`.

    Example:
        >>> losses = wd.annual_losses(curves, hazard, wd.hazus_loss_ratios("COM4"), replacement_value=12e6)
        >>> float(losses["expected_annual_loss"])
    """
    tree = branches_of("annual_losses", hazard)
    found = curves_of("annual_losses", curves, tree)
    ratios = checked_ratios("annual_losses", loss_ratios, found.names)
    value = real_number("replacement_value", replacement_value, above=0)
    check_confidence(confidence)
    periods = np.atleast_1d(finite_numbers("return_periods", return_periods))
    if periods.ndim != 1 or np.any(periods <= 0):
        raise ValueError("return_periods must be a row of years above 0")
    _warn_of_crossing(found)
    rates = annual_rates(curves, tree, confidence=confidence)  # warns of what is extrapolated
    sampled = rates["branch_annual_rate"].values[None]
    if found.replicate_median is not None and found.replicate_dispersion is not None:
        each = [
            rates_by_segment(one, found.replicate_median, found.replicate_dispersion).sum(-1) for one in tree.curves
        ]
        sampled = np.stack(each, axis=1)
    in_state = _rates_in_states(rates["annual_rate"].values)
    in_state_sampled = _rates_in_states(sampled)

    def rate_of_loss(side: int, ratio: float) -> float:
        """Return estimate or bound of the rate at which a loss ratio is exceeded."""
        exceeding = ratios.exceeding(ratio)
        if side == 0:
            return float(in_state @ exceeding)
        return float(weighted_bounds(in_state_sampled @ exceeding, tree.weights, confidence)[side - 1])

    mean = in_state @ ratios.mean
    mean_bounds = weighted_bounds(in_state_sampled @ ratios.mean, tree.weights, confidence)
    deviation = np.sqrt(in_state @ (ratios.mean**2 + ratios.deviation**2))
    # Both sides of each step are on the curve.
    grid = np.unique(np.concatenate([np.linspace(0.0, 1.0, _POINTS), ratios.mean, np.nextafter(ratios.mean, 0.0)]))
    grid = grid[grid >= 0]
    exceeding = np.array([ratios.exceeding(ratio) for ratio in grid]).T
    bounds = weighted_bounds(in_state_sampled @ exceeding, tree.weights, confidence)
    exceedance = np.array([in_state @ exceeding, *bounds])
    at_periods = np.array(
        [
            [_least_loss(partial(rate_of_loss, side), grid, exceedance[side], 1 / period) for period in periods]
            for side in range(3)
        ]
    )

    money = {"units": "1", "comment": "in the unit of replacement_value"}
    variables: dict[str, tuple] = {
        "deviation_of_annual_loss": (
            (),
            value * deviation,
            money | {"long_name": "standard deviation of the loss of a year"},
        ),
        "contribution": (
            "damage_state",
            in_state * ratios.mean / mean if mean > 0 else np.full(in_state.shape, np.nan),
            {"units": "1", "long_name": "share of the state in the expected annual loss"},
        ),
        "annual_rate_of_state": (
            "damage_state",
            in_state,
            {"units": "year-1", "long_name": "annual rate of damage that comes to this state and no further"},
        ),
    }
    for side, suffix in enumerate(("", "_lower", "_upper")):
        words = f", {suffix[1:]} bound" if suffix else ""
        loss = mean if side == 0 else mean_bounds[side - 1]
        variables |= {
            f"expected_annual_loss{suffix}": (
                (),
                value * loss,
                money | {"long_name": f"expected loss of a year{words}"},
            ),
            f"loss_exceedance_rate{suffix}": (
                "loss",
                exceedance[side],
                {"units": "year-1", "long_name": f"annual rate at which the loss is exceeded{words}"},
            ),
            f"return_period_loss{suffix}": (
                "return_period",
                value * at_periods[side],
                money | {"long_name": f"least loss that is exceeded at most once in the return period{words}"},
            ),
        }
    return xr.Dataset(
        variables,
        {
            "loss": ("loss", value * grid, money | {"long_name": "loss"}),
            "return_period": ("return_period", periods, {"units": "year", "long_name": "return period"}),
            "damage_state": ("damage_state", np.array(found.names), {"long_name": "damage state"}),
        },
        {
            "intensity_measure": tree.measure or found.measure,
            "replacement_value": value,
            **interval_attributes(found, len(tree.curves), confidence),
        },
    )


def _least_loss(rate_of_loss: Callable[[float], float], grid: np.ndarray, rates: np.ndarray, rate: float) -> float:
    """Return the least loss ratio that is exceeded at most at a rate, by halving between two points of the curve.

    Args:
        rate_of_loss: Rate at which a loss ratio is exceeded.
        grid: Loss ratios of the curve, from 0 to 1.
        rates: Rates at which they are exceeded; NaN without an interval.
        rate: The rate.
    """
    if np.isnan(rates[0]):
        return np.nan
    first = int(np.argmax(rates <= rate))  # no loss is above 1, whose rate is 0
    if first == 0:
        return 0.0
    low, high = grid[first - 1], grid[first]
    for _ in range(_HALVINGS):
        middle = 0.5 * (low + high)
        low, high = (middle, high) if rate_of_loss(middle) > rate else (low, middle)
    return high


def _rates_in_states(exceeding: np.ndarray) -> np.ndarray:
    """Return the rates of damage that comes to each state and no further, of rates of reaching them, states last."""
    # Of curves that cross far out, a heavier state may have the larger rate: it is then that of the lighter one.
    reached = np.minimum.accumulate(exceeding, axis=-1)
    return reached - np.concatenate([reached[..., 1:], np.zeros((*reached.shape[:-1], 1))], axis=-1)


def _probability_of_states(levels: np.ndarray, median: np.ndarray, dispersion: np.ndarray) -> np.ndarray:
    """Return the probability of being in each state, shape [..., intensity, damage_state]."""
    exceeding = probability(levels[:, None], median[..., None, :], dispersion[..., None, :])
    return _rates_in_states(exceeding)


def _warn_of_crossing(found: Curves) -> None:
    """Warn of states whose fitted curves cross where it matters."""
    reach = found.median[:, None] * np.exp(found.dispersion[:, None] * np.linspace(-3, 3, 61))
    levels = np.unique(reach)
    exceeding = probability(levels[:, None], found.median, found.dispersion)
    excess = np.diff(exceeding, axis=1).max(axis=0, initial=0.0)
    for i in np.flatnonzero(excess > CROSSING):
        warn_caller(
            f"the fragility curves of {found.names[i]!r} and {found.names[i + 1]!r} cross: the heavier state is "
            f"likelier by up to {100 * excess[i]:.2g} %, and is taken to be as likely as the lighter one there"
        )
