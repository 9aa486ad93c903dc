"""Integrals over hazard curves, in closed form, of loss ratios that are linear between intensities."""

from __future__ import annotations

import numpy as np

from warpdyn.answers.risk.hazard_curves import HazardCurve


def begin_of(curve: HazardCurve, levels: np.ndarray) -> float:
    """Return the intensity at which the integral of a piecewise linear function over a hazard curve begins.

    This is the first intensity of the function in `levels`. If it is 0, the integral begins at the first point of the
    hazard curve or at the second intensity, whichever is lower, because the extrapolated hazard would give an unbounded
    rate near 0.
    """
    return float(levels[0] if levels[0] > 0 else min(curve.intensity[0], levels[1]))


def part_above(start: float, levels: np.ndarray, mean: np.ndarray) -> tuple[np.ndarray, np.ndarray]:
    """Return the points of a piecewise linear function above the intensity `start`, with a first point at `start`.

    Args:
        start: The intensity.
        levels: Intensities of the function, shape [point].
        mean: Values of the function (mean loss ratios [1]), shape [point].
    """
    if start <= levels[0]:
        return levels, mean
    above = levels > start
    further = np.append(levels[above], max(levels[-1], 2 * start) if not above.any() else [])
    return np.append(start, further), np.append(np.interp(start, levels, mean), np.interp(further, levels, mean))


def loss_of_year(curve: HazardCurve, levels: np.ndarray, mean: np.ndarray) -> float:
    """Return the integral of a piecewise linear loss ratio over a hazard curve [1/year], exact on each segment.

    Args:
        curve: The hazard curve.
        levels: Intensities of the loss ratio [units of the hazard], increasing, shape [point].
        mean: Mean loss ratios [1], shape [point].
    """
    begin = begin_of(curve, levels)
    if levels[0] == 0:
        mean = np.append(np.interp(begin, levels, mean), mean[levels > begin])
        levels = np.append(begin, levels[levels > begin])
    within = curve.intensity[(curve.intensity > levels[0]) & (curve.intensity < levels[-1])]
    edges = np.unique(np.concatenate([levels, within]))
    low, log_ratio = edges[:-1], np.diff(np.log(edges))
    segment = np.clip(np.searchsorted(curve.intensity, low, side="right") - 1, 0, curve.slopes.size - 1)
    power = 1 - curve.slopes[segment]
    is_one = power == 0  # the integral of 1 / x is a logarithm
    width = np.where(is_one, log_ratio, np.expm1(power * log_ratio) / np.where(is_one, 1.0, power))
    # Integration by parts: loss at the first intensity, plus the increase of the loss between edges times the rates.
    rise = np.diff(np.interp(edges, levels, mean)) / np.diff(edges)
    return float(mean[0] * curve.rate_of(levels[0]) + rise @ (curve.rate_of(low) * low * width))
