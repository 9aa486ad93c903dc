"""Binomial likelihood of exceedance counts by probit or logit: P(exceedance) = F(intercept + slope ln(level))."""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import dataclass

import numpy as np
from scipy.special import expit, log_expit, log_ndtr

from warpdyn.answers.fragility.maximum_likelihood.newton import Evaluation

_LOG_SQRT_2PI = 0.5 * np.log(2.0 * np.pi)


@dataclass(frozen=True, eq=False)
class Link:
    """Symmetric distribution F of the standardised capacity: normal (probit) or logistic (logit).

    Args:
        log_cumulative: Function that returns ln of the cumulative probability F(z).
        log_density: Function that returns ln of the probability density at z.
        slope: Function that returns the derivative of ln of the density with respect to z.
        deviation: Standard deviation of the distribution.
    """

    log_cumulative: Callable[[np.ndarray], np.ndarray]
    log_density: Callable[[np.ndarray], np.ndarray]
    slope: Callable[[np.ndarray], np.ndarray]
    deviation: float


PROBIT = Link(log_ndtr, lambda z: -0.5 * z * z - _LOG_SQRT_2PI, lambda z: -z, 1.0)
LOGIT = Link(log_expit, lambda z: log_expit(z) + log_expit(-z), lambda z: 1.0 - 2.0 * expit(z), np.pi / np.sqrt(3.0))


def likelihood(
    link: Link, position: np.ndarray, parameters: np.ndarray, exceeding: np.ndarray, passing: np.ndarray
) -> Evaluation:
    """Return log-likelihood, gradient and negative second derivatives, for P = F(intercept + slope x position).

    Args:
        link: Probit or logit.
        position: Logarithm of each level, shape [im_level].
        parameters: Intercept and slope, shape [row, 2].
        exceeding: Number of samples that exceed the state, shape [row, im_level].
        passing: Number of samples that do not exceed the state, shape [row, im_level].

    Returns:
        Log-likelihood, shape [row]; gradient with respect to intercept and slope, shape [row, 2]; negative second
        derivatives, shape [row, 2, 2].
    """
    score = parameters[:, :1] + parameters[:, 1:] * position
    above, below, density = link.log_cumulative(score), link.log_cumulative(-score), link.log_density(score)
    rise, fall, bend = np.exp(density - above), np.exp(density - below), link.slope(score)
    value = (exceeding * above + passing * below).sum(axis=1)
    slope = exceeding * rise - passing * fall
    curvature = np.maximum(exceeding * rise * (rise - bend) + passing * fall * (fall + bend), 0.0)
    return value, gradient_in_line(slope, position), information_in_line(curvature, position)


def gradient_in_line(slope: np.ndarray, position: np.ndarray) -> np.ndarray:
    """Return the derivatives of the log-likelihood by the intercept and the slope of the line, shape [row, 2].

    Args:
        slope: Derivatives by the value of the line at each level, shape [row, im_level].
        position: Position of each level on the axis of the line, shape [im_level].
    """
    return np.stack([slope.sum(axis=1), slope @ position], axis=1)


def information_in_line(weight: np.ndarray, position: np.ndarray) -> np.ndarray:
    """Return the second derivatives of the log-likelihood by the intercept and the slope of the line, [row, 2, 2].

    Args:
        weight: Second derivatives by the value of the line at each level, shape [row, im_level].
        position: Position of each level on the axis of the line, shape [im_level].
    """
    moments = [weight.sum(axis=1), weight @ position, weight @ position**2]
    return np.stack([moments[0], moments[1], moments[1], moments[2]], axis=1).reshape(-1, 2, 2)
