"""Datasets to netCDF, all or nothing: a file that is there is whole."""

from __future__ import annotations

import os
import tempfile
from pathlib import Path

import xarray as xr


def check_writable(path: str | os.PathLike) -> Path:
    """Return the path, after making its folder and trying to write beside it; call it before a long run.

    Args:
        path: Where a file is to be written.

    Raises:
        OSError: If no file can be written there; the message names the path and says why.
    """
    path = Path(path)
    if path.is_dir():
        raise IsADirectoryError(f"cannot write {path}: it is a directory; name a file in it")
    try:
        path.parent.mkdir(parents=True, exist_ok=True)
        with tempfile.NamedTemporaryFile(dir=path.parent, prefix=f".{path.name}."):
            pass
        if path.exists() and not os.access(path, os.W_OK):
            raise PermissionError("the file that is there is read-only")
    except OSError as error:
        reason = error.strerror or str(error)
        raise type(error)(f"cannot write {path}: {reason}; choose another folder") from error
    return path


def write(dataset: xr.Dataset, path: str | os.PathLike) -> Path:
    """Write a dataset to a netCDF-4 file: to a temporary file beside it first, then moved into its place.

    Args:
        dataset: The dataset.
        path: The file.

    Raises:
        OSError: If the file cannot be written; what stood there before is untouched.
    """
    path = check_writable(path)
    temporary = path.with_name(f".{path.name}.{os.getpid()}.part")
    try:
        dataset.to_netcdf(temporary, format="NETCDF4", engine="netcdf4")
        os.replace(temporary, path)
    finally:
        temporary.unlink(missing_ok=True)
    return path
