"""Errors of files that are damaged or are not records of accelerations, and of text with ambiguous columns."""

from __future__ import annotations


class NotARecordError(ValueError):
    """Error: a file contains no accelerations, or perhaps none. In an archive, it is skipped with a warning."""


class AmbiguousTextError(ValueError):
    """Error: the columns of a text are ambiguous, and an argument of `read_text` must define them."""


def damaged(problem: str) -> ValueError:
    """Return the error for a file that differs from its format or contradicts its header, with the remedy."""
    return ValueError(f"{problem}. The file is damaged: get another copy, or correct it")
