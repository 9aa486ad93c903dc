"""Probability that a demand exceeds a limit during a run, from independent samples, with its exact interval."""

from __future__ import annotations

from collections.abc import Mapping
from typing import Any

import numpy as np
import xarray as xr

from warpdyn.answers.fragility.curve_variables import variable
from warpdyn.answers.fragility.demands import damage_of
from warpdyn.answers.fragility.intervals.fractions import clopper_pearson
from warpdyn.answers.fragility.lognormal_fit import check_confidence
from warpdyn.answers.fragility.stripe_counts import decoded_status
from warpdyn.campaigns.reductions.limits import DRIFT, DamageLimits, Limit
from warpdyn.campaigns.running.joining.duplicates import check_samples
from warpdyn.campaigns.running.selections import without_added_places
from warpdyn.foundations.core.checks import check_dataset, true_or_false
from warpdyn.foundations.core.near_misses import suggests_names
from warpdyn.foundations.core.output_variables import COLLAPSED, LARGEST_EXCLUDED_FRACTION

_NEEDED = ("status", "structure")
_LABELS = ("structure", "motion_index")


@suggests_names
def exceedance_probability(
    run: xr.Dataset,
    limits: Mapping[str, Limit],
    *,
    demand: str = DRIFT,
    added_storeys: bool = False,
    confidence: float = 0.95,
) -> xr.Dataset:
    """Return the probability that a sample exceeds a limit during the run (first passage), with its interval.

    The samples must be independent: each sample has its own structure under the same load (such as FilteredNoise, which
    gives each structure a separate random motion), or each sample has its own motion. Then the number of exceeding
    samples has a binomial distribution, and the interval is the exact one of Clopper and Pearson (1934). It is
    conservative (too wide) if the structures are the points of a Sobol sequence. If samples share records, use
    `fragility` or `fragility_of_cloud`, whose intervals account for this.

    A demand is the largest value at the ends of the integration steps, from `record_from` to the end of the run. Values
    between steps do not count, which makes the probabilities of rare events too small by some percent: see the chapter
    "Rare events" of the theory manual. For probabilities below 1e-3 use `subset_simulation`.

    Args:
        run: A run, as `simulate` returned it, or some of its samples.
        limits: Limit of each damage state, from the lightest to the heaviest, in the units of the demand, such as
            `{"threshold": 0.005}`; or limits of several demands, as for `fragility`. A collapsed sample exceeds every
            limit, and only a collapse exceeds `math.inf`.
        demand: Name of the demand to which limits that are plain numbers apply. The storey or floor with the largest
            demand counts.
        added_storeys: Whether storeys of isolators or of a tuned mass damper count as storeys of the building; for a
            LumpedStructure, whether places in the groups "equipment", "absorber" and "soil" count.
        confidence: Probability that the interval covers the true value [1].

    Returns:
        With the dimension `damage_state`: `exceedance_probability` [1] and its bounds `exceedance_probability_lower`
        and `exceedance_probability_upper`, `exceeding_samples` and `damage_limit`; `valid_samples` and
        `excluded_samples` (failed ones). The attribute `peaks_recorded` states the times at which peaks are recorded.

    Raises:
        ValueError: If the samples are not independent, a demand is missing, limits are not positive and increasing,
            more than 1 % of the samples failed, or another argument is out of its range.
        TypeError: If `run` is not a Dataset.

    Example:
        >>> noise = wd.FilteredNoise(wd.WhiteNoise(0.01), duration=10.0, interval=0.02)
        >>> random = wd.simulate(wd.Scene(building, noise, recorders=("drift",)), structures=200, seed=1)
        >>> found = wd.exceedance_probability(random, {"threshold": 0.01})
        >>> names = ("exceedance_probability_lower", "exceedance_probability", "exceedance_probability_upper")
        >>> [float(found[name][0].round(2)) for name in names]
        [0.31, 0.38, 0.45]
    """
    check_dataset("exceedance_probability", run, *_NEEDED, advice="give the result of simulate()", argument="run")
    check_confidence(confidence)
    if not true_or_false("added_storeys", added_storeys):
        run = without_added_places(run)
    if run.sizes.get("sample", 0) == 0:
        raise ValueError(f"exceedance_probability: the run is empty, its sizes are {dict(run.sizes)}")
    checked = DamageLimits.of(limits, demand)
    check_samples("exceedance_probability", run)
    _check_independent(run)
    status = decoded_status(run["status"])
    valid = status <= COLLAPSED
    failed = int((~valid).sum())
    if failed > LARGEST_EXCLUDED_FRACTION * status.size:
        raise ValueError(
            f"exceedance_probability: {failed} of {status.size} samples failed (more than 1 %), perhaps those with the "
            "largest demands: see print(wd.summary(run)), and choose a shorter step= in simulate()"
        )
    passed = damage_of("exceedance_probability", run, checked, status).passed[-1][valid]
    exceeding = (passed[None] >= np.arange(1, len(checked.states) + 1)[:, None]).sum(axis=1)
    lower, upper = clopper_pearson(exceeding, np.full(exceeding.shape, valid.sum()), confidence)
    along = "damage_state"
    variables: dict[str, Any] = {
        "exceedance_probability": variable(along, exceeding / valid.sum(), "probability of exceeding the limit"),
        "exceedance_probability_lower": variable(along, lower, "lower bound of the interval"),
        "exceedance_probability_upper": variable(along, upper, "upper bound of the interval"),
        "exceeding_samples": variable(along, exceeding, "samples that exceed the limit"),
        "valid_samples": variable((), int(valid.sum()), "samples counted, collapsed ones included"),
        "excluded_samples": variable((), failed, "samples that failed"),
    }
    if checked.single:
        units = str(run[checked.single].attrs.get("units", "1"))
        variables["damage_limit"] = variable(along, checked.values[0], f"limit of {checked.single}", units=units)
    states = (along, np.array(checked.states), {"long_name": "damage state"})
    how = f"{100 * confidence:g} %, Clopper and Pearson (1934), independent samples"
    attributes = {"intervals": how, "confidence": confidence, "peaks_recorded": times_of_peaks(run)}
    return xr.Dataset(variables, {along: states}, attributes)


def times_of_peaks(run: xr.Dataset) -> str:
    """Return words that state at which times the peaks of a run are recorded, with its integration steps [s]."""
    words = "at the ends of integration steps"
    if "integration_step" not in run:
        return words
    steps = np.unique(run["integration_step"].values)
    steps = steps[np.isfinite(steps)]
    if not steps.size:
        return words
    return f"{words} of {steps[0]:.6g} s" if steps.size == 1 else f"{words} of {steps[0]:.6g} to {steps[-1]:.6g} s"


def _check_independent(run: xr.Dataset) -> None:
    """Raise a ValueError if two samples share a random motion, or a random structure under several motions."""
    labels = [*_NEEDED, "motion_index"] if "motion_index" in run else _NEEDED  # random motions are not numbered
    for name in labels:
        if run[name].dims != ("sample",):
            raise ValueError(
                f"exceedance_probability: {name!r} has dimensions {run[name].dims}; they must be ('sample',): select "
                "one event by select_event(run, name), and one archetype by select_archetype(run, name)"
            )
    samples = run.sizes["sample"]
    structures, motions = (np.unique(run[name].values).size if name in labels else 1 for name in _LABELS)
    if (motions, structures) in ((samples, 1), (1, samples), (samples, samples)):
        return
    if motions == 1:
        remedy = (
            "select one level by run.isel(sample=run['im_level'].values == level), or use wd.fragility(run, limits)"
        )
    else:
        remedy = (
            "select one structure by run.isel(sample=run['structure'].values == 0), or use wd.fragility(run, limits) "
            "for stripes, whose intervals account for shared records"
        )
    raise ValueError(
        f"exceedance_probability: {samples:,} samples of {structures:,} structures and {motions:,} motions share them, "
        f"so they are not independent, and a binomial interval would be too narrow: {remedy}"
    )
