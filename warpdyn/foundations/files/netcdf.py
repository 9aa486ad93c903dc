"""Datasets written to netCDF, at once or block after block; a file gets its name only when it is complete.

The module also has the attributes that record how a dataset was made.
"""

from __future__ import annotations

import datetime
import os
import platform
import zlib
from collections.abc import Callable
from contextlib import suppress
from pathlib import Path
from types import TracebackType
from typing import Any

import netCDF4
import numpy as np
import xarray as xr

from warpdyn.foundations.core.checks import check_kind
from warpdyn.foundations.core.interruption import interruptible, stop_if_asked
from warpdyn.foundations.files.unfinished import Unfinished
from warpdyn.foundations.files.versions import version_of

# Samples in a chunk of the file: a few hundred kB of each variable, so that half-filled chunks at the end of a
# block take little time and space.
CHUNK = 2**14
ROWS_AT_A_TIME = 16 * CHUNK  # samples written between two checks for a signal; compressing them takes about 0.1 s
TRIED_BYTES = 2**15  # bytes of a variable that are compressed to decide whether to compress the variable
LEAST_SHRINKING = 10
OF_ZARR = ("chunks", "preferred_chunks", "compressors", "filters", "shards")  # encodings of variables of a Zarr store
COMPRESSED = {"zlib": True, "complevel": 1, "shuffle": True}
# Encodings of values; other encodings describe the file from which a dataset was read.
CODED = ("dtype", "scale_factor", "add_offset", "_FillValue", "missing_value", "units", "calendar")


def trace(title: str, function: str) -> dict[str, str]:
    """Return the root attributes that name the content of a dataset and record how it was made.

    Args:
        title: The content of the dataset.
        function: The public function of warpdyn that made it.
    """
    return {
        "Conventions": "CF-1.11",
        "title": title,
        "history": f"{_now()} warpdyn.{function}",
        "source": f"warpdyn {version_of('warpdyn')}, warp-lang {version_of('warp-lang')}, numpy {np.__version__}, "
        f"Python {platform.python_version()}",
    }


def _now() -> str:
    return f"{datetime.datetime.now(datetime.UTC):%Y-%m-%dT%H:%M:%SZ}"


def write(dataset: xr.Dataset, path: str | os.PathLike) -> Path:
    """Write a dataset to a netCDF-4 file; a complete file replaces an older one that warpdyn wrote.

    A dataset whose attributes do not name warpdyn gets a line in its attribute `history`.

    Args:
        dataset: The dataset.
        path: The file, in a folder that exists; its name ends in ".nc".

    Raises:
        OSError: If the file cannot be written, such as on a full disk, or would replace a file that warpdyn did not
            write. An older file is then unchanged.
        ValueError: If the name has another ending.
        TypeError: If `dataset` is not a Dataset.

    Example:
        >>> path = wd.write(run, "run.nc")
        >>> import xarray as xr
        >>> with xr.open_dataset(path) as kept:
        ...     kept.sizes["sample"]
        144
    """
    check_kind("write", "a Dataset", dataset, xr.Dataset)
    with interruptible(), Unfinished(path) as unfinished:
        dataset = _signed(dataset)
        along = {str(name): variable for name, variable in dataset.variables.items() if "sample" in variable.dims}
        if dataset.sizes.get("sample", 0) > CHUNK and all(map(_is_plain, along.values())):
            _write_in_parts(dataset, along, unfinished)
        else:
            write_at_once(dataset, unfinished)
    return unfinished.path


def write_at_once(dataset: xr.Dataset, unfinished: Unfinished) -> None:
    """Write a small dataset, and move the file to its place."""
    with unfinished.named_errors():
        _to_netcdf(dataset, unfinished.part)
        unfinished.move_in()


def _signed(dataset: xr.Dataset) -> xr.Dataset:
    """Return the dataset with attributes that name warpdyn, which may then replace the file."""
    if any("warpdyn" in str(dataset.attrs.get(name, "")) for name in ("source", "history")):
        return dataset
    before = f"{dataset.attrs['history']}\n" if dataset.attrs.get("history") else ""
    return dataset.assign_attrs(history=f"{before}{_now()} warpdyn.write")


def _is_plain(variable: xr.Variable) -> bool:
    """Return whether a file contains a variable's values without any conversion, with `sample` as first dimension."""
    coded = {"scale_factor", "add_offset", "_FillValue", "missing_value"} & variable.encoding.keys()
    of_nan = coded == {"_FillValue"} and variable.dtype.kind == "f" and np.isnan(variable.encoding["_FillValue"])
    as_is = (of_nan or not coded) and variable.encoding.get("dtype", variable.dtype) == variable.dtype
    missing = "_FillValue" in variable.attrs or "missing_value" in variable.attrs
    return variable.dims[:1] == ("sample",) and variable.dtype.kind in "iuf" and as_is and not missing


def _write_in_parts(dataset: xr.Dataset, along: dict[str, xr.Variable], unfinished: Unfinished) -> None:
    """Write a dataset with its variables along `sample` part by part, so that Ctrl-C acts between parts."""
    with GrowingFile(unfinished, dataset.sizes["sample"]) as file:
        for first in range(0, dataset.sizes["sample"], ROWS_AT_A_TIME):
            part = slice(first, first + ROWS_AT_A_TIME)
            file.append({name: variable[part].values for name, variable in along.items()}, lambda rows: dataset)
        file.finish(xr.Dataset(attrs=dataset.attrs))


class GrowingFile:
    """A netCDF-4 file to which samples are added block after block, and which is moved to its place when complete.

    It is used in a `with` statement, which closes the file.

    Args:
        unfinished: The folder.
        samples: Number of samples in the finished file.
    """

    def __init__(self, unfinished: Unfinished, samples: int) -> None:
        self.unfinished, self.samples, self._written = unfinished, samples, 0
        self._file: netCDF4.Dataset | None = None

    def __enter__(self) -> GrowingFile:
        return self

    def __exit__(self, kind: type | None, error: BaseException | None, trace: TracebackType | None) -> None:
        with suppress(OSError, RuntimeError):  # after an error on a full disk, closing fails as well
            self._close()

    def append(self, rows: dict[str, np.ndarray], labelled: Callable[[dict[str, np.ndarray]], xr.Dataset]) -> None:
        """Add samples.

        Args:
            rows: Their values by name, sample first.
            labelled: Function from the values to their dataset, with the names, attributes and other variables.

        Raises:
            OSError: If the disk is full or fails; the message names the file.
        """
        with self.unfinished.named_errors():
            if self._file is None:
                self._create(labelled(rows))
            assert self._file is not None
            count = len(next(iter(rows.values())))
            for name, values in rows.items():
                for first in range(0, count, ROWS_AT_A_TIME):
                    part = values[first : first + ROWS_AT_A_TIME]
                    begin = self._written + first
                    self._file[name][begin : begin + len(part)] = part
                    stop_if_asked()
            self._written += count

    def _create(self, first: xr.Dataset) -> None:
        chunked = _chunked(first, self.samples)
        # The file is created without samples; they are written block by block.
        first, part = first.isel(sample=slice(0)), self.unfinished.part
        _to_netcdf(first, part, chunked, unlimited_dims=["sample"])
        self._file = netCDF4.Dataset(part, "r+")
        self._file.set_auto_maskandscale(False)
        for name in chunked:
            # Cache two chunks, the half-filled one and the next; the default would be 16 MiB for each variable.
            variable = self._file[name]
            size = variable.dtype.itemsize * int(np.prod(variable.chunking()))
            variable.set_var_chunk_cache(2 * size)

    def finish(self, rest: xr.Dataset) -> None:
        """Add the variables and attributes that are known only at the end, and move the file to its place.

        Raises:
            OSError: As `append`.
        """
        with self.unfinished.named_errors():
            self._close()
            _to_netcdf(rest, self.unfinished.part, mode="a")
            self.unfinished.move_in()

    def _close(self) -> None:
        if self._file is not None:
            file, self._file = self._file, None
            file.close()


Encoding = dict[str, dict[str, Any]]


def _to_netcdf(dataset: xr.Dataset, path: Path, chunked: Encoding | None = None, **how: Any) -> None:
    """Write a dataset; coordinates have no fill value, as CF requires, and variables that shrink are compressed.

    Args:
        dataset: The dataset.
        path: The file.
        chunked: Encoding of variables that are written block by block.
        how: Other arguments of `Dataset.to_netcdf`.
    """
    encoding: Encoding = {}
    for name, variable in dataset.variables.items():
        own = {key: variable.encoding[key] for key in CODED if key in variable.encoding}
        if name in dataset.coords and not own.keys() & {"scale_factor", "add_offset", "missing_value"}:
            own["_FillValue"] = None
        if variable.dtype.kind in "iuf":
            encoding[str(name)] = own | (COMPRESSED if variable.ndim and _shrinks(variable) else {})
        elif name in dataset.coords:
            held = {key: value for key, value in variable.encoding.items() if key not in OF_ZARR}
            encoding[str(name)] = held | own
    how = {"unlimited_dims": ()} | how  # those of a file that the dataset was read from would lead to small chunks
    dataset.to_netcdf(path, encoding=encoding | (chunked or {}), format="NETCDF4", engine="netcdf4", **how)


def _chunked(dataset: xr.Dataset, samples: int) -> Encoding:
    """Return the encoding of the variables along `sample`: in chunks of samples, some of them compressed.

    Measured for a large fragility study: demands shrink by a quarter, at 30 MB/s; inputs and coordinates, which repeat
    from sample to sample, shrink to a hundredth, at 300 MB/s.
    """
    found: Encoding = {}
    for name, variable in dataset.variables.items():
        if variable.dims[:1] == ("sample",):
            found[str(name)] = {"chunksizes": (min(CHUNK, samples), *variable.shape[1:])}
            found[str(name)] |= COMPRESSED if _shrinks(variable) else {"zlib": False}
            if name in dataset.coords:
                found[str(name)]["_FillValue"] = None
    return found


def _shrinks(variable: xr.Variable) -> bool:
    """Return whether the first values of a variable become much smaller by compression."""
    rows = TRIED_BYTES // max(1, variable.dtype.itemsize * int(np.prod(variable.shape[1:])))
    values = np.ascontiguousarray(variable[:rows].values)
    if values.dtype.kind not in "iuf" or not values.nbytes:
        return False
    shuffled = values.view(np.uint8).reshape(-1, values.dtype.itemsize).T.tobytes()
    return len(zlib.compress(shuffled, 1)) * LEAST_SHRINKING < values.nbytes
