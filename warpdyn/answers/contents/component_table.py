"""Components from a table with one row for each limit state."""

from __future__ import annotations

from typing import Any

import pandas as pd

from warpdyn.answers.contents.component import ABOVE, Component
from warpdyn.foundations.core.checks import check_kind
from warpdyn.foundations.core.near_misses import did_you_mean, suggests_names

FUNCTION = "components_from_table"
NEEDED = ("component", "demand", "median", "dispersion")
OPTIONAL = ("cost", "place", "period", "unit")


@suggests_names
def components_from_table(table: pd.DataFrame) -> dict[str, Component]:
    """Return components from a table with one row for each limit state, from the lightest to the heaviest.

    Args:
        table: A DataFrame, for example of `pandas.read_csv`, with the columns `component` (name), `demand`, `median`
            [unit of the demand] and `dispersion` [1], and if needed `cost` [currency per unit], `place`, `period` [s]
            and `unit`; see `Component`. `demand`, `place`, `period` and `unit` must be the same in all rows of a
            component.

    Returns:
        The components by name, in the order of the table.

    Raises:
        TypeError: If `table` is not a DataFrame.
        ValueError: If a column is missing or unknown, a row has no name, or the rows of a component contradict each
            other. The error names the component.

    Example:
        >>> rows = [("partition", 0.005, 0.4, 2700.0), ("partition", 0.01, 0.3, 6800.0)]
        >>> table = pd.DataFrame(rows, columns=["component", "median", "dispersion", "cost"])
        >>> wd.components_from_table(table.assign(demand="peak_storey_drift_ratio"))["partition"].medians
        (0.005, 0.01)
    """
    check_kind(FUNCTION, "a pandas DataFrame", table, pd.DataFrame, argument="table")
    for name in NEEDED:
        if name not in table:
            raise ValueError(f"{FUNCTION}: the table has no column {name!r}; it has {', '.join(map(str, table))}")
    for name in table:
        if name not in NEEDED + OPTIONAL:
            hint = did_you_mean(name, [*NEEDED, *OPTIONAL])
            raise ValueError(f"{FUNCTION}: unknown column {name!r}{hint}; allowed are {', '.join(NEEDED + OPTIONAL)}")
    if not len(table):
        raise ValueError(f"{FUNCTION}: the table has no rows")
    if (unnamed := table["component"].isna().to_numpy()).any():
        raise ValueError(f"{FUNCTION}: row {int(unnamed.argmax())} of the table has no name: fill in 'component'")
    found = {}
    for name, rows in table.groupby("component", sort=False):
        common: dict[str, Any] = {}
        for column in ("demand", "place", "period", "unit"):
            values = rows[column].dropna().unique().tolist() if column in rows else []
            if len(values) > 1:
                raise ValueError(f"{FUNCTION}: component {name!r} has several values of {column!r}: {values}")
            common |= {column: values[0]} if values else {}
        if common.get("place") is None:
            common["place"] = ABOVE
        costs = rows["cost"].tolist() if "cost" in rows else None
        try:
            found[str(name)] = Component(
                medians=rows["median"].tolist(), dispersions=rows["dispersion"].tolist(), costs=costs, **common
            )
        except (ValueError, TypeError) as error:
            raise ValueError(f"{FUNCTION}: component {name!r}: {error}") from None
    return found
