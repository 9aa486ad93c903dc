"""ShakeMap's grid.xml: the intensities that an earthquake is estimated to have had at the points of a grid."""

from __future__ import annotations

import os
import re
import xml.etree.ElementTree as ElementTree
from collections.abc import Iterator
from pathlib import Path

import numpy as np
import xarray as xr

from warpdyn.foundations.core.messages import warn_caller
from warpdyn.foundations.files.text import check_names, existing_file
from warpdyn.model.sites.intensity_fields import field_dataset

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
MOST_INTENSE = 12.0  # of the modified Mercalli scale
# What no earthquake is known to have passed: 4.4 g at Ichinoseki-Nishi in 2008 (Aoi, Kunugi and Fujiwara 2008, Science
# 322), 3.2 m/s at Chi-Chi in 1999; spectral accelerations up to three times the peak.
HIGHEST = {"PGA": (5.0, "g"), "PSA": (15.0, "g"), "PGV": (5.0, "m/s")}
VS30 = "SVEL"  # m/s
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
        ValueError: If a file is no such XML, has a field twice or one of an unknown unit among the intensities, another
            number of values than its grid, places outside its specification, or values that are impossible (not
            finite, below 0, MMI above 12); or if grids differ. The message names the file. Values beyond all that was
            ever recorded give a warning.
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
    for i, other in enumerate(found):
        for before in range(i):
            same = found[before][2].keys() == other[2].keys() and names[before] == names[i]
            if same and all(np.array_equal(found[before][2][name][0], other[2][name][0]) for name in other[2]):
                raise ValueError(f"{paths[i]} is the same map as {paths[before]}, which would count twice")
    for path, (lon, lat, fields, _) in zip(paths[1:], found[1:], strict=True):
        if not (np.array_equal(lon, longitude) and np.array_equal(lat, latitude) and fields.keys() == first.keys()):
            raise ValueError(f"{path} has another grid, or other fields, than {paths[0]}: read it by itself")
    fields = {name: (np.stack([each[2][name][0] for each in found]), first[name][1]) for name in first}
    said = {name: value for name, value in attributes.items() if value}
    return field_dataset(str(paths[0]), longitude, latitude, fields, None, names, said)


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
    columns = sorted(((_whole(path, each, "index"), each) for each in parts["grid_field"]), key=lambda pair: pair[0])
    names = [each.get("name", "").strip().upper() for _, each in columns]
    if [index for index, _ in columns] != list(range(1, len(names) + 1)):
        raise ValueError(
            f"{path}: the indices of <grid_field> must be 1 to {len(names)}, each once, got "
            f"{', '.join(str(index) for index, _ in columns)}"
        )
    try:
        check_names(names)
    except ValueError as error:
        raise ValueError(f"{path}: of <grid_field>, {error}") from None
    try:
        values = np.array((parts["grid_data"][0].text or "").split(), dtype=np.float64)
    except ValueError as error:
        raise ValueError(f"{path}: <grid_data> holds what is no number: {error}") from None
    grid = parts["grid_specification"][0] if "grid_specification" in parts else None
    points = values.size // len(names)
    if grid is not None:
        points = _whole(path, grid, "nlon") * _whole(path, grid, "nlat")
    if values.size != points * len(names) or not points:
        raise ValueError(
            f"{path}: <grid_data> holds {values.size:,} values, and its grid {points:,} points of {len(names)} fields"
        )
    for name in ("LON", "LAT"):
        if name not in names:
            raise ValueError(f"{path}: there is no field {name}; the fields are {', '.join(names)}")
    rows = dict(zip(names, values.reshape(points, -1).T, strict=True))
    units = {name: each.get("units", "") for name, (_, each) in zip(names, columns, strict=True)}
    if grid is not None:
        _check_extent(path, grid, rows)
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
            _check_values(path, name, values, factor)
            measure = f"SA({spectral[1]}.{spectral[2]})" if spectral else name
            yield measure, (factor * values, ours)
        else:
            is_deviation = bool(_LOGARITHM.fullmatch(units[name].strip()))
            bad = ~np.isfinite(values) | (is_deviation & (values < 0)) | ((name == VS30) & ~(values > 0))
            _raise_for(path, name, values, bad, "finite" + (" and at least 0" if is_deviation else ""))
            yield name, (values, "1" if is_deviation else "")


def _check_values(path: Path, name: str, values: np.ndarray, factor: float) -> None:
    """Raise a ValueError if an intensity is impossible; warn of one that was never recorded."""
    most = MOST_INTENSE if name == "MMI" else np.inf
    bound = f"from 0 to {most:g}" if name == "MMI" else "finite and at least 0"
    _raise_for(path, name, values, ~((values >= 0) & (values <= most) & np.isfinite(values)), bound)
    highest = HIGHEST.get(name[:3])
    if highest is not None and factor * values.max() > highest[0]:
        warn_caller(
            f"{path}: the largest {name} is {factor * values.max():.3g} {highest[1]}, and no earthquake is known with "
            f"more than {highest[0]:g} {highest[1]}: is the unit in <grid_field> right?"
        )


def _raise_for(path: Path, name: str, values: np.ndarray, bad: np.ndarray, bound: str) -> None:
    """Raise a ValueError that counts bad values and shows the first."""
    if bad.any():
        point = int(bad.argmax())
        raise ValueError(
            f"{path}: {bad.sum():,} of {bad.size:,} values of {name} are impossible, the first is {values[point]:g} at "
            f"point {point + 1}; they must be {bound}. Take another version of the map, or mend the file"
        )


def _whole(path: Path, element: ElementTree.Element, name: str) -> int:
    """Return an attribute of an element as a whole number above 0."""
    word = element.get(name, "")
    if not word.strip().isdecimal() or int(word) == 0:
        tag = element.tag.rpartition("}")[2]
        raise ValueError(f"{path}: {name} of <{tag}> must be a whole number above 0, got {word!r}")
    return int(word)


def _check_extent(path: Path, grid: ElementTree.Element, rows: dict[str, np.ndarray]) -> None:
    """Raise a ValueError unless places are where the grid's specification has them."""
    for axis, name in (("lon", "LON"), ("lat", "LAT")):
        try:
            low, high = (float(grid.get(f"{axis}_{end}", "nan")) for end in ("min", "max"))
        except ValueError:
            raise ValueError(f"{path}: {axis}_min and {axis}_max of <grid_specification> must be numbers") from None
        # Printed coordinates and spacings have few digits: a tenth of the map is more than these lose.
        room = 0.1 * abs(high - low) + 1e-3
        if rows[name].min() < low - room or rows[name].max() > high + room:
            raise ValueError(
                f"{path}: {name} goes from {rows[name].min():g} to {rows[name].max():g}, and <grid_specification> has "
                f"{low:g} to {high:g}: longitudes and latitudes may be exchanged, or values lost"
            )
