"""GeoParquet 1.1 of points: plain Parquet with a column of geometries and metadata that says so."""

from __future__ import annotations

import json

import numpy as np
import pandas as pd

from warpdyn.interfaces.exchange.regional.building_table import parts_of

FUNCTION = "write_building_results"
VERSION, GEOMETRY = "1.1.0", "geometry"
LOOKED_AT = 10_000  # rows that tell whether a column's values repeat
# A point of well-known binary (OGC 06-103r4): little-endian, of type 1, and its two coordinates.
POINT = np.dtype([("order", "u1"), ("type", "<u4"), ("x", "<f8"), ("y", "<f8")])


def write_points(name: str, table: pd.DataFrame) -> None:
    """Write a table with places as GeoParquet, part by part.

    Args:
        name: The file.
        table: The table, with columns `longitude` and `latitude` [degree].

    Raises:
        ValueError: If a column holds values of several kinds, such as text and numbers.
    """
    import pyarrow as pa
    import pyarrow.parquet as pq

    low, high = ([float(edge(table[column])) for column in ("longitude", "latitude")] for edge in (np.min, np.max))
    # Without a `crs` places are longitude and latitude on WGS 84 (OGC:CRS84), as the specification has it.
    column = {"encoding": "WKB", "geometry_types": ["Point"], "bbox": [*low, *high]}
    geo = {"version": VERSION, "primary_column": GEOMETRY, "columns": {GEOMETRY: column}}
    plain = _converted(table)
    said = (plain.schema.metadata or {}) | {
        b"geo": json.dumps(geo).encode(),
        b"PANDAS_ATTRS": json.dumps(table.attrs).encode(),
    }
    schema = plain.schema.append(pa.field(GEOMETRY, pa.binary(), nullable=False)).with_metadata(said)
    # A dictionary of values that hardly repeat takes time and saves nothing.
    few = [column for column in table if table[column].iloc[:LOOKED_AT].nunique() <= LOOKED_AT / 10]
    first = 0
    with pq.ParquetWriter(name, schema, use_dictionary=few) as writer:
        for part in parts_of(table[["longitude", "latitude"]]):
            columns = [*plain.slice(first, len(part)).columns, _binary(part)]
            writer.write_table(pa.Table.from_arrays(columns, schema=schema))
            first += len(part)


def _converted(table: pd.DataFrame):  # type: ignore[no-untyped-def]  # pyarrow carries no types
    """Return the table as Arrow's, which shares its numbers; raise a ValueError that names a column it cannot hold."""
    import pyarrow as pa

    try:
        return pa.Table.from_pandas(table, preserve_index=False)
    except pa.ArrowException:
        for name in table:
            try:
                pa.array(table[name], from_pandas=True)
            except pa.ArrowException as error:
                raise ValueError(
                    f"{FUNCTION}: column {name!r} holds values that Parquet has no single type for ({error}): make "
                    "them all text or all numbers, or leave the column out"
                ) from None
        raise


def _binary(part: pd.DataFrame):  # type: ignore[no-untyped-def]  # pyarrow carries no types
    """Return the places of a part of the table as well-known binary."""
    import pyarrow as pa

    points = np.empty(len(part), dtype=POINT)
    points["order"], points["type"] = 1, 1
    points["x"], points["y"] = part["longitude"], part["latitude"]
    ends = np.arange(len(part) + 1, dtype=np.int32) * POINT.itemsize
    return pa.Array.from_buffers(pa.binary(), len(part), [None, pa.py_buffer(ends), pa.py_buffer(points)])
