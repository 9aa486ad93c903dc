"""The error of a file that is not a record of accelerations."""

from __future__ import annotations


class NotARecordError(ValueError):
    """A file is recognised as one that contains no accelerations; in an archive it is left out, with a warning."""
