"""Tables that a recorded computation looks up."""

from __future__ import annotations

from typing import Any

import numpy as np

from warpdyn.engine.tracing.arrays import Traced, nodes_of
from warpdyn.engine.tracing.nodes import called

PREFIX = "table_"  # names of tables are table_0, table_1, ...

_tables: list[tuple[np.ndarray, ...]] = []


def looked_up(grid: np.ndarray, values: np.ndarray, at: Any, even: np.ndarray | None = None, last: float = 1.0) -> Any:
    """Return for each place the value of its table cell; beyond the ends of the table, that of the end cell.

    Args:
        grid: Increasing left edges of the cells, or all edges.
        values: Value of each cell.
        at: The places.
        even: Values in cells of equal width from 0 to `last`, which need no search; NaN in refined cells.
        last: End of the even cells.
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
    """Return the arrays of the table of a call: grid, values, even cells, and their end."""
    return _tables[int(call.removeprefix(PREFIX))]
