"""Checks of the table that `building_results` returns, before a function writes it to a file."""

from __future__ import annotations

from collections.abc import Iterator

import numpy as np
import pandas as pd

from warpdyn.answers.fragility.building_results import PROBABILITY, STANDARD_ERROR, damage_states
from warpdyn.foundations.core.checks import check_kind
from warpdyn.foundations.core.messages import amount_of

ROWS_AT_A_TIME = 2**16  # number of table rows that are converted to text at once, about 10 MB
ROUNDING = 1e-9  # a mean of probabilities may exceed 1 by this much because of rounding
AT_LEAST_ZERO = (
    "number",
    "sample_count",
    "expected_loss_ratio",
    "loss_ratio_standard_deviation",
    "expected_loss",
    "loss_standard_deviation",
)
ADVICE = "pass the result of building_results(counted, stock, inventory)"


def checked_results(function: str, results: object, *names: str) -> tuple[pd.DataFrame, list[str]]:
    """Check a table of building results; return it, and its damage states in order, starting with "none" (no damage).

    Args:
        function: Name of the public function, for error messages.
        results: The table, one row per building.
        names: Names of further columns that the table must contain.

    Raises:
        TypeError: If `results` is not a DataFrame.
        ValueError: If a column or a location is missing, or a value is impossible: a longitude or latitude out of
            range, a probability that is not from 0 to 1, a negative standard error or number of buildings, or an
            infinite value.
    """
    check_kind(function, "a DataFrame", results, pd.DataFrame, ADVICE, argument="results")
    assert isinstance(results, pd.DataFrame)
    needed = ("id", "longitude", "latitude", "sample_count", *names)
    missing = [name for name in needed if name not in results]
    states = damage_states(results)
    if missing or not states:
        raise ValueError(f"{function}: the table has no {', '.join(missing) or 'probabilities of damage'}: {ADVICE}")
    is_missing = results[["longitude", "latitude"]].isna().any(axis=1).to_numpy()
    if is_missing.any():
        raise ValueError(
            f"{function}: {amount_of(int(is_missing.sum()), 'building')} without longitude and latitude, such as "
            f"{results['id'].iloc[is_missing.argmax()]!r}: drop them by .dropna(subset=['longitude', 'latitude'])"
        )
    longitude, latitude = (_numbers(function, results, name) for name in ("longitude", "latitude"))
    is_swapped = (np.abs(latitude) > 90).any() and np.abs(longitude).max() <= 90
    hint = "; are longitude and latitude swapped?" if is_swapped else ""
    _check_range(function, results, "latitude", -90, 90, f" [degree]{hint}")
    _check_range(function, results, "longitude", -180, 180, " [degree]")
    for state in states:
        _check_range(function, results, PROBABILITY + state, 0, 1 + ROUNDING)
        _check_range(function, results, STANDARD_ERROR + state, 0, np.inf)
    for name in AT_LEAST_ZERO:
        if name in results:
            _check_range(function, results, name, 0, np.inf)
    return results, states


def _numbers(function: str, results: pd.DataFrame, name: str) -> np.ndarray:
    """Return a column of the table as float64 numbers, shape [row]; raise a ValueError if it is not numeric."""
    column = results[name]
    if not pd.api.types.is_numeric_dtype(column):
        raise ValueError(
            f"{function}: column {name!r} has the type {column.dtype}; it must contain numbers: convert it by "
            f".astype({{{name!r}: float}})"
        )
    return column.to_numpy(dtype=np.float64, na_value=np.nan)


def _check_range(function: str, results: pd.DataFrame, name: str, low: float, high: float, hint: str = "") -> None:
    """Raise a ValueError if a column contains an infinite value or a value outside a range; the error names the row."""
    values = _numbers(function, results, name)
    bad = (values < low) | (values > high) | np.isinf(values)
    if bad.any():
        row = int(bad.argmax())
        allowed = f"from {low:g} to {high:g}" if high < np.inf else f"finite and at least {low:g}"
        raise ValueError(
            f"{function}: {name} of {results['id'].iloc[row]!r} (row {row}) is {values[row]:g}; it must be "
            f"{allowed}{hint}: correct or drop this row"
        )


def parts_of(table: pd.DataFrame) -> Iterator[pd.DataFrame]:
    """Yield consecutive parts of a table, each with at most ROWS_AT_A_TIME rows."""
    for first in range(0, len(table), ROWS_AT_A_TIME):
        yield table.iloc[first : first + ROWS_AT_A_TIME]
