"""Fragility curves from the demands of a run: stripe fractions, fitted curves, and their intervals."""

from __future__ import annotations

from collections.abc import Iterable, Mapping
from typing import Any

import numpy as np
import xarray as xr
from numpy.typing import ArrayLike

from warpdyn.core.checks import check_dataset, real_numbers, whole_number
from warpdyn.core.messages import warn_caller
from warpdyn.core.plausibility import warn_of_implausible_limits
from warpdyn.core.units import IN_G
from warpdyn.statistics.lognormal_fit import (
    FIT_MEANINGS,
    FITTED,
    check_confidence,
    clopper_pearson,
    fit_stripes,
    levels_to_add,
    probability,
)
from warpdyn.statistics.stripe_counts import StripeCounts, count_stripes

LEAST_FITTED_FRACTION = 0.95  # of the bootstrap replicates; with fewer no interval is given

_CURVE_POINTS = 401


def fragility(
    dataset: xr.Dataset,
    limits: Mapping[str, float],
    *,
    bootstrap: int = 1000,
    confidence: float = 0.95,
    seed: int = 0,
) -> xr.Dataset:
    """Fit a lognormal fragility curve to every damage state of a run on stripes, with intervals.

    A sample exceeds a damage state at a storey if its peak drift ratio there is above the limit (strictly), and at
    every storey if it collapsed. The worst storey is that of the largest drift, also if it is a storey of isolators or
    of a tuned mass damper: take `select_storeys` of such a run first. Curves maximise the binomial likelihood
    (Baker 2015, Earthquake Spectra 31(1)). Intervals of curves are percentiles of a bootstrap over records: records
    are drawn with replacement, each with all its samples, since these share the motion.

    The result has the dimension `stripe`, because `im_level` lies along `sample` in the run:
    `run.merge(result, combine_attrs="no_conflicts")` keeps both, with the attributes of both, in one dataset.

    Args:
        dataset: `peak_storey_drift_ratio(sample, storey)`, the flag variable `status(sample)`, and the coordinates
            `motion_index(sample)` and `im_level(sample)` [g], the level of each sample's stripe.
        limits: Storey drift ratio limit [1] of each damage state, from the lightest on; a warning names one that seems
            to be in percent or mm.
        bootstrap: Number of replicates.
        confidence: Probability that the intervals cover.
        seed: Seed of the bootstrap; the same seed gives the same intervals.

    Returns:
        Fractions by stripe with Clopper-Pearson intervals, medians [g], dispersions [1] and curves with bootstrap
        intervals, for the worst storey and (named `storey_...`) for each storey. A median and a dispersion are NaN
        if the stripes have no fit (see `fit_lognormal`; `fit_status` gives the case); bounds are also NaN if fewer than
        95 % of the replicates have a fit or there is only one record.

    Raises:
        ValueError: If the dataset lacks a variable, coordinate or status flag, is not on at least two stripes or holds
            an undefined demand of a completed sample; if more than 1 % of the samples diverged or had an unstable
            step; if limits are not positive, finite and increasing; if bootstrap, confidence or seed is out of range.
        TypeError: If `dataset` is no Dataset.
    """
    check_dataset("fragility", dataset, advice="give what simulate() returned")
    names, limit = _checked_limits(limits)
    warn_of_implausible_limits({f" of {name!r}": value for name, value in zip(names, limit, strict=True)})
    bootstrap = whole_number("bootstrap", bootstrap, 1)
    seed = whole_number("seed", seed, 0)
    check_confidence(confidence)
    counts = count_stripes(dataset, limit)

    # Rows [storey and, last, the worst of them; damage state], stripes last.
    exceeding = np.moveaxis(counts.exceeding.sum(axis=0), 0, -1)
    valid = counts.valid.sum(axis=0)
    median, dispersion, outcome = fit_stripes(counts.levels, exceeding, valid)
    intensity = counts.levels.max() * np.linspace(0.0, 1.0, _CURVE_POINTS) ** 2  # close together at low levels
    curve = probability(intensity, median[-1, :, None], dispersion[-1, :, None])

    replicate_median, replicate_dispersion = _replicates(counts, bootstrap, seed, (median, dispersion))
    fitted = np.isfinite(replicate_median).mean(axis=0) if len(replicate_median) else np.full(median.shape, np.nan)
    trusted = (outcome == FITTED) & (fitted >= LEAST_FITTED_FRACTION)
    _warn(names, counts, outcome, fitted, exceeding[-1], valid, limit)
    replicate_curve = probability(intensity, replicate_median[:, -1, :, None], replicate_dispersion[:, -1, :, None])
    median_bounds = _percentiles(replicate_median, trusted, confidence)
    dispersion_bounds = _percentiles(replicate_dispersion, trusted, confidence)
    curve_bounds = _percentiles(replicate_curve, trusted[-1], confidence)

    with np.errstate(invalid="ignore"):
        fraction = exceeding / valid
    fraction_bounds = clopper_pearson(exceeding, valid, confidence)

    independent = "samples taken as independent; those of one record are not, which the bootstrap intervals respect"
    no_fit = "NaN where the stripes have no lognormal fit"
    flags = {"flag_values": np.arange(len(FIT_MEANINGS), dtype=np.int8), "flag_meanings": " ".join(FIT_MEANINGS)}
    kept_out = ", ".join(f"{status}: {number}" for status, number in counts.excluded.items())
    # Rows as above, with their bounds.
    estimates: dict[str, tuple[np.ndarray, Any, str, dict[str, Any]]] = {
        "exceedance_fraction": (fraction, fraction_bounds, "fraction of samples exceeding", {"comment": independent}),
        "fragility_median": (
            median,
            median_bounds,
            "median capacity",
            {"units": "g", "comment": f"{IN_G}; {no_fit}"},
        ),
        "fragility_dispersion": (dispersion, dispersion_bounds, "dispersion of the capacity", {"comment": no_fit}),
        "fit_status": (outcome, None, "outcome of the lognormal fit", flags),
        "bootstrap_fitted": (fitted, None, "fraction of the bootstrap replicates with a lognormal fit", {}),
    }
    variables = {}
    for name, (values, bounds, meaning, attributes) in estimates.items():
        dimensions = ("damage_state", "stripe")[: values.ndim - 1]
        for suffix, part, words in _with_bounds(values, bounds, meaning, confidence):
            storeys = np.moveaxis(part[:-1], 0, -1)
            variables[name + suffix] = _variable(dimensions, part[-1], f"{words}, worst storey", **attributes)
            variables[f"storey_{name}{suffix}"] = _variable((*dimensions, "storey"), storeys, words, **attributes)
    for suffix, part, words in _with_bounds(curve, curve_bounds, "fragility curve, worst storey", confidence):
        variables[f"fragility_curve{suffix}"] = _variable(("damage_state", "intensity"), part, words, comment=no_fit)
    variables |= {
        "exceeding_samples": _variable(("damage_state", "stripe"), exceeding[-1], "samples exceeding, worst storey"),
        "valid_samples": _variable("stripe", valid, "samples counted, collapsed ones included"),
        "excluded_samples": _variable((), sum(counts.excluded.values()), "samples kept out", comment=kept_out),
        "drift_ratio_limit": _variable("damage_state", limit, "storey drift ratio limit"),
    }
    return xr.Dataset(
        variables,
        coords={
            "damage_state": ("damage_state", np.array(names), {"long_name": "damage state"}),
            "stripe": _variable("stripe", counts.levels, "intensity of the stripe", units="g", comment=IN_G),
            "intensity": _variable("intensity", intensity, "intensity along the curve", units="g", comment=IN_G),
            "storey": _variable("storey", counts.storeys, "storey, from the ground up"),
        },
        attrs={
            "intensity_measure": dataset["im_level"]
            .attrs.get("long_name", "intensity measure")
            .removesuffix(" of the scaled motion"),
            "fragility_method": "maximum binomial likelihood of a lognormal curve through stripes (Baker 2015)",
            "interval_method": "curves: percentiles of a bootstrap over records; stripe fractions: Clopper-Pearson",
            "confidence": float(confidence),
            "bootstrap_replicates": len(replicate_median),
            "bootstrap_seed": seed,
        },
    )


def _variable(dimensions: str | tuple[str, ...], values: ArrayLike, long_name: str, **attributes: object) -> tuple:
    return dimensions, values, {"long_name": long_name, "units": "1"} | attributes


def _with_bounds(
    values: np.ndarray, bounds: Iterable[np.ndarray] | None, meaning: str, confidence: float
) -> list[tuple[str, np.ndarray, str]]:
    """Return name suffix, values and wording of an estimate and, if it has them, of its bounds."""
    parts = [("", values, meaning)]
    for side, bound in zip(("lower", "upper"), () if bounds is None else bounds, strict=bounds is not None):
        parts.append((f"_{side}", bound, f"{meaning}, {side} bound of the {100 * confidence:g} % interval"))
    return parts


def _replicates(
    counts: StripeCounts, bootstrap: int, seed: int, fit: tuple[np.ndarray, np.ndarray]
) -> tuple[np.ndarray, np.ndarray]:
    """Return median and dispersion of the curve of each replicate, shape [replicate, storey + 1, damage_state].

    They are near the fit to all records, which the search starts from.
    """
    records = len(counts.valid)
    if records == 1:  # every replicate would be the data again
        return (np.empty((0, *counts.exceeding.shape[2:])),) * 2
    drawn = np.random.default_rng(seed).integers(records, size=(bootstrap, records))
    # How often each record was drawn; sums over the drawn records are then one matrix product, exact for counts.
    weights = np.zeros((bootstrap, records))
    np.add.at(weights, (np.arange(bootstrap)[:, None], drawn), 1.0)
    exceeding = (weights @ counts.exceeding.reshape(records, -1)).reshape(bootstrap, *counts.exceeding.shape[1:])
    valid = (weights @ counts.valid)[:, None, None, :]
    median, dispersion, _ = fit_stripes(counts.levels, np.moveaxis(exceeding, 1, -1), valid, fit)
    return median, dispersion


def _percentiles(replicates: np.ndarray, trusted: np.ndarray, confidence: float) -> np.ndarray:
    """Return the bounds over the replicates that have a fit, shape [2, ...]; NaN where they are not trusted."""
    bounds = np.full((2, *replicates.shape[1:]), np.nan)
    for row in zip(*np.nonzero(trusted), strict=True):
        values = replicates[(slice(None), *row)]
        values = values[np.isfinite(values).reshape(len(values), -1).all(axis=1)]
        bounds[(slice(None), *row)] = np.quantile(values, [0.5 - 0.5 * confidence, 0.5 + 0.5 * confidence], axis=0)
    return bounds


def _warn(
    names: list[str],
    counts: StripeCounts,
    outcome: np.ndarray,
    fitted: np.ndarray,
    exceeding: np.ndarray,
    valid: np.ndarray,
    limit: np.ndarray,
) -> None:
    """Give one warning of curves without a fit or an interval; the counts are those of the worst storey."""
    told = []
    beyond = [f"{value:g} of {name!r}" for name, value in zip(names, limit, strict=True) if value > counts.least_drift]
    if beyond:
        told.append(
            f"the limit {', '.join(beyond)} lies above the drift at which samples collapsed "
            f"({counts.least_drift:.3g}): every collapse counts as exceeding it"
        )
    if len(counts.valid) == 1:
        told.append("the run has one record: a bootstrap over records has no interval to give")
    for state, name in enumerate(names):
        if outcome[-1, state] != FITTED:
            meaning = FIT_MEANINGS[outcome[-1, state]]
            advice = levels_to_add(counts.levels, exceeding[state], valid)
            told.append(f"damage state {name!r} has no lognormal fit: {meaning}{'; ' if advice else ''}{advice}")
    for state, name in enumerate(names):
        rows = np.flatnonzero((outcome[:, state] == FITTED) & (fitted[:, state] < LEAST_FITTED_FRACTION))
        if rows.size:
            where = ["worst storey" if row == len(outcome) - 1 else f"storey {counts.storeys[row]}" for row in rows]
            told.append(
                f"damage state {name!r}, {', '.join(where)}: only {100 * fitted[rows, state].min():.1f} % of the "
                "bootstrap replicates have a lognormal fit, so no interval is given (at least "
                f"{100 * LEAST_FITTED_FRACTION:g} % must)"
            )
    if told:
        warn_caller("\n- ".join(["fragility:", *told]) if len(told) > 1 else f"fragility: {told[0]}")


def _checked_limits(limits: Mapping[str, float]) -> tuple[list[str], np.ndarray]:
    if not isinstance(limits, Mapping) or not limits:
        given = repr(limits) if isinstance(limits, Mapping | list | tuple | int | float) else type(limits).__name__
        raise ValueError(
            "limits must map at least one damage state to a storey drift ratio, as the dictionary "
            f"{{'slight': 0.005, 'complete': 0.04}}, got {given}"
        )
    names = [str(name) for name in limits]
    values = real_numbers("limits", list(limits.values()))
    if len(set(names)) < len(names):
        raise ValueError(f"two damage states have one name: {names}")
    for name, value in zip(names, values, strict=True):
        if not (np.isfinite(value) and value > 0):
            raise ValueError(f"the limit of damage state {name!r} is {value}; it must be finite and above 0")
    for i in np.flatnonzero(np.diff(values) <= 0):
        raise ValueError(
            f"limits must increase from one damage state to the next, but {names[i]!r} has {values[i]} "
            f"and {names[i + 1]!r} after it {values[i + 1]}"
        )
    return names, values
