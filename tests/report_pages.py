"""What stands on a report's page, read by html.parser."""

from __future__ import annotations

import base64
import io
from html.parser import HTMLParser
from pathlib import Path

import numpy as np
from matplotlib.image import imread

VOID = {"meta", "img", "br"}


class Page(HTMLParser):
    """The headings, remarks, tables and figures of a page; fails where its elements are not closed in order.

    Attributes:
        tables: Rows of cells by caption, heads first.
        figures: Pixels by caption.
    """

    def __init__(self, path: Path) -> None:
        super().__init__()
        self.text = path.read_text(encoding="utf-8")
        self.open: list[str] = []
        self.headings: list[str] = []
        self.remarks: list[str] = []
        self.links: list[str] = []
        self.tables: dict[str, list[list[str]]] = {}
        self.figures: dict[str, np.ndarray] = {}
        self._caption, self._words, self._kind = "", "", ""
        self.feed(self.text)
        self.close()
        assert not self.open, self.open

    def handle_starttag(self, tag: str, attrs: list[tuple[str, str | None]]) -> None:
        given = dict(attrs)
        self.links += [value or "" for name, value in attrs if name in ("src", "href")]
        if tag == "img":
            head, data = (given["src"] or "").split(",", 1)
            assert head == "data:image/png;base64"
            self.figures[given["alt"] or ""] = imread(io.BytesIO(base64.b64decode(data)))
        if tag not in VOID:
            self.open.append(tag)
        self._words, self._kind = "", given.get("class") or ""
        if tag == "tr":
            self.tables[self._caption].append([])

    def handle_data(self, data: str) -> None:
        self._words += data

    def handle_endtag(self, tag: str) -> None:
        assert self.open.pop() == tag
        words = self._words.strip()
        if tag in ("h1", "h2", "h3"):
            self.headings.append(words)
        elif tag == "caption":
            count = sum(caption.split(" (again")[0] == words for caption in self.tables)
            self._caption = f"{words} (again {count})" if count else words  # as where a page has several events
            self.tables[self._caption] = []
        elif tag in ("th", "td"):
            self.tables[self._caption][-1].append(words)
        elif tag == "p" and self._kind == "remark":
            self.remarks.append(words)

    def column(self, caption: str, head: str) -> list[str]:
        """Return the cells below a head."""
        heads, *rows = self.tables[caption]
        return [row[heads.index(head)] for row in rows]

    def numbers(self, caption: str, head: str) -> np.ndarray:
        """Return the numbers below a head; NaN where a cell is empty."""
        return np.array([float(cell.replace(",", "") or "nan") for cell in self.column(caption, head)])
