"""Coordinates of assets from a table of administrative units: the two tables are joined by the ids of units."""

from __future__ import annotations

import os
import re

import numpy as np
import pandas as pd

from warpdyn.foundations.core.messages import counted
from warpdyn.foundations.files.text import check_names, read_csv

# GEM's exposure files have the columns ID_0 (country), ID_1 (first level of administrative units) and so on.
UNIT_ID = re.compile(r"ID_\d", re.IGNORECASE)
LONGITUDES, LATITUDES = ("longitude", "lon", "long", "x"), ("latitude", "lat", "y")
LARGEST_ID = 2**53  # floating-point numbers represent all whole numbers up to this number exactly


def with_places(what: str, table: pd.DataFrame, places: pd.DataFrame | str | os.PathLike) -> pd.DataFrame:
    """Return a table of assets with the longitudes and latitudes of their administrative units.

    Args:
        what: Name of the file of assets, for errors.
        table: The assets.
        places: A table, or its CSV file, with one row per administrative unit: longitude and latitude [degree], and ids
            in columns ID_0, ID_1 and so on (in upper or lower case). Columns with the same name in both tables are
            compared.

    Returns:
        The table with additional columns `lon` and `lat`.

    Raises:
        ValueError: If no column of ids is in both tables, an id is missing, `places` lacks a unit or has it twice, or a
            longitude or latitude is out of range.
        TypeError: If `places` is neither a table nor a path.
    """
    if isinstance(places, str | os.PathLike):
        source, found = str(places), read_csv(places)
    elif isinstance(places, pd.DataFrame):
        source, found = "places", places
    else:
        raise TypeError(f"{what}: places must be a pandas DataFrame or the path of a CSV file, got {places!r}")
    check_names(found.columns, f"{source}: ")
    names = {str(name).strip().lower(): name for name in found.columns}
    own = {str(name).strip().lower(): name for name in table.columns}
    keys = sorted(name for name in own if UNIT_ID.fullmatch(name) and name in names)
    if not keys:
        raise ValueError(
            f"{what}: the assets have the columns {', '.join(map(str, table.columns))} and {source} has "
            f"{', '.join(map(str, found.columns))}: both need a column of ids with the same name, such as ID_1"
        )
    longitude, latitude = (_place_column(source, names, each) for each in (LONGITUDES, LATITUDES))
    values = [pd.to_numeric(found[name], errors="coerce").to_numpy(np.float64) for name in (longitude, latitude)]
    bad = ~((np.abs(values[0]) <= 180) & (np.abs(values[1]) <= 90))
    if bad.any():
        row = int(bad.argmax())
        raise ValueError(
            f"{source}: {bad.sum():,} of {len(found):,} rows have no place on Earth, the first is row {row} with "
            f"longitude {found[longitude].iloc[row]} and latitude {found[latitude].iloc[row]}: longitudes must be "
            "from -180 to 180 degrees, latitudes from -90 to 90. Correct these rows"
        )
    of_units = _joined(source, found, [names[key] for key in keys])
    if not of_units.is_unique:
        twice = of_units[of_units.duplicated()].iloc[0]
        raise ValueError(
            f"{source}: the unit {twice!r} of {', '.join(keys).upper()} has two rows: remove one of these rows"
        )
    of_assets = _joined(what, table, [own[key] for key in keys])
    row = pd.Index(of_units).get_indexer(of_assets)
    if np.any(row < 0):
        unknown = counted([repr(each) for each in of_assets[row < 0].unique()])
        raise ValueError(
            f"{what}: {source} has no row for {unknown} units of {', '.join(keys).upper()}, with "
            f"{np.sum(row < 0):,} of {len(table):,} assets: add these rows"
        )
    return table.assign(lon=values[0][row], lat=values[1][row])


def _joined(what: str, table: pd.DataFrame, columns: list) -> pd.Series:
    """Return the ids in several columns as one text per row, joined by "/". The number 11.0 becomes "11"."""
    texts = []
    for name in columns:
        values = table[name]
        missing = values.isna().to_numpy()
        if missing.any():
            raise ValueError(
                f"{what}: {missing.sum():,} of {len(table):,} rows have no {name}, the first is row "
                f"{int(missing.argmax())}, so that their coordinates are unknown. Add the ids, or remove these rows"
            )
        if pd.api.types.is_float_dtype(values):
            known = values.dropna()
            if ((known == np.floor(known)) & (known.abs() < LARGEST_ID)).all():
                values = values.astype("Int64")
        texts.append(values.astype(str).str.strip())
    whole = texts[0]
    for each in texts[1:]:
        whole = whole + "/" + each
    return whole.reset_index(drop=True)


def _place_column(source: str, names: dict[str, object], known: tuple[str, ...]) -> object:
    """Return the name of the first column that is in `known`, such as "lon"; raise a ValueError without a match."""
    for name in known:
        if name in names:
            return names[name]
    raise ValueError(
        f"{source}: there is no column {known[0]!r}; the columns are {', '.join(map(str, names.values()))}. "
        "Rename or add the column"
    )
