"""Writing datasets to netCDF, at once or block by block. A file gets its final name only when it is complete.

The module also defines the attributes that record how a dataset was made.
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

# Samples in a chunk of the file: a few hundred kB of each variable, so that half-filled chunks at the end of a block
# take little time and space.
CHUNK = 2**14
ROWS_AT_A_TIME = 16 * CHUNK  # samples written between two checks for a signal such as Ctrl-C; writing them takes 0.1 s
TRIED_BYTES = 2**15  # bytes of a variable that are compressed to decide whether to compress the variable
LEAST_SHRINKING = 10  # a variable is compressed if this makes it at least this many times smaller
OF_ZARR = ("chunks", "preferred_chunks", "compressors", "filters", "shards")  # encodings that only Zarr stores have
COMPRESSED = {"zlib": True, "complevel": 1, "shuffle": True}
# Encodings that define how values are stored. Other encodings only describe the file from which a dataset was read.
CODED = ("dtype", "scale_factor", "add_offset", "_FillValue", "missing_value", "units", "calendar")


def trace(title: str, function: str) -> dict[str, str]:
    """Return the global attributes of a dataset: its title, and how it was made.

    Args:
        title: Title of the dataset.
        function: Name of the public function of warpdyn that made the dataset.
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
    """Write a dataset to a netCDF-4 file.

    A file at this path that warpdyn wrote is replaced, after the new file is complete. If no attribute of the dataset
    mentions warpdyn, a line is added to its attribute `history`.

    Args:
        dataset: The dataset.
        path: The file, in an existing folder; its name must end in ".nc".

    Raises:
        OSError: If the file cannot be written, for example because the disk is full, or if warpdyn did not write the
            file at this path. The existing file is then unchanged.
        ValueError: If the name does not end in ".nc".
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
    """Write a dataset in one call of xarray, and rename the temporary file to its final name."""
    with unfinished.named_errors():
        _to_netcdf(dataset, unfinished.part)
        unfinished.move_in()


def _signed(dataset: xr.Dataset) -> xr.Dataset:
    """Return the dataset with attributes that mention warpdyn: only files with this mark are replaced later."""
    if any("warpdyn" in str(dataset.attrs.get(name, "")) for name in ("source", "history")):
        return dataset
    before = f"{dataset.attrs['history']}\n" if dataset.attrs.get("history") else ""
    return dataset.assign_attrs(history=f"{before}{_now()} warpdyn.write")


def _is_plain(variable: xr.Variable) -> bool:
    """Return whether a variable has the first dimension `sample` and its values are written to a file unconverted."""
    coded = {"scale_factor", "add_offset", "_FillValue", "missing_value"} & variable.encoding.keys()
    of_nan = coded == {"_FillValue"} and variable.dtype.kind == "f" and np.isnan(variable.encoding["_FillValue"])
    as_is = (of_nan or not coded) and variable.encoding.get("dtype", variable.dtype) == variable.dtype
    missing = "_FillValue" in variable.attrs or "missing_value" in variable.attrs
    return variable.dims[:1] == ("sample",) and variable.dtype.kind in "iuf" and as_is and not missing


def _write_in_parts(dataset: xr.Dataset, along: dict[str, xr.Variable], unfinished: Unfinished) -> None:
    """Write a dataset to a file; variables with the dimension `sample` in parts, so that Ctrl-C acts between parts."""
    with GrowingFile(unfinished, dataset.sizes["sample"]) as file:
        for first in range(0, dataset.sizes["sample"], ROWS_AT_A_TIME):
            part = slice(first, first + ROWS_AT_A_TIME)
            file.append({name: variable[part].values for name, variable in along.items()}, lambda rows: dataset)
        file.finish(xr.Dataset(attrs=dataset.attrs))


class GrowingFile:
    """A netCDF-4 file to which samples are added block by block. The file gets its final name when it is complete.

    Use it in a `with` statement, which closes the file.

    Args:
        unfinished: The hidden folder in which the file is written.
        samples: Number of samples in the finished file.
    """

    def __init__(self, unfinished: Unfinished, samples: int) -> None:
        self.unfinished, self.samples, self._written = unfinished, samples, 0
        self._file: netCDF4.Dataset | None = None

    def __enter__(self) -> GrowingFile:
        return self

    def __exit__(self, kind: type | None, error: BaseException | None, trace: TracebackType | None) -> None:
        with suppress(OSError, RuntimeError):  # after an error because of a full disk, closing the file fails as well
            self._close()

    def append(self, rows: dict[str, np.ndarray], labelled: Callable[[dict[str, np.ndarray]], xr.Dataset]) -> None:
        """Add samples to the file.

        Args:
            rows: Name of the variable -> values; the first dimension is `sample`.
            labelled: Function from `rows` to a dataset that contains them, with dimensions, attributes and labels.

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
        """Add variables and attributes that are known only at the end of a run, and give the file its final name.

        Raises:
            OSError: As in `append`.
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
    """Write a dataset to a netCDF file.

    Coordinates get no fill value, as the CF conventions require. A variable is compressed if this makes it at least
    LEAST_SHRINKING times smaller.

    Args:
        dataset: The dataset.
        path: The file.
        chunked: Name -> encoding of the variables that are written block by block.
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
    # Unlimited dimensions of a file from which the dataset was read would make chunks small.
    how = {"unlimited_dims": ()} | how
    dataset.to_netcdf(path, encoding=encoding | (chunked or {}), format="NETCDF4", engine="netcdf4", **how)


def _chunked(dataset: xr.Dataset, samples: int) -> Encoding:
    """Return the encoding of the variables with the dimension `sample`: chunk size, and whether they are compressed.

    Measured for a large fragility study: compression makes demands only 25 % smaller, at 30 MB/s. It makes inputs and
    coordinates, whose values repeat, 99 % smaller, at 300 MB/s.
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
    """Return whether compression makes the first values of a variable at least LEAST_SHRINKING times smaller."""
    rows = TRIED_BYTES // max(1, variable.dtype.itemsize * int(np.prod(variable.shape[1:])))
    values = np.ascontiguousarray(variable[:rows].values)
    if values.dtype.kind not in "iuf" or not values.nbytes:
        return False
    shuffled = values.view(np.uint8).reshape(-1, values.dtype.itemsize).T.tobytes()
    return len(zlib.compress(shuffled, 1)) * LEAST_SHRINKING < values.nbytes
