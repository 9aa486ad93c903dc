"""Checks of text files, used by all functions that read such files; each error names the file."""

from __future__ import annotations

import os
import xml.etree.ElementTree as ElementTree
from collections.abc import Iterable
from pathlib import Path

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
