"""Multiple stripe analysis: fractions of exceeding samples, fitted fragility curves, and their intervals."""

from __future__ import annotations

from collections.abc import Mapping
from typing import Any

import numpy as np
import xarray as xr

from warpdyn.answers.fragility.curve_variables import (
    DISCRETISATION,
    curves,
    discretisation_variance,
    draws,
    estimates,
    interval_method,
    sandwich,
    variable,
    variances,
)
from warpdyn.answers.fragility.estimators.binomial import PENALISED, UNDETERMINED
from warpdyn.answers.fragility.estimators.table import FIT_MEANINGS, estimator_of
from warpdyn.answers.fragility.intervals.extrapolation import mark, sentences
from warpdyn.answers.fragility.intervals.jackknife import SOURCES, RecordNumbers, few_groups, leave_out, trusted
from warpdyn.answers.fragility.lognormal_fit import (
    FITTED,
    NO_EXCEEDANCE,
    SEPARATED,
    check_confidence,
    levels_to_add,
)
from warpdyn.answers.fragility.reduced_counts import is_reduced, labels_of_run, limits_of
from warpdyn.answers.fragility.stripe_counts import StripeCounts, count_stripes
from warpdyn.campaigns.reductions.limits import DRIFT, DamageLimits, Limit
from warpdyn.campaigns.running.selections import without_added_places
from warpdyn.foundations.core.checks import MOST_REPLICATES, check_dataset, one_of, true_or_false, whole_number
from warpdyn.foundations.core.messages import warn_of_all
from warpdyn.foundations.core.near_misses import suggests_names
from warpdyn.foundations.core.output_variables import measure_of_dataset
from warpdyn.foundations.core.units import unit_attributes

OVER = ("records and structures", "records")


@suggests_names
def fragility(
    dataset: xr.Dataset,
    limits: Mapping[str, Limit] | None = None,
    *,
    demand: str = DRIFT,
    estimator: str = "lognormal",
    intervals_over: str = OVER[0],
    added_storeys: bool = False,
    replicates: int = 1000,
    confidence: float = 0.95,
    seed: int = 0,
) -> xr.Dataset:
    """Fit a lognormal fragility curve to every damage state by multiple stripe analysis, with intervals.

    A sample exceeds a damage state if its demand exceeds the state's limit at the worst place, i.e. the storey or floor
    with the largest demand. Storeys of isolators or of a tuned mass damper, and the floors above them, do not count
    unless `added_storeys` is True. A collapsed sample exceeds every state, even if only the isolators failed. The
    curves maximise the binomial likelihood (Baker 2015, Earthquake Spectra 31(1)).

    Intervals include the variability among records and among structures, by a jackknife over both with Student's t; if
    each structure runs under only one record, by a jackknife over records. `median_variance` and `dispersion_variance`
    contain the variance from each source.

    The result has the dimension `stripe` instead of `im_level`, because `im_level` is a coordinate of the samples of
    the run. `run.merge(result, combine_attrs="no_conflicts")` combines run and result in one dataset.

    Args:
        dataset: A run on stripes, as `simulate` returned it. It contains a demand with the dimension (sample), or with
            one more dimension such as (sample, storey), the flag variable `status(sample)`, and for each sample the
            coordinates `motion_index`, `im_level` and `structure` (or `building`). Or a run with the statistics
            DamageCounts over ("motion", "stripe", "structure_group"), from which the curves are the same.
        limits: Limit of each damage state, from the lightest to the heaviest, in the units of the demand, such as
            `{"slight": 0.005, "complete": 0.05}`; or limits of several demands, if exceeding any of them counts:
            `{"slight": {"peak_storey_drift_ratio": 0.005, "peak_floor_acceleration": 3.0}}`. A sample that exceeds a
            state exceeds all lighter ones; only collapse exceeds `math.inf`. A warning names drift limits that seem to
            be in percent or mm. None: use the limits of DamageCounts.
        demand: Name of the demand to which limits that are plain numbers apply. If it has a sign, such as the residual
            drift ratio, its absolute value is compared.
        estimator: "lognormal", "logit" (loglogistic curves) or "ordinal" (lognormal curves with one common dispersion,
            which cannot cross). If stripes are separated (no level at which some samples exceed the state and some do
            not, or only one), the first two penalise the likelihood (Firth 1993), and a warning reports this. The
            interval of the median then consists of two levels: the highest level at which the fraction is surely below
            0.5, and the lowest level at which it is surely above 0.5. The dispersion has no interval, because separated
            stripes do not determine it.
        intervals_over: "records and structures", or "records" for intervals of the given structures.
        added_storeys: Whether storeys of isolators or of a tuned mass damper count as storeys of the building.
        replicates: Number of draws from the joint sampling distribution of all medians and dispersions. The functions
            for rates and losses compute their intervals from these draws.
        confidence: Probability that the intervals cover the true value [1].
        seed: Seed of the draws.

    Returns:
        Fractions by stripe, medians [g, or the unit of the levels], dispersions [1] and curves, each with its interval,
        for the worst storey or floor and for each one (variables `storey_...`, or with the name of another dimension).
        Median and dispersion are NaN if the stripes have no fit (`fit_status` contains the reason), or if the median is
        outside the levels and the data do not determine it. `median_status` marks other medians outside the levels as
        extrapolated, and a warning gives their values. The bounds are also NaN if there is only one record, or if the
        fit fails when one of the records is left out.

    Raises:
        ValueError: If the dataset lacks a variable, coordinate or status flag; if there are fewer than two stripes; if
            a demand of a completed sample is not finite; if more than 1 % of the samples diverged or had an unstable
            step; if limits are not positive and increasing; if another argument is out of its range.
        TypeError: If `dataset` is not a Dataset.

    Example:
        >>> curves = wd.fragility(run, {"slight": 0.005, "complete": 0.015})
        >>> curves["fragility_median"].round(2).values  # g
        array([0.49, 1.24])
        >>> contents = dict(limits={"contents": 3.0}, demand="peak_floor_acceleration")  # m/s2
        >>> wd.fragility(run, **contents, intervals_over="records")["fragility_median"].round(2).values
        array([0.75])
    """
    return curves_of_stripes(
        dataset,
        limits,
        demand=demand,
        estimator=estimator,
        intervals_over=intervals_over,
        added_storeys=added_storeys,
        replicates=replicates,
        confidence=confidence,
        seed=seed,
    )


def curves_of_stripes(
    dataset: xr.Dataset,
    limits: Mapping[str, Limit] | None,
    *,
    demand: str,
    estimator: str,
    intervals_over: str,
    added_storeys: bool,
    replicates: int,
    confidence: float,
    seed: int,
    numbers: RecordNumbers | None = None,
) -> xr.Dataset:
    """Return the result of `fragility`, whose draws can use given random numbers of the records.

    Args:
        dataset, limits, demand, estimator, intervals_over, added_storeys, replicates, confidence, seed: As in
            `fragility`.
        numbers: Random numbers of all records of the dataset, for `replicates` draws. None: from the seed.
    """
    check_dataset("fragility", dataset, advice="give the result of simulate()")
    replicates, seed = whole_number("replicates", replicates, 1, MOST_REPLICATES), whole_number("seed", seed, 0)
    check_confidence(confidence)
    one_of("intervals_over", intervals_over, OVER)
    chosen = estimator_of(estimator)
    if not true_or_false("added_storeys", added_storeys):
        dataset = without_added_places(dataset)
    checked = limits_of(dataset, limits, demand)
    counts = count_stripes(dataset, checked)
    labels = labels_of_run(dataset) if is_reduced(dataset) else dataset
    over_structures = intervals_over == OVER[0]
    left, outcome = leave_out(counts, chosen, over_structures=over_structures)
    ends = float(counts.levels[0]), float(counts.levels[-1])
    marked = mark(left, outcome, *ends)
    left, outcome = marked.left, marked.outcome
    has_interval = trusted(left, outcome)
    remarks = few_groups(left.worst, has_interval[-1], checked.states)
    of_worst = marked.status[-1], outcome[-1], marked.fitted[-1]
    remarks += sentences(checked.states, *of_worst, *ends, counts.units)
    _warn(checked, counts, outcome, has_interval, remarks)
    variables = estimates(counts, left, outcome, marked.status, has_interval, confidence, over_structures)
    curve, intensity = curves(counts, left, has_interval, confidence, chosen.shape)
    variables |= curve
    of_discretisation = discretisation_variance(dataset, checked.single, len(checked.states))
    variables |= variances(left.worst, has_interval[-1], of_discretisation)
    variables |= sandwich(left.worst, outcome[-1])
    variables |= draws(
        left.worst, has_interval[-1], replicates, seed, counts.units, confidence, counts.records, numbers
    )
    kept_out = ", ".join(f"{status}: {number}" for status, number in counts.excluded.items())
    variables |= {
        "valid_samples": variable("stripe", counts.trials, "samples counted, collapsed ones included"),
        "excluded_samples": variable((), sum(counts.excluded.values()), "samples that failed", comment=kept_out),
    }
    if checked.single:
        of_demand = {"units": str(labels[checked.single].attrs.get("units", "1")), "demand": checked.single}
        variables["damage_limit"] = variable(
            "damage_state", checked.values[0], f"limit of {checked.single}", **of_demand
        )
    else:
        words = {"long_name": "limit of each demand, in its demand_units", "demand": "several"}
        variables["damage_limit"] = ("limited_demand", "damage_state"), checked.values, words
    of_measure = unit_attributes(counts.units)
    coordinates: dict[str, Any] = {
        "damage_state": ("damage_state", np.array(checked.states), {"long_name": "damage state"}),
        "stripe": variable("stripe", counts.levels, "intensity of the stripe", **of_measure),
        "intensity": variable("intensity", intensity, "intensity along the curve", **of_measure),
        "source": ("source", np.array([*SOURCES, DISCRETISATION]), {"long_name": "source of variance"}),
    }
    if counts.dim:
        given = labels[counts.dim].attrs if counts.dim in labels.coords else {}
        words = {"long_name": f"{counts.dim}, from the ground up", "units": "1"}
        coordinates[counts.dim] = (counts.dim, counts.places, words | given)
    if not checked.single:
        of_each = [str(labels[name].attrs.get("units", "1")) for name in checked.demands]
        of_limit = "limited_demand"  # a run may have the dimension `demand`
        coordinates[of_limit] = (of_limit, np.array(checked.demands), {"long_name": "variable of the run"})
        coordinates["demand_units"] = (of_limit, np.array(of_each), {"long_name": "units of the variable"})
    return xr.Dataset(
        variables,
        coords=coordinates,
        attrs={
            **measure_of_dataset(labels),
            "demand": ", ".join(checked.demands),
            "fragility_method": chosen.method,
            "fragility_shape": chosen.shape.name,
            "interval_method": interval_method(len(left.records), len(left.groups), strata=counts.strata.max() + 1)
            + "; stripe fractions: Korn and Graubard (1998)",
            "confidence": float(confidence),
            "replicates_seed": seed,
        },
    )


def _warn(
    limits: DamageLimits, counts: StripeCounts, outcome: np.ndarray, has_interval: np.ndarray, remarks: list[str]
) -> None:
    """Warn of limits above the collapse drift ratio and of curves without fit or interval; add the texts `remarks`.

    Args:
        limits: Limits of the damage states.
        counts: Numbers of samples.
        outcome: Outcome of each fit, an index into FIT_MEANINGS, shape [place + 1, damage_state].
        has_interval: Whether each fit has an interval, of the same shape.
        remarks: Further sentences of the warning.
    """
    found, states = [*remarks], limits.states
    if np.isfinite(counts.least_drift):
        drifts = zip(states, limits.values[limits.demands.index(DRIFT)], strict=True)
        beyond = [f"{value:g} of {name!r}" for name, value in drifts if counts.least_drift < value < np.inf]
        if beyond:
            found.append(
                f"limit {', '.join(beyond)} is not below {counts.least_drift:.3g}, the smallest drift ratio at which "
                "a sample collapsed, so every collapse counts as exceeding it: choose a smaller limit or a larger "
                "Scene(collapse_drift_ratio=...)"
            )
    if len(counts.valid) == 1:
        found.append("the run has only one record, so the variance among records is unknown: no intervals. Add records")
    for state, name in enumerate(states):
        if outcome[-1, state] not in (FITTED, UNDETERMINED):
            advice = levels_to_add(counts.levels, counts.total[-1, state], counts.trials, counts.units)
            if np.isinf(limits.values[:, state]).all() and outcome[-1, state] == NO_EXCEEDANCE:
                advice += (
                    ". Only collapse exceeds its infinite limit: give Scene(collapse_drift_ratio=...), or give the "
                    "building a drift_capacity or drift_ratio_capacity"
                )
            what = f" has no lognormal fit: {FIT_MEANINGS[outcome[-1, state]]}"
            if outcome[-1, state] == PENALISED:
                what = (
                    f": its stripes are {FIT_MEANINGS[SEPARATED]}, so the curve is fitted by penalised likelihood. The "
                    "interval of the median is that of the levels around it; the dispersion has no interval"
                )
            found.append(f"damage state {name!r}{what}{'; ' if advice else ''}{advice}")
    lacking = (outcome == FITTED) & ~has_interval
    if len(counts.valid) > 1 and lacking.any():
        names = [
            f"{name!r} ({'worst place' if place == len(outcome) - 1 else f'{counts.dim} {counts.places[place]}'})"
            for state, name in enumerate(states)
            for place in np.flatnonzero(lacking[:, state])[::-1]
        ]
        some = ", ".join(names[:3]) + (", ..." if len(names) > 3 else "")
        found.append(
            f"there is no interval of {some}: if one of the records (or structures) is left out, the curve has no "
            "lognormal fit. Add records, or levels at which some samples exceed the state and some do not"
        )
    warn_of_all("fragility", found)
