"""Posterior samples of fragility curves, drawn by the Metropolis sampler of pyFragility."""

from __future__ import annotations

from collections.abc import Mapping
from typing import Any

import numpy as np
import xarray as xr

from warpdyn.answers.fragility.curve_variables import fit_flags, variable
from warpdyn.answers.fragility.estimators import ESTIMATORS, FIT_MEANINGS, LOGNORMAL
from warpdyn.answers.fragility.intervals.extrapolation import sentences, status_attributes
from warpdyn.answers.fragility.lognormal_fit import FITTED, check_confidence, levels_to_add
from warpdyn.answers.fragility.maximum_likelihood.newton import covariance_of_influences
from warpdyn.answers.fragility.reduced_counts import is_reduced, labels_of_run, limits_of
from warpdyn.answers.fragility.stripe_counts import StripeCounts, count_stripes
from warpdyn.campaigns.reductions.limits import DRIFT, DamageLimits, Limit
from warpdyn.campaigns.running.selections import without_added_places
from warpdyn.foundations.core.checks import (
    MOST_REPLICATES,
    check_dataset,
    one_of,
    shortened,
    true_or_false,
    whole_number,
)
from warpdyn.foundations.core.messages import warn_of_all
from warpdyn.foundations.core.near_misses import suggests_names
from warpdyn.foundations.core.output_variables import (
    EXTRAPOLATED,
    MEDIAN_STATUS,
    NO_MEDIAN,
    WITHIN_LEVELS,
    measure_of_dataset,
)
from warpdyn.foundations.core.units import unit_attributes

PRIORS = {"median": "theta", "dispersion": "beta"}  # names of the parameters, with their names in pyFragility
_BURN_IN = 2000  # number of discarded draws during which the sampler adapts
_UNBOUNDED = 20.0  # a draw with this dispersion indicates an improper posterior: the sampler moves away without end


@suggests_names
def fragility_posterior(
    dataset: xr.Dataset,
    limits: Mapping[str, Limit] | None = None,
    *,
    demand: str = DRIFT,
    priors: Mapping[str, Any] | None = None,
    added_storeys: bool = False,
    draws: int = 4000,
    confidence: float = 0.95,
    seed: int = 0,
) -> xr.Dataset:
    """Draw lognormal fragility curves from their posterior distribution for a run on stripes.

    Samples of one record are correlated. Therefore the log-likelihood of each damage state is divided by a design
    effect: the ratio of the cluster-robust variance to the variance for independent samples, as the mean of the ratios
    for ln(median) and ln(dispersion). The width of the posterior then includes the variance among records (calibrated
    composite likelihood: Pauli, Racugno and Ventura 2011, Statistica Sinica 21). The sampler is pyFragility's adaptive
    random-walk Metropolis.

    Args:
        dataset: A run on stripes, as for `fragility`.
        limits: Limit of each damage state, from the lightest to the heaviest, in the form described in `fragility`.
        demand: Name of the demand to which limits that are plain numbers apply.
        priors: Prior distributions of "median" [g, or the unit of the levels] and "dispersion" [1] of every damage
            state, as frozen distributions of scipy.stats; flat priors by default.
        added_storeys: Whether storeys of isolators or of a tuned mass damper count, as in `fragility`.
        draws: Number of draws, in addition to 2,000 discarded ones during which the sampler adapts.
        confidence: Probability of the credible intervals [1].
        seed: Seed of the sampler.

    Returns:
        `fragility_median` and `fragility_dispersion`, the medians of the draws, with their credible intervals;
        `replicate_median` and `replicate_dispersion`, the draws; `design_effect` [1]; and `effective_draws`, the
        equivalent number of independent draws. The values are NaN for a damage state without a maximum-likelihood fit,
        at which the sampler starts. They are also NaN for a state whose posterior is improper, which is common with
        flat priors and few records.

    Raises:
        ImportError: If pyFragility is not installed.
        ValueError, TypeError: As in `fragility`; or if a key of `priors` is unknown, or a prior is not a distribution.

    Example:
        >>> from scipy.stats import lognorm
        >>> drawn = wd.fragility_posterior(run, limits, priors={"dispersion": lognorm(0.3, scale=0.4)}, draws=500)
        >>> dict(drawn["replicate_median"].sizes)
        {'replicate': 500, 'damage_state': 2}
    """
    check_dataset("fragility_posterior", dataset, advice="give the result of simulate()")
    if not true_or_false("added_storeys", added_storeys):
        dataset = without_added_places(dataset)
    try:
        import pyFragility
    except ImportError as error:
        raise ImportError('fragility_posterior needs pyFragility: pip install "pyFragility>=0.2"') from error
    draws, seed = whole_number("draws", draws, 100, MOST_REPLICATES), whole_number("seed", seed, 0)
    check_confidence(confidence)
    if priors is not None and not isinstance(priors, Mapping):
        raise TypeError(
            f"priors must map 'median' or 'dispersion' to a distribution of scipy.stats, got {shortened(priors)}"
        )
    priors = {} if priors is None else dict(priors)
    for name, distribution in priors.items():
        one_of("prior", name, tuple(PRIORS))
        if not hasattr(distribution, "logpdf"):
            raise TypeError(
                f"the prior of {name!r} must be a distribution, such as scipy.stats.lognorm(0.3, scale=0.4)"
            )
    checked = limits_of(dataset, limits, demand)
    counts = count_stripes(dataset, checked)
    labels = labels_of_run(dataset) if is_reduced(dataset) else dataset
    exceeding = np.moveaxis(counts.of_records[:, :, -1], 1, -1)  # at the worst place, [record, damage_state, im_level]
    total = counts.valid.sum(axis=1)[:, None, :]
    estimator = ESTIMATORS["lognormal"]
    fit = estimator.fit(counts.levels, exceeding.sum(axis=0), total.sum(axis=0))
    outcome = fit[2]
    cells = counts.exceeding[:, :, :, -1]
    influences, independent = estimator.influences(counts.levels, cells, counts.valid, *fit[:2])
    variance = np.einsum("iis->is", covariance_of_influences(influences.sum(axis=1)))
    ratio = (variance / independent).mean(axis=0)
    effect = np.where(outcome == FITTED, np.where(ratio > 1.0, ratio, 1.0), np.nan)  # 1 also for a single record
    effective = np.full(outcome.size, np.nan)
    found = np.full((2, draws, outcome.size), np.nan)
    improper: list[str] = []
    for state in np.flatnonzero(outcome == FITTED):
        some = exceeding.sum(axis=0)[state], total.sum(axis=0)[0]
        there = some[1] > 0
        best = pyFragility.fit_msa(counts.levels[there], some[0][there], some[1][there])
        of_parameters = {PRIORS[name]: distribution for name, distribution in priors.items()}
        prior = pyFragility.independent_priors(best.likelihood, **of_parameters)

        def log_prior(
            parameters: np.ndarray, best: Any = best, prior: Any = prior, share: float = 1.0 / effect[state]
        ) -> float:
            # pyFragility adds the log-likelihood itself; add the negative part that the design effect removes.
            return prior(parameters) - (1.0 - share) * best.likelihood.loglik(parameters)

        with np.errstate(over="ignore", invalid="ignore"):  # draws that are not finite are reported below
            posterior = best.posterior(log_prior=log_prior, n_samples=draws, burn_in=_BURN_IN, seed=seed)
            independent_draws = posterior.effective_sample_size().min()
        if np.isfinite(independent_draws) and posterior.params[:, 1].max() < _UNBOUNDED:
            found[:, :, state], effective[state] = posterior.params.T, independent_draws
        else:
            improper.append(checked.states[state])
    ends = float(counts.levels[0]), float(counts.levels[-1])
    middle = np.median(found[0], axis=0)
    status = np.where((middle < ends[0]) | (middle > ends[1]), EXTRAPOLATED, WITHIN_LEVELS)
    status = np.where(np.isfinite(middle), status, NO_MEDIAN).astype(np.int8)
    remarks = sentences(checked.states, status, outcome, middle, *ends, counts.units)
    remarks += [
        f"the posterior of damage state {name!r} is improper, because the data bound neither its median nor its "
        f'dispersion: give priors={{"median": ..., "dispersion": ...}}'
        for name in improper
    ]
    _warn(checked, counts, outcome, remarks)
    return _labelled(checked, counts, found, outcome, status, effect, effective, confidence, seed, labels)


def _warn(limits: DamageLimits, counts: StripeCounts, outcome: np.ndarray, remarks: list[str]) -> None:
    found = [*remarks]
    if len(counts.valid) == 1:
        found.append(
            "the run has only one record: its samples count as independent, although they are correlated: add records"
        )
    for state, name in enumerate(limits.states):
        if outcome[state] != FITTED:
            advice = levels_to_add(counts.levels, counts.total[-1, state], counts.trials, counts.units)
            found.append(
                f"damage state {name!r} has no posterior, because it has no maximum-likelihood fit: "
                f"{FIT_MEANINGS[outcome[state]]}{'; ' if advice else ''}{advice}"
            )
    warn_of_all("fragility_posterior", found)


def _labelled(
    limits: DamageLimits,
    counts: StripeCounts,
    found: np.ndarray,
    outcome: np.ndarray,
    status: np.ndarray,
    effect: np.ndarray,
    effective: np.ndarray,
    confidence: float,
    seed: int,
    dataset: xr.Dataset,
) -> xr.Dataset:
    """Return the dataset of the posterior draws; `found` contains medians and dispersions, [2, draw, damage_state]."""
    of_measure = unit_attributes(counts.units)
    state, of_draws = "damage_state", ("replicate", "damage_state")
    start, position = "outcome of the fit at which the sampler starts", "position of the median among the levels"
    divisor = "divisor of the log-likelihood, because samples share records"
    variables: dict[str, tuple] = {
        "fit_status": variable(state, outcome, start, **fit_flags()),
        MEDIAN_STATUS: variable(state, status, position, **status_attributes()),
        "design_effect": variable(state, effect, divisor),
        "effective_draws": variable(state, effective, "equivalent number of independent draws"),
    }
    tail = 0.5 - 0.5 * confidence
    for name, values, of_unit in zip(("median", "dispersion"), found, (of_measure, {"units": "1"}), strict=True):
        low, middle, high = np.quantile(values, [tail, 0.5, 1.0 - tail], axis=0)
        for suffix, part, words in (
            ("", middle, "posterior median of the"),
            ("_lower", low, f"lower bound of the {100 * confidence:g} % credible interval of the"),
            ("_upper", high, f"upper bound of the {100 * confidence:g} % credible interval of the"),
        ):
            variables[f"fragility_{name}{suffix}"] = variable(state, part, f"{words} {name}", **of_unit)
        variables[f"replicate_{name}"] = variable(of_draws, values, f"posterior draw of the {name}", **of_unit)
    return xr.Dataset(
        variables,
        {"damage_state": ("damage_state", np.array(limits.states), {"long_name": "damage state"})},
        {
            **measure_of_dataset(dataset),
            "demand": ", ".join(limits.demands),
            "fragility_method": "posterior of lognormal curves through stripes, by pyFragility's Metropolis sampler",
            "fragility_shape": LOGNORMAL.name,
            "interval_method": "quantiles of the posterior, its likelihood divided by the design effect of the records",
            "confidence": float(confidence),
            "replicates_seed": seed,
        },
    )
