"""Checks links and figures of the built site: `python docs/check_links.py results/site`.

Every link within the site has a target, and every figure has alternative text that is not a file name. Sphinx checks
what pages refer to; this also checks what themes and rendered programs write, and the reference's anchors.
"""

from __future__ import annotations

import re
import sys
from html.parser import HTMLParser
from pathlib import Path
from urllib.parse import unquote, urlsplit

FILE = re.compile(r"[0-9a-f]{32}|\.(?:png|svg|jpe?g|gif)$")
SHORTEST = 12  # letters of a description


class Page(HTMLParser):
    """The targets, the links and the figures with their alternative text of an HTML page."""

    def __init__(self, path: Path) -> None:
        super().__init__()
        self.targets: set[str] = set()
        self.links: set[str] = set()
        self.figures: list[tuple[str, str]] = []
        self.feed(path.read_text(encoding="utf-8"))

    def handle_starttag(self, tag: str, attrs: list[tuple[str, str | None]]) -> None:
        if tag == "img":
            given = dict(attrs)
            self.figures.append((given.get("src") or "", (given.get("alt") or "").strip()))
        for name, value in attrs:
            if value and (name == "id" or (tag == "a" and name == "name")):
                self.targets.add(value)
            elif value and name in ("href", "src"):
                self.links.add(value)


def read_pages(site: Path) -> dict[Path, Page]:
    """Return the pages of a site by their paths."""
    return {path.resolve(): Page(path) for path in sorted(site.rglob("*.html")) if "_static" not in path.parts}


def broken_links(site: Path, pages: dict[Path, Page]) -> list[str]:
    """Return the links within a site whose file or anchor is missing, each after the page that contains it."""
    broken = []
    for path, page in pages.items():
        for link in sorted(page.links):
            parts = urlsplit(link)
            if parts.scheme or parts.netloc:
                continue
            target = (path.parent / unquote(parts.path)).resolve() if parts.path else path
            anchor = unquote(parts.fragment)
            missing = not target.exists() or (anchor and target in pages and anchor not in pages[target].targets)
            if missing:
                broken.append(f"{path.relative_to(site.resolve())}: {link}")
    return broken


def figures_without_text(site: Path, pages: dict[Path, Page]) -> list[str]:
    """Return the figures whose alternative text is missing, too short or a file name, after their page."""
    return [
        f"{path.relative_to(site.resolve())}: the figure {source} has the alternative text {text!r}"
        for path, page in pages.items()
        for source, text in page.figures
        if len(text) < SHORTEST or FILE.search(text)
    ]


if __name__ == "__main__":
    folder = Path(sys.argv[1])
    pages = read_pages(folder)
    found = broken_links(folder, pages) + figures_without_text(folder, pages)
    figures = sum(len(page.figures) for page in pages.values())
    print("\n".join(found) or f"all links within the site have targets, and {figures} figures have alternative text")
    sys.exit(bool(found))
