"""Unfinished files: each is written in a locked, hidden folder next to its final path, and moved when complete."""

from __future__ import annotations

import json
import os
import stat
import tempfile
from collections.abc import Iterator
from contextlib import contextmanager, suppress
from pathlib import Path
from types import TracebackType

import netCDF4

from warpdyn.foundations.files.disk_errors import disk_error, named_error
from warpdyn.foundations.files.part_files import NO_LOCKS, PartFile, fcntl, sync_folder
from warpdyn.foundations.files.removal import LOCK, REPLACED, foreign_in, remove_tree
from warpdyn.foundations.files.targets import (
    Permissions,
    check_folder,
    check_replaceable,
    kind_of,
    resolved,
    take_over_store,
)

SUFFIX, STORE_SUFFIX = ".nc", ".zarr"
AWAY = "move it away, or choose another name"
GIVEN_UP = (ValueError, TypeError)  # a run is not resumed after these errors: the same call would raise them again
NOT_FOLLOWED = getattr(os, "O_NOFOLLOW", 0) | getattr(os, "O_CLOEXEC", 0)  # flags of `os.open`: do not follow links


def check_writable(path: str | os.PathLike, suffix: str = SUFFIX) -> Path:
    """Return the absolute path of a file or Zarr store after checking that it may be written, before a long run.

    Args:
        path: The file or the store.
        suffix: Required ending of the name: ".nc" for a file, ".zarr" for a store (a folder).

    Raises:
        OSError: If the path cannot be written, or the file at this path was not written by warpdyn.
        ValueError: If the name has another ending.
        TypeError: If `path` is not text or a Path.
    """
    if not isinstance(path, str | os.PathLike) or not os.fspath(path):
        raise TypeError(f"path must name a file, got {path!r}")
    given, path = Path(path), resolved(Path(path))
    is_store = suffix == STORE_SUFFIX
    try:
        check_replaceable(path, is_store=is_store)
        if path.suffix.lower() != suffix:
            kind = "Zarr stores" if is_store else "netCDF"
            table = "; write_table writes tables" if path.suffix.lower() in (".csv", ".parquet") else ""
            link = f" (it is a link to {path})" if given.is_symlink() else ""
            raise ValueError(
                f"cannot write {given}: datasets are written as {kind}, to a name that ends in {suffix!r}{table}{link}"
            )
        check_folder(path.parent)
    except OSError as error:
        raise named_error(error, given) from error
    if path.exists():
        attributes_of(path)
        if is_store:
            _check_store(path)
    return path


def _check_store(path: Path) -> None:
    """Raise a FileExistsError if a Zarr store contains a file not made by warpdyn, which replacing would remove."""
    foreign = foreign_in(path, is_store=True)
    if foreign is not None:
        raise FileExistsError(
            f"cannot write {path}: the existing store contains {foreign}, which warpdyn did not make; move it away"
        )


def attributes_of(path: Path) -> dict[str, object]:
    """Return the attributes of the dataset in an existing file or Zarr store, which warpdyn must have written.

    Raises:
        FileExistsError: If warpdyn did not write the file; such a file is never replaced.
    """
    try:
        if path.suffix == STORE_SUFFIX:
            found = json.loads((path / ".zattrs").read_text())
        else:
            with netCDF4.Dataset(path) as file:
                found = {name: file.getncattr(name) for name in file.ncattrs()}
    except (OSError, ValueError) as error:
        raise FileExistsError(f"cannot write {path}: warpdyn did not write the existing file; move it away") from error
    if not any("warpdyn" in str(found.get(name, "")) for name in ("source", "history")):
        raise FileExistsError(f"cannot write {path}: warpdyn did not write the existing dataset; move it away")
    return found


class Unfinished:
    """The hidden folder in which a file is written until it is complete. Only one process at a time can use the folder.

    Use it in a `with` statement. If a process was killed, the next process that writes the same file removes the files
    that were left, except the folder `kept`, from which a run is resumed. If the folder, or a file in it, was not made
    by warpdyn, an error is raised and nothing is changed.

    Args:
        path: The file, or the Zarr store.
        suffix: Required ending of the name.

    Raises:
        OSError: If another process is writing the file, or the folder cannot be made.
    """

    def __init__(self, path: str | os.PathLike, suffix: str = SUFFIX) -> None:
        self.path = check_writable(path, suffix)
        self.folder = self.path.with_name(f".{self.path.name}.unfinished")
        self.kept = self.folder / "kept"
        self.is_journaled = False  # whether `kept` contains results of this run, and no results of other runs
        self._is_store = suffix == STORE_SUFFIX
        self._older = Permissions.of(self.path)
        self._part: PartFile | None = None
        self._lock: int | None = None

    @property
    def part(self) -> Path:
        """Path of the temporary file, which `move_in` moves to its final path."""
        if self._part is None:
            self._part = PartFile(self.path, self.folder)
        return self._part.path

    def __enter__(self) -> Unfinished:
        try:
            self._lock = self._locked()
            self._sweep()
            if self._older is not None and not self._is_store:
                self._part = PartFile(self.path, self.folder)  # raises an error if another user owns the existing file
        except BaseException as error:
            if self._lock is not None and os.listdir(self.folder) == [LOCK]:
                with suppress(OSError):
                    remove_tree(self.folder)
            self._leave()
            if isinstance(error, OSError) and self.path.name not in str(error).partition(":")[0]:
                raise named_error(error, self.path) from error
            raise
        return self

    def __exit__(self, kind: type | None, error: BaseException | None, trace: TracebackType | None) -> None:
        try:
            if self._part is not None:
                self._part.discard()
            keeps = self.kept.is_dir()
            if self.is_journaled:
                # A run that was stopped or filled the disk can be resumed; a run with invalid arguments cannot.
                keeps = error is not None and not isinstance(error, GIVEN_UP) and self._holds_results()
                if keeps and error is not None:
                    error.add_note(
                        f"{self.path}: the finished part of the run is kept in {self.folder}; repeat the same call to "
                        "resume the run, or remove this folder to start again"
                    )
            if not keeps:
                with suppress(OSError):  # another process may have begun to use the folder
                    remove_tree(self.folder)
        finally:
            self._leave()

    def _holds_results(self) -> bool:
        """Return whether the folder `kept` contains results of finished regions (parts of a run)."""
        return any(self.kept.glob("*.npz"))

    def move_in(self) -> None:
        """Move the finished temporary file to its final path; an existing file is replaced."""
        assert self._part is not None
        self._part.move_in()

    def move_in_store(self, store: Path) -> None:
        """Move a finished Zarr store to its final path; an existing store is moved away first."""
        take_over_store(self.path, store)
        if self.path.exists():
            check_replaceable(self.path, is_store=True)
            _check_store(self.path)
            os.replace(self.path, self.folder / REPLACED)
        os.replace(store, self.path)
        sync_folder(self.path.parent)

    @contextmanager
    def named_errors(self) -> Iterator[None]:
        """Convert errors of writing into an OSError that names the file; netCDF raises RuntimeErrors."""
        try:
            yield
        except (OSError, RuntimeError) as error:
            if isinstance(error, OSError) or str(error).startswith("NetCDF"):
                raise disk_error(error, self.path) from error
            raise

    def forget(self) -> None:
        """Remove the folder `kept` with the results of an earlier run that was not completed."""
        if self.kept.is_dir():
            remove_tree(self.kept)

    def _sweep(self) -> None:
        """Remove the files of killed processes, after checking that all files in the folder were made by warpdyn."""
        foreign = foreign_in(self.folder, is_store=False)
        if foreign is not None:
            raise self._not_ours(f"contains {foreign}")
        replaced = self.folder / REPLACED
        if self._is_store and replaced.is_dir() and not self.path.exists():
            os.replace(replaced, self.path)  # a process was killed after moving the old store, before moving the new
        for left in list(self.folder.iterdir()):
            if left.is_dir() and left != self.kept:
                remove_tree(left)
            elif left.is_file() and left.name != LOCK:
                left.unlink()

    def _not_ours(self, what: str) -> OSError:
        return FileExistsError(
            f"cannot write {self.path}: {self.folder}, the folder of the unfinished file, {what}, which warpdyn did "
            f"not make; {AWAY}"
        )

    def _leave(self) -> None:
        if self._lock is not None:
            os.close(self._lock)
            self._lock = None

    def _locked(self) -> int:
        """Make the hidden folder if it does not exist, and lock it; return the file descriptor of the lock file.

        The lock is released when the descriptor is closed or the process ends.
        """
        mode = 0o777 if self._older is None else self._older.mode if self._is_store else self._older.of_folder
        while True:
            is_new = not os.path.lexists(self.folder)
            with suppress(FileExistsError):
                self.folder.mkdir(mode)
            try:
                self._check_folder()
                lock = os.open(self.folder / LOCK, os.O_RDWR | os.O_CREAT | NOT_FOLLOWED, 0o644)
            except FileNotFoundError:  # another process has just removed the folder
                continue
            except BaseException:
                if is_new:
                    with suppress(OSError):
                        self.folder.rmdir()
                raise
            try:
                if fcntl is not None:
                    fcntl.flock(lock, fcntl.LOCK_EX | fcntl.LOCK_NB)
            except OSError as error:
                if error.errno not in NO_LOCKS:
                    os.close(lock)
                    raise BlockingIOError(
                        f"cannot write {self.path}: another process is writing it. Wait "
                        "until it has finished, or choose another name"
                    ) from error
            with suppress(FileNotFoundError):
                if os.stat(self.folder / LOCK).st_ino == os.fstat(lock).st_ino:
                    return lock  # otherwise, another process has removed this lock file: try again
            os.close(lock)

    def _check_folder(self) -> None:
        """Raise an error if the hidden folder was not made by warpdyn, or belongs to another user."""
        found = os.lstat(self.folder)
        if not stat.S_ISDIR(found.st_mode):
            raise self._not_ours(f"is {kind_of(found.st_mode)}")
        there = os.listdir(self.folder)
        if there and LOCK not in there:
            raise self._not_ours(f"is a folder with {min(there)}")
        if there and not stat.S_ISREG(os.lstat(self.folder / LOCK).st_mode):
            raise self._not_ours(f"contains {LOCK}, which is not a file")
        with tempfile.TemporaryFile(dir=self.folder) as new:  # shows the owner that new files get
            owner = os.fstat(new.fileno()).st_uid
        if found.st_uid != owner:
            raise self._not_ours("is a folder of another user")
        if self._is_store and self._older is not None and owner not in (self._older.owner, 0):
            raise PermissionError(f"cannot write {self.path}: the existing store belongs to another user; {AWAY}")
