"""The error of a file that is not a record of accelerations."""

from __future__ import annotations


class NotARecordError(ValueError):
    """A file contains no accelerations, or nothing shows that it does; in an archive it is left out, with a warning."""
