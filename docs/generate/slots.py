"""Tables of the slots of kernels, from warpdyn/engine/kernels/slots.py."""

from __future__ import annotations

from collections.abc import Iterable
from pathlib import Path

from generate.tables import table, write
from warpdyn.engine.kernels.slots import COMMON, GROUPS


def write_table(docs: Path) -> None:
    """Write the tables into docs/extending/generated."""
    pages = [f"### {title}\n\n{slots_table(group)}" for title, group in GROUPS.items()]
    write(docs / "extending" / "generated" / "_slots.md", "\n".join(pages))
    rows = [(f"`{name}`", text) for name, text in COMMON.items()]
    write(docs / "extending" / "generated" / "_common.md", table(("variable", "meaning"), rows))


def slots_table(group: dict) -> str:
    """Return the table of one group of slots."""
    rows = [(f"`{name}`", slot.text, slot.index, _code(slot.reads), _code(slot.writes)) for name, slot in group.items()]
    return table(("slot", "purpose", "for each", "may also read", "may change"), rows)


def _code(names: Iterable[str]) -> str:
    return ", ".join(f"`{name}`" for name in names)
