"""Cloud analysis: regression of ln(demand) on ln(intensity), with collapses censored or modelled separately."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np
from scipy.special import ndtr

from warpdyn.answers.fragility.estimators.binomial import fit_probit
from warpdyn.answers.fragility.estimators.censored import CensoredRegression
from warpdyn.answers.fragility.lognormal_fit import NO_EXCEEDANCE

DEMAND_AND_COLLAPSE = "of demand and collapse"  # value of the attribute `fragility_shape`
_HALVINGS = 80  # number of bisection steps, after which a fractile is exact to rounding


@dataclass(frozen=True, eq=False)
class CloudFits:
    """Fitted regressions of ln(demand) on ln(intensity), with a model of collapse; one fit for each row of weights.

    Args:
        intercept: ln(demand) at an intensity of 1, shape [row].
        slope: Slope of ln(demand) over ln(intensity), shape [row].
        deviation: Standard deviation of ln(demand) about the line, shape [row].
        collapse_median: Median intensity of collapse, shape [row]; infinite without a model of collapse.
        collapse_dispersion: Dispersion of the intensity of collapse [1], shape [row].
        is_censored: Whether the demands of collapsed samples are lower bounds in the regression. Then the model of
            collapse is used only for infinite limits, which only collapse exceeds.
    """

    intercept: np.ndarray
    slope: np.ndarray
    deviation: np.ndarray
    collapse_median: np.ndarray
    collapse_dispersion: np.ndarray
    is_censored: bool = False

    def probability(self, intensity: np.ndarray, limit: np.ndarray) -> np.ndarray:
        """Return the probability that a sample exceeds each limit, by its demand or by collapse.

        Args:
            intensity: Intensities, 0 or above, of a shape that broadcasts with [row, damage_state, point].
            limit: Limits [units of the demand], shape [damage_state].
        """
        parts = (self.intercept, self.slope, self.deviation, self.collapse_median, self.collapse_dispersion)
        intercept, slope, deviation, median, dispersion = (part[:, None, None] for part in parts)
        with np.errstate(divide="ignore", invalid="ignore"):
            logarithm = np.log(intensity)
            stands = ndtr((np.log(limit)[:, None] - intercept - slope * logarithm) / deviation)
            is_left_out = np.isinf(median) | (self.is_censored & np.isfinite(limit)[:, None])
            survives = np.where(is_left_out, 1.0, ndtr((np.log(median) - logarithm) / dispersion))
        return 1.0 - stands * survives

    def fractile(self, share: float, limit: np.ndarray) -> np.ndarray:
        """Return the intensity at which the share `share` of samples exceeds each limit, shape [row, damage_state]."""
        is_finite = np.isfinite(limit)
        with np.errstate(invalid="ignore"):
            of_collapse = np.log(self.collapse_median)[:, None]
            spread = 40.0 * self.collapse_dispersion[:, None]
            demand = (np.log(limit) - self.intercept[:, None]) / self.slope[:, None]
            alone = np.where(is_finite, demand, of_collapse)
            wide = np.where(is_finite, 40.0 * (self.deviation / self.slope)[:, None], spread)
            high = alone + wide
            low = np.where(np.isfinite(of_collapse), np.minimum(alone - wide, of_collapse - spread), alone - wide)
        for _ in range(_HALVINGS):
            with np.errstate(invalid="ignore"):
                middle = 0.5 * (low + high)
            exceeds = self.probability(np.exp(middle)[..., None], limit)[..., 0] > share
            low, high = np.where(exceeds, low, middle), np.where(exceeds, middle, high)
        is_known = np.where(is_finite, self.slope[:, None] > 0, np.isfinite(of_collapse))
        return np.where(is_known, np.exp(0.5 * (low + high)), np.nan)


def fit_censored(
    intensity: np.ndarray, demand: np.ndarray, collapsed: np.ndarray, weights: np.ndarray
) -> tuple[CloudFits, CensoredRegression]:
    """Return regressions of ln(demand) by maximum likelihood; demands of collapsed samples are right-censored.

    Source: Tobin (1958), "Estimation of relationships for limited dependent variables", Econometrica 26.

    Args:
        intensity: Intensity of each sample, shape [sample].
        demand: Demand of each sample, shape [sample]; for a collapsed sample, the value before the collapse.
        collapsed: Whether each sample collapsed, shape [sample].
        weights: Weight of each sample in each fit, shape [row, sample].

    Returns:
        The fits, and the regression with censored values.
    """
    regression = _regression(intensity, demand, collapsed)
    coefficients, deviation = regression.fit(weights)
    never = np.full(len(weights), np.inf)
    fits = CloudFits(coefficients[:, 0], coefficients[:, 1], deviation, never, np.ones_like(never), is_censored=True)
    return fits, regression


def fit_with_collapse(
    intensity: np.ndarray, demand: np.ndarray, collapsed: np.ndarray, weights: np.ndarray
) -> tuple[CloudFits, int]:
    """Return least-squares regressions of samples without collapse, with a probit of the probability of collapse.

    Source: Jalayer, Ebrahimian, Miano, Manfredi and Sezen (2017), "Analytical fragility assessment using unscaled
    ground motion records", Earthquake Engineering and Structural Dynamics 46(15); with a probit on ln(intensity)
    instead of their logit, as in pyFragility. Arguments: see `fit_censored`.

    Returns:
        The fits; the outcome of the fit of collapse, an index into FIT_MEANINGS: it is penalised if the intensities of
        collapsed samples do not overlap with the intensities of other samples.
    """
    regression = _regression(intensity[~collapsed], demand[~collapsed], np.zeros(int((~collapsed).sum()), dtype=bool))
    coefficients, deviation = regression.fit(weights[:, ~collapsed])
    median, dispersion, outcome = fit_collapse(intensity, collapsed, weights)
    return CloudFits(coefficients[:, 0], coefficients[:, 1], deviation, median, dispersion), outcome


def fit_collapse(
    intensity: np.ndarray, collapsed: np.ndarray, weights: np.ndarray
) -> tuple[np.ndarray, np.ndarray, int]:
    """Return median and dispersion of the collapse intensity, fitted by probit; arguments: see `fit_censored`.

    Returns:
        Median intensity of collapse (infinite without collapses), shape [row]; its dispersion [1], shape [row]; the
        outcome of the fit to all samples, an index into FIT_MEANINGS.
    """
    levels, place = np.unique(intensity, return_inverse=True)
    is_at = (place[:, None] == np.arange(levels.size)).astype(np.float64)
    median, dispersion, outcome = fit_probit(levels, (weights * collapsed) @ is_at, weights @ is_at)
    is_none = outcome == NO_EXCEEDANCE
    return np.where(is_none, np.inf, median), np.where(is_none, 1.0, dispersion), int(outcome[0])


def _regression(intensity: np.ndarray, demand: np.ndarray, collapsed: np.ndarray) -> CensoredRegression:
    logarithm = np.log(demand)
    design = np.column_stack([np.ones(intensity.size), np.log(intensity)])
    return CensoredRegression(logarithm, np.where(collapsed, np.inf, logarithm), design)
