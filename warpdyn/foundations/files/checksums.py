"""Checksums of the files from which a killed run resumes, so that it computes damaged files again.

Arrays are in NumPy files (.npz), which contain a checksum for each array. Other files and Zarr stores have a seal: a
JSON file with their digests.
"""

from __future__ import annotations

import hashlib
import json
import os
import zipfile
from collections.abc import Mapping
from pathlib import Path
from typing import Any

import numpy as np

from warpdyn.foundations.files.part_files import whole_file

NAMES = "names of all arrays"  # an array in each NumPy file
MISSING = ""  # digest of a file that does not exist


def save_arrays(path: Path, arrays: Mapping[str, Any]) -> None:
    """Write arrays and numbers by name to a NumPy file (.npz), which appears whole.

    Raises:
        OSError: If it cannot be written.
    """
    with whole_file(path) as part, open(part, "r+b") as file:
        named: dict[str, Any] = {**arrays, NAMES: np.array(sorted(arrays))}
        np.savez(file, **named)


def are_whole(path: Path) -> bool:
    """Return whether a NumPy file (.npz) exists and the checksums of its arrays agree."""
    try:
        with zipfile.ZipFile(path) as file:
            if file.testzip() is not None:
                return False
        with np.load(path) as kept:  # a zip file has no checksum of its list of files
            return sorted(set(kept.files) - {NAMES}) == kept[NAMES].tolist()
    except Exception:  # a damaged file may claim anything, such as encryption, and raise any error
        return False


def load_arrays(path: Path) -> dict[str, np.ndarray] | None:
    """Return the arrays of a NumPy file (.npz) by name; None if it is missing, empty or damaged."""
    if not are_whole(path):
        return None
    with np.load(path) as kept:
        return {name: kept[name] for name in kept.files if name != NAMES}


def digest_of(path: Path) -> str:
    """Return the digest of a file's content; MISSING if there is no such file."""
    try:
        with open(path, "rb") as file:
            return hashlib.file_digest(file, "sha256").hexdigest()
    except (FileNotFoundError, IsADirectoryError, NotADirectoryError):
        return MISSING


def digests_in(path: Path) -> dict[str, str]:
    """Return the digests of a file, or of all files in a folder, by their names in it."""
    if not path.is_dir():
        return {"": digest_of(path)}
    files = (Path(folder, name) for folder, _, names in os.walk(path) for name in names)
    return {file.relative_to(path).as_posix(): digest_of(file) for file in sorted(files)}


def seal(path: Path, content: Path) -> None:
    """Write the seal of a file or a Zarr store, before it is moved from `content` to `path`."""
    with whole_file(_seal_of(path)) as part:
        part.write_text(json.dumps(digests_in(content)))


def is_sealed(path: Path) -> bool:
    """Return whether a file or a Zarr store agrees with its seal."""
    try:
        sealed = json.loads(_seal_of(path).read_text())
    except (OSError, ValueError):
        return False
    return path.exists() and sealed == digests_in(path)


def _seal_of(path: Path) -> Path:
    return path.with_name(f"{path.name}.json")
