"""Annual rates of damage states: fragility curves and a hazard curve put together."""

from __future__ import annotations

import numpy as np
import xarray as xr

from warpdyn.answers.fragility.lognormal_fit import check_confidence
from warpdyn.answers.risk.curves import Curves, curves_of, interval_attributes, warn_of_crossing, warn_of_table_ends
from warpdyn.answers.risk.hazard_curves import Hazard, HazardCurve, HazardLogicTree, branches_of
from warpdyn.foundations.core.checks import real_number
from warpdyn.foundations.core.messages import warn_caller
from warpdyn.foundations.core.near_misses import suggests_names

LEAST_KNOWN_SHARE = 0.95  # of the replicates; with fewer no interval is given
EXTRAPOLATED_SHARE = 0.01  # of an answer from beyond the points of the hazard curve: with more a warning is given


@suggests_names
def annual_rates(curves: xr.Dataset, hazard: Hazard, *, years: float = 50.0, confidence: float = 0.95) -> xr.Dataset:
    """Return the annual rate at which a building reaches each damage state, and the probability in a period.

    The rate is the integral of the fragility curve over the hazard curve, a power law between its points: in closed
    form of lognormal curves, by quadrature of loglogistic ones, of those of demand and collapse and of tables. The
    replicates of the curves and the branches of a logic tree, each replicate with each branch, give the interval;
    the estimate is that of the fitted curves with the mean over the branches. Each state's rate is that of its own
    curve, also where curves cross.

    Args:
        curves: What `fragility`, `fragility_of_cloud`, `fragility_from_capacities` or `fragility_posterior` returned;
            or a dataset of `fragility_median(damage_state)` and `fragility_dispersion(damage_state)`, for an interval
            with `replicate_median` and `replicate_dispersion(replicate, damage_state)`; or a table without an interval,
            `fragility_curve(damage_state, intensity)` or `exceedance_fraction(damage_state, stripe)`, linear between
            its points, 0 below the first (of a table that begins at 0, below the first point of the hazard) and level
            above the last; a warning tells where that decides more than 5 % of a rate.
        hazard: The hazard of the curves' intensity measure.
        years: The period [year], in which occurrences are a Poisson process.
        confidence: Probability that the intervals cover [1].

    Returns:
        `annual_rate(damage_state)` of reaching or exceeding the state [1/year], `return_period` [year],
        `probability_in_period` [1], each with `_lower` and `_upper` (NaN without replicates and branches);
        `branch_annual_rate(branch, damage_state)`, `share_below_hazard` and `share_above_hazard(damage_state)`, the
        shares of the rate that come from beyond the points of the hazard curve, and, with replicates,
        `replicate_annual_rate(replicate, damage_state)`. A warning names states whose shares are above 1 %.

    Raises:
        TypeError: If `curves` is no Dataset or `hazard` no hazard.
        ValueError: If a state has no fit, a rate has no bound, or the hazard is of another unit or intensity measure.

    Example:
        >>> rates = wd.annual_rates(curves, hazard)
        >>> rates["annual_rate"].round(5).values  # 1/year
        array([5.6e-04, 6.0e-05])
        >>> rates["probability_in_period"].round(3).values  # in 50 years
        array([0.028, 0.003])
    """
    tree = branches_of("annual_rates", hazard)
    found = curves_of("annual_rates", curves, tree)
    years = real_number("years", years, above=0)
    check_confidence(confidence)
    warn_of_crossing(
        found, "has the rate of its own curve: annual_losses and estimator='ordinal' have curves that do not cross"
    )
    rate = found.rates(tree)
    mean = tree.weights @ rate
    shares = warned_shares(found, tree, mean)
    sampled = found.sampled_rates(tree)
    bounds = weighted_bounds(sampled, tree.weights, confidence)
    state = "damage_state"
    per_year = {"units": "year-1"}
    variables: dict[str, tuple] = {}
    reaching = "of reaching or exceeding the damage state"
    for suffix, part, words in (
        ("", mean, ""),
        ("_lower", bounds[0], ", lower bound"),
        ("_upper", bounds[1], ", upper bound"),
    ):
        # The longest return period is that of the smallest rate.
        inverse = bounds[1] if suffix == "_lower" else bounds[0] if suffix == "_upper" else mean
        variables[f"annual_rate{suffix}"] = state, part, per_year | {"long_name": f"annual rate {reaching}{words}"}
        variables[f"return_period{suffix}"] = (
            state,
            1 / inverse,
            {"units": "year", "long_name": f"return period {reaching}{words}"},
        )
        variables[f"probability_in_period{suffix}"] = (
            state,
            -np.expm1(-part * years),
            {"units": "1", "long_name": f"probability {reaching} in {years:g} years{words}"},
        )
    variables["branch_annual_rate"] = (
        ("branch", state),
        rate,
        per_year | {"long_name": f"annual rate {reaching} by each branch of the hazard"},
    )
    variables["branch_weight"] = "branch", tree.weights, {"units": "1", "long_name": "weight of the branch"}
    for name, part, where in (("below", shares[0], "the first"), ("above", shares[1], "the last")):
        long_name = f"share of the annual rate from intensities {name} {where} point of the hazard curve"
        variables[f"share_{name}_hazard"] = state, part, {"units": "1", "long_name": long_name}
    if found.replicate_median is not None:
        variables["replicate_annual_rate"] = (
            ("replicate", state),
            np.einsum("rbs,b->rs", sampled, tree.weights),
            per_year | {"long_name": f"annual rate {reaching}, by replicate of the fragility curves"},
        )
    return xr.Dataset(
        variables,
        {state: (state, np.array(found.names), {"long_name": "damage state"})},
        {
            "intensity_measure": tree.measure or found.measure,
            "years": years,
            "rate_method": found.shape.method,
            **interval_attributes(found, len(tree.curves), confidence),
        },
    )


def warned_shares(found: Curves, tree: HazardLogicTree, mean: np.ndarray) -> np.ndarray:
    """Return the shares of rates from beyond the hazard's points, shape [2, state]; warn of those that matter.

    Args:
        found: The curves.
        tree: The hazard.
        mean: Their annual rates, shape [damage_state].
    """
    shares = found.shares_beyond(tree)
    warn_of_extrapolation(found.names, shares, tree.curves, "annual rate")
    warn_of_table_ends("annual rate", found, tree, mean)
    return shares


def weighted_bounds(sampled: np.ndarray, weights: np.ndarray, confidence: float) -> np.ndarray:
    """Return the interval of values over replicates and weighted branches, shape [2, ...]; NaN of a single value.

    Args:
        sampled: Values, shape [replicate, branch, ...]; NaN where a replicate has none.
        weights: Weights of the branches, of sum 1, shape [branch].
        confidence: Probability that the interval covers [1].
    """
    replicates, branches, *rest = sampled.shape
    if replicates * branches < 2:
        return np.full((2, *rest), np.nan)
    values = sampled.reshape(replicates * branches, -1)
    order = np.argsort(values, axis=0)  # NaN stand last
    ordered = np.take_along_axis(values, order, axis=0)
    known = np.isfinite(ordered)
    each = np.where(known, (np.tile(weights, replicates) / replicates)[order], 0.0)
    whole = each.sum(axis=0)
    # Each value stands in the middle of its own weight; between two of them the quantile is interpolated.
    upto = (np.cumsum(each, axis=0) - 0.5 * each) / np.where(whole > 0, whole, 1.0)
    bounds = np.full((2, values.shape[1]), np.nan)
    # With fewer replicates that are known, these would give too narrow an interval.
    for i in np.flatnonzero(whole >= LEAST_KNOWN_SHARE):
        shares = 0.5 - 0.5 * confidence, 0.5 + 0.5 * confidence
        bounds[:, i] = np.interp(shares, upto[known[:, i], i], ordered[known[:, i], i])
    return bounds.reshape(2, *rest)


def warn_of_extrapolation(
    names: tuple[str, ...], shares: np.ndarray, curves: tuple[HazardCurve, ...], what: str
) -> None:
    """Warn of the shares of an answer that come from beyond the points of the hazard.

    Args:
        names: Damage states, or what else the answer is of in words that begin with "the".
        shares: Their shares from below and from above, shape [2, name].
        curves: The branches of the hazard.
        what: The answer.
    """
    units = curves[0].units
    ends = (
        f"below the first point of the hazard curve ({min(each.intensity[0] for each in curves):.3g} {units})",
        f"above the last point of the hazard curve ({max(each.intensity[-1] for each in curves):.3g} {units})",
    )
    for side, row in zip(ends, shares, strict=True):
        told = [
            f"{float(f'{100 * share:.2g}'):g} % of {name if name.startswith('the ') else repr(name)}"
            for name, share in zip(names, row, strict=True)
            if share > EXTRAPOLATED_SHARE
        ]
        if told:
            warn_caller(
                f"{what}: {', '.join(told)} comes from intensities {side}, where it is extrapolated with the slope of "
                "its end; give a curve that goes further"
            )
