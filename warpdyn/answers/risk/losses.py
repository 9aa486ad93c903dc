"""Losses of a building: expected annual loss, loss exceedance curve, and losses of return periods."""

from __future__ import annotations

from collections.abc import Callable, Sequence
from functools import partial

import numpy as np
import xarray as xr
from numpy.typing import ArrayLike

from warpdyn.answers.fragility.curve_variables import variable
from warpdyn.answers.fragility.lognormal_fit import check_confidence
from warpdyn.answers.risk.annual_rates import warned_shares, weighted_bounds
from warpdyn.answers.risk.curves.curve_set import CurveSet, check_hazard
from warpdyn.answers.risk.curves.curve_warnings import CUT_SHARE, warn_of_crossing, warn_of_extrapolated_loss
from warpdyn.answers.risk.hazard_curves import Hazard, HazardLogicTree, branches_of
from warpdyn.answers.risk.integrals.linear import begin_of, loss_of_year
from warpdyn.answers.risk.vulnerability import rates_in_states
from warpdyn.campaigns.reductions.damage.loss_ratios import Ratios, checked_ratios
from warpdyn.foundations.core.checks import check_dataset, finite_numbers, real_number, shortened
from warpdyn.foundations.core.messages import warn_caller
from warpdyn.foundations.core.near_misses import suggests_names
from warpdyn.foundations.core.plausibility import PlausibilityFindings

RETURN_PERIODS: tuple[float, ...] = (10.0, 25.0, 50.0, 100.0, 250.0, 475.0, 1000.0, 2500.0)
_POINTS = 201  # number of points of a loss exceedance curve
_HALVINGS = 30  # number of bisection steps to find a return-period loss, from an interval of 0.5 % of the value
_MONEY = {"units": "1", "comment": "in the unit of replacement_value"}


@suggests_names
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

    The expected annual loss is a sum over the damage states: annual rate of being in the state times mean loss ratio.
    The annual rate at which a loss is exceeded is also a sum: annual rate of being in the state times the probability
    that the loss in this state is larger (beta distribution of the loss ratio; without a coefficient of variation the
    curve has steps). Occurrences are a Poisson process, and the building is repaired after each. Intervals are computed
    as in `annual_rates`. At every intensity, a heavier state is at most as likely as a lighter one: if fitted curves
    cross, the lower probability counts for both, and a warning names them.

    Args:
        curves: Fragility curves, as in `annual_rates`.
        hazard: The hazard, of the same intensity measure as the curves.
        loss_ratios: Loss ratios of the damage states, as in `vulnerability`.
        replacement_value: Value of the building [currency of the losses]; 1 for loss ratios.
        return_periods: Return periods [year], such as 475.
        confidence: Probability that the intervals cover the true value [1].

    Returns:
        `expected_annual_loss` and `deviation_of_annual_loss`, its standard deviation [currency/year];
        `contribution(damage_state)`, the share of each state in the expected loss [1];
        `annual_rate_of_state(damage_state)`, the annual rate of being in exactly this state [1/year];
        `loss_exceedance_rate(loss)` [1/year]; `return_period_loss(return_period)` [currency], the smallest loss that is
        exceeded at most once per return period on average (0 if damage is rarer). Expected losses, exceedance rates and
        return-period losses have bounds `_lower` and `_upper`.

    Raises:
        TypeError, ValueError: As in `annual_rates` and `vulnerability`.

    Example:
        >>> losses = wd.annual_losses(curves, hazard, {"slight": 0.05, "complete": 1.0}, replacement_value=12e6)
        >>> float(losses["expected_annual_loss"].round(-1))
        1030.0
    """
    tree = branches_of("annual_losses", hazard)
    found = CurveSet.from_dataset("annual_losses", curves, tree)
    ratios = checked_ratios("annual_losses", loss_ratios, found.names)
    value = real_number("replacement_value", replacement_value, above=0)
    check_confidence(confidence)
    periods = checked_periods(return_periods)
    warn_of_crossing(found)
    rate = tree.weights @ found.rates(tree, ordered=True)
    warned_shares(found, tree, rate)
    in_state = rates_in_states(rate)
    in_state_sampled = rates_in_states(found.sampled_rates(tree, ordered=True))

    def rate_of_loss(side: int, ratio: float) -> float:
        """Return the annual rate [1/year] at which a loss ratio is exceeded; side 0: estimate, 1 and 2: bounds."""
        exceeding = ratios.exceeding(ratio)
        if side == 0:
            return float(in_state @ exceeding)
        return float(weighted_bounds(in_state_sampled @ exceeding, tree.weights, confidence)[side - 1])

    mean = in_state @ ratios.mean
    mean_bounds = weighted_bounds(in_state_sampled @ ratios.mean, tree.weights, confidence)
    deviation = np.sqrt(in_state @ (ratios.mean**2 + ratios.deviation**2))
    # The grid contains both sides of each step of the curve.
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

    share = in_state * ratios.mean / mean if mean > 0 else np.full(in_state.shape, np.nan)
    of_state = "annual rate of damage of exactly this state"
    variables: dict[str, tuple] = {
        "deviation_of_annual_loss": variable((), value * deviation, "standard deviation of the annual loss", **_MONEY),
        "contribution": variable("damage_state", share, "share of the state in the expected annual loss"),
        "annual_rate_of_state": variable("damage_state", in_state, of_state, units="year-1"),
    }
    exceeded, at_least = (
        "annual rate at which the loss is exceeded",
        "least loss exceeded at most once per return period",
    )
    for side, suffix in enumerate(("", "_lower", "_upper")):
        words = f", {suffix[1:]} bound" if suffix else ""
        loss = mean if side == 0 else mean_bounds[side - 1]
        variables |= {
            f"expected_annual_loss{suffix}": variable((), value * loss, f"expected annual loss{words}", **_MONEY),
            f"loss_exceedance_rate{suffix}": variable("loss", exceedance[side], f"{exceeded}{words}", units="year-1"),
            f"return_period_loss{suffix}": variable(
                "return_period", value * at_periods[side], f"{at_least}{words}", **_MONEY
            ),
        }
    return xr.Dataset(
        variables,
        {
            "loss": variable("loss", value * grid, "loss", **_MONEY),
            "return_period": variable("return_period", periods, "return period", units="year"),
            "damage_state": ("damage_state", np.array(found.names), {"long_name": "damage state"}),
        },
        {
            "intensity_measure": tree.measure or found.measure,
            "replacement_value": value,
            **found.interval_attributes(len(tree.curves), confidence),
        },
    )


def checked_periods(return_periods: ArrayLike, name: str = "return_periods") -> np.ndarray:
    """Return return periods [year] as an array after a check; warn if they seem to be rates.

    Args:
        return_periods: The periods, as the user gave them.
        name: Name of the argument, for messages.
    """
    periods = np.atleast_1d(finite_numbers(name, return_periods))
    if periods.ndim != 1 or not periods.size or np.any(periods <= 0):
        raise ValueError(
            f"{name} must be a row of years above 0, such as [100, 475, 2475], got {shortened(return_periods)}"
        )
    findings = PlausibilityFindings()
    shortest = float(periods.min())
    meant = f" (as a rate, of {1 / shortest:.4g} years)" if shortest < 1 else ""
    findings.add("return_period", periods, f" in {name}{meant}")
    findings.warn()
    return periods


@suggests_names
def expected_annual_loss(vulnerability: xr.Dataset, hazard: Hazard, *, replacement_value: float = 1.0) -> xr.Dataset:
    """Return the expected annual loss of a vulnerability function, for example of storey losses or of another program.

    The expected annual loss is the integral of the mean loss ratio over the hazard curve. It is exact: the mean loss
    ratio is linear between its intensities, and the hazard is a power law between its points. Below the first intensity
    of the function the loss is 0; if the first intensity is 0, the loss is 0 below the first point of the hazard or the
    second intensity of the function, whichever is lower. Above the last intensity, the loss ratio is constant. A
    warning is given if these rules decide more than 5 % of the result, or if more than 1 % of it is from intensities
    beyond the points of the hazard.

    Args:
        vulnerability: `mean_loss_ratio(intensity)` [1], as returned by `vulnerability`, by `storey_losses` and
            `portfolio_losses` for a run on stripes, and by `read_nrml_vulnerability`.
        hazard: The hazard, of the same intensity measure as the function.
        replacement_value: Value of the building or portfolio [currency of the losses]; 1 for loss ratios.

    Returns:
        `expected_annual_loss` [currency/year]; `branch_expected_annual_loss(branch)` for each branch of a logic tree,
        whose weighted mean is the expected annual loss; `share_above_intensities`, the share of the loss from
        intensities above the last one of the function [1].

    Raises:
        TypeError: If `vulnerability` is not a Dataset, or `hazard` is not a HazardCurve or HazardLogicTree.
        ValueError: If the function is missing or has fewer than two increasing intensities, if loss ratios are not
            finite or not from 0 to 1, or if the hazard has another unit or measure.

    Example:
        >>> losses = wd.vulnerability(curves, {"slight": 0.05, "complete": 1.0})
        >>> float(wd.expected_annual_loss(losses, hazard, replacement_value=12e6)["expected_annual_loss"].round(-1))
        1030.0
    """
    name = "expected_annual_loss"
    needed, advice = ("mean_loss_ratio", "intensity"), "give the result of vulnerability()"
    check_dataset(name, vulnerability, *needed, advice=advice, argument="vulnerability")
    tree = branches_of(name, hazard)
    value = real_number("replacement_value", replacement_value, above=0)
    levels = finite_numbers(f"{name}: intensity", vulnerability["intensity"].values)
    mean = finite_numbers(f"{name}: mean_loss_ratio", vulnerability["mean_loss_ratio"].values)
    if levels.size < 2 or mean.shape != levels.shape or np.any(levels < 0) or np.any(np.diff(levels) <= 0):
        raise ValueError(
            f"{name}: the function must have at least 2 increasing intensities, each with a "
            f"loss ratio; the intensities are {shortened(levels)}"
        )
    if np.any((mean < 0) | (mean > 1)):
        raise ValueError(
            f"{name}: mean loss ratios must be from 0 to 1 (2 % is 0.02), got {mean.min():g} to {mean.max():g}"
        )
    units = str(vulnerability["intensity"].attrs.get("units", "g"))
    check_hazard(name, tree, units, str(vulnerability.attrs.get("intensity_measure", "")))
    if levels[0] == 0 and mean[0] > 0:
        raise ValueError(
            f"{name}: the loss ratio at intensity 0 is {mean[0]:g}; it must be 0, because "
            "there is no loss without shaking: correct this value, or begin the function at a higher intensity"
        )
    ratios = np.array([loss_of_year(curve, levels, mean) for curve in tree.curves])
    whole = float(tree.weights @ ratios)
    above = mean[-1] * float(tree.rate_of(levels[-1]))
    if whole > 0:
        _warn_of_ends(tree, levels, mean, units, whole)
    share = above / whole if whole > 0 else np.nan
    by_branch = "expected annual loss by each branch of the hazard"
    return xr.Dataset(
        {
            "expected_annual_loss": variable((), value * whole, "expected annual loss", **_MONEY),
            "branch_expected_annual_loss": variable("branch", value * ratios, by_branch, **_MONEY),
            "share_above_intensities": variable((), share, "share from intensities above the last of the function"),
        },
        attrs={"intensity_measure": tree.measure, "replacement_value": value},
    )


def _warn_of_ends(tree: HazardLogicTree, levels: np.ndarray, mean: np.ndarray, units: str, whole: float) -> None:
    """Warn if a loss function is cut off at its first or last intensity, or if losses beyond the hazard points matter.

    Args:
        tree: The hazard.
        levels: Intensities of the function [units], shape [point].
        mean: Mean loss ratios [1], shape [point].
        units: Units of the intensities.
        whole: Expected annual loss ratio [1/year].
    """
    begins = [begin_of(one, levels) for one in tree.curves]
    at_begin = [np.interp(x, levels, mean) * float(one.rate_of(x)) for x, one in zip(begins, tree.curves, strict=True)]
    begin, first = max(begins), float(tree.weights @ at_begin) / whole
    # Additional loss if the function continued above its last intensity with its last slope in ln(intensity).
    slope = (mean[-1] - mean[-2]) / np.log(levels[-1] / levels[-2]) if levels[-2] > 0 else mean[-1] - mean[-2]
    further = sum(
        w * float(one.rate_of(levels[-1])) / one.slopes[-1] for w, one in zip(tree.weights, tree.curves, strict=True)
    )
    last = min(slope * further, (1 - mean[-1]) * float(tree.rate_of(levels[-1]))) / whole
    found = []
    if first > CUT_SHARE:
        found.append(
            f"it begins at {begin:g} {units} with a loss ratio of {np.interp(begin, levels, mean):.3g}, and lower "
            f"intensities count as free of loss, although this step alone is {100 * first:.0f} % of the expected loss: "
            + (
                "start the function where its loss is near 0"
                if levels[0] > 0
                else "give a hazard curve that begins lower"
            )
        )
    if last > CUT_SHARE:
        found.append(
            f"it ends at {levels[-1]:g} {units}, where it still rises; with the same slope beyond, it would add "
            f"{100 * last:.0f} % to the expected loss: give the function up to higher intensities"
        )
    if found:
        warn_caller("expected_annual_loss: the function is cut off: " + "; ".join(found))
    warn_of_extrapolated_loss("expected_annual_loss", tree, levels, mean, whole)


def _least_loss(rate_of_loss: Callable[[float], float], grid: np.ndarray, rates: np.ndarray, rate: float) -> float:
    """Return the smallest loss ratio [1] whose annual exceedance rate is at most `rate` [1/year], by bisection.

    Args:
        rate_of_loss: Function that returns the exceedance rate of a loss ratio.
        grid: Increasing loss ratios, between which the result is searched.
        rates: Exceedance rates of the grid [1/year].
        rate: The given rate [1/year].
    """
    if np.isnan(rates[0]):
        return np.nan
    first = int(np.argmax(rates <= rate))  # the rate of a loss above 1 is 0
    if first == 0:
        return 0.0
    low, high = grid[first - 1], grid[first]
    for _ in range(_HALVINGS):
        middle = 0.5 * (low + high)
        low, high = (middle, high) if rate_of_loss(middle) > rate else (low, middle)
    return high
