"""Markov chains of one level of subset simulation: conditional sampling with an adapted spread of the candidates."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np

from warpdyn.answers.reliability.evaluation import Evaluation

# Share of accepted candidates that the spread is adapted to, and the spread before the first adaptation (Papaioannou et
# al. 2015, section 3.4).
BEST_ACCEPTANCE, FIRST_SPREAD = 0.44, 0.6


@dataclass(eq=False)
class Population:
    """The samples of one level, with their values of the limit-state function.

    Args:
        normals: Standard normal values, shape [sample, variable].
        values: Values of the limit-state function, shape [sample].
        ancestors: For this level and each earlier level, the chain of that level from which each sample descends,
            shape [sample]. In the first level each sample is one chain.
        acceptance: Share of accepted candidates [1]; NaN in the first level.
        spread: Standard deviation of the candidates at the end of the level [1].
    """

    normals: np.ndarray
    values: np.ndarray
    ancestors: list[np.ndarray]
    acceptance: float = np.nan
    spread: float = FIRST_SPREAD


def first_population(evaluation: Evaluation, samples: int, generator: np.random.Generator) -> Population:
    """Return the first level: independent samples (plain Monte Carlo)."""
    normals = generator.standard_normal((samples, evaluation.variables))
    return Population(normals, evaluation(normals), [np.arange(samples)])


def next_population(
    evaluation: Evaluation,
    before: Population,
    seeds: np.ndarray,
    threshold: float,
    length: int,
    generator: np.random.Generator,
) -> Population:
    """Return samples of the standard normal distribution, under the condition that the value is at most a threshold.

    Each seed starts a chain. The candidate after z is sqrt(1 - s^2) z + s n with standard normal n and the spread s; it
    replaces z if its value is at most the threshold. All chains advance together, so that one call evaluates the
    candidates of all chains. After each step, ln(s) changes by (acceptance - 0.44) / sqrt(number of the step).

    Source: Papaioannou, Betz, Zwirglmaier and Straub (2015), "MCMC algorithms for subset simulation", Probabilistic
    Engineering Mechanics 41 (adaptive conditional sampling). There, chains run in groups, and the spread is adapted
    after each group.

    Args:
        evaluation: The limit-state function.
        before: The samples of the level before.
        seeds: Indices of samples whose value is at most the threshold, shape [chain].
        threshold: Largest value of the level.
        length: Number of samples of a chain, including its seed.
        generator: Source of random numbers.
    """
    chains, variables = seeds.size, evaluation.variables
    normals, values = np.empty((chains, length, variables)), np.empty((chains, length))
    normals[:, 0], values[:, 0] = before.normals[seeds], before.values[seeds]
    spread, accepted = before.spread, 0
    for place in range(1, length):
        candidate = generator.standard_normal((chains, variables))
        candidate *= spread
        candidate += np.sqrt(1.0 - spread**2) * normals[:, place - 1]
        found = evaluation(candidate)
        is_accepted = found <= threshold
        normals[:, place] = np.where(is_accepted[:, None], candidate, normals[:, place - 1])
        values[:, place] = np.where(is_accepted, found, values[:, place - 1])
        accepted += int(is_accepted.sum())
        spread = min(1.0, spread * float(np.exp((is_accepted.mean() - BEST_ACCEPTANCE) / np.sqrt(place))))
    ancestors = [np.repeat(each[seeds], length) for each in before.ancestors] + [np.repeat(np.arange(chains), length)]
    acceptance = accepted / (chains * (length - 1))
    return Population(normals.reshape(-1, variables), values.ravel(), ancestors, acceptance, spread)
