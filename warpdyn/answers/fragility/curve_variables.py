"""Variables of a dataset of fragility curves: fractions, curves, variances by source, and draws."""

from __future__ import annotations

from typing import Any

import numpy as np
import xarray as xr
from numpy.typing import ArrayLike

from warpdyn.answers.fragility.estimators.binomial import PENALISED
from warpdyn.answers.fragility.estimators.table import FIT_MEANINGS, CurveShape
from warpdyn.answers.fragility.intervals.extrapolation import status_attributes
from warpdyn.answers.fragility.intervals.fractions import fraction_intervals
from warpdyn.answers.fragility.intervals.jackknife import LeftOut, RecordNumbers, spread_of
from warpdyn.answers.fragility.lognormal_fit import FITTED
from warpdyn.answers.fragility.stripe_counts import StripeCounts
from warpdyn.foundations.core.output_variables import MEDIAN_STATUS
from warpdyn.foundations.core.units import unit_attributes

DISCRETISATION = "discretisation"
NO_FIT = "NaN without a lognormal fit of the stripes"
_CURVE_POINTS = 401
_OF_STRIPES = ("damage_state", "stripe")


def variable(dimensions: str | tuple[str, ...], values: ArrayLike, long_name: str, **attributes: object) -> tuple:
    """Return (dimensions, values, attributes) of a variable for an xarray Dataset; units are "1" by default."""
    return dimensions, values, {"long_name": long_name, "units": "1"} | attributes


def estimates(
    counts: StripeCounts,
    left: LeftOut,
    outcome: np.ndarray,
    status: np.ndarray,
    has_interval: np.ndarray,
    confidence: float,
    over_structures: bool,
) -> dict[str, tuple]:
    """Return the variables of fractions, medians and dispersions with bounds, for each and for the worst storey.

    Args:
        counts: Numbers of samples by record, structure group, stripe, place (storey or floor) and damage state.
        left: The fits.
        outcome: Outcome of each fit, an index into FIT_MEANINGS, shape [place + 1, damage_state].
        status: Position of each median among the levels, of the same shape.
        has_interval: Whether a fit has an interval, of the same shape.
        confidence: Probability that the intervals cover the true value [1].
        over_structures: Whether intervals include the variability among structures.
    """
    with np.errstate(invalid="ignore"):
        fraction = counts.total / counts.trials
    bounds = np.where(has_interval, np.exp(left.spread.interval(confidence)), np.nan)
    of_measure = unit_attributes(counts.units, NO_FIT)
    median, dispersion = np.exp(left.whole)
    fraction_bounds = fraction_intervals(counts, confidence, over_structures=over_structures)
    bounds[:, 0] = np.where(outcome == PENALISED, levels_about_median(counts.levels, fraction_bounds), bounds[:, 0])
    rows: dict[str, tuple[np.ndarray, np.ndarray | None, str, dict[str, Any]]] = {
        "exceedance_fraction": (fraction, fraction_bounds, "fraction of samples exceeding", {}),
        "fragility_median": (median, bounds[:, 0], "median capacity", of_measure),
        "fragility_dispersion": (dispersion, bounds[:, 1], "dispersion of the capacity", {"comment": NO_FIT}),
        "fit_status": (outcome, None, "outcome of the lognormal fit", fit_flags()),
        MEDIAN_STATUS: (status, None, "position of the median among the levels", status_attributes()),
    }
    variables = {"exceeding_samples": variable(_OF_STRIPES, counts.total[-1], "samples exceeding, worst place")}
    for name, (values, bound, meaning, attributes) in rows.items():
        dimensions: tuple[str, ...] = _OF_STRIPES[: values.ndim - 1]
        for suffix, part, words in with_bounds(values, bound, meaning, confidence):
            variables[name + suffix] = variable(dimensions, part[-1], f"{words}, worst place", **attributes)
            if counts.dim:
                by_place = np.moveaxis(part[:-1], 0, -1)
                variables[f"{counts.dim}_{name}{suffix}"] = variable(
                    (*dimensions, counts.dim), by_place, words, **attributes
                )
    return variables


def levels_about_median(levels: np.ndarray, fraction_bounds: np.ndarray) -> np.ndarray:
    """Return the two levels that enclose the median of any increasing curve, shape [2, row ...].

    The lower one is the highest level at which the interval of the exceedance fraction is below 0.5. The upper one is
    the lowest level at which this interval is above 0.5. NaN if there is no such level.

    Args:
        levels: Intensity of each stripe, shape [im_level], increasing.
        fraction_bounds: Lower and upper bound of the fractions, shape [2, row ..., im_level].
    """
    low, high = fraction_bounds
    below = np.where(high < 0.5, levels, -np.inf).max(axis=-1)
    above = np.where(low > 0.5, levels, np.inf).min(axis=-1)
    bounds = np.stack([below, above])
    return np.where(np.isfinite(bounds), bounds, np.nan)


def with_bounds(
    values: np.ndarray, bounds: np.ndarray | None, meaning: str, confidence: float
) -> list[tuple[str, np.ndarray, str]]:
    """Return an estimate and, if it has bounds, its bounds: a list of (name suffix, values, long name)."""
    parts = [("", values, meaning)]
    for side, bound in zip(("lower", "upper"), () if bounds is None else bounds, strict=bounds is not None):
        parts.append((f"_{side}", bound, f"{meaning}, {side} bound of the {100 * confidence:g} % interval"))
    return parts


def curves(
    counts: StripeCounts, left: LeftOut, has_interval: np.ndarray, confidence: float, shape: CurveShape
) -> tuple[dict[str, tuple], np.ndarray]:
    """Return the variables of the curves of the worst storey or floor with bounds, and the intensities of their points.

    Arguments: see `estimates`; `shape` is the shape of the curves.
    """
    intensity, worst, has_interval = intensities_along(counts.levels.max()), left.worst, has_interval[-1]
    median, dispersion = np.exp(worst.whole)
    curve = shape.probability(intensity, median[:, None], dispersion[:, None])
    with np.errstate(divide="ignore"):
        logarithm = np.log(intensity[1:])

    def scores(of: np.ndarray) -> np.ndarray:
        return (logarithm - of[..., 0, :, None]) * np.exp(-of[..., 1, :, None])

    slopes = np.stack([-np.exp(-worst.whole[1])[:, None] + 0 * logarithm, -scores(worst.whole)])
    interaction = (slopes**2 * worst.interaction[:, :, None]).sum(axis=0)  # neglects the covariance, which is small
    parts = scores(worst.whole), scores(worst.records), scores(worst.groups)
    spread = spread_of(*parts, interaction, worst.strata)
    with np.errstate(over="ignore"):
        standardised = np.exp(np.where(has_interval[:, None], spread.interval(confidence), np.nan))
    bounds = shape.probability(standardised, 1.0, 1.0)
    none = np.where(has_interval, 0.0, np.nan)[None, :, None].repeat(2, axis=0)
    bounds = np.concatenate([none, bounds], axis=-1)
    variables = {
        f"fragility_curve{suffix}": variable(("damage_state", "intensity"), part, words, comment=NO_FIT)
        for suffix, part, words in with_bounds(curve, bounds, "fragility curve, worst place", confidence)
    }
    return variables, intensity


def discretisation_variance(dataset: xr.Dataset, demand: str | None, states: int) -> np.ndarray:
    """Return the variance of ln(median) and ln(dispersion) due to the integration step, shape [2, damage_state].

    For the median it is the square of the median relative error of the demand, which the run estimates if
    `checked_share` is given. It is NaN if `checked_share` was not given, and always NaN for the dispersion.
    """
    variance = np.full((2, states), np.nan)
    if "estimated_relative_error" in dataset and demand in dataset["estimated_relative_error"]["demand"].values:
        variance[0] = float(dataset["estimated_relative_error"].sel(demand=demand, error_statistic="median")) ** 2
    return variance


def variances(left: LeftOut, has_interval: np.ndarray, of_discretisation: np.ndarray | None = None) -> dict[str, tuple]:
    """Return variables of the variance of ln(median) and ln(dispersion): by source, and for independent samples.

    Args:
        left: The fits at the worst storey or floor, with and without each record and group of structures.
        has_interval: Whether a damage state has an interval, shape [damage_state].
        of_discretisation: Variance due to the integration step, shape [2, damage_state]; None: it is unknown.
    """
    by_source, comment = np.where(has_interval, left.spread.by_source, np.nan), "of its logarithm; "
    if of_discretisation is not None:
        by_source = np.concatenate([by_source, of_discretisation[None]])
        comment += "discretisation of the median: square of the demand's median relative error, by `checked_share`; "
    comment += "record and structure: their interaction, and the rest"
    variables = {}
    for number, name in enumerate(("median", "dispersion")):
        variables[f"{name}_variance"] = variable(
            ("damage_state", "source"), by_source[:, number].T, f"variance of the {name} by its source", comment=comment
        )
        variables[f"{name}_variance_if_independent"] = variable(
            "damage_state",
            left.binomial[number],
            f"variance of the {name} if all observations were independent, which they are not",
            comment="of its logarithm: the likelihood's own",
        )
    return variables


def sandwich(left: LeftOut, outcome: np.ndarray) -> dict[str, tuple]:
    """Return variables of the cluster-robust variance of ln(median) and ln(dispersion) for the worst storey or floor.

    The variance is NaN for penalised fits, because separated stripes have no scatter.
    """
    found = np.where(outcome == FITTED, left.sandwich, np.nan)
    return {
        f"{name}_variance_by_sandwich": variable(
            "damage_state",
            found[number],
            f"variance of the {name} by the cluster-robust sandwich, with records as clusters",
            comment="of its logarithm, for the given structures",
        )
        for number, name in enumerate(("median", "dispersion"))
    }


def draws(
    left: LeftOut,
    has_interval: np.ndarray,
    count: int,
    seed: int,
    units: str,
    confidence: float,
    records: np.ndarray | None = None,
    numbers: RecordNumbers | None = None,
) -> dict[str, tuple]:
    """Return variables with draws from the joint distribution of medians and dispersions (worst storey or floor).

    Args:
        left: The fits at the worst place.
        has_interval: Whether a damage state has an interval, shape [damage_state]; otherwise its draws are NaN.
        count: Number of draws.
        seed: Seed of the draws.
        units: Units of the median.
        confidence: Coverage of the interval that limits the tails of the draws [1].
        records: Labels of the records.
        numbers: Random numbers of the records; None: from the seed.
    """
    spread = left.spread.draw(count, seed, confidence, records, numbers)
    drawn = np.exp(np.where(has_interval, spread, np.nan))
    said = "draw from the sampling distribution of the"
    of_replicates = ("replicate", "damage_state")
    return {
        "replicate_median": variable(of_replicates, drawn[:, 0], f"{said} median", units=units),
        "replicate_dispersion": variable(of_replicates, drawn[:, 1], f"{said} dispersion"),
    }


def fit_flags() -> dict[str, Any]:
    """Return the flag attributes of the variable `fit_status`, whose meanings are FIT_MEANINGS."""
    return {"flag_values": np.arange(len(FIT_MEANINGS), dtype=np.int8), "flag_meanings": " ".join(FIT_MEANINGS)}


def intensities_along(highest: float) -> np.ndarray:
    """Return intensities from 0 to `highest` for the points of a curve, shape [point], closer at low intensities."""
    return highest * np.linspace(0.0, 1.0, _CURVE_POINTS) ** 2


def interval_method(records: int, groups: int, parts: int | None = None, strata: int = 1) -> str:
    """Return a text that describes the jackknife of the intervals.

    Args:
        records: Number of records.
        groups: Number of groups of structures that are left out; 0: only records are left out.
        parts: Number of groups of records that are left out; None: single records.
        strata: Number of sets of records that run at different levels.
    """
    nested = f" in {strata} sets, each at its own levels," if strata > 1 else ""
    in_parts = "" if parts in (None, records) else f" in {parts} parts"
    and_groups = f" and {groups} groups of structures" if groups else ""
    return f"jackknife over {records} records{nested}{in_parts}{and_groups}, less its bias, with Student's t"
