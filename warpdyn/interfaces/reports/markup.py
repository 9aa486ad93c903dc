"""Parts of a report (headings, paragraphs, tables and figures), and the HTML page made of them with a template."""

from __future__ import annotations

import base64
import io
from collections.abc import Iterable, Sequence
from pathlib import Path
from typing import Any

from jinja2 import Environment, FileSystemLoader
from matplotlib.figure import Figure

from warpdyn.foundations.core.description import number_text

DPI = 130  # resolution of figures [pixels per inch]: about 900 pixels on the 18 cm of an A4 page

Part = dict[str, Any]  # the key "kind" names the kind of part; page.html shows the other values


def page(title: str, generator: str, parts: Iterable[Part]) -> str:
    """Return the text of an HTML page of a report that does not load other files.

    Args:
        title: Title of the page, as plain text.
        generator: Name and version of the program that wrote the page.
        parts: Headings, paragraphs, tables and figures, in the order of the page.
    """
    templates = Environment(
        loader=FileSystemLoader(Path(__file__).parent), autoescape=True, trim_blocks=True, lstrip_blocks=True
    )
    return templates.get_template("page.html").render(title=title, generator=generator, parts=parts)


def heading(text: str, level: int = 2) -> Part:
    """Return a heading as a part of a report."""
    return {"kind": "heading", "text": text, "level": level}


def paragraph(text: str) -> Part:
    """Return a paragraph as a part of a report."""
    return {"kind": "paragraph", "text": text}


def remark(text: str) -> Part:
    """Return an important paragraph as a part of a report, marked by a bar on its left side."""
    return {"kind": "remark", "text": text}


def preformatted(text: str) -> Part:
    """Return text in a monospaced font as a part of a report; spaces and line breaks are kept."""
    return {"kind": "preformatted", "text": text}


def table(caption: str, heads: Sequence[str], rows: Iterable[Sequence[object]]) -> Part:
    """Return a table as a part of a report. Numbers are rounded to four digits; the cell of a NaN is empty."""
    rows = [list(row) for row in rows]
    is_numeric = [bool(rows) and all(_is_number(row[i]) for row in rows) for i in range(len(heads))]
    return {
        "kind": "table",
        "caption": caption,
        "heads": heads,
        "rows": [[_cell(cell) for cell in row] for row in rows],
        "classes": ["number" if each else "text" for each in is_numeric],
    }


def figure(drawn: Figure, caption: str) -> Part:
    """Return a figure as a part of a report: a PNG inside the page; the caption is also its alternative text."""
    file = io.BytesIO()
    drawn.savefig(file, format="png", dpi=DPI)
    return {"kind": "figure", "caption": caption, "png": base64.b64encode(file.getvalue()).decode("ascii")}


def _is_number(cell: object) -> bool:
    return isinstance(cell, int | float) and not isinstance(cell, bool)


def _cell(cell: object) -> str:
    if isinstance(cell, float):
        return "" if cell != cell else f"{cell:.4g}"
    return f"{cell:,}" if _is_number(cell) else number_text(cell)
