"""Checks of text files: an error names a file that is missing, empty or of another kind than the reader expects."""

from __future__ import annotations

import os
import xml.etree.ElementTree as ElementTree
from collections.abc import Iterable
from pathlib import Path

OTHER_SEPARATORS = {";": "semicolons", "\t": "tabs", "|": "vertical bars"}


def existing_file(function: str, path: str | os.PathLike, argument: str = "path") -> Path:
    """Return the path of an existing file.

    Args:
        function: The public function that reads it.
        path: The file.
        argument: The name of the argument.

    Raises:
        TypeError: If `path` is not a path.
        ValueError: If `path` is empty.
        OSError: If there is no such file, or it is a folder.
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
        kind: The kind of file in words, for errors.

    Raises:
        TypeError, OSError: As `existing_file`.
        ValueError: If the file is empty, not text, or text of another kind.
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
        raise ValueError(f"{function}: {path} is empty, not {kind}")
    if text.lstrip().startswith("<") or "\0" in text:
        raise ValueError(f"{function}: {path} is not {kind}: it begins with {text.strip()[:20]!r}")
    return text


def xml_root(path: Path) -> ElementTree.Element:
    """Return the root of an XML file, with tags without namespaces; raise a ValueError if the file is not XML."""
    try:
        # Python's expat reads no external entities, and from 2.4.1 on none that grow without bounds.
        root = ElementTree.parse(path).getroot()
    except ElementTree.ParseError as error:
        raise ValueError(f"{path} is not XML: {error}") from None
    for element in root.iter():
        if isinstance(element.tag, str):
            element.tag = element.tag.rpartition("}")[2]
    return root


def check_separator(line: str) -> None:
    """Raise a ValueError if the names of columns are not separated by commas."""
    found = next((each for each in OTHER_SEPARATORS if each in line and "," not in line), None)
    if found:
        raise ValueError(
            f"its columns are separated by {found!r} ({OTHER_SEPARATORS[found]}) instead of commas: save it as CSV "
            "with commas (and points in numbers)"
        )


def check_names(names: Iterable[object], where: str = "") -> None:
    """Raise a ValueError if two columns have the same name, apart from upper and lower case and blanks.

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
    """Return the path of a file that another file names, after checking that it is in the folder of that file.

    Args:
        folder: The folder of the file that names it.
        name: The name, which may contain subfolders.
        what: The file that names it, for the message.

    Raises:
        ValueError: If the file is outside the folder, also if a symbolic link leads there.
    """
    path = folder / name
    if not path.resolve().is_relative_to(folder.resolve()):
        raise ValueError(
            f"{what} names the file {name!r}, which is outside its folder ({path.resolve()}): copy the file there"
        )
    return path
