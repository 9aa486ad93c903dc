"""Readers for the command `warpdyn`: scenes and ground motions from files, and results of runs from their files."""

from __future__ import annotations

import json
from collections.abc import Sequence
from pathlib import Path
from typing import Any

import xarray as xr

import warpdyn as wd
from warpdyn.foundations.core.checks import in_words
from warpdyn.foundations.files.unfinished import STORE_SUFFIX

SETS = {"far_field": wd.records.far_field, "near_field": wd.records.near_field}
LARGEST_SCENE = 2**26  # bytes; a scene of 100,000 scattered values has 2 MB
NO_FILE = "there is no such file: correct the path"


def read_scene(path: Path, motions: Sequence[str], unit: str | None, step: float | None) -> wd.Scene:
    """Read the JSON file of a scene with its ground motions, and return the scene.

    Args:
        path: JSON file that contains the text of `Scene.to_json()`.
        motions: Files and directories with the ground motions of the scene, or names of record sets (keys of SETS).
        unit: Unit of the accelerations, such as "g", for record files that do not state their unit; None: every file
            states it.
        step: Time step [s] for record files that do not state it; None: every file states it.

    Raises:
        ValueError: If the file is not a scene, or a motion of the scene is missing. The message begins with the path.
        OSError: If a file does not exist or cannot be read.
    """
    if not path.is_file():
        raise FileNotFoundError(
            f"{path}: {'this is a directory: give the file with the scene' if path.is_dir() else NO_FILE}"
        )
    if path.stat().st_size > LARGEST_SCENE:
        raise ValueError(
            f"{path} has {in_words(path.stat().st_size)}, too much for a scene: give the file with the text of "
            "Scene.to_json()"
        )
    try:
        text = path.read_text(encoding="utf-8-sig")
    except UnicodeDecodeError:
        raise ValueError(f"{path} is not a text file: give the file with the text of Scene.to_json()") from None
    needed = _motions_in(text)
    given = [motion for name in motions for motion in read_motions(name, unit, step)]
    if needed and not given:
        raise ValueError(
            f"{path}: the scene needs {needed} ground motions, which the JSON does not contain: add --motions with "
            "their files or directories"
        )
    try:
        return wd.Scene.from_json(text, given)
    except (ValueError, TypeError) as error:
        words = str(error).replace("from_json(): ", "").replace("give motions= that", "give --motions with files that")
        raise ValueError(f"{path}: {words}") from error
    except (LookupError, AttributeError, ArithmeticError, RecursionError) as error:  # JSON with another structure
        raise ValueError(
            f"{path}: the JSON is not a scene as Scene.to_json() writes it ({type(error).__name__}: {error}): write it "
            "again by Scene.to_json()"
        ) from error


def _motions_in(text: str) -> int:
    """Return the number of different ground motions that the JSON text of a scene names; 0 if the text is not JSON."""
    digests: set[str] = set()

    def collected(told: dict[str, Any]) -> dict[str, Any]:
        if {"name", "step", "samples"} <= told.keys() and "components" not in told:  # a pair counts as its components
            digests.add(str(told.get("digest")))
        return told

    try:
        json.loads(text, object_hook=collected)
    except (ValueError, RecursionError):
        return 0
    return len(digests)


def read_motions(name: str, unit: str | None, step: float | None) -> list[wd.GroundMotion]:
    """Return a list of ground motions.

    `name` is a record set (a key of SETS), a netCDF file, a record file, an archive, or a directory of record files.
    """
    if name in SETS:
        return SETS[name]()
    path = Path(name)
    if path.is_dir():
        return wd.records.read_directory(path, "*", "all", unit, step)
    if not path.is_file():
        raise FileNotFoundError(f"{name}: {NO_FILE}, or give one of {', '.join(SETS)}")
    if path.suffix.lower() == ".nc":
        with read_dataset(path) as data:
            try:
                return wd.records.from_dataset(data.load())
            except ValueError as error:
                raise ValueError(f"{name}: {error}") from error
    return wd.records.read(path, unit=unit, step=step)


def read_dataset(path: Path) -> xr.Dataset:
    """Open the file of a run, a netCDF file or a Zarr store, and return its dataset.

    Raises:
        ValueError: If the file is not a netCDF file, or the directory is not a Zarr store.
        OSError: If there is no such file.
    """
    is_store = path.name.endswith(STORE_SUFFIX)
    if not path.exists():
        raise FileNotFoundError(f"{path}: {NO_FILE}")
    if path.is_dir() and not is_store:
        raise ValueError(f"{path} is a directory: give the netCDF file or Zarr store of a run")
    try:
        return xr.open_zarr(path) if is_store else xr.open_dataset(path, engine="netcdf4")
    except Exception as error:  # readers raise errors of many classes for files of other formats
        kind = "Zarr store" if is_store else "netCDF file"
        raise ValueError(
            f"{path} cannot be read as a {kind} ({type(error).__name__}: {error}): give the file of --out or of "
            "simulate(path=...)"
        ) from error
