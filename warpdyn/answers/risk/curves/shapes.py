"""Shapes of fragility curves: lognormal, loglogistic, cloud analysis with collapse, and tables of points."""

from __future__ import annotations

from typing import NamedTuple, TypeAlias

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


class Table(NamedTuple):
    """Curves given as points: name of the variable, intensities [point], probabilities [damage_state, point]."""

    name: str
    levels: np.ndarray
    probability: np.ndarray


# A table may decrease from one point to the next by this much without a warning; fractions of samples scatter more.
MOST_FALL = {"fragility_curve": 1e-3, "exceedance_fraction": 0.1}
TABLES = {"fragility_curve": "intensity", "exceedance_fraction": "stripe"}
# Number of dispersions from the median beyond which the probability is 0 or 1 to rounding, for a normal and a logistic
# distribution; number of dispersions on each side of the median between which curves are drawn.
_NORMAL_REACH, _LOGISTIC_REACH, _DRAWN = 9.0, 22.0, 3.0
CLOUD_VARIABLES = (
    "regression_intercept",
    "regression_slope",
    "regression_deviation",
    "collapse_median",
    "collapse_dispersion",
    "damage_limit",
)


def points_of(function: str, curves: xr.Dataset, names: tuple[str, ...], name: str = "") -> Table | None:
    """Return the points of curves that are given as a table; None for curves with parameters of a known shape.

    Args:
        function: Name of the public function, for messages.
        curves: The dataset of the curves.
        names: Names of the damage states.
        name: Name of a variable that is read as points even if the curves have parameters; "": no such variable.

    Raises:
        ValueError: If the dimensions of the points are wrong, there are fewer than two points, a value is not finite,
            intensities are negative or do not increase, or probabilities are not from 0 to 1.
    """
    known = curves.attrs.get("fragility_shape", LOGNORMAL.name) in (
        LOGNORMAL.name,
        LOGLOGISTIC.name,
        DEMAND_AND_COLLAPSE,
    )
    is_chosen = bool(name)
    if not is_chosen:
        if known and "fragility_median" in curves:
            return None
        name = next((each for each in TABLES if each in curves), "")
        if not name:
            return None
    along = TABLES[name]
    if name not in curves or set(curves[name].dims) != {"damage_state", along} or along not in curves.coords:
        given = f"; its dimensions are {curves[name].dims}" if name in curves else ""
        at = " (or intensities=, at which fitted curves are written)" if is_chosen else ""
        raise ValueError(
            f"{function}: give the variable {name}(damage_state, {along}) with the coordinate {along!r}{at}{given}"
        )
    levels = finite_numbers(f"{function}: {along}", curves[along].values)
    probable = curves[name].transpose("damage_state", along).values.astype(np.float64)
    if levels.size < 2 or levels[0] < 0 or np.any(np.diff(levels) <= 0):
        raise ValueError(
            f"{function}: {along} must have at least 2 increasing intensities of at least 0, got {levels.tolist()}"
        )
    for state, row in zip(names, probable, strict=True):
        bad = np.flatnonzero(~((row >= 0) & (row <= 1)))
        if bad.size:
            raise ValueError(
                f"{function}: {name} of damage state {state!r} is {row[bad[0]]:g} at {levels[bad[0]]:g}; it must be "
                f"known and from 0 to 1. Leave the state out: curves.drop_sel(damage_state={state!r})"
            )
        if levels[0] == 0 and row[0] > 0:
            raise ValueError(
                f"{function}: {name} of damage state {state!r} is {row[0]:g} at intensity 0; it must be 0: set it to "
                "0, or begin the table at a higher intensity"
            )
        place = int(np.argmin(np.diff(row)))
        if row[place] - row[place + 1] > MOST_FALL[name] and not is_chosen:
            warn_caller(
                f"{function}: {name} of damage state {state!r} falls from {row[place]:.3g} at {levels[place]:g} to "
                f"{row[place + 1]:.3g} at {levels[place + 1]:g}, so it may be the probability of being in the state: "
                "give "
                "the probability of reaching or exceeding the state, which grows with the intensity"
            )
    return Table(name, levels, probable)


def shape_of(
    function: str, curves: xr.Dataset, table: Table | None, median: np.ndarray, dispersion: np.ndarray
) -> Shape:
    """Return the shape of fragility curves.

    Args:
        function: Name of the public function, for messages.
        curves: The dataset of the curves.
        table: The points of the curves; None: curves with parameters.
        median: Medians, shape [damage_state].
        dispersion: Dispersions [1], shape [damage_state].

    Raises:
        ValueError: If the attribute `fragility_shape` of the dataset is unknown.
    """
    if table is not None:
        return _of_table(table)
    name, states = curves.attrs.get("fragility_shape", LOGNORMAL.name), median.size
    drawn = _DRAWN * np.array([[-1.0], [1.0]]) * np.ones(states)
    if name == LOGNORMAL.name:
        return LognormalShape()
    if name == LOGLOGISTIC.name:
        reach = drawn * _LOGISTIC_REACH / _DRAWN
        return NumericalShape(name, LOGLOGISTIC.probability, reach, drawn, tail=LOGIT.deviation)
    if name == DEMAND_AND_COLLAPSE:
        return _of_cloud(function, curves, median, dispersion, drawn)
    raise ValueError(
        f"{function}: unknown shape {name!r} of the curves; allowed: {LOGNORMAL.name!r}, {LOGLOGISTIC.name!r} and "
        f"{DEMAND_AND_COLLAPSE!r}. Give other curves as points: fragility_curve(damage_state, intensity)"
    )


def _of_table(table: Table) -> NumericalShape:
    _, levels, probable = table

    def curve(intensity: np.ndarray, median: np.ndarray, dispersion: np.ndarray) -> np.ndarray:
        rows = [np.interp(intensity, levels, row, left=0.0) for row in probable]
        return np.broadcast_to(np.stack(rows), (*median.shape[:-1], intensity.size))

    positive = levels[levels > 0]
    ends = np.log(positive[[0, -1]])[:, None] * np.ones(len(probable))
    first_line = float(levels[1]) if levels[0] == 0 else 0.0
    return NumericalShape("a table", curve, ends, ends, width=np.inf, kinks=levels, first_line=first_line)


def _of_cloud(
    function: str, curves: xr.Dataset, median: np.ndarray, dispersion: np.ndarray, drawn: np.ndarray
) -> NumericalShape:
    """Return the shape of curves from cloud analysis with collapse; draws of curves shift and stretch this shape."""
    missing = [name for name in CLOUD_VARIABLES if name not in curves]
    if missing:
        raise ValueError(
            f"{function}: the curves are of the shape {DEMAND_AND_COLLAPSE!r}, and the dataset has no "
            f"{', '.join(missing)}: give all that fragility_of_cloud() returned, or fragility_curve alone as a table"
        )
    *parts, limit = (np.atleast_1d(curves[name].values).astype(np.float64) for name in CLOUD_VARIABLES)
    intercepts, slopes, deviations, medians, spreads = parts
    fits = CloudFits(intercepts, slopes, deviations, medians, spreads)
    centre, scale = np.log(median)[:, None], dispersion[:, None]

    def curve(intensity: np.ndarray, medians: np.ndarray, dispersions: np.ndarray) -> np.ndarray:
        with np.errstate(divide="ignore"):
            moved = centre + scale * (np.log(intensity) - np.log(medians)) / dispersions
        return fits.probability(np.exp(moved), limit).reshape(moved.shape)

    intercept, slope, deviation, of_collapse, spread = (float(part[0]) for part in parts)
    # The demand part and the collapse part each end _NORMAL_REACH deviations from the part's median.
    alone = (np.log(limit) - intercept) / slope  # an infinite limit is exceeded only by collapse
    middles, widths = [np.where(np.isfinite(limit), alone, np.log(of_collapse))], [deviation / slope]
    if np.isfinite(of_collapse):
        middles.append(np.full(limit.size, np.log(of_collapse)))
        widths.append(spread)
    ends = [
        np.array([m + side * _NORMAL_REACH * w for m, w in zip(middles, widths, strict=True)]) for side in (-1.0, 1.0)
    ]
    reach = np.stack([ends[0].min(axis=0), ends[1].max(axis=0)])
    reach = (reach - np.log(median)) / dispersion
    return NumericalShape(
        DEMAND_AND_COLLAPSE, curve, reach, drawn, width=min(1.0, min(widths) / float(dispersion.max()))
    )
