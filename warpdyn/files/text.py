"""Text files that readers are given, which may be missing, empty or of another kind than the reader takes."""

from __future__ import annotations

import os
from pathlib import Path


def existing_file(function: str, path: str | os.PathLike, argument: str = "path") -> Path:
    """Return the path of a file that is there.

    Args:
        function: The public function that reads it.
        path: The file.
        argument: The name of the argument.

    Raises:
        TypeError: If it is no path.
        ValueError: If it is empty text.
        OSError: If there is no such file, or a folder has that name.
    """
    if not isinstance(path, str | os.PathLike):
        raise TypeError(f"{function}: {argument} must name a file, got {path!r}")
    if not os.fspath(path):
        raise ValueError(f"{function}: {argument} is empty: give the name of a file")
    path = Path(path)
    if path.is_dir():
        raise IsADirectoryError(f"{function}: {path} is a folder; name a file in it")
    if not path.is_file():
        raise FileNotFoundError(f"{function}: there is no file {path}")
    return path


def read_csv_text(function: str, path: str | os.PathLike, kind: str = "CSV") -> str:
    """Return the text of a file of comma-separated values.

    Args:
        function: The public function that reads it.
        path: The file, in UTF-8.
        kind: What the function reads, for the error.

    Raises:
        TypeError, OSError: As of `existing_file`.
        ValueError: If the file is empty, no text, or text of another kind.
    """
    path = existing_file(function, path)
    try:
        text = path.read_text(encoding="utf-8-sig")
    except UnicodeDecodeError as error:
        raise ValueError(
            f"{function}: {path} is no {kind}: its byte {error.start} is no text in UTF-8 (a spreadsheet is exported "
            "as CSV UTF-8)"
        ) from None
    if not text.strip():
        raise ValueError(f"{function}: {path} is empty, and no {kind}")
    if text.lstrip().startswith("<") or "\0" in text:
        raise ValueError(f"{function}: {path} is no {kind}: it begins with {text.strip()[:20]!r}")
    return text
