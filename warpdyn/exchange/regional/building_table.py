"""The table of `building_results`, checked before a file is made of it."""

from __future__ import annotations

from collections.abc import Iterator

import pandas as pd

from warpdyn.core.checks import check_kind
from warpdyn.statistics.building_results import PROBABILITY, STANDARD_ERROR

ROWS_AT_A_TIME = 2**16  # of which text is held at once: some ten megabytes
ADVICE = "give what building_results(counted, stock, inventory) returned"


def checked_results(function: str, results: object, *names: str) -> tuple[pd.DataFrame, list[str]]:
    """Return a table of results and the damage states that it has probabilities of, no damage first.

    Args:
        function: The public function.
        results: The table.
        names: Columns that are needed besides.

    Raises:
        TypeError: If it is no DataFrame.
        ValueError: If a column is missing, or a place is not.
    """
    check_kind(function, "a DataFrame", results, pd.DataFrame, ADVICE)
    assert isinstance(results, pd.DataFrame)
    needed = ("id", "longitude", "latitude", "sample_count", *names)
    missing = [name for name in needed if name not in results]
    states = [
        str(name).removeprefix(PROBABILITY)
        for name in results.columns
        if str(name).startswith(PROBABILITY) and f"{STANDARD_ERROR}{str(name).removeprefix(PROBABILITY)}" in results
    ]
    if missing or not states:
        raise ValueError(f"{function}: the table has no {', '.join(missing) or 'probabilities of damage'}: {ADVICE}")
    nowhere = results[["longitude", "latitude"]].isna().any(axis=1).to_numpy()
    if nowhere.any():
        raise ValueError(
            f"{function}: {nowhere.sum():,} buildings have no place, such as {results['id'].iloc[nowhere.argmax()]!r}"
        )
    return results, states


def parts_of(table: pd.DataFrame) -> Iterator[pd.DataFrame]:
    """Return a table part by part."""
    for first in range(0, len(table), ROWS_AT_A_TIME):
        yield table.iloc[first : first + ROWS_AT_A_TIME]
