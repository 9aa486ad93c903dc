"""Likelihood of candidates: the differences from a measurement are independent and normal, with noise and offset."""

from __future__ import annotations

from collections.abc import Callable
from typing import Any

import numpy as np
from numpy.typing import ArrayLike

from warpdyn.campaigns.inference.priors import Prior, Values, check_bounds, check_prior
from warpdyn.engine.laws.parameter import Parameter
from warpdyn.foundations.core.checks import real_number
from warpdyn.model.scene.distributions.distribution import Distribution
from warpdyn.model.scene.distributions.numerical import as_distribution

NOISE = Parameter("1", "standard deviation of the noise", low=0.0, low_open=True)
OFFSET = Parameter("1", "offset of the sensor")

Misfit = Callable[[Values], tuple[np.ndarray, np.ndarray, np.ndarray]]


class Likelihood:
    """Logarithm of the likelihood of candidates, as a function of standard normal variables.

    The variables are those of the prior, the noise (if its standard deviation is unknown) and the offset of each sensor
    (if it has a prior).

    Args:
        prior: Prior of the parameters of the structure.
        misfit: Function of parameters that returns the sums of differences and of their squares, [candidate, sensor].
        count: Number of values of each sensor.
        sensors: Number of sensors.
        noise: Standard deviation of the noise, or its prior.
        offset: Prior of the offset of each sensor; None: no offset.
    """

    def __init__(
        self, prior: Prior, misfit: Misfit, count: int, sensors: int, noise: ArrayLike | Distribution, offset: Any
    ) -> None:
        self.prior, self.misfit, self.count, self.sensors = prior, misfit, count, sensors
        self.noise = given_noise(noise)
        self.offset = None if offset is None else as_distribution(offset)
        if self.offset is not None:
            check_prior("offset", self.offset)
        self.has_noise = isinstance(self.noise, Distribution)

    @property
    def variables(self) -> int:
        """Number of standard normal variables."""
        return self.prior.variables + int(self.has_noise) + (self.sensors if self.offset is not None else 0)

    def noise_of(self, normals: np.ndarray) -> np.ndarray:
        """Return the standard deviation of the noise, shape [candidate]."""
        if not isinstance(self.noise, Distribution):
            return np.full(len(normals), self.noise)
        return np.asarray(self.noise.from_standard_normal(normals[:, self.prior.variables]))

    def offset_of(self, normals: np.ndarray) -> np.ndarray:
        """Return the offsets of the sensors, shape [candidate, sensor]."""
        if self.offset is None:
            return np.zeros((len(normals), self.sensors))
        return np.asarray(self.offset.from_standard_normal(normals[:, -self.sensors :]))

    def __call__(self, normals: np.ndarray) -> np.ndarray:
        """Return the logarithms of the likelihoods, shape [candidate]; -inf for impossible candidates."""
        values = self.prior.values(normals[:, : self.prior.variables])
        rows = np.flatnonzero(self.prior.allowed(values))
        found = np.full(len(normals), -np.inf)
        if not rows.size:
            return found
        sums, squares, _ = self.misfit({name: each[rows] for name, each in values.items()})
        offset, noise = self.offset_of(normals[rows]), self.noise_of(normals[rows])
        with np.errstate(invalid="ignore", divide="ignore", over="ignore"):
            total = np.sum(squares - 2 * offset * sums + self.count * offset**2, axis=1)
            logs = -self.sensors * self.count * (0.5 * np.log(2 * np.pi) + np.log(noise)) - 0.5 * total / noise**2
        found[rows] = np.where(np.isfinite(logs), logs, -np.inf)
        return found


def given_noise(noise: Any) -> float | Distribution:
    """Return the standard deviation of the noise, or its prior, after a check."""
    if isinstance(noise, Distribution) or hasattr(noise, "ppf"):
        prior = as_distribution(noise)
        check_prior("noise", prior)
        check_bounds("noise", prior, NOISE)
        return prior
    return real_number("noise (a distribution, or a standard deviation)", noise, above=0)
