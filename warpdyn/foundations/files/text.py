"""Checks of text files, used by all functions that read such files; each error names the file."""

from __future__ import annotations

import csv
import os
import re
import warnings
import xml.etree.ElementTree as ElementTree
from collections.abc import Collection, Iterable
from itertools import islice
from pathlib import Path

import pandas as pd

from warpdyn.foundations.core.messages import amount_of

DECIMAL_COMMA = re.compile(r"[+-]?\d+,\d+(?:[eE][+-]?\d+)?")
OTHER_SEPARATORS = {";": "semicolons", "\t": "tabs", "|": "vertical bars"}  # instead of commas, in files named CSV


def existing_file(function: str, path: str | os.PathLike, argument: str = "path") -> Path:
    """Return the path of an existing file; raise an error if it is not text or a Path, or no file has this path.

    Args:
        function: Name of the public function that reads the file, for errors.
        path: The file.
        argument: Name of the function's argument, for errors.

    Raises:
        TypeError: If `path` is not text or a Path.
        ValueError: If `path` is empty.
        OSError: If the file does not exist, or is a folder.
    """
    if not isinstance(path, str | os.PathLike):
        raise TypeError(f"{function}: {argument} must name a file, got {path!r}")
    if not os.fspath(path):
        raise ValueError(f"{function}: {argument} is empty: give the name of a file")
    path = Path(path)
    if path.is_dir():
        raise IsADirectoryError(f"{function}: {path} is a folder; name a file in it")
    if not path.is_file():
        raise FileNotFoundError(f"{function}: there is no file {path}: correct the path")
    return path


def read_csv_text(function: str, path: str | os.PathLike, kind: str = "CSV") -> str:
    """Return the text of a CSV file.

    Args:
        function: Name of the public function that reads the file, for errors.
        path: The file, in UTF-8.
        kind: The kind of file in words, for errors.

    Raises:
        TypeError, OSError: As in `existing_file`.
        ValueError: If the file is empty, is not UTF-8 text, or is XML or HTML.
    """
    path = existing_file(function, path)
    try:
        text = path.read_text(encoding="utf-8-sig")
    except UnicodeDecodeError as error:
        raise ValueError(
            f"{function}: {path} is not {kind}: its byte {error.start} is not UTF-8 text. Export a spreadsheet as CSV "
            "UTF-8"
        ) from None
    if not text.strip():
        raise ValueError(f"{function}: {path} is empty, not {kind}: give a file with content")
    if text.lstrip().startswith("<") or "\0" in text:
        raise ValueError(
            f"{function}: {path} is not {kind}: it begins with {text.strip()[:20]!r}, as a web page or a binary file "
            "does. Download the file again, or export the table as CSV UTF-8"
        )
    return text


def read_csv(path: str | os.PathLike, *, comment: str | None = None, identifier: str = "id") -> pd.DataFrame:
    """Return the table in a CSV file; blanks at the beginning and end of column names are removed.

    Args:
        path: The file, in UTF-8, with or without a byte order mark.
        comment: Characters with which comment lines before the column names begin; None: no comment lines.
        identifier: Name of the column (in upper or lower case) that is read as text, so that "007" and "7" differ.

    Raises:
        ValueError: If the file is empty, is XML or HTML, its columns are not separated by commas, two columns have the
            same name (apart from upper and lower case and blanks), or a row has more or fewer values than there are
            columns. The message names the file.
        FileNotFoundError: If the file does not exist.
    """
    try:
        with open(path, encoding="utf-8-sig", newline="") as file:
            lines = iter(file)
            skipped, line = 0, next(lines, "")
            while comment and line.startswith(comment):
                skipped, line = skipped + 1, next(lines, "")
        if not line.strip():
            raise ValueError("it is empty: the first line must contain the names of columns")
        if line.lstrip().startswith("<") or "\0" in line:
            raise ValueError(
                f"it is not CSV: it begins with {line.strip()[:20]!r}, as a web page or a binary file does. Download "
                "the file again, or export the table as CSV UTF-8"
            )
        check_separator(line)
        names = next(csv.reader([line], skipinitialspace=True), [])
        check_names(names)
        ids: dict[str, type] = {name: str for name in names if name.strip().lower() == identifier.lower()}
        with warnings.catch_warnings():
            warnings.simplefilter("error", pd.errors.ParserWarning)  # pandas warns if it drops values
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
        raise ValueError(f"{path} is not text in UTF-8: {error}. Save the table as CSV UTF-8") from None
    except (ValueError, pd.errors.ParserWarning, csv.Error) as error:
        raise ValueError(f"{path}: {error}") from None
    return table.rename(columns=lambda name: str(name).strip())


def _check_lengths(path: str | os.PathLike, columns: int, skipped: int) -> None:
    """Raise a ValueError that names the first line whose number of values differs from the number of columns."""
    with open(path, encoding="utf-8-sig", newline="") as file:
        rows = csv.reader(islice(file, skipped, None), skipinitialspace=True)
        for row in rows:
            if row and len(row) != columns:
                has_points = any("." in value for value in row)
                hint = "" if has_points or len(row) < columns else ", or save numbers with decimal points, not commas"
                raise ValueError(
                    f"line {skipped + rows.line_num} has {amount_of(len(row), 'value')}, but there are {columns} "
                    f"columns: correct the line{hint}"
                )


def xml_root(path: Path) -> ElementTree.Element:
    """Return the root element of an XML file, without the namespaces in tags; raise a ValueError if it is not XML."""
    try:
        # Python's XML parser (expat) reads no external entities; since version 2.4.1, it limits the growth of entities.
        root = ElementTree.parse(path).getroot()
    except ElementTree.ParseError as error:
        raise ValueError(f"{path} is not XML: {error}. Export the file again, or correct it") from None
    for element in root.iter():
        if isinstance(element.tag, str):
            element.tag = element.tag.rpartition("}")[2]
    return root


def check_separator(line: str) -> None:
    """Raise a ValueError if the header line of a CSV file separates the columns by another character than a comma."""
    found = next((each for each in OTHER_SEPARATORS if each in line and "," not in line), None)
    if found:
        raise ValueError(
            f"its columns are separated by {found!r} ({OTHER_SEPARATORS[found]}) instead of commas: save it as CSV "
            "with commas (and points in numbers)"
        )


def comma_hint(value: object) -> str:
    """Return advice that ends a message about text that is not a number: if it has a decimal comma; otherwise ""."""
    if not isinstance(value, str) or not DECIMAL_COMMA.fullmatch(value.strip()):
        return ""
    return (
        ". This number has a decimal comma: save the file with decimal points, or give the table "
        "pandas.read_csv(path, sep=';', decimal=',')"
    )


def separator_hint(names: Collection[object]) -> str:
    """Return advice if the only column of a table has a name with a separator, because it was read as one column."""
    name = str(next(iter(names), ""))
    found = next((each for each in OTHER_SEPARATORS if each in name), None)
    if len(names) != 1 or found is None:
        return ""
    return (
        f". Its columns are separated by {found!r} ({OTHER_SEPARATORS[found]}): give the table "
        f"pandas.read_csv(path, sep={found!r}), with decimal=',' if numbers have decimal commas"
    )


def check_names(names: Iterable[object], where: str = "") -> None:
    """Raise a ValueError if two column names are equal when upper and lower case and blanks are ignored.

    Args:
        names: The names.
        where: Beginning of the message, such as "buildings.csv: ".
    """
    seen: dict[str, str] = {}
    for each in names:
        name = str(each)
        key = " ".join(name.split()).casefold()
        other = seen.get(key)
        seen[key] = name
        if other is not None and key:
            raise ValueError(
                f"{where}it has the column {name!r} twice: remove or rename one"
                if other == name
                else f"{where}its columns {other!r} and {name!r} differ only in upper and lower case or blanks: "
                "remove or rename one"
            )


def inside_folder(folder: Path, name: str, what: str) -> Path:
    """Return the path of a file whose name is written in another file; raise an error if it is outside of a folder.

    Args:
        folder: The folder in which the file must be.
        name: Name of the file, which may contain subfolders.
        what: The file that contains the name, for the message.

    Raises:
        ValueError: If the file is outside the folder, also if it is a symbolic link to a file outside.
    """
    path = folder / name
    if not path.resolve().is_relative_to(folder.resolve()):
        raise ValueError(
            f"{what} names the file {name!r}, which is outside of {folder} ({path.resolve()}): copy the file into this "
            "folder"
        )
    return path
