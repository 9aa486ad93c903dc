"""Files grid.xml of ShakeMap: estimated intensities of an earthquake at the points of a grid."""

from __future__ import annotations

import os
import re
import xml.etree.ElementTree as ElementTree
from collections.abc import Iterator
from pathlib import Path

import numpy as np
import xarray as xr

from warpdyn.foundations.core.messages import warn_caller
from warpdyn.foundations.files.text import check_names, existing_file, xml_root
from warpdyn.model.sites.intensity_fields import field_dataset

# Units in files of all ShakeMap versions (ShakeMap manual, "Products and formats": grid.xml) -> (our unit, factor).
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
MOST_INTENSE = 12.0  # largest value of the modified Mercalli scale
# Values that no earthquake is known to have exceeded. The largest recorded values are 4.4 g at Ichinoseki-Nishi in 2008
# (Aoi, Kunugi and Fujiwara 2008, Science 322) and 3.2 m/s at Chi-Chi in 1999. Spectral accelerations are up to three
# times the peak acceleration.
HIGHEST = {"PGA": (5.0, "g"), "PSA": (15.0, "g"), "PGV": (5.0, "m/s")}
VS30 = "SVEL"  # field of the shear-wave velocity Vs30 [m/s]
_LOGARITHM = re.compile(r"ln\(.*\)")  # unit of standard deviations of logarithms
OF_EVENTS = ("event_id", "magnitude", "depth", "lat", "lon", "event_timestamp", "event_description")  # of <event>


def read_shakemap(*paths: str | os.PathLike) -> xr.Dataset:
    """Read ShakeMaps: the file grid.xml of one earthquake, or the files of several earthquakes on the same grid.

    If an intensity is larger than in any known earthquake, a warning is given, because its unit may be wrong.

    Args:
        *paths: XML files of intensities, as published by the USGS, with the fields LON, LAT, MMI, PGA, PGV, PSA03 and
            so on, in the units that the file gives; or files of uncertainties, such as uncertainty.xml, with standard
            deviations of natural logarithms.

    Returns:
        Dataset with the fields of the files, dimensions (earthquake, point), and the coordinates `longitude` and
        `latitude`. `PGA` and `SA(0.3)`, `SA(1.0)`, `SA(3.0)` are in g, `PGV` in m/s. `MMI` and all other fields have
        their names in the file, such as `STDPGA` (standard deviation of ln PGA), or `GMPE_INTER_STDPGA` and
        `GMPE_INTRA_STDPGA` (its between-event and within-event parts, for `correlated_fields`). The attributes describe
        the earthquake of the first file.

    Raises:
        ValueError: If a file is not a ShakeMap, has a field twice, an intensity in an unknown unit, a wrong number of
            values, places outside its <grid_specification>, or impossible values (not finite, below 0, MMI above 12);
            or if the grids of the files differ. The message names the file.
        FileNotFoundError: If a file does not exist.
        TypeError, IsADirectoryError: If a path is not text or a Path, or is a folder.

    Example:
        >>> shaking = wd.sites.read_shakemap("grid.xml")
        >>> shaking["PGA"].values  # g
        array([[0.21, 0.22, 0.23, 0.24]])
    """
    if not paths:
        raise ValueError("read_shakemap() needs at least one file: give read_shakemap('grid.xml')")
    found = [_read_grid(existing_file("read_shakemap", path)) for path in paths]
    (longitude, latitude, first, attributes), names = (
        found[0],
        [each[3]["event_id"] or str(i) for i, each in enumerate(found)],
    )
    for i, other in enumerate(found):
        for before in range(i):
            same = found[before][2].keys() == other[2].keys() and names[before] == names[i]
            if same and all(np.array_equal(found[before][2][name][0], other[2][name][0]) for name in other[2]):
                raise ValueError(
                    f"{paths[i]} is the same map as {paths[before]}, so that its earthquake would count twice: remove "
                    "one of them"
                )
    for path, (lon, lat, fields, _) in zip(paths[1:], found[1:], strict=True):
        if not (np.array_equal(lon, longitude) and np.array_equal(lat, latitude) and fields.keys() == first.keys()):
            raise ValueError(f"{path} has another grid, or other fields, than {paths[0]}: read it separately")
    fields = {name: (np.stack([each[2][name][0] for each in found]), first[name][1]) for name in first}
    attributes = {name: value for name, value in attributes.items() if value}
    return field_dataset(str(paths[0]), longitude, latitude, fields, None, names, attributes)


def _read_grid(
    path: Path,
) -> tuple[np.ndarray, np.ndarray, dict[str, tuple[np.ndarray, str]], dict[str, str]]:
    """Return the content of a ShakeMap file: longitudes, latitudes, fields, and attributes of the earthquake.

    Longitudes and latitudes [degree] have shape [point]. Fields are a mapping from names to (values, unit).
    """
    root = xml_root(path)
    parts: dict[str, list[ElementTree.Element]] = {}
    for element in root.iter():
        parts.setdefault(str(element.tag), []).append(element)
    if "shakemap_grid" not in parts or "grid_data" not in parts or "grid_field" not in parts:
        raise ValueError(
            f"{path} is not a ShakeMap: it has no <shakemap_grid> with <grid_field> and <grid_data>. Give the file "
            "grid.xml of a ShakeMap"
        )
    columns = sorted(((_whole(path, each, "index"), each) for each in parts["grid_field"]), key=lambda pair: pair[0])
    names = [each.get("name", "").strip().upper() for _, each in columns]
    if [index for index, _ in columns] != list(range(1, len(names) + 1)):
        raise ValueError(
            f"{path}: the indices of <grid_field> must be 1 to {len(names)}, each once, got "
            f"{', '.join(str(index) for index, _ in columns)}: download the map again"
        )
    check_names(names, f"{path}: of <grid_field>, ")
    try:
        values = np.array((parts["grid_data"][0].text or "").split(), dtype=np.float64)
    except ValueError as error:
        raise ValueError(f"{path}: <grid_data> must contain only numbers: {error}. Download the map again") from None
    grid = parts["grid_specification"][0] if "grid_specification" in parts else None
    points = values.size // len(names)
    if grid is not None:
        points = _whole(path, grid, "nlon") * _whole(path, grid, "nlat")
    if values.size != points * len(names) or not points:
        raise ValueError(
            f"{path}: <grid_data> has {values.size:,} values, but its grid has {points:,} points of "
            f"{len(names)} fields: download the map again"
        )
    for name in ("LON", "LAT"):
        if name not in names:
            raise ValueError(
                f"{path}: there is no field {name}; the fields are {', '.join(names)}. Download the map again"
            )
    rows = dict(zip(names, values.reshape(points, -1).T, strict=True))
    units = {name: each.get("units", "") for name, (_, each) in zip(names, columns, strict=True)}
    if grid is not None:
        _check_extent(path, grid, rows)
    fields = dict(_converted(path, rows, units))
    event = parts["event"][0] if "event" in parts else root
    return rows["LON"].copy(), rows["LAT"].copy(), fields, {name: event.get(name, "") for name in OF_EVENTS}


def _converted(
    path: Path, rows: dict[str, np.ndarray], units: dict[str, str]
) -> Iterator[tuple[str, tuple[np.ndarray, str]]]:
    """Yield the name, values and unit of each field, converted to the units that `read_shakemap` returns.

    Intensities get OpenQuake's names, such as "SA(0.3)"; other fields have the names in the file.
    """
    for name, values in rows.items():
        if name in ("LON", "LAT"):
            continue
        spectral = _SPECTRAL.fullmatch(name)
        if spectral or name in ("PGA", "PGV", "MMI"):
            unit = units[name].strip().lower()
            if unit not in UNITS:
                raise ValueError(
                    f"{path}: {name} has the unit {units[name]!r}; allowed are {', '.join(UNITS)}: correct the unit in "
                    "<grid_field>, or download the map again"
                )
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
    """Raise a ValueError if a value of an intensity is impossible; warn if a value is above the largest known one."""
    most = MOST_INTENSE if name == "MMI" else np.inf
    bound = f"from 0 to {most:g}" if name == "MMI" else "finite and at least 0"
    _raise_for(path, name, values, ~((values >= 0) & (values <= most) & np.isfinite(values)), bound)
    highest = HIGHEST.get(name[:3])
    if highest is not None and factor * values.max() > highest[0]:
        warn_caller(
            f"{path}: the largest {name} is {factor * values.max():.3g} {highest[1]}, and no earthquake is known with "
            f"more than {highest[0]:g} {highest[1]}: check the unit in <grid_field>"
        )


def _raise_for(path: Path, name: str, values: np.ndarray, bad: np.ndarray, bound: str) -> None:
    """Raise a ValueError if a value is bad; the message gives the number of bad values and the first bad value."""
    if bad.any():
        point = int(bad.argmax())
        raise ValueError(
            f"{path}: {bad.sum():,} of {bad.size:,} values of {name} are impossible, the first is {values[point]:g} at "
            f"point {point + 1}; they must be {bound}. Use another version of the map, or correct the file"
        )


def _whole(path: Path, element: ElementTree.Element, name: str) -> int:
    """Return the attribute `name` of an XML element as an integer; raise a ValueError if it is not a number above 0."""
    word = element.get(name, "")
    if not word.strip().isdecimal() or int(word) == 0:
        raise ValueError(
            f"{path}: {name} of <{element.tag}> must be a whole number above 0, got {word!r}: download the map again"
        )
    return int(word)


def _check_extent(path: Path, grid: ElementTree.Element, rows: dict[str, np.ndarray]) -> None:
    """Raise a ValueError if longitudes or latitudes of a map are outside the bounds in its <grid_specification>."""
    for axis, name in (("lon", "LON"), ("lat", "LAT")):
        try:
            low, high = (float(grid.get(f"{axis}_{end}", "nan")) for end in ("min", "max"))
        except ValueError:
            raise ValueError(
                f"{path}: {axis}_min and {axis}_max of <grid_specification> must be numbers: download the map again"
            ) from None
        # The tolerance is larger than the rounding of printed coordinates and spacings.
        tolerance = 0.1 * abs(high - low) + 1e-3
        if rows[name].min() < low - tolerance or rows[name].max() > high + tolerance:
            raise ValueError(
                f"{path}: {name} is from {rows[name].min():g} to {rows[name].max():g}, but <grid_specification> gives "
                f"{low:g} to {high:g}: longitudes and latitudes may be exchanged, or values may be missing: download "
                "the map again"
            )
