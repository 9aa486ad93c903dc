"""Text files, which appear in their place only when they are complete."""

from __future__ import annotations

import os
from collections.abc import Callable
from contextlib import suppress
from pathlib import Path

from warpdyn.files.unfinished import disk_error


def checked_path(function: str, path: str | os.PathLike, *suffixes: str) -> Path:
    """Return a path that may be written, before anything is computed for it.

    Args:
        function: The public function that writes it.
        path: The file, in a folder that exists.
        suffixes: Endings that its name may have, in any case.

    Raises:
        TypeError: If it is no path.
        ValueError: If its name has another ending.
        OSError: If there is no such folder, or a folder has that name.
    """
    if not isinstance(path, str | os.PathLike) or not os.fspath(path):
        raise TypeError(f"{function}: path must name a file, got {path!r}")
    path = Path(path)
    if path.suffix.lower() not in suffixes:
        allowed = " or ".join(repr(suffix) for suffix in suffixes)
        raise ValueError(f"{function}: the name of {path} must end in {allowed}")
    if path.is_dir():
        raise IsADirectoryError(f"{function}: {path} is a folder; name a file in it")
    if not path.parent.is_dir():
        raise FileNotFoundError(f"{function}: there is no folder {path.parent}; make it first")
    return path


def write_in_place(path: Path, write: Callable[[str], object]) -> Path:
    """Write a file beside its place and move it there when it is complete; an older one is replaced.

    Args:
        path: The file.
        write: Writes the file whose name it is given.

    Raises:
        OSError: If it cannot be written; the message names it, and not the file beside it.
    """
    target = path.resolve()  # a link stays, and its target is written
    part = target.with_name(f".{target.stem}.{os.getpid()}{target.suffix}")
    try:
        write(str(part))
        os.replace(part, target)
    except BaseException as error:
        with suppress(OSError):
            part.unlink()
        if isinstance(error, OSError):
            raise disk_error(error, path) from error
        raise
    return path


def write_text(path: Path, text: str) -> Path:
    """Write text as UTF-8 with plain line feeds."""
    return write_in_place(path, lambda name: Path(name).write_text(text, encoding="utf-8", newline="\n"))
