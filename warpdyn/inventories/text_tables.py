"""Tables of text: CSV files, of which every row is read whole or none is."""

from __future__ import annotations

import csv
import os
import warnings
from collections.abc import Iterable
from itertools import islice
from pathlib import Path

import pandas as pd

OTHER_SEPARATORS = {";": "semicolons", "\t": "tabs", "|": "vertical bars"}


def read_csv(path: str | os.PathLike, *, comment: str | None = None, identifier: str = "id") -> pd.DataFrame:
    """Return the table of a CSV file, with names of columns as they are but for spaces around them.

    Args:
        path: The file, UTF-8, with or without a mark of its byte order.
        comment: What lines before the names of the columns begin with, if there are any.
        identifier: The column, in any case, that is text: "007" is another building than "7".

    Raises:
        ValueError: If it is empty, its columns are not separated by commas, it has a column twice (also with a name
            that differs in upper and lower case or in blanks alone), or a row has more or fewer values than there are
            columns. The message names the file.
        FileNotFoundError: If there is no such file.
    """
    try:
        with open(path, encoding="utf-8-sig", newline="") as file:
            lines = iter(file)
            skipped, line = 0, next(lines, "")
            while comment and line.startswith(comment):
                skipped, line = skipped + 1, next(lines, "")
        if not line.strip():
            raise ValueError("it is empty: there are no names of columns")
        check_separator(line)
        names = next(csv.reader([line], skipinitialspace=True), [])
        check_names(names)
        ids: dict[str, type] = {name: str for name in names if name.strip().lower() == identifier.lower()}
        with warnings.catch_warnings():
            warnings.simplefilter("error", pd.errors.ParserWarning)  # of values that would be dropped
            try:
                table = pd.read_csv(
                    path,
                    encoding="utf-8-sig",
                    skipinitialspace=True,
                    index_col=False,
                    skiprows=skipped,
                    dtype=ids,
                    low_memory=False,
                )
            except pd.errors.ParserWarning:
                _check_lengths(path, len(names), skipped)
                raise
        if len(table.columns) and table.iloc[:, -1].isna().any():
            _check_lengths(path, len(names), skipped)
    except UnicodeDecodeError as error:
        raise ValueError(f"{path} is no text in UTF-8: {error}") from None
    except (ValueError, pd.errors.ParserWarning, csv.Error) as error:
        raise ValueError(f"{path}: {error}") from None
    return table.rename(columns=lambda name: str(name).strip())


def check_separator(line: str) -> None:
    """Raise a ValueError if the names of columns are separated by something else than commas."""
    found = next((each for each in OTHER_SEPARATORS if each in line and "," not in line), None)
    if found:
        raise ValueError(
            f"its columns are separated by {found!r} ({OTHER_SEPARATORS[found]}), but by commas in the files that are "
            "read: save it as CSV with commas (and points in numbers)"
        )


def check_names(names: Iterable[object]) -> None:
    """Raise a ValueError if two columns have one name, but for upper and lower case and blanks."""
    seen: dict[str, str] = {}
    for each in names:
        name = str(each)
        key = " ".join(name.split()).casefold()
        other = seen.get(key)
        seen[key] = name
        if other is not None and key:
            raise ValueError(
                f"it has the column {name!r} twice: remove or rename one"
                if other == name
                else f"its columns {other!r} and {name!r} differ in upper and lower case or blanks alone: remove or "
                "rename one"
            )


def inside_folder(folder: Path, name: str, what: str) -> Path:
    """Return the path of a file that another file names, once it is known to lie in the folder of that file.

    Args:
        folder: The folder of the file that names it.
        name: The name, which may lead into folders below.
        what: What the message begins with: the file that names it.

    Raises:
        ValueError: If it lies outside the folder, also by a symbolic link.
    """
    path = folder / name
    if not path.resolve().is_relative_to(folder.resolve()):
        raise ValueError(
            f"{what} names the file {name!r}, which lies outside its folder ({path.resolve()}): files that it names "
            "must be in its folder; copy the file there"
        )
    return path


def _check_lengths(path: str | os.PathLike, columns: int, skipped: int) -> None:
    """Raise a ValueError if a row has fewer or more values than there are columns."""
    with open(path, encoding="utf-8-sig", newline="") as file:
        rows = csv.reader(islice(file, skipped, None), skipinitialspace=True)
        for row in rows:
            if row and len(row) != columns:
                raise ValueError(
                    f"line {skipped + rows.line_num} has {len(row)} values and there are {columns} columns: correct "
                    "the line"
                )
