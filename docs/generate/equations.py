"""Equations of pages as MathML, which browsers show without a script, so that the site needs no network.

Sphinx's own choices load MathJax from the network, or need LaTeX. docutils converts LaTeX to MathML.
"""

from __future__ import annotations

from typing import Any

from docutils import nodes
from docutils.utils.math.latex2mathml import tex2mathml
from sphinx.application import Sphinx


def mathml(text: str, *, is_block: bool = False) -> str:
    """Return an equation in LaTeX as MathML.

    Raises:
        MathError: If docutils does not know a command.
    """
    return tex2mathml(text, as_block=is_block)


def _inline(translator: Any, node: nodes.math) -> None:
    translator.body.append(mathml(node.astext()))
    raise nodes.SkipNode


def _block(translator: Any, node: nodes.math_block) -> None:
    translator.body.append(f'<div class="equation">{mathml(node.astext(), is_block=True)}</div>\n')
    raise nodes.SkipNode


def setup(app: Sphinx) -> dict[str, bool]:
    """Register the renderer "mathml" of Sphinx's HTML pages."""
    app.add_html_math_renderer("mathml", (_inline, None), (_block, None))
    return {"parallel_read_safe": True, "parallel_write_safe": True}
