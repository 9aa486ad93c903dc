"""Conversion of fragility curves to another intensity measure, with the added dispersion."""

from __future__ import annotations

from collections.abc import Sequence

import numpy as np
import xarray as xr

from warpdyn.answers.fragility.curve_variables import variable
from warpdyn.answers.fragility.lognormal_fit import check_confidence
from warpdyn.answers.risk.curves.curve_set import CurveSet
from warpdyn.answers.risk.integrals.lognormal import LognormalShape
from warpdyn.answers.risk.measures.regression import CONSTANT, LEAST_MOTIONS, regression_line
from warpdyn.foundations.core.checks import check_kind, whole_number
from warpdyn.foundations.core.messages import warn_of_all
from warpdyn.foundations.core.near_misses import suggests_names
from warpdyn.foundations.core.units import unit_attributes
from warpdyn.model.ground_motions.measures.measure import IntensityMeasure
from warpdyn.model.ground_motions.measures.names import same_measure
from warpdyn.model.ground_motions.motions import GroundMotion, checked_motions
from warpdyn.model.ground_motions.plausibility import warn_of_implausible_motions

USUAL_SLOPES = 0.3, 3.0  # of the logarithm of one measure over that of another
LARGEST_INPUT, LARGEST_CONVERTED = 3.0, 1.5  # dispersions [1]; a larger one of the input may be in percent
FARTHEST = 3.0  # a median farther outside the range of the motions than this factor is an extrapolation


@suggests_names
def convert_curves(
    curves: xr.Dataset,
    motions: Sequence[GroundMotion],
    measure: IntensityMeasure,
    to: IntensityMeasure,
    *,
    confidence: float = 0.95,
    seed: int = 0,
) -> xr.Dataset:
    """Convert lognormal fragility curves from one intensity measure to another, with the added dispersion.

    The two measures of the motions are related by the line ln(measure) = a + b ln(to) with normal residuals of the
    standard deviation s. A curve of median m and dispersion d becomes a lognormal curve of median exp((ln m - a) / b)
    and dispersion sqrt(d^2 + s^2) / b. This is exact if the residuals are normal and independent of the capacity. They
    are not independent if the new measure describes the demand better than the first one; then run the analysis with
    it.

    Source: Baker and Cornell (2006), "Which spectral acceleration are you using?", Earthquake Spectra 22(2) (the
    dispersion must belong to the measure of the hazard).

    Args:
        curves: Lognormal fragility curves, as in `annual_rates`, in `measure`.
        motions: Motions that represent the site, as recorded (not scaled to one level), at least 4.
        measure: Intensity measure of the curves.
        to: The new intensity measure.
        confidence: Probability that the intervals cover the true value [1].
        seed: Seed of the bootstrap over motions.

    Returns:
        A dataset of curves that `annual_rates` and other functions accept: `fragility_median(damage_state)`
        [level_units of the new measure] and `fragility_dispersion` [1], with `_lower` and `_upper` (NaN without
        replicates); `replicate_median` and `replicate_dispersion(replicate, damage_state)`, each from another
        bootstrap sample of the motions; and the line: `slope` b, `intercept` a, `residual_dispersion` s.

    Raises:
        TypeError: If an argument is of another class.
        ValueError: If curves are not lognormal or of another measure, there are fewer than 4 motions, an intensity is
            not above 0 or equal for all motions, or the slope is not above 0.

    Warns:
        UserWarning: If the slope is outside 0.3 to 3, a dispersion of the curves is above 3 or a converted one above
            1.5, a median is outside the range of the motions by more than a factor of 3, or the peak acceleration of a
            motion is implausible.

    Example:
        >>> new = wd.convert_curves(curves, motions, wd.PeakGroundAcceleration(), wd.SpectralAcceleration(0.05))
        >>> new["fragility_dispersion"].round(1).values
        array([0.3, 0.3])
    """
    name = "convert_curves"
    check_confidence(confidence)
    seed = whole_number("seed", seed, 0)
    for key, each in (("measure", measure), ("to", to)):
        check_kind(name, "an intensity measure", each, IntensityMeasure, argument=key)
    given = checked_motions(motions)
    if len(given) < LEAST_MOTIONS:
        raise ValueError(f"{name} needs at least {LEAST_MOTIONS} motions, got {len(given)}")
    found = CurveSet.from_dataset(name, curves)
    if not isinstance(found.limited, LognormalShape):
        raise ValueError(f"{name} converts lognormal curves only: fit the curves by estimator='lognormal'")
    if found.measure and same_measure(found.measure, measure.name) is False:
        raise ValueError(f"{name}: the curves are of {found.measure!r}, but measure= is {measure.name!r}")
    if found.units != measure.level_units:
        raise ValueError(f"{name}: the curves are in {found.units!r}, but {measure.name} is in {measure.level_units!r}")
    levels = np.array([each.level_values(given) for each in (to, measure)])
    if not (levels > 0).all():
        raise ValueError(
            f"{name}: an intensity of {given[int(np.argwhere(~(levels > 0))[0, 1])].name!r} is not above 0"
        )
    x, y = np.log(levels)
    for each, row in zip((to, measure), (x, y), strict=True):
        if np.ptp(row) < CONSTANT:
            raise ValueError(
                f"{name}: {each.name} is {np.exp(row[0]):.4g} {each.level_units} for all {row.size} motions: give "
                "motions as they were recorded, not scaled to one level"
            )
    slope, intercept, deviation, _ = regression_line(x, y)
    if not slope > 0:
        raise ValueError(f"{name}: {measure.name} does not increase with {to.name} (slope {slope:.3g})")
    line = np.array([[slope, intercept, deviation]])
    median, dispersion = (each[0] for each in _in_new_measure(line, found.median[None], found.dispersion[None]))
    warn_of_implausible_motions(given)
    warn_of_all(name, _remarks(found, np.exp(y), slope, dispersion, f"ln({measure.name}) over ln({to.name})"))
    of_measure, state = unit_attributes(to.level_units), "damage_state"
    result: dict[str, tuple] = {
        "fragility_median": variable(state, median, "median capacity", **of_measure),
        "fragility_dispersion": variable(state, dispersion, "dispersion of the capacity"),
        "slope": variable((), slope, f"slope of ln({measure.name}) over ln({to.name})"),
        "intercept": variable((), intercept, f"ln({measure.name}) at {to.name} of 1"),
        "residual_dispersion": variable((), deviation, f"standard deviation of ln({measure.name}) about the line"),
    }
    bounds = np.full((2, 2, median.size), np.nan)
    if found.replicate_median is not None and found.replicate_dispersion is not None:
        draws = np.random.default_rng(seed).integers(x.size, size=(len(found.replicate_median), x.size))
        lines = np.array([regression_line(x[row], y[row])[:3] for row in draws])
        drawn = _in_new_measure(lines, found.replicate_median, found.replicate_dispersion)
        shares = 0.5 - 0.5 * confidence, 0.5 + 0.5 * confidence
        bounds = np.array([np.nanquantile(each, shares, axis=0) for each in drawn])
        of_draws = ("replicate", state)
        result["replicate_median"] = variable(of_draws, drawn[0], "draws of the median", **of_measure)
        result["replicate_dispersion"] = variable(of_draws, drawn[1], "draws of the dispersion")
    for row, key in zip(bounds, ("fragility_median", "fragility_dispersion"), strict=True):
        attributes = of_measure if key == "fragility_median" else {}
        for end, value in zip(("lower", "upper"), row, strict=True):
            result[f"{key}_{end}"] = variable(state, value, f"{result[key][2]['long_name']}, {end} bound", **attributes)
    return xr.Dataset(
        result,
        {state: (state, np.array(found.names), {"long_name": "damage state"})},
        {
            "intensity_measure": to.name,
            "fragility_shape": "lognormal",
            "fragility_method": f"converted from {measure.name} by the regression of {x.size} motions",
            "confidence": float(confidence),
        },
    )


def _remarks(found: CurveSet, intensities: np.ndarray, slope: float, dispersion: np.ndarray, words: str) -> list[str]:
    """Return a sentence for each property of a conversion that makes its result doubtful.

    Args:
        found: The curves before the conversion.
        intensities: Intensity of each motion in the measure of these curves, shape [motion].
        slope: Slope of the line.
        dispersion: Dispersions after the conversion, shape [damage_state].
        words: Text that names what the slope relates.
    """
    remarks, (low, high) = [], (intensities.min(), intensities.max())
    if not USUAL_SLOPES[0] <= slope <= USUAL_SLOPES[1]:
        remarks.append(
            f"the slope of {words} is {slope:.3g}, outside {USUAL_SLOPES[0]:g} to {USUAL_SLOPES[1]:g}: the motions "
            "hardly relate the two measures. Give more motions, with a wider range of intensities"
        )
    for label, median, before, after in zip(found.names, found.median, found.dispersion, dispersion, strict=True):
        if before > LARGEST_INPUT:
            remarks.append(
                f"the dispersion of {label!r} in curves= is {before:.3g}: dispersions are fractions, such as 0.4, not "
                "percent"
            )
        elif after > LARGEST_CONVERTED:
            remarks.append(
                f"the converted dispersion of {label!r} is {after:.3g}, above {LARGEST_CONVERTED:g}: run the analysis "
                "with the new measure instead"
            )
        if not low / FARTHEST <= median <= high * FARTHEST:
            remarks.append(
                f"the median of {label!r}, {median:.3g} {found.units}, is far outside the range of the motions, "
                f"{low:.3g} to {high:.3g} {found.units}, so that the line is extrapolated: give motions of such "
                "intensities, or check the units of the curves"
            )
    return remarks


def _in_new_measure(lines: np.ndarray, median: np.ndarray, dispersion: np.ndarray) -> tuple[np.ndarray, np.ndarray]:
    """Return medians and dispersions in the new measure, shape [replicate, damage_state].

    Args:
        lines: Slope, intercept and deviation of each replicate, shape [replicate, 3].
        median, dispersion: Those in the measure of the curves, shape [replicate, damage_state].
    """
    slope, intercept, deviation = (each[:, None] for each in lines.T)
    slope = np.where(slope > 0, slope, np.nan)  # a sample of few motions may have no increasing line
    with np.errstate(over="ignore"):
        new = np.exp((np.log(median) - intercept) / slope)
    is_known = np.isfinite(new)
    return np.where(is_known, new, np.nan), np.where(is_known, np.sqrt(dispersion**2 + deviation**2) / slope, np.nan)
