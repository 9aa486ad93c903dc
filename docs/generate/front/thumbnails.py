"""The directive `thumbnails`: small copies of figures of other pages, with a question each.

Each line is `question | page | number of the figure on that page`.
"""

from __future__ import annotations

import html
import shutil
from pathlib import Path
from typing import Any

from docutils import nodes
from PIL import Image
from sphinx.application import Sphinx
from sphinx.errors import ExtensionError
from sphinx.util.docutils import SphinxDirective

WIDTH = 480  # pixels
FOLDER = "_images/thumbnails"


class thumbnails(nodes.General, nodes.Element):
    """Questions and figures, until the pages with the figures have been read."""


class Thumbnails(SphinxDirective):
    """Reads the lines of the directive."""

    has_content = True

    def run(self) -> list[nodes.Node]:
        """Return the node that `fill` replaces."""
        rows = [[part.strip() for part in line.split("|")] for line in self.content if line.strip()]
        return [thumbnails(rows=[(question, page, int(number)) for question, page, number in rows])]


def figures(app: Sphinx, page: str) -> list[nodes.image]:
    """Return the figures of a page, without the second copy of those that have one for the dark theme."""
    found = app.env.get_doctree(page).findall(nodes.image)
    return [image for image in found if "only-dark" not in image.get("classes", [])]


def copy(source: Path, target: Path) -> None:
    """Write a figure as a small one, or a copy of it if it is a drawing."""
    target.parent.mkdir(parents=True, exist_ok=True)
    if source.suffix == ".svg":
        shutil.copyfile(source, target)
        return
    with Image.open(source) as opened:
        picture = opened.convert("RGBA")
        paper = Image.new("RGBA", picture.size, "white")
        paper.alpha_composite(picture)
        paper.thumbnail((WIDTH, 2 * WIDTH))
        paper.convert("RGB").save(target, optimize=True)


def fill(app: Sphinx, tree: nodes.document, page: str) -> None:
    """Replace the directives of a page by links with figures."""
    for node in list(tree.findall(thumbnails)):
        items = []
        for question, shown, number in node["rows"]:
            found = figures(app, shown)
            if number > len(found):
                raise ExtensionError(f"{page}: {shown} has {len(found)} figures, and number {number} is missing")
            image = found[number - 1]
            source = (Path(app.srcdir) / image["uri"]).resolve()
            name = f"{FOLDER}/{shown.replace('/', '_')}_{number}{source.suffix}"
            if app.builder.format == "html":
                copy(source, Path(app.outdir) / name)
            up = "../" * page.count("/")
            section = image.parent
            while not isinstance(section, nodes.section):
                section = section.parent
            link = f"{app.builder.get_relative_uri(page, shown)}#{section['ids'][0]}"
            items.append(
                f'<a class="thumbnail" href="{link}">'
                f'<img src="{up}{name}" alt="{html.escape(image.get("alt", ""))}" loading="lazy">'
                f"<span>{html.escape(question)}</span></a>"
            )
        node.replace_self(nodes.raw("", f'<div class="thumbnails">{"".join(items)}</div>', format="html"))


def pages_with_thumbnails(app: Sphinx, *_: Any) -> list[str]:
    """Return the pages to write again, as figures of other pages may have changed."""
    return [page for page in app.env.found_docs if page == "gallery"]


def setup(app: Sphinx) -> dict[str, bool]:
    """Add the directive."""
    app.add_node(thumbnails)
    app.add_directive("thumbnails", Thumbnails)
    app.connect("env-get-outdated", pages_with_thumbnails)
    app.connect("doctree-resolved", fill)
    return {"parallel_read_safe": True, "parallel_write_safe": True}
