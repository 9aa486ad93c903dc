"""The one way in which warpdyn writes a file: under a new name beside its place, then moved there when complete.

The new name is unique and is created exclusively, so that nothing that exists is opened, followed or overwritten. The
content is on the disk before the file gets its place. The new file takes over the permissions of the one that it
replaces. What a killed process left is removed by the next one that writes the same file.
"""

from __future__ import annotations

import errno
import os
import re
import stat
import uuid
from collections.abc import Iterator
from contextlib import contextmanager, suppress
from pathlib import Path

from warpdyn.foundations.files.targets import Permissions, check_replaceable

try:
    import fcntl
except ImportError:  # Windows, where open files cannot be removed
    fcntl = None  # type: ignore[assignment]

PART = ".part"
# What systems answer that cannot lock files, such as some network file systems.
NO_LOCKS = (errno.ENOLCK, errno.EOPNOTSUPP, errno.ENOSYS)
MOST_OF_A_NAME = 150  # bytes of the name of a file that are in the name of its temporary file; systems allow 255 in all
NEW = os.O_RDWR | os.O_CREAT | os.O_EXCL | getattr(os, "O_NOFOLLOW", 0) | getattr(os, "O_CLOEXEC", 0)
AS_IS = os.O_RDWR | getattr(os, "O_NOFOLLOW", 0) | getattr(os, "O_CLOEXEC", 0) | getattr(os, "O_NONBLOCK", 0)


class PartFile:
    """A new, empty file with a unique name, which takes the place of another one when it is complete.

    Args:
        target: The file whose place it takes.
        folder: Where it is made, on the disk of the target; None for the folder of the target.
        is_locked: Whether it is locked until it is complete, so that other processes can see that it is in use. HDF5
            locks files itself, and refuses those that are locked.

    Raises:
        OSError: If it cannot be made, or the target cannot be replaced.
    """

    def __init__(self, target: Path, folder: Path | None = None, *, is_locked: bool = False) -> None:
        check_replaceable(target)
        self.target, self._older = target, Permissions.of(target)
        self._lock: int | None = None
        while True:
            self.path = (folder or target.parent) / f".{_shortened(target.name)}.{uuid.uuid4().hex}{PART}"
            # Nobody reads it who may not read the older file.
            made = os.open(self.path, NEW, 0o666 if self._older is None else 0o600)
            try:
                self._identity = _identity(os.fstat(made))
                if self._older is not None:
                    self._older.take_over(made)
                if is_locked and fcntl is not None:
                    with suppress(OSError):
                        fcntl.flock(made, fcntl.LOCK_EX)
                    self._lock = made
            except BaseException:
                self.path.unlink()
                raise
            finally:
                if self._lock is None:
                    os.close(made)
            if self._is_there():
                return  # and was not removed by another process before it was locked
            self._unlock()

    def move_in(self) -> None:
        """Bring the content to the disk, take over the permissions, and take the place of the target."""
        sync(self.path)
        if self._older is not None:
            self._older.apply(self.path)
        check_replaceable(self.target)  # what came there meanwhile, too
        os.replace(self.path, self.target)
        self._unlock()
        sync_folder(self.target.parent)

    def discard(self) -> None:
        """Remove it, unless it has moved; its space is free at once, also while a library holds it open."""
        try:
            if self._is_there():
                with suppress(OSError):
                    if os.lstat(self.path).st_nlink == 1:
                        os.truncate(self.path, 0)
                self.path.unlink()
        finally:
            self._unlock()

    def _is_there(self) -> bool:
        """Return whether the file of this name is the one that was made here."""
        try:
            return _identity(os.lstat(self.path)) == self._identity
        except FileNotFoundError:
            return False

    def _unlock(self) -> None:
        if self._lock is not None:
            os.close(self._lock)
            self._lock = None


@contextmanager
def whole_file(target: Path) -> Iterator[Path]:
    """Yield a new file to write to, which takes the place of the target at the end of the block, if no error is raised.

    Args:
        target: The file, whose symbolic links are resolved.

    Raises:
        OSError: If the file cannot be made, or the target cannot be replaced.
    """
    sweep(target)
    part = PartFile(target, is_locked=True)
    try:
        yield part.path
        part.move_in()
    finally:
        part.discard()


def sweep(target: Path) -> None:
    """Remove what killed processes left of files that were to take the place of the target.

    Only regular files with a name that `PartFile` makes are removed, and only if no process holds them.
    """
    if fcntl is None:
        return
    name = re.compile(rf"\.{re.escape(_shortened(target.name))}\.[0-9a-f]{{32}}{re.escape(PART)}")
    with suppress(OSError), os.scandir(target.parent) as entries:
        for entry in entries:
            if name.fullmatch(entry.name) and entry.is_file(follow_symlinks=False):
                with suppress(OSError):
                    _remove_if_unused(Path(entry.path))


def sync(path: Path) -> None:
    """Bring the content of a file to the disk."""
    file = os.open(path, AS_IS)
    try:
        os.fsync(file)
    finally:
        os.close(file)


def sync_folder(folder: Path) -> None:
    """Bring the names of the files in a folder to the disk, where the system can do so."""
    if os.name != "posix":
        return
    with suppress(OSError):  # some network file systems do so at once, and refuse to be asked
        opened = os.open(folder, os.O_RDONLY | os.O_DIRECTORY | os.O_CLOEXEC)
        try:
            os.fsync(opened)
        finally:
            os.close(opened)


def _remove_if_unused(path: Path) -> None:
    file = os.open(path, AS_IS)
    try:
        fcntl.flock(file, fcntl.LOCK_EX | fcntl.LOCK_NB)
        found = os.fstat(file)
        if stat.S_ISREG(found.st_mode) and _identity(found) == _identity(os.lstat(path)):
            path.unlink()
    finally:
        os.close(file)


def _identity(found: os.stat_result) -> tuple[int, int]:
    return found.st_dev, found.st_ino


def _shortened(name: str) -> str:
    """Return the beginning of a name, so that a longer one made of it is not too long for the system."""
    return os.fsencode(name)[:MOST_OF_A_NAME].decode(errors="ignore")
