"""Files that are being written: checked, locked, and kept in a hidden folder beside their place until complete."""

from __future__ import annotations

import errno
import json
import os
import shutil
from collections.abc import Iterator
from contextlib import contextmanager, suppress
from pathlib import Path
from types import TracebackType

import netCDF4

from warpdyn.core.near_misses import did_you_mean

try:
    import fcntl
except ImportError:  # Windows, where files in use cannot be removed and two writers show by that
    fcntl = None  # type: ignore[assignment]

SUFFIX, STORE_SUFFIX = ".nc", ".zarr"
GIVEN_UP = (OSError, ValueError, TypeError)  # errors after which a run does not go on
# What systems answer that cannot lock files, such as some network file systems.
NO_LOCKS = (errno.ENOLCK, errno.EOPNOTSUPP, errno.ENOSYS)


def check_writable(path: str | os.PathLike, suffix: str = SUFFIX) -> Path:
    """Check that a file or a Zarr store may be written, and return its absolute path; call it before a long run.

    Args:
        path: Where it is to be written.
        suffix: What its name must end in: ".nc" for a file, ".zarr" for a store, which is a folder.

    Raises:
        OSError: If it cannot be written there, or something stands there that warpdyn did not write.
        ValueError: If its name has another ending.
        TypeError: If it is no path.
    """
    if not isinstance(path, str | os.PathLike) or not os.fspath(path):
        raise TypeError(f"path must name a file, got {path!r}")
    path = Path(path).resolve()  # a link stays, and its target is written
    is_store = suffix == STORE_SUFFIX
    if path.is_dir() and not is_store:
        raise IsADirectoryError(f"cannot write {path}: it is a directory; name a file in it")
    if path.exists() and not (path.is_dir() if is_store else path.is_file()):
        raise OSError(f"cannot write {path}: what is there is no {'folder' if is_store else 'file'}")
    if path.suffix.lower() != suffix:
        kind = "Zarr stores" if is_store else "netCDF"
        table = "; write_table writes tables" if path.suffix.lower() in (".csv", ".parquet") else ""
        raise ValueError(
            f"cannot write {path}: datasets are written as {kind}, to a name that ends in {suffix!r}{table}"
        )
    try:
        if not path.parent.is_dir():
            raise FileNotFoundError(f"there is no folder {path.parent}{_near(path.parent)}; make it first")
        if path.exists() and not os.access(path, os.W_OK):
            raise PermissionError("the file that is there is read-only")
        if not os.access(path.parent, os.W_OK | os.X_OK):
            raise PermissionError(errno.EACCES, os.strerror(errno.EACCES))
    except OSError as error:
        raise _named(error, path, "; choose another folder") from error
    if path.exists():
        attributes_of(path)
    return path


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
        raise FileExistsError(f"cannot write {path}: what stands there is not warpdyn's; move it away") from error
    if not any("warpdyn" in str(found.get(name, "")) for name in ("source", "history")):
        raise FileExistsError(f"cannot write {path}: the dataset that stands there is not warpdyn's; move it away")
    return found


class Unfinished:
    """The hidden folder in which a file is written until it is complete; one process at a time has it.

    It is used in a `with` statement. What a killed process left in it is removed by the next one, but for the folder
    `kept`, which belongs to the run that is to go on.

    Args:
        path: The file, or the Zarr store.
        suffix: What its name must end in.

    Raises:
        OSError: If another process is writing the file, or the folder cannot be made.
    """

    def __init__(self, path: str | os.PathLike, suffix: str = SUFFIX) -> None:
        self.path = check_writable(path, suffix)
        self.folder = self.path.with_name(f".{self.path.name}.unfinished")
        self.part, self.kept = self.folder / "part.nc", self.folder / "kept"
        self.is_journaled = False  # whether `kept` holds what this run has done, and no other
        # A store is of a long run on many machines, which goes on when its disk has room again, or its network is back.
        self._given_up = GIVEN_UP[1:] if suffix == STORE_SUFFIX else GIVEN_UP
        self._lock: int | None = None

    def __enter__(self) -> Unfinished:
        try:
            self._lock = self._locked()
            for left in self.folder.iterdir():
                if left not in (self.kept, self.folder / "lock"):
                    _remove(left)
        except BaseException as error:
            self._leave()
            if isinstance(error, OSError) and self.path.name not in str(error).partition(":")[0]:
                raise _named(error, self.path) from error
            raise
        return self

    def __exit__(self, kind: type | None, error: BaseException | None, trace: TracebackType | None) -> None:
        try:
            _remove(self.part)
            keeps = self.kept.is_dir()
            if self.is_journaled:
                # A run that was stopped goes on; one that asked for what cannot be, or found the disk full, does not.
                keeps = error is not None and not isinstance(error, self._given_up) and self._holds_results()
                if keeps and error is not None:
                    error.add_note(
                        f"{self.path}: what is finished of the run is kept; the same call goes on from there"
                    )
            if not keeps:
                with suppress(OSError):  # another process that waits may have begun to use the folder
                    _remove(self.folder)
        finally:
            self._leave()

    def _holds_results(self) -> bool:
        """Return whether `kept` holds blocks, regions, or files and stores of a portfolio's groups, that are done."""
        return any(self.kept.rglob("*.n[pc]*")) or any(self.kept.glob(f"*{STORE_SUFFIX}/.zmetadata"))

    def move_in(self) -> None:
        """Put the finished file in its place."""
        with open(self.part, "rb") as file:
            os.fsync(file.fileno())
        os.replace(self.part, self.path)

    def move_in_store(self, store: Path) -> None:
        """Put a finished store in its place; a folder does not replace another, which is moved away before."""
        if self.path.exists():
            os.replace(self.path, self.folder / "replaced")
        os.replace(store, self.path)

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
            _remove(self.kept)

    def _leave(self) -> None:
        if self._lock is not None:
            os.close(self._lock)
            self._lock = None

    def _locked(self) -> int:
        """Make the folder and return its locked file, which is unlocked when it is closed, also by a kill."""
        while True:
            self.folder.mkdir(exist_ok=True)
            try:
                lock = os.open(self.folder / "lock", os.O_RDWR | os.O_CREAT | getattr(os, "O_CLOEXEC", 0), 0o644)
            except FileNotFoundError:  # the process that had it removed the folder just now
                continue
            try:
                if fcntl is not None:
                    fcntl.flock(lock, fcntl.LOCK_EX | fcntl.LOCK_NB)
            except OSError as error:
                if error.errno not in NO_LOCKS:
                    os.close(lock)
                    raise BlockingIOError(f"cannot write {self.path}: another process is writing it") from error
            with suppress(FileNotFoundError):
                if os.stat(self.folder / "lock").st_ino == os.fstat(lock).st_ino:
                    return lock  # and not that of a process that has removed it meanwhile
            os.close(lock)


def disk_error(error: BaseException, path: Path) -> OSError:
    """Return what kept a file from being written as an OSError that names the file.

    netCDF says "HDF error" of a full disk too; what is still free tells.

    Args:
        error: The error that was raised.
        path: The file.
    """
    if isinstance(error, OSError) and error.errno not in (None, errno.ENOSPC, errno.EDQUOT) and error.errno > 0:
        return _named(error, path)
    try:
        free = shutil.disk_usage(path.parent).free
    except OSError:
        free = 0
    reason = f"{os.strerror(errno.ENOSPC)}, or another error of the disk ({error}); {free / 1e6:.3g} MB are free there"
    return OSError(errno.ENOSPC, f"cannot write {path}: {reason}")


def _named(error: OSError, path: Path, advice: str = "") -> OSError:
    """Return an error of the system with the path that it is about."""
    told = type(error)(f"cannot write {path}: {error.strerror or error}{advice}")
    told.errno = error.errno
    return told


def _near(folder: Path) -> str:
    """Return a question about a folder whose name is like that of a folder that is missing."""
    missing = folder
    while not missing.parent.is_dir() and missing.parent != missing:
        missing = missing.parent
    try:
        beside = [each.name for each in missing.parent.iterdir() if each.is_dir()]
    except OSError:
        return ""
    return did_you_mean(missing.name, beside)


def _remove(path: Path) -> None:
    """Remove a file or a folder; the space of a file is free also while a library holds it open."""
    if path.is_dir():
        for each in path.iterdir():
            if each.name != "lock":
                _remove(each)
        with suppress(FileNotFoundError):  # the lock goes last
            (path / "lock").unlink()
        path.rmdir()
        return
    with suppress(OSError):
        os.truncate(path, 0)
    path.unlink(missing_ok=True)
