"""Lognormal curves fitted to binomial stripe counts by maximum likelihood, for many rows of counts at once."""

from __future__ import annotations

from numbers import Real

import numpy as np
from numpy.typing import ArrayLike
from scipy.special import ndtr, ndtri

from warpdyn.answers.fragility.maximum_likelihood.links import PROBIT, likelihood
from warpdyn.answers.fragility.maximum_likelihood.newton import maximise

FIT_MEANINGS = ("fitted", "no_exceedance", "all_exceeding", "separated", "not_increasing", "no_finite_median")
FITTED, NO_EXCEEDANCE, ALL_EXCEEDING, SEPARATED, NOT_INCREASING, NO_FINITE_MEDIAN = range(len(FIT_MEANINGS))

_BLOCK = 1 << 14  # number of rows fitted at a time, which limits the memory and fits in the cache


def probability(intensity: ArrayLike, median: ArrayLike, dispersion: ArrayLike) -> np.ndarray:
    """Return the probability of exceedance by a lognormal fragility curve; it is 0 at intensity 0.

    Args:
        intensity: Intensity measure, in the unit of the median; 0 or above; of any shape.
        median: Intensity at which the probability of exceedance is 0.5, of a shape that broadcasts with `intensity`.
        dispersion: Standard deviation of ln(capacity) [1], of a shape that broadcasts with `intensity`.
    """
    with np.errstate(divide="ignore"):
        return ndtr((np.log(intensity) - np.log(median)) / dispersion)


def fit_stripes(
    levels: ArrayLike,
    exceeding: ArrayLike,
    total: ArrayLike,
    start: tuple[np.ndarray, np.ndarray] | None = None,
) -> tuple[np.ndarray, np.ndarray, np.ndarray]:
    """Return medians and dispersions of lognormal curves fitted to stripe counts by maximum binomial likelihood.

    Source: Baker (2015), Earthquake Spectra 31(1).

    Median and dispersion are NaN if the likelihood has no maximum at a finite median and positive dispersion:

    - no sample exceeds the state, or every sample exceeds it;
    - the stripes are separated: at most one stripe has both exceeding and other samples; above it all samples exceed
      the state, and below it no sample does (the likelihood increases as the dispersion goes to 0);
    - the counts do not increase with the level: the best slope is zero, negative, or so small that the median is beyond
      the range of floating-point numbers.

    Args:
        levels: Intensity of each stripe, shape [im_level].
        exceeding: Number of samples that exceed the state, shape [..., im_level].
        total: Number of samples, of a shape that broadcasts with `exceeding`; stripes with 0 samples have no effect.
        start: Median and dispersion at which the search starts, of a shape that broadcasts to [...]. If they are NaN or
            None, the search starts from a curve of slope 0. The likelihood has only one maximum; a close start saves
            iterations.

    Returns:
        Median, in the unit of `levels`, dispersion [1], and the outcome as an index into `FIT_MEANINGS`, each of shape
        [...].

    Raises:
        ValueError: If there are fewer than two different levels, a level is not finite and positive, shapes do not
            match, or a count is not finite, is negative or exceeds its total.
    """
    levels = np.asarray(levels, dtype=np.float64)
    if levels.ndim != 1 or np.unique(levels).size < 2:
        raise ValueError(f"levels must be one row of at least 2 distinct intensities, got {levels.tolist()}")
    bad = np.flatnonzero(~(np.isfinite(levels) & (levels > 0)))
    if bad.size:
        raise ValueError(f"levels[{bad[0]}] is {levels[bad[0]]}; every level must be finite and above 0")
    exceeding, total = _checked_counts(exceeding, total)
    if exceeding.ndim == 0 or exceeding.shape[-1] != levels.size:
        raise ValueError(
            "the last dimension of exceeding must be that of the levels, of length "
            f"{levels.size}; got shape {exceeding.shape}"
        )
    leading = exceeding.shape[:-1]
    exceeding = exceeding.reshape(-1, levels.size)
    passing = total.reshape(-1, levels.size) - exceeding

    # Centre and scale the logarithms, so that both parameters have similar sizes and a low correlation.
    logarithm = np.log(levels)
    centre, scale = logarithm.mean(), logarithm.std()
    position = (logarithm - centre) / scale
    outcome = _classify(position, exceeding, passing)
    rows = np.flatnonzero(outcome == FITTED)
    parameters = np.full((outcome.size, 2), np.nan)
    if start is not None:
        first, spread = (np.broadcast_to(values, leading).reshape(-1) for values in start)
        parameters[:, 1] = scale / spread
        parameters[:, 0] = (centre - np.log(first)) / spread
    for begin in range(0, rows.size, _BLOCK):
        block = rows[begin : begin + _BLOCK]
        parameters[block] = _maximise(position, exceeding[block], passing[block], parameters[block])
        lost = block[np.isnan(parameters[block, 0])]  # the start was too far away: try a curve of slope 0
        if start is not None and lost.size:
            parameters[lost] = _maximise(position, exceeding[lost], passing[lost], parameters[lost])
    parameters[outcome != FITTED] = np.nan
    # If the slope is just above zero, the median may be beyond the range of floating-point numbers.
    with np.errstate(all="ignore"):
        median = np.exp(centre - scale * parameters[:, 0] / parameters[:, 1])
        dispersion = scale / parameters[:, 1]
    fitted = np.isfinite(median) & (median >= np.finfo(np.float64).tiny) & np.isfinite(dispersion) & (dispersion > 0)
    outcome[(outcome == FITTED) & ~fitted] = NO_FINITE_MEDIAN
    median[~fitted] = dispersion[~fitted] = np.nan
    return median.reshape(leading), dispersion.reshape(leading), outcome.reshape(leading)


def check_confidence(confidence: float) -> None:
    """Raise a ValueError unless the confidence is a number above 0 and below 1."""
    if not isinstance(confidence, Real) or not 0.0 < confidence < 1.0:
        raise ValueError(f"confidence must be a number between 0 and 1, such as 0.95, got {confidence!r}")


def levels_to_add(levels: np.ndarray, exceeding: np.ndarray, total: np.ndarray, units: str = "g") -> str:
    """Return advice on levels to add for a damage state whose stripes have no lognormal fit, as text for a message.

    At the recommended levels some samples exceed the state and some do not. The text is empty if exceedances do not
    increase with the level, because then more levels do not help.

    Args:
        levels: Intensity of each stripe [units], increasing, shape [stripe].
        exceeding: Number of exceeding samples of each stripe, shape [stripe].
        total: Number of samples of each stripe, shape [stripe].
        units: Units of the levels.
    """
    counted = total > 0
    levels, exceeding, passing = levels[counted], exceeding[counted], (total - exceeding)[counted]
    if not exceeding.any():
        return f"add levels above {levels[-1]:g} {units}, where samples exceed it"
    if not passing.any():
        return f"add levels below {levels[0]:g} {units}, where samples do not exceed it"
    highest_passing, lowest_exceeding = levels[passing > 0][-1], levels[exceeding > 0][0]
    if highest_passing < lowest_exceeding:
        return f"add levels between {highest_passing:g} and {lowest_exceeding:g} {units}, where some samples exceed it"
    if highest_passing > lowest_exceeding:
        return ""
    # At only one level some samples exceed the state and some do not: another level near it determines a slope.
    at = f"{highest_passing:g}"
    below, above = levels[levels < highest_passing], levels[levels > highest_passing]
    near = [f"between {below[-1]:g} and {at} {units}"] if below.size else [f"below {at} {units}"]
    near += [f"between {at} and {above[0]:g} {units}"] if above.size else [f"above {at} {units}"]
    return f"only at {at} {units} some samples exceed it and some do not: add levels {' or '.join(near)}"


def _checked_counts(exceeding: ArrayLike, total: ArrayLike) -> tuple[np.ndarray, np.ndarray]:
    exceeding, total = np.asarray(exceeding, dtype=np.float64), np.asarray(total, dtype=np.float64)
    try:
        exceeding, total = np.broadcast_arrays(exceeding, total)
    except ValueError:
        raise ValueError(
            f"exceeding has shape {exceeding.shape} and total {total.shape}: give one total for all levels, "
            "or one per level"
        ) from None
    bad = ~(np.isfinite(total) & (exceeding >= 0) & (exceeding <= total))
    if bad.any():
        index = tuple(int(i) for i in np.argwhere(bad)[0])
        raise ValueError(
            f"counts at {index}: {exceeding[index]} exceeding of {total[index]}; "
            "counts must be finite and 0 <= exceeding <= total: correct the counts"
        )
    return exceeding, total


def _classify(position: np.ndarray, exceeding: np.ndarray, passing: np.ndarray) -> np.ndarray:
    """Return, for each row of counts, an index into FIT_MEANINGS: FITTED if the likelihood has a finite maximum.

    A finite maximum exists if and only if the levels of exceeding and passing samples overlap (Albert and Anderson
    1984, Biometrika 71). The likelihood is concave, so the best slope is positive if the derivative at slope 0 is
    positive.

    Args:
        position: Centred and scaled logarithm of each level, shape [im_level].
        exceeding: Number of samples that exceed the state, shape [row, im_level].
        passing: Number of samples that do not exceed it, shape [row, im_level].
    """
    lowest_exceeding = np.where(exceeding > 0, position, np.inf).min(axis=1)
    highest_exceeding = np.where(exceeding > 0, position, -np.inf).max(axis=1)
    lowest_passing = np.where(passing > 0, position, np.inf).min(axis=1)
    highest_passing = np.where(passing > 0, position, -np.inf).max(axis=1)

    total = exceeding + passing
    trials = np.maximum(total.sum(axis=1, keepdims=True), 1.0)
    residual = exceeding - total * (exceeding.sum(axis=1, keepdims=True) / trials)
    derivative = residual @ position
    rounding = 1e-12 * trials[:, 0] * np.abs(position).max()

    outcome = np.full(len(exceeding), FITTED, dtype=np.int8)
    outcome[(derivative <= rounding) | (highest_exceeding <= lowest_passing)] = NOT_INCREASING
    outcome[highest_passing <= lowest_exceeding] = SEPARATED
    outcome[~(passing > 0).any(axis=1)] = ALL_EXCEEDING
    outcome[~(exceeding > 0).any(axis=1)] = NO_EXCEEDANCE
    return outcome


def _maximise(position: np.ndarray, exceeding: np.ndarray, passing: np.ndarray, start: np.ndarray) -> np.ndarray:
    """Return intercept and slope of the probit at the maximum likelihood, shape [row, 2]; NaN without convergence.

    The search starts from `start`, or from slope 0 if `start` is not finite. Other arguments: see `_classify`.
    """
    trials = (exceeding + passing).sum(axis=1)
    flat = np.stack([ndtri(exceeding.sum(axis=1) / trials), np.zeros(len(exceeding))], axis=1)
    first = np.where(np.isfinite(start).all(axis=1, keepdims=True), start, flat)
    return maximise(lambda p, row: likelihood(PROBIT, position, p, exceeding[row], passing[row]), first)
