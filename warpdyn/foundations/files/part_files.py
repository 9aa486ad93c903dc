"""Files are written under a temporary name and renamed when complete; warpdyn writes all files in this way.

The temporary name is unique, and the file is created exclusively: no existing file is opened or overwritten, and no
symbolic link is followed. The content is on the disk before the file is renamed. The new file gets the permissions of
the file that it replaces. If a process is killed, the next process that writes the same file removes the temporary
file that was left.
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

PART = ".part"  # ending of temporary names
# Errors of systems that cannot lock files, such as some network file systems.
NO_LOCKS = (errno.ENOLCK, errno.EOPNOTSUPP, errno.ENOSYS)
MOST_OF_A_NAME = 150  # bytes of a file's name that its temporary name contains; systems allow 255 bytes in a name
# Flags of `os.open` for creating a new file, and for opening an existing file. Neither follows a symbolic link.
NEW = os.O_RDWR | os.O_CREAT | os.O_EXCL | getattr(os, "O_NOFOLLOW", 0) | getattr(os, "O_CLOEXEC", 0)
AS_IS = os.O_RDWR | getattr(os, "O_NOFOLLOW", 0) | getattr(os, "O_CLOEXEC", 0) | getattr(os, "O_NONBLOCK", 0)


class PartFile:
    """A new, empty temporary file with a unique name. When it is complete, `move_in` renames it to the target.

    Args:
        target: The file to be replaced or created.
        folder: Folder of the temporary file, on the same disk as the target; None: the folder of the target.
        is_locked: Whether to lock the temporary file until it is complete, so that other processes do not remove it.
            False is necessary for files that HDF5 writes: HDF5 locks files itself and cannot open locked files.

    Raises:
        OSError: If the file cannot be created, or the target cannot be replaced.
    """

    def __init__(self, target: Path, folder: Path | None = None, *, is_locked: bool = False) -> None:
        check_replaceable(target)
        self.target, self._older = target, Permissions.of(target)
        self._lock: int | None = None
        while True:
            self.path = (folder or target.parent) / f".{_shortened(target.name)}.{uuid.uuid4().hex}{PART}"
            # Users who may not read the existing target must not be able to read the temporary file.
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
                return  # otherwise, another process removed the file before it was locked; try another name
            self._unlock()

    def move_in(self) -> None:
        """Flush the content to the disk, set the target's permissions, and rename the temporary file to the target."""
        sync(self.path)
        if self._older is not None:
            self._older.apply(self.path)
        check_replaceable(self.target)  # again, because the target may have changed meanwhile
        os.replace(self.path, self.target)
        self._unlock()
        sync_folder(self.target.parent)

    def discard(self) -> None:
        """Remove the temporary file if it still exists. Its disk space is freed even if a library has the file open."""
        try:
            if self._is_there():
                with suppress(OSError):
                    if os.lstat(self.path).st_nlink == 1:
                        os.truncate(self.path, 0)
                self.path.unlink()
        finally:
            self._unlock()

    def _is_there(self) -> bool:
        """Return whether the file that is now at `path` is the file that this object created."""
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
    """Yield the path of a new temporary file; at the end of the block, the file is renamed to the target.

    If an error is raised in the block, the temporary file is removed, and the target is not changed.

    Args:
        target: Path of the target, with symbolic links resolved.

    Raises:
        OSError: If the file cannot be created, or the target cannot be replaced.
    """
    sweep(target)
    part = PartFile(target, is_locked=True)
    try:
        yield part.path
        part.move_in()
    finally:
        part.discard()


def sweep(target: Path) -> None:
    """Remove temporary files that were left by killed processes while they wrote the target.

    A file is removed only if it is a regular file, its name has the form that `PartFile` gives for this target, and no
    process has locked it.
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
    """Flush the content of a file to the disk."""
    file = os.open(path, AS_IS)
    try:
        os.fsync(file)
    finally:
        os.close(file)


def sync_folder(folder: Path) -> None:
    """Flush the list of files of a folder to the disk, if the system supports it, so that renamed files persist."""
    if os.name != "posix":
        return
    with suppress(OSError):  # some network file systems flush folders in any case, and report an error here
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
    """Return the first MOST_OF_A_NAME bytes of a file name, so that the longer temporary name is a valid file name."""
    return os.fsencode(name)[:MOST_OF_A_NAME].decode(errors="ignore")
