"""The parts of a report's page in HTML: sections, paragraphs, tables, and figures inlined as PNG."""

from __future__ import annotations

import base64
import html
import io
from collections.abc import Iterable, Sequence
from string import Template

from matplotlib.figure import Figure

from warpdyn.foundations.core.description import number_text

DPI = 130  # of figures: 18 cm of an A4 page are some 900 points
PAGE = Template("""\
<!DOCTYPE html>
<html lang="en">
<head>
<meta charset="utf-8">
<meta name="viewport" content="width=device-width, initial-scale=1">
<meta name="generator" content="$generator">
<title>$title</title>
<style>
@page { size: A4; margin: 18mm 16mm; }
body { font: 15px/1.45 system-ui, "Segoe UI", "DejaVu Sans", sans-serif; color: #1a1a1a; background: #fff;
       max-width: 52rem; margin: 2rem auto; padding: 0 1rem; }
h1 { font-size: 1.7rem; margin: 0 0 .3rem; } h2 { font-size: 1.25rem; border-bottom: 1px solid #bbb; margin-top: 2rem; }
h3 { font-size: 1.05rem; margin-bottom: .3rem; }
table { border-collapse: collapse; margin: .8rem 0; display: block; overflow-x: auto; font-size: .88rem; }
caption { text-align: left; font-weight: 600; padding-bottom: .2rem; white-space: nowrap; }
th, td { padding: .2rem .7rem .2rem 0; border-bottom: 1px solid #ddd; vertical-align: top; text-align: left; }
td.number, th.number { text-align: right; font-variant-numeric: tabular-nums; }
figure { margin: 1rem 0; break-inside: avoid; } figure img { max-width: 100%; height: auto; }
figcaption { font-size: .88rem; color: #444; }
pre { white-space: pre-wrap; overflow-wrap: anywhere; font-size: .72rem; background: #f5f5f5; padding: .6rem; }
td.text { overflow-wrap: break-word; } .remark { border-left: 4px solid #d55e00; padding-left: .7rem; }
@media print {
  body { font-size: 10pt; margin: 0; max-width: none; padding: 0; }
  table { display: table; width: 100%; } tr, figure { break-inside: avoid; } h2, h3 { break-after: avoid; }
}
</style>
</head>
<body>
$body
</body>
</html>
""")


def page(title: str, generator: str, body: Iterable[str]) -> str:
    """Return a whole page that needs no other file.

    Args:
        title: Its title, as plain text.
        generator: What wrote it.
        body: Its parts in HTML.
    """
    return PAGE.substitute(title=html.escape(title), generator=html.escape(generator), body="\n".join(body))


def heading(text: str, level: int = 2) -> str:
    """Return a heading."""
    return f"<h{level}>{html.escape(text)}</h{level}>"


def paragraph(text: str, *, is_remark: bool = False) -> str:
    """Return a paragraph; remarks, which a reader must see, have a bar beside them."""
    kind = ' class="remark"' if is_remark else ""
    return f"<p{kind}>{html.escape(text)}</p>"


def table(caption: str, heads: Sequence[str], rows: Iterable[Sequence[object]]) -> str:
    """Return a table whose numbers have four digits, and where what is not a number (NaN) is left empty."""
    rows = [list(row) for row in rows]
    numeric = [bool(rows) and all(_is_number(row[i]) for row in rows) for i in range(len(heads))]
    head = "".join(
        f"<th{_css_class(is_number)}>{html.escape(text)}</th>" for text, is_number in zip(heads, numeric, strict=True)
    )
    body = "".join(
        "<tr>"
        + "".join(f"<td{_css_class(n)}>{_cell(cell)}</td>" for cell, n in zip(row, numeric, strict=True))
        + "</tr>\n"
        for row in rows
    )
    return (
        f"<table><caption>{html.escape(caption)}</caption><thead><tr>{head}</tr></thead><tbody>\n{body}</tbody></table>"
    )


def figure(drawn: Figure, caption: str) -> str:
    """Return a figure as PNG within the page, with its caption, which also stands for it where no image is shown."""
    file = io.BytesIO()
    drawn.savefig(file, format="png", dpi=DPI)
    data, words = base64.b64encode(file.getvalue()).decode("ascii"), html.escape(caption, quote=True)
    image = f'<img alt="{words}" src="data:image/png;base64,{data}">'
    return f"<figure>{image}<figcaption>{words}</figcaption></figure>"


def preformatted(text: str) -> str:
    """Return text as it stands, in letters of one width."""
    return f"<pre>{html.escape(text)}</pre>"


def _is_number(cell: object) -> bool:
    return isinstance(cell, int | float) and not isinstance(cell, bool)


def _css_class(is_number: bool) -> str:
    return ' class="number"' if is_number else ' class="text"'


def _cell(cell: object) -> str:
    if isinstance(cell, float):
        return "" if cell != cell else f"{cell:.4g}"
    return f"{cell:,}" if _is_number(cell) else html.escape(number_text(cell))
