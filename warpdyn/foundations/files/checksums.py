"""Files of a checkpoint: NumPy files (.npz) with a checksum per array, and SHA-256 digests of other files."""

from __future__ import annotations

import hashlib
import zipfile
from collections.abc import Mapping
from pathlib import Path
from typing import Any

import numpy as np

from warpdyn.foundations.files.part_files import whole_file

NAMES = "names of all arrays"  # name of an additional array in each NumPy file, which lists the names of the others
MISSING = ""  # result of `digest_of` for a file that does not exist


def save_arrays(path: Path, arrays: Mapping[str, Any]) -> None:
    """Write named arrays and numbers to a NumPy file (.npz); the file appears only when it is complete.

    Raises:
        OSError: If the file cannot be written.
    """
    with whole_file(path) as part, open(part, "r+b") as file:
        named: dict[str, Any] = {**arrays, NAMES: np.array(sorted(arrays))}
        np.savez(file, **named)


def are_whole(path: Path) -> bool:
    """Return whether a NumPy file (.npz) exists and contains all of its arrays, with correct checksums."""
    try:
        with zipfile.ZipFile(path) as file:
            if file.testzip() is not None:
                return False
        with np.load(path) as kept:  # a zip file has no checksum of its list of files; NAMES replaces it
            return sorted(set(kept.files) - {NAMES}) == kept[NAMES].tolist()
    except Exception:  # reading a damaged file can raise any error, for example because the file seems to be encrypted
        return False


def load_arrays(path: Path, without: str = NAMES) -> dict[str, np.ndarray] | None:
    """Return the arrays of a NumPy file (.npz) as name -> array; None if the file is missing, empty or damaged.

    Args:
        path: The file.
        without: Arrays whose names begin with this text are not returned.
    """
    if not are_whole(path):
        return None
    with np.load(path) as kept:
        return {name: kept[name] for name in kept.files if not name.startswith((NAMES, without))}


def digest_of(path: Path) -> str:
    """Return the SHA-256 digest of a file's content; MISSING if the file does not exist."""
    try:
        with open(path, "rb") as file:
            return hashlib.file_digest(file, "sha256").hexdigest()
    except (FileNotFoundError, IsADirectoryError, NotADirectoryError):
        return MISSING
