"""Check the free space of the kernel cache, and remove unfinished files of processes that were killed.

Warp compiles into a temporary folder next to the folder of the module and then renames it; the compiler writes
precompiled headers in the same way. While a process compiles, it creates and locks a note: a file with the name of the
temporary folder. If a note is not locked, its process was killed. Folders without a note are not removed.
"""

import atexit
import errno
import os
import shutil
import tempfile
import threading
from collections.abc import Iterator
from contextlib import contextmanager, suppress
from pathlib import Path

from warpdyn.foundations.files.disk_errors import FULL, free_space
from warpdyn.foundations.files.part_files import fcntl
from warpdyn.foundations.files.removal import LOCK, remove_tree

OF_A_PROCESS = "warpdyn_kernels_"  # prefix of the names of temporary folders
NOTE, HEADERS, UNFINISHED_HEADERS = ".compiling", "precompiled_headers_*", "*.pch.tmp"
OPENED = getattr(os, "O_CLOEXEC", 0) | getattr(os, "O_NOFOLLOW", 0)
# Bytes that a compilation may need: precompiled headers of Warp 1.19 need 4.7 MB, a kernel with its source 0.1 to 1 MB
# on a processor; binaries for a GPU need about the same.
ROOM = 2**25


def check_room(cache: Path) -> None:
    """Raise an OSError if the disk of the kernel cache has less than ROOM bytes free.

    If the disk became full while a kernel is compiled, the compiler would end the Python process.
    """
    while not cache.is_dir() and cache.parent != cache:
        cache = cache.parent
    try:
        if shutil.disk_usage(cache).free < ROOM:
            raise OSError(errno.ENOSPC, os.strerror(errno.ENOSPC))
        # Reserving the space also tests quotas and limits of the process.
        if hasattr(os, "posix_fallocate"):
            with tempfile.TemporaryFile(dir=cache) as file:
                os.posix_fallocate(file.fileno(), 0, ROOM)
    except OSError as error:
        if error.errno not in FULL:
            return  # the folder cannot be written, or the system cannot reserve space
        raise OSError(
            errno.ENOSPC,
            f"cannot compile a kernel: the kernel cache {cache} has too little free space ({error.strerror}; "
            f"{free_space(cache)}, and a kernel needs up to {ROOM / 1e6:.0f} MB). Delete files there, or choose "
            "another folder before Python starts: export WARP_CACHE_PATH=/a/folder/on/another/disk",
        ) from error


@contextmanager
def noted(folder: Path) -> Iterator[None]:
    """Lock a note while this thread compiles a module into `folder`; first remove unfinished files of killed processes.

    The note is a file that names Warp's temporary folder. A later process removes the folder if the note is not locked.
    """
    if fcntl is None:
        yield
        return
    with suppress(OSError):
        folder.parent.mkdir(parents=True, exist_ok=True)
        _sweep(folder.parent)
    # The name of Warp's temporary folder for this process and thread.
    note = folder.with_name(f"{folder.name}_p{os.getpid()}_t{threading.get_ident()}{NOTE}")
    held = None
    with suppress(OSError):  # without a note, nothing is removed if this process is killed
        held = os.open(note, os.O_RDWR | os.O_CREAT | os.O_EXCL | OPENED, 0o644)
        fcntl.flock(held, fcntl.LOCK_EX)
    try:
        yield
    finally:
        if held is not None:
            note.unlink(missing_ok=True)
            os.close(held)


def folder_of_this_process() -> Path:
    """Return a new temporary folder; it is removed when this process ends or, if it is killed, by a later process."""
    if fcntl is not None:
        for left in Path(tempfile.gettempdir()).glob(f"{OF_A_PROCESS}*"):
            with suppress(OSError):
                _remove_if_unused(left)
    folder = Path(tempfile.mkdtemp(prefix=OF_A_PROCESS))
    lock = os.open(folder / LOCK, os.O_RDWR | os.O_CREAT | os.O_EXCL | OPENED, 0o600)
    if fcntl is not None:
        fcntl.flock(lock, fcntl.LOCK_EX)  # until the process ends
    atexit.register(shutil.rmtree, folder, ignore_errors=True)
    return folder


def _remove_if_unused(folder: Path) -> None:
    """Remove the temporary folder of a process that has ended; raise an OSError if the process is still running."""
    if folder.is_symlink() or folder.stat().st_uid != os.geteuid():
        return
    lock = os.open(folder / LOCK, os.O_RDWR | OPENED)
    try:
        fcntl.flock(lock, fcntl.LOCK_EX | fcntl.LOCK_NB)
        remove_tree(folder)
    finally:
        os.close(lock)


def _sweep(cache: Path) -> None:
    """Remove temporary folders of killed processes, and unfinished precompiled headers if no process compiles."""
    # A process locks a note before it writes headers, so a process without note now did not write these files.
    unfinished = [path for folder in cache.glob(HEADERS) for path in folder.glob(UNFINISHED_HEADERS)]
    held = [not _is_removed(note) for note in cache.glob(f"*{NOTE}")]
    if not any(held):
        for path in unfinished:
            if path.is_file() and not path.is_symlink():
                path.unlink(missing_ok=True)


def _is_removed(note: Path) -> bool:
    """Remove a note that is not locked, with the folder that it names; return whether the note was removed.

    A note is a file that a process locks while it compiles into the folder. If the note has no lock, the process was
    killed.
    """
    try:
        file = os.open(note, os.O_RDWR | OPENED)
    except FileNotFoundError:
        return True
    except OSError:
        return False
    try:
        fcntl.flock(file, fcntl.LOCK_EX | fcntl.LOCK_NB)
        folder = note.with_name(note.name.removesuffix(NOTE))
        if folder.is_dir() and not folder.is_symlink():
            remove_tree(folder)
        note.unlink(missing_ok=True)
    except OSError:
        return False
    finally:
        os.close(file)
    return True
