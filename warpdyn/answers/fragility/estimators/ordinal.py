"""Lognormal curves of ordered damage states with one common dispersion, which cannot cross (cumulative probit)."""

from __future__ import annotations

import numpy as np
from scipy.special import log_ndtr, ndtri

from warpdyn.answers.fragility.lognormal_fit import FITTED, NO_FINITE_MEDIAN, NOT_INCREASING, SEPARATED, fit_stripes
from warpdyn.answers.fragility.maximum_likelihood.newton import Evaluation, maximise

_LOG_SQRT_2PI = 0.5 * np.log(2.0 * np.pi)


def fit_ordinal(
    levels: np.ndarray, exceeding: np.ndarray, total: np.ndarray, start: tuple[np.ndarray, np.ndarray] | None = None
) -> tuple[np.ndarray, np.ndarray, np.ndarray]:
    """Return medians and the common dispersion of lognormal curves, fitted by maximum multinomial likelihood.

    The likelihood is that of a cumulative probit with a common slope (McCullagh 1980, Journal of the Royal Statistical
    Society B 42). A damage state has no curve if no sample exceeds it or every sample does; two states that the same
    samples exceed have the same curve.

    Args:
        levels: Intensity of each stripe, shape [im_level].
        exceeding: Number of samples that exceed each state, shape [..., damage_state, im_level], not increasing along
            `damage_state`.
        total: Number of samples, of a shape that broadcasts with `exceeding`; the same for every damage state.
        start: Median and dispersion at which the search starts, shape [..., damage_state]; None: no start.

    Returns:
        Median, dispersion [1] and outcome (an index into FIT_MEANINGS), shape [..., damage_state].

    Raises:
        ValueError: If a damage state has more exceedances than a lighter one, or as in `fit_stripes`.

    Example:
        >>> counts = [[2, 10, 22, 32], [0, 2, 8, 18]]
        >>> median, dispersion, outcome = fit_ordinal([0.2, 0.4, 0.7, 1.0], counts, 40)
        >>> bool(median[0] < median[1]), bool(dispersion[0] == dispersion[1])
        (True, True)
    """
    alone = fit_stripes(levels, exceeding, total)  # checks the counts; its outcome shows which states have no curve
    exceeding, total = np.broadcast_arrays(np.asarray(exceeding, dtype=np.float64), total)
    if exceeding.ndim < 2 or np.any(np.diff(exceeding, axis=-2) > 0):
        raise ValueError(
            "exceeding must have shape [..., damage_state, im_level], and a heavier damage state must not have more "
            "exceedances than a lighter one: sort the states with the lightest first"
        )
    states, stripes = exceeding.shape[-2:]
    counts = exceeding.reshape(-1, states, stripes)
    trials = total.reshape(-1, states, stripes)[:, 0]
    logarithm = np.log(np.asarray(levels, dtype=np.float64))
    centre, spread = logarithm.mean(), logarithm.std()
    position = (logarithm - centre) / spread

    sums = counts.sum(axis=2)
    # If several states are exceeded by the same samples, fit one. Omit states that no sample or every sample exceeds.
    is_first = np.diff(sums, axis=1, prepend=-1.0) != 0
    is_kept = is_first & (sums > 0) & (sums < trials.sum(axis=1, keepdims=True))
    median, dispersion = np.full((2, len(counts), states), np.nan)
    outcome = np.array(alone[2]).reshape(-1, states)
    patterns, pattern_of = np.unique(is_kept, axis=0, return_inverse=True)
    for number, pattern in enumerate(patterns):
        rows = np.flatnonzero(pattern_of.ravel() == number)
        kept = np.flatnonzero(pattern)
        if not kept.size:
            continue
        each = _in_each_state(counts[rows][:, kept], trials[rows])
        first = _start(position, counts[rows][:, kept], trials[rows])
        if start is not None:
            middle, scatter = (np.broadcast_to(part, exceeding.shape[:-1]).reshape(-1, states) for part in start)
            near = np.column_stack([(centre - np.log(middle)) / scatter, spread / scatter[:, 0]])
            near = near[rows][:, [*kept, states]]
            usable = np.isfinite(near).all(axis=1) & (np.diff(near[:, :-1], axis=1) < 0).all(axis=1)
            first = np.where(usable[:, None], near, first)
        found = maximise(lambda p, row, each=each: _likelihood(position, p, each[row]), first)  # type: ignore[misc]
        slope = found[:, -1]
        with np.errstate(all="ignore"):
            middle, scatter = np.exp(centre - spread * found[:, :-1] / slope[:, None]), spread / slope
        good = np.isfinite(middle).all(axis=1) & (slope > 0)
        missing = np.full(good.shape, NO_FINITE_MEDIAN)
        missing[slope <= 0] = NOT_INCREASING
        missing[(outcome[rows][:, kept] == SEPARATED).all(axis=1)] = SEPARATED
        # States that are exceeded by the same samples get the same curve.
        source = np.maximum.accumulate(np.where(pattern, np.arange(states), -1))
        for state in np.flatnonzero(source >= 0):
            of = int(np.searchsorted(kept, source[state]))
            same = rows[sums[rows, state] == sums[rows, source[state]]]
            at = np.searchsorted(rows, same)
            median[same, state] = np.where(good[at], middle[at, of], np.nan)
            dispersion[same, state] = np.where(good[at], scatter[at], np.nan)
            outcome[same, state] = np.where(good[at], FITTED, missing[at])
    shape = exceeding.shape[:-1]
    return median.reshape(shape), dispersion.reshape(shape), outcome.reshape(shape)


def influences_of_cells(
    levels: np.ndarray, exceeding: np.ndarray, valid: np.ndarray, median: np.ndarray, dispersion: np.ndarray
) -> tuple[np.ndarray, np.ndarray]:
    """Return the first-order contribution of each cell (record, group, level) to ln(median) and ln(dispersion).

    Args:
        levels: Intensity of each stripe, shape [im_level].
        exceeding: Number of exceeding samples of each cell, shape [record, group, im_level, ..., damage_state].
        valid: Number of samples of each cell, shape [record, group, im_level].
        median: Medians from `fit_ordinal` for the sums over all cells, shape [..., damage_state].
        dispersion: Dispersions [1] from `fit_ordinal`, shape [..., damage_state].

    Returns:
        The contributions, shape [record, group, 2, ..., damage_state], and the variances if all samples were
        independent, shape [2, ..., damage_state]; NaN without a fit.
    """
    cells, states = exceeding.shape[:2], exceeding.shape[-1]
    position = np.log(np.asarray(levels, dtype=np.float64))
    counts = exceeding.reshape(*cells, position.size, -1, states)
    middle, scatter = (np.reshape(part, (-1, states)) for part in (median, dispersion))
    influences = np.full((*cells, 2, *middle.shape), np.nan)
    independent = np.full((2, *middle.shape), np.nan)
    for row in range(len(middle)):
        fitted = np.flatnonzero(np.isfinite(middle[row]))
        kept = fitted[np.diff(middle[row, fitted], prepend=-1.0) > 0]
        if not kept.size:
            continue
        slope = 1.0 / scatter[row, kept[0]]
        parameters = np.append(-slope * np.log(middle[row, kept]), slope)[None]
        in_states = _in_each_state(
            np.moveaxis(counts[:, :, :, row, kept], -1, -2).reshape(-1, kept.size, position.size),
            np.broadcast_to(valid, (*cells, position.size)).reshape(-1, position.size),
        )
        each = _gradients(position, parameters, in_states)
        _, _, information = _likelihood(position, parameters, in_states.sum(axis=0)[None])
        inverse = np.linalg.pinv(information[0], hermitian=True)
        for state in fitted:
            of = int(np.searchsorted(middle[row, kept], middle[row, state]))
            change = np.zeros(
                (2, kept.size + 1)
            )  # derivatives of ln(median) and ln(dispersion) with respect to parameters
            change[0, of], change[0, -1], change[1, -1] = -1.0, -np.log(middle[row, state]), -1.0
            change /= slope
            influences[:, :, :, row, state] = (each @ (change @ inverse).T).reshape(*cells, 2)
            independent[:, row, state] = np.diag(change @ inverse @ change.T)
    shape = np.shape(median)
    return influences.reshape(*cells, 2, *shape), independent.reshape(2, *shape)


def _in_each_state(exceeding: np.ndarray, trials: np.ndarray) -> np.ndarray:
    """Return the number of samples in exactly each damage state, no damage first, [row, damage_state + 1, im_level].

    Args:
        exceeding: Number of samples that exceed each state, shape [row, damage_state, im_level].
        trials: Number of samples, shape [row, im_level].
    """
    with_all = np.concatenate([trials[:, None], exceeding, np.zeros_like(trials[:, None])], axis=1)
    return -np.diff(with_all, axis=1)


def _start(position: np.ndarray, exceeding: np.ndarray, trials: np.ndarray) -> np.ndarray:
    """Return start parameters: slope 0, and intercepts that give the overall fraction of each state at every level.

    The shape is [row, damage_state + 1]; the slope is last. `exceeding` and `trials`: see `_in_each_state`.
    """
    share = exceeding.sum(axis=2) / trials.sum(axis=1, keepdims=True)
    return np.column_stack([ndtri(share), np.zeros(len(share))])


def _likelihood(position: np.ndarray, parameters: np.ndarray, counts: np.ndarray) -> Evaluation:
    """Return log-likelihood, gradient and negative second derivatives with respect to all intercepts and the slope.

    Args:
        position: Logarithm of each level, shape [im_level].
        parameters: Intercepts of the states, from the lightest to the heaviest, and slope, shape [row, damage_state +
            1].
        counts: Number of samples in each state, no damage first, shape [row, damage_state + 1, im_level].
    """
    rows, states = parameters.shape[0], parameters.shape[1] - 1
    score = parameters[:, :-1, None] + parameters[:, -1:, None] * position
    log_share, above, below = _densities(position, parameters, counts)
    value = np.where(counts > 0, counts * log_share, 0.0).sum(axis=(1, 2))
    value[~(np.diff(parameters[:, :-1], axis=1) < 0).all(axis=1)] = -np.inf  # curves that cross are not allowed
    slope = counts[:, 1:] * above - counts[:, :-1] * below
    own = score * slope + counts[:, 1:] * above**2 + counts[:, :-1] * below**2
    between = -counts[:, 1:-1] * above[:, :-1] * below[:, 1:]
    gradient = np.column_stack([slope.sum(axis=2), (slope @ position).sum(axis=1)])
    information = np.zeros((rows, states + 1, states + 1))
    place, across = np.arange(states), own.copy()
    across[:, :-1] += between
    across[:, 1:] += between
    information[:, place, place] = own.sum(axis=2)
    information[:, place[:-1], place[1:]] = information[:, place[1:], place[:-1]] = between.sum(axis=2)
    information[:, -1, :-1] = information[:, :-1, -1] = across @ position
    information[:, -1, -1] = (across @ position**2).sum(axis=1)
    return value, gradient, information


def _gradients(position: np.ndarray, parameters: np.ndarray, counts: np.ndarray) -> np.ndarray:
    """Return the gradient of each cell's log-likelihood at one row of parameters, shape [cell, damage_state + 1].

    Args:
        position: Logarithm of each level, shape [im_level].
        parameters: Intercepts and slope, shape [1, damage_state + 1].
        counts: Number of samples of each cell in each state, no damage first, [cell, damage_state + 1, im_level].
    """
    one = np.ones((1, *counts.shape[1:]))
    above, below = _densities(position, parameters, one)[1:]
    slope = counts[:, 1:] * above - counts[:, :-1] * below
    return np.column_stack([slope.sum(axis=2), (slope @ position).sum(axis=1)])


def _densities(
    position: np.ndarray, parameters: np.ndarray, counts: np.ndarray
) -> tuple[np.ndarray, np.ndarray, np.ndarray]:
    """Return ln(probability) of each state, and normal densities at its edges divided by the probability.

    Returns:
        ln(probability), shape [row, damage_state + 1, im_level]; density at the upper edge of states 1 to the last
        divided by their probability; density at the lower edge of states 0 to the last but one divided by their
        probability. The densities are 0 for states without samples (`counts`).
    """
    score = parameters[:, :-1, None] + parameters[:, -1:, None] * position
    edge = np.full((len(parameters), 1, position.size), np.inf)
    high, low = np.concatenate([edge, score], axis=1), np.concatenate([score, -edge], axis=1)
    # Subtract probabilities in the tail in which both are small, to avoid cancellation.
    is_right = low > 0
    upper, lower = np.where(is_right, -low, high), np.where(is_right, -high, low)
    with np.errstate(divide="ignore", invalid="ignore", over="ignore"):
        log_upper = log_ndtr(upper)
        log_share = log_upper + np.log1p(-np.exp(log_ndtr(lower) - log_upper))
        log_density = -0.5 * score * score - _LOG_SQRT_2PI
        above = np.where(counts[:, 1:] > 0, np.exp(log_density - log_share[:, 1:]), 0.0)
        below = np.where(counts[:, :-1] > 0, np.exp(log_density - log_share[:, :-1]), 0.0)
    return log_share, above, below
