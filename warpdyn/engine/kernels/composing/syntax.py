"""Parse Python texts while other threads parse, too."""

from __future__ import annotations

import ast
import time

ATTEMPTS, PAUSE = 10, 0.01  # attempts to parse a text, and time between them [s]


def syntax_tree(text: str) -> ast.Module:
    """Return the syntax tree of a Python text.

    CPython 3.11 may raise a SystemError ("AST constructor recursion depth mismatch") if another thread, such as one in
    which Warp builds a kernel, parses at the same time. Then the text is parsed again.
    """
    for _ in range(ATTEMPTS - 1):
        try:
            return ast.parse(text)
        except SystemError:
            time.sleep(PAUSE)
    return ast.parse(text)
