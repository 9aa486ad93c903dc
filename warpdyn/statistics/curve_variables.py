"""The variables of a dataset of fragility curves: fractions, curves, variances by source, draws."""

from __future__ import annotations

from typing import Any

import numpy as np
import xarray as xr
from numpy.typing import ArrayLike

from warpdyn.core.units import IN_G
from warpdyn.statistics.demands import DamageLimits
from warpdyn.statistics.estimators.table import FIT_MEANINGS, CurveShape
from warpdyn.statistics.jackknife import LeftOut, fraction_intervals, spread_of
from warpdyn.statistics.lognormal_fit import FITTED
from warpdyn.statistics.stripe_counts import StripeCounts

DISCRETISATION = "discretisation"
NO_FIT = "NaN where the stripes have no lognormal fit"
_CURVE_POINTS = 401
_OF_STRIPES = ("damage_state", "stripe")


def variable(dimensions: str | tuple[str, ...], values: ArrayLike, long_name: str, **attributes: object) -> tuple:
    """Return what a dataset takes as a variable, without units unless they are given."""
    return dimensions, values, {"long_name": long_name, "units": "1"} | attributes


def estimates(
    counts: StripeCounts,
    left: LeftOut,
    outcome: np.ndarray,
    has_interval: np.ndarray,
    confidence: float,
    over_structures: bool,
) -> dict[str, tuple]:
    """Return fractions, medians and dispersions with their bounds, of the worst place and of each."""
    with np.errstate(invalid="ignore"):
        fraction = counts.total / counts.trials
    spread = spread_of(left.whole, left.records, left.groups, left.interaction)
    bounds = np.where(has_interval, np.exp(spread.interval(confidence)), np.nan)
    of_measure = {"units": counts.units, "comment": f"{IN_G}; {NO_FIT}" if counts.units == "g" else NO_FIT}
    flags = {"flag_values": np.arange(len(FIT_MEANINGS), dtype=np.int8), "flag_meanings": " ".join(FIT_MEANINGS)}
    median, dispersion = np.exp(left.whole)
    fraction_bounds = fraction_intervals(counts, confidence, over_structures=over_structures)
    rows: dict[str, tuple[np.ndarray, np.ndarray | None, str, dict[str, Any]]] = {
        "exceedance_fraction": (fraction, fraction_bounds, "fraction of samples exceeding", {}),
        "fragility_median": (median, bounds[:, 0], "median capacity", of_measure),
        "fragility_dispersion": (dispersion, bounds[:, 1], "dispersion of the capacity", {"comment": NO_FIT}),
        "fit_status": (outcome, None, "outcome of the lognormal fit", flags),
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


def with_bounds(
    values: np.ndarray, bounds: np.ndarray | None, meaning: str, confidence: float
) -> list[tuple[str, np.ndarray, str]]:
    """Return name suffix, values and wording of an estimate and, if it has them, of its bounds."""
    parts = [("", values, meaning)]
    for side, bound in zip(("lower", "upper"), () if bounds is None else bounds, strict=bounds is not None):
        parts.append((f"_{side}", bound, f"{meaning}, {side} bound of the {100 * confidence:g} % interval"))
    return parts


def curves(
    counts: StripeCounts, left: LeftOut, has_interval: np.ndarray, confidence: float, shape: CurveShape
) -> tuple[dict[str, tuple], np.ndarray]:
    """Return the curves of the worst place with their bounds, and their intensities."""
    intensity = counts.levels.max() * np.linspace(0.0, 1.0, _CURVE_POINTS) ** 2  # close together at low levels
    median, dispersion = np.exp(left.whole[:, -1])
    curve = shape.probability(intensity, median[:, None], dispersion[:, None])
    with np.errstate(divide="ignore"):
        logarithm = np.log(intensity[1:])

    def scores(of: np.ndarray) -> np.ndarray:
        return (logarithm - of[..., 0, -1, :, None]) * np.exp(-of[..., 1, -1, :, None])

    slopes = np.stack([-np.exp(-left.whole[1, -1])[:, None] + 0 * logarithm, -scores(left.whole)])
    interaction = (slopes**2 * left.interaction[:, -1, :, None]).sum(axis=0)  # without the covariance, which is small
    spread = spread_of(scores(left.whole), scores(left.records), scores(left.groups), interaction)
    with np.errstate(over="ignore"):
        standardised = np.exp(np.where(has_interval[-1, :, None], spread.interval(confidence), np.nan))
    bounds = shape.probability(standardised, 1.0, 1.0)
    none = np.where(has_interval[-1], 0.0, np.nan)[None, :, None].repeat(2, axis=0)
    bounds = np.concatenate([none, bounds], axis=-1)
    variables = {
        f"fragility_curve{suffix}": variable(("damage_state", "intensity"), part, words, comment=NO_FIT)
        for suffix, part, words in with_bounds(curve, bounds, "fragility curve, worst place", confidence)
    }
    return variables, intensity


def variances(dataset: xr.Dataset, limits: DamageLimits, left: LeftOut, has_interval: np.ndarray) -> dict[str, tuple]:
    """Return the variances of the logarithms of median and dispersion by their source, worst place."""
    spread = spread_of(left.whole, left.records, left.groups, left.interaction)
    by_source = np.where(has_interval, spread.by_source, np.nan)[:, :, -1]
    error = np.full_like(left.whole[:, -1], np.nan)
    if "estimated_relative_error" in dataset and limits.single in dataset["estimated_relative_error"]["demand"].values:
        found = dataset["estimated_relative_error"].sel(demand=limits.single, error_statistic="median")
        error[0] = float(found) ** 2
    by_source = np.concatenate([by_source, error[None]])
    variables = {}
    for number, name in enumerate(("median", "dispersion")):
        of_error = (
            "; discretisation is the square of the median relative error of the demand, by `checked_share`"
            if not number
            else ""
        )
        comment = f"of its logarithm; record and structure: their interaction, and what is neither's{of_error}"
        variables[f"{name}_variance"] = variable(
            ("damage_state", "source"), by_source[:, number].T, f"variance of the {name} by its source", comment=comment
        )
        variables[f"{name}_variance_if_independent"] = variable(
            "damage_state",
            left.binomial[number, -1],
            f"variance of the {name} if all samples were independent, which they are not",
            comment="of its logarithm: the binomial likelihood's own",
        )
    return variables


def sandwich(left: LeftOut, outcome: np.ndarray) -> dict[str, tuple]:
    """Return the cluster-robust variances of the logarithms of median and dispersion, worst place.

    A penalised fit has none: its stripes hold no scatter to tell it from.
    """
    found = np.where(outcome == FITTED, left.sandwich, np.nan)
    return {
        f"{name}_variance_by_sandwich": variable(
            "damage_state",
            found[(number, -1) if found.ndim > 2 else number],
            f"variance of the {name} by the cluster-robust sandwich, with records as clusters",
            comment="of its logarithm; structures are taken as given",
        )
        for number, name in enumerate(("median", "dispersion"))
    }


def draws(left: LeftOut, has_interval: np.ndarray, count: int, seed: int, units: str) -> dict[str, tuple]:
    """Return draws from the joint sampling distribution of the medians and dispersions of the worst place."""
    worst = (slice(None), slice(None), -1)
    spread = spread_of(left.whole[:, -1], left.records[worst], left.groups[worst], left.interaction[:, -1])
    draws = np.exp(np.where(has_interval[-1], spread.draw(count, seed), np.nan))
    said = "draw from the sampling distribution of the"
    of_replicates = ("replicate", "damage_state")
    return {
        "replicate_median": variable(of_replicates, draws[:, 0], f"{said} median", units=units),
        "replicate_dispersion": variable(of_replicates, draws[:, 1], f"{said} dispersion"),
    }
