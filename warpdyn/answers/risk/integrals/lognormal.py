"""Integrals of lognormal fragility curves over hazard curves, in closed form for each power-law segment.

With a hazard curve lambda(x) = lambda_r (x / x_r)^-k on a segment and a lognormal capacity of median theta and
dispersion beta, the rate at which capacities within the segment (a, b) are exceeded is

    lambda_r (theta / x_r)^-k exp(k^2 beta^2 / 2) (Phi(z_b + k beta) - Phi(z_a + k beta)),  z = ln(x / theta) / beta,

and the sum over the segments is the annual rate of the damage state (Cornell and others 2002, J. Struct. Eng. 128(4),
equation 5, has the case of one segment from 0 to infinity). All terms are positive, so rounding errors stay small.
"""

from __future__ import annotations

import numpy as np
from scipy.special import log_ndtr, ndtr

from warpdyn.answers.fragility.estimators import LOGNORMAL
from warpdyn.answers.risk.hazard_curves import HazardCurve

SOURCE = "Cornell and others (2002), J. Struct. Eng. 128(4); in closed form for each power-law segment of the hazard"
_FARTHEST = 40.0  # crossings of curves farther than this from the hazard points, in ln(intensity), are ignored


class LognormalShape:
    """Lognormal shape of fragility curves, integrated in closed form; its methods are those of `NumericalShape`."""

    name, method = LOGNORMAL.name, SOURCE

    def usual(self, median: np.ndarray, dispersion: np.ndarray) -> tuple[np.ndarray, np.ndarray]:
        """Return the lowest and the highest intensity at which curves are drawn, each of shape [damage_state]."""
        return median * np.exp(-3 * dispersion), median * np.exp(3 * dispersion)

    def probability(self, intensity: np.ndarray, median: np.ndarray, dispersion: np.ndarray) -> np.ndarray:
        """Return the probability of exceedance, shape [..., damage_state, point], at intensities of shape [point]."""
        return LOGNORMAL.probability(intensity, median[..., None], dispersion[..., None])

    def rates(
        self, hazard: HazardCurve, median: np.ndarray, dispersion: np.ndarray, *, ordered: bool = False
    ) -> np.ndarray:
        """Return the annual rates of the damage states [1/year], shape [..., damage_state].

        Args:
            hazard: The hazard curve.
            median: Median capacity [units of the hazard], shape [..., damage_state].
            dispersion: Dispersion of the capacity [1], of the same shape.
            ordered: Whether crossing curves are corrected, so that a heavier state is at most as likely as a lighter
                one at every intensity.
        """
        if not ordered:
            return rates_by_segment(hazard, median, dispersion).sum(axis=-1)
        # Between two successive crossings, the same curve is the lowest.
        mean = np.log(median)
        first, second = np.triu_indices(median.shape[-1], 1)
        with np.errstate(divide="ignore", invalid="ignore"):
            crossing = (mean[..., first] * dispersion[..., second] - mean[..., second] * dispersion[..., first]) / (
                dispersion[..., second] - dispersion[..., first]
            )
        points = np.log(hazard.intensity)
        # If two curves never cross, an edge is added at the first point, where it has no effect.
        crossing = np.where(np.isfinite(crossing), crossing, points[0])
        crossing = np.clip(crossing, points[0] - _FARTHEST, points[-1] + _FARTHEST)
        merged = np.sort(
            np.concatenate([np.broadcast_to(points, (*mean.shape[:-1], points.size)), crossing], axis=-1), axis=-1
        )[..., None, :]
        below, whole = _rates_below(hazard, merged, median, dispersion)
        parts = np.concatenate([below[..., :1], np.diff(below, axis=-1), whole[..., None] - below[..., -1:]], axis=-1)
        return np.minimum.accumulate(np.maximum(parts, 0.0), axis=-2).sum(axis=-1)

    def rates_by_bin(
        self, hazard: HazardCurve, edges: np.ndarray, median: np.ndarray, dispersion: np.ndarray
    ) -> tuple[np.ndarray, np.ndarray, np.ndarray]:
        """Return annual rates within bins of intensities, below and above them; see the function `rates_by_bin`."""
        return rates_by_bin(hazard, edges, median, dispersion)


def rates_by_segment(hazard: HazardCurve, median: np.ndarray, dispersion: np.ndarray) -> np.ndarray:
    """Return the annual rates [1/year] at which capacities are exceeded, by the range that contains the capacity.

    The ranges are below, between and above the points of the hazard curve; the result has the shape [..., point + 1].
    Their sum is the annual rate of the damage state. Arguments: see `LognormalShape.rates`.
    """
    return _rates_of_pieces(hazard, np.log(hazard.intensity), median, dispersion)


def rates_by_bin(
    hazard: HazardCurve, edges: np.ndarray, median: np.ndarray, dispersion: np.ndarray
) -> tuple[np.ndarray, np.ndarray, np.ndarray]:
    """Return annual rates [1/year] of a damage state: from intensities in each bin, below all bins and above all bins.

    Args:
        hazard: The hazard curve.
        edges: Edges of the bins [units of the hazard], increasing.
        median: Medians of the curves, of any shape [...].
        dispersion: Dispersions of the curves, of the same shape.

    Returns:
        Rates within the bins, shape [..., bin]; below all bins, shape [...]; above all bins, shape [...].
    """
    log_edges = np.log(edges)
    merged = np.unique(np.concatenate([np.log(hazard.intensity), log_edges]))
    below, whole = _rates_below(hazard, merged, median, dispersion)
    by_parts = below[..., np.searchsorted(merged, log_edges)]
    parts = np.diff(by_parts, axis=-1), by_parts[..., 0], whole - by_parts[..., -1]
    # A difference of two rates can only be negative by rounding.
    within, under, over = (np.maximum(part, 0.0) for part in parts)
    return within, under, over


def _rates_below(
    hazard: HazardCurve, log_edges: np.ndarray, median: np.ndarray, dispersion: np.ndarray
) -> tuple[np.ndarray, np.ndarray]:
    """Return the annual rates from intensities below each edge, shape [..., edge], and the total, shape [...].

    Arguments: see `_rates_of_pieces`.
    """
    pieces = _rates_of_pieces(hazard, log_edges, median, dispersion)
    # Integration by parts converts the rate of capacities below an edge to the rate from intensities below this edge.
    below = np.cumsum(pieces[..., :-1], axis=-1)
    probable = ndtr((log_edges - np.log(median)[..., None]) / dispersion[..., None])
    return below - probable * hazard.rate_of(np.exp(log_edges)), pieces.sum(axis=-1)


def _rates_of_pieces(
    hazard: HazardCurve, log_edges: np.ndarray, median: np.ndarray, dispersion: np.ndarray
) -> np.ndarray:
    """Return the annual rates at which capacities below, between and above edges are exceeded, [..., edge + 1].

    The edges, in ln(intensity), include all points of the hazard curve and increase along the last axis. They broadcast
    with the medians and dispersions, of shape [...].
    """
    mean, spread = np.log(median)[..., None], np.asarray(dispersion)[..., None]
    log_x, log_rate = np.log(hazard.intensity), np.log(hazard.annual_rate)
    end = np.full((*log_edges.shape[:-1], 1), np.inf)
    edges = np.concatenate([-end, log_edges, end], axis=-1)
    segment = np.clip(np.searchsorted(log_x, edges[..., :-1], side="right") - 1, 0, log_x.size - 2)
    slope = hazard.slopes[segment]
    scale = log_rate[segment] + slope * (log_x[segment] - mean) + 0.5 * (slope * spread) ** 2
    low, high = ((part - mean) / spread + slope * spread for part in (edges[..., :-1], edges[..., 1:]))
    # Probability between two standard normal values: use logarithms and the tail in which both values are small,
    # because
    # `scale` grows as fast as the tail decreases.
    mirrored = low > 0
    low, high = np.where(mirrored, -high, low), np.where(mirrored, -low, high)
    larger, smaller = log_ndtr(high), log_ndtr(low)
    with np.errstate(divide="ignore", invalid="ignore"):
        mass = np.where(smaller == -np.inf, larger, larger + np.log1p(-np.exp(smaller - larger)))
    with np.errstate(over="ignore"):  # the rate is infinite for a very large dispersion
        return np.exp(scale + mass)
