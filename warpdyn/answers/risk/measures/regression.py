"""Least-squares lines through the logarithms of intensities."""

from __future__ import annotations

import numpy as np

LEAST_MOTIONS = 4  # of a regression; fewer leave too few degrees of freedom for its standard deviation
CONSTANT = 1e-6  # a smaller range of logarithms is due to rounding only


def regression_line(x: np.ndarray, y: np.ndarray) -> tuple[float, float, float, float]:
    """Return slope, intercept, standard deviation of the residuals and R squared of a least-squares line.

    All four are NaN if `x` is constant.
    """
    if np.ptp(x) < CONSTANT:
        return (float("nan"),) * 4
    offset, centred = x - x.mean(), y - y.mean()
    slope = float(offset @ centred / (offset @ offset))
    remaining = centred - slope * offset
    deviation = float(np.sqrt(remaining @ remaining / (x.size - 2)))
    return slope, float(y.mean() - slope * x.mean()), deviation, float(1 - remaining @ remaining / (centred @ centred))
