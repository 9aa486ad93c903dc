"""ShakeMap's grid.xml: the intensities that an earthquake is estimated to have had at the points of a grid."""

from __future__ import annotations

import os
import re
import xml.etree.ElementTree as ElementTree
from collections.abc import Iterator
from pathlib import Path

import numpy as np
import xarray as xr

from warpdyn.files.text import existing_file
from warpdyn.sites.intensity_fields import field_dataset

# Units of ShakeMap, as its versions write them (ShakeMap manual, "Products and formats": grid.xml), and ours.
UNITS = {
    "%g": ("g", 0.01),
    "pctg": ("g", 0.01),
    "g": ("g", 1.0),
    "cm/s": ("m s-1", 0.01),
    "cms": ("m s-1", 0.01),
    "m/s": ("m s-1", 1.0),
    "intensity": ("1", 1.0),
    "mmi": ("1", 1.0),
}
_SPECTRAL = re.compile(r"PSA(\d+)[P.]?(\d)", re.IGNORECASE)
_LOGARITHM = re.compile(r"ln\(.*\)")
TOLD = ("event_id", "magnitude", "depth", "lat", "lon", "event_timestamp", "event_description")


def read_shakemap(*paths: str | os.PathLike) -> xr.Dataset:
    """Read ShakeMaps: the grid.xml of one earthquake, or those of several on the same grid.

    Args:
        *paths: The files, in XML as the USGS publishes it (fields of a grid: LON, LAT, MMI, PGA, PGV, PSA03 and so on,
            in the units that the file names). A file of uncertainties, such as uncertainty.xml, may stand in their
            place: its fields are natural logarithms.

    Returns:
        Dataset with the fields of the files (earthquake, point): `PGA` and `SA(0.3)`, `SA(1.0)`, `SA(3.0)` in g, `PGV`
        in m/s, `MMI`, and all others by their own names, such as `STDPGA`, a standard deviation of the logarithm, or
        `GMPE_INTER_STDPGA` and `GMPE_INTRA_STDPGA`, those between and within earthquakes, for `correlated_fields`; with
        the coordinates `longitude` and `latitude`. The attributes are what the first file says of its earthquake.

    Raises:
        ValueError: If a file is no such XML, has a field of an unknown unit among the intensities, or holds another
            number of values than its grid; or grids differ. The message names the file.
        FileNotFoundError: If there is no such file.
        TypeError, IsADirectoryError: If the path is none, or a folder has that name.

    Example:
        >>> shaking = wd.sites.read_shakemap("grid.xml")
        >>> shaking["PGA"].values  # g
        array([[0.21, 0.22, 0.23, 0.24]])
    """
    if not paths:
        raise ValueError("read_shakemap() takes at least one file")
    found = [_read_grid(existing_file("read_shakemap", path)) for path in paths]
    (longitude, latitude, first, attributes), names = (
        found[0],
        [each[3]["event_id"] or str(i) for i, each in enumerate(found)],
    )
    for path, (lon, lat, fields, _) in zip(paths[1:], found[1:], strict=True):
        if not (np.array_equal(lon, longitude) and np.array_equal(lat, latitude) and fields.keys() == first.keys()):
            raise ValueError(f"{path} has another grid, or other fields, than {paths[0]}: read it by itself")
    fields = {name: (np.stack([each[2][name][0] for each in found]), first[name][1]) for name in first}
    return field_dataset(str(paths[0]), longitude, latitude, fields, None, names, {k: v for k, v in attributes.items() if v})


def _read_grid(
    path: Path,
) -> tuple[np.ndarray, np.ndarray, dict[str, tuple[np.ndarray, str]], dict[str, str]]:
    """Return longitudes, latitudes, the fields with their units, and what a file says of its earthquake."""
    try:
        # Python's expat takes no outside entities, and from 2.4.1 on none that grow without bounds.
        root = ElementTree.parse(path).getroot()
    except ElementTree.ParseError as error:
        raise ValueError(f"{path} is no XML: {error}") from None
    parts: dict[str, list[ElementTree.Element]] = {}
    for element in root.iter():
        if isinstance(element.tag, str):
            parts.setdefault(element.tag.rpartition("}")[2], []).append(element)
    if "shakemap_grid" not in parts or "grid_data" not in parts or "grid_field" not in parts:
        raise ValueError(f"{path} is no ShakeMap: it has no <shakemap_grid> with <grid_field> and <grid_data>")
    columns = sorted((int(each.get("index", "0")), each) for each in parts["grid_field"])
    names = [each.get("name", "").upper() for _, each in columns]
    try:
        values = np.array((parts["grid_data"][0].text or "").split(), dtype=np.float64)
    except ValueError as error:
        raise ValueError(f"{path}: <grid_data> holds what is no number: {error}") from None
    grid = parts["grid_specification"][0] if "grid_specification" in parts else None
    points = int(grid.get("nlon", "0")) * int(grid.get("nlat", "0")) if grid is not None else values.size // len(names)
    if values.size != points * len(names) or not points:
        raise ValueError(
            f"{path}: <grid_data> holds {values.size:,} values, and its grid {points:,} points of {len(names)} fields"
        )
    for name in ("LON", "LAT"):
        if name not in names:
            raise ValueError(f"{path}: there is no field {name}; the fields are {', '.join(names)}")
    rows = dict(zip(names, values.reshape(points, -1).T, strict=True))
    units = {name: each.get("units", "") for name, (_, each) in zip(names, columns, strict=True)}
    fields = dict(_converted(path, rows, units))
    event = parts["event"][0] if "event" in parts else root
    told = {name: event.get(name, "") for name in TOLD}
    return rows["LON"].copy(), rows["LAT"].copy(), fields, told


def _converted(
    path: Path, rows: dict[str, np.ndarray], units: dict[str, str]
) -> Iterator[tuple[str, tuple[np.ndarray, str]]]:
    """Yield the fields by OpenQuake's names, in our units."""
    for name, values in rows.items():
        if name in ("LON", "LAT"):
            continue
        spectral = _SPECTRAL.fullmatch(name)
        if spectral or name in ("PGA", "PGV", "MMI"):
            unit = units[name].strip().lower()
            if unit not in UNITS:
                raise ValueError(f"{path}: {name} is in {units[name]!r}; known units are {', '.join(UNITS)}")
            ours, factor = UNITS[unit]
            measure = f"SA({spectral[1]}.{spectral[2]})" if spectral else name
            yield measure, (factor * values, ours)
        else:
            yield name, (values, "1" if _LOGARITHM.fullmatch(units[name].strip()) else "")
