"""Errors of files that are damaged or are not records of accelerations, and of text with ambiguous columns."""

from __future__ import annotations


class NotARecordError(ValueError):
    """Error: a file contains no accelerations, or possibly none. In archives, such files are skipped with a warning."""


class AmbiguousTextError(ValueError):
    """Error: the columns of a text file are ambiguous, so that the user must give an argument of `read_text`."""


def damaged(problem: str) -> ValueError:
    """Return the error for a file that differs from its format or contradicts its header; the message has a remedy."""
    return ValueError(f"{problem}. The file is damaged: get another copy, or correct it")
