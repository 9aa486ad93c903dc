"""Zarr stores of samples: the store is first made without values; then processes write regions of samples into it.

A region contains the samples of one chunk, so that several processes can write at the same time without writing to the
same chunk. Stores have Zarr's format 2, which most programs can read: the specification of format 3 includes neither
consolidated metadata nor text of fixed length.

A file counts as written only after it is flushed to the disk. A resumed run compares files with their SHA-256 digests.
"""

from __future__ import annotations

import warnings
from concurrent.futures import ThreadPoolExecutor
from pathlib import Path
from typing import TYPE_CHECKING, Any

import numpy as np
import xarray as xr

from warpdyn.foundations.files.checksums import digest_of
from warpdyn.foundations.files.part_files import sync, sync_folder
from warpdyn.foundations.files.removal import remove_tree

if TYPE_CHECKING:
    import zarr

REMEDY = 'pip install "distributed>=2024.11" "zarr>=3.1.3"'
FORMAT: Any = 2  # version of the Zarr format
AT_A_TIME = 8  # files flushed to the disk at the same time: 24 files take 10 ms, one after the other 150 to 240 ms
OF_THE_END = (".zattrs", ".zmetadata")  # files that `complete` writes at the end of a run
Digests = dict[str, str]  # name of a file in the store -> its SHA-256 digest


def check_zarr() -> None:
    """Raise an ImportError with advice if Zarr is not installed."""
    try:
        import zarr  # noqa: F401  (only checks that it is installed)
    except ImportError as error:
        raise ImportError(f"a Zarr store needs zarr, which is not installed: {REMEDY}") from error


def lay_out(path: Path, template: xr.Dataset, samples: int, region: int) -> Digests:
    """Make a Zarr store with space for samples, but without their values; return its files as name -> digest.

    Args:
        path: The store; an existing store is replaced.
        template: The dataset without samples.
        samples: Number of samples.
        region: Number of samples in a region.
    """
    from numcodecs import Blosc

    if path.is_dir():
        remove_tree(path)
    along = [str(name) for name, variable in template.variables.items() if "sample" in variable.dims]
    encoding: dict[str, dict[str, Any]] = {str(name): {"_FillValue": None} for name in template.coords}
    for name in along:
        # Measured for a large fragility study: a sample shrinks from 233 to 97 bytes, in 1 us of a processor core.
        compressor = Blosc("zstd", clevel=1, shuffle=Blosc.SHUFFLE)
        chunks = (min(region, samples), *template[name].shape[1:])
        encoding.setdefault(name, {}).update(chunks=chunks, compressors=compressor)
    template.to_zarr(path, mode="w", consolidated=False, zarr_format=FORMAT, encoding=encoding)
    group = _opened(path)
    for name in along:
        _array(group, name).resize((samples, *template[name].shape[1:]))
    _sync_all(path)
    return {name: digest_of(path / name) for name in _files_in(path) if name not in OF_THE_END}


def is_laid_out(path: Path, digests: object) -> bool:
    """Return whether the files that `lay_out` wrote are unchanged; if so, remove files that `complete` has added.

    Args:
        path: The store.
        digests: The files of the store as name -> digest, as returned by `lay_out`.
    """
    if not path.is_dir() or not isinstance(digests, dict):
        return False
    if any(digest_of(path / name) != digest for name, digest in digests.items()):
        return False
    arrays = {name.partition("/")[0] for name in digests}
    for entry in list(path.iterdir()):
        if entry.is_dir() and entry.name not in arrays:
            remove_tree(entry)
        elif entry.name in OF_THE_END:
            entry.unlink()
    return True


def write_region(path: Path, first: int, rows: dict[str, np.ndarray]) -> Digests:
    """Write the samples of a region to a Zarr store and flush them to the disk; return the files as name -> digest.

    A file of the store is either complete or does not exist. A chunk that contains only the fill value has no file.

    Args:
        path: The store.
        first: Index of the region's first sample.
        rows: Name of the variable -> values; the first dimension is `sample`.
    """
    group, chunks = _opened(path), []
    for name, values in rows.items():
        array = _array(group, name)
        array[first : first + len(values)] = values
        chunks.append("/".join([name, ".".join([str(first // array.chunks[0]), *"0" * (array.ndim - 1)])]))

    def kept(chunk: str) -> str:
        if (path / chunk).is_file():
            sync(path / chunk)
        sync_folder((path / chunk).parent)
        return digest_of(path / chunk)

    with ThreadPoolExecutor(AT_A_TIME) as pool:
        return dict(zip(chunks, pool.map(kept, chunks), strict=True))


def damaged_regions(path: Path, digests: list[Digests]) -> list[int]:
    """Return the indices of the regions of a Zarr store whose files were changed or removed after they were written.

    Args:
        path: The store.
        digests: The result of `write_region` for each region: file name -> digest.
    """

    def is_damaged(chunks: Digests) -> bool:
        return not chunks or any(digest_of(path / name) != digest for name, digest in chunks.items())

    with ThreadPoolExecutor(AT_A_TIME) as pool:
        return [place for place, damaged in enumerate(pool.map(is_damaged, digests)) if damaged]


def complete(path: Path, rest: xr.Dataset) -> None:
    """Add the attributes and variables that are known only at the end of a run, and consolidate the store's metadata.

    Unfinished files of chunks that killed processes left are removed.
    """
    import zarr

    rest.to_zarr(path, mode="a", consolidated=False, zarr_format=FORMAT)
    with warnings.catch_warnings():
        warnings.simplefilter("ignore")  # Zarr warns of files that are not arrays
        zarr.consolidate_metadata(path, zarr_format=FORMAT)
    for unfinished in path.rglob("*.partial"):
        unfinished.unlink(missing_ok=True)
    _sync_all(path, [str(name) for name in rest.variables])


def _sync_all(path: Path, arrays: list[str] | None = None) -> None:
    """Flush the metadata of a Zarr store and all files of the arrays to the disk (`arrays` None: of all arrays)."""
    folders = [each for each in path.iterdir() if each.is_dir() and (arrays is None or each.name in arrays)]
    for folder in (path, *folders):
        for file in folder.iterdir():
            if file.is_file():
                sync(file)
        sync_folder(folder)


def _files_in(path: Path) -> list[str]:
    return [file.relative_to(path).as_posix() for file in sorted(path.rglob("*")) if file.is_file()]


def _opened(path: Path) -> zarr.Group:
    import zarr

    return zarr.open_group(path, mode="r+", zarr_format=FORMAT)


def _array(group: zarr.Group, name: str) -> Any:
    return group[name]
