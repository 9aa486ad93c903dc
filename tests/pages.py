"""Runs the programs of a page of the site in this process, as the site's build runs them in a kernel of Jupyter."""

from __future__ import annotations

import ast
import re
from contextlib import redirect_stdout
from dataclasses import dataclass, field
from io import StringIO
from pathlib import Path
from typing import Any

from conftest import ROOT

CELL = re.compile(r"^```\{code-cell\}[^\n]*\n(?:(?::[^\n]*\n)+)?(.*?)^```$", re.MULTILINE | re.DOTALL)


@dataclass
class RunPage:
    """What a page left: its variables, all that it printed, and the value of each cell that ends with an expression."""

    variables: dict[str, Any] = field(default_factory=dict)
    printed: str = ""
    shown: list[object] = field(default_factory=list)


def cells_of(page: Path) -> list[str]:
    """Return the programs of a page, cell by cell."""
    return CELL.findall(page.read_text())


def run_page(name: str) -> RunPage:
    """Run every cell of a page, such as "tutorials/hazus_to_loss.md", one after the other in one namespace."""
    page, ran, printed = ROOT / "docs" / name, RunPage(), StringIO()
    cells = cells_of(page)
    assert cells, f"{name} has no programs"
    for number, cell in enumerate(cells):
        *statements, last = ast.parse(cell).body
        ends_with_value = isinstance(last, ast.Expr)
        program = ast.Module(statements if ends_with_value else [*statements, last], type_ignores=[])
        with redirect_stdout(printed):
            exec(compile(program, f"{name}, cell {number}", "exec"), ran.variables)
            if ends_with_value:
                value = eval(compile(ast.Expression(last.value), f"{name}, cell {number}", "eval"), ran.variables)
                ran.shown.append(value)
    ran.printed = printed.getvalue()
    return ran
