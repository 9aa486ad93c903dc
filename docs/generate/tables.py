"""Markdown tables, and pages that are written only if their text changes, so that Sphinx rebuilds only these."""

from __future__ import annotations

import csv
import textwrap
from collections.abc import Iterable, Sequence
from pathlib import Path


def table(head: Sequence[str], rows: Iterable[Sequence[object]]) -> str:
    """Return a table in Markdown."""
    lines = [head, ["-"] * len(head), *rows]
    return "\n".join("| " + " | ".join(str(cell).replace("|", "\\|") for cell in line) + " |" for line in lines) + "\n"


def write(path: Path, text: str) -> None:
    """Write a page, unless the file already has this text."""
    path.parent.mkdir(parents=True, exist_ok=True)
    if not path.is_file() or path.read_text(encoding="utf-8") != text:
        path.write_text(text, encoding="utf-8")


def rows_of(path: Path) -> tuple[str, list[dict[str, str]]]:
    """Return machine and date, from the first line of a measured table, and the rows of the table."""
    lines = path.read_text(encoding="utf-8").splitlines()
    return lines[0].removeprefix("# "), list(csv.DictReader(line for line in lines if not line.startswith("#")))


def prose(docstring: str) -> str:
    """Return a docstring as Markdown: indented lines, which are equations and tables, become blocks of code."""
    blocks = []
    for block in textwrap.dedent(docstring).strip().split("\n\n"):
        is_code = block.startswith("    ")
        blocks.append(f"```text\n{textwrap.dedent(block)}\n```" if is_code else block)
    return "\n\n".join(blocks)
