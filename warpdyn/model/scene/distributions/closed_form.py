"""Normal, lognormal and uniform distributions, whose values are formulas that kernels can compute."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np
from scipy.special import ndtr, ndtri

from warpdyn.foundations.core.checks import real_number
from warpdyn.foundations.core.near_misses import with_suggestions
from warpdyn.model.scene.distributions.distribution import Distribution


@with_suggestions
@dataclass(frozen=True)
class Normal(Distribution):
    """A normal distribution.

    Args:
        mean: Mean [units of the variable].
        standard_deviation: Standard deviation [units of the variable], at least 0.

    Raises:
        ValueError: If a value is not finite, or the standard deviation is below 0.

    Example:
        >>> distribution = wd.Normal(mean=0.05, standard_deviation=0.01)
        >>> wd.RandomValue(distribution).per
        'building'
    """

    mean: float
    standard_deviation: float

    def __post_init__(self) -> None:
        real_number("Normal.mean", self.mean)
        real_number("Normal.standard_deviation", self.standard_deviation, least=0)

    def from_standard_normal(self, z: np.ndarray) -> np.ndarray:
        """Return the values with the same cumulative probabilities as standard normal values z, in the shape of z."""
        return self.mean + self.standard_deviation * z

    def to_standard_normal(self, value: float) -> float:
        """Return the standard normal value with the same cumulative probability as a value [units of the variable]."""
        with np.errstate(divide="ignore", invalid="ignore"):
            return float(np.divide(value - self.mean, self.standard_deviation))


@with_suggestions
@dataclass(frozen=True)
class Lognormal(Distribution):
    """A lognormal distribution, given by its median and dispersion.

    Args:
        median: Median [units of the variable], above 0.
        dispersion: Standard deviation of the natural logarithm [1], at least 0.

    Raises:
        ValueError: If a value is not finite, the median is not above 0 or the dispersion is below 0.

    Example:
        >>> distribution = wd.Lognormal(median=1.0, dispersion=0.2)
        >>> wd.RandomFactor(distribution).distribution
        Lognormal(median=1.0, dispersion=0.2)
    """

    median: float
    dispersion: float

    def __post_init__(self) -> None:
        real_number("Lognormal.median", self.median, above=0)
        real_number("Lognormal.dispersion", self.dispersion, least=0)

    @classmethod
    def from_mean(cls, mean: float, cov: float) -> Lognormal:
        """Return the distribution with a given mean and coefficient of variation (standard deviation over mean).

        Args:
            mean: Mean [units of the variable], above 0.
            cov: Coefficient of variation [1], at least 0.

        Raises:
            ValueError: If the mean is not finite and above 0, or the coefficient is not finite or below 0.

        Example:
            >>> round(wd.Lognormal.from_mean(mean=0.05, cov=0.5).median, 4)
            0.0447
        """
        mean, cov = real_number("mean", mean, above=0), real_number("cov", cov, least=0)
        return cls(mean / float(np.sqrt(1 + cov**2)), float(np.sqrt(np.log1p(cov**2))))

    def from_standard_normal(self, z: np.ndarray) -> np.ndarray:
        """Return the values with the same cumulative probabilities as standard normal values z, in the shape of z."""
        return self.median * np.exp(self.dispersion * z)

    def to_standard_normal(self, value: float) -> float:
        """Return the standard normal value with the same cumulative probability as a value [units of the variable]."""
        if not value > 0:
            return -np.inf
        with np.errstate(divide="ignore", invalid="ignore"):
            return float(np.divide(np.log(value / self.median), self.dispersion))


@with_suggestions
@dataclass(frozen=True)
class Uniform(Distribution):
    """A uniform distribution between two bounds.

    Args:
        low: Lower bound [units of the variable].
        high: Upper bound [units of the variable], above the lower bound.

    Raises:
        ValueError: If a bound is not finite, or the upper bound is not above the lower bound.

    Example:
        >>> distribution = wd.Uniform(low=0.02, high=0.08)
        >>> wd.RandomValue(distribution).distribution
        Uniform(low=0.02, high=0.08)
    """

    low: float
    high: float

    def __post_init__(self) -> None:
        low, high = real_number("Uniform.low", self.low), real_number("Uniform.high", self.high)
        if not high > low:
            raise ValueError(f"Uniform.high must be a finite number above Uniform.low={low:g}, got {high:g}")

    def from_standard_normal(self, z: np.ndarray) -> np.ndarray:
        """Return the values with the same cumulative probabilities as standard normal values z, in the shape of z."""
        return self.low + (self.high - self.low) * ndtr(z)

    def to_standard_normal(self, value: float) -> float:
        """Return the standard normal value with the same cumulative probability as a value [units of the variable]."""
        return float(ndtri(np.clip((value - self.low) / (self.high - self.low), 0.0, 1.0)))
