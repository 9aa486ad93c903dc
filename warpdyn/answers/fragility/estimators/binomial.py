"""Fits of lognormal (probit) and loglogistic (logit) curves to stripe counts; penalised if stripes are separated."""

from __future__ import annotations

import numpy as np

from warpdyn.answers.fragility.lognormal_fit import FITTED, NO_FINITE_MEDIAN, SEPARATED, fit_stripes
from warpdyn.answers.fragility.maximum_likelihood.links import (
    LOGIT,
    PROBIT,
    Link,
    gradient_in_line,
    information_in_line,
    likelihood,
)
from warpdyn.answers.fragility.maximum_likelihood.newton import Evaluation, maximise

PENALISED = NO_FINITE_MEDIAN + 1  # outcome: penalised fit; its index follows the outcomes of `fit_stripes`
UNDETERMINED = PENALISED + 1  # outcome: the median is outside the levels, and the data do not determine it


def penalised_likelihood(
    link: Link, position: np.ndarray, parameters: np.ndarray, exceeding: np.ndarray, passing: np.ndarray
) -> Evaluation:
    """Return the logarithm of likelihood times Jeffreys' prior, its gradient, and the expected information.

    The logarithm of the prior (the penalty) is half the logarithm of the determinant of the expected information. The
    sum has a finite maximum for all counts (Firth 1993, Biometrika 80; Kosmidis and Firth 2021, Biometrika 108).
    Arguments and shapes: see `likelihood`.
    """
    score = parameters[:, :1] + parameters[:, 1:] * position
    above, below, density = link.log_cumulative(score), link.log_cumulative(-score), link.log_density(score)
    rise, fall = np.exp(density - above), np.exp(density - below)
    weight = (exceeding + passing) * np.exp(2.0 * density - above - below)
    information = information_in_line(weight, position)
    determinant = np.linalg.det(information)
    with np.errstate(divide="ignore", invalid="ignore"):  # a trial without information is rejected by its value
        value = (exceeding * above + passing * below).sum(axis=1) + 0.5 * np.log(determinant)
        # Leverage of a level: row of the design matrix times inverse information times this row.
        a, b, c = (information[:, i, j, None] for i, j in ((0, 0), (0, 1), (1, 1)))
        leverage = (c - 2.0 * b * position + a * position**2) / determinant[:, None]
        slope = exceeding * rise - passing * fall
        slope += 0.5 * weight * leverage * (2.0 * link.slope(score) - rise + fall)
    return value, gradient_in_line(slope, position), information


def fit_probit(
    levels: np.ndarray, exceeding: np.ndarray, total: np.ndarray, start: tuple[np.ndarray, np.ndarray] | None = None
) -> tuple[np.ndarray, np.ndarray, np.ndarray]:
    """Return medians and dispersions of lognormal curves fitted to stripe counts; penalised if stripes are separated.

    Args:
        levels: Intensity of each stripe, shape [im_level].
        exceeding: Number of samples that exceed the state, shape [..., im_level].
        total: Number of samples, of a shape that broadcasts with `exceeding`.
        start: Median and dispersion at which the search starts; None: no start.

    Returns:
        Median, dispersion [1] and outcome (an index into FIT_MEANINGS), each of shape [...].

    Raises:
        ValueError: As in `fit_stripes`.

    Example:
        >>> median, dispersion, outcome = fit_probit([0.2, 0.4, 0.6, 0.8], [0, 0, 11, 11], 11)
        >>> float(median.round(3)), int(outcome) == PENALISED
        (0.49, True)
    """
    median, dispersion, outcome = fit_stripes(levels, exceeding, total, start)
    return _penalised_where_separated(PROBIT, levels, exceeding, total, median, dispersion, outcome)


def fit_logit(
    levels: np.ndarray, exceeding: np.ndarray, total: np.ndarray, start: tuple[np.ndarray, np.ndarray] | None = None
) -> tuple[np.ndarray, np.ndarray, np.ndarray]:
    """Return medians and dispersions of loglogistic curves fitted to stripe counts; arguments: see `fit_probit`.

    The dispersion is the standard deviation of ln(capacity), which is pi / sqrt(3) divided by the slope of the logit.
    """
    median, dispersion, outcome = (np.atleast_1d(part) for part in fit_stripes(levels, exceeding, total, start))
    position, centre, spread = _positions(levels)
    exceeding, total = np.broadcast_arrays(np.asarray(exceeding, dtype=np.float64), total)
    rows = np.flatnonzero(outcome.ravel() == FITTED)  # probit and logit have a maximum under the same condition
    counted = exceeding.reshape(-1, exceeding.shape[-1])[rows]
    passing = total.reshape(-1, exceeding.shape[-1])[rows] - counted
    slope = LOGIT.deviation * spread / dispersion.ravel()[rows]
    first = np.stack([slope * (centre - np.log(median.ravel()[rows])) / spread, slope], axis=1)
    found = maximise(lambda p, row: likelihood(LOGIT, position, p, counted[row], passing[row]), first)
    _set(median, dispersion, outcome, rows, found, (centre, spread, LOGIT.deviation), FITTED)
    shape = exceeding.shape[:-1]
    parts = median.reshape(shape), dispersion.reshape(shape), outcome.reshape(shape)
    return _penalised_where_separated(LOGIT, levels, exceeding, total, *parts)


def _penalised_where_separated(
    link: Link,
    levels: np.ndarray,
    exceeding: np.ndarray,
    total: np.ndarray,
    median: np.ndarray,
    dispersion: np.ndarray,
    outcome: np.ndarray,
) -> tuple[np.ndarray, np.ndarray, np.ndarray]:
    """Return medians, dispersions and outcomes, in which fits of separated stripes are replaced by penalised fits."""
    shape = outcome.shape
    median, dispersion, outcome = (np.array(part).reshape(-1) for part in (median, dispersion, outcome))
    rows = np.flatnonzero(outcome == SEPARATED)
    if rows.size:
        position, centre, spread = _positions(levels)
        exceeding, total = np.broadcast_arrays(np.asarray(exceeding, dtype=np.float64), total)
        counted = exceeding.reshape(-1, exceeding.shape[-1])[rows]
        passing = total.reshape(-1, exceeding.shape[-1])[rows] - counted
        # Start from a straight line through the fractions; these are moved away from 0 and 1 by half a sample.
        share = (counted + 0.5) / (counted + passing + 1.0)
        score, weight = np.log(share / (1.0 - share)) * link.deviation / LOGIT.deviation, counted + passing
        mean, rise = (weight @ position) / weight.sum(axis=1), (weight * score).sum(axis=1) / weight.sum(axis=1)
        away = position - mean[:, None]
        slope = (weight * away * score).sum(axis=1) / (weight * away**2).sum(axis=1)
        first = np.stack([rise - slope * mean, slope], axis=1)
        found = maximise(lambda p, row: penalised_likelihood(link, position, p, counted[row], passing[row]), first)
        _set(median, dispersion, outcome, rows, found, (centre, spread, link.deviation), PENALISED)
    return median.reshape(shape), dispersion.reshape(shape), outcome.reshape(shape)


def _positions(levels: np.ndarray) -> tuple[np.ndarray, float, float]:
    """Return (ln(levels) - centre) / scale, shape [im_level], and the centre and the scale of ln(levels)."""
    logarithm = np.log(np.asarray(levels, dtype=np.float64))
    centre, spread = float(logarithm.mean()), float(logarithm.std())
    return (logarithm - centre) / spread, centre, spread


def _set(
    median: np.ndarray,
    dispersion: np.ndarray,
    outcome: np.ndarray,
    rows: np.ndarray,
    found: np.ndarray,
    scales: tuple[float, float, float],
    success: int,
) -> None:
    """Convert intercepts and slopes to medians and dispersions; write these and the outcomes to arrays in place.

    Args:
        median, dispersion, outcome: Arrays that are changed.
        rows: Rows of these arrays that are set.
        found: Intercept and slope of each row, shape [row, 2].
        scales: Centre and scale of ln(levels), and standard deviation of the link's distribution.
        success: Outcome of a row with a finite median and dispersion.
    """
    centre, spread, deviation = scales
    with np.errstate(all="ignore"):
        middle, scatter = np.exp(centre - spread * found[:, 0] / found[:, 1]), deviation * spread / found[:, 1]
    good = np.isfinite(middle) & (middle > 0) & np.isfinite(scatter) & (scatter > 0)
    median.reshape(-1)[rows] = np.where(good, middle, np.nan)
    dispersion.reshape(-1)[rows] = np.where(good, scatter, np.nan)
    outcome.reshape(-1)[rows] = np.where(good, success, NO_FINITE_MEDIAN)


def influences_of_cells(
    link: Link,
    levels: np.ndarray,
    exceeding: np.ndarray,
    valid: np.ndarray,
    median: np.ndarray,
    dispersion: np.ndarray,
) -> tuple[np.ndarray, np.ndarray]:
    """Return the first-order contribution of each cell (record, group, level) to ln(median) and ln(dispersion).

    Args:
        link: Probit or logit.
        levels: Intensity of each stripe, shape [im_level].
        exceeding: Number of exceeding samples of each cell, shape [record, group, im_level, row ...].
        valid: Number of samples of each cell, shape [record, group, im_level].
        median: Fitted medians, shape [row ...].
        dispersion: Fitted dispersions [1], shape [row ...].

    Returns:
        The contributions: score of each cell times the inverse of the information of all cells, shape [record, group,
        2, row ...]; and the variances if all samples were independent: diagonal of this inverse, shape [2, row ...].
        NaN without a fit.
    """
    rows = median.shape
    at = (slice(None), *(None,) * len(rows))
    score = link.deviation * (np.log(levels)[at] - np.log(median)) / dispersion
    log_density = link.log_density(score)
    above, below = (np.exp(log_density - link.log_cumulative(side)) for side in (score, -score))
    # Derivatives of the score with respect to ln(median) and ln(dispersion).
    slopes = np.stack([-link.deviation / dispersion + 0.0 * score, -score])
    bend, over = link.slope(score), exceeding.sum(axis=(0, 1))
    under = valid.sum(axis=(0, 1))[at] - over
    weight = over * above * (above - bend) + under * below * (below + bend)
    # At the maximum, second derivatives of the score do not contribute: they multiply a gradient of 0.
    information = np.einsum("al...,bl...,l...->...ab", slopes, slopes, weight)
    determinant = information[..., 0, 0] * information[..., 1, 1] - information[..., 0, 1] ** 2
    with np.errstate(divide="ignore", invalid="ignore"):
        flipped = np.stack(
            [
                np.stack([information[..., 1, 1], -information[..., 0, 1]], axis=-1),
                np.stack([-information[..., 0, 1], information[..., 0, 0]], axis=-1),
            ],
            axis=-2,
        )
        inverse = flipped / determinant[..., None, None]
    factors = np.einsum("...ab,bl...->al...", inverse, slopes)
    # First count all samples as not exceeding, then add the difference for the exceeding samples.
    influences = np.einsum("rgl...,al...->rga...", exceeding.astype(np.float64), factors * (above + below))
    influences -= np.tensordot(valid.astype(np.float64), np.moveaxis(factors * below, 1, 0), axes=1)
    return influences, np.moveaxis(np.diagonal(inverse, axis1=-2, axis2=-1), -1, 0)
