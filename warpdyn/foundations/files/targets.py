"""Checks of paths before writing: which files may be replaced, and which permissions the new file gets.

Only regular files (or, for Zarr stores, folders) are replaced, never devices, pipes or sockets. Permissions are the
mode, the owner, the group and the access control list.
"""

from __future__ import annotations

import errno
import os
import stat
from contextlib import suppress
from dataclasses import dataclass
from pathlib import Path

from warpdyn.foundations.core.near_misses import did_you_mean
from warpdyn.foundations.files.disk_errors import named_error

ACL = "system.posix_acl_access"  # extended attribute with the access control list of a file in Linux
WRITABLE = stat.S_IWUSR | stat.S_IWGRP | stat.S_IWOTH
KINDS = (
    (stat.S_ISDIR, "a folder"),
    (stat.S_ISLNK, "a symbolic link"),
    (stat.S_ISFIFO, "a named pipe"),
    (stat.S_ISSOCK, "a socket"),
    (stat.S_ISCHR, "a device"),
    (stat.S_ISBLK, "a device"),
)


def kind_of(mode: int) -> str:
    """Return the kind of a file in words, such as "a folder" or "a named pipe", from the `st_mode` of `os.lstat`."""
    return next((name for is_kind, name in KINDS if is_kind(mode)), "a file")


@dataclass(frozen=True)
class Permissions:
    """The permissions of a file or a folder that will be replaced.

    Args:
        mode: Permission bits of owner, group and others.
        owner: Number of the owner.
        group: Number of the group.
        acl: Access control list as Linux stores it; None: no list.
    """

    mode: int
    owner: int
    group: int
    acl: bytes | None

    @classmethod
    def of(cls, path: Path) -> Permissions | None:
        """Return the permissions of a file or a folder; None if it does not exist."""
        try:
            found = os.lstat(path)
        except (FileNotFoundError, NotADirectoryError):
            return None
        acl = None
        if hasattr(os, "getxattr"):
            with suppress(OSError):  # the file or the file system has no such list
                acl = os.getxattr(path, ACL, follow_symlinks=False)
        return cls(stat.S_IMODE(found.st_mode) & 0o777, found.st_uid, found.st_gid, acl)

    @property
    def of_folder(self) -> int:
        """Permission bits of a folder in which files are as private as the file with these permissions."""
        return self.mode | (self.mode & 0o444) >> 2 | 0o700

    def take_over(self, file: int) -> None:
        """Set the owner of a new file to the owner of the file that it will replace, before anything is written to it.

        Args:
            file: File descriptor of the new file.

        Raises:
            PermissionError: If the owner is another user and cannot be set. Otherwise, a file of the current user would
                replace a file of another user.
        """
        if not hasattr(os, "fchown") or os.fstat(file).st_uid == self.owner:
            return
        try:
            os.fchown(file, self.owner, -1)
        except OSError:
            raise PermissionError(
                errno.EPERM, "the existing file belongs to another user; remove it first, or choose another name"
            ) from None

    def apply(self, path: Path) -> None:
        """Set these permissions on the finished file or folder, as far as the file system supports them."""
        if not hasattr(os, "chown"):
            with suppress(OSError):
                path.chmod(self.mode)
            return
        mode = self.mode
        found = os.lstat(path)
        if found.st_uid != self.owner:
            with suppress(OSError):
                os.chown(path, self.owner, -1, follow_symlinks=False)
        if found.st_gid != self.group:
            try:
                os.chown(path, -1, self.group, follow_symlinks=False)
            except OSError:  # the new file has another group, which must not get the rights of the original group
                mode &= ~0o070 | (mode & 0o007) << 3
        with suppress(OSError):
            path.chmod(mode)
        if hasattr(os, "setxattr"):
            with suppress(OSError):
                if self.acl is not None:
                    os.setxattr(path, ACL, self.acl)
                else:
                    os.removexattr(path, ACL)  # the new file may have inherited a list from its folder


def check_replaceable(path: Path, *, is_store: bool = False) -> None:
    """Raise an error unless a path does not exist or is a file (for a Zarr store: a folder) that may be written.

    Args:
        path: The path, with symbolic links resolved.
        is_store: Whether a Zarr store, which is a folder, will be written.

    Raises:
        OSError: If the path is not a file (for a store: not a folder), or is read-only. The message of the error does
            not contain the path; callers add it.
    """
    try:
        found = os.lstat(path)
    except (FileNotFoundError, NotADirectoryError):
        return
    mode = found.st_mode
    if not (stat.S_ISDIR(mode) if is_store else stat.S_ISREG(mode)):
        kind = kind_of(mode)
        if stat.S_ISDIR(mode):
            raise IsADirectoryError(errno.EISDIR, "it is a directory; name a file in it")
        wanted = "folder, as a Zarr store is," if is_store else "file"
        raise FileExistsError(
            errno.EEXIST, f"the path is not a {wanted} but {kind}, which is never replaced; choose another name"
        )
    # The superuser can write a read-only file, but its owner made it read-only in order to keep it.
    if not mode & WRITABLE or not os.access(path, os.W_OK):
        kind = "folder" if is_store else "file"
        raise PermissionError(
            errno.EACCES, f"the existing {kind} is read-only; allow writing (chmod u+w), or choose another name"
        )


def take_over_store(older: Path, store: Path) -> None:
    """Set the permissions of a new Zarr store and its files to those of the store that it replaces, if there is one."""
    of_folders, of_files = Permissions.of(older), Permissions.of(older / ".zattrs")
    if (of_folders, of_files) == (None, None) or (of_folders, of_files) == (
        Permissions.of(store),
        Permissions.of(store / ".zattrs"),
    ):
        return
    for folder, _, names in os.walk(store):
        if of_folders is not None:
            of_folders.apply(Path(folder))
        for name in names:
            if of_files is not None:
                of_files.apply(Path(folder, name))


def resolved(path: Path) -> Path:
    """Return a path with symbolic links resolved, so that writing replaces the file that a link names, not the link.

    Raises:
        OSError: If the links form a loop.
    """
    try:
        found = path.resolve()
        is_loop = found.is_symlink()
    except (OSError, RuntimeError) as error:  # RuntimeError: for loops of links, until Python 3.12
        if isinstance(error, OSError) and error.errno != errno.ELOOP:
            raise named_error(error, path) from error
        is_loop = True
    if is_loop:
        raise OSError(errno.ELOOP, f"cannot write {path}: its symbolic links lead to each other; choose another name")
    return found


def check_folder(folder: Path) -> None:
    """Raise an OSError if the folder does not exist, or if this process may not create files in it."""
    if not folder.is_dir():
        raise FileNotFoundError(errno.ENOENT, f"there is no folder {folder}{_near(folder)}; create it first")
    if not os.access(folder, os.W_OK | os.X_OK):
        raise PermissionError(errno.EACCES, f"{os.strerror(errno.EACCES)} in {folder}; choose another folder")


def _near(folder: Path) -> str:
    """Return " (did you mean ...?)" with an existing folder of a similar name; "" if no name is similar."""
    missing = folder
    while not missing.parent.is_dir() and missing.parent != missing:
        missing = missing.parent
    try:
        beside = [each.name for each in missing.parent.iterdir() if each.is_dir()]
    except OSError:
        return ""
    return did_you_mean(missing.name, beside)
