"""Annual rates of damage states: the integral of fragility curves over a hazard curve."""

from __future__ import annotations

import numpy as np
import xarray as xr

from warpdyn.answers.fragility.curve_variables import variable
from warpdyn.answers.fragility.lognormal_fit import check_confidence
from warpdyn.answers.risk.curves.curve_set import CurveSet
from warpdyn.answers.risk.curves.curve_warnings import warn_of_crossing, warn_of_extrapolation, warn_of_table_ends
from warpdyn.answers.risk.hazard_curves import Hazard, HazardLogicTree, branches_of
from warpdyn.foundations.core.checks import real_number
from warpdyn.foundations.core.near_misses import suggests_names

LEAST_KNOWN_SHARE = 0.95  # an interval is given only if at least this share of the replicates has a known value


@suggests_names
def annual_rates(curves: xr.Dataset, hazard: Hazard, *, years: float = 50.0, confidence: float = 0.95) -> xr.Dataset:
    """Return the annual rate of reaching each damage state, and the probability of reaching it in a period of years.

    The rate is the integral of the fragility curve over the hazard curve, which is a power law between its points. The
    integral is exact for lognormal curves and computed by quadrature for all others. The estimate uses the fitted
    curves and the mean over the branches of a logic tree. The interval is computed from the rates of all replicates
    (draws) of the curves with all branches. Each rate is computed from the state's own curve, even if curves cross.

    Args:
        curves: The result of `fragility`, `fragility_of_cloud`, `fragility_from_capacities` or `fragility_posterior`.
            Or a dataset with `fragility_median(damage_state)` and `fragility_dispersion(damage_state)`; for an
            interval, add `replicate_median` and `replicate_dispersion(replicate, damage_state)`. Or a table without an
            interval, `fragility_curve(damage_state, intensity)` or `exceedance_fraction(damage_state, stripe)`: it is
            linear between its points, constant above the last point, and 0 below the first point. If its first
            intensity is 0, it is 0 below the first point of the hazard or the second intensity of the table, whichever
            is lower. A warning is given if the ends of the table decide more than 5 % of a rate.
        hazard: The hazard, of the same intensity measure as the curves.
        years: The period [year] of `probability_in_period`; occurrences are a Poisson process.
        confidence: Probability that the intervals cover the true value [1].

    Returns:
        `annual_rate(damage_state)` of reaching or exceeding the state [1/year], `return_period` [year] and
        `probability_in_period` [1], each with bounds `_lower` and `_upper` (NaN without replicates and branches);
        `branch_annual_rate(branch, damage_state)` [1/year]; `share_below_hazard` and `share_above_hazard(damage_state)`
        [1], the shares of the rate from intensities below and above the points of the hazard curve (a warning names
        states with more than 1 %); and, with replicates, `replicate_annual_rate(replicate, damage_state)` [1/year].

    Raises:
        TypeError: If `curves` is not a Dataset, or `hazard` is not a HazardCurve or HazardLogicTree.
        ValueError: If a state has no fit, a rate is infinite, or the hazard has another unit or intensity measure.

    Example:
        >>> rates = wd.annual_rates(curves, hazard)
        >>> rates["annual_rate"].round(5).values  # 1/year
        array([5.6e-04, 6.0e-05])
        >>> rates["probability_in_period"].round(3).values  # in 50 years
        array([0.028, 0.003])
    """
    tree = branches_of("annual_rates", hazard)
    found = CurveSet.from_dataset("annual_rates", curves, tree)
    years = real_number("years", years, above=0)
    check_confidence(confidence)
    warn_of_crossing(found, "each rate is that of the state's curve")
    rate = found.rates(tree)
    mean = tree.weights @ rate
    shares = warned_shares(found, tree, mean)
    sampled = found.sampled_rates(tree)
    bounds = weighted_bounds(sampled, tree.weights, confidence)
    state, of_branch = "damage_state", ("branch", "damage_state")
    variables: dict[str, tuple] = {}
    reaching = "of reaching or exceeding the damage state"
    # The longest return period belongs to the smallest rate.
    sides = (("", mean, mean, ""), ("_lower", *bounds, ", lower bound"), ("_upper", *bounds[::-1], ", upper bound"))
    for suffix, part, inverse, words in sides:
        variables |= {
            f"annual_rate{suffix}": variable(state, part, f"annual rate {reaching}{words}", units="year-1"),
            f"return_period{suffix}": variable(state, 1 / inverse, f"return period {reaching}{words}", units="year"),
            f"probability_in_period{suffix}": variable(
                state, -np.expm1(-part * years), f"probability {reaching} in {years:g} years{words}"
            ),
        }
    by_branch = f"annual rate {reaching} by each branch of the hazard"
    variables["branch_annual_rate"] = variable(of_branch, rate, by_branch, units="year-1")
    variables["branch_weight"] = variable("branch", tree.weights, "weight of the branch")
    for name, part, where in (("below", shares[0], "the first"), ("above", shares[1], "the last")):
        long_name = f"share of the annual rate from intensities {name} {where} point of the hazard curve"
        variables[f"share_{name}_hazard"] = variable(state, part, long_name)
    if found.replicate_median is not None:
        by_replicate = f"annual rate {reaching}, by replicate of the fragility curves"
        values = np.einsum("rbs,b->rs", sampled, tree.weights)
        variables["replicate_annual_rate"] = variable(("replicate", state), values, by_replicate, units="year-1")
    return xr.Dataset(
        variables,
        {state: (state, np.array(found.names), {"long_name": "damage state"})},
        {
            "intensity_measure": tree.measure or found.measure,
            "years": years,
            "rate_method": found.limited.method,
            **found.interval_attributes(len(tree.curves), confidence),
        },
    )


def warned_shares(found: CurveSet, tree: HazardLogicTree, mean: np.ndarray) -> np.ndarray:
    """Return the shares of rates from intensities beyond the hazard points, [2, damage_state]; warn if they are large.

    Args:
        found: The fragility curves.
        tree: The hazard.
        mean: Annual rates of the damage states [1/year], shape [damage_state].
    """
    shares = found.shares_beyond(tree)
    warn_of_extrapolation(found.names, shares, tree.curves, "annual rate")
    warn_of_table_ends("annual rate", found, tree, mean)
    return shares


def weighted_bounds(sampled: np.ndarray, weights: np.ndarray, confidence: float) -> np.ndarray:
    """Return the interval of a value over replicates and weighted branches, shape [2, ...]; NaN for a single value.

    Args:
        sampled: Values for each replicate of the curves and each branch, shape [replicate, branch, ...]; NaN if a
            replicate has no value.
        weights: Weights of the branches, whose sum is 1, shape [branch].
        confidence: Probability that the interval covers the true value [1].
    """
    replicates, branches, *rest = sampled.shape
    if replicates * branches < 2:
        return np.full((2, *rest), np.nan)
    values = sampled.reshape(replicates * branches, -1)
    order = np.argsort(values, axis=0)  # NaN are last
    ordered = np.take_along_axis(values, order, axis=0)
    known = np.isfinite(ordered)
    each = np.where(known, (np.tile(weights, replicates) / replicates)[order], 0.0)
    whole = each.sum(axis=0)
    # The cumulative probability of a value is at the middle of its weight; quantiles are interpolated between values.
    upto = (np.cumsum(each, axis=0) - 0.5 * each) / np.where(whole > 0, whole, 1.0)
    bounds = np.full((2, values.shape[1]), np.nan)
    # If fewer values are known, the interval would be too narrow, so it stays NaN.
    for i in np.flatnonzero(whole >= LEAST_KNOWN_SHARE):
        shares = 0.5 - 0.5 * confidence, 0.5 + 0.5 * confidence
        bounds[:, i] = np.interp(shares, upto[known[:, i], i], ordered[known[:, i], i])
    return bounds.reshape(2, *rest)
