"""Removal of hidden folders and Zarr stores; warpdyn removes only files that it made."""

from __future__ import annotations

import os
import re
from contextlib import suppress
from pathlib import Path

from warpdyn.foundations.files.targets import kind_of

LOCK, REPLACED = "lock", "replaced"
# Names of the files and folders that warpdyn makes in a hidden folder: the lock file, unfinished files, the header of a
# checkpoint and the files of its regions, an unfinished Zarr store, and a store that is being replaced. Versions before
# 0.1 also wrote "part.nc".
FILES = re.compile(r"lock|part\.nc|.+\.part|run\.json|\d+-\d+-\d+\.npz")
FOLDERS = re.compile(r"kept|replaced|\w+\.zarr")
# Names of the files in a Zarr store of format 2: metadata, chunks, and chunks that a killed process left unfinished.
# macOS adds a file to each folder that a user views, and NFS adds one for each file that was removed while it was open.
OF_STORES = re.compile(r"\.z(attrs|array|group|metadata)|\d+(\.\d+)*|.*\.[0-9a-f]{32}\.partial|\.DS_Store|\.nfs\w+")


def foreign_in(folder: Path, *, is_store: bool) -> str | None:
    """Return a description of the first file or folder that warpdyn did not make, or None if warpdyn made all of them.

    Args:
        folder: A hidden folder of warpdyn, or a Zarr store.
        is_store: Whether `folder` is a Zarr store.
    """
    with os.scandir(folder) as entries:
        for entry in entries:
            path = Path(entry.path)
            if entry.is_dir(follow_symlinks=False):
                if not is_store and not FOLDERS.fullmatch(entry.name):
                    return f"the folder {path}"
                found = foreign_in(path, is_store=is_store or entry.name == REPLACED or path.suffix == ".zarr")
                if found is not None:
                    return found
            elif not entry.is_file(follow_symlinks=False):
                return f"{path}, which is {kind_of(entry.stat(follow_symlinks=False).st_mode)}"
            elif not (OF_STORES if is_store else FILES).fullmatch(entry.name):
                return f"the file {path}"
    return None


def remove_tree(folder: Path) -> None:
    """Remove a folder with all regular files and folders in it; the lock file is removed last.

    Links are not followed. Links, devices and other special files are not removed, and neither are the folders that
    contain them. If a file has a second name (a hard link), its content remains available under the second name.

    Raises:
        OSError: If a file or folder was not removed.
    """
    lock = None
    with os.scandir(folder) as entries:
        for entry in list(entries):
            if entry.is_dir(follow_symlinks=False):
                remove_tree(Path(entry.path))
            elif entry.name == LOCK:
                lock = Path(entry.path)
            elif entry.is_file(follow_symlinks=False):
                with suppress(FileNotFoundError):
                    os.unlink(entry.path)
    if lock is not None and not lock.is_symlink():
        lock.unlink(missing_ok=True)
    folder.rmdir()
