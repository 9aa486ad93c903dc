"""Comparison of intensity measures by a cloud regression: efficiency, proficiency and sufficiency."""

from __future__ import annotations

from collections.abc import Mapping, Sequence

import numpy as np
import xarray as xr
from numpy.typing import ArrayLike
from scipy.special import stdtr, stdtrit

from warpdyn.answers.fragility.curve_variables import variable
from warpdyn.answers.fragility.lognormal_fit import check_confidence
from warpdyn.answers.risk.measures.samples import measured
from warpdyn.campaigns.reductions.limits import DRIFT
from warpdyn.foundations.core.checks import finite_numbers
from warpdyn.foundations.core.near_misses import suggests_names
from warpdyn.model.ground_motions.measures.measure import IntensityMeasure
from warpdyn.model.ground_motions.motions import GroundMotion

LEAST_MOTIONS = 4


@suggests_names
def compare_measures(
    run: xr.Dataset,
    motions: Sequence[GroundMotion],
    measures: Sequence[IntensityMeasure],
    *,
    demand: str = DRIFT,
    covariates: Mapping[str, ArrayLike] | None = None,
    confidence: float = 0.95,
) -> xr.Dataset:
    """Return efficiency, proficiency and sufficiency of intensity measures, from the samples of one run.

    For each measure, ln(demand) = intercept + slope * ln(intensity) is fitted by least squares over all samples.
    Efficiency is the standard deviation of the residuals (smaller is better), proficiency is efficiency over slope.
    Sufficiency is the p-value of the slope of the residuals (their mean for each motion) against a covariate such as
    magnitude or ln(distance): below 0.05 the measure does not describe the effect of this covariate sufficiently.

    Sources: Luco and Cornell (2007), "Structure-specific scalar intensity measures for near-source and ordinary
    earthquake ground motions", Earthquake Spectra 23(2) (efficiency, sufficiency); Padgett, Nielson and DesRoches
    (2008), "Selection of optimal intensity measures in probabilistic seismic demand models of highway bridge
    portfolios", Earthquake Engineering & Structural Dynamics 37(5) (proficiency). Intervals: jackknife over motions
    with Student's t, of the logarithm.

    Args:
        run: A run under recorded motions, usually a `Cloud`, as `simulate` returned it.
        motions: The motions of the run's scene, in its order.
        measures: The intensity measures that are compared.
        demand: Name of the demand; the worst storey or floor counts.
        covariates: Name -> value for each motion [units of the covariate], shape [motion], such as
            `{"magnitude": [6.7, ...]}`.
        confidence: Probability that the intervals cover the true value [1].

    Returns:
        With the dimension `measure`: `slope` [1], `intercept` [1] (demand in its units, intensity in `level_units` of
        the measure, "g" for accelerations), `efficiency` and `proficiency` [1] with `_lower` and `_upper`,
        `determination` (R squared) [1], and `sufficiency(covariate, measure)` [1], the p-values.

    Raises:
        TypeError: If an argument is of another class.
        ValueError: If the motions are not those of the run, there are fewer than 4, samples failed or collapsed (a
            regression needs their demands), a demand is 0, or covariates have another length.

    Example:
        >>> run = wd.simulate(wd.Scene(building, wd.Cloud(motions), recorders=("drift",)))
        >>> measures = [wd.PeakGroundAcceleration(), wd.SpectralAcceleration(0.8)]
        >>> wd.compare_measures(run, motions, measures)["efficiency"].round(2).values
        array([0.44, 0.22])
    """
    name = "compare_measures"
    check_confidence(confidence)
    found = measured(name, run, motions, measures)
    worst, count = found.worst(name, demand), run.sizes["motion"]
    if not (worst > 0).all():
        missing = int((~(worst > 0)).sum())
        raise ValueError(
            f"{name}: {missing} of {worst.size} samples collapsed or have a demand of 0, which has no logarithm: run "
            "weaker motions, or use fragility_of_cloud"
        )
    if count < LEAST_MOTIONS:
        raise ValueError(f"{name} needs at least {LEAST_MOTIONS} motions, got {count}")
    known = {}
    for key, given in (covariates or {}).items():
        values = finite_numbers(f"covariates[{key!r}]", given)
        if values.shape != (count,) or np.ptp(values) == 0:
            raise ValueError(
                f"covariates[{key!r}] must be a row of {count} numbers, one for each motion and not all equal, got "
                f"shape {values.shape}"
            )
        known[key] = values
    y, logarithms = np.log(worst), np.log(found.intensities)
    rows = np.array([regression_line(x, y) for x in logarithms])
    error = _jackknife_errors(logarithms, y, found.motion)
    half = stdtrit(count - 1, 0.5 + confidence / 2) * error
    slope, intercept, deviation, determination = rows.T
    logs = np.log([deviation, np.where(slope > 0, deviation / np.abs(slope), np.nan)])
    result = {
        "slope": variable("measure", slope, "slope of ln(demand) over ln(intensity)"),
        "intercept": variable("measure", intercept, "ln(demand) at an intensity of 1"),
        "determination": variable("measure", determination, "coefficient of determination R squared"),
    }
    for key, row, width, words in zip(
        ("efficiency", "proficiency"), logs, half, ("deviation of ln(demand)", "efficiency over slope"), strict=True
    ):
        for end, value, side in (("", row, ""), ("_lower", row - width, ", lower"), ("_upper", row + width, ", upper")):
            result[key + end] = variable("measure", np.exp(value), words + side)
    if known:
        residual = y - intercept[:, None] - slope[:, None] * logarithms
        number = np.bincount(found.motion, minlength=count)
        means = np.array(
            [np.bincount(found.motion, each, minlength=count) / np.maximum(number, 1) for each in residual]
        )
        p_values = [[_p_value(x[number > 0], row[number > 0]) for row in means] for x in known.values()]
        result["sufficiency"] = variable(("covariate", "measure"), p_values, "p-value of the slope of the residuals")
    coordinates = {
        "measure": ("measure", [each.name for each in measures], {"long_name": "intensity measure"}),
        "level_units": ("measure", [each.level_units for each in measures], {"long_name": "units of the intensity"}),
    }
    if known:
        coordinates["covariate"] = ("covariate", list(known), {"long_name": "property of the motions"})
    return xr.Dataset(result, coordinates, {"demand": demand, "confidence": float(confidence), "motions": count})


def regression_line(x: np.ndarray, y: np.ndarray) -> tuple[float, float, float, float]:
    """Return slope, intercept, standard deviation of the residuals and R squared of a least-squares line."""
    offset, centred = x - x.mean(), y - y.mean()
    slope = float(offset @ centred / (offset @ offset))
    remaining = centred - slope * offset
    deviation = float(np.sqrt(remaining @ remaining / (x.size - 2)))
    return slope, float(y.mean() - slope * x.mean()), deviation, float(1 - remaining @ remaining / (centred @ centred))


def _jackknife_errors(logarithms: np.ndarray, y: np.ndarray, motion: np.ndarray) -> np.ndarray:
    """Return standard errors of ln(efficiency) and ln(proficiency) of each measure, shape [2, measure]."""
    motions = np.unique(motion)
    left = []
    for each in motions:
        kept = motion != each
        lines = np.array([regression_line(x[kept], y[kept]) for x in logarithms])
        left.append(np.log([lines[:, 2], lines[:, 2] / np.abs(lines[:, 0])]))
    spread = np.array(left) - np.mean(left, axis=0)
    error: np.ndarray = np.sqrt((motions.size - 1) / motions.size * (spread**2).sum(axis=0))
    return error


def _p_value(x: np.ndarray, y: np.ndarray) -> float:
    """Return the two-sided p-value of the slope of a least-squares line, by Student's t."""
    slope, _, deviation, _ = regression_line(x, y)
    error = deviation / np.sqrt(((x - x.mean()) ** 2).sum())
    return float(2 * stdtr(x.size - 2, -abs(slope) / error))
