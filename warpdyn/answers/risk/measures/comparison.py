"""Comparison of intensity measures by a cloud regression: efficiency, proficiency and sufficiency."""

from __future__ import annotations

from collections.abc import Mapping, Sequence

import numpy as np
import xarray as xr
from numpy.typing import ArrayLike
from scipy.special import stdtr

from warpdyn.answers.fragility.curve_variables import variable
from warpdyn.answers.fragility.intervals.student_t import jackknife_half_width
from warpdyn.answers.fragility.lognormal_fit import check_confidence
from warpdyn.answers.risk.measures.regression import CONSTANT, LEAST_MOTIONS, regression_line
from warpdyn.answers.risk.measures.samples import measured
from warpdyn.campaigns.reductions.limits import DRIFT
from warpdyn.foundations.core.checks import finite_numbers
from warpdyn.foundations.core.near_misses import suggests_names
from warpdyn.model.ground_motions.measures.measure import IntensityMeasure
from warpdyn.model.ground_motions.motions import GroundMotion


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
    _check_measures(name, measures)
    found = measured(name, run, motions, measures)
    worst, count, with_samples = found.worst(name, demand), run.sizes["motion"], np.unique(found.motion)
    if not (worst > 0).all():
        missing = int((~(worst > 0)).sum())
        raise ValueError(
            f"{name}: {missing} of {worst.size} samples collapsed or have a demand of 0, which has no logarithm: run "
            "weaker motions, or use fragility_of_cloud"
        )
    if with_samples.size < LEAST_MOTIONS:
        raise ValueError(
            f"{name} needs samples of at least {LEAST_MOTIONS} motions, got {with_samples.size}: give a run under more "
            "motions"
        )
    known = {}
    for key, given in (covariates or {}).items():
        values = finite_numbers(f"covariates[{key!r}]", given)
        if values.shape != (count,) or np.ptp(values[with_samples]) == 0:
            raise ValueError(
                f"covariates[{key!r}] must be a row of {count} numbers, one for each motion and not all equal, got "
                f"shape {values.shape}"
            )
        known[key] = values
    y, logarithms = np.log(worst), np.log(found.intensities)
    for measure, row in zip(measures, logarithms, strict=True):
        if np.ptp(row) < CONSTANT:
            raise ValueError(
                f"{name}: {measure.name} is {np.exp(row[0]):.4g} {measure.level_units} in all samples, so that no line "
                "can be fitted: remove it from measures=, or give a run under a Cloud or with several levels"
            )
    rows = np.array([regression_line(x, y) for x in logarithms])
    left = [_logarithms_without(each, logarithms, y, found.motion) for each in with_samples]
    half = jackknife_half_width(left, confidence)
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
    return xr.Dataset(
        result, coordinates, {"demand": demand, "confidence": float(confidence), "motions": with_samples.size}
    )


def _check_measures(function: str, measures: Sequence[IntensityMeasure]) -> None:
    """Raise an error unless `measures` is a list of at least one measure, without repetitions."""
    if not isinstance(measures, list | tuple):
        raise TypeError(
            f"{function}: measures must be a list of intensity measures, such as [wd.PeakGroundAcceleration()]"
        )
    if not measures:
        raise ValueError(
            f"{function}: measures= is empty: give intensity measures, such as wd.SpectralAcceleration(1.0)"
        )
    for place, each in enumerate(measures):
        if each in measures[:place]:
            raise ValueError(f"{function}: {each.name} occurs twice in measures=: remove one of the two")


def _logarithms_without(motion: int, logarithms: np.ndarray, y: np.ndarray, motions: np.ndarray) -> np.ndarray:
    """Return ln(efficiency) and ln(proficiency) of each measure without the samples of one motion, shape [2, measure].

    Args:
        motion: Index of the motion that is left out.
        logarithms: Logarithms of the intensities, shape [measure, sample].
        y: Logarithms of the demands, shape [sample].
        motions: Index of the motion of each sample, shape [sample].
    """
    kept = motions != motion
    slope, _, deviation, _ = np.array([regression_line(x[kept], y[kept]) for x in logarithms]).T
    logs: np.ndarray = np.log([deviation, deviation / np.abs(slope)])
    return logs


def _p_value(x: np.ndarray, y: np.ndarray) -> float:
    """Return the two-sided p-value of the slope of a least-squares line, by Student's t."""
    slope, _, deviation, _ = regression_line(x, y)
    error = deviation / np.sqrt(((x - x.mean()) ** 2).sum())
    return float(2 * stdtr(x.size - 2, -abs(slope) / error))
