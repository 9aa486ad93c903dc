"""Text of record files: its lines, its numbers, and a check that the last number is complete."""

from __future__ import annotations

import re
from collections.abc import Sequence
from pathlib import Path

import numpy as np

from warpdyn.core.messages import warn_caller

_NUMBER = re.compile(r"[+-]?(\d+\.?\d*|\.\d+)([ED][+-]?\d+)?", re.IGNORECASE)


def text_of(path: str | Path) -> str:
    """Return the text of a file, or raise an error that gives the reason why there is none."""
    if Path(path).is_dir():
        raise IsADirectoryError(f"{path}: is a directory, not a file; read_directory reads the .AT2 files in it")
    if not Path(path).is_file():
        raise FileNotFoundError(f"{path}: no such file")
    text = Path(path).read_text(encoding="utf-8-sig", errors="replace")
    if not text.strip():
        raise ValueError(f"{path}: the file is empty")
    return text


def lines_of(text: str) -> list[str]:
    """Return the lines of a text, without blank ones at its end."""
    return text.rstrip().split("\n")  # str.splitlines would also split at form feeds


def number(token: str, place: str) -> float:
    """Return a number, or raise a ValueError that names its place."""
    # The pattern refuses what float() accepts but no record means: "nan", "inf", "1_000".
    value = float(re.sub("[dD]", "E", token)) if _NUMBER.fullmatch(token) else np.nan
    if not np.isfinite(value):
        raise ValueError(f"{place}: {token!r} is not a finite number")
    return value


def check_last_value(text: str, values: Sequence[str], path: str | Path) -> None:
    """Raise a ValueError if the last value of a file is cut; warn if that cannot be decided.

    A value that white space follows is complete. If no newline ends the file, its last value must have as many
    characters after the decimal point, exponent included, as all others; if the others differ, it cannot be decided.

    Args:
        text: The file's text.
        values: Its values as text.
        path: The file.
    """
    if text[-1].isspace():
        return
    *others, last = (len(value.partition(".")[2]) for value in values)
    if len(set(others)) == 1 and others[0] > 0:
        if last < others[0]:
            raise ValueError(
                f"{path}: truncated within its last value, {values[-1]!r}: the others have {others[0]} characters "
                "after the decimal point, and no newline ends the file"
            )
        return
    warn_caller(f"{path}: no newline ends the file, so its last value, {values[-1]!r}, may be truncated")
