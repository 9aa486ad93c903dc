"""Errors of an integration method in period and amplitude of free vibration, and the step that limits their sum."""

from __future__ import annotations

from functools import cache

import numpy as np

from warpdyn.engine.methods.kinds import Method
from warpdyn.engine.methods.table import METHODS
from warpdyn.engine.tracing.arrays import is_traced
from warpdyn.engine.tracing.tables import looked_up

# Steps w h (circular frequency times step) at which errors are tabulated; longer steps do not resolve the vibration.
TABULATED = np.geomspace(1e-3, 1.5, 400)


def error_of_a_cycle(method: Method, frequency_step: np.ndarray) -> np.ndarray:
    """Return the error after one undamped cycle, relative to the amplitude: phase error plus amplitude error.

    The phase error is 2 pi |T_h / T - 1|, where T_h is the period of the numerical solution and T the exact period. The
    amplitude error is the growth or decay. Both follow from the eigenvalue of the amplification matrix that
    approximates exp(i w h) (Bathe and Wilson 1973).

    Args:
        method: Integration method, a value of METHODS.
        frequency_step: w h, circular frequency times step, shape [...].
    """
    x = np.asarray(frequency_step, dtype=np.float64)
    if method.kind == "exact" or method.is_adaptive:
        return np.zeros_like(x)
    eigenvalues = np.linalg.eigvals(method.amplification(x, np.zeros_like(x)))
    exact = np.exp(1j * x)[..., None]
    nearest = np.take_along_axis(eigenvalues, np.abs(eigenvalues - exact).argmin(axis=-1)[..., None], axis=-1)
    return np.abs(np.log(nearest / exact)[..., 0]) * 2 * np.pi / x


@cache
def _table(name: str) -> np.ndarray:
    """Return, for each tabulated step, the largest error of a cycle with this step or a shorter one, shape [step]."""
    return np.maximum.accumulate(error_of_a_cycle(METHODS[name], TABULATED))


def accurate_step(method: Method, period: np.ndarray, cycles: np.ndarray, error: float) -> np.ndarray:
    """Return the longest steps [s] with which the error after a number of cycles is at most `error`.

    Args:
        method: Integration method, a value of METHODS.
        period: Periods [s], shape [...].
        cycles: Number of cycles of the vibration, shape [...] like `period`.
        error: Error after these cycles, relative to the amplitude.

    Returns:
        Steps [s], shape [...] like `period`; infinite for exact and adaptive methods.
    """
    if method.kind == "exact" or method.is_adaptive:
        return np.full(np.shape(period), np.inf)
    if is_traced(period, cycles):
        step = looked_up(_table(method.name), TABULATED, error / np.maximum(cycles, 1.0))
        return step * period / (2 * np.pi)
    place = np.searchsorted(_table(method.name), error / np.maximum(cycles, 1.0), side="right") - 1
    return TABULATED[np.maximum(place, 0)] * period / (2 * np.pi)
