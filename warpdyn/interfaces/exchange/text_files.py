"""Files of other formats: paths are checked before any computation, and files are renamed when they are complete."""

from __future__ import annotations

import csv
import json
import os
from collections.abc import Callable, Sequence
from pathlib import Path

from warpdyn.foundations.files.disk_errors import disk_error, named_error
from warpdyn.foundations.files.part_files import whole_file
from warpdyn.foundations.files.targets import check_folder, check_replaceable, resolved

HEAD = 10_000  # characters of a file in which the mark of its writer must be


def checked_path(function: str, path: str | os.PathLike, *suffixes: str) -> Path:
    """Return a path after checking that it can be written, before anything is computed.

    Args:
        function: The public function that writes the file.
        path: The file, in a folder that exists.
        suffixes: Endings that its name may have, in lower case; capitals in the name are accepted.

    Raises:
        TypeError: If `path` is not a path.
        ValueError: If the name has another ending.
        OSError: If the folder does not exist, or the path is a folder, a device or a pipe, is read-only or belongs to
            another user.
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


def check_same_table(function: str, path: Path, columns: Sequence[str], overwrite: bool) -> None:
    """Raise a FileExistsError if a table would replace a file that is not a table with the same columns.

    CSV files do not contain the name of the program that wrote them, so the columns decide: a script that runs again
    replaces its own table, but not an inventory or a table of another program.

    Args:
        function: The public function that writes the table.
        path: The file; its name ends in ".csv", ".parquet", ".xlsx" or ".geojson".
        columns: Names of the columns (for GeoJSON, of the properties).
        overwrite: Whether to replace any file.
    """
    _check_own(function, path, overwrite, "a table with the same columns", lambda: _columns_of(path) == set(columns))


def check_same_format(function: str, path: Path, mark: str, what: str, overwrite: bool) -> None:
    """Raise a FileExistsError if a file would replace a file that this function of warpdyn has not written.

    Args:
        function: The public function that writes the file.
        path: The file.
        mark: Text in the first lines of each file that this function writes, and of no other file.
        what: Such a file in words.
        overwrite: Whether to replace any file.
    """
    _check_own(function, path, overwrite, what, lambda: mark in _head_of(path))


def _check_own(function: str, path: Path, overwrite: bool, what: str, is_own: Callable[[], bool]) -> None:
    if not isinstance(overwrite, bool):
        raise TypeError(f"{function}: overwrite must be True or False, got {overwrite!r}")
    if not overwrite and path.exists() and not is_own():
        raise FileExistsError(
            f"{function}: {path} exists and is not {what}, so it may contain other data: choose another name, or "
            "replace it by overwrite=True"
        )


def _head_of(path: Path) -> str:
    """Return the first characters of a file; "" if it is not text."""
    try:
        with open(path, encoding="utf-8") as file:
            return file.read(HEAD)
    except (OSError, UnicodeDecodeError):
        return ""


def _columns_of(path: Path) -> set[str] | None:
    """Return the columns of a table; None if the file is not a table in a format that warpdyn writes."""
    try:
        if path.suffix.lower() == ".parquet":
            import pyarrow.parquet

            return set(pyarrow.parquet.read_schema(path).names)
        if path.suffix.lower() == ".xlsx":
            import openpyxl

            book = openpyxl.load_workbook(path, read_only=True)
            try:
                (sheet,) = book.worksheets  # a file with further sheets contains other data
                return set(next(sheet.iter_rows(max_row=1, values_only=True)))
            finally:
                book.close()
        with open(path, encoding="utf-8", newline="") as file:
            if path.suffix.lower() == ".csv":
                return set(next(csv.reader(file)))
            first = next(line for line in file if line.startswith('{"type": "Feature", '))  # each has its own line
            return set(json.loads(first.rstrip(",\n"))["properties"])
    except Exception:  # a file of another kind may cause any error
        return None


def write_in_place(path: Path, write: Callable[[str], object]) -> Path:
    """Write a file under a temporary name and rename it when it is complete; an existing file is replaced.

    If several threads or processes write the same file, each has its own temporary file; the last one to finish
    determines the content.

    Args:
        path: The file. If it is a symbolic link, the link stays, and its target is replaced.
        write: Function that writes the file with the given name.

    Raises:
        OSError: If the file cannot be written; the message contains `path`, not the temporary name.
    """
    try:
        with whole_file(resolved(path)) as part:
            write(str(part))
    except OSError as error:
        raise disk_error(error, path) from error
    return path


def write_text(path: Path, text: str) -> Path:
    """Write text as UTF-8 with line feeds as line ends."""
    return write_in_place(path, lambda name: Path(name).write_text(text, encoding="utf-8", newline="\n"))
