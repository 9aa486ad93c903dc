"""Write datasets to netCDF, whole or block after block; a file appears in its place only when it is complete.

The attributes that say how a dataset was made are here too.
"""

from __future__ import annotations

import datetime
import os
import platform
import tempfile
import zlib
from collections.abc import Callable
from importlib.metadata import version
from pathlib import Path
from types import TracebackType
from uuid import uuid4

import netCDF4
import numpy as np
import xarray as xr

from warpdyn.core.checks import check_kind

# Samples in a chunk of the file: some hundred kilobytes of each variable, so that the half-filled chunks at the end of
# a block cost little.
CHUNK = 2**14
TRIED_BYTES = 2**15  # bytes of a variable that are compressed on trial, to see whether compression pays
LEAST_SHRINKING = 10


def check_writable(path: str | os.PathLike) -> Path:
    """Make a file's folder, check that a file can be written in it, and return the path; call it before a long run.

    Args:
        path: Where a file is to be written.

    Raises:
        OSError: If no file can be written there; the message names the path and the reason.
    """
    if not isinstance(path, str | os.PathLike) or not os.fspath(path):
        raise TypeError(f"path must name a file, got {path!r}")
    path = Path(path).resolve()  # a link stays, and its target is written
    if path.is_dir():
        raise IsADirectoryError(f"cannot write {path}: it is a directory; name a file in it")
    if path.exists() and not path.is_file():
        raise OSError(f"cannot write {path}: what is there is no file")
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
    """Return the root attributes that say what a dataset holds and how it was made.

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
        OSError: If the file cannot be written; an older file in its place is untouched.
        TypeError: If `dataset` is no Dataset.
    """
    check_kind("write", "a Dataset", dataset, xr.Dataset)
    path = check_writable(path)
    temporary = _temporary(path)
    encoding = _encoding(dataset, dataset.sizes["sample"]) if dataset.sizes.get("sample", 0) > CHUNK else {}
    try:
        dataset.to_netcdf(temporary, format="NETCDF4", engine="netcdf4", encoding=encoding)
        os.replace(temporary, path)
    finally:
        temporary.unlink(missing_ok=True)
    return path


class GrowingFile:
    """A netCDF-4 file to which samples are added block after block; it appears in its place when it is finished.

    It is used in a `with` statement, which removes an unfinished file and leaves an older file in its place.

    Args:
        path: The file.
        samples: Number of samples in the finished file.

    Raises:
        OSError: If no file can be written there.
    """

    def __init__(self, path: str | os.PathLike, samples: int) -> None:
        self.path, self.samples = check_writable(path), samples
        self._temporary, self._written = _temporary(self.path), 0
        self._file: netCDF4.Dataset | None = None

    def __enter__(self) -> GrowingFile:
        return self

    def __exit__(self, kind: type | None, error: BaseException | None, trace: TracebackType | None) -> None:
        self._close()
        self._temporary.unlink(missing_ok=True)

    def append(self, rows: dict[str, np.ndarray], labelled: Callable[[dict[str, np.ndarray]], xr.Dataset]) -> None:
        """Add samples.

        Args:
            rows: Their values by name, sample first.
            labelled: Function from the values to their dataset; the file takes its names, attributes and other
                variables.
        """
        if self._file is None:
            first = labelled(rows)
            encoding = _encoding(first, self.samples)
            # The file is created without samples; they are written block by block.
            first = first.isel(sample=slice(0))
            first.to_netcdf(
                self._temporary, encoding=encoding, format="NETCDF4", engine="netcdf4", unlimited_dims=["sample"]
            )
            self._file = netCDF4.Dataset(self._temporary, "r+")
            self._file.set_auto_maskandscale(False)
            for name in encoding:
                # Two chunks are cached, the half-filled one and the next; by default each variable would take 16 MiB.
                variable = self._file[name]
                size = variable.dtype.itemsize * int(np.prod(variable.chunking()))
                variable.set_var_chunk_cache(2 * size)
        count = len(next(iter(rows.values())))
        for name, values in rows.items():
            self._file[name][self._written : self._written + count] = values
        self._written += count

    def finish(self, rest: xr.Dataset) -> None:
        """Add the variables and attributes that are known only at the end, and move the file into its place."""
        self._close()
        rest.to_netcdf(self._temporary, mode="a", format="NETCDF4", engine="netcdf4")
        os.replace(self._temporary, self.path)

    def _close(self) -> None:
        if self._file is not None:
            self._file.close()
            self._file = None


def _temporary(path: Path) -> Path:
    return path.with_name(f".{path.name}.{uuid4().hex}.part")


def _encoding(dataset: xr.Dataset, samples: int) -> dict[str, dict[str, object]]:
    """Return how the variables along `sample` are stored in the file: in chunks of samples, some of them compressed.

    As measured on the main job, demands shrink by a quarter, at 30 MB/s; inputs and coordinates, which repeat from
    sample to sample, shrink a hundredfold, at 300 MB/s.
    """
    found: dict[str, dict[str, object]] = {}
    for name, variable in dataset.variables.items():
        if variable.dims[:1] == ("sample",):
            chunk: dict[str, object] = {"chunksizes": (min(CHUNK, samples), *variable.shape[1:])}
            pays = {"zlib": True, "complevel": 1, "shuffle": True} if _shrinks(variable) else {"zlib": False}
            found[str(name)] = chunk | pays
    return found


def _shrinks(variable: xr.Variable) -> bool:
    """Return whether the first values of a variable become much smaller by compression."""
    rows = TRIED_BYTES // max(1, variable.dtype.itemsize * int(np.prod(variable.shape[1:])))
    values = np.ascontiguousarray(variable[:rows].values)
    if values.dtype.kind not in "iuf" or not values.nbytes:
        return False
    shuffled = values.view(np.uint8).reshape(-1, values.dtype.itemsize).T.tobytes()
    return len(zlib.compress(shuffled, 1)) * LEAST_SHRINKING < values.nbytes
