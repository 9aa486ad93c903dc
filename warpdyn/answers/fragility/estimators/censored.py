"""Normal regression of values that are known exactly, within an interval, or only up to one bound (censored)."""

from __future__ import annotations

from dataclasses import dataclass
from functools import cached_property
from typing import NamedTuple

import numpy as np
from scipy.special import log_ndtr

from warpdyn.answers.fragility.maximum_likelihood.newton import Evaluation, maximise

NARROW = 1e-6  # an interval (of a logarithm) that is narrower is replaced by its centre, because of rounding

_AT_A_TIME = 1 << 20  # number of observations times rows that are in memory at the same time
_LOG_SQRT_2PI = 0.5 * np.log(2.0 * np.pi)


@dataclass(frozen=True, eq=False)
class CensoredRegression:
    """Maximum likelihood of value = coefficients . design + deviation x normal (Tobin 1958, Olsen 1978).

    As a function of coefficients / deviation and 1 / deviation, the log-likelihood is concave, also for intervals
    (Olsen 1978, Econometrica 46; Burridge 1981, Journal of the Royal Statistical Society B 43), so it has only one
    maximum.

    Args:
        lower: Lower bound of each value, shape [observation]; -inf if it has no lower bound.
        upper: Upper bound of each value, shape [observation]; inf if it has no upper bound; equal to the lower bound if
            the value is known.
        design: Explanatory variables of the mean, shape [observation, coefficient].
    """

    lower: np.ndarray
    upper: np.ndarray
    design: np.ndarray

    def __post_init__(self) -> None:
        with np.errstate(invalid="ignore"):
            is_narrow = self.upper - self.lower <= NARROW
            middle = 0.5 * (self.lower + self.upper)
        for name in ("lower", "upper"):
            object.__setattr__(self, name, np.where(is_narrow, middle, getattr(self, name)))

    def fit(self, weights: np.ndarray) -> tuple[np.ndarray, np.ndarray]:
        """Return the coefficients, shape [row, coefficient], and the standard deviation, shape [row].

        Both are NaN if Newton's method finds no maximum. If all values are known, the result is a least-squares fit
        (mean and standard deviation if the design is constant); the deviation has divisor n, not n - 1.

        Args:
            weights: Weight of each observation in each fit, shape [row, observation].
        """
        if self._is_exact.all():
            return self._least_squares(weights)
        first = self._start()
        found = np.full((len(weights), first.size), np.nan)
        size = max(1, _AT_A_TIME // max(self.lower.size, 1))
        for begin in range(0, len(weights), size):
            some = weights[begin : begin + size]

            def evaluate(parameters: np.ndarray, row: np.ndarray, some: np.ndarray = some) -> Evaluation:
                return self._evaluate(parameters, some[row])

            found[begin : begin + size] = maximise(evaluate, np.tile(first, (len(some), 1)))
            if begin == 0 and np.isfinite(found[0]).all():
                first = found[0]
        with np.errstate(invalid="ignore"):
            return found[:, :-1] / found[:, -1:], 1.0 / found[:, -1]

    def influences(self, coefficients: np.ndarray, deviation: float) -> tuple[np.ndarray, np.ndarray]:
        """Return the first-order contribution of each observation to the fitted coefficients and deviation.

        Args:
            coefficients: Fitted coefficients, shape [coefficient].
            deviation: Fitted standard deviation.

        Returns:
            The contributions, shape [observation, coefficient + 1]; the covariance of coefficients and deviation if all
            observations were independent, shape [coefficient + 1, coefficient + 1].
        """
        count = coefficients.size + 1
        if not np.isfinite(deviation):
            return np.full((self.lower.size, count), np.nan), np.full((count, count), np.nan)
        parameters = np.append(coefficients, 1.0)[None] / deviation
        at = self._at(parameters)
        scores = at.slope_upper[0, :, None] * self._upper_row + at.slope_lower[0, :, None] * self._lower_row
        scores[self._is_exact, -1] += deviation
        _, _, information = self._evaluate(parameters, np.ones((1, self.lower.size)))
        inverse = np.linalg.pinv(information[0], hermitian=True)
        change = np.zeros((count, count))  # derivatives with respect to coefficients / deviation and 1 / deviation
        change[:-1, :-1] = deviation * np.eye(count - 1)
        change[:-1, -1], change[-1, -1] = -coefficients * deviation, -(deviation**2)
        return scores @ (change @ inverse).T, change @ inverse @ change.T

    def _least_squares(self, weights: np.ndarray) -> tuple[np.ndarray, np.ndarray]:
        count = self.design.shape[1]
        squares = weights @ (self.design[:, :, None] * self.design[:, None, :]).reshape(-1, count * count)
        products = weights @ (self.design * self.lower[:, None])
        inverse = np.linalg.pinv(squares.reshape(-1, count, count), hermitian=True)
        coefficients = np.einsum("rij,rj->ri", inverse, products)
        residual = self.lower - coefficients @ self.design.T
        with np.errstate(invalid="ignore", divide="ignore"):
            deviation = np.sqrt((weights * residual**2).sum(axis=1) / weights.sum(axis=1))
        return coefficients, np.where(deviation > 0, deviation, np.nan)

    @cached_property
    def _is_exact(self) -> np.ndarray:
        return self.lower == self.upper

    @cached_property
    def _upper_row(self) -> np.ndarray:
        """Factors of the parameters in the standardised upper bound, shape [observation, coefficient + 1]."""
        return np.column_stack([-self.design, np.where(np.isfinite(self.upper), self.upper, 0.0)])

    @cached_property
    def _lower_row(self) -> np.ndarray:
        """Factors of the parameters in the standardised lower bound, shape [observation, coefficient + 1]."""
        return np.column_stack([-self.design, np.where(np.isfinite(self.lower), self.lower, 0.0)])

    def _start(self) -> np.ndarray:
        """Return start parameters for the search: a least-squares line through the centre of each value's bounds.

        If a value has only one bound, the line uses this bound.
        """
        low, high = np.isfinite(self.lower), np.isfinite(self.upper)
        both = low & high
        with np.errstate(invalid="ignore"):
            middle = np.where(both, 0.5 * (self.lower + self.upper), np.where(low, self.lower, self.upper))
        usable = np.isfinite(middle)
        coefficients = np.linalg.lstsq(self.design[usable], middle[usable], rcond=None)[0]
        width = float((self.upper - self.lower)[both].max(initial=0.0))
        deviation = max(float(np.std(middle[usable] - self.design[usable] @ coefficients)), 0.2 * width, 1e-3)
        return np.append(coefficients, 1.0) / deviation

    def _evaluate(self, parameters: np.ndarray, weights: np.ndarray) -> Evaluation:
        """Return log-likelihood, gradient and negative second derivatives for rows of parameters and weights.

        Parameters are coefficients / deviation and 1 / deviation, shape [row, coefficient + 1]; weights have the shape
        [row, observation].
        """
        at, rows, count = self._at(parameters), len(parameters), parameters.shape[1]
        up, low = self._upper_row, self._lower_row
        value = np.where(weights > 0, weights * at.value, 0.0).sum(axis=1)
        gradient = (weights * at.slope_upper) @ up + (weights * at.slope_lower) @ low
        information = np.zeros((rows, count * count))
        for bend, left, right in ((at.bend_upper, up, up), (at.bend_lower, low, low)):
            information += (weights * bend) @ (left[:, :, None] * right[:, None, :]).reshape(-1, count * count)
        both = up[:, :, None] * low[:, None, :]
        both += low[:, :, None] * up[:, None, :]
        information -= (weights * at.slope_upper * -at.slope_lower * ~self._is_exact) @ both.reshape(-1, count * count)
        # The density of a known value is the normal density of the standardised value, divided by the deviation.
        precision, known = parameters[:, -1], weights @ self._is_exact.astype(np.float64)
        with np.errstate(divide="ignore", invalid="ignore"):
            value += np.where(known > 0, known * np.log(precision), 0.0)
            gradient[:, -1] += known / precision
            information[:, -1] += known / precision**2
        value[~(precision > 0)] = -np.inf
        return value, gradient, information.reshape(rows, count, count)

    def _at(self, parameters: np.ndarray) -> _Scores:
        """Return the contributions of all observations to the likelihood and its derivatives at given parameters."""
        with np.errstate(all="ignore"):
            high = np.where(np.isfinite(self.upper), parameters @ self._upper_row.T, np.inf)
            low = np.where(np.isfinite(self.lower), parameters @ self._lower_row.T, -np.inf)
            # Subtract probabilities in the tail in which both are small, to avoid cancellation.
            is_right = low > 0
            upper, lower = np.where(is_right, -low, high), np.where(is_right, -high, low)
            log_upper = log_ndtr(upper)
            value = log_upper + np.log1p(-np.exp(log_ndtr(lower) - log_upper))
            density = [np.exp(-0.5 * z * z - _LOG_SQRT_2PI - value) for z in (high, low)]
            bends = [
                f * (f + np.where(np.isfinite(z), z, 0.0) * side)
                for f, z, side in zip(density, (high, low), (1.0, -1.0), strict=True)
            ]
        exact = self._is_exact
        value = np.where(exact, -0.5 * high * high - _LOG_SQRT_2PI, value)
        return _Scores(
            value,
            np.where(exact, -high, density[0]),
            np.where(exact, 0.0, -density[1]),
            np.where(exact, 1.0, bends[0]),
            np.where(exact, 0.0, bends[1]),
        )


class _Scores(NamedTuple):
    """Contributions of observations to the log-likelihood and its derivatives, each of shape [row, observation].

    Args:
        value: Log-likelihood; for known values without the term ln(1 / deviation).
        slope_upper: Derivative of the log-likelihood with respect to the standardised upper bound; for a known value,
            with respect to the standardised value.
        slope_lower: Derivative of the log-likelihood with respect to the standardised lower bound.
        bend_upper: Negative second derivative with respect to the standardised upper bound.
        bend_lower: Negative second derivative with respect to the standardised lower bound. The mixed second derivative
            is the product of both slopes.
    """

    value: np.ndarray
    slope_upper: np.ndarray
    slope_lower: np.ndarray
    bend_upper: np.ndarray
    bend_lower: np.ndarray
