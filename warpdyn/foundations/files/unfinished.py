"""Files that are being written: checked, locked, and kept in a hidden folder beside their place until complete."""

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
GIVEN_UP = (ValueError, TypeError)  # errors after which a run does not go on, as the same call would end in them again
NOT_FOLLOWED = getattr(os, "O_NOFOLLOW", 0) | getattr(os, "O_CLOEXEC", 0)


def check_writable(path: str | os.PathLike, suffix: str = SUFFIX) -> Path:
    """Check that a file or a Zarr store may be written, and return its absolute path; call it before a long run.

    Args:
        path: Where it is to be written.
        suffix: What its name must end in: ".nc" for a file, ".zarr" for a store, which is a folder.

    Raises:
        OSError: If it cannot be written there, or something is there that warpdyn did not write.
        ValueError: If its name has another ending.
        TypeError: If it is not a path.
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
    """Raise a FileExistsError if a store of warpdyn's holds something else, which would be lost with it."""
    foreign = foreign_in(path, is_store=True)
    if foreign is not None:
        raise FileExistsError(
            f"cannot write {path}: the store that is there holds {foreign}, which warpdyn did not make; move it away"
        )


def attributes_of(path: Path) -> dict[str, object]:
    """Return the attributes of a dataset that warpdyn wrote.

    Raises:
        FileExistsError: If the file is something else, which is never replaced.
    """
    try:
        if path.suffix == STORE_SUFFIX:
            found = json.loads((path / ".zattrs").read_text())
        else:
            with netCDF4.Dataset(path) as file:
                found = {name: file.getncattr(name) for name in file.ncattrs()}
    except (OSError, ValueError) as error:
        raise FileExistsError(f"cannot write {path}: what is there is not warpdyn's; move it away") from error
    if not any("warpdyn" in str(found.get(name, "")) for name in ("source", "history")):
        raise FileExistsError(f"cannot write {path}: the dataset that is there is not warpdyn's; move it away")
    return found


class Unfinished:
    """The hidden folder in which a file is written until it is complete; one process at a time has it.

    It is used in a `with` statement. What a killed process left in it is removed by the next one, except the folder
    `kept`, which belongs to the run that is to go on. A folder of this name that warpdyn did not make, or that holds
    something that warpdyn did not make, is an error, and is left as it is.

    Args:
        path: The file, or the Zarr store.
        suffix: What its name must end in.

    Raises:
        OSError: If another process is writing the file, or the folder cannot be made.
    """

    def __init__(self, path: str | os.PathLike, suffix: str = SUFFIX) -> None:
        self.path = check_writable(path, suffix)
        self.folder = self.path.with_name(f".{self.path.name}.unfinished")
        self.kept = self.folder / "kept"
        self.is_journaled = False  # whether `kept` holds what this run has done, and no other
        self._is_store = suffix == STORE_SUFFIX
        self._older = Permissions.of(self.path)
        self._part: PartFile | None = None
        self._lock: int | None = None

    @property
    def part(self) -> Path:
        """The file that is written until it is moved into its place."""
        if self._part is None:
            self._part = PartFile(self.path, self.folder)
        return self._part.path

    def __enter__(self) -> Unfinished:
        try:
            self._lock = self._locked()
            self._sweep()
            if self._older is not None and not self._is_store:
                self._part = PartFile(self.path, self.folder)  # which may not take the place of another user's file
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
                # A run that was stopped, or whose disk is full, goes on; one that asked for what cannot be does not.
                keeps = error is not None and not isinstance(error, GIVEN_UP) and self._holds_results()
                if keeps and error is not None:
                    error.add_note(
                        f"{self.path}: what is finished of the run is kept in {self.folder}; the same call goes on "
                        "from there (remove this folder to give the run up)"
                    )
            if not keeps:
                with suppress(OSError):  # another process that waits may have begun to use the folder
                    remove_tree(self.folder)
        finally:
            self._leave()

    def _holds_results(self) -> bool:
        """Return whether `kept` contains files of finished regions."""
        return any(self.kept.glob("*.npz"))

    def move_in(self) -> None:
        """Put the finished file in its place."""
        assert self._part is not None
        self._part.move_in()

    def move_in_store(self, store: Path) -> None:
        """Put a finished store in its place; a folder does not replace another, which is moved away before."""
        take_over_store(self.path, store)
        if self.path.exists():
            check_replaceable(self.path, is_store=True)
            _check_store(self.path)
            os.replace(self.path, self.folder / REPLACED)
        os.replace(store, self.path)
        sync_folder(self.path.parent)

    @contextmanager
    def named_errors(self) -> Iterator[None]:
        """Turn errors of the disk into an OSError that names the file; netCDF raises RuntimeError of them."""
        try:
            yield
        except (OSError, RuntimeError) as error:
            if isinstance(error, OSError) or str(error).startswith("NetCDF"):
                raise disk_error(error, self.path) from error
            raise

    def forget(self) -> None:
        """Remove what an earlier run has kept."""
        if self.kept.is_dir():
            remove_tree(self.kept)

    def _sweep(self) -> None:
        """Remove what a killed process left, after a check that all of it is warpdyn's."""
        foreign = foreign_in(self.folder, is_store=False)
        if foreign is not None:
            raise self._not_ours(f"holds {foreign}")
        replaced = self.folder / REPLACED
        if self._is_store and replaced.is_dir() and not self.path.exists():
            os.replace(replaced, self.path)  # a process was killed before the new store took its place
        for left in list(self.folder.iterdir()):
            if left.is_dir() and left != self.kept:
                remove_tree(left)
            elif left.is_file() and left.name != LOCK:
                left.unlink()

    def _not_ours(self, what: str) -> OSError:
        return FileExistsError(
            f"cannot write {self.path}: {self.folder}, where the file is written until it is complete, {what}, which "
            f"warpdyn did not make; {AWAY}"
        )

    def _leave(self) -> None:
        if self._lock is not None:
            os.close(self._lock)
            self._lock = None

    def _locked(self) -> int:
        """Make the folder and return its locked file, which is unlocked when it is closed, also by a kill."""
        mode = 0o777 if self._older is None else self._older.mode if self._is_store else self._older.of_folder
        while True:
            is_new = not os.path.lexists(self.folder)
            with suppress(FileExistsError):
                self.folder.mkdir(mode)
            try:
                self._check_folder()
                lock = os.open(self.folder / LOCK, os.O_RDWR | os.O_CREAT | NOT_FOLLOWED, 0o644)
            except FileNotFoundError:  # the process that had it removed the folder just now
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
                    raise BlockingIOError(f"cannot write {self.path}: another process is writing it") from error
            with suppress(FileNotFoundError):
                if os.stat(self.folder / LOCK).st_ino == os.fstat(lock).st_ino:
                    return lock  # and not that of a process that has removed it meanwhile
            os.close(lock)

    def _check_folder(self) -> None:
        """Raise an error if the folder is not one that warpdyn made for this user."""
        found = os.lstat(self.folder)
        if not stat.S_ISDIR(found.st_mode):
            raise self._not_ours(f"is {kind_of(found.st_mode)}")
        there = os.listdir(self.folder)
        if there and LOCK not in there:
            raise self._not_ours(f"is a folder with {min(there)}")
        if there and not stat.S_ISREG(os.lstat(self.folder / LOCK).st_mode):
            raise self._not_ours(f"holds {LOCK}, which is not a file")
        with tempfile.TemporaryFile(dir=self.folder) as new:  # without a name, where the system can do so
            owner = os.fstat(new.fileno()).st_uid
        if found.st_uid != owner:
            raise self._not_ours("is a folder of another user")
        if self._is_store and self._older is not None and owner not in (self._older.owner, 0):
            raise PermissionError(f"cannot write {self.path}: the store that is there belongs to another user; {AWAY}")
