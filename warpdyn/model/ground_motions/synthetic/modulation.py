"""Gamma modulation of the intensity of a synthetic motion over time.

The squared modulating function is the energy times a gamma density of the time. Its shape and scale follow from the
time between 5 and 95 % of the energy and the time of 45 % of the energy.
"""

from __future__ import annotations

import numpy as np
from scipy.special import gammaincinv

LEAST_SHAPE, MOST_SHAPE = 1e-3, 1e6  # bounds of the search
START, MIDDLE, END = 0.05, 0.45, 0.95  # shares of the energy
ITERATIONS = 60  # of the bisection: the interval of ln(shape) becomes 2e-17


def ratio_of(shape: np.ndarray) -> np.ndarray:
    """Return the duration from 5 to 95 % divided by the time of 45 % of the energy; it decreases with the shape."""
    start, middle, end = (gammaincinv(shape, share) for share in (START, MIDDLE, END))
    return (end - start) / middle


def gamma_modulation(duration: np.ndarray, middle: np.ndarray) -> tuple[np.ndarray, np.ndarray]:
    """Return the shape [1] and the scale [s] of the gamma density of the energy, each of shape [motion].

    Args:
        duration: Time from 5 to 95 % of the energy [s], shape [motion].
        middle: Time of 45 % of the energy [s], shape [motion].
    """
    wanted = duration / middle
    low, high = (np.full(wanted.shape, np.log(bound)) for bound in (LEAST_SHAPE, MOST_SHAPE))
    for _ in range(ITERATIONS):
        centre = (low + high) / 2
        is_above = ratio_of(np.exp(centre)) > wanted  # a larger shape has a smaller ratio
        low, high = np.where(is_above, centre, low), np.where(is_above, high, centre)
    shape = np.exp((low + high) / 2)
    return shape, middle / gammaincinv(shape, MIDDLE)
