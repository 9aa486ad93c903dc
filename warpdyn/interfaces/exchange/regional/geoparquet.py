"""Writer of points as GeoParquet 1.1: a Parquet file with a column of geometries and metadata that describe it."""

from __future__ import annotations

import json

import numpy as np
import pandas as pd

from warpdyn.interfaces.exchange.regional.building_table import parts_of

FUNCTION = "write_building_results"
VERSION, GEOMETRY = "1.1.0", "geometry"
LOOKED_AT = 10_000  # number of rows in which different values are counted, for the choice of the encoding
# Layout of a point in well-known binary (OGC 06-103r4): byte order (1: little-endian), type 1 (point), two coordinates.
POINT = np.dtype([("order", "u1"), ("type", "<u4"), ("x", "<f8"), ("y", "<f8")])


def write_points(name: str, table: pd.DataFrame) -> None:
    """Write a table with the location of each row as a GeoParquet file.

    Args:
        name: Path of the file that is written.
        table: The table, with the columns `longitude` and `latitude` [degree].

    Raises:
        ValueError: If a column contains values of several types, such as text and numbers.
    """
    import pyarrow as pa
    import pyarrow.parquet as pq

    low, high = ([float(edge(table[column])) for column in ("longitude", "latitude")] for edge in (np.min, np.max))
    # By the specification, coordinates without a `crs` are longitude and latitude on WGS 84 (OGC:CRS84).
    column = {"encoding": "WKB", "geometry_types": ["Point"], "bbox": [*low, *high]}
    geo = {"version": VERSION, "primary_column": GEOMETRY, "columns": {GEOMETRY: column}}
    plain = _converted(table)
    said = (plain.schema.metadata or {}) | {
        b"geo": json.dumps(geo).encode(),
        b"PANDAS_ATTRS": json.dumps(table.attrs).encode(),
    }
    schema = plain.schema.append(pa.field(GEOMETRY, pa.binary(), nullable=False)).with_metadata(said)
    # Dictionary encoding is used only for columns with many repeated values. For other columns it takes time and saves
    # no space.
    few = [column for column in table if table[column].iloc[:LOOKED_AT].nunique() <= LOOKED_AT / 10]
    first = 0
    with pq.ParquetWriter(name, schema, use_dictionary=few) as writer:
        for part in parts_of(table[["longitude", "latitude"]]):
            columns = [*plain.slice(first, len(part)).columns, _binary(part)]
            writer.write_table(pa.Table.from_arrays(columns, schema=schema))
            first += len(part)


def _converted(table: pd.DataFrame):  # type: ignore[no-untyped-def]  # pyarrow carries no types
    """Return the table as an Arrow table without copying numbers; an error names a column that Arrow cannot store."""
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
    """Return the points of some rows of the table as an Arrow array of well-known binary values, one per row."""
    import pyarrow as pa

    points = np.empty(len(part), dtype=POINT)
    points["order"], points["type"] = 1, 1
    points["x"], points["y"] = part["longitude"], part["latitude"]
    ends = np.arange(len(part) + 1, dtype=np.int32) * POINT.itemsize
    return pa.Array.from_buffers(pa.binary(), len(part), [None, pa.py_buffer(ends), pa.py_buffer(points)])
