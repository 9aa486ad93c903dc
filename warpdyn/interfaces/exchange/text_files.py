"""Text files, which appear in their place only when they are complete."""

from __future__ import annotations

import os
from collections.abc import Callable
from pathlib import Path

from warpdyn.foundations.files.disk_errors import disk_error, named_error
from warpdyn.foundations.files.part_files import whole_file
from warpdyn.foundations.files.targets import check_folder, check_replaceable, resolved


def checked_path(function: str, path: str | os.PathLike, *suffixes: str) -> Path:
    """Return a path that may be written, before anything is computed for it.

    Args:
        function: The public function that writes it.
        path: The file, in a folder that exists.
        suffixes: Endings that its name may have, in any case.

    Raises:
        TypeError: If it is not a path.
        ValueError: If its name has another ending.
        OSError: If there is no such folder, or something of that name is not a file (a folder, a device, a pipe), is
            read-only or belongs to another user.
    """
    if not isinstance(path, str | os.PathLike) or not os.fspath(path):
        raise TypeError(f"{function}: path must name a file, got {path!r}")
    path = Path(path)
    if path.suffix.lower() not in suffixes:
        allowed = " or ".join(repr(suffix) for suffix in suffixes)
        raise ValueError(f"{function}: the name of {path} must end in {allowed}")
    target = resolved(path)
    try:
        check_folder(target.parent)
        check_replaceable(target)
    except OSError as error:
        raise named_error(error, path, function) from error
    return path


def write_in_place(path: Path, write: Callable[[str], object]) -> Path:
    """Write a file under another name and move it into its place when it is complete; an older one is replaced.

    If threads or processes write the same file at a time, each writes a file of its own, and the last one stays.

    Args:
        path: The file. If it is a symbolic link, the link stays, and its target is replaced.
        write: Writes the file whose name it is given.

    Raises:
        OSError: If it cannot be written; the message names it, and not the file beside it.
    """
    try:
        with whole_file(resolved(path)) as part:
            write(str(part))
    except OSError as error:
        raise disk_error(error, path) from error
    return path


def write_text(path: Path, text: str) -> Path:
    """Write text as UTF-8 with plain line feeds."""
    return write_in_place(path, lambda name: Path(name).write_text(text, encoding="utf-8", newline="\n"))
