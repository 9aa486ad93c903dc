"""Standard errors of fragility curves by a jackknife over records and structures (Miller 1974).

Every structure runs under every record, so samples share both. The fits without one record at a time give the variance
among records, and the fits without one structure at a time give the variance among structures. Both contain the
variance of the interaction, which is counted only once. If structures are not shared by records (nested design), only
records are left out. Records that were selected for one level each are compared only with records of the same level.
The bias that the jackknife estimates is subtracted, and intervals use quantiles of Student's t: with 22 records,
percentiles of a bootstrap are too narrow and too low, above all for dispersions (measured coverages:
docs/explanation/intervals.md).
"""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import dataclass
from functools import cached_property

import numpy as np
from scipy.special import gammaincinv, stdtrit

from warpdyn.answers.fragility.estimators.table import Estimator
from warpdyn.answers.fragility.lognormal_fit import FITTED
from warpdyn.answers.fragility.maximum_likelihood.newton import covariance_of_influences
from warpdyn.answers.fragility.stripe_counts import StripeCounts

FARTHEST_DRAW = float(np.log(4.0))  # draws are within 1/4 to 4 times the estimate, or within its interval if wider
FEWEST_KNOWN = 4.0  # up to this number of degrees of freedom, Student's t is far wider than a normal distribution
# With 7 degrees of freedom, a 95 % interval is 1.2 times as wide as for a normal distribution.
ENOUGH_STRUCTURES = "8 groups: 8 structures by Monte Carlo, 32 of a Sobol sequence"
SOURCES = ("record", "structure", "record and structure")  # sources of variance; the integration step is another one


@dataclass(frozen=True, eq=False)
class RecordNumbers:
    """Random numbers of records, by which the draws of fits to different samples under the same records are joint.

    Args:
        records: Labels of the records, increasing, shape [record].
        normal: Standard normal numbers, shape [draw, record].
        uniform: Probability of the chi-squared value of each draw, shape [draw].
    """

    records: np.ndarray
    normal: np.ndarray
    uniform: np.ndarray

    @classmethod
    def of(cls, records: np.ndarray, count: int, seed: int) -> RecordNumbers:
        """Return the numbers for `count` draws with a seed; arguments: see the class."""
        generator = np.random.default_rng(seed)
        return cls(records, generator.standard_normal((count, records.size)), generator.uniform(size=count))

    def of_records(self, records: np.ndarray) -> np.ndarray:
        """Return the normal numbers of some of the records, shape [draw, record]."""
        return self.normal[:, np.searchsorted(self.records, records)]


@dataclass(frozen=True, eq=False)
class Spread:
    """Sampling distribution of estimates of any shape [...], from a jackknife.

    Args:
        centre: The estimates minus their bias.
        by_source: Variance from each of `SOURCES`, shape [3, ...].
        freedom: Degrees of freedom of the total variance, shape [...].
        deviations: Deviations for each record and group that was left out; the sum of their squares is the total
            variance, shape [unit, ...].
    """

    centre: np.ndarray
    by_source: np.ndarray
    freedom: np.ndarray
    deviations: np.ndarray

    @property
    def standard_error(self) -> np.ndarray:
        """Square root of the total variance, shape [...]."""
        return np.sqrt(self.by_source.sum(axis=0))

    def interval(self, confidence: float) -> np.ndarray:
        """Return the lower and the upper bound of the interval, shape [2, ...]; NaN if the variance is unknown."""
        half = stdtrit(self.freedom, 0.5 + 0.5 * confidence) * self.standard_error
        return np.stack([self.centre - half, self.centre + half])

    def draw(
        self,
        count: int,
        seed: int,
        confidence: float,
        records: np.ndarray | None = None,
        numbers: RecordNumbers | None = None,
    ) -> np.ndarray:
        """Return draws from the joint distribution of all estimates, shape [count, ...].

        Each estimate has the Student's t distribution of its interval, with its own degrees of freedom; the estimates
        are correlated like the deviations (grouped t copula, Daul and others 2003, Risk 16(11)). Tails are cut off at
        the bounds of the interval or at `FARTHEST_DRAW` from the centre, whichever is farther. Otherwise the heavy
        tails for few degrees of freedom would give implausible medians and dispersions.

        Args:
            count: Number of draws.
            seed: Seed of the draws.
            confidence: Coverage of the interval at whose bounds tails are cut off [1].
            records: Labels of the records, which are the first units of the deviations.
            numbers: Random numbers of these records. None: from the seed, like those of groups of structures.
        """
        generator = np.random.default_rng(seed)
        normal = generator.standard_normal((count, len(self.deviations)))
        if numbers is not None and records is not None and len(self.deviations):
            normal[:, : records.size] = numbers.of_records(records)
        finite = np.nan_to_num(self.deviations, posinf=0.0, neginf=0.0).reshape(len(self.deviations), self.centre.size)
        sums = (normal @ finite).reshape((count, *self.centre.shape))
        uniform = generator.uniform(size=count) if numbers is None else numbers.uniform
        probability = uniform.reshape(-1, *[1] * self.centre.ndim)
        freedom = np.where(np.isfinite(self.freedom), self.freedom, 1.0)
        with np.errstate(divide="ignore", invalid="ignore"):
            # Chi-squared values of all estimates at the same probability, with the degrees of freedom of each estimate.
            stretch = np.sqrt(freedom / (2.0 * gammaincinv(0.5 * freedom, probability)))
            steps = np.where(sums == 0.0, 0.0, sums * stretch)
        lower, upper = self.interval(confidence)
        farthest = np.fmax(0.5 * (upper - lower), FARTHEST_DRAW)
        return self.centre + np.clip(steps, -farthest, farthest)


@dataclass(frozen=True, eq=False)
class LeftOut:
    """Fits of fragility curves to all samples, and to the samples without each record and each group of structures.

    Args:
        whole: ln(median) and ln(dispersion) of the fit to all samples, shape [2, row ...].
        records: ln(median) and ln(dispersion) of the fits without each record, shape [record, 2, row ...].
        groups: ln(median) and ln(dispersion) of the fits without each group of structures, shape [group, 2, row ...];
            empty for nested designs.
        interaction: Variance of both logarithms from the interaction of record and structure, shape [2, row ...].
        binomial: Variance of both logarithms if all samples were independent, shape [2, row ...].
        influences: First-order contribution of each record to both logarithms, shape [record, 2, row ...].
        strata: Number of the stratum of each record, shape [record]; None: one stratum. See `strata_of_records`.
    """

    whole: np.ndarray
    records: np.ndarray
    groups: np.ndarray
    interaction: np.ndarray
    binomial: np.ndarray
    influences: np.ndarray
    strata: np.ndarray | None = None

    @cached_property
    def worst(self) -> LeftOut:
        """The fits at the worst storey or floor only (the last index of the places)."""
        at = (slice(None), slice(None), -1)
        parts = self.whole[:, -1], self.records[at], self.groups[at]
        return LeftOut(*parts, self.interaction[:, -1], self.binomial[:, -1], self.influences[at], self.strata)

    @cached_property
    def spread(self) -> Spread:
        """Sampling distribution of ln(median) and ln(dispersion)."""
        return spread_of(self.whole, self.records, self.groups, self.interaction, self.strata)

    @property
    def sandwich(self) -> np.ndarray:
        """Cluster-robust variance of ln(median) and ln(dispersion), with records as clusters, shape [2, row ...]."""
        return np.einsum("ii...->i...", covariance_of_influences(self.influences))


def leave_out(
    counts: StripeCounts, estimator: Estimator, *, over_structures: bool = True
) -> tuple[LeftOut, np.ndarray]:
    """Return curves fitted to all samples, and to the samples without each record or group of structures.

    Args:
        counts: Numbers of samples by record, structure group, stripe, place (storey or floor) and damage state.
        estimator: Method of fitting curves.
        over_structures: Whether groups of structures are left out, too.

    Returns:
        The fits; the outcome of the fit to all samples, an index into `FIT_MEANINGS`, shape [place + 1, damage_state].
    """
    fit = estimator.fit
    median, dispersion, outcome = fit(counts.levels, counts.total, counts.trials, None)
    start = median, dispersion
    with np.errstate(divide="ignore"):
        whole = np.log(np.stack([median, dispersion]))

    def fitted(exceeding: np.ndarray, trials: np.ndarray) -> np.ndarray:
        medians, dispersions, _ = fit(counts.levels, exceeding, trials, start)
        return np.log(np.stack([medians, dispersions], axis=1))

    is_crossed = leaves_out_structures(counts, over_structures)
    records, groups = without_each(counts, fitted, whole.shape, is_crossed=is_crossed)
    influences, binomial = estimator.influences(counts.levels, counts.exceeding, counts.valid, median, dispersion)
    interaction = interaction_variance(influences, counts.strata) if is_crossed else 0 * whole
    return LeftOut(whole, records, groups, interaction, binomial, influences.sum(axis=1), counts.strata), outcome


def leaves_out_structures(counts: StripeCounts, over_structures: bool) -> bool:
    """Return whether the jackknife leaves out groups of structures in addition to records."""
    return over_structures and counts.is_crossed and counts.valid.shape[1] > 1


def without_each(
    counts: StripeCounts,
    estimate: Callable[[np.ndarray, np.ndarray], np.ndarray],
    shape: tuple[int, ...],
    *,
    is_crossed: bool,
) -> tuple[np.ndarray, np.ndarray]:
    """Return an estimate without each record, [record, ...], and without each group of structures, [group, ...].

    If there is only one record, the first array is empty.

    Args:
        counts: Numbers of samples by record, structure group, stripe, place (storey or floor) and damage state.
        estimate: Function of numbers of exceeding samples, shape [part, place + 1, damage_state, im_level], and of
            numbers of samples, of a shape that broadcasts with it. It returns the estimates, shape [part, ...].
        shape: Shape [...] of the estimate.
        is_crossed: Whether groups of structures are left out; otherwise the second array is empty.
    """

    def without(exceeding: np.ndarray, valid: np.ndarray) -> np.ndarray:
        return estimate(counts.total - np.moveaxis(exceeding, 1, -1), (counts.trials - valid)[:, None, None, :])

    none = np.empty((0, *shape))
    records = without(counts.of_records, counts.valid.sum(axis=1)) if len(counts.valid) > 1 else none
    return records, without(counts.of_groups, counts.valid.sum(axis=0)) if is_crossed else none


def spread_of(
    estimate: np.ndarray,
    records: np.ndarray,
    groups: np.ndarray,
    interaction: np.ndarray,
    strata: np.ndarray | None = None,
) -> Spread:
    """Return the sampling distribution of an estimate, from its values without each record and each group.

    Args:
        estimate: The estimate, of any shape [...].
        records: Values of the estimate without each record, shape [record, ...]; empty: the variance is unknown.
        groups: Values of the estimate without each group of structures, shape [group, ...]; may be empty.
        interaction: Variance from the interaction of record and structure, shape [...].
        strata: Number of the stratum of each record; None: all records are in one stratum.
    """
    if not len(records):
        none = np.full(estimate.shape, np.nan)
        return Spread(none, np.full((3, *estimate.shape), np.nan), none, np.empty((0, *estimate.shape)))
    centre, of_records, steps, freedom = _jackknife(estimate, records, strata)
    if not len(groups):
        by_source = np.stack([of_records, 0 * of_records, 0 * of_records])
        return Spread(estimate + centre, by_source, freedom, steps)
    shift, of_groups, steps_of_groups, _ = _jackknife(estimate, groups)
    interaction = np.minimum(interaction, np.minimum(of_records, of_groups))
    own = of_groups - interaction  # without the interaction, which the variance among records already contains
    by_source = np.stack([of_records - interaction, own, interaction])
    with np.errstate(divide="ignore", invalid="ignore"):
        # Welch (1947) and Satterthwaite (1946).
        total = (of_records + own) ** 2 / (of_records**2 / freedom + own**2 / (len(groups) - 1))
        share = np.where(of_groups > 0, np.sqrt(own / of_groups), 0.0)
    deviations = np.concatenate([steps, share * steps_of_groups])
    return Spread(estimate + centre + shift, by_source, np.where(total > 0, total, freedom), deviations)


def _jackknife(
    estimate: np.ndarray, left_out: np.ndarray, strata: np.ndarray | None = None
) -> tuple[np.ndarray, np.ndarray, np.ndarray, np.ndarray]:
    """Return bias correction, variance, deviations and degrees of freedom from estimates `left_out` without each group.

    The sum of the squared deviations is the variance. Corrections and variances of strata are added; a unit (record or
    group) is compared only with units of its stratum.

    Args:
        estimate: The estimate from all units, of any shape [...].
        left_out: The estimates without each unit, shape [unit, ...].
        strata: Number of the stratum of each unit; None: one stratum.
    """
    strata = np.zeros(len(left_out), dtype=np.int64) if strata is None else strata
    correction, variance, squares = (np.zeros(estimate.shape) for _ in range(3))
    deviations = np.empty(left_out.shape)
    numbers, sizes = np.unique(strata, return_counts=True)
    for number, units in zip(numbers, sizes, strict=True):
        own = strata == number
        mean = left_out[own].mean(axis=0)
        deviations[own] = np.sqrt((units - 1) / units) * (left_out[own] - mean)
        correction = correction + (units - 1) * (estimate - mean)
        of_stratum = (deviations[own] ** 2).sum(axis=0)
        variance = variance + of_stratum
        squares = squares + of_stratum**2 / (units - 1)
    freedom = np.full(estimate.shape, float(len(left_out) - numbers.size))
    if numbers.size > 1:  # Satterthwaite (1946)
        with np.errstate(divide="ignore", invalid="ignore"):
            freedom = np.where(squares > 0, variance**2 / squares, freedom)
    return correction, variance, deviations, freedom


def interaction_variance(influences: np.ndarray, strata: np.ndarray | None = None) -> np.ndarray:
    """Return the variance of an estimate from the interaction of record and group of structures, shape [...].

    Args:
        influences: Contributions of each pair of a record and a group to the estimate, shape [record, group, ...].
        strata: Number of the stratum of each record, whose variances are added; None: one stratum.
    """
    if strata is not None and strata.any():
        parts = [interaction_variance(influences[strata == number]) for number in np.unique(strata)]
        return np.sum(parts, axis=0)
    records, groups = influences.shape[:2]
    of_records, of_groups = influences.mean(axis=1), influences.mean(axis=0)
    # Residual sum of squares of a two-way analysis of variance (record and group).
    squares = np.einsum("rg...,rg...->...", influences, influences)
    squares -= groups * (of_records**2).sum(axis=0) + records * (of_groups**2).sum(axis=0)
    squares += records * groups * of_records.mean(axis=0) ** 2
    return records * groups / ((records - 1) * (groups - 1)) * np.maximum(squares, 0.0)


def few_groups(left: LeftOut, has_interval: np.ndarray, states: tuple[str, ...]) -> list[str]:
    """Return a list with one sentence if intervals are based on too few groups of structures; otherwise an empty list.

    Args:
        left: The fits at the worst place.
        has_interval: Whether a damage state has an interval, shape [damage_state].
        states: Names of the damage states.
    """
    groups, freedom = len(left.groups), left.spread.freedom.min(axis=0)
    decisive = min(FEWEST_KNOWN, len(left.records) - 1)
    few = [name for name, least, known in zip(states, freedom, has_interval, strict=True) if known and least < decisive]
    if not few or not 0 < groups <= FEWEST_KNOWN:
        return []
    return [
        f"there are only {groups} groups of structures, so the intervals of "
        f"{', '.join(map(repr, few))} are wide, with {np.nanmin(freedom):.2g} degrees of freedom: simulate at least "
        f"{ENOUGH_STRUCTURES}"
    ]


def trusted(left: LeftOut, outcome: np.ndarray) -> np.ndarray:
    """Return whether the fit to all samples and all fits without a record or group exist, shape [row ...].

    A penalised fit is not trusted: its stripes are nearly the same if one record is left out, so the interval of the
    jackknife would be too narrow (95 % intervals covered the median in only 72 % of 134 cases of 11 records at 6
    levels).
    """
    parts = np.concatenate([left.records, left.groups])
    return (outcome == FITTED) & np.isfinite(parts).all(axis=(0, 1)) & (len(left.records) > 1)
