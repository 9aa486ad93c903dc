"""GeoJSON (RFC 7946) of points, written part by part."""

from __future__ import annotations

import json
from collections.abc import Mapping
from typing import Any

import pandas as pd

from warpdyn.interfaces.exchange.regional.building_table import parts_of

DIGITS = 10  # after the point, of properties; 1e-10 of a probability, and of a degree a hundredth of a millimetre


def write_points(name: str, properties: pd.DataFrame, places: pd.DataFrame, head: Mapping[str, Any]) -> None:
    """Write a FeatureCollection with a point for each row of a table.

    Args:
        name: The file.
        properties: The properties, a column each; what is missing is null.
        places: Longitude and latitude [degree], in columns of these names.
        head: Further members of the collection, before its features.
    """
    members = "".join(f"{json.dumps(key)}: {json.dumps(value)},\n" for key, value in head.items())
    with open(name, "w", encoding="utf-8", newline="\n") as file:
        file.write('{"type": "FeatureCollection",\n' + members + '"features": [\n')
        before = ""
        for part, of_part in zip(parts_of(properties), parts_of(places), strict=True):
            # A row's JSON has no line feeds in it, as they are escaped in text. What else Unicode takes for the end of
            # a line, such as U+2028, is not, so that `splitlines` would cut rows.
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
