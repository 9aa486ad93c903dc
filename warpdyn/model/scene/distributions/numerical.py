"""Distributions whose quantiles the host computes: those of SciPy, truncated and empirical distributions."""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import dataclass
from functools import cached_property
from typing import Any

import numpy as np
from scipy.special import ndtr, ndtri

from warpdyn.engine.tracing.arrays import NotTraceableError, is_traced
from warpdyn.foundations.core.checks import finite_numbers, real_number, shortened
from warpdyn.foundations.core.frozen_values import FrozenArrays, FrozenMapping
from warpdyn.foundations.core.near_misses import with_suggestions
from warpdyn.model.scene.distributions.distribution import Distribution

LEAST_PROBABILITY = 1e-12  # of the interval of a Truncated distribution; below, its quantiles lose their digits


class Numerical(Distribution):
    """Base class: a distribution whose values a kernel cannot compute, so that the host draws all structures."""

    def from_standard_normal(self, z: np.ndarray) -> np.ndarray:
        """Return the values with the same cumulative probabilities as standard normal values z, in the shape of z."""
        if is_traced(z):
            raise NotTraceableError(f"the host draws values of {type(self).__name__}")
        return self.quantiles(np.asarray(z))

    def quantiles(self, z: np.ndarray) -> np.ndarray:
        """Return the values with the same cumulative probabilities as standard normal values z, in the shape of z."""
        raise NotImplementedError


@dataclass(frozen=True)
class ScipyDistribution(Numerical):
    """A continuous distribution of scipy.stats with fixed parameters.

    Args:
        name: Name in scipy.stats, such as "weibull_min".
        parameters: Parameters by their names in SciPy, such as {"c": 2.0, "scale": 3.0}.

    Raises:
        ValueError: If SciPy has no continuous distribution of this name or does not accept the parameters.
    """

    name: str
    parameters: Mapping[str, float]

    def __post_init__(self) -> None:
        given = {key: real_number(f"{self.name}: {key}", value) for key, value in self.parameters.items()}
        object.__setattr__(self, "parameters", FrozenMapping(given))
        if not np.isfinite(self.frozen.median()):
            raise ValueError(
                f"scipy.stats.{self.name} has no median with {given}: SciPy does not accept these parameters. Correct "
                "them; its documentation gives their bounds"
            )

    def __hash__(self) -> int:
        return hash((self.name, tuple(self.parameters.items())))

    def __repr__(self) -> str:
        inner = ", ".join(f"{key}={value:.6g}" for key, value in self.parameters.items())
        return f"scipy.stats.{self.name}({inner})"

    @cached_property
    def frozen(self) -> Any:
        """The frozen distribution of SciPy."""
        from scipy import stats  # its import takes 0.3 s

        kind = getattr(stats, self.name, None)
        if not isinstance(kind, stats.rv_continuous):
            raise ValueError(f"scipy.stats has no continuous distribution {self.name!r}")
        try:
            return kind(**self.parameters)
        except TypeError as error:
            raise ValueError(f"scipy.stats.{self.name}: {error}") from None

    def quantiles(self, z: np.ndarray) -> np.ndarray:
        """Return the values with the same cumulative probabilities as standard normal values z, in the shape of z."""
        # The survival function has all digits in the upper tail, where 1 - probability is small.
        return np.where(z < 0, self.frozen.ppf(ndtr(np.minimum(z, 0.0))), self.frozen.isf(ndtr(-np.maximum(z, 0.0))))

    def to_standard_normal(self, value: float) -> float:
        """Return the standard normal value with the same cumulative probability as a value [units of the variable]."""
        below, above = self.frozen.cdf(value), self.frozen.sf(value)
        return float(ndtri(below) if below < above else -ndtri(above))


@with_suggestions
@dataclass(frozen=True)
class Truncated(Numerical):
    """A distribution that is limited to an interval: that of a variable, under the condition that it is within it.

    The quantile at probability p is that of the given distribution at F(low) + p (F(high) - F(low)), where F is its
    cumulative probability.

    Source: N. L. Johnson, S. Kotz and N. Balakrishnan, Continuous Univariate Distributions, volume 1, 2nd edition,
    Wiley, 1994, chapter 13.

    Args:
        distribution: Distribution without the limits: Normal, Lognormal, Uniform, or a frozen continuous distribution
            of scipy.stats.
        low, high: Least and largest value [units of the variable]. None: no limit on this side.

    Raises:
        TypeError: If `distribution` is not a distribution.
        ValueError: If both limits are None, a limit is not finite, `high` is not above `low`, or the variable is in the
            interval with a probability below 1e-12.

    Example:
        >>> positive = wd.Truncated(wd.Normal(mean=1.0, standard_deviation=0.4), low=0.1)
        >>> wd.RandomFactor(positive).distribution
        Truncated(distribution=Normal(mean=1.0, standard_deviation=0.4), low=0.1, high=None)
    """

    distribution: Distribution
    low: float | None = None
    high: float | None = None

    def __post_init__(self) -> None:
        object.__setattr__(self, "distribution", as_distribution(self.distribution))
        if isinstance(self.distribution, Empirical):
            raise TypeError("Truncated needs a continuous distribution: remove the values of Empirical instead")
        if self.low is None and self.high is None:
            raise ValueError("Truncated needs low= or high=, such as Truncated(Normal(1.0, 0.3), low=0.2)")
        low = -np.inf if self.low is None else real_number("Truncated.low", self.low)
        high = np.inf if self.high is None else real_number("Truncated.high", self.high)
        if not high > low:
            raise ValueError(f"Truncated.high must be above Truncated.low={low:g}, got {high:g}")
        if not self._inside >= LEAST_PROBABILITY:
            raise ValueError(
                f"Truncated: {self.distribution!r} is between {low:g} and {high:g} with a probability of "
                f"{self._inside:.2g}; check the unit of low and high"
            )

    @cached_property
    def _ends(self) -> tuple[float, float]:
        """Standard normal values of both limits."""
        low = -np.inf if self.low is None else self.distribution.to_standard_normal(self.low)
        high = np.inf if self.high is None else self.distribution.to_standard_normal(self.high)
        return low, high

    @cached_property
    def _inside(self) -> float:
        """Probability that a value of the distribution without limits is within them [1]."""
        low, high = self._ends
        return float(ndtr(-low) - ndtr(-high) if low > 0 else ndtr(high) - ndtr(low))

    def quantiles(self, z: np.ndarray) -> np.ndarray:
        """Return the values with the same cumulative probabilities as standard normal values z, in the shape of z."""
        low, high = self._ends
        # Each tail counts probabilities from its end, where they are small and have all digits.
        below, above = ndtr(low) + ndtr(z) * self._inside, ndtr(-high) + ndtr(-z) * self._inside
        inner = np.where(below < above, ndtri(below), -ndtri(above))
        return np.clip(self.distribution.from_standard_normal(inner), self.low, self.high)

    def to_standard_normal(self, value: float) -> float:
        """Return the standard normal value with the same cumulative probability as a value [units of the variable]."""
        low, high = self._ends
        place = min(max(self.distribution.to_standard_normal(value), low), high)
        below, above = (ndtr(place) - ndtr(low)) / self._inside, (ndtr(-place) - ndtr(-high)) / self._inside
        return float(ndtri(below) if below < above else -ndtri(above))


@with_suggestions
@dataclass(frozen=True, eq=False)
class Empirical(FrozenArrays, Numerical):
    """A distribution of observed values, such as measured strengths: every draw is one of them, all equally probable.

    Args:
        values: Observed values [units of the variable], at least 2; values that occur several times are drawn more
            often.

    Raises:
        ValueError: If there are fewer than 2 values, or a value is not finite.

    Example:
        >>> measured = wd.Empirical([0.021, 0.034, 0.034, 0.052])  # damping ratios of four buildings
        >>> wd.RandomValue(measured).distribution
        Empirical(of 4 values)
    """

    values: Any  # an array after the constructor has checked the argument

    def __post_init__(self) -> None:
        values = finite_numbers("Empirical.values", self.values)
        if values.ndim != 1 or values.size < 2:
            raise ValueError(f"Empirical.values must be at least 2 numbers in a row, got {shortened(self.values)}")
        values.sort()
        values.flags.writeable = False
        object.__setattr__(self, "values", values)

    def __repr__(self) -> str:
        return f"Empirical(of {len(self.values)} values)"

    def quantiles(self, z: np.ndarray) -> np.ndarray:
        """Return the values with the same cumulative probabilities as standard normal values z, in the shape of z."""
        place = np.minimum(ndtr(z) * self.values.size, self.values.size - 1)
        found: np.ndarray = self.values[place.astype(np.int64)]
        return found

    def to_standard_normal(self, value: float) -> float:
        """Return the standard normal value with the same cumulative probability as a value [units of the variable]."""
        return float(ndtri(np.searchsorted(self.values, value, side="right") / self.values.size))


def as_distribution(given: Any) -> Distribution:
    """Return a distribution of warpdyn, or a frozen distribution of scipy.stats as a ScipyDistribution.

    Raises:
        TypeError: If it is another object, or a distribution of SciPy that is discrete or has no name in scipy.stats.
        ValueError: If a parameter of a frozen distribution is not one finite number.
    """
    if isinstance(given, Distribution):
        return given
    if not hasattr(given, "dist") or not hasattr(given, "ppf"):  # a frozen distribution of SciPy has both
        hint = "; call it with its parameters, such as scipy.stats.gumbel_r(loc=1.0, scale=0.1)"
        raise TypeError(
            "distribution must be Normal, Lognormal, Uniform, Truncated, Empirical or a frozen distribution of "
            f"scipy.stats, got {shortened(given)}{hint if hasattr(given, 'ppf') else ''}"
        )
    from scipy import stats  # its import takes 0.3 s

    kind: Any = given.dist
    if not isinstance(kind, stats.rv_continuous) or type(getattr(stats, kind.name, None)) is not type(kind):
        raise TypeError(
            f"{type(kind).__name__} is not a continuous distribution of scipy.stats with a name: draw values from it "
            "and give them as Empirical(values)"
        )
    shapes = [name.strip() for name in given.dist.shapes.split(",")] if given.dist.shapes else []
    by_place = dict(zip([*shapes, "loc", "scale"], given.args, strict=False))
    return ScipyDistribution(given.dist.name, {**by_place, **given.kwds})
