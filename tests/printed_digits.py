"""Tolerances for comparisons with printed values."""

from __future__ import annotations

import numpy as np


def half_unit(value: float, digits: int) -> float:
    """Return half a unit of the last of some printed significant digits, with 2 % for rounding of ties."""
    return 0.51 * 10.0 ** (np.floor(np.log10(abs(value))) - digits + 1)
