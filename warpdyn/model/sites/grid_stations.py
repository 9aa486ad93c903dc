"""Stations (grid points) of SimCenter's EventGrid.csv: coordinates, and the rows of the file of each station."""

from __future__ import annotations

import csv
import os
import re
from pathlib import Path

import numpy as np
import pandas as pd

from warpdyn.foundations.core.messages import counted, warn_caller
from warpdyn.foundations.files.text import check_names, check_separator, existing_file, inside_folder, read_csv
from warpdyn.model.ground_motions.records.units import unit_factor
from warpdyn.model.inventories.table import no_column
from warpdyn.model.sites.places import check_degrees

MOTIONS, GRID_COLUMNS = "TH_file", ("GP_file", "Longitude", "Latitude")
MISSING = ("", "nan", "na", "n/a", "null")  # texts of cells without a number


def read_stations(
    function: str,
    path: str | os.PathLike,
) -> tuple[Path, list[str], tuple[np.ndarray, np.ndarray], list[list[dict[str, str]]]]:
    """Return the names, coordinates and rows of the grid points of EventGrid.csv, from it and the files of the points.

    Args:
        function: Name of the public function, for messages.
        path: EventGrid.csv, or its folder.

    Returns:
        The path of EventGrid.csv, the names of the points, (longitudes, latitudes) [degree], each of shape [point], and
        the rows of the file of each point.
    """
    is_folder = isinstance(path, str | os.PathLike) and os.fspath(path) != "" and Path(path).is_dir()
    file = existing_file(function, Path(path) / "EventGrid.csv" if is_folder else path)
    table = read_csv(file)
    for name in GRID_COLUMNS:
        if name not in table:
            raise no_column(str(file), name, table)
    if not len(table):
        raise ValueError(f"{file} contains no grid point: it needs at least one row below the names of the columns")
    unnamed = [f"row {row + 1}" for row in np.flatnonzero(table["GP_file"].isna())]
    if unnamed:
        raise ValueError(
            f"{file}: {counted(unnamed)} of {len(table):,} grid points have no GP_file: name a file in each row"
        )
    names = table["GP_file"].astype(str).tolist()
    places = [
        np.array(
            [number_of_station(f"{file}: {name} of {of}", each) for of, each in zip(names, table[name], strict=True)]
        )
        for name in GRID_COLUMNS[1:]
    ]
    twice = pd.DataFrame({"name": names, "lon": places[0], "lat": places[1]}).duplicated().to_numpy()
    if twice.any():
        raise ValueError(f"{file}: the grid point {names[int(twice.argmax())]} has two rows: remove one of them")
    kept = ~(np.isnan(places[0]) | np.isnan(places[1]))
    warn_of_points_left_out(file, names, kept, "no longitude or latitude")
    names = [name for name, is_kept in zip(names, kept, strict=True) if is_kept]
    longitude, latitude = (each[kept] for each in places)
    check_degrees(str(file), longitude, latitude)
    files = {name: inside_folder(file.parent, name, str(file)) for name in dict.fromkeys(names)}
    missing = [name for name in names if not files[name].is_file()]
    if missing:
        raise ValueError(
            f"{file}: for {counted(missing)} of {len(names):,} grid points the file that GP_file names does "
            "not exist: add the files, or remove these rows"
        )
    read = {name: _rows_of_station(source) for name, source in files.items()}
    empty = [name for name, rows in read.items() if not rows]
    if empty:
        raise ValueError(
            f"{file}: {counted(empty)} of {len(names):,} grid points have no motions in their "
            "file: add motions, or remove these rows"
        )
    counts = {name: len(rows) for name, rows in read.items()}
    others = [name for name, count in counts.items() if count != counts[names[0]]]
    if others:
        raise ValueError(
            f"{file}: {names[0]} has {counts[names[0]]} rows, but {counted(others)} of {len(names):,} points have "
            "other numbers of rows: the file of each point needs one row per earthquake. Complete the files"
        )
    return file, names, (longitude, latitude), [read[name] for name in names]


def warn_of_points_left_out(file: Path, names: list[str], kept: np.ndarray, why: str) -> None:
    """Warn that points are left out because they have `why`, such as "no longitude"; if all have, raise a ValueError.

    Args:
        file: EventGrid.csv, for the message.
        names: Names of the points.
        kept: Whether each point is used, shape [point].
        why: The reason in words, such as "no longitude or latitude".
    """
    if kept.all():
        return
    left = [name for name, is_kept in zip(names, kept, strict=True) if not is_kept]
    if not kept.any():
        raise ValueError(f"{file}: all of {len(names):,} grid points ({names[0]}, ...) have {why}: complete the file")
    warn_caller(
        f"{file}: {counted(left)} of {len(names):,} grid points have {why} and are left out: buildings near them get "
        "motions of other points"
    )


def _rows_of_station(path: Path) -> list[dict[str, str]]:
    # The csv module is used instead of pandas, which needs 1 ms for each of thousands of such files.
    with open(path, encoding="utf-8-sig", newline="") as file:
        reader = csv.DictReader(file, skipinitialspace=True)
        try:
            reader.fieldnames = [name.strip() for name in reader.fieldnames or ()]
            check_separator(reader.fieldnames[0] if len(reader.fieldnames) == 1 else ",")
            check_names(reader.fieldnames)
            rows = list(reader)
        except (UnicodeDecodeError, ValueError, csv.Error) as error:
            raise ValueError(f"{path}: {error}") from None
    if any(None in row for row in rows):
        raise ValueError(f"{path}: a row has more values than there are columns: correct this row")
    return rows


def number_of_station(what: str, word: object, *, above: float | None = None, least: float | None = None) -> float:
    """Return the number in a cell, NaN if it is empty; raise a ValueError if it is not a number or out of bounds."""
    text = str(word).strip()
    try:
        value = np.nan if text.lower() in MISSING else float(text)
    except ValueError:
        value = np.inf
    if np.isinf(value) or (above is not None and value <= above) or (least is not None and value < least):
        bound = f" above {above:g}" if above is not None else "" if least is None else f" of at least {least:g}"
        raise ValueError(f"{what} must be a finite number{bound}, got {word!r}: correct the file")
    return value


def acceleration_factor(unit: str, where: str) -> float:
    """Return the factor from a unit of acceleration to m/s2. The unit may be written as in R2D, such as "inps2"."""
    return unit_factor(re.sub(r"^([a-z]+)ps2$", r"\1/s2", str(unit).strip(), flags=re.IGNORECASE), where)
