"""The device function that looks up a value in a table, for a computation that was recorded from Python code."""

from collections.abc import Sequence
from typing import Any

import warp as wp

from warpdyn.engine.tracing.tables import table_of


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


def args_of(calls: Sequence[str], device: str) -> list[Any]:
    """Return the arrays of the tables that `calls` name, in the memory of a device, in the order of `calls`."""
    return [wp.array(values, dtype=wp.float64, device=device) for call in calls for values in table_of(call)]
