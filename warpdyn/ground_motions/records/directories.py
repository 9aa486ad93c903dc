"""Reader of all records of a directory."""

from __future__ import annotations

from fnmatch import fnmatchcase
from pathlib import Path

from warpdyn.ground_motions.motions import GroundMotion
from warpdyn.ground_motions.records.at2 import read_at2


def read_directory(path: str | Path, pattern: str = "*.AT2") -> list[GroundMotion]:
    """Read every PEER .AT2 file of a directory whose name matches a pattern.

    Args:
        path: The directory; its subdirectories are not searched.
        pattern: Shell pattern of the file names, upper and lower case alike.

    Returns:
        The motions [m/s2], in the order of their file names.

    Raises:
        FileNotFoundError: If there is no such directory, or no file in it matches.
        ValueError: If a file is not a sound record, as `read_at2` says.
    """
    directory = Path(path)
    if not directory.is_dir():
        raise FileNotFoundError(f"{path}: no such directory (to read records {pattern!r} from)")
    files = [file for file in directory.iterdir() if fnmatchcase(file.name.lower(), pattern.lower()) and file.is_file()]
    if not files:
        raise FileNotFoundError(f"{path}: no file in this directory matches {pattern!r}")
    return [read_at2(file) for file in sorted(files, key=lambda file: (file.name.lower(), file.name))]
