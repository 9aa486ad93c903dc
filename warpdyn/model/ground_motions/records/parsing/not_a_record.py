"""The error of a file that is not a record of accelerations."""

from __future__ import annotations


class NotARecordError(ValueError):
    """A file contains no accelerations, or may contain none; in an archive such a file is skipped with a warning."""
