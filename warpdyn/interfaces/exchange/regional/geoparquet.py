"""Writer of points as GeoParquet 1.1: Parquet with a column of geometries and metadata that describe it."""

from __future__ import annotations

import json

import numpy as np
import pandas as pd

from warpdyn.interfaces.exchange.regional.building_table import parts_of

FUNCTION = "write_building_results"
VERSION, GEOMETRY = "1.1.0", "geometry"
LOOKED_AT = 10_000  # number of rows in which repeated values are counted
# A point in well-known binary (OGC 06-103r4): byte order (little-endian), type 1, and two coordinates.
POINT = np.dtype([("order", "u1"), ("type", "<u4"), ("x", "<f8"), ("y", "<f8")])


def write_points(name: str, table: pd.DataFrame) -> None:
    """Write a table with locations as GeoParquet.

    Args:
        name: The file.
        table: The table, with columns `longitude` and `latitude` [degree].

    Raises:
        ValueError: If a column contains values of several types, such as text and numbers.
    """
    import pyarrow as pa
    import pyarrow.parquet as pq

    low, high = ([float(edge(table[column])) for column in ("longitude", "latitude")] for edge in (np.min, np.max))
    # Without a `crs`, coordinates are longitude and latitude on WGS 84 (OGC:CRS84) by the specification.
    column = {"encoding": "WKB", "geometry_types": ["Point"], "bbox": [*low, *high]}
    geo = {"version": VERSION, "primary_column": GEOMETRY, "columns": {GEOMETRY: column}}
    plain = _converted(table)
    said = (plain.schema.metadata or {}) | {
        b"geo": json.dumps(geo).encode(),
        b"PANDAS_ATTRS": json.dumps(table.attrs).encode(),
    }
    schema = plain.schema.append(pa.field(GEOMETRY, pa.binary(), nullable=False)).with_metadata(said)
    # Use dictionary encoding only for columns with many repeated values; for others it takes time and saves nothing.
    few = [column for column in table if table[column].iloc[:LOOKED_AT].nunique() <= LOOKED_AT / 10]
    first = 0
    with pq.ParquetWriter(name, schema, use_dictionary=few) as writer:
        for part in parts_of(table[["longitude", "latitude"]]):
            columns = [*plain.slice(first, len(part)).columns, _binary(part)]
            writer.write_table(pa.Table.from_arrays(columns, schema=schema))
            first += len(part)


def _converted(table: pd.DataFrame):  # type: ignore[no-untyped-def]  # pyarrow carries no types
    """Return the table as Arrow table, without copying numbers; an error names the column that Arrow cannot store."""
    import pyarrow as pa

    try:
        return pa.Table.from_pandas(table, preserve_index=False)
    except pa.ArrowException:
        for name in table:
            try:
                pa.array(table[name], from_pandas=True)
            except pa.ArrowException as error:
                raise ValueError(
                    f"{FUNCTION}: column {name!r} contains values of several types ({error}): convert it to text by "
                    f".astype({{{name!r}: str}}), or drop it by .drop(columns=[{name!r}])"
                ) from None
        raise


def _binary(part: pd.DataFrame):  # type: ignore[no-untyped-def]  # pyarrow carries no types
    """Return the locations of a part of the table as well-known binary."""
    import pyarrow as pa

    points = np.empty(len(part), dtype=POINT)
    points["order"], points["type"] = 1, 1
    points["x"], points["y"] = part["longitude"], part["latitude"]
    ends = np.arange(len(part) + 1, dtype=np.int32) * POINT.itemsize
    return pa.Array.from_buffers(pa.binary(), len(part), [None, pa.py_buffer(ends), pa.py_buffer(points)])
