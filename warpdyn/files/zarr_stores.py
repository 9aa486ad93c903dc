"""Zarr stores of samples: laid out first, then written region by region, by any number of processes side by side.

A region is as long as a chunk along `sample`, so that no two processes ever write to one chunk. Stores are of Zarr's
format 2, which most programs read: format 3 has neither consolidated metadata nor names of fixed length in its
specification.
"""

from __future__ import annotations

import warnings
from pathlib import Path
from typing import TYPE_CHECKING, Any

import numpy as np
import xarray as xr

if TYPE_CHECKING:
    import zarr

REMEDY = 'pip install "distributed>=2024.11" "zarr>=3.1.3"'
FORMAT: Any = 2


def check_zarr() -> None:
    """Raise an ImportError with advice if Zarr is not installed."""
    try:
        import zarr  # noqa: F401  (whether it is there)
    except ImportError as error:
        raise ImportError(f"a Zarr store needs zarr, which is not installed: {REMEDY}") from error


def lay_out(path: Path, template: xr.Dataset, samples: int, region: int) -> None:
    """Make a store for so many samples, without their values.

    Args:
        path: The store; what stands there is replaced.
        template: The dataset without samples.
        samples: Number of samples.
        region: Samples of a region.
    """
    from numcodecs import Blosc

    along = [str(name) for name, variable in template.variables.items() if "sample" in variable.dims]
    encoding: dict[str, dict[str, Any]] = {str(name): {"_FillValue": None} for name in template.coords}
    for name in along:
        # As measured on the main job, a sample shrinks from 233 to 97 bytes, in a microsecond of a processor core.
        compressor = Blosc("zstd", clevel=1, shuffle=Blosc.SHUFFLE)
        chunks = (min(region, samples), *template[name].shape[1:])
        encoding.setdefault(name, {}).update(chunks=chunks, compressors=compressor)
    template.to_zarr(path, mode="w", consolidated=False, zarr_format=FORMAT, encoding=encoding)
    group = _opened(path)
    for name in along:
        _array(group, name).resize((samples, *template[name].shape[1:]))


def write_region(path: Path, first: int, rows: dict[str, np.ndarray]) -> None:
    """Write the samples of a region, by name and sample first; each file of the store appears whole or not at all.

    Args:
        path: The store.
        first: The first of the samples.
        rows: Their values.
    """
    group = _opened(path)
    for name, values in rows.items():
        _array(group, name)[first : first + len(values)] = values


def complete(path: Path, rest: xr.Dataset) -> None:
    """Add the variables that are known only at the end, and all attributes, and consolidate the metadata."""
    import zarr

    rest.to_zarr(path, mode="a", consolidated=False, zarr_format=FORMAT)
    with warnings.catch_warnings():
        warnings.simplefilter("ignore")  # of files beside the arrays
        zarr.consolidate_metadata(path, zarr_format=FORMAT)


def _opened(path: Path) -> zarr.Group:
    import zarr

    return zarr.open_group(path, mode="r+", zarr_format=FORMAT)


def _array(group: zarr.Group, name: str) -> Any:
    return group[name]
