"""Tempered sequential Monte Carlo: samples of a posterior distribution, and the evidence of the model.

Samples are moved from the prior to the posterior through targets prior x likelihood^p, with p from 0 to 1 (transitional
Markov chain Monte Carlo: Ching and Chen 2007, Journal of Engineering Mechanics 133). The next p makes the coefficient
of variation of the weights 1. The evidence is the product of the mean weights. All samples are candidates of one call
of the likelihood, so that a step of all Markov chains is one launch.

The variables are standard normal under the prior; priors map them to parameters. Differences from Ching and Chen: the
weights of the proposal's covariance are normalised; every resampled sample has its own Markov chain; two kinds of
proposals alternate; and the chains continue until the samples have forgotten where they started.
"""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import dataclass, field

import numpy as np

from warpdyn.campaigns.inference.resampling import effective_sample_size, family_variance, normalised, systematic
from warpdyn.foundations.core.interruption import stop_if_asked

VARIATION = 1.0  # coefficient of variation of the weights of a stage
FORGOTTEN = 0.1  # a stage ends if start and present values of each variable have at most this correlation ...
FEWEST_SWEEPS, MOST_SWEEPS = 4, 60  # ... after at least and at most this number of Metropolis steps
WANTED_ACCEPTANCE = {"walk": 0.25, "autoregressive": 0.5}
LARGEST_SHARE = 0.999  # of new noise in an autoregressive proposal
INFLATION = 1.05  # of the covariance of autoregressive proposals, so that they reach the tails of the target

LogLikelihood = Callable[[np.ndarray], np.ndarray]


@dataclass
class Tempered:
    """Samples of a posterior, and the record of the stages.

    Attributes:
        normals: Standard normal variables of the samples, shape [sample, variable].
        log_likelihood: Logarithm of the likelihood, shape [sample].
        ancestors: First ancestor of each sample.
        log_evidence: Logarithm of the evidence.
        evidence_variance: Variance of the log evidence.
        allowed_share: Share of prior samples with a likelihood above 0 [1].
        exponent, sweeps, acceptance, effective, log_mean_weight: Of each stage: p, number of Metropolis steps, share of
            accepted proposals [1], effective sample size before resampling, and logarithm of the mean weight.
        forgotten: Largest correlation [1] of start and end of the Markov chains in each stage.
        evaluations: Number of calculated likelihoods.
    """

    normals: np.ndarray
    log_likelihood: np.ndarray
    ancestors: np.ndarray
    log_evidence: float = 0.0
    evidence_variance: float = 0.0
    allowed_share: float = 1.0
    exponent: list[float] = field(default_factory=list)
    sweeps: list[int] = field(default_factory=list)
    acceptance: list[float] = field(default_factory=list)
    effective: list[float] = field(default_factory=list)
    log_mean_weight: list[float] = field(default_factory=list)
    forgotten: list[float] = field(default_factory=list)
    evaluations: int = 0


class Proposals:
    """Proposals of Metropolis steps that follow the covariance of the weighted samples of a stage.

    A random walk adds normal noise. An autoregressive proposal is reversible with respect to the normal distribution
    with the samples' mean and (slightly enlarged) covariance: if the target is nearly normal, almost all of these
    proposals are accepted, however far they lead.

    Args:
        dimension: Number of variables.
        random: Generator of random numbers.
    """

    def __init__(self, dimension: int, random: np.random.Generator) -> None:
        self.random = random
        self.scale = 2.38 / np.sqrt(dimension)
        self.share = 0.9
        self.mean: np.ndarray = np.zeros(dimension)
        self.factor: np.ndarray = np.eye(dimension)
        self.inverse: np.ndarray = np.eye(dimension)

    def fit(self, normals: np.ndarray, weights: np.ndarray) -> None:
        """Set mean and covariance to those of samples [sample, variable] with weights of sum 1."""
        self.mean = weights @ normals
        centred = normals - self.mean
        covariance = (weights[:, None] * centred).T @ centred
        spread = np.trace(covariance) / len(covariance)
        self.factor = np.linalg.cholesky(covariance + 1e-10 * max(spread, 1e-30) * np.eye(len(covariance)))
        self.inverse = np.linalg.inv(self.factor)

    def _distance(self, normals: np.ndarray) -> np.ndarray:
        """Return minus twice the logarithm of the enlarged normal density, except for a constant."""
        return np.sum(np.square((normals - self.mean) @ self.inverse.T), axis=1) / INFLATION

    def propose(self, normals: np.ndarray, kind: str) -> tuple[np.ndarray, np.ndarray]:
        """Return proposals and the logarithms of their correction of the acceptance ratio, shape [sample]."""
        noise = self.random.standard_normal(normals.shape) @ self.factor.T
        if kind == "walk":
            return normals + self.scale * noise, np.zeros(len(normals))
        kept = np.sqrt(1 - self.share**2)
        proposed = self.mean + kept * (normals - self.mean) + self.share * np.sqrt(INFLATION) * noise
        return proposed, 0.5 * (self._distance(proposed) - self._distance(normals))

    def adapt(self, kind: str, acceptance: float) -> None:
        """Change the size of proposals according to the share of accepted ones."""
        change = acceptance - WANTED_ACCEPTANCE[kind]
        if kind == "walk":
            self.scale *= float(np.exp(change))
        else:
            odds = np.log(self.share / (1 - self.share)) + 2 * change
            self.share = min(float(1 / (1 + np.exp(-odds))), LARGEST_SHARE)


def temper(log_likelihood: LogLikelihood, dimension: int, count: int, random: np.random.Generator) -> Tempered:
    """Return samples of the posterior of variables that are standard normal under the prior.

    Args:
        log_likelihood: Function of variables, shape [sample, variable], that returns the logarithms of their
            likelihoods, shape [sample]; -inf for a sample that is not possible.
        dimension: Number of variables.
        count: Number of samples.
        random: Generator of random numbers.

    Raises:
        ValueError: If the likelihood of every sample of the prior is 0.
    """
    normals = random.standard_normal((count, dimension))
    found = Tempered(normals, log_likelihood(normals), np.arange(count), evaluations=count)
    possible = np.isfinite(found.log_likelihood)
    found.allowed_share = float(possible.mean())
    if not possible.any():
        raise ValueError(
            f"the likelihood of all {count} samples of the prior is 0: the model fails, or its parameters contradict "
            "each other, for every sample. Correct the priors"
        )
    proposals, exponent = Proposals(dimension, random), 0.0
    if not possible.all():  # stage without likelihood, which removes impossible samples
        stage(found, np.where(possible, 0.0, -np.inf), 0.0, proposals, log_likelihood)
    while exponent < 1.0:
        following = next_exponent(found.log_likelihood, exponent)
        stage(found, (following - exponent) * found.log_likelihood, following, proposals, log_likelihood)
        exponent = following
    return found


def next_exponent(log_likelihood: np.ndarray, exponent: float) -> float:
    """Return the next p, at most 1: the weights likelihood^(p - exponent) have the variation VARIATION."""
    above = log_likelihood - log_likelihood.max()

    def variation(p: float) -> float:
        weights = np.exp((p - exponent) * above)
        return float(weights.std() / weights.mean())

    if variation(1.0) <= VARIATION:
        return 1.0
    low, high = exponent, 1.0
    while high - low > 1e-6 * (high - exponent) and low < (middle := 0.5 * (low + high)) < high:
        low, high = (middle, high) if variation(middle) < VARIATION else (low, middle)
    return high


def stage(
    found: Tempered, log_weights: np.ndarray, exponent: float, proposals: Proposals, log_likelihood: LogLikelihood
) -> None:
    """Weight, resample and move all samples; the target of the moves is prior x likelihood^exponent."""
    weights, log_mean = normalised(log_weights)
    found.log_evidence += log_mean
    found.evidence_variance = float(family_variance(weights, found.ancestors))
    proposals.fit(found.normals, weights)
    chosen = systematic(weights, proposals.random.random())
    found.normals, found.ancestors = found.normals[chosen], found.ancestors[chosen]
    found.log_likelihood = found.log_likelihood[chosen]
    enough = max(FORGOTTEN, 2.5 / np.sqrt(len(chosen)))  # correlations of independent samples are not exactly 0
    start, accepted, sweeps, remaining = _state(found), [], 0, 1.0
    while sweeps < FEWEST_SWEEPS or (remaining > enough and sweeps < MOST_SWEEPS):
        stop_if_asked()
        kind = ("autoregressive", "walk")[sweeps % 2]
        accepted.append(_sweep(found, exponent, proposals, kind, log_likelihood))
        proposals.adapt(kind, accepted[-1])
        sweeps += 1
        remaining = _correlation(start, _state(found))
    found.exponent.append(exponent)
    found.sweeps.append(sweeps)
    found.acceptance.append(float(np.mean(accepted)))
    found.effective.append(effective_sample_size(weights))
    found.log_mean_weight.append(log_mean)
    found.forgotten.append(remaining)


def _sweep(found: Tempered, exponent: float, proposals: Proposals, kind: str, log_likelihood: LogLikelihood) -> float:
    """Make one Metropolis step of every sample; return the share of accepted proposals."""
    proposed, correction = proposals.propose(found.normals, kind)
    likelihood = log_likelihood(proposed)
    found.evaluations += len(proposed)
    prior = 0.5 * np.sum(np.square(found.normals) - np.square(proposed), axis=1)
    possible = np.isfinite(likelihood)
    gain = np.where(possible, likelihood, 0.0) - found.log_likelihood
    ratio = np.where(possible, exponent * gain + prior + correction, -np.inf)
    accept = np.log(proposals.random.random(len(proposed))) < ratio
    found.normals = np.where(accept[:, None], proposed, found.normals)
    found.log_likelihood = np.where(accept, likelihood, found.log_likelihood)
    return float(accept.mean())


def _state(found: Tempered) -> np.ndarray:
    """Return the variables and the log-likelihood of the samples, which Markov chains must forget, [sample, value]."""
    return np.column_stack([found.normals, found.log_likelihood])


def _correlation(start: np.ndarray, end: np.ndarray) -> float:
    """Return the largest correlation of a variable's values in two sets of samples [sample, variable]."""
    first, second = start - start.mean(axis=0), end - end.mean(axis=0)
    size = np.sqrt(np.sum(np.square(first), axis=0) * np.sum(np.square(second), axis=0))
    return float(np.max(np.sum(first * second, axis=0) / np.maximum(size, 1e-300)))
