"""Writer of the results of each building of a region as GeoParquet, CSV, GeoJSON or netCDF."""

from __future__ import annotations

import os
from pathlib import Path
from typing import Any

import numpy as np
import pandas as pd
import xarray as xr

from warpdyn.answers.fragility.building_results import PROBABILITY, STANDARD_ERROR
from warpdyn.foundations.files import netcdf
from warpdyn.interfaces.exchange.regional import geojson, geoparquet
from warpdyn.interfaces.exchange.regional.building_table import checked_results
from warpdyn.interfaces.exchange.text_files import check_same_table, checked_path, write_in_place

_FUNCTION = geoparquet.FUNCTION
_MONEY = {"units": "1", "comment": "in the currency of replacement_cost"}
# netCDF attributes of the columns that warpdyn computes. The units of further columns of a user are not known.
_ATTRIBUTES: dict[str, dict[str, str]] = {
    "id": {"long_name": "id of the building in the inventory"},
    "longitude": {"long_name": "longitude", "standard_name": "longitude", "units": "degrees_east"},
    "latitude": {"long_name": "latitude", "standard_name": "latitude", "units": "degrees_north"},
    "storeys": {"long_name": "number of storeys", "units": "1"},
    "year": {"long_name": "year of construction", "units": "1"},
    "occupancy": {"long_name": "occupancy"},
    "structure_type": {"long_name": "structure type"},
    "plan_area": {"long_name": "area of the building's ground plan", "units": "m2"},
    "replacement_cost": {"long_name": "replacement cost of all buildings of the row", "units": "1"},
    "number": {"long_name": "number of buildings that the row represents", "units": "1"},
    "archetype": {"long_name": "name of the archetype"},
    "sample_count": {"long_name": "samples counted, collapsed ones included", "units": "1"},
    "failed_count": {"long_name": "samples excluded because their integration failed", "units": "1"},
    "expected_loss_ratio": {"long_name": "expected loss divided by replacement cost", "units": "1"},
    "loss_ratio_standard_deviation": {"long_name": "standard deviation of the loss ratio of a sample", "units": "1"},
    "expected_loss": {"long_name": "expected loss of all buildings of the row"} | _MONEY,
    "loss_standard_deviation": {"long_name": "standard deviation of the loss of a sample"} | _MONEY,
}


def write_building_results(results: pd.DataFrame, path: str | os.PathLike, *, overwrite: bool = False) -> Path:
    """Write the damage probabilities and losses of each building as GeoParquet, CSV, GeoJSON or netCDF.

    The ending of the file name selects the format:

    - ".parquet": GeoParquet 1.1 with points on WGS 84, for GIS programs, geopandas and pandas. This file is the
      smallest and the fastest to write.
    - ".csv": one row per row of the table, with the same columns.
    - ".geojson" (RFC 7946): one point per row of the table. The properties are the columns, with ten digits after the
      decimal point.
    - ".nc": netCDF with CF conventions and the dimensions `building` and `damage_state`.

    Args:
        results: Result of `building_results`, or some of its rows.
        path: Path of the file that is written. An existing netCDF file is replaced only if warpdyn wrote it.
        overwrite: If True, replace an existing CSV, Parquet or GeoJSON file of any content. If False, replace it only
            if it has the same columns.

    Returns:
        Path of the written file.

    Raises:
        ValueError: If the name has another ending, if the table lacks a column or a location, or if a value is
            impossible, such as a probability above 1.
        ImportError: If the file is GeoParquet and pyarrow is not installed.
        TypeError: If `results` is not a DataFrame.
        OSError: If the file cannot be written, or exists with other content and `overwrite` is False.

    Example:
        >>> path = wd.write_building_results(results, "buildings.parquet")
        >>> pd.read_parquet(path)["archetype"].tolist()
        ['W1 high 2', 'W1 moderate 2', 'C1L high 2']
    """
    path = checked_path(_FUNCTION, path, ".parquet", ".csv", ".geojson", ".nc")
    table, states = checked_results(_FUNCTION, results)
    suffix = path.suffix.lower()
    if suffix == ".nc":
        return netcdf.write(_dataset(table, states), path)
    if suffix == ".csv":
        check_same_table(_FUNCTION, path, table.columns, overwrite)
        return write_in_place(path, lambda name: table.to_csv(name, index=False, lineterminator="\n"))
    if suffix == ".geojson":
        properties = table.drop(columns=["longitude", "latitude"])
        check_same_table(_FUNCTION, path, properties.columns, overwrite)
        return write_in_place(path, lambda name: geojson.write_points(name, properties, table, {}))
    try:
        import pyarrow  # noqa: F401 # checked before anything is written
    except ImportError:
        raise ImportError(
            f'{_FUNCTION}: GeoParquet needs pyarrow, which is not installed: pip install "pyarrow>=17", or write CSV, '
            "GeoJSON or netCDF"
        ) from None
    if geoparquet.GEOMETRY in table:
        raise ValueError(
            f"{_FUNCTION}: GeoParquet needs the column name {geoparquet.GEOMETRY!r}, but the table has such a column: "
            "rename it by .rename(columns=...)"
        )
    check_same_table(_FUNCTION, path, [*table.columns, geoparquet.GEOMETRY], overwrite)
    return write_in_place(path, lambda name: geoparquet.write_points(name, table))


def _dataset(table: pd.DataFrame, states: list[str]) -> xr.Dataset:
    """Return the table of building results as a dataset with the dimensions building and damage_state."""
    of_states = {f"{kind}{state}" for kind in (PROBABILITY, STANDARD_ERROR) for state in states}
    variables: dict[str, Any] = {}
    for name in table.columns:
        if name not in of_states and name != "building":
            plain = str(name).replace("/", "_")  # netCDF does not allow "/" in names
            variables[plain] = ("building", _values(table[name]), _ATTRIBUTES.get(str(name), {"long_name": str(name)}))
    for name, kind, long_name in (
        ("damage_probability", PROBABILITY, "probability of being in the damage state"),
        ("damage_probability_standard_error", STANDARD_ERROR, "standard error of the probability"),
    ):
        values = table[[f"{kind}{state}" for state in states]].to_numpy()
        variables[name] = (("building", "damage_state"), values, {"long_name": long_name, "units": "1"})
    number = table["building"].to_numpy() if "building" in table else np.arange(len(table))
    coordinates = {
        "building": ("building", number, {"long_name": "number of the building in the portfolio", "units": "1"}),
        "damage_state": ("damage_state", np.array(states), {"long_name": "damage state"}),
    }
    coordinates |= {name: variables.pop(name) for name in ("longitude", "latitude")}
    about = {key: value for key, value in table.attrs.items() if isinstance(value, str)}
    attributes = netcdf.trace(about.pop("title", "damage of buildings"), _FUNCTION)
    before = f"{about.pop('history')}\n" if "history" in about else ""
    history = {"history": before + attributes["history"]}
    return xr.Dataset(variables, coordinates, about | attributes | history)


def _values(column: pd.Series) -> np.ndarray:
    """Return the values of a column in a type that netCDF can store; missing texts are written as ""."""
    if isinstance(column.dtype, pd.CategoricalDtype):
        names = np.append(column.cat.categories.astype(str).to_numpy(), "").astype(object)
        return names[column.cat.codes.to_numpy()]  # code -1: missing
    if column.dtype.kind in "iufbM":
        return column.to_numpy()
    return column.astype(object).where(column.notna(), "").astype(str).to_numpy(dtype=object)
