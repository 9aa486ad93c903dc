"""Fragility curves from capacities (intensities at which structures first exceed limits, from IDA)."""

from __future__ import annotations

import numpy as np
import xarray as xr

from warpdyn.answers.fragility.curve_dataset import dataset_of_curves
from warpdyn.answers.fragility.curve_variables import variable
from warpdyn.answers.fragility.estimators import LOGNORMAL
from warpdyn.answers.fragility.estimators.binomial import UNDETERMINED
from warpdyn.answers.fragility.estimators.censored import CensoredRegression
from warpdyn.answers.fragility.fragility_curves import OVER
from warpdyn.answers.fragility.intervals.observations import Observations
from warpdyn.answers.fragility.lognormal_fit import (
    ALL_EXCEEDING,
    FIT_MEANINGS,
    FITTED,
    NO_EXCEEDANCE,
    NO_FINITE_MEDIAN,
    SEPARATED,
    check_confidence,
)
from warpdyn.foundations.core.checks import MOST_REPLICATES, check_dataset, one_of, whole_number
from warpdyn.foundations.core.messages import warn_of_all
from warpdyn.foundations.core.near_misses import suggests_names
from warpdyn.foundations.core.output_variables import LARGEST_EXCLUDED_FRACTION, measure_of_dataset

PAIRS = ("structure", "motion")
_ADVICE = "give the result of capacities()"


@suggests_names
def fragility_from_capacities(
    capacities: xr.Dataset,
    *,
    intervals_over: str = OVER[0],
    replicates: int = 1000,
    confidence: float = 0.95,
    seed: int = 0,
) -> xr.Dataset:
    """Fit a lognormal fragility curve to the capacities of every damage state, with intervals.

    For each capacity only bounds are known: it is within its bracket, above the highest level that was run
    (right-censored), or below the lowest level. The curves maximise the likelihood of these bounds. If every capacity
    is known exactly, this is the method of moments: mean and standard deviation of ln(capacity), with divisor n as in
    NumPy's `std` and scipy.stats' `lognorm.fit` (Baker 2015, Earthquake Spectra 31(1), divides by n - 1). Intervals are
    computed as in `fragility`, by a jackknife over records and structures with Student's t.

    Args:
        capacities: `capacity(structure, motion, damage_state)` [g, or the unit of the intensity measure], and its
            bracket `capacity_lower` and `capacity_upper`: the upper bound is infinite if no level exceeds the limit,
            the lower bound is 0 if the lowest level exceeds it, and both are NaN if the search failed. If the dataset
            has no brackets, capacities are exact.
        intervals_over: "records and structures", or "records" for intervals of the given structures.
        replicates: Number of draws from the joint sampling distribution of all medians and dispersions.
        confidence: Probability that the intervals cover the true value [1].
        seed: Seed of the draws.

    Returns:
        Medians [units of the capacities], dispersions [1] and curves, each with its interval, as `fragility` returns
        them; `fit_status`; `censored_capacities`, the number of capacities above the highest level; `median_variance`
        by source; and `median_variance_by_sandwich`, the cluster-robust variance with records as clusters.

    Raises:
        ValueError: If a variable or dimension is missing, a capacity is not positive, a bracket does not contain its
            capacity, more than 1 % of the searches failed, or another argument is out of its range.
        TypeError: If `capacities` is not a Dataset.

    Example:
        >>> found = wd.capacities(scene, {"slight": 0.005, "complete": 0.015}, structures=3)
        >>> curves = wd.fragility_from_capacities(found)
        >>> curves["fragility_median"].round(1).values  # g
        array([0.5, 1.2])
    """
    check_dataset("fragility_from_capacities", capacities, "capacity", advice=_ADVICE, argument="capacities")
    replicates, seed = whole_number("replicates", replicates, 1, MOST_REPLICATES), whole_number("seed", seed, 0)
    check_confidence(confidence)
    one_of("intervals_over", intervals_over, OVER)
    lower, upper = _checked_brackets(capacities)
    motions, states = lower.shape[1:]
    known = ~np.isnan(lower).any(axis=-1).ravel()
    structure, motion = np.divmod(np.arange(known.size), motions)
    sampling = ""
    if "drawn_structure" in capacities.coords:
        sampling = str(capacities["drawn_structure"].attrs.get("sampling", ""))
        structure = capacities["drawn_structure"].transpose(..., "motion").values.ravel()
        _check_pairs(structure, motion)
    observed = Observations(motion[known], structure[known], sampling, intervals_over == OVER[0])
    with np.errstate(divide="ignore"):
        low, high = np.log(lower.reshape(-1, states)[known]), np.log(upper.reshape(-1, states)[known])

    rows, count = len(observed.weights), int(known.sum())
    logarithms, influences = np.full((rows, 2, states), np.nan), np.full((count, 2, states), np.nan)
    independent = np.full((2, states), np.nan)
    outcome = np.array([_outcome(low[:, state], high[:, state]) for state in range(states)])
    for state in np.flatnonzero(outcome == FITTED):
        fitted = CensoredRegression(low[:, state], high[:, state], np.ones((count, 1)))
        centre, deviation = fitted.fit(observed.weights)
        if not np.isfinite(deviation[0]):
            outcome[state] = NO_FINITE_MEDIAN
            continue
        each, alone = fitted.influences(centre[0], float(deviation[0]))
        scale = np.array([1.0, deviation[0]])  # derivative of the dispersion with respect to its logarithm
        influences[:, :, state], independent[:, state] = each / scale, np.diag(alone) / scale**2
        logarithms[:, 0, state], logarithms[:, 1, state] = centre[:, 0], np.log(deviation)
    names = tuple(str(name) for name in capacities["damage_state"].values)
    left = observed.left_out(logarithms, influences, independent)
    attributes = capacities["capacity"].attrs
    units = str(attributes.get("units", "g"))
    medians, dispersions = np.exp(logarithms)[:, 0, :, None], np.exp(logarithms)[:, 1, :, None]
    finite = upper[np.isfinite(upper)]
    lowest, highest = np.exp(_ends(low, high))
    result, outcome, remarks = dataset_of_curves(
        observed,
        names,
        left,
        outcome,
        (lowest, highest),
        curves=lambda intensity: LOGNORMAL.probability(intensity, medians, dispersions),
        highest=float(finite.max()) if finite.size else 1.0,
        units=units,
        confidence=confidence,
        replicates=replicates,
        seed=seed,
    )
    _warn(names, outcome, observed.records, high, remarks)
    censored, failed = np.isposinf(high).sum(axis=0), int((~known).sum())
    words = "capacities above the highest level, right-censored"
    result["censored_capacities"] = variable("damage_state", censored, words)
    result["excluded_pairs"] = variable((), failed, "pairs of a structure and a motion whose search failed")
    return result.assign_attrs(
        measure_of_dataset(capacities)
        | {name: capacities.attrs[name] for name in ("demand",) if name in capacities.attrs}
        | {
            "fragility_method": "maximum likelihood of lognormal capacities, within brackets and right-censored",
            "fragility_shape": LOGNORMAL.name,
        }
    )


def _check_pairs(structure: np.ndarray, motion: np.ndarray) -> None:
    """Raise a ValueError if a pair of a structure and a motion occurs more than once, e.g. after xr.concat."""
    pairs = np.unique(np.column_stack([structure, motion]), axis=0)
    if len(pairs) < structure.size:
        raise ValueError(
            f"fragility_from_capacities: {structure.size - len(pairs)} of {structure.size} pairs of structure and "
            "motion are repeated. xr.concat numbers the structures of several calls alike; use joined = "
            "wd.join([found, other]) instead"
        )


def _checked_brackets(capacities: xr.Dataset) -> tuple[np.ndarray, np.ndarray]:
    """Return lower and upper bounds of the capacities, [structure, motion, damage_state]; NaN: the search failed."""
    name = "fragility_from_capacities"
    given = capacities["capacity"]
    if not {"motion", "damage_state"} <= set(given.dims) <= {*PAIRS, "damage_state"}:
        raise ValueError(
            f"{name}: capacity has dimensions {given.dims}; they must be ('structure', 'motion', "
            "'damage_state'): give the result of capacities()"
        )
    if "damage_state" not in capacities.coords:
        raise ValueError(f"{name}: damage_state has no names; {_ADVICE}")
    if 0 in given.shape:
        raise ValueError(
            f"{name}: the dataset of capacities is empty: its dimensions are {dict(given.sizes)}; {_ADVICE}"
        )
    parts: list[np.ndarray] = []
    for part in ("capacity", "capacity_lower", "capacity_upper"):
        if part not in capacities:
            parts.append(parts[0])  # exact
            continue
        values = capacities[part].transpose(..., "motion", "damage_state").values.astype(np.float64)
        parts.append(values if values.ndim == 3 else values[None])
    capacity, lower, upper = parts
    failed = np.isnan(capacity) & (np.isnan(lower) | np.isnan(upper))
    lower = np.where(failed, np.nan, np.where(np.isnan(lower), 0.0, lower))
    upper = np.where(failed, np.nan, np.where(np.isnan(upper), np.inf, upper))
    bad = ~failed & ~((lower >= 0) & (upper > 0) & (lower <= upper) & np.isfinite(lower))
    if bad.any():
        place = tuple(int(i) for i in np.argwhere(bad)[0])
        hint = (
            "; a capacity that was not reached needs the highest level that was run as capacity_lower"
            if np.isinf(lower[place])
            else ": correct capacity_lower and capacity_upper"
        )
        raise ValueError(
            f"{name}: the capacity of structure {place[0]}, motion {place[1]}, damage state "
            f"{str(capacities['damage_state'].values[place[2]])!r} lies between {lower[place]:g} and {upper[place]:g}; "
            f"brackets must be positive and increase{hint}"
        )
    pairs = failed.any(axis=-1)
    if pairs.sum() > LARGEST_EXCLUDED_FRACTION * pairs.size:
        raise ValueError(
            f"{name}: {pairs.sum()} of {pairs.size} pairs of a structure and a motion have no capacity; at most "
            f"{100 * LARGEST_EXCLUDED_FRACTION:g} % may. Run capacities() with a smaller step= or another method="
        )
    return lower, upper


def _ends(low: np.ndarray, high: np.ndarray) -> np.ndarray:
    """Return ln of the smallest and of the largest finite bound of the capacities, shape [2, damage_state].

    `low` and `high` are ln of the lower and upper bounds, shape [observation, damage_state].
    """
    from_below = np.where(np.isfinite(low), low, np.where(np.isfinite(high), high, np.inf))
    from_above = np.where(np.isfinite(high), high, np.where(np.isfinite(low), low, -np.inf))
    return np.stack([from_below.min(axis=0), from_above.max(axis=0)])


def _outcome(low: np.ndarray, high: np.ndarray) -> int:
    """Return an index into FIT_MEANINGS: FITTED, or the reason why the likelihood of the brackets has no maximum.

    `low` and `high` are ln of the lower and upper bounds of a damage state's capacities, shape [observation].
    """
    if np.isposinf(high).all():
        return NO_EXCEEDANCE
    if np.isneginf(low).all():
        return ALL_EXCEEDING
    return SEPARATED if low.max() <= high.min() else FITTED


def _warn(names: tuple[str, ...], outcome: np.ndarray, records: int, high: np.ndarray, remarks: list[str]) -> None:
    """Warn of damage states without a fit and of a single record; add the sentences `remarks` to the warning."""
    advice = {
        NO_EXCEEDANCE: "no capacity was reached: raise capacities(..., highest=)",
        ALL_EXCEEDING: "every capacity is below the lowest level: run lower levels",
        SEPARATED: "all brackets have a level in common: give a smaller capacities(..., tolerance=), or more motions",
    }
    share = np.isposinf(high).mean(axis=0)
    found = [*remarks]
    for name, each, part in zip(names, outcome, share, strict=True):
        what = advice.get(each, "see its capacities")
        if each == SEPARATED and part > 0.5:
            what = f"{100 * part:.0f} % of the capacities are above the highest level: raise capacities(..., highest=)"
        if each not in (FITTED, UNDETERMINED):
            found.append(f"damage state {name!r} has no fit ({FIT_MEANINGS[each]}); {what}")
    if records == 1:
        found.append("there is only one motion, so there are no intervals over records: give more motions")
    warn_of_all("fragility_from_capacities", found)
