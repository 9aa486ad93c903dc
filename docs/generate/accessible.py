"""Corrections of HTML that Sphinx, docutils and pandas write and that screen readers cannot read."""

from __future__ import annotations

import re
from typing import Any

from sphinx.application import Sphinx

EMPTY_HEADER = re.compile(r"<th\b([^>]*)>\s*(?:<p>\s*</p>\s*)?</th>")
EQUATION_AS_HEADER = re.compile(r"<th\b([^>]*)><p>\s*<math\b((?:(?!</math>).)*</math>)\s*</p></th>", re.DOTALL)
PARAMETERS = re.compile(r"<dl>\s*((?:<dd>(?:(?!</?d[dlt]>).)*</dd>\s*)+)</dl>", re.DOTALL)
DATAFRAME = re.compile(r'<table\b[^>]*class="dataframe".*?</table>', re.DOTALL)
TAG = re.compile(r"<[^>]*>")


def _named(found: re.Match[str]) -> str:
    """Return a header with its equation for the eye, and the text of the equation for screen readers."""
    text = "".join(TAG.sub("", f"<math{found[2]}").split())
    spoken = f'<span class="visually-hidden">{text}</span>'
    return f'<th{found[1]}><p><math aria-hidden="true"{found[2]}{spoken}</p></th>'


def _as_list(found: re.Match[str]) -> str:
    items = found[1].replace("<dd>", "<li>").replace("</dd>", "</li>")
    return f'<ul class="sig-parameters">{items}</ul>'


def _scoped(found: re.Match[str]) -> str:
    """Return a table of pandas whose headers state whether they are those of columns or of rows."""
    head, end, rows = found[0].partition("</thead>")
    return re.sub(r"<th\b", '<th scope="col"', head) + end + re.sub(r"<th\b", '<th scope="row"', rows)


def corrected(body: str) -> str:
    """Return the body of a page with these corrections.

    - An empty header of a table becomes an empty cell, because screen readers announce a header without a name.
    - A header that consists of an equation gets the text of the equation, because screen readers need not read MathML.
    - Headers of a table of pandas state what they belong to.
    - The parameters of a long signature, for which Sphinx writes a definition list without terms, become a list.
    """
    body = EMPTY_HEADER.sub(r"<td\1></td>", body)
    body = EQUATION_AS_HEADER.sub(_named, body)
    body = DATAFRAME.sub(_scoped, body)
    return PARAMETERS.sub(_as_list, body)


def _correct(app: Sphinx, page: str, template: str, context: dict[str, Any], tree: Any) -> None:
    if "body" in context:
        context["body"] = corrected(context["body"])


def setup(app: Sphinx) -> dict[str, bool]:
    """Correct each page before it is written."""
    app.connect("html-page-context", _correct)
    return {"parallel_read_safe": True, "parallel_write_safe": True}
