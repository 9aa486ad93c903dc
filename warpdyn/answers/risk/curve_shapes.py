"""Shapes of fragility curves: lognormal, loglogistic, of demand and collapse, and tables."""

from __future__ import annotations

from typing import TypeAlias

import numpy as np
import xarray as xr

from warpdyn.answers.fragility.estimators import LOGLOGISTIC, LOGNORMAL
from warpdyn.answers.fragility.estimators.binomial import LOGIT
from warpdyn.answers.fragility.estimators.cloud import DEMAND_AND_COLLAPSE, CloudFits
from warpdyn.answers.risk.integrals.lognormal import LognormalShape
from warpdyn.answers.risk.integrals.quadrature import NumericalShape
from warpdyn.foundations.core.checks import finite_numbers
from warpdyn.foundations.core.messages import warn_caller

Shape: TypeAlias = LognormalShape | NumericalShape
Table: TypeAlias = tuple[np.ndarray, np.ndarray]

# By how much a table may fall from a point to the next without a warning: a fraction of samples does by chance.
MOST_FALL = {"fragility_curve": 1e-3, "exceedance_fraction": 0.1}
TABLES = {"fragility_curve": "intensity", "exceedance_fraction": "stripe"}
# Dispersions from the median beyond which 0 or 1 is left to rounding, of a normal and of a logistic distribution.
_NORMAL_REACH, _LOGISTIC_REACH, _DRAWN = 9.0, 22.0, 3.0
OF_CLOUD = (
    "regression_intercept",
    "regression_slope",
    "regression_deviation",
    "collapse_median",
    "collapse_dispersion",
    "damage_limit",
)


def table_of(function: str, curves: xr.Dataset, names: tuple[str, ...]) -> Table | None:
    """Return intensities and probabilities of curves that are given by points alone, or None.

    Args:
        function: The public function.
        curves: Curves without `fragility_median`, or of a shape that is not known.
        names: Damage states.

    Raises:
        ValueError: If the points are of other dimensions, fewer than two or not finite, intensities do not increase or
            are below 0, or probabilities are not from 0 to 1.
    """
    shape = curves.attrs.get("fragility_shape", LOGNORMAL.name)
    if "fragility_median" in curves and shape in (LOGNORMAL.name, LOGLOGISTIC.name, DEMAND_AND_COLLAPSE):
        return None
    name = next((each for each in TABLES if each in curves), None)
    if name is None:
        return None
    along = TABLES[name]
    if set(curves[name].dims) != {"damage_state", along} or along not in curves.coords:
        raise ValueError(
            f"{function}: {name} must lie along damage_state and {along}, with its intensities as the coordinate "
            f"{along!r}; got {curves[name].dims}"
        )
    levels = finite_numbers(f"{function}: {along}", curves[along].values)
    probable = curves[name].transpose("damage_state", along).values.astype(np.float64)
    if levels.size < 2 or levels[0] < 0 or np.any(np.diff(levels) <= 0):
        raise ValueError(f"{function}: {along} must hold at least 2 increasing intensities, none below 0")
    for state, row in zip(names, probable, strict=True):
        if not np.all((row >= 0) & (row <= 1)):
            raise ValueError(
                f"{function}: {name} of damage state {state!r} must be known and from 0 to 1 at every intensity; leave "
                "the state out, as in curves.sel(damage_state=[...])"
            )
        if levels[0] == 0 and row[0] > 0:
            raise ValueError(f"{function}: {name} of damage state {state!r} is {row[0]:g} at intensity 0; it must be 0")
        place = int(np.argmin(np.diff(row)))
        if row[place] - row[place + 1] > MOST_FALL[name]:
            warn_caller(
                f"{function}: {name} of damage state {state!r} falls from {row[place]:.3g} at {levels[place]:g} to "
                f"{row[place + 1]:.3g} at {levels[place + 1]:g}, as the probability of being in a state does: give "
                "that of reaching or exceeding it, which grows with the intensity"
            )
    return levels, probable


def shape_of(
    function: str, curves: xr.Dataset, table: Table | None, median: np.ndarray, dispersion: np.ndarray
) -> Shape:
    """Return the shape of curves.

    Args:
        function: The public function.
        curves: The dataset.
        table: Points of curves that are given by them alone.
        median: Medians, shape [damage_state].
        dispersion: Dispersions.

    Raises:
        ValueError: If the shape is not known and there are no points.
    """
    if table is not None:
        return _of_table(table)
    name, states = curves.attrs.get("fragility_shape", LOGNORMAL.name), median.size
    drawn = _DRAWN * np.array([[-1.0], [1.0]]) * np.ones(states)
    if name == LOGNORMAL.name:
        return LognormalShape()
    if name == LOGLOGISTIC.name:
        reach = drawn * _LOGISTIC_REACH / _DRAWN
        return NumericalShape(LOGLOGISTIC.probability, reach, drawn, tail=LOGIT.deviation)
    if name == DEMAND_AND_COLLAPSE:
        return _of_cloud(function, curves, median, dispersion, drawn)
    raise ValueError(
        f"{function}: the curves are of the shape {name!r}; known are {LOGNORMAL.name!r}, {LOGLOGISTIC.name!r} and "
        f"{DEMAND_AND_COLLAPSE!r}, and any curve as points: fragility_curve(damage_state, intensity)"
    )


def _of_table(table: Table) -> NumericalShape:
    levels, probable = table

    def curve(intensity: np.ndarray, median: np.ndarray, dispersion: np.ndarray) -> np.ndarray:
        rows = [np.interp(intensity, levels, row, left=0.0) for row in probable]
        return np.broadcast_to(np.stack(rows), (*median.shape[:-1], intensity.size))

    positive = levels[levels > 0]
    ends = np.log(positive[[0, -1]])[:, None] * np.ones(len(probable))
    first_line = float(levels[1]) if levels[0] == 0 else 0.0
    return NumericalShape(curve, ends, ends, width=np.inf, kinks=levels, first_line=first_line)


def _of_cloud(
    function: str, curves: xr.Dataset, median: np.ndarray, dispersion: np.ndarray, drawn: np.ndarray
) -> NumericalShape:
    """Return the shape of curves of demand and collapse; replicates shift and stretch it in ln(intensity)."""
    missing = [name for name in OF_CLOUD if name not in curves]
    if missing:
        raise ValueError(
            f"{function}: the curves are of the shape {DEMAND_AND_COLLAPSE!r}, and the dataset has no "
            f"{', '.join(missing)}: give all that fragility_of_cloud() returned, or fragility_curve alone as a table"
        )
    *parts, limit = (np.atleast_1d(curves[name].values).astype(np.float64) for name in OF_CLOUD)
    intercept, gradient, scatter, middle, spread_of_collapse = parts
    fits = CloudFits(intercept, gradient, scatter, middle, spread_of_collapse)
    centre, scale = np.log(median)[:, None], dispersion[:, None]

    def curve(intensity: np.ndarray, medians: np.ndarray, dispersions: np.ndarray) -> np.ndarray:
        with np.errstate(divide="ignore"):
            moved = centre + scale * (np.log(intensity) - np.log(medians)) / dispersions
        return fits.probability(np.exp(moved), limit)

    slope, deviation, of_collapse, spread = (float(part[0]) for part in parts[1:])
    # Each of both parts has ended where it is _NORMAL_REACH of its own deviations from its own median.
    alone = (np.log(limit) - float(parts[0][0])) / slope  # but collapse alone passes an infinite limit
    middles, widths = [np.where(np.isfinite(limit), alone, np.log(of_collapse))], [deviation / slope]
    if np.isfinite(of_collapse):
        middles.append(np.full(limit.size, np.log(of_collapse)))
        widths.append(spread)
    ends = [
        np.array([m + side * _NORMAL_REACH * w for m, w in zip(middles, widths, strict=True)]) for side in (-1.0, 1.0)
    ]
    reach = np.stack([ends[0].min(axis=0), ends[1].max(axis=0)])
    reach = (reach - np.log(median)) / dispersion
    return NumericalShape(curve, reach, drawn, width=min(1.0, min(widths) / float(dispersion.max())))
