"""Gamma modulation of the intensity of a synthetic motion over time.

The squared modulating function is the energy times a gamma density of the time. Its shape and scale follow from the
time between 5 and 95 % of the energy and the time of 45 % of the energy.
"""

from __future__ import annotations

import functools

import numpy as np
from scipy.interpolate import CubicSpline
from scipy.special import gammaincinv

LEAST_SHAPE, MOST_SHAPE = 0.05, 1e6
KNOTS = 4096  # of the spline, equally spaced in ln(shape); its relative error is below 2e-11
START, MIDDLE, END = 0.05, 0.45, 0.95  # shares of the energy


def ratio_of(shape: np.ndarray) -> np.ndarray:
    """Return the duration from 5 to 95 % divided by the time of 45 % of the energy; it decreases with the shape."""
    start, middle, end = (gammaincinv(shape, share) for share in (START, MIDDLE, END))
    return (end - start) / middle


@functools.cache
def _shape_of_ratio() -> CubicSpline:
    """Return ln(shape) as a function of -ln(ratio)."""
    logarithm = np.linspace(np.log(LEAST_SHAPE), np.log(MOST_SHAPE), KNOTS)
    return CubicSpline(-np.log(ratio_of(np.exp(logarithm))), logarithm)


def gamma_modulation(duration: np.ndarray, middle: np.ndarray) -> tuple[np.ndarray, np.ndarray]:
    """Return the shape [1] and the scale [s] of the gamma density of the energy, each of shape [motion].

    Shapes are limited to the range from LEAST_SHAPE to MOST_SHAPE.

    Args:
        duration: Time from 5 to 95 % of the energy [s], shape [motion].
        middle: Time of 45 % of the energy [s], shape [motion].
    """
    spline = _shape_of_ratio()
    shape = np.exp(spline(np.clip(-np.log(duration / middle), spline.x[0], spline.x[-1])))
    return shape, middle / gammaincinv(shape, MIDDLE)
