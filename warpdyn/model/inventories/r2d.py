"""Inventories of SimCenter's R2D tool: CSV and GeoJSON files."""

from __future__ import annotations

import json
import os
from collections.abc import Mapping
from typing import Any

import numpy as np
import pandas as pd

from warpdyn.foundations.core.checks import one_of
from warpdyn.foundations.core.messages import counted, warn_caller
from warpdyn.foundations.files.text import check_names, existing_file, read_csv
from warpdyn.model.inventories.table import FACTORS, checked_inventory, names_of_columns

# R2D's names of the columns (SimCenter, R2D user manual, "Asset Definition": buildings).
R2D_NAMES = {
    "id": "id",
    "longitude": "Longitude",
    "latitude": "Latitude",
    "storeys": "NumberOfStories",
    "year": "YearBuilt",
    "occupancy": "OccupancyClass",
    "structure_type": "StructureType",
    "plan_area": "PlanArea",
    "replacement_cost": "ReplacementCost",
}
FARTHEST = 1000.0  # m, allowed distance between a building's coordinates and its footprint; footprints are smaller
METRES_OF_DEGREE = 111_195.0  # m per degree of a great circle
ASSET_ID = "AIM_id"  # column of ids in result files of R2D


def read_r2d(
    path: str | os.PathLike, *, area_unit: str = "ft2", columns: Mapping[str, str] | None = None
) -> pd.DataFrame:
    """Read a CSV file of buildings for SimCenter's R2D tool.

    Args:
        path: The file, with columns `id`, `Latitude`, `Longitude` and, optionally, `NumberOfStories`, `YearBuilt`,
            `OccupancyClass`, `StructureType`, `PlanArea` and `ReplacementCost`, in upper or lower case. All other
            columns are kept.
        area_unit: Unit of `PlanArea`, which the file does not contain: "ft2", as in SimCenter's examples, or "m2". A
            column `plan_area`, as in files that `write_building_results` wrote, is always in m2.
        columns: Meaning -> name of the column in the file, as in `from_table`.

    Returns:
        The inventory, as from `from_table`, with `plan_area` in m2.

    Raises:
        ValueError, FileNotFoundError: As in `from_table`, with the file's name; or if the file does not exist.
        TypeError, IsADirectoryError: If `path` is not text or a Path, or is a folder.

    Example:
        >>> inventory = wd.inventories.read_r2d("buildings.csv")
        >>> inventory["plan_area"].round(1).tolist()  # m2
        [92.9, 185.8]
    """
    one_of("area_unit", area_unit, tuple(FACTORS))
    return _inventory(
        str(path), read_csv(existing_file("read_r2d", path)), area_unit, {} if columns is None else columns
    )


def read_geojson(
    path: str | os.PathLike, *, area_unit: str = "ft2", columns: Mapping[str, str] | None = None
) -> pd.DataFrame:
    """Read a GeoJSON file (RFC 7946) of buildings from SimCenter's R2D tool or BRAILS.

    The id of a building is the property `id`, or `AIM_id` as in R2D's results, or the id of the feature. The
    coordinates are the properties `Latitude` and `Longitude`. If these are missing, or more than 1 km away from the
    geometry, they are replaced by the coordinates of the point, or by the mean of the corners of the polygon's outer
    ring. A warning gives the number of these buildings, and reports if longitude and latitude are exchanged in the
    properties.

    Args:
        path: The file, a FeatureCollection of points or polygons; the properties have the names of columns in
            `read_r2d`.
        area_unit: Unit of the property `PlanArea`: "ft2" or "m2". A property `plan_area` is always in m2.
        columns: Meaning -> name of the property in the file, as in `from_table`.

    Returns:
        The inventory, as from `from_table`, without the polygons.

    Raises:
        ValueError, TypeError, OSError: As in `read_r2d`; or if the file is not a FeatureCollection, or coordinates are
            not in degrees.

    Example:
        >>> inventory = wd.inventories.read_geojson("AnchorageBuildings.geojson")
        >>> inventory["structure_type"].tolist()
        ['W1']
    """
    one_of("area_unit", area_unit, tuple(FACTORS))
    with open(existing_file("read_geojson", path), encoding="utf-8-sig") as file:
        try:
            told = json.load(file)
        except (json.JSONDecodeError, UnicodeDecodeError) as error:
            raise ValueError(f"{path} is not JSON: {error}. Export the file again, or correct it") from None
    features = told.get("features") if isinstance(told, dict) else None
    if not isinstance(features, list) or not all(isinstance(each, dict) for each in features):
        raise ValueError(
            f"{path}: there is no list of features: the file must contain a FeatureCollection: export it again"
        )
    _check_degrees(path, told)
    table = pd.DataFrame.from_records([each.get("properties") or {} for each in features])
    check_names(table.columns, f"{path}: of the properties, ")
    names = {str(name).lower(): str(name) for name in table.columns}
    if "id" not in names and ASSET_ID.lower() not in names:
        table["id"] = [each.get("id") for each in features]
    columns = columns or {}
    own = [columns.get(name, names.get(name)) for name in ("longitude", "latitude")]
    if None in own or not set(own) <= set(table.columns):
        places = np.array([_place(path, number, each.get("geometry")) for number, each in enumerate(features)])
        table["Longitude"], table["Latitude"] = places.reshape(-1, 2).T
    else:
        _move_to_geometry(path, table, own, features)
    return _inventory(str(path), table, area_unit, columns)


def _move_to_geometry(path: object, table: pd.DataFrame, names: list, features: list[dict]) -> None:
    """Correct the coordinates of buildings in `table` from their geometries, and warn.

    Coordinates are corrected if they are missing, or more than FARTHEST away from the building's geometry.
    """
    has_geometry = np.array([isinstance(each.get("geometry"), dict) for each in features])
    if not has_geometry.any():
        return
    drawn = np.full((len(features), 2), np.nan)
    for number in np.flatnonzero(has_geometry).tolist():
        drawn[number] = _place(path, number, features[number]["geometry"])
    told = np.stack([pd.to_numeric(table[name], errors="coerce").to_numpy(np.float64) for name in names], axis=1)
    with np.errstate(invalid="ignore"):
        is_far = _far_apart(told, drawn)
    is_missing = np.isnan(told).any(axis=1) & has_geometry
    if is_far.any():
        is_exchanged = bool(np.all(~_far_apart(told[is_far][:, ::-1], drawn[is_far])))
        cause = "longitude and latitude are exchanged in the properties" if is_exchanged else "the properties are wrong"
        warn_caller(
            f"{path}: of {len(table):,} buildings {_some_ids(table, is_far)} have {names[0]} and {names[1]} more than "
            f"{FARTHEST / 1000:g} km away from their geometries: {cause}. The coordinates of the geometries are used; "
            "correct the properties if those are wrong"
        )
    if is_missing.any():
        warn_caller(
            f"{path}: of {len(table):,} buildings {_some_ids(table, is_missing)} have no number as {names[0]} or "
            f"{names[1]}: the coordinates of their geometries are used. No action is needed if the geometries are right"
        )
    for axis, name in enumerate(names):
        table[name] = np.where(is_far | is_missing, drawn[:, axis], told[:, axis])


def _some_ids(table: pd.DataFrame, chosen: np.ndarray) -> str:
    """Return the number of the buildings in the mask `chosen` and the ids of the first ones, as text."""
    ids = table["id"] if "id" in table else pd.Series(np.arange(len(table)))
    return counted([repr(each) for each in ids[chosen]])


def _far_apart(one: np.ndarray, other: np.ndarray) -> np.ndarray:
    """Return whether the two places of each building are more than FARTHEST apart, shape [building]; False for NaN.

    Places are longitudes and latitudes [degree], shape [building, 2].
    """
    north = one[:, 1] - other[:, 1]
    east = (one[:, 0] - other[:, 0] + 180) % 360 - 180
    return np.hypot(north, east * np.cos(np.radians(other[:, 1]))) * METRES_OF_DEGREE > FARTHEST


def _inventory(what: str, table: pd.DataFrame, area_unit: str, columns: Mapping[str, str]) -> pd.DataFrame:
    """Return the inventory from a table whose columns have the names that R2D uses, or the names in `columns`."""
    names = {str(name).lower(): name for name in table.columns}
    known = {meaning: names[name.lower()] for meaning, name in R2D_NAMES.items() if name.lower() in names}
    if "id" not in names and ASSET_ID.lower() in names:
        known["id"] = names[ASSET_ID.lower()]
    for meaning in ("id", "longitude", "latitude"):
        known.setdefault(meaning, R2D_NAMES[meaning])  # the error about a missing column then gives the name in R2D
    source = known | names_of_columns(what, columns)
    inventory = checked_inventory(what, table, source)
    # A column that is named plan_area in the file is in m2 already.
    if "plan_area" in inventory and source.get("plan_area", "plan_area") != "plan_area":
        inventory["plan_area"] *= FACTORS[area_unit]
    return inventory


def _check_degrees(path: object, told: Mapping[str, Any]) -> None:
    """Raise a ValueError if the file states another coordinate system than WGS 84, which RFC 7946 requires."""
    named = told.get("crs") or {}
    name = str((named.get("properties") or {}).get("name", "")) if isinstance(named, dict) else ""
    if name and not name.endswith(("CRS84", ":4326")):
        raise ValueError(
            f"{path}: its coordinate system is {name!r}, but coordinates must be longitudes and latitudes in degrees: "
            "convert the file to CRS84 (EPSG:4326)"
        )


def _place(path: object, number: int, geometry: Any) -> tuple[float, float]:
    """Return the longitude and latitude [degree] of a point, or the mean of the corners of a polygon's outer ring."""
    kind = geometry.get("type") if isinstance(geometry, dict) else None
    try:
        if kind == "Point":
            longitude, latitude = geometry["coordinates"][:2]
            return float(longitude), float(latitude)
        if kind in ("Polygon", "MultiPolygon"):
            rings = geometry["coordinates"] if kind == "Polygon" else geometry["coordinates"][0]
            corners = np.array([corner[:2] for corner in rings[0]], dtype=np.float64)[:-1]  # the last is the first
            return float(corners[:, 0].mean()), float(corners[:, 1].mean())
    except (LookupError, TypeError, ValueError):
        kind = f"an invalid {kind}"
    raise ValueError(
        f"{path}: feature {number} needs the properties Latitude and Longitude, or a Point or Polygon as geometry; it "
        f"has {kind or 'no geometry'}: add coordinates to the feature"
    )
