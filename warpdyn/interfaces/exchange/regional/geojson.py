"""Writer of points as GeoJSON (RFC 7946)."""

from __future__ import annotations

import json
from collections.abc import Mapping
from typing import Any

import pandas as pd

from warpdyn.interfaces.exchange.regional.building_table import parts_of

DIGITS = 10  # digits after the decimal point of properties; 1e-10 degree is 0.01 mm


def write_points(name: str, properties: pd.DataFrame, places: pd.DataFrame, head: Mapping[str, Any]) -> None:
    """Write a FeatureCollection with one point per row of a table.

    Args:
        name: The file.
        properties: The properties, one per column; missing values become null.
        places: Table with the columns `longitude` and `latitude` [degree].
        head: Further members of the collection, before its features.
    """
    members = "".join(f"{json.dumps(key)}: {json.dumps(value)},\n" for key, value in head.items())
    with open(name, "w", encoding="utf-8", newline="\n") as file:
        file.write('{"type": "FeatureCollection",\n' + members + '"features": [\n')
        before = ""
        for part, of_part in zip(parts_of(properties), parts_of(places), strict=True):
            # The JSON of a row contains no line feed, but may contain other line ends such as U+2028, at which
            # `splitlines` would split it.
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
