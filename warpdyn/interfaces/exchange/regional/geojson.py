"""Writer of points with properties as GeoJSON (RFC 7946)."""

from __future__ import annotations

import json
from collections.abc import Mapping
from typing import Any

import pandas as pd

from warpdyn.interfaces.exchange.regional.building_table import parts_of

DIGITS = 10  # digits of a property after the decimal point; 1e-10 degree is 0.01 mm


def write_points(name: str, properties: pd.DataFrame, places: pd.DataFrame, head: Mapping[str, Any]) -> None:
    """Write a GeoJSON FeatureCollection with one point per row of a table.

    Args:
        name: Path of the file that is written.
        properties: Table of the properties, one per column; missing values become null.
        places: Table with the columns `longitude` and `latitude` [degree], in the same order of rows.
        head: Further members of the FeatureCollection, which are written before its features.
    """
    members = "".join(f"{json.dumps(key)}: {json.dumps(value)},\n" for key, value in head.items())
    with open(name, "w", encoding="utf-8", newline="\n") as file:
        file.write('{"type": "FeatureCollection",\n' + members + '"features": [\n')
        before = ""
        for part, of_part in zip(parts_of(properties), parts_of(places), strict=True):
            # The JSON text of a row contains no line feed. It may contain other line ends, such as U+2028, at which
            # `splitlines` would split the row.
            lines = part.to_json(orient="records", lines=True, double_precision=DIGITS, force_ascii=False)
            rows = lines.rstrip("\n").split("\n")
            longitude, latitude = (of_part[column].tolist() for column in ("longitude", "latitude"))
            file.write(before)
            file.write(
                ",\n".join(
                    f'{{"type": "Feature", "geometry": {{"type": "Point", "coordinates": [{x!r}, {y!r}]}}, '
                    f'"properties": {row}}}'
                    for row, x, y in zip(rows, longitude, latitude, strict=True)
                )
            )
            before = ",\n"
        file.write("\n]}\n")
