"""Errors of writing files; messages name the path that the user gave instead of the temporary file."""

from __future__ import annotations

import errno
import os
import shutil
from pathlib import Path

FULL = (errno.ENOSPC, errno.EDQUOT, errno.EFBIG)  # no space left, quota exceeded, larger than the process may write


def disk_error(error: BaseException, path: Path) -> OSError:
    """Return an OSError whose message names the file that could not be written, and the reason.

    netCDF reports "HDF error" also if the disk is full; the free space in the message shows whether it was full.

    Args:
        error: The error that was raised.
        path: The file that the user gave.
    """
    if isinstance(error, OSError) and error.errno not in (None, *FULL) and error.errno > 0:
        return named_error(error, path)
    reason = f"{os.strerror(errno.ENOSPC)}, or another error of the disk ({error}); {free_space(path.parent)}: "
    reason += "free some space, or choose another folder"
    return OSError(errno.ENOSPC, f"cannot write {path}: {reason}")


def named_error(error: OSError, path: Path, function: str = "") -> OSError:
    """Return a copy of a system error; its message names the file and, if given, the function that writes the file."""
    named = type(error)(f"{f'{function}: ' if function else ''}cannot write {path}: {error.strerror or error}")
    named.errno = error.errno
    return named


def free_space(folder: Path) -> str:
    """Return text such as "120 MB are free there": the free space of the disk that contains the folder."""
    try:
        free = shutil.disk_usage(folder).free
    except OSError:
        free = 0
    return f"{free / 1e6:.3g} MB are free there"
