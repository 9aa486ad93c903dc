"""Writing of files: paths are checked before any computation, and a file gets its name when it is complete."""

from __future__ import annotations

import csv
import json
import os
from collections.abc import Callable, Sequence
from pathlib import Path

from warpdyn.foundations.files.disk_errors import disk_error, named_error
from warpdyn.foundations.files.part_files import whole_file
from warpdyn.foundations.files.targets import check_folder, check_replaceable, resolved

HEAD = 10_000  # number of characters at the beginning of a file in which the mark of its writer is searched


def checked_path(function: str, path: str | os.PathLike, *suffixes: str) -> Path:
    """Check that a file can be written at a path, before anything is computed, and return the path.

    Args:
        function: Name of the public function that writes the file, for error messages.
        path: Path of the file; its folder must exist.
        suffixes: Allowed endings of the file name, in lower case; capital letters in the file name are accepted.

    Raises:
        TypeError: If `path` is not a path.
        ValueError: If the file name has another ending.
        OSError: If the folder does not exist; or if the path is a folder, a device or a pipe, is read-only, or belongs
            to another user.
    """
    if not isinstance(path, str | os.PathLike) or not os.fspath(path):
        raise TypeError(f"{function}: path must name a file, got {path!r}: give path='name{suffixes[0]}'")
    path = Path(path)
    if path.suffix.lower() not in suffixes:
        allowed = " or ".join(repr(suffix) for suffix in suffixes)
        raise ValueError(
            f"{function}: the name of {path} must end in {allowed}: rename it to {path.stem or 'name'}{suffixes[0]}"
        )
    target = resolved(path)
    try:
        check_folder(target.parent)
        check_replaceable(target)
    except OSError as error:
        raise named_error(error, path, function) from error
    return path


def check_same_table(function: str, path: Path, columns: Sequence[str], overwrite: bool) -> None:
    """Raise a FileExistsError if a table would replace a file that is not a table with the same columns.

    CSV files do not name the program that wrote them. Therefore the columns decide: a script that runs again replaces
    its own table, but not an inventory or a table of another program.

    Args:
        function: Name of the public function that writes the table, for error messages.
        path: Path of the file; its name ends in ".csv", ".parquet", ".xlsx" or ".geojson".
        columns: Names of the columns of the new table (for GeoJSON, of the properties).
        overwrite: If True, a file with any content may be replaced.
    """
    _check_own(function, path, overwrite, "a table with the same columns", lambda: _columns_of(path) == set(columns))


def check_same_format(function: str, path: Path, mark: str, what: str, overwrite: bool) -> None:
    """Raise a FileExistsError if a new file would replace a file that the given function did not write.

    Args:
        function: Name of the public function that writes the file, for error messages.
        path: Path of the file.
        mark: Text that the first lines of each file from this function contain, and of no other file.
        what: Description of a file from this function, for error messages.
        overwrite: If True, a file with any content may be replaced.
    """
    _check_own(function, path, overwrite, what, lambda: mark in _head_of(path))


def _check_own(function: str, path: Path, overwrite: bool, what: str, is_own: Callable[[], bool]) -> None:
    if not isinstance(overwrite, bool):
        raise TypeError(
            f"{function}: overwrite must be True or False, got {overwrite!r}: give overwrite=True to replace the file"
        )
    if not overwrite and path.exists() and not is_own():
        raise FileExistsError(
            f"{function}: {path} exists and is not {what}, so it may contain other data: choose another name, or "
            "replace it by overwrite=True"
        )


def _head_of(path: Path) -> str:
    """Return the first HEAD characters of a file; "" if the file is not UTF-8 text or cannot be read."""
    try:
        with open(path, encoding="utf-8") as file:
            return file.read(HEAD)
    except (OSError, UnicodeDecodeError):
        return ""


def _columns_of(path: Path) -> set[str] | None:
    """Return the names of the columns of a table file; None if it is not a table in a format that warpdyn writes."""
    try:
        if path.suffix.lower() == ".parquet":
            import pyarrow.parquet

            return set(pyarrow.parquet.read_schema(path).names)
        if path.suffix.lower() == ".xlsx":
            import openpyxl

            book = openpyxl.load_workbook(path, read_only=True)
            try:
                (sheet,) = book.worksheets  # a file with several sheets is not a table of warpdyn
                return set(next(sheet.iter_rows(max_row=1, values_only=True)))
            finally:
                book.close()
        with open(path, encoding="utf-8", newline="") as file:
            if path.suffix.lower() == ".csv":
                return set(next(csv.reader(file)))
            first = next(line for line in file if line.startswith('{"type": "Feature", '))  # one line per point
            return set(json.loads(first.rstrip(",\n"))["properties"])
    except Exception:  # a file in another format may cause any error
        return None


def write_in_place(path: Path, write: Callable[[str], object]) -> Path:
    """Write a file under a temporary name, and rename it when it is complete; an existing file is replaced.

    If several threads or processes write the same file, each of them uses its own temporary file. The content is that
    of the process that finishes last.

    Args:
        path: Path of the file. If it is a symbolic link, the link is kept, and the file to which it points is replaced.
        write: Function that writes the content to the file whose (temporary) name it gets as its argument.

    Raises:
        OSError: If the file cannot be written; the message contains `path` instead of the temporary name.
    """
    try:
        with whole_file(resolved(path)) as part:
            write(str(part))
    except OSError as error:
        raise disk_error(error, path) from error
    return path


def write_text(path: Path, text: str) -> Path:
    """Write a text file in UTF-8 with line feeds as line ends, and return its path."""
    return write_in_place(path, lambda name: Path(name).write_text(text, encoding="utf-8", newline="\n"))
