"""Fragility surfaces: probability of damage as a function of two intensity measures (a vector measure)."""

from __future__ import annotations

from collections.abc import Mapping, Sequence

import numpy as np
import xarray as xr
from scipy.special import log_ndtr, ndtr

from warpdyn.answers.fragility.curve_variables import variable
from warpdyn.answers.fragility.demands import damage_of
from warpdyn.answers.fragility.intervals.student_t import jackknife_half_width
from warpdyn.answers.fragility.lognormal_fit import check_confidence
from warpdyn.answers.risk.measures.samples import measured
from warpdyn.campaigns.reductions.limits import DRIFT, DamageLimits, Limit
from warpdyn.foundations.core.messages import warn_of_all
from warpdyn.foundations.core.near_misses import suggests_names
from warpdyn.foundations.core.units import unit_attributes
from warpdyn.model.ground_motions.measures.measure import IntensityMeasure
from warpdyn.model.ground_motions.motions import GroundMotion

TERMS = ("intercept", "first", "second")
MOST_ITERATIONS, CONVERGED = 50, 1e-9
STEEPEST = 100.0  # a larger coefficient of a standardised logarithm means that the samples are separated
COLLINEAR = 0.999  # a larger correlation of the logarithms hardly separates the two coefficients
_POINTS = 41  # intensities along each axis of the surface
_LOG_ROOT = 0.5 * np.log(2 * np.pi)


@suggests_names
def fragility_surface(
    run: xr.Dataset,
    limits: Mapping[str, Limit],
    motions: Sequence[GroundMotion],
    measures: tuple[IntensityMeasure, IntensityMeasure],
    *,
    demand: str = DRIFT,
    confidence: float = 0.95,
) -> xr.Dataset:
    """Fit fragility surfaces: the probability of each damage state as a function of two intensity measures.

    The probability that a sample exceeds the state is Phi(c0 + c1 ln(first) + c2 ln(second)), with coefficients of
    largest binomial likelihood (probit regression) over all samples of the run. A collapsed sample exceeds every state.
    If the interval of c2 contains 0, the second measure adds no information to the first.

    Source: Baker (2007), "Probabilistic structural response assessment using vector-valued intensity measures",
    Earthquake Engineering & Structural Dynamics 36(13) (vector measures). Intervals: jackknife over motions with
    Student's t.

    Args:
        run: A run under recorded motions, such as Stripes or a Cloud, as `simulate` returned it.
        limits: Limit of each damage state, from the lightest to the heaviest [units of the demand], as in `fragility`.
        motions: The motions of the run's scene, in its order.
        measures: Two different intensity measures.
        demand: Name of the demand; the worst storey or floor counts.
        confidence: Probability that the intervals cover the true value [1].

    Returns:
        `coefficient(damage_state, term)` with `_lower` and `_upper`; terms are "intercept", "first" and "second", for
        intensities in `level_units` ("g" for accelerations). `probability(damage_state, first_intensity,
        second_intensity)` [1] over the range of the samples. Coefficients are NaN, with a warning, for a state that all
        or no samples exceed or whose samples are separated; bounds are NaN if this happens without one of the motions.

    Raises:
        TypeError: If an argument is of another class.
        ValueError: If there are not two different measures, the motions are not those of the run, logarithms of both
            measures are proportional, limits are invalid, or samples failed.

    Example:
        >>> both = wd.SpectralAcceleration(0.7), wd.SpectralAcceleration(1.4)
        >>> surface = wd.fragility_surface(run, {"slight": 0.005}, motions, both)
        >>> bool((surface["coefficient"].sel(term="first") > 0).all())
        True
    """
    name = "fragility_surface"
    check_confidence(confidence)
    if not isinstance(measures, list | tuple) or len(measures) != 2:
        raise ValueError(f"{name}: measures must be two intensity measures, such as (measure_1, measure_2)")
    checked = DamageLimits.of(limits, demand)
    found = measured(name, run, motions, measures)
    passed = damage_of(name, found.run, checked, found.status).passed[-1]
    logarithms = np.log(found.intensities)
    if np.linalg.matrix_rank(logarithms - logarithms.mean(axis=1, keepdims=True), tol=1e-8) < 2:
        raise ValueError(
            f"{name}: {measures[0].name} and {measures[1].name} of the samples are proportional or constant: choose "
            "two measures that describe different properties of the motions"
        )
    states, count = checked.states, len(checked.states)
    coefficient, bounds = np.full((count, 3), np.nan), np.full((2, count, 3), np.nan)
    remarks, motion = [], np.unique(found.motion)
    correlation = float(np.corrcoef(logarithms)[0, 1])
    if abs(correlation) > COLLINEAR:
        remarks.append(
            f"{measures[0].name} and {measures[1].name} are nearly collinear (the correlation of their logarithms is "
            f"{correlation:.8g}), so that their effects cannot be separated: choose two measures that describe "
            "different properties of the motions, such as spectral accelerations at distant periods"
        )
    for state, label in enumerate(states):
        exceeds = passed > state
        coefficient[state] = probit_plane(logarithms, exceeds)
        if np.isnan(coefficient[state]).any():
            why = "all or none of the samples exceed it, or the samples are separated"
            if abs(correlation) > COLLINEAR:
                why = f"the measures are nearly collinear, or {why}"
            remarks.append(f"damage state {label!r} has no surface: {why}. Add motions or levels")
            continue
        left = [
            probit_plane(logarithms[:, found.motion != each], exceeds[found.motion != each], coefficient[state])
            for each in motion
        ]
        half = jackknife_half_width(left, confidence)
        bounds[:, state] = coefficient[state] - half, coefficient[state] + half
    warn_of_all(name, remarks)
    axes = [np.geomspace(row.min(), row.max(), _POINTS) for row in found.intensities]
    plane = coefficient[:, 0, None, None] + (
        coefficient[:, 1, None, None] * np.log(axes[0])[:, None] + coefficient[:, 2, None, None] * np.log(axes[1])
    )
    dims, state_dim = ("damage_state", "term"), "damage_state"
    words = "coefficient of the probit"
    return xr.Dataset(
        {
            "coefficient": variable(dims, coefficient, words),
            "coefficient_lower": variable(dims, bounds[0], f"{words}, lower bound"),
            "coefficient_upper": variable(dims, bounds[1], f"{words}, upper bound"),
            "probability": variable(
                (state_dim, "first_intensity", "second_intensity"), ndtr(plane), "probability of exceedance"
            ),
        },
        {
            state_dim: (state_dim, np.array(states), {"long_name": "damage state"}),
            "term": ("term", np.array(TERMS), {"long_name": "term of the probit"}),
            **{
                f"{term}_intensity": variable(f"{term}_intensity", axis, each.name, **unit_attributes(each.level_units))
                for term, axis, each in zip(TERMS[1:], axes, measures, strict=True)
            },
        },
        {
            "first_measure": measures[0].name,
            "second_measure": measures[1].name,
            "demand": ", ".join(checked.demands),
            "fragility_method": "probit regression on the logarithms of two measures",
            "interval_method": "jackknife over motions, Student's t",
            "confidence": float(confidence),
        },
    )


def probit_plane(logarithms: np.ndarray, exceeds: np.ndarray, start: np.ndarray | None = None) -> np.ndarray:
    """Return the coefficients of largest likelihood of a probit on two variables, shape [3]; NaN without a maximum.

    Args:
        logarithms: The variables, shape [2, sample].
        exceeds: Whether each sample exceeds the state, shape [sample].
        start: Coefficients at which the search starts; None: zeros.
    """
    nothing = np.full(3, np.nan)
    if exceeds.all() or not exceeds.any():
        return nothing
    # Standardised variables, so that all coefficients have similar sizes.
    centre, scale = logarithms.mean(axis=1), logarithms.std(axis=1)
    x = np.vstack([np.ones(exceeds.size), (logarithms - centre[:, None]) / scale[:, None]])
    sign = np.where(exceeds, 1.0, -1.0)
    found = np.zeros(3)
    if start is not None:
        found = np.array([start[0] + start[1:] @ centre, *(start[1:] * scale)])
    value = log_ndtr(sign * (found @ x)).sum()
    for _ in range(MOST_ITERATIONS):
        eta = sign * (found @ x)
        ratio = np.exp(-0.5 * eta**2 - _LOG_ROOT - log_ndtr(eta))
        gradient, curvature = x @ (sign * ratio), (x * (ratio * (ratio + eta))) @ x.T
        try:
            step = np.linalg.solve(curvature, gradient)
        except np.linalg.LinAlgError:
            return nothing
        for _ in range(MOST_ITERATIONS):  # the likelihood is concave: half the step until it increases
            new = log_ndtr(sign * ((found + step) @ x)).sum()
            if new >= value - 1e-12 * abs(value):
                break
            step /= 2
        found, value = found + step, new
        if np.abs(found).max() > STEEPEST:
            return nothing
        if np.abs(step).max() < CONVERGED:
            slopes = found[1:] / scale
            return np.array([found[0] - slopes @ centre, *slopes])
    return nothing
