"""Newton's method for many small likelihoods at the same time, and cluster-robust covariances of estimates."""

from __future__ import annotations

from collections.abc import Callable

import numpy as np

Evaluation = tuple[np.ndarray, np.ndarray, np.ndarray]  # value, gradient, negative second derivatives

_ITERATIONS = 200  # usually 5 to 10 are needed; more if `information` only approximates the second derivatives
_HALVINGS = 40  # largest number of halvings of a step
_TOLERANCE = 1e-10  # largest step at convergence, relative to the parameters
_RIDGE = 1e-14  # added to a unit diagonal, so that rounding does not make a matrix singular


def maximise(evaluate: Callable[[np.ndarray, np.ndarray], Evaluation], start: np.ndarray) -> np.ndarray:
    """Return the parameters that maximise concave functions, one per row, by Newton's method with step halving.

    Args:
        evaluate: Function of parameters, shape [row, parameter], and the indices of their rows. It returns the value,
            shape [row], the gradient, shape [row, parameter], and the negative second derivatives (or a positive
            definite matrix close to them, such as the expected information), shape [row, parameter, parameter]. A value
            that is not finite means that the parameters are out of bounds.
        start: Parameters at which the search starts, shape [row, parameter].

    Returns:
        The parameters at the maximum, of the shape of `start`; NaN without convergence.
    """
    found = np.full(start.shape, np.nan)
    parameters = np.array(start, dtype=np.float64)
    active = np.flatnonzero(np.isfinite(parameters).all(axis=1))
    if not active.size:
        return found
    value, gradient, information = evaluate(parameters[active], active)
    for _ in range(_ITERATIONS):
        current, step = parameters[active], _solved(information, gradient)
        # A step at which the function is constant within rounding is accepted.
        least = value - 1e-13 * np.abs(value)
        trial = np.arange(active.size)
        for _ in range(_HALVINGS):
            better = evaluate(current[trial] + step[trial], active[trial])
            for held, new in zip((value, gradient, information), better, strict=True):
                held[trial] = new
            trial = trial[~(value[trial] >= least[trial])]
            if not trial.size:
                break
            step[trial] *= 0.5
        step[trial] = np.nan  # no point along the step is better: the function has no maximum
        parameters[active] = current + step
        size, magnitude = np.abs(step).max(axis=1), 1.0 + np.abs(current).max(axis=1)
        arrived = active[size <= _TOLERANCE * magnitude]
        found[arrived] = parameters[arrived]
        going_on = np.isfinite(size) & (size > _TOLERANCE * magnitude)
        if not going_on.any():
            break
        active, value, gradient, information = (part[going_on] for part in (active, value, gradient, information))
    return found


def covariance_of_influences(influences: np.ndarray) -> np.ndarray:
    """Return the cluster-robust covariance of estimates (Liang and Zeger 1986, Biometrika 73).

    The covariance (sandwich) is: inverse information x sum of the outer products of the clusters' scores x inverse
    information, times n / (n - 1) for n clusters. Observations of one cluster, such as those of one record, may be
    correlated.

    Args:
        influences: First-order contribution of each cluster to the estimates, i.e. its score times the inverse of the
            information of all clusters, shape [cluster, estimate, ...].

    Returns:
        The covariances, shape [estimate, estimate, ...]; NaN for a single cluster.
    """
    clusters = len(influences)
    factor = clusters / (clusters - 1) if clusters > 1 else np.nan
    return factor * np.einsum("ci...,cj...->ij...", influences, influences)


def _solved(information: np.ndarray, gradient: np.ndarray) -> np.ndarray:
    """Return the Newton step of each row, shape [row, parameter]; NaN if the information matrix is singular."""
    if gradient.shape[1] == 2:
        return _solved_pairs(information, gradient)
    # Scale to a unit diagonal, because parameters may have very different sizes.
    scale = np.sqrt(np.maximum(np.einsum("rii->ri", information), np.finfo(np.float64).tiny))
    scaled = information / (scale[:, :, None] * scale[:, None, :])
    finite = np.isfinite(scaled).all(axis=(1, 2)) & np.isfinite(gradient).all(axis=1)
    step = np.full(gradient.shape, np.nan)
    eye = _RIDGE * np.eye(gradient.shape[1])
    try:
        step[finite] = np.linalg.solve(scaled[finite] + eye, (gradient / scale)[finite][..., None])[..., 0]
    except np.linalg.LinAlgError:
        for row in np.flatnonzero(finite):
            step[row] = np.linalg.lstsq(scaled[row], (gradient / scale)[row], rcond=None)[0]
    return step / scale


def _solved_pairs(information: np.ndarray, gradient: np.ndarray) -> np.ndarray:
    """Return the Newton steps for two parameters in closed form, shape [row, 2], in half the time of `_solved`."""
    scale = np.sqrt(np.maximum(information[:, [0, 1], [0, 1]], np.finfo(np.float64).tiny))
    coupling = information[:, 0, 1] / (scale[:, 0] * scale[:, 1])
    scaled = gradient / scale
    with np.errstate(divide="ignore", invalid="ignore"):
        step = (1.0 + _RIDGE) * scaled - coupling[:, None] * scaled[:, ::-1]
        return step / (((1.0 + _RIDGE) ** 2 - coupling**2)[:, None] * scale)
