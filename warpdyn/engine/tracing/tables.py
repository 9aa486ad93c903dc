"""Tables that a recorded computation looks up, and their device function."""

from __future__ import annotations

from typing import Any

import numpy as np
import warp as wp

from warpdyn.engine.tracing.arrays import Traced, nodes_of
from warpdyn.engine.tracing.nodes import called

PREFIX = "table_"  # of the calls of `value_in_table`; the number of the table follows

_tables: list[tuple[np.ndarray, ...]] = []


def looked_up(
    grid: np.ndarray, values: np.ndarray, place: Traced, even: np.ndarray | None = None, last: float = 1.0
) -> Traced:
    """Return the values of the cells of a table in which places are; beyond its ends those of the last cells.

    Args:
        grid: Increasing left edges of the cells, or all edges.
        values: Value of each cell.
        place: The places.
        even: Values in cells of equal width from 0 to `last`, which need no search; NaN in refined cells.
        last: End of the even cells.
    """
    table = (grid[: values.size].copy(), values, np.array([np.nan]) if even is None else even, np.array([last]))
    for number, known in enumerate(_tables):
        if all(np.array_equal(a, b, equal_nan=True) for a, b in zip(known, table, strict=True)):
            break
    else:
        number = len(_tables)
        _tables.append(table)
    nodes = nodes_of(place)
    found = np.empty(nodes.shape, object)
    for index in np.ndindex(nodes.shape):
        found[index] = called(f"{PREFIX}{number}", nodes[index])
    return Traced(found)


def table_of(call: str) -> tuple[np.ndarray, ...]:
    """Return the arrays of the table of a call: grid, values, even cells, and their end."""
    return _tables[int(call.removeprefix(PREFIX))]


@wp.func
def value_in_table(
    grid: wp.array(dtype=wp.float64),
    values: wp.array(dtype=wp.float64),
    even: wp.array(dtype=wp.float64),
    last: wp.array(dtype=wp.float64),
    place: wp.float64,
):
    cells = even.shape[0]
    inside = wp.clamp(wp.float64(cells) / last[0] * place, wp.float64(0.0), wp.float64(cells - 1))
    value = even[int(inside)]
    if wp.isnan(value):
        low = int(0)  # the place is not before this cell, or this is the first
        high = int(values.shape[0])
        while high - low > 1:
            middle = (low + high) // 2
            if grid[middle] <= place:
                low = middle
            else:
                high = middle
        value = values[low]
    return value


def args_of(calls: list[str], device: str) -> list[Any]:
    """Return the arrays of tables in the memory of a device, in the order of `calls`."""
    return [wp.array(values, dtype=wp.float64, device=device) for call in calls for values in table_of(call)]
