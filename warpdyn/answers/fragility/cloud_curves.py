"""Cloud analysis: fragility curves by regression of demands on intensities, for motions without common levels."""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import replace

import numpy as np
import xarray as xr

from warpdyn.answers.fragility.curve_dataset import dataset_of_curves
from warpdyn.answers.fragility.curve_variables import variable
from warpdyn.answers.fragility.demands import checked_demand, refuse_portfolio
from warpdyn.answers.fragility.estimators import FIT_MEANINGS, LOGNORMAL
from warpdyn.answers.fragility.estimators.binomial import PENALISED, UNDETERMINED
from warpdyn.answers.fragility.estimators.censored import CensoredRegression
from warpdyn.answers.fragility.estimators.cloud import (
    DEMAND_AND_COLLAPSE,
    CloudFits,
    fit_censored,
    fit_collapse,
    fit_with_collapse,
)
from warpdyn.answers.fragility.fragility_curves import OVER
from warpdyn.answers.fragility.intervals.observations import Observations
from warpdyn.answers.fragility.lognormal_fit import (
    FITTED,
    NO_EXCEEDANCE,
    NO_FINITE_MEDIAN,
    NOT_INCREASING,
    check_confidence,
)
from warpdyn.answers.fragility.stripe_counts import check_labels, decoded_status, structure_label
from warpdyn.campaigns.reductions.limits import DRIFT, DamageLimits, Limit
from warpdyn.campaigns.running.joining.duplicates import check_samples
from warpdyn.campaigns.running.selections import without_added_places
from warpdyn.foundations.core.checks import MOST_REPLICATES, check_dataset, one_of, true_or_false, whole_number
from warpdyn.foundations.core.messages import warn_of_all
from warpdyn.foundations.core.near_misses import suggests_names
from warpdyn.foundations.core.output_variables import (
    COLLAPSED,
    DIVERGED,
    LARGEST_EXCLUDED_FRACTION,
    STATUS_MEANINGS,
    measure_of_dataset,
)

METHODS = {
    "censored": "regression of ln demand on ln intensity by maximum likelihood, collapses right-censored (Tobin 1958)",
    "collapse": "regression of ln demand on ln intensity of samples without collapse, and probit of collapse "
    "(Jalayer et al. 2017)",
}
LEAST_STANDING = 4  # smallest number of samples without collapse that determines a line and a standard deviation
_SIXTEENTH, _EIGHTY_FOURTH = 0.15865525393145707, 0.8413447460685429  # normal probabilities at -1 and +1 deviation


@suggests_names
def fragility_of_cloud(
    dataset: xr.Dataset,
    limits: Mapping[str, Limit],
    *,
    estimator: str = "censored",
    demand: str = DRIFT,
    intervals_over: str = OVER[0],
    added_storeys: bool = False,
    replicates: int = 1000,
    confidence: float = 0.95,
    seed: int = 0,
) -> xr.Dataset:
    """Fit fragility curves by cloud analysis: ln(demand) is linear in ln(intensity), with constant standard deviation.

    The standard deviation has divisor n (maximum likelihood), as in pyFragility and in the likelihood of statsmodels.
    Programs that divide by n - 1 or n - 2 return dispersions larger by sqrt(n / (n - 1)) or sqrt(n / (n - 2)).

    The demand of a collapsed sample is only known to be larger than its value before the collapse. Estimator "censored"
    uses this value as a lower bound (right-censored). The curve of a limit c is lognormal, with median exp((ln c -
    intercept) / slope) and dispersion deviation / slope. Estimator "collapse" fits the line to samples without
    collapse, and fits the probability of collapse separately; a sample exceeds a limit if it collapses or its demand is
    larger. These curves are not lognormal: their dispersion is defined as half of ln(x84 / x16), where x84 and x16 are
    the intensities at which 84 % and 16 % of the samples exceed the limit. Samples that did not collapse have smaller
    demands than all samples would have, so their line is biased; "censored" has no such bias. Both estimators use the
    demand of the worst storey or floor. Intervals are computed as in `fragility`, by a jackknife over records and
    structures.

    Args:
        dataset: A run of a Cloud or OneMotionPerStructure, as `simulate` returned it, or a run on stripes. It contains
            a demand, the flag variable `status(sample)`, and the coordinates `motion_index` and `im_level`.
        limits: Limit of each damage state, from the lightest to the heaviest, in the units of the demand. Only collapse
            exceeds `math.inf`; its curve is the probit of collapse, with either estimator.
        estimator: "censored" or "collapse".
        demand: Name of the demand that is compared with the limits; if it has a sign, its absolute value is compared.
        intervals_over: "records and structures", or "records" for intervals of the given structures.
        added_storeys: Whether storeys of isolators or of a tuned mass damper count, as in `fragility`.
        replicates: Number of draws from the joint sampling distribution of all medians and dispersions.
        confidence: Probability that the intervals cover the true value [1].
        seed: Seed of the draws.

    Returns:
        Medians [g, or the unit of the intensity], dispersions [1] and curves, each with its interval, as `fragility`
        returns them; `regression_intercept` (ln(demand) at an intensity of 1), `regression_slope` and
        `regression_deviation`. Estimator "collapse" adds `collapse_median` and `collapse_dispersion`; estimator
        "censored" adds `median_variance_by_sandwich`, the cluster-robust variance with records as clusters.

    Raises:
        ValueError: If the dataset lacks a variable or coordinate, a demand or an intensity is not positive, fewer than
            4 samples did not collapse, all intensities are equal, more than 1 % of the samples failed, or an argument
            is out of its range.
        TypeError: If `dataset` is not a Dataset.

    Example:
        >>> run = wd.simulate(wd.Scene(building, wd.Cloud(motions), scatter), structures=4)
        >>> curves = wd.fragility_of_cloud(run, {"slight": 0.005, "moderate": 0.007})
        >>> curves["fragility_median"].round(1).values  # g
        array([0.5, 0.7])
    """
    check_dataset("fragility_of_cloud", dataset, advice="give the result of simulate()")
    if not true_or_false("added_storeys", added_storeys):
        dataset = without_added_places(dataset)
    refuse_portfolio("fragility_of_cloud", dataset)
    replicates, seed = whole_number("replicates", replicates, 1, MOST_REPLICATES), whole_number("seed", seed, 0)
    check_confidence(confidence)
    one_of("estimator of a cloud", estimator, tuple(METHODS))
    one_of("intervals_over", intervals_over, OVER)
    checked = DamageLimits.of(limits, demand)
    if checked.single is None:
        raise ValueError(
            f"fragility_of_cloud: the limits are limits of several demands ({', '.join(checked.demands)}), but a "
            "regression needs one demand: give limits of one demand, or use fragility() for a run on stripes"
        )
    intensity, values, collapsed, observed, failed = _checked_cloud(dataset, checked.single, intervals_over == OVER[0])
    limit = checked.values[0]
    regression: CensoredRegression | None = None
    of_collapse = NO_EXCEEDANCE
    if estimator == "censored":
        fits, regression = fit_censored(intensity, values, collapsed, observed.weights)
        if np.isinf(limit).any():
            middle, scatter, of_collapse = fit_collapse(intensity, collapsed, observed.weights)
            fits = replace(fits, collapse_median=middle, collapse_dispersion=scatter)
    else:
        fits, of_collapse = fit_with_collapse(intensity, values, collapsed, observed.weights)
    outcome = np.full(limit.size, FITTED if fits.slope[0] > 0 else NOT_INCREASING)
    outcome[np.isinf(limit)] = of_collapse
    median = fits.fractile(0.5, limit)
    with np.errstate(divide="ignore", invalid="ignore"):
        spread = np.log(fits.fractile(_EIGHTY_FOURTH, limit) / fits.fractile(_SIXTEENTH, limit)) / 2.0
        logarithms = np.log(np.stack([median, spread], axis=1))
    outcome[(outcome == FITTED) & ~np.isfinite(logarithms[0]).all(axis=0)] = NO_FINITE_MEDIAN
    logarithms[:, :, ~np.isin(outcome, (FITTED, PENALISED))] = np.nan
    influences, independent = _influences(observed, regression, fits, np.where(np.isinf(limit), np.nan, logarithms[0]))
    left = observed.left_out(logarithms, influences, independent)
    ends = float(intensity.min()), float(intensity.max())
    result, outcome, remarks = dataset_of_curves(
        observed,
        checked.states,
        left,
        outcome,
        ends,
        curves=lambda points: fits.probability(points[None, None], limit),
        highest=float(max(intensity.max(), np.nanmax(median[0], initial=0.0) * 2.0)),
        units=str(dataset["im_level"].attrs.get("units", "g")),
        confidence=confidence,
        replicates=replicates,
        seed=seed,
        added="motions",
    )
    _warn(checked, outcome, of_collapse, collapsed, values, observed.records, estimator, remarks)
    for name in ("median_variance_by_sandwich", "dispersion_variance_by_sandwich"):
        if name in result:  # of the regression
            result[name] = result[name].where(np.isfinite(limit))
    numbers = {
        "regression_intercept": (fits.intercept[0], "ln demand at an intensity of 1, of the regression"),
        "regression_slope": (fits.slope[0], "slope of ln demand on ln intensity"),
        "regression_deviation": (fits.deviation[0], "standard deviation of ln demand about the line, with divisor n"),
        "collapsed_samples": (int(collapsed.sum()), "samples that collapsed"),
        "valid_samples": (intensity.size, "samples counted, collapsed ones included"),
        "excluded_samples": (failed, "samples kept out"),
    }
    if estimator == "collapse" or np.isinf(limit).any():
        numbers["collapse_median"] = fits.collapse_median[0], "median intensity of collapse; infinite without collapses"
        numbers["collapse_dispersion"] = fits.collapse_dispersion[0], "dispersion of the intensity of collapse"
    for name, (number, words) in numbers.items():
        result[name] = variable((), number, words)
    of_demand = {"units": str(dataset[checked.single].attrs.get("units", "1")), "demand": checked.single}
    result["damage_limit"] = ("damage_state", limit, {"long_name": f"limit of {checked.single}"} | of_demand)
    attributes: dict[str, object] = {
        "demand": checked.single,
        "fragility_method": METHODS[estimator],
        "fragility_shape": LOGNORMAL.name if estimator == "censored" else DEMAND_AND_COLLAPSE,
    }
    return result.assign_attrs(measure_of_dataset(dataset) | attributes)


def _checked_cloud(
    dataset: xr.Dataset, demand: str, over_structures: bool
) -> tuple[np.ndarray, np.ndarray, np.ndarray, Observations, int]:
    """Return the checked samples of a cloud that did not fail, and the number of failed samples.

    Args:
        dataset: The run.
        demand: Name of the demand.
        over_structures: Whether intervals include the variability among structures.

    Returns:
        Intensity of each sample; demand at the worst storey or floor; whether the sample collapsed; record and
        structure of each sample; number of failed samples.
    """
    name = "fragility_of_cloud"
    check_labels(dataset, f"{name}: ")
    check_samples(name, dataset)
    status = decoded_status(dataset["status"])
    intensity = dataset["im_level"].values.astype(np.float64)
    worst = checked_demand(name, dataset, demand, status).max(axis=0).astype(np.float64)
    kept, collapsed = status < DIVERGED, status == COLLAPSED
    failed = int((~kept).sum())
    if failed > LARGEST_EXCLUDED_FRACTION * status.size:
        codes, counts = np.unique(status[~kept], return_counts=True)
        which = ", ".join(f"{count} {STATUS_MEANINGS[code]}" for code, count in zip(codes, counts, strict=True))
        raise ValueError(
            f"{name}: {failed} of {status.size} samples failed ({which}); at most "
            f"{100 * LARGEST_EXCLUDED_FRACTION:g} % may fail. Simulate with a smaller step= or another method="
        )
    for what, values in (("im_level", intensity), (demand, worst)):
        bad = np.flatnonzero(kept & ~((values > 0) & np.isfinite(values)))
        if bad.size:
            why = (
                "collapsed samples have no value of this demand, but the regression needs a lower bound of it: "
                "choose another demand=, such as 'peak_storey_drift_ratio'"
                if collapsed[bad[0]] and what == demand
                else "it must be finite and above 0, because its logarithm is taken: remove this sample from the "
                "run, or choose another demand="
            )
            raise ValueError(f"{name}: {what} of sample {bad[0]} is {values[bad[0]]}: {why}")
    standing = kept & ~collapsed
    if standing.sum() < LEAST_STANDING or np.unique(intensity[standing]).size < 2:
        raise ValueError(
            f"{name}: {standing.sum()} of {kept.sum()} samples did not collapse, at "
            f"{np.unique(intensity[standing]).size} different intensities; the regression needs at least "
            f"{LEAST_STANDING} such "
            "samples and 2 intensities: add motions of lower intensity"
        )
    own = structure_label(dataset)
    structure = np.arange(status.size) if own is None else own.values
    sampling = "" if own is None else str(own.attrs.get("sampling", ""))
    observed = Observations(dataset["motion_index"].values[kept], structure[kept], sampling, over_structures)
    return intensity[kept], worst[kept], collapsed[kept], observed, failed


def _influences(
    observed: Observations, regression: CensoredRegression | None, fits: CloudFits, logarithms: np.ndarray
) -> tuple[np.ndarray, np.ndarray]:
    """Return contributions of samples to ln(median) and ln(dispersion), and variances for independent samples.

    For estimator "collapse" (`regression` is None) the contributions are zero: the interaction of record and structure
    is then counted twice in the variance, which makes the interval wider (conservative).

    Args:
        observed: Record and structure of each sample.
        regression: The regression of estimator "censored"; None for estimator "collapse".
        fits: The fits; the first row is the fit to all samples.
        logarithms: ln(median) and ln(dispersion), shape [2, damage_state].

    Returns:
        Contributions, shape [sample, 2, damage_state]; variances, shape [2, damage_state].
    """
    states, samples = logarithms.shape[1], observed.record.size
    influences, independent = np.zeros((samples, 2, states)), np.full((2, states), np.nan)
    if regression is None:
        return influences, independent
    slope, deviation = float(fits.slope[0]), float(fits.deviation[0])
    each, alone = regression.influences(np.array([fits.intercept[0], slope]), deviation)
    for state in np.flatnonzero(np.isfinite(logarithms).all(axis=0)):
        # Derivatives of ln(median) = (ln(limit) - intercept) / slope and of dispersion = deviation / slope.
        change = np.array([[-1.0, -logarithms[0, state], 0.0], [0.0, -deviation / slope, 1.0]]) / slope
        scale = np.array([1.0, deviation / slope])
        influences[:, :, state] = each @ change.T / scale
        independent[:, state] = np.diag(change @ alone @ change.T) / scale**2
    return influences, independent


def _warn(
    limits: DamageLimits,
    outcome: np.ndarray,
    of_collapse: int,
    collapsed: np.ndarray,
    demand: np.ndarray,
    records: int,
    estimator: str,
    remarks: list[str],
) -> None:
    """Warn of curves without a fit, of a single record and of extrapolated limits; add the sentences `remarks`."""
    found = [*remarks]
    is_finite = np.isfinite(limits.values[0])
    for number in np.flatnonzero(~is_finite & ~np.isin(outcome, (FITTED, PENALISED))):
        found.append(
            f"damage state {limits.states[number]!r} has no curve: only collapse exceeds its infinite limit, and the "
            f"probability of collapse has no fit ({FIT_MEANINGS[of_collapse]}; {collapsed.sum()} of {collapsed.size} "
            "samples collapsed): add motions of intensities at which some samples collapse and some do not"
        )
    without = is_finite & ~np.isin(outcome, (FITTED, UNDETERMINED))
    if without.any():
        found.append(
            f"no curve of a finite limit has a fit ({FIT_MEANINGS[outcome[without][0]]}): the demand does not grow "
            "with the intensity. Choose another intensity measure, or motions of a wider range of intensities"
        )
    if (estimator == "collapse" or not is_finite.all()) and collapsed.any() and of_collapse != FITTED:
        found.append(
            f"the fit of the probability of collapse is {FIT_MEANINGS[of_collapse]}: {collapsed.sum()} of "
            f"{collapsed.size} samples collapsed, and intensities with and without collapse do not overlap: add "
            "motions of intensities between them"
        )
    if records == 1:
        found.append("there is only one motion, so there are no intervals over records: give more motions")
    standing = demand[~collapsed].max()
    finite = zip(limits.states, limits.values[0], strict=True)
    above = [repr(state) for state, limit in finite if standing < limit < np.inf]
    if above:
        advice = "add motions of higher intensity"
        if estimator == "censored" and collapsed.any():
            advice += ", or use estimator='collapse', which counts every collapse as exceeding it"
        part = " of samples without collapse" if estimator == "collapse" and collapsed.any() else ""
        found.append(
            f"the limit of {' and '.join(above)} is above all demands of samples without collapse ({standing:.3g}), so "
            f"its curve{part} is extrapolated: {advice}"
        )
    warn_of_all("fragility_of_cloud", found)
