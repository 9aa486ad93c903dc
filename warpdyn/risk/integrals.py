"""Integrals of lognormal fragility curves over hazard curves, in closed form for each power-law segment.

With a hazard curve lambda(x) = lambda_r (x / x_r)^-k on a segment and a lognormal capacity of median theta and
dispersion beta, the rate at which capacities within the segment (a, b) are exceeded is

    lambda_r (theta / x_r)^-k exp(k^2 beta^2 / 2) (Phi(z_b + k beta) - Phi(z_a + k beta)),  z = ln(x / theta) / beta,

and the sum over the segments is the annual rate of the damage state (Cornell and others 2002, J. Struct. Eng. 128(4),
equation 5, has the case of one segment from 0 to infinity). Terms are positive, so that nothing cancels.
"""

from __future__ import annotations

import numpy as np
from scipy.special import log_ndtr, ndtr

from warpdyn.risk.hazard_curves import HazardCurve


def rates_by_segment(hazard: HazardCurve, median: np.ndarray, dispersion: np.ndarray) -> np.ndarray:
    """Return the part of the annual rate of exceedance of each capacity that lies between points of the hazard curve.

    Args:
        hazard: The curve.
        median: Median capacity [units of the hazard], any shape.
        dispersion: Dispersion of the capacity [1], of the same shape, above 0.

    Returns:
        Rates [1/year] of capacities below the first point, between each two and above the last, shape [..., point + 1].
    """
    return _rates_of_pieces(hazard, np.log(hazard.intensity), median, dispersion)


def rates_by_bin(
    hazard: HazardCurve, edges: np.ndarray, median: np.ndarray, dispersion: np.ndarray
) -> tuple[np.ndarray, np.ndarray, np.ndarray]:
    """Return the part of the annual rate of exceedance that comes from intensities within each bin.

    That is the integral of the fragility curve over the rate of occurrence of the bin's intensities.

    Args:
        hazard: The curve.
        edges: Edges of the bins [units of the hazard], increasing, shape [bin + 1].
        median: Median capacity [units of the hazard], any shape.
        dispersion: Dispersion of the capacity [1], of the same shape.

    Returns:
        Rates [1/year] of the bins, shape [..., bin], and of intensities below and above all bins, each of the median's
        shape.
    """
    merged = np.unique(np.concatenate([np.log(hazard.intensity), np.log(edges)]))
    pieces = _rates_of_pieces(hazard, merged, median, dispersion)
    # Rate at which capacities below each edge are exceeded; by parts, the rate from intensities below it follows.
    below = np.cumsum(pieces, axis=-1)[..., np.searchsorted(merged, np.log(edges))]
    probability = ndtr((np.log(edges) - np.log(median)[..., None]) / dispersion[..., None])
    by_parts = below - probability * hazard.rate_of(edges)
    parts = np.diff(by_parts, axis=-1), by_parts[..., 0], pieces.sum(axis=-1) - by_parts[..., -1]
    # Where next to nothing comes from, the difference of two rates is their rounding.
    within, under, over = (np.maximum(part, 0.0) for part in parts)
    return within, under, over


def _rates_of_pieces(
    hazard: HazardCurve, log_edges: np.ndarray, median: np.ndarray, dispersion: np.ndarray
) -> np.ndarray:
    """Return the rates of capacities between edges, which hold all points of the hazard curve, and outside of them."""
    mean, spread = np.log(median)[..., None], np.asarray(dispersion)[..., None]
    log_x, log_rate = np.log(hazard.intensity), np.log(hazard.annual_rate)
    edges = np.concatenate([[-np.inf], log_edges, [np.inf]])
    segment = np.clip(np.searchsorted(log_x, edges[:-1], side="right") - 1, 0, log_x.size - 2)
    slope = hazard.slopes[segment]
    scale = log_rate[segment] + slope * (log_x[segment] - mean) + 0.5 * (slope * spread) ** 2
    low, high = ((part - mean) / spread + slope * spread for part in (edges[:-1], edges[1:]))
    # The mass between two values of the standard normal: of the tail that is smaller, in logarithms, as the factor
    # before it grows as fast as the tail falls.
    mirrored = low > 0
    low, high = np.where(mirrored, -high, low), np.where(mirrored, -low, high)
    larger, smaller = log_ndtr(high), log_ndtr(low)
    with np.errstate(divide="ignore", invalid="ignore"):
        mass = np.where(smaller == -np.inf, larger, larger + np.log1p(-np.exp(smaller - larger)))
    return np.exp(scale + mass)
