"""Storey stiffnesses of shear buildings with given periods."""

from __future__ import annotations

from typing import Any

import numpy as np
from numpy.typing import ArrayLike

from warpdyn.foundations.core.checks import finite_numbers, one_of
from warpdyn.foundations.core.messages import amount_of
from warpdyn.model.structures.lateral_loads import floor_loads, storey_shears
from warpdyn.model.structures.modal import chain_stiffness_matrix

STIFFNESS_DISTRIBUTIONS = ("uniform", "linear_mode")
PERIOD_TOLERANCE = 1e-9  # largest relative difference between a period and its given value
RESTARTS = 10  # searches from further starting points, if the search ends in a local minimum


def chain_of_periods(period: ArrayLike, mass: np.ndarray, height: np.ndarray, distribution: str) -> np.ndarray:
    """Return the storey stiffnesses of a chain with the given periods [N/m], shape [storey].

    The arguments are those of `ShearBuilding.from_periods`; mass [kg] and height [m] have shape [storey].
    """
    one_of("stiffness distribution", distribution, STIFFNESS_DISTRIBUTIONS)
    periods = np.atleast_1d(finite_numbers("period", period))
    storeys = len(mass)
    if periods.ndim != 1 or not 1 <= periods.size <= storeys:
        raise ValueError(
            f"period must be one value, or a list of at most {amount_of(storeys, 'period')} [s], one per mode, got "
            f"shape {np.shape(period)}"
        )
    for mode in np.flatnonzero(periods <= 0):
        raise ValueError(f"the period of mode {mode + 1} is {periods[mode]:g} s; it must be above 0")
    for mode in np.flatnonzero(np.diff(periods) >= 0):
        raise ValueError(
            f"periods must decrease from mode to mode, but mode {mode + 2} has {periods[mode + 1]:g} s after "
            f"{periods[mode]:g} s: sort them with the longest first"
        )
    shape = np.ones(storeys)
    if distribution == "linear_mode":
        # If a mode shape is linear over the height, every storey has the same drift ratio.
        shape = storey_shears(floor_loads("triangular", mass, height)) / height
    stiffness = shape * _scale(shape, mass, periods[0])
    return stiffness if periods.size == 1 else _bent(stiffness, mass, periods)


def _scale(stiffness: np.ndarray, mass: np.ndarray, period: float) -> float:
    return float((2 * np.pi / period / _frequencies(stiffness, mass)[0]) ** 2)


def _frequencies(stiffness: np.ndarray, mass: np.ndarray) -> np.ndarray:
    """Return the circular frequencies of all modes of a chain, in increasing order [rad/s], shape [mode].

    This function uses NumPy, because building a scene must not import the package warp, which takes longer.
    """
    root = np.sqrt(mass)
    return np.sqrt(np.linalg.eigvalsh(chain_stiffness_matrix(stiffness) / np.outer(root, root)))


def _bent(start: np.ndarray, mass: np.ndarray, periods: np.ndarray) -> np.ndarray:
    """Return storey stiffnesses [N/m] that give the chain the given first periods, modified from `start` [N/m].

    A polynomial over the storeys is added to ln(stiffness). Terms of high order are scaled down, so that the change is
    smooth if only a few periods are given. With as many periods as storeys, every stiffness can change separately.
    """
    from scipy.optimize import least_squares  # imported here, because the import takes 0.1 s

    count, storeys = periods.size, start.size
    place = np.linspace(-1, 1, storeys)
    basis = np.linalg.qr(np.polynomial.legendre.legvander(place, storeys - 1))[0] / np.arange(1, storeys + 1) ** 2
    wanted = np.log(2 * np.pi / periods)

    def error(coefficients: np.ndarray) -> np.ndarray:
        return np.log(_frequencies(start * np.exp(basis @ coefficients), mass)[:count]) - wanted

    def slope(coefficients: np.ndarray) -> np.ndarray:
        # For a mode of unit modal mass, d(w^2) = drift^2 dk; here dk is k times the basis functions.
        stiffness = start * np.exp(basis @ coefficients)
        root = 1 / np.sqrt(mass)
        square, vectors = np.linalg.eigh(chain_stiffness_matrix(stiffness) * root[:, None] * root)
        drift = np.diff(root[:, None] * vectors, axis=0, prepend=0.0)[:, :count]
        return (drift**2 * stiffness[:, None] / (2 * square[:count])).T @ basis

    # If the search ends in a local minimum, start again from another point.
    random = np.random.default_rng(0)
    nearest: Any = None
    for scale in (0.0, *np.linspace(0.2, 2.0, RESTARTS)):
        begin = scale * np.arange(1, storeys + 1) * random.normal(size=storeys)
        found = least_squares(error, begin, slope, max_nfev=100, xtol=1e-15, ftol=1e-15, gtol=1e-15)
        if nearest is None or found.cost < nearest.cost:
            nearest = found
        if np.abs(nearest.fun).max() <= PERIOD_TOLERANCE:
            return start * np.exp(basis @ nearest.x)
    worst = int(np.abs(nearest.fun).argmax())
    reached = periods[worst] * np.exp(-nearest.fun[worst])
    raise ValueError(
        f"no chain with these masses was found that has these periods: the nearest has {reached:.6g} s instead of "
        f"{periods[worst]:.6g} s in mode {worst + 1}; give fewer or other periods"
    )
