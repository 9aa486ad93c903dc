"""Datasets to netCDF, all or nothing: a file that is there is whole. What traces a dataset to its making."""

from __future__ import annotations

import datetime
import os
import platform
import tempfile
from importlib.metadata import version
from pathlib import Path

import numpy as np
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


def trace(title: str, function: str) -> dict[str, str]:
    """Return the root attributes of a dataset that say what it is and what made it.

    Args:
        title: What the dataset holds.
        function: The public function of warpdyn that made it.
    """
    return {
        "Conventions": "CF-1.11",
        "title": title,
        "history": f"{datetime.datetime.now(datetime.UTC):%Y-%m-%dT%H:%M:%SZ} warpdyn.{function}",
        "source": f"warpdyn {version('warpdyn')}, warp-lang {version('warp-lang')}, numpy {np.__version__}, "
        f"Python {platform.python_version()}",
    }


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
