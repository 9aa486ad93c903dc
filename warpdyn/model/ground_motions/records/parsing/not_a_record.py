"""Errors of files that are not records of accelerations, and of text with ambiguous columns."""

from __future__ import annotations


class NotARecordError(ValueError):
    """A file contains no accelerations, or may contain none; in an archive such a file is skipped with a warning."""


class AmbiguousTextError(ValueError):
    """The columns of a text are ambiguous; an argument of `read_text` must define them."""
