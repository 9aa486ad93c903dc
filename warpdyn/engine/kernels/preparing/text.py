"""Text of preparing kernels: tables among their arguments."""

import re
from collections.abc import Sequence
from typing import Any

from warpdyn.engine.tracing.tables import PREFIX, value_in_table

PARTS = ("grid", "values", "even", "last")


def tables_in(text: str) -> list[str]:
    """Return the calls of tables in a text, each once."""
    return sorted(set(re.findall(rf"\b{PREFIX}\d+(?=\()", text)))


def arguments_of_tables(calls: Sequence[str]) -> dict[str, str]:
    """Return the arguments of a kernel for tables, as {name: type}."""
    return {f"{call}_{part}": "wp.array(dtype=wp.float64)" for call in calls for part in PARTS}


def written(text: str, calls: Sequence[str]) -> tuple[str, dict[str, Any]]:
    """Return a text in which calls of tables are calls of `value_in_table`, and the names that it adds."""
    for call in calls:
        arrays = ", ".join(f"{call}_{part}" for part in PARTS)
        text = re.sub(rf"\b{call}\(", f"value_in_table({arrays}, ", text)
    return text, {"value_in_table": value_in_table} if calls else {}
