"""Bilinear idealisation of a capacity curve up to its peak."""

from __future__ import annotations

from collections.abc import Callable
from itertools import pairwise

import numpy as np
from numpy.typing import ArrayLike

from warpdyn.foundations.core.checks import finite_numbers
from warpdyn.foundations.core.messages import warn_caller

LARGEST_DISPLACEMENT = 1e4  # [m]; larger values are probably forces, given in the place of displacements
SECANT_SHARE = 0.6  # the initial stiffness is the secant at this share of the yield strength


def bilinear_curve(displacement: ArrayLike, capacity: ArrayLike) -> tuple[float, float, float]:
    """Return yield displacement, yield strength and hardening ratio of the bilinear idealisation of a capacity curve.

    The bilinear curve ends at the peak of the capacity curve and has the same area up to the peak. Its initial
    stiffness is the secant stiffness of the capacity curve at 0.6 times the yield strength (ASCE 41-17, section
    7.4.3.2.4, up to the peak). A curve that consists of a yield point and an ultimate point is used unchanged. If
    several bilinear curves fulfil these conditions, the curve with the lowest strength is returned. If no bilinear
    curve fulfils them, an elastic-perfectly-plastic curve with the strength of the peak is returned, and a warning is
    given.

    Args:
        displacement: Displacements [m], increasing, with or without the origin, shape [point].
        capacity: Forces [N] or accelerations [m/s2] at these displacements, shape [point].

    Raises:
        ValueError: If the curve starts below zero, has a displacement that does not increase, has no rise or stiffens.
    """
    x, y = checked_curve(displacement, capacity)
    peak = _peak(y)
    if peak < 2:
        raise ValueError(
            "the capacity curve needs a yield point and, after it, another point that is not lower: add such a point"
        )
    given_peak = peak - (x.size - np.size(displacement))  # index of the peak in the argument, which may lack the origin
    x, y = x[: peak + 1], y[: peak + 1]
    end, top = x[-1], y[-1]
    area = np.trapezoid(y, x)

    def yield_displacement(strength: float) -> float:
        share = SECANT_SHARE * strength
        after = int(np.argmax(y >= share))
        place = x[after - 1] + (share - y[after - 1]) * (x[after] - x[after - 1]) / (y[after] - y[after - 1])
        return place / SECANT_SHARE

    def excess(strength: float) -> float:
        """Return (area below the bilinear curve - area below the capacity curve) * 2 / (end * top), up to the peak."""
        return strength / top - yield_displacement(strength) / end + 1 - 2 * area / (top * end)

    straight = 0.5 * top * end
    if area < straight * (1 + 1e-9):
        what = "is a straight line" if area > straight * (1 - 1e-9) else "stiffens"
        raise ValueError(
            f"the capacity curve {what} up to its peak, point {given_peak}, so that no bilinear curve with a hardening "
            "ratio below 1 has the same area: give a curve with a yield point above the line from the origin to the "
            "peak"
        )
    if x.size == 3:
        at, strength = x[1], y[1]
    elif (strength := _first_root(excess, y, top)) is not None:
        at = yield_displacement(strength)
    else:
        warn_caller(
            f"no bilinear curve has the area of the capacity curve up to its peak, point {given_peak}: an "
            "elastic-perfectly-plastic curve with the strength of the peak is used, whose area is "
            f"{1 + excess(top) * 0.5 * top * end / area:.3g} times that of the capacity curve. Compare both "
            "by wd.plots.pushover_curve, or choose a law with more points"
        )
        return yield_displacement(top), float(top), 0.0
    return float(at), float(strength), float((top - strength) / (end - at) * at / strength)


def _first_root(excess: Callable[[float], float], capacity: np.ndarray, top: float) -> float | None:
    """Return the lowest yield strength at which the function `excess` is zero; None if it has no zero up to `top`.

    `excess` is linear in the strength between breakpoints at 1 / 0.6 times the capacities of the curve's points. It
    may rise and fall again. If the capacity curve falls before its peak, `excess` jumps at a breakpoint.
    """
    from scipy.optimize import brentq  # imported here, because the import takes 0.1 s and few scenes need it

    ends = np.unique(capacity / SECANT_SHARE)
    ends = np.append(ends[(ends > 0) & (ends < top)], top)
    for begin, end in pairwise([0.0, *ends]):
        begin += 1e-9 * (end - begin)  # start after a jump of `excess`
        if excess(begin) * excess(end) <= 0:
            return brentq(excess, begin, end, xtol=1e-15 * top, rtol=1e-14)
    # Because of rounding, the zero of an elastic-perfectly-plastic curve, which is at `top`, may be missed above.
    return top if abs(excess(top)) <= 1e-12 else None


def _peak(capacity: np.ndarray) -> int:
    """Return the index of the largest capacity; if several points have the largest capacity, the index of the last."""
    return int(np.flatnonzero(capacity == capacity.max())[-1])


def checked_curve(displacement: ArrayLike, capacity: ArrayLike) -> tuple[np.ndarray, np.ndarray]:
    """Return the displacements and capacities of a curve as arrays, with the origin as first point, shape [point].

    Raises:
        ValueError: If the curve starts below zero, a displacement does not increase or is above LARGEST_DISPLACEMENT,
            or capacities are negative or all zero.
    """
    x, y = finite_numbers("displacement", displacement), finite_numbers("capacity", capacity)
    if x.ndim != 1 or x.shape != y.shape or not x.size:
        raise ValueError(
            f"displacement and capacity must have the same shape [point], got shapes {np.shape(x)} and {np.shape(y)}"
        )
    if x.max() > LARGEST_DISPLACEMENT:
        raise ValueError(
            f"the displacement of the capacity curve reaches {x.max():g} m: give the displacements [m] first and the "
            "capacities [N or m/s2] second; they seem to be swapped"
        )
    if x[0] < 0 or y[0] < 0 or (x[0] == 0 and y[0] != 0) or (x[0] > 0 and y[0] == 0):
        raise ValueError(
            f"the capacity curve starts at ({x[0]:g}, {y[0]:g}), point 0; it must start at the origin or at a point of "
            "positive displacement and capacity"
        )
    for point in np.flatnonzero(np.diff(x) <= 0) + 1:
        raise ValueError(
            f"the capacity curve folds back at point {point}: its displacement {x[point]:g} is not above "
            f"{x[point - 1]:g} before it. Displacements must increase: sort the points, or remove this point"
        )
    for point in np.flatnonzero(y < 0):
        raise ValueError(f"the capacity at point {point} is {y[point]:g}; it must be at least 0: correct it")
    if x[0] > 0:
        x, y = np.append(0.0, x), np.append(0.0, y)
    if y.max() == 0 or y.size < 3:
        raise ValueError(
            "the capacity curve needs a yield point and, after it, another point that is not lower: add such a point"
        )
    return x, y
