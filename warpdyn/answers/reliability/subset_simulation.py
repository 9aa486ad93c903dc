"""Subset simulation: a small probability as the product of larger conditional probabilities."""

from __future__ import annotations

from dataclasses import dataclass
from typing import Any

import numpy as np
import xarray as xr
from numpy.typing import ArrayLike

from warpdyn.answers.fragility.curve_variables import variable
from warpdyn.answers.fragility.lognormal_fit import check_confidence
from warpdyn.answers.reliability.chains import first_population, next_population
from warpdyn.answers.reliability.evaluation import Evaluation, LimitState
from warpdyn.answers.reliability.intervals import probability_variables
from warpdyn.answers.reliability.variance import AncestralVariance
from warpdyn.foundations.core.checks import real_number, whole_number
from warpdyn.foundations.core.messages import warn_caller
from warpdyn.foundations.core.near_misses import suggests_names
from warpdyn.foundations.core.random_numbers import Purpose

LEAST_SAMPLES, LEAST_CHAINS = 100, 10
SMALLEST = 1e-15  # probability below which the levels end with an error
LEAST_ACCEPTANCE = 0.05  # chains with fewer accepted candidates hardly move


@dataclass(eq=False)
class Level:
    """Threshold of a level, conditional probability of reaching it with its coefficient of variation, and its chains.

    Args:
        threshold: Value of the limit-state function that the next level starts from; 0 in the last level.
        probability: Conditional probability that the value is below the threshold [1].
        variation: Coefficient of variation of the conditional probability [1].
        acceptance, spread: See `Population`.
    """

    threshold: float
    probability: float
    variation: float
    acceptance: float
    spread: float


@dataclass(eq=False)
class Levels:
    """All levels of a subset simulation.

    Args:
        levels: The levels.
        variation: Coefficient of variation of the probability [1].
        failures: Normal values of the failing samples of the last level, shape [failure, variable].
    """

    levels: list[Level]
    variation: float
    failures: np.ndarray

    @property
    def probability(self) -> float:
        """Probability that the limit-state function is negative [1]."""
        return float(np.prod([each.probability for each in self.levels]))


@suggests_names
def subset_simulation(
    limit_state: LimitState,
    variables: int | None = None,
    *,
    samples: int = 2000,
    level_probability: float = 0.1,
    confidence: float = 0.95,
    seed: int = 0,
) -> xr.Dataset:
    """Return the small probability that a limit-state function of standard normal variables is negative.

    The probability is the product of conditional probabilities of about `level_probability`: the samples with the
    smallest values of a level are the seeds of Markov chains, which sample the next level. A probability of 1e-6 takes
    6 levels. All chains of a level advance together: one call of `limit_state` evaluates one candidate of each chain.

    The limit-state function is a Python function of standard normal values, shape [sample, variable], that returns one
    value per sample, such as capacity minus demand, or a `SceneLimitState` of a scene. It must decrease continuously
    towards failure: a function that is only 1 or -1 leads to no level.

    The coefficient of variation accounts for the correlation of samples in a chain and of chains with a common
    ancestor. The estimate has a positive relative bias of about the square of its coefficient of variation or less.

    Sources: Au and Beck (2001), "Estimation of small failure probabilities in high dimensions by subset simulation",
    Probabilistic Engineering Mechanics 16; Papaioannou et al. (2015), "MCMC algorithms for subset simulation",
    Probabilistic Engineering Mechanics 41 (chains).

    Args:
        limit_state: The limit-state function, negative if a sample fails; or a SceneLimitState.
        variables: Number of standard normal variables; None: that of the SceneLimitState.
        samples: Number of samples per level, a multiple of 1 / level_probability, at least 100.
        level_probability: Share of the samples of a level that are the seeds of the next level [1]: 1 divided by a
            whole number of at least 2.
        confidence: Probability that the interval covers the true value [1].
        seed: Seed of the samples.

    Returns:
        `probability` [1] with the bounds `probability_lower` and `probability_upper`, `coefficient_of_variation` [1]
        and `evaluations`. With the dimension `level`: `threshold`, the value of the limit-state function at the end of
        the level, and `exceedance_probability`, the probability of a value below it; `conditional_probability` with its
        `level_coefficient_of_variation`, `acceptance_rate` and `candidate_spread` of the chains [1] (NaN in the first
        level).

    Raises:
        TypeError: If `limit_state` is not a function, or its values are not real numbers.
        ValueError: If an argument is out of its range, a value is NaN, all samples fail, all values are equal, the
            threshold of a level is not below that of the level before, or the probability is below 1e-15.

    Example:
        >>> def limit_state(normals):  # failure: the sum of ten variables exceeds 13
        ...     return 13.0 - normals.sum(axis=1)
        >>> found = wd.subset_simulation(limit_state, 10, seed=1)
        >>> 0.5 < float(found["probability"]) / 1.97e-5 < 2.0  # exact: 1.97e-5
        True
    """
    check_confidence(confidence)
    evaluation = Evaluation("subset_simulation", limit_state, variables)
    found = levels_of(evaluation, samples, level_probability, seed)
    return xr.Dataset(
        {
            **probability_variables(
                "subset_simulation", found.probability, found.variation, evaluation.evaluations, confidence
            ),
            **_level_variables(found.levels),
        },
        {"level": ("level", np.arange(1, len(found.levels) + 1), {"long_name": "level of subset simulation"})},
        {
            "analysis": "subset_simulation",
            "variables": evaluation.variables,
            "samples_per_level": samples,
            "confidence": float(confidence),
            "seed": seed,
            "interval_method": "lognormal, with the variance between groups of samples of common ancestors",
            **getattr(limit_state, "attributes", {}),
        },
    )


def levels_of(evaluation: Evaluation, samples: int, level_probability: float, seed: int) -> Levels:
    """Return the levels of a subset simulation; see `subset_simulation` for the arguments and errors."""
    function = evaluation.function
    count, length = _checked_sizes(samples, level_probability)
    generator = np.random.default_rng([whole_number("seed", seed, 0), Purpose.RARE_EVENTS])
    evaluation.check_memory(count)
    population = first_population(evaluation, count, generator)
    _check_first(function, population.values)
    variance, levels = AncestralVariance(count), list[Level]()
    remaining = 1.0
    while True:
        failures = int((population.values < 0).sum())
        is_last = failures * length >= count
        threshold = 0.0 if is_last else _threshold(population.values, count // length)
        is_below = population.values < 0 if is_last else population.values <= threshold
        if levels and not threshold < levels[-1].threshold:
            raise ValueError(
                f"{function}: level {len(levels) + 1} does not progress: its threshold, {threshold:.6g}, is that of "
                f"the level before, because {1 / length:.0%} of the samples or more have this value: return a "
                "limit-state function that decreases continuously towards failure, such as capacity - demand instead "
                "of 1 or -1, or without an upper bound of the demand"
            )
        variation = variance.add(is_below, population.ancestors)
        probability = float(is_below.mean())
        levels.append(Level(threshold, probability, variation, population.acceptance, population.spread))
        remaining *= probability
        if is_last:
            break
        if remaining < SMALLEST:
            raise ValueError(
                f"{function}: the probability is below {SMALLEST:g}: after {len(levels)} levels the threshold is "
                f"{threshold:.4g}, from {levels[0].threshold:.4g} in the first level, and failure is a value below 0. "
                "Check the sign and the limit of limit_state; perhaps no sample can fail"
            )
        seeds = np.flatnonzero(is_below)
        if seeds.size > count // length:  # several samples with the value of the threshold
            seeds = np.sort(generator.permutation(seeds)[: count // length])
        population = next_population(evaluation, population, seeds, threshold, length, generator)
    _warn_of_stuck_chains(function, levels)
    return Levels(levels, variance.coefficient_of_variation, population.normals[population.values < 0])


def _checked_sizes(samples: object, level_probability: object) -> tuple[int, int]:
    """Return the number of samples per level and of samples per chain, or raise a ValueError."""
    count = whole_number("samples", samples, 1)
    probability = real_number("level_probability", level_probability, above=0)
    length = round(1 / probability)
    if length < 2 or abs(length * probability - 1) > 1e-9:
        raise ValueError(
            f"level_probability must be 1 divided by a whole number of at least 2, such as 0.1 or 0.2, got "
            f"{probability:g}"
        )
    least = max(LEAST_SAMPLES, LEAST_CHAINS * length)
    if count < least:
        raise ValueError(
            f"samples={count} per level are too few: {LEAST_CHAINS} chains and {LEAST_SAMPLES} samples are the least, "
            f"and 1,000 or more are usual: give samples={max(1000, least)}"
        )
    if count % length:
        raise ValueError(
            f"samples must be a multiple of {length} (1 / level_probability), so that all chains have {length} "
            f"samples, got {count}: give samples={-(-count // length) * length}"
        )
    return count, length


def _check_first(function: str, values: np.ndarray) -> None:
    """Raise a ValueError if all samples of the first level fail, or have the same value."""
    if (values < 0).all():
        raise ValueError(
            f"{function}: limit_state is negative for all {values.size} samples, so that all of them fail: its sign "
            "may be wrong; it must be negative only if a sample fails, such as capacity - demand"
        )
    if values.min() == values.max():
        raise ValueError(
            f"{function}: limit_state is {values[0]:g} for all {values.size} samples: it must depend on the standard "
            "normal values and decrease continuously towards failure"
        )


def _threshold(values: np.ndarray, seeds: int) -> float:
    """Return the threshold of a level: the mean of the largest value of the seeds and the next value."""
    ordered = np.partition(values, (seeds - 1, seeds))[seeds - 1 : seeds + 1]
    return float(ordered.mean()) if np.isfinite(ordered).all() else float(ordered[0])


def _warn_of_stuck_chains(function: str, levels: list[Level]) -> None:
    """Warn if the chains of a level accepted few candidates."""
    stuck = [number for number, level in enumerate(levels, 1) if level.acceptance < LEAST_ACCEPTANCE]
    if stuck:
        warn_caller(
            f"{function}: the chains of level {', '.join(map(str, stuck))} accepted less than {LEAST_ACCEPTANCE:.0%} "
            "of the candidates, so that they hardly move and the interval may be too narrow: the failure domain may "
            "consist of narrow parts. Give more samples=, and compare several seeds"
        )


def _level_variables(levels: list[Level]) -> dict[str, Any]:
    """Return the variables of all levels."""
    conditional = np.array([each.probability for each in levels])
    rows: dict[str, tuple[ArrayLike, str]] = {
        "threshold": ([each.threshold for each in levels], "value of the limit-state function at the end of the level"),
        "exceedance_probability": (np.cumprod(conditional), "probability of a value below the threshold"),
        "conditional_probability": (conditional, "probability of a value below the threshold within the level"),
        "level_coefficient_of_variation": (
            [each.variation for each in levels],
            "coefficient of variation of the conditional probability",
        ),
        "acceptance_rate": ([each.acceptance for each in levels], "share of accepted candidates of the chains"),
        "candidate_spread": (
            [each.spread if np.isfinite(each.acceptance) else np.nan for each in levels],
            "standard deviation of the candidates of the chains",
        ),
    }
    return {name: variable("level", values, words) for name, (values, words) in rows.items()}
