"""SimCenter's EventGrid.csv: a grid of stations, each with a file of its motions or of its intensities."""

from __future__ import annotations

import csv
import json
import os
import re
from pathlib import Path

import numpy as np
import xarray as xr

from warpdyn.files.text import existing_file
from warpdyn.ground_motions.motions import GroundMotion
from warpdyn.ground_motions.records.units import unit_factor
from warpdyn.inventories.text_tables import read_csv
from warpdyn.sites.intensity_fields import field_dataset
from warpdyn.sites.motion_grid import MotionGrid

MOTIONS, GRID_COLUMNS = "TH_file", ("GP_file", "Longitude", "Latitude")
MOST_SHOWN = 3
_SPECTRAL = re.compile(r"P?SA[_( ]*(\d+(?:\.\d+)?) *s?\)?", re.IGNORECASE)


def read_event_grid(path: str | os.PathLike, unit: str) -> MotionGrid:
    """Read the motions at the points of a grid, as SimCenter's R2D tool takes them.

    The folder holds EventGrid.csv (columns `GP_file`, `Longitude`, `Latitude`), the file of each point that it names
    (columns `TH_file` and, if factors are not 1, `factor`, a row for each earthquake), and each motion as
    `<TH_file>.json` with `dT` [s], `data_x` and, if both components are known, `data_y`. Every point has as many rows:
    row `i` of every point is of earthquake `i` (in SimCenter's own draws, too). Other columns of the grid, such as
    Vs30, are not used; SimCenter takes for a building that has such a property only the points that agree with it.

    Args:
        path: EventGrid.csv, or its folder.
        unit: Unit of the accelerations, which the files do not say: one of `records.UNITS`, such as "g".

    Returns:
        The grid of motions, each motion held once however many points have it.

    Raises:
        ValueError: If a column is missing, points have no file or no motions (the message counts and names them), their
            numbers of rows differ, a factor is not finite and above 0, or a motion's file is not as it should be.
        FileNotFoundError: If there is no such EventGrid.csv.
        TypeError: If the path is none.

    Example:
        >>> grid = wd.sites.read_event_grid("records/EventGrid.csv", unit="g")
        >>> design = grid.at(inventory, stock, draws=25, neighbours=2, reach=20e3, seed=1)
        >>> design.samples_per_structure
        25
    """
    file, names, places, rows = _read_stations("read_event_grid", path)
    if rows[0] and MOTIONS not in rows[0][0]:
        raise ValueError(
            f"{file}: {names[0]} has no column {MOTIONS!r}, as files of intensities have none: take read_intensity_grid"
        )
    factor = unit_factor(unit, str(file))
    found: dict[str, int] = {}
    motions: list[list[GroundMotion]] = []
    record, scale = np.zeros((len(rows), len(rows[0])), np.int32), np.ones((len(rows), len(rows[0])))
    missing: list[str] = []
    for point, of_point in enumerate(rows):
        for earthquake, row in enumerate(of_point):
            name = row.get(MOTIONS) or ""
            if name not in found:
                found[name] = len(motions)
                source = file.parent / f"{name}.json"
                if source.is_file():
                    motions.append(_read_motion(source, name, factor))
                else:
                    missing.append(f"{name!r} of {names[point]}")
                    motions.append([])
            record[point, earthquake] = found[name]
            where = f"{file.parent / names[point]}, row {earthquake + 1}: factor"
            scale[point, earthquake] = _number(where, row.get("factor") or "1", above=0)
    if missing:
        raise ValueError(
            f"{file}: {_told(missing)} of {len(found):,} motions have no file <{MOTIONS}>.json in its folder"
        )
    components = len(motions[0])
    if any(len(each) != components for each in motions):
        raise ValueError(f"{file}: some motions have one component and others two: give all of them both, or one")
    motion = record[:, :, None] * components + np.arange(components, dtype=np.int32)
    same = (record == record[:1]).all(axis=0)
    earthquakes = [rows[0][i][MOTIONS] if same[i] else str(i) for i in range(record.shape[1])]
    flat = [each for both in motions for each in both]
    both = np.broadcast_to(scale[:, :, None], motion.shape)
    return MotionGrid(*places, flat, motion, both, names, earthquakes)


def read_intensity_grid(path: str | os.PathLike, unit: str = "g") -> xr.Dataset:
    """Read the intensities at the points of a grid, as SimCenter's R2D tool takes them.

    The folder is as `read_event_grid` says, but the files of the points have a column for each intensity measure, such
    as `PGA` or `SA(0.3)` (also written `SA_0.3`), a row for each earthquake, and there are no motions.

    Args:
        path: EventGrid.csv, or its folder.
        unit: Unit of the accelerations, one of `records.UNITS`.

    Returns:
        Dataset with the fields `PGA`, `SA(0.3)` and so on (earthquake, point) in g, and the coordinates `longitude` and
        `latitude`; `scale_records` takes one of them. Measures that are no acceleration are as the file has them,
        without a unit.

    Raises:
        ValueError, TypeError, FileNotFoundError: As of `read_event_grid`.

    Example:
        >>> field = wd.sites.read_intensity_grid("intensities/EventGrid.csv")["SA(1.0)"]
        >>> field.dims, field.attrs["units"]
        (('earthquake', 'point'), 'g')
    """
    file, names, (longitude, latitude), rows = _read_stations("read_intensity_grid", path)
    columns = [str(name) for name in rows[0][0]]
    if MOTIONS in columns:
        raise ValueError(f"{file}: {names[0]} has the column {MOTIONS!r}: take read_event_grid, which reads motions")
    factor = unit_factor(unit, str(file)) / unit_factor("g", "")
    fields = {}
    for column in columns:
        values = np.array(
            [
                [_number(f"{name}, row {i + 1}: {column}", row.get(column) or "") for i, row in enumerate(of_point)]
                for name, of_point in zip(names, rows, strict=True)
            ]
        )
        spectral = _SPECTRAL.fullmatch(column.strip())
        measure = f"SA({float(spectral[1])})" if spectral else column.strip()
        is_acceleration = bool(spectral) or measure == "PGA"
        fields[measure] = (values.T * factor, "g") if is_acceleration else (values.T, "")
    return field_dataset(longitude, latitude, fields, names)


def _read_stations(
    function: str,
    path: str | os.PathLike,
) -> tuple[Path, list[str], tuple[np.ndarray, np.ndarray], list[list[dict[str, str]]]]:
    """Return the grid's file, the names and places of its points, and the rows of each point's file."""
    is_folder = isinstance(path, str | os.PathLike) and os.fspath(path) != "" and Path(path).is_dir()
    file = existing_file(function, Path(path) / "EventGrid.csv" if is_folder else path)
    table = read_csv(file)
    for name in GRID_COLUMNS:
        if name not in table:
            raise ValueError(f"{file}: there is no column {name!r}; the columns are {', '.join(table.columns)}")
    if not len(table):
        raise ValueError(f"{file}: there is no grid point in it")
    unnamed = [f"row {row + 1}" for row in np.flatnonzero(table["GP_file"].isna())]
    if unnamed:
        raise ValueError(f"{file}: {_told(unnamed)} of {len(table):,} grid points have no GP_file")
    names = table["GP_file"].astype(str).tolist()
    places = tuple(
        np.array([_number(f"{file}: {name} of {of}", each) for of, each in zip(names, table[name], strict=True)])
        for name in GRID_COLUMNS[1:]
    )
    missing = [name for name in names if not (file.parent / name).is_file()]
    if missing:
        raise ValueError(f"{file}: {_told(missing)} of {len(names):,} grid points have no file")
    read = {name: _rows_of_station(file.parent / name) for name in dict.fromkeys(names)}
    empty = [name for name, rows in read.items() if not rows]
    if empty:
        raise ValueError(f"{file}: {_told(empty)} of {len(names):,} grid points have no motions in their file")
    counts = {name: len(rows) for name, rows in read.items()}
    others = [name for name, count in counts.items() if count != counts[names[0]]]
    if others:
        raise ValueError(
            f"{file}: {names[0]} has {counts[names[0]]} rows, and {_told(others)} of {len(names):,} points have other "
            "numbers: each point has a row for each earthquake"
        )
    return file, names, (places[0], places[1]), [read[name] for name in names]


def _rows_of_station(path: Path) -> list[dict[str, str]]:
    # Not pandas, which takes a millisecond for each of thousands of such files.
    with open(path, encoding="utf-8-sig", newline="") as file:
        reader = csv.DictReader(file, skipinitialspace=True)
        rows = list(reader)
    if any(None in row for row in rows):
        raise ValueError(f"{path}: a row has more values than there are columns")
    return rows


def _read_motion(path: Path, name: str, factor: float) -> list[GroundMotion]:
    """Return the components of a motion."""
    try:
        told = json.loads(path.read_text(encoding="utf-8-sig"))
        step = told["dT"]
        values = {"x": told["data_x"]} | ({"y": told["data_y"]} if "data_y" in told else {})
    except (json.JSONDecodeError, KeyError, TypeError) as error:
        raise ValueError(f"{path} must be JSON with dT and data_x: {error!r}") from None
    return [  # components of one record may be of different lengths
        GroundMotion(factor * np.asarray(each, dtype=np.float64), step, f"{name} {axis}", str(path), name, axis)
        for axis, each in values.items()
    ]


def _number(what: str, word: object, above: float | None = None) -> float:
    try:
        value = float(str(word))
    except ValueError:
        value = np.nan
    if not np.isfinite(value) or (above is not None and value <= above):
        bound = "" if above is None else f" above {above:g}"
        raise ValueError(f"{what} must be a finite number{bound}, got {word!r}")
    return value


def _told(names: list[str]) -> str:
    """Return a number of names and some of them."""
    return f"{len(names):,} ({', '.join(names[:MOST_SHOWN])}{', ...' if len(names) > MOST_SHOWN else ''})"
