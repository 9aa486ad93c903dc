"""Correlation of spectral accelerations at two periods."""

from __future__ import annotations

import numpy as np
from numpy.typing import ArrayLike

from warpdyn.foundations.core.checks import finite_numbers
from warpdyn.foundations.core.near_misses import suggests_names

SHORTEST, LONGEST = 0.01, 10.0  # range of periods of the model [s]
CORNER, BROAD = 0.109, 0.2  # periods between which the formula changes [s]


@suggests_names
def spectral_correlation(first: ArrayLike, second: ArrayLike) -> np.ndarray:
    """Return the correlation of ln Sa at two periods, for one component of a motion.

    Source: Baker and Jayaram (2008), "Correlation of spectral acceleration values from NGA ground motion models",
    Earthquake Spectra 24(1). The model was derived from records of shallow crustal earthquakes.

    Args:
        first: First periods [s], 0.01 to 10 s, any shape.
        second: Second periods [s]; `first` and `second` are broadcast.

    Returns:
        Correlation coefficients [1], with the broadcast shape of the periods.

    Raises:
        ValueError: If a period is not a number from 0.01 to 10 s.

    Example:
        >>> wd.spectral_correlation([0.3, 1.0, 2.0], 1.0).round(4)
        array([0.5735, 1.    , 0.749 ])
    """
    rows = []
    for name, values in (("first", first), ("second", second)):
        row = finite_numbers(f"spectral_correlation: {name} [s]", values)
        bad = row[(row < SHORTEST * (1 - 1e-9)) | (row > LONGEST * (1 + 1e-9))]
        if bad.size:
            raise ValueError(
                f"spectral_correlation: {name} must be periods from {SHORTEST:g} to {LONGEST:g} s, the range of the "
                f"model, got {bad[0]:g}"
            )
        rows.append(row)
    short, long = np.minimum(*rows), np.maximum(*rows)
    c1 = 1 - np.cos(np.pi / 2 - 0.366 * np.log(long / np.maximum(short, CORNER)))
    with np.errstate(over="ignore"):  # exp overflows only for long periods, where the value is not used
        rise = 1 - 1 / (1 + np.exp(np.minimum(100 * long - 5, 700.0)))
    c2 = np.where(long < BROAD, 1 - 0.105 * rise * (long - short) / (long - 0.0099), 0.0)
    c3 = np.where(long < CORNER, c2, c1)
    c4 = c1 + 0.5 * (np.sqrt(c3) - c3) * (1 + np.cos(np.pi * short / CORNER))
    above = np.where(long < BROAD, np.minimum(c2, c4), c4)
    return np.where(long <= CORNER, c2, np.where(short > CORNER, c1, above))
