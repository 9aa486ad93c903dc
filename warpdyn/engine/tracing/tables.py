"""Tables in which a recorded computation looks up values."""

from __future__ import annotations

from typing import Any

import numpy as np

from warpdyn.engine.tracing.arrays import Traced, nodes_of
from warpdyn.engine.tracing.nodes import called

PREFIX = "table_"  # names of tables are table_0, table_1, ...

_tables: list[tuple[np.ndarray, ...]] = []


def looked_up(grid: np.ndarray, values: np.ndarray, at: Any, even: np.ndarray | None = None, last: float = 1.0) -> Any:
    """Return the value of the table cell that contains each of the numbers `at`, as recorded values.

    Numbers beyond the ends of the table have the value of the first or the last cell.

    Args:
        grid: Increasing left edges of the cells, or all edges.
        values: Value of each cell.
        at: The numbers, recorded values.
        even: Values in cells of equal width from 0 to `last`, which need no search; NaN in refined cells.
        last: End of the cells of equal width.
    """
    table = (grid[: values.size].copy(), values, np.array([np.nan]) if even is None else even, np.array([last]))
    same = (
        place
        for place, known in enumerate(_tables)
        if all(np.array_equal(a, b, equal_nan=True) for a, b in zip(known, table, strict=True))
    )
    number = next(same, len(_tables))
    if number == len(_tables):
        _tables.append(table)
    nodes: Any = nodes_of(at)
    found = np.empty(nodes.shape, object)
    for index in np.ndindex(nodes.shape):
        found[index] = called(f"{PREFIX}{number}", nodes[index])
    return Traced(found)


def table_of(call: str) -> tuple[np.ndarray, ...]:
    """Return the arrays of the table that a call names: grid, values, values in cells of equal width, and their end."""
    return _tables[int(call.removeprefix(PREFIX))]
