"""Importance sampling: a small probability from samples that fail more often, with their weights."""

from __future__ import annotations

import numpy as np
import xarray as xr
from numpy.typing import ArrayLike

from warpdyn.answers.fragility.curve_variables import variable
from warpdyn.answers.fragility.lognormal_fit import check_confidence
from warpdyn.answers.reliability.densities import Density, NormalsAtCentres, WithPlainShare, centred_at
from warpdyn.answers.reliability.evaluation import Evaluation, LimitState
from warpdyn.answers.reliability.intervals import probability_variables
from warpdyn.answers.reliability.subset_simulation import levels_of
from warpdyn.foundations.core.checks import finite_numbers, whole_number
from warpdyn.foundations.core.messages import warn_caller
from warpdyn.foundations.core.near_misses import suggests_names
from warpdyn.foundations.core.random_numbers import Purpose

LEAST_SAMPLES = 100
PILOT_SAMPLES, PILOT_PROBABILITY = 4000, 0.1  # of the subset simulation that finds failing samples
MOST_VARIABLES = 40  # of a density that fits failing samples; measured up to this number
FEWEST_FAILURES = 30  # effective number of failing samples below which a standard error is unreliable


@suggests_names
def importance_sampling(
    limit_state: LimitState,
    variables: int | None = None,
    *,
    centres: ArrayLike | None = None,
    samples: int = 10_000,
    confidence: float = 0.95,
    seed: int = 0,
) -> xr.Dataset:
    """Return the small probability that a limit-state function of standard normal variables is negative.

    Samples are drawn from a density under which failure is frequent, and each failing sample counts with its weight:
    the standard normal density divided by the density of the samples. The estimate is unbiased, and its coefficient of
    variation follows from independent samples. 10 % of the samples are drawn from the standard normal density, so that
    no weight exceeds 10.

    Density of the other samples:

    - centres given: a mixture of normal densities with unit covariance, with equal shares;
    - a SceneLimitState under FilteredNoise: linear events. The drift of a linear building is a linear function of the
      normal variables of the noise; samples are drawn under the condition that this drift exceeds its threshold at one
      time (Au and Beck 2001). The coefficient of variation of a sample is then about 1 for any probability. The
      building must be linear up to the limit and have no random parameters; otherwise use `subset_simulation`;
    - otherwise, a mixture of normal densities that fits the failing samples of a subset simulation with 4,000 samples
      per level best (smallest cross entropy), for up to 40 variables. If the subset simulation does not find a part of
      the failure domain, the estimate lacks most of this part.

    Sources: Au and Beck (2001), "First excursion probabilities for linear systems by very efficient importance
    sampling", Probabilistic Engineering Mechanics 16 (linear events); Owen and Zhou (2000), "Safe and effective
    importance sampling", Journal of the American Statistical Association 95 (share of the standard normal density).

    Args:
        limit_state: The limit-state function, negative if a sample fails, see `subset_simulation`; or a
            SceneLimitState.
        variables: Number of standard normal variables; None: that of the SceneLimitState.
        centres: Points near the most probable failures (design points), shape [centre, variable] or [variable]; None:
            chosen as described above.
        samples: Number of samples, at least 100.
        confidence: Probability that the interval covers the true value [1].
        seed: Seed of the samples.

    Returns:
        `probability` [1] with the bounds `probability_lower` and `probability_upper`, `coefficient_of_variation` [1],
        `evaluations` (with those of the subset simulation), `failing_samples`, and `effective_failures`: the number of
        failing samples of equal weight that would give the same coefficient of variation.

    Raises:
        TypeError: If `limit_state` is not a function, or its values are not real numbers.
        ValueError: If an argument is out of its range, a value is NaN, no sample fails, `centres` is None and the scene
            is nonlinear or has random parameters under noise, or there are more than 40 variables; or if the subset
            simulation finds no failing samples (see its errors).

    Example:
        >>> def limit_state(normals):  # failure: the sum of ten variables exceeds 13
        ...     return 13.0 - normals.sum(axis=1)
        >>> found = wd.importance_sampling(limit_state, 10, centres=np.full(10, 1.3), samples=2000, seed=1)
        >>> 0.8 < float(found["probability"]) / 1.97e-5 < 1.2  # exact: 1.97e-5
        True
    """
    check_confidence(confidence)
    function = "importance_sampling"
    evaluation = Evaluation(function, limit_state, variables)
    count = whole_number("samples", samples, 1)
    if count < LEAST_SAMPLES:
        raise ValueError(f"samples={count} are too few: {LEAST_SAMPLES} are the least, and 10,000 are usual")
    evaluation.check_memory(count)
    seed = whole_number("seed", seed, 0)
    generator = np.random.default_rng([seed, Purpose.RARE_EVENTS, 1])
    density, words = _density_of(evaluation, centres, seed, generator)
    mixture = WithPlainShare(density, evaluation.variables)
    normals = mixture.draw(generator, count)
    fails = evaluation(normals) < 0
    if not fails.any():
        raise ValueError(
            f"{function}: none of {count} samples failed, with {words}: give centres= near failures, more samples=, or "
            "use subset_simulation, which finds failures by itself"
        )
    contribution = np.where(fails, mixture.weights(normals), 0.0)
    probability = float(contribution.mean())
    variation = float(contribution.std(ddof=1) / (probability * np.sqrt(count)))
    effective = float(contribution.sum() ** 2 / (contribution**2).sum())
    if effective < FEWEST_FAILURES:
        warn_caller(
            f"{function}: {int(fails.sum())} samples failed, but their weights differ so much that they count as "
            f"{effective:.0f} samples of equal weight. The interval may be far too narrow: give more samples=, other "
            "centres=, or compare with subset_simulation"
        )
    return xr.Dataset(
        {
            **probability_variables(function, probability, variation, evaluation.evaluations, confidence),
            "failing_samples": variable((), int(fails.sum()), "samples that fail"),
            "effective_failures": variable((), effective, "failing samples of equal weight"),
        },
        attrs={
            "analysis": function,
            "variables": evaluation.variables,
            "samples": count,
            "density": words,
            "confidence": float(confidence),
            "seed": seed,
            "interval_method": "lognormal, with the variance of independent weighted samples",
            **getattr(limit_state, "attributes", {}),
        },
    )


def _density_of(
    evaluation: Evaluation, centres: ArrayLike | None, seed: int, generator: np.random.Generator
) -> tuple[Density, str]:
    """Return the density of the samples near failures, and words that describe it."""
    if centres is not None:
        points = np.atleast_2d(finite_numbers("centres", centres))
        if points.ndim != 2 or points.shape[1] != evaluation.variables or not len(points):
            raise ValueError(
                f"centres must have the shape [centre, {evaluation.variables}], one standard normal value per "
                f"variable, got {np.shape(centres)}"
            )
        return NormalsAtCentres(points, np.full(len(points), 1 / len(points))), f"{len(points)} given centres"
    of_scene = getattr(evaluation.limit_state, "linear_events", lambda: None)()
    if of_scene is not None:
        return of_scene
    if evaluation.variables > MOST_VARIABLES:
        raise ValueError(
            f"importance_sampling cannot choose a density for {evaluation.variables} variables, only for up to "
            f"{MOST_VARIABLES}: use subset_simulation, whose error does not depend on the number of variables, or give "
            "centres="
        )
    levels = levels_of(evaluation, PILOT_SAMPLES, PILOT_PROBABILITY, seed)
    density = centred_at(levels.failures, generator)
    return density, f"{len(density.centres)} centres that fit {len(levels.failures)} failing samples"
