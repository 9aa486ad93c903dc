"""Masked arrays, which netCDF4 returns by default: masked values are refused, because NumPy would drop the mask."""

from __future__ import annotations

from typing import Any

import numpy as np
from numpy.typing import ArrayLike, DTypeLike


def refuse_masked(what: str, values: object) -> None:
    """Raise a ValueError if a masked array, or a row of a list, has masked values.

    `np.asarray` returns the numbers behind a mask as if they were measured. A masked array without masked values is an
    array like any other.

    Args:
        what: Name of the argument.
        values: What the user gave.
    """
    if isinstance(values, list | tuple):
        for i, row in enumerate(values):
            if isinstance(row, np.ma.MaskedArray | list | tuple):
                refuse_masked(f"{what}[{i}]", row)
    elif np.ma.is_masked(values):
        mask = np.ma.getmaskarray(np.ma.asarray(values))
        place = "".join(f"[{i}]" for i in np.argwhere(mask)[0])
        raise ValueError(
            f"{what}{place} is masked, so its value is unknown ({int(mask.sum())} of {mask.size} values are masked): "
            "fill the gaps, such as values.filled(0.0), or remove them"
        )


def unmasked(what: str, values: ArrayLike, dtype: DTypeLike = None) -> np.ndarray[Any, Any]:
    """Return values as a plain array, as `np.asarray` does; raise a ValueError if some are masked."""
    refuse_masked(what, values)
    return np.asarray(values, dtype=dtype)
