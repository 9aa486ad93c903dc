"""Fragility curves from the demands of a run: stripe fractions, fitted curves, and their intervals."""

from __future__ import annotations

from collections.abc import Mapping
from typing import Any

import numpy as np
import xarray as xr
from numpy.typing import ArrayLike
from scipy.special import ndtr

from warpdyn.core.checks import check_dataset, one_of, whole_number
from warpdyn.core.messages import warn_caller
from warpdyn.core.units import IN_G
from warpdyn.statistics.demands import DRIFT, DamageLimits, Limit
from warpdyn.statistics.jackknife import SOURCES, LeftOut, fraction_intervals, leave_out, spread_of, trusted
from warpdyn.statistics.lognormal_fit import FIT_MEANINGS, FITTED, check_confidence, levels_to_add, probability
from warpdyn.statistics.stripe_counts import StripeCounts, count_stripes

OVER = ("records and structures", "records")
DISCRETISATION = "discretisation"

_CURVE_POINTS = 401


def fragility(
    dataset: xr.Dataset,
    limits: Mapping[str, Limit],
    *,
    demand: str = DRIFT,
    intervals_over: str = OVER[0],
    replicates: int = 1000,
    confidence: float = 0.95,
    seed: int = 0,
) -> xr.Dataset:
    """Fit a lognormal fragility curve to every damage state of a run on stripes, with intervals.

    A sample exceeds a damage state if its demand is above the state's limit (strictly) at the worst place: the storey
    or floor where it is largest, also if it is a storey of isolators or of a tuned mass damper (take `select_storeys`
    of such a run first). A collapsed sample exceeds every state. Curves maximise the binomial likelihood (Baker 2015,
    Earthquake Spectra 31(1)).

    Intervals cover what was sampled, the records and the structures, by a jackknife over both with Student's t. Where
    each structure runs under one record alone, records tell all. `median_variance` and `dispersion_variance` say where
    the variance comes from.

    The result has the dimension `stripe`, because `im_level` lies along `sample` in the run:
    `run.merge(result, combine_attrs="no_conflicts")` keeps both, with the attributes of both, in one dataset.

    Args:
        dataset: A run on stripes, as `simulate` returned it: a demand over (sample) or (sample, storey) or the like,
            the flag variable `status(sample)`, and the coordinates `motion_index`, `im_level` and `structure` (or
            `building`) of each sample.
        limits: Of each damage state, from the lightest on, the limit of the demand in the units of its variable, such
            as `{"slight": 0.005, "complete": 0.05}`; or limits of several demands, of which the worst decides:
            `{"slight": {"peak_storey_drift_ratio": 0.005, "peak_floor_acceleration": 3.0}}`. A sample that has reached
            a state has reached those before it. A warning names drift limits that seem to be in percent or mm.
        demand: Variable of the run that plain limits are of.
        intervals_over: "records and structures", or "records" to take the structures as given.
        replicates: Number of draws from the joint sampling distribution of all medians and dispersions, which risks and
            losses carry on.
        confidence: Probability that the intervals cover.
        seed: Seed of these draws.

    Returns:
        Fractions by stripe, medians [g, or the unit of the levels], dispersions [1] and curves, each with its interval,
        for the worst place and (named `storey_...`, or after its dimension) for each. A median and a dispersion are NaN
        if the stripes have no fit (see `fit_lognormal`; `fit_status` gives the case); bounds are also NaN where the
        stripes without one of the records have no fit, or there is only one record.

    Raises:
        ValueError: If the dataset lacks a variable, coordinate or status flag, is not on at least two stripes or holds
            an undefined demand of a completed sample; if more than 1 % of the samples diverged or had an unstable
            step; if limits are not positive, finite and increasing; if another argument is out of its range.
        TypeError: If `dataset` is no Dataset.

    Example:
        >>> curves = wd.fragility(run, {"slight": 0.005, "moderate": 0.01})
        >>> floors = wd.fragility(run, {"contents": 3.0}, demand="peak_floor_acceleration")  # m/s2
    """
    check_dataset("fragility", dataset, advice="give what simulate() returned")
    replicates, seed = whole_number("replicates", replicates, 1), whole_number("seed", seed, 0)
    check_confidence(confidence)
    one_of("intervals_over", intervals_over, OVER)
    checked = DamageLimits.of(limits, demand)
    counts = count_stripes(dataset, checked)
    over_structures = intervals_over == OVER[0]
    left, outcome = leave_out(counts, over_structures=over_structures)
    has_interval = trusted(left, outcome)
    _warn(checked, counts, outcome, has_interval)
    variables = _estimates(counts, left, outcome, has_interval, confidence, over_structures)
    curve, intensity = _curves(counts, left, has_interval, confidence)
    variables |= curve
    variables |= _variances(dataset, checked, left, has_interval)
    variables |= _draws(left, has_interval, replicates, seed, counts.units)
    limit = checked.values[0] if checked.single else checked.values
    kept_out = ", ".join(f"{status}: {number}" for status, number in counts.excluded.items())
    variables |= {
        "valid_samples": _variable("stripe", counts.trials, "samples counted, collapsed ones included"),
        "excluded_samples": _variable((), sum(counts.excluded.values()), "samples kept out", comment=kept_out),
        "damage_limit": _variable(
            "damage_state" if checked.single else ("demand", "damage_state"),
            limit,
            f"limit of {checked.single or 'each demand'}",
            units=str(dataset[checked.single].attrs.get("units", "1")) if checked.single else "1",
            demand=checked.single or "several",
        ),
    }
    of_measure = {"units": counts.units} | ({"comment": IN_G} if counts.units == "g" else {})
    coordinates: dict[str, Any] = {
        "damage_state": ("damage_state", np.array(checked.states), {"long_name": "damage state"}),
        "stripe": _variable("stripe", counts.levels, "intensity of the stripe", **of_measure),
        "intensity": _variable("intensity", intensity, "intensity along the curve", **of_measure),
        "source": ("source", np.array([*SOURCES, DISCRETISATION]), {"long_name": "source of variance"}),
    }
    if counts.dim:
        said = dataset[counts.dim].attrs if counts.dim in dataset.coords else {}
        words = {"long_name": f"{counts.dim}, from the ground up", "units": "1"}
        coordinates[counts.dim] = (counts.dim, counts.places, words | said)
    if not checked.single:
        coordinates["demand"] = ("demand", np.array(checked.demands), {"long_name": "variable of the run"})
    units = 1 if not len(left.groups) else len(left.groups)
    return xr.Dataset(
        variables,
        coords=coordinates,
        attrs={
            "intensity_measure": dataset["im_level"]
            .attrs.get("long_name", "intensity measure")
            .removesuffix(" of the scaled motion"),
            "demand": ", ".join(checked.demands),
            "fragility_method": "maximum binomial likelihood of a lognormal curve through stripes (Baker 2015)",
            "interval_method": f"jackknife over {len(left.records)} records"
            + (f" and {units} groups of structures" if units > 1 else "")
            + ", less its bias, with Student's t; stripe fractions: Korn and Graubard (1998)",
            "confidence": float(confidence),
            "replicates_seed": seed,
        },
    )


def _variable(dimensions: str | tuple[str, ...], values: ArrayLike, long_name: str, **attributes: object) -> tuple:
    return dimensions, values, {"long_name": long_name, "units": "1"} | attributes


def _estimates(
    counts: StripeCounts,
    left: LeftOut,
    outcome: np.ndarray,
    has_interval: np.ndarray,
    confidence: float,
    over_structures: bool,
) -> dict[str, tuple]:
    """Return fractions, medians and dispersions with their bounds, of the worst place and of each."""
    with np.errstate(invalid="ignore"):
        fraction = counts.total / counts.trials
    spread = spread_of(left.whole, left.records, left.groups, left.interaction)
    bounds = np.where(has_interval, np.exp(spread.interval(confidence)), np.nan)
    of_measure = {"units": counts.units, "comment": f"{IN_G}; {NO_FIT}" if counts.units == "g" else NO_FIT}
    flags = {"flag_values": np.arange(len(FIT_MEANINGS), dtype=np.int8), "flag_meanings": " ".join(FIT_MEANINGS)}
    median, dispersion = np.exp(left.whole)
    fraction_bounds = fraction_intervals(counts, confidence, over_structures=over_structures)
    rows: dict[str, tuple[np.ndarray, np.ndarray | None, str, dict[str, Any]]] = {
        "exceedance_fraction": (fraction, fraction_bounds, "fraction of samples exceeding", {}),
        "fragility_median": (median, bounds[:, 0], "median capacity", of_measure),
        "fragility_dispersion": (dispersion, bounds[:, 1], "dispersion of the capacity", {"comment": NO_FIT}),
        "fit_status": (outcome, None, "outcome of the lognormal fit", flags),
    }
    variables = {"exceeding_samples": _variable(_OF_STRIPES, counts.total[-1], "samples exceeding, worst place")}
    for name, (values, bound, meaning, attributes) in rows.items():
        dimensions: tuple[str, ...] = _OF_STRIPES[: values.ndim - 1]
        for suffix, part, words in _with_bounds(values, bound, meaning, confidence):
            variables[name + suffix] = _variable(dimensions, part[-1], f"{words}, worst place", **attributes)
            if counts.dim:
                by_place = np.moveaxis(part[:-1], 0, -1)
                variables[f"{counts.dim}_{name}{suffix}"] = _variable(
                    (*dimensions, counts.dim), by_place, words, **attributes
                )
    return variables


NO_FIT = "NaN where the stripes have no lognormal fit"
_OF_STRIPES = ("damage_state", "stripe")


def _with_bounds(
    values: np.ndarray, bounds: np.ndarray | None, meaning: str, confidence: float
) -> list[tuple[str, np.ndarray, str]]:
    """Return name suffix, values and wording of an estimate and, if it has them, of its bounds."""
    parts = [("", values, meaning)]
    for side, bound in zip(("lower", "upper"), () if bounds is None else bounds, strict=bounds is not None):
        parts.append((f"_{side}", bound, f"{meaning}, {side} bound of the {100 * confidence:g} % interval"))
    return parts


def _curves(
    counts: StripeCounts, left: LeftOut, has_interval: np.ndarray, confidence: float
) -> tuple[dict[str, tuple], np.ndarray]:
    """Return the curves of the worst place with their bounds, and their intensities."""
    intensity = counts.levels.max() * np.linspace(0.0, 1.0, _CURVE_POINTS) ** 2  # close together at low levels
    median, dispersion = np.exp(left.whole[:, -1])
    curve = probability(intensity, median[:, None], dispersion[:, None])
    with np.errstate(divide="ignore"):
        logarithm = np.log(intensity[1:])

    def scores(of: np.ndarray) -> np.ndarray:
        return (logarithm - of[..., 0, -1, :, None]) * np.exp(-of[..., 1, -1, :, None])

    slopes = np.stack([-np.exp(-left.whole[1, -1])[:, None] + 0 * logarithm, -scores(left.whole)])
    interaction = (slopes**2 * left.interaction[:, -1, :, None]).sum(axis=0)  # without the covariance, which is small
    spread = spread_of(scores(left.whole), scores(left.records), scores(left.groups), interaction)
    bounds = ndtr(np.where(has_interval[-1, :, None], spread.interval(confidence), np.nan))
    none = np.where(has_interval[-1], 0.0, np.nan)[None, :, None].repeat(2, axis=0)
    bounds = np.concatenate([none, bounds], axis=-1)
    variables = {
        f"fragility_curve{suffix}": _variable(("damage_state", "intensity"), part, words, comment=NO_FIT)
        for suffix, part, words in _with_bounds(curve, bounds, "fragility curve, worst place", confidence)
    }
    return variables, intensity


def _variances(dataset: xr.Dataset, limits: DamageLimits, left: LeftOut, has_interval: np.ndarray) -> dict[str, tuple]:
    """Return the variances of the logarithms of median and dispersion by their source, worst place."""
    spread = spread_of(left.whole, left.records, left.groups, left.interaction)
    by_source = np.where(has_interval, spread.by_source, np.nan)[:, :, -1]
    error = np.full_like(left.whole[:, -1], np.nan)
    if "estimated_relative_error" in dataset and limits.single in dataset["estimated_relative_error"]["demand"].values:
        found = dataset["estimated_relative_error"].sel(demand=limits.single, error_statistic="median")
        error[0] = float(found) ** 2
    by_source = np.concatenate([by_source, error[None]])
    variables = {}
    for number, name in enumerate(("median", "dispersion")):
        of_error = (
            "; discretisation is the square of the median relative error of the demand, by `checked_share`"
            if not number
            else ""
        )
        comment = f"of its logarithm; record and structure: their interaction, and what is neither's{of_error}"
        variables[f"{name}_variance"] = _variable(
            ("damage_state", "source"), by_source[:, number].T, f"variance of the {name} by its source", comment=comment
        )
        variables[f"{name}_variance_if_independent"] = _variable(
            "damage_state",
            left.binomial[number, -1],
            f"variance of the {name} if all samples were independent, which they are not",
            comment="of its logarithm: the binomial likelihood's own",
        )
    return variables


def _draws(left: LeftOut, has_interval: np.ndarray, count: int, seed: int, units: str) -> dict[str, tuple]:
    """Return draws from the joint sampling distribution of the medians and dispersions of the worst place."""
    worst = (slice(None), slice(None), -1)
    spread = spread_of(left.whole[:, -1], left.records[worst], left.groups[worst], left.interaction[:, -1])
    draws = np.exp(np.where(has_interval[-1], spread.draw(count, seed), np.nan))
    said = "draw from the sampling distribution of the"
    of_replicates = ("replicate", "damage_state")
    return {
        "replicate_median": _variable(of_replicates, draws[:, 0], f"{said} median", units=units),
        "replicate_dispersion": _variable(of_replicates, draws[:, 1], f"{said} dispersion"),
    }


def _warn(limits: DamageLimits, counts: StripeCounts, outcome: np.ndarray, has_interval: np.ndarray) -> None:
    """Warn once of curves without a fit or an interval."""
    said, states = [], limits.states
    if np.isfinite(counts.least_drift):
        drifts = zip(states, limits.values[limits.demands.index(DRIFT)], strict=True)
        beyond = [f"{value:g} of {name!r}" for name, value in drifts if value > counts.least_drift]
        if beyond:
            said.append(
                f"the limit {', '.join(beyond)} lies above the drift at which samples collapsed "
                f"({counts.least_drift:.3g}): every collapse counts as exceeding it"
            )
    if len(counts.valid) == 1:
        said.append("the run has one record: there is no variance among records, and no interval")
    for state, name in enumerate(states):
        if outcome[-1, state] != FITTED:
            meaning = FIT_MEANINGS[outcome[-1, state]]
            advice = levels_to_add(counts.levels, counts.total[-1, state], counts.trials)
            said.append(f"damage state {name!r} has no lognormal fit: {meaning}{'; ' if advice else ''}{advice}")
    lacking = (outcome == FITTED) & ~has_interval
    if len(counts.valid) > 1 and lacking.any():
        names = [
            f"{name!r} ({'worst place' if place == len(outcome) - 1 else f'{counts.dim} {counts.places[place]}'})"
            for state, name in enumerate(states)
            for place in np.flatnonzero(lacking[:, state])[::-1]
        ]
        some = ", ".join(names[:3]) + (", ..." if len(names) > 3 else "")
        said.append(
            f"no interval is given of damage state {some}: without one of the records (or structures) it has no "
            "lognormal fit; add records, or levels where some samples exceed it and some do not"
        )
    if said:
        warn_caller("\n- ".join(["fragility:", *said]) if len(said) > 1 else f"fragility: {said[0]}")
