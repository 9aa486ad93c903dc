"""The dataset of fragility curves that are fitted to capacities or to a cloud of demands."""

from __future__ import annotations

from collections.abc import Callable
from typing import Any

import numpy as np
import xarray as xr
from numpy.typing import ArrayLike
from scipy.special import ndtr, ndtri

from warpdyn.answers.fragility.curve_variables import (
    draws,
    fit_flags,
    intensities_along,
    interval_method,
    sandwich,
    variable,
    variances,
    with_bounds,
)
from warpdyn.answers.fragility.intervals.extrapolation import mark, sentences, status_attributes
from warpdyn.answers.fragility.intervals.jackknife import SOURCES, LeftOut, few_groups, spread_of, trusted
from warpdyn.answers.fragility.intervals.observations import Observations
from warpdyn.foundations.core.output_variables import MEDIAN_STATUS
from warpdyn.foundations.core.units import unit_attributes

_LEAST_PROBABILITY = 1e-12  # if the probability is closer to 0 or 1, the bounds are equal to the curve


def dataset_of_curves(
    observed: Observations,
    states: tuple[str, ...],
    left: LeftOut,
    outcome: np.ndarray,
    ends: tuple[ArrayLike, ArrayLike],
    *,
    curves: Callable[[np.ndarray], np.ndarray],
    highest: float,
    units: str,
    confidence: float,
    replicates: int,
    seed: int,
    added: str = "levels",
) -> tuple[xr.Dataset, np.ndarray, list[str]]:
    """Return a dataset with fragility curves, their intervals, variances by source, and draws for later functions.

    Args:
        observed: Record and structure of each observation.
        states: Names of the damage states.
        left: ln(median) and ln(dispersion) of the fit to all observations, and of the fits without each record and
            without each group of structures.
        outcome: Outcome of each fit, an index into FIT_MEANINGS, shape [damage_state].
        ends: Lowest and highest intensity that were run: two numbers, or two arrays of shape [damage_state].
        curves: Function of intensities that returns the probability of exceedance for each row of weights (for
            all observations, and without each record or group), shape [row, damage_state, intensity].
        highest: Highest intensity of the curves.
        units: Units of the intensity.
        confidence: Probability that the intervals cover the true value [1].
        replicates: Number of draws from the sampling distribution of medians and dispersions.
        seed: Seed of the draws.
        added: Words for the addition that a warning advises, "levels" or "motions".

    Returns:
        The dataset; the outcomes, which also mark medians that the data do not determine; sentences for a warning.
    """
    marked = mark(left, outcome, *ends)
    left, outcome, status = marked.left, marked.outcome, marked.status
    known = trusted(left, outcome)
    remarks = few_groups(left, known, states) + sentences(states, status, outcome, marked.fitted, *ends, units, added)
    bounds = np.exp(np.where(known, left.spread.interval(confidence), np.nan))
    median, dispersion = np.exp(left.whole)
    no_fit = "NaN without a fit"
    of_measure = unit_attributes(units, no_fit)
    of_state = "damage_state"
    variables: dict[str, tuple] = {}
    for number, (name, values, attributes) in enumerate(
        (("median", median, of_measure), ("dispersion", dispersion, {"comment": no_fit}))
    ):
        words = f"{name} capacity" if name == "median" else f"{name} of the capacity"
        for suffix, part, text in with_bounds(values, bounds[:, number], words, confidence):
            variables[f"fragility_{name}{suffix}"] = variable(of_state, part, text, **attributes)
    variables |= variances(left, known)
    variables |= draws(left, known, replicates, seed, units, confidence)
    variables["fit_status"] = variable(of_state, outcome.astype(np.int8), "outcome of the fit", **fit_flags())
    text = "position of the median among the intensities that were run"
    variables[MEDIAN_STATUS] = variable(of_state, status, text, **status_attributes())
    intensity = intensities_along(highest)
    curve, between = _curves(observed, left, curves, intensity, confidence)
    curve = np.where(np.isfinite(median)[:, None], curve, np.nan)
    between = np.where(known[:, None], between, np.nan)
    on_curve = (of_state, "intensity")
    for suffix, part, text in with_bounds(curve, between, "fragility curve", confidence):
        variables[f"fragility_curve{suffix}"] = variable(on_curve, part, text, comment=no_fit)
    coordinates: dict[str, Any] = {
        of_state: (of_state, np.array(states), {"long_name": "damage state"}),
        "intensity": variable("intensity", intensity, "intensity along the curve", **of_measure),
        "source": ("source", np.array(SOURCES), {"long_name": "source of variance"}),
    }
    if np.isfinite(left.influences).any() and np.any(left.influences):
        variables |= sandwich(left, outcome)
    of_intervals = {
        "interval_method": interval_method(observed.records, observed.groups, observed.parts),
        "confidence": float(confidence),
        "replicates_seed": seed,
    }
    return xr.Dataset(variables, coordinates, of_intervals), outcome, remarks


def _curves(
    observed: Observations,
    left: LeftOut,
    curves: Callable[[np.ndarray], np.ndarray],
    intensity: np.ndarray,
    confidence: float,
) -> tuple[np.ndarray, np.ndarray]:
    """Return the curves, [damage_state, intensity], and the bounds of their intervals, [2, damage_state, intensity]."""
    probability = curves(intensity)
    curve = probability[0]
    score = ndtri(np.clip(probability, _LEAST_PROBABILITY, 1.0 - _LEAST_PROBABILITY))
    whole, records, groups = observed.split(score)
    with np.errstate(invalid="ignore", divide="ignore"):
        # Derivatives of the score (ln(intensity) - ln(median)) / dispersion of a lognormal curve.
        slopes = np.stack([np.exp(-left.whole[1])[:, None] + 0.0 * whole, whole])
        interaction = (slopes**2 * left.interaction[:, :, None]).sum(axis=0)
        bounds = ndtr(spread_of(whole, records, groups, interaction).interval(confidence))
    certain = (curve < _LEAST_PROBABILITY) | (curve > 1.0 - _LEAST_PROBABILITY)
    return curve, np.where(certain, curve, bounds)
