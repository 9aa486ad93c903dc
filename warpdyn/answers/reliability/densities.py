"""Densities of importance sampling: mixtures of the standard normal density and of densities near failure."""

from __future__ import annotations

from dataclasses import dataclass
from typing import Protocol

import numpy as np
from scipy.special import log_ndtr, logsumexp, ndtri_exp

# Share of the samples from the standard normal density itself. It bounds the weights by 1 / PLAIN_SHARE, so that the
# variance of the estimate is finite for every limit-state function.
PLAIN_SHARE = 0.1
BATCH = 2**22  # values of events that are computed at once
MOST_CENTRES, ITERATIONS = 8, 20


class Density(Protocol):
    """A density from which most samples are drawn."""

    def draw(self, generator: np.random.Generator, count: int) -> np.ndarray:
        """Return samples, shape [sample, variable]."""

    def log_ratio(self, normals: np.ndarray) -> np.ndarray:
        """Return the logarithm of the density divided by the standard normal density, shape [sample]."""


@dataclass(eq=False)
class NormalsAtCentres:
    """A mixture of normal densities with unit covariance.

    Args:
        centres: Means, shape [centre, variable].
        shares: Share of each centre [1], shape [centre].
    """

    centres: np.ndarray
    shares: np.ndarray

    def draw(self, generator: np.random.Generator, count: int) -> np.ndarray:
        """Return samples, shape [sample, variable]."""
        chosen = generator.choice(len(self.shares), count, p=self.shares)
        drawn: np.ndarray = generator.standard_normal((count, self.centres.shape[1])) + self.centres[chosen]
        return drawn

    def log_ratio(self, normals: np.ndarray) -> np.ndarray:
        """Return the logarithm of the density divided by the standard normal density, shape [sample]."""
        found: np.ndarray = logsumexp(self.log_parts(normals), axis=1)
        return found

    def log_parts(self, normals: np.ndarray) -> np.ndarray:
        """Return the logarithm of each centre's part of the ratio, shape [sample, centre]."""
        with np.errstate(divide="ignore"):
            found: np.ndarray = normals @ self.centres.T - (self.centres**2).sum(axis=1) / 2 + np.log(self.shares)
        return found


@dataclass(eq=False)
class LinearEvents:
    """Density of standard normal variables under the condition that a linear function exceeds a threshold.

    Event i is |direction_i . z| > distance_i. An event is chosen in proportion to its probability, and z is drawn under
    the condition that it occurs. The ratio to the standard normal density is the number of events that occur, divided
    by the sum of their probabilities.

    Source: Au and Beck (2001), "First excursion probabilities for linear systems by very efficient importance
    sampling", Probabilistic Engineering Mechanics 16.

    Args:
        directions: Unit vectors, shape [event, variable].
        distances: Thresholds [1], shape [event].
    """

    directions: np.ndarray
    distances: np.ndarray

    def draw(self, generator: np.random.Generator, count: int) -> np.ndarray:
        """Return samples, shape [sample, variable]."""
        log_shares = log_ndtr(-self.distances)
        shares = np.exp(log_shares - logsumexp(log_shares))
        chosen = generator.choice(shares.size, count, p=shares / shares.sum())
        drawn: np.ndarray = generator.standard_normal((count, self.directions.shape[1]))
        # A standard normal value beyond the distance, by its upper tail probability.
        tail = np.log1p(-generator.random(count)) + log_shares[chosen]
        beyond = -ndtri_exp(tail) * generator.choice((-1.0, 1.0), count)
        along = self.directions[chosen]
        drawn += (beyond - (drawn * along).sum(axis=1))[:, None] * along
        return drawn

    def log_ratio(self, normals: np.ndarray) -> np.ndarray:
        """Return the logarithm of the density divided by the standard normal density, shape [sample]."""
        batch = max(1, BATCH // self.distances.size)
        parts = [normals[first : first + batch] for first in range(0, len(normals), batch)]
        number = np.concatenate(
            [(np.abs(part @ self.directions.T) > self.distances).sum(axis=1) for part in parts] or [np.zeros(0)]
        )
        log_sum = np.log(2.0) + logsumexp(log_ndtr(-self.distances))
        with np.errstate(divide="ignore"):
            found: np.ndarray = np.log(number) - log_sum
        return found


@dataclass(eq=False)
class WithPlainShare:
    """A mixture of a density and of the standard normal density, which has the share PLAIN_SHARE.

    Args:
        density: The density of the other samples.
        variables: Number of variables.
    """

    density: Density
    variables: int

    def draw(self, generator: np.random.Generator, count: int) -> np.ndarray:
        """Return samples, shape [sample, variable]."""
        plain = int(generator.binomial(count, PLAIN_SHARE))
        drawn = self.density.draw(generator, count - plain)
        return np.concatenate([generator.standard_normal((plain, self.variables)), drawn])

    def weights(self, normals: np.ndarray) -> np.ndarray:
        """Return the standard normal density divided by the density of the samples, shape [sample]."""
        near = np.log1p(-PLAIN_SHARE) + self.density.log_ratio(normals)
        found: np.ndarray = np.exp(-np.logaddexp(np.log(PLAIN_SHARE), near))
        return found


def centred_at(failures: np.ndarray, generator: np.random.Generator) -> NormalsAtCentres:
    """Return the mixture of normal densities with unit covariance that fits failing samples best.

    For each number of centres, the maximum of the likelihood is found by expectation maximisation from a clustering by
    k-means. This minimises the cross entropy of the mixture and the distribution of failing samples. The number of
    centres minimises the Bayesian information criterion.

    Args:
        failures: Failing samples, shape [failure, variable].
        generator: Source of random numbers.
    """
    from scipy.cluster.vq import kmeans2  # its import takes 0.5 s

    count, variables = failures.shape
    best, best_score = None, -np.inf
    for number in range(1, min(MOST_CENTRES, count) + 1):
        centres, cluster = kmeans2(failures, number, minit="++", rng=generator)
        shares = np.bincount(cluster, minlength=number) / count
        mixture = NormalsAtCentres(centres, shares)
        for _ in range(ITERATIONS):
            parts = mixture.log_parts(failures)
            belongs = np.exp(parts - logsumexp(parts, axis=1, keepdims=True))
            shares = belongs.mean(axis=0)
            used = shares * count > 1
            centres = (belongs[:, used].T @ failures) / (count * shares[used, None])
            mixture = NormalsAtCentres(centres, shares[used] / shares[used].sum())
        score = float(mixture.log_ratio(failures).sum()) - number * (variables + 1) / 2 * np.log(count)
        if score > best_score:
            best, best_score = mixture, score
    assert best is not None
    return best
