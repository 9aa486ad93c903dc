"""Readers of hazard curves from the OpenQuake engine and from tools of the USGS."""

from __future__ import annotations

import csv
import json
import re
from collections.abc import Sequence
from pathlib import Path
from typing import Any

import numpy as np

from warpdyn.foundations.core.checks import real_number
from warpdyn.foundations.core.messages import warn_caller
from warpdyn.foundations.files.text import check_names, check_separator, read_csv_text
from warpdyn.model.ground_motions.measures.measure import OPENQUAKE_UNITS
from warpdyn.model.ground_motions.measures.names import measure_named, spectral_name

SAME_PLACE = 1e-3  # largest difference of coordinates of the same site [degree], about 100 m

Points = tuple[np.ndarray, np.ndarray]
Site = tuple[float, float]


def read_openquake_csv(path: str | Path, site: Site | None) -> tuple[np.ndarray, np.ndarray, str, str]:
    """Read a hazard curve from a CSV file of the OpenQuake engine.

    Args:
        path: The file.
        site: Longitude and latitude [degree]; None: the file has one site.

    Returns:
        Intensities [units], annual rates of exceedance [1/year], name of the intensity measure, and units.
    """
    lines = read_csv_text("HazardCurve.from_openquake_csv", path).splitlines()
    header = lines[0] if lines[0].startswith("#") else ""
    years = re.search(r"investigation_time=([\d.eE+-]+)", header)
    named = re.search(r"imt='([^']+)'|imt=\"+([^\",]+)\"+", header)
    if not years or not named:
        raise ValueError(
            f"{path}: the first line must be a comment with investigation_time=... and imt='...', as in files of the "
            "OpenQuake engine: export the hazard curve again, or give its points to HazardCurve(intensity, annual_rate)"
        )
    _check_kind(path, header)
    measure = named[1] or named[2]
    known = measure_named(measure)
    if known is None or not known.kind:
        raise ValueError(
            f"{path}: warpdyn does not know the intensity measure {measure!r}; it reads {', '.join(OPENQUAKE_UNITS)}, "
            "with the period of SA as in SA(0.3). For another measure, give the points to HazardCurve(intensity, "
            "annual_rate, units=..., measure=...)"
        )
    units, factor = known.from_openquake()
    rows = _csv_lines(path, lines[1:])
    if not rows:
        raise ValueError(
            f"{path}: the file ends after its first line; the names of the columns and one line per site must follow: "
            "export the curve again"
        )
    columns = [(i, name[4:]) for i, name in enumerate(rows[0]) if name.startswith("poe-")]
    if not columns or not {"lon", "lat"} <= set(rows[0]):
        raise ValueError(
            f"{path}, line 2: the columns must be lon, lat, ... and poe-<intensity>, got {rows[0][:5]}: export the "
            "curve again"
        )
    place = _row_of_site(path, rows[0], rows[1:], site, first_line=3)
    row, where = rows[1 + place], f"{path}, line {3 + place}"
    intensity = np.array([_number(name, f"{path}, line 2") for _, name in columns])
    probability = np.array([_number(row[i], where) if i < len(row) else np.nan for i, _ in columns])
    if not np.all((probability >= 0) & (probability <= 1)):
        bad = probability[~((probability >= 0) & (probability <= 1))][0]
        raise ValueError(
            f"{where}: a probability is {bad:g}, but it must be from 0 to 1: correct this line of the file"
        )
    # Points with probability 0, or with a probability that the file rounds to 1, have no annual rate.
    kept = (probability > 0) & (probability < 1)
    time = real_number(f"{path}: investigation_time", _number(years[1], f"{path}, line 1"), above=0)
    rate = -np.log1p(-probability[kept]) / time
    return *_checked(path, factor * intensity[kept], rate), measure, units


def _check_kind(path: str | Path, header: str) -> None:
    """Raise a ValueError if a file does not contain a hazard curve; warn if the curve is not the mean curve."""
    found = re.search(r"kind='([^']*)'", header)
    kind = found[1] if found else "mean"
    if not re.fullmatch(r"mean|max|quantile-[\d.]+|rlz-\d+|\d+", kind):
        raise ValueError(
            f"{path} contains a curve of kind={kind!r}, whose values are not probabilities of exceedance (for 'std' "
            "they are standard deviations over the logic tree): read the file of kind='mean'"
        )
    if kind.startswith(("quantile", "max")):
        warn_caller(
            f"{path}: the hazard curve has kind={kind!r}, so rates and losses computed with it are not means; for "
            "means read the file of kind='mean'"
        )


def read_usgs(path: str | Path, measure: str | None, site: str | Site | None) -> tuple[np.ndarray, np.ndarray, str]:
    """Read a hazard curve of the USGS from JSON or CSV.

    Args:
        path: The file.
        measure: Name of the intensity measure; None: read it from the file or from the name of its folder.
        site: Name of the site, or longitude and latitude [degree]; None: the file has one site.

    Returns:
        Intensities [g], annual rates of exceedance [1/year], and name of the intensity measure.
    """
    text = read_csv_text("HazardCurve.from_usgs", path, "JSON or CSV")
    if text.lstrip().startswith("{"):
        return _usgs_json(path, text, measure)
    rows = _csv_lines(path, text.splitlines())
    header = [name.strip() for name in rows[0]]
    if not {"lon", "lat"} <= set(header):
        raise ValueError(
            f"{path}: neither JSON of a USGS service nor CSV with the columns name, lon, lat, "
            "<intensity>: give a file of one of these kinds, or HazardCurve(intensity, annual_rate)"
        )
    columns = [i for i, name in enumerate(header) if re.fullmatch(r"[\d.]+(?:[eE][+-]?\d+)?", name)]
    folder = spectral_name(Path(path).resolve().parent.name)
    of_folder = measure_named(folder)
    named = measure or (folder if of_folder and of_folder.level_units == "g" else None)
    if named is None:
        raise ValueError(
            f"{path}: the name of its folder is not an intensity measure (such as PGA, SA0P2): give measure='SA(0.2)'"
        )
    place = _row_of_site(path, header, rows[1:], site, first_line=2)
    row, where = rows[1 + place], f"{path}, line {2 + place}"
    intensity = np.array([float(header[i]) for i in columns])
    rate = np.array([_number(row[i], where) if i < len(row) else np.nan for i in columns])
    return *_positive(path, intensity, rate), named


def _usgs_json(path: str | Path, text: str, measure: str | None) -> tuple[np.ndarray, np.ndarray, str]:
    """Read a hazard curve from the JSON of USGS services: with `hazardCurves`, or (before 2022) a list with `yvalues`.

    Returns:
        Intensities [g], annual rates of exceedance [1/year], and name of the intensity measure.
    """
    try:
        response = json.loads(text)["response"]
        found: dict[str, Points] = {}
        twice = ""
        for each in response["hazardCurves"] if isinstance(response, dict) else response:
            about = each if isinstance(response, dict) else each["metadata"]
            total = next(part for part in each["data"] if part["component"] == "Total")
            points = total.get("values") or {"xs": about["xvalues"], "ys": total["yvalues"]}
            values = np.array(points["xs"], dtype=np.float64), np.array(points["ys"], dtype=np.float64)
            name = spectral_name(about["imt"]["value"])
            twice = twice or (name if name in found else "")
            found[name] = values
    except (KeyError, TypeError, ValueError, StopIteration) as error:
        raise ValueError(
            f"{path}: not the JSON of a USGS hazard service: it needs response.hazardCurves with imt.value, and xs "
            "and ys of the component 'Total'. Request the file again, or give HazardCurve(intensity, annual_rate)"
        ) from error
    if twice:
        raise ValueError(
            f"{path} has {twice} twice, perhaps for several sites or ground conditions: give a file with one curve per "
            "measure"
        )
    wanted = spectral_name(measure) if measure else None
    if wanted is None and len(found) == 1:
        wanted = next(iter(found))
    if wanted not in found:
        asked = f"has no measure {measure!r}" if measure else "has several intensity measures: give measure="
        raise ValueError(f"{path} {asked}; it has {', '.join(found)}")
    return *_positive(path, *found[wanted]), wanted


def _csv_lines(path: str | Path, lines: Sequence[str]) -> list[list[str]]:
    """Return the rows of a CSV file, without blanks around values; raise a ValueError for repeated column names."""
    try:
        check_separator(lines[0] if lines else "")
        rows = [[value.strip() for value in row] for row in csv.reader(lines) if any(row)]
        check_names(rows[0] if rows else ())
    except (ValueError, csv.Error) as error:
        raise ValueError(f"{path}: {error}") from None
    return rows


def _row_of_site(
    path: str | Path, header: Sequence[str], rows: Sequence[Sequence[str]], site: Any, *, first_line: int
) -> int:
    """Return the index of the row of a site in a file.

    Args:
        path: The file, for messages.
        header: Names of the columns.
        rows: Rows of the file below the column names.
        site: Name of the site, or longitude and latitude [degree]; None: the file must have one row.
        first_line: Number of the line of the first row in the file, for messages.
    """
    if not rows:
        raise ValueError(f"{path}: the file has no row after the column names; it needs one row per site")
    if site is None:
        if len(rows) > 1:
            raise ValueError(f"{path} has {len(rows)} sites: give site=(longitude, latitude)")
        return 0
    if isinstance(site, str):
        names = [row[header.index("name")] for row in rows] if "name" in header else []
        if site not in names:
            raise ValueError(
                f"{path} has no site {site!r}; it has {', '.join(names[:8]) or 'no names'}: give one of these, or "
                "site=(longitude, latitude)"
            )
        if names.count(site) > 1:
            raise ValueError(
                f"{path} has the site {site!r} in {names.count(site)} lines: keep one of these lines in the file"
            )
        return names.index(site)
    if not isinstance(site, Sequence) or len(site) != 2:
        raise ValueError(f"site must be longitude and latitude [degree], such as site=(-122.4, 37.8), got {site!r}")
    places = np.array(
        [
            [_number(row[header.index(axis)], f"{path}, line {first_line + i}") for axis in ("lon", "lat")]
            for i, row in enumerate(rows)
        ]
    )
    apart = np.abs(places - np.array([real_number("site", value) for value in site])).max(axis=1)
    nearest = int(np.argmin(apart))
    same = np.flatnonzero((apart <= SAME_PLACE) & (apart == apart[nearest])).tolist()
    if len(same) > 1 and any(list(rows[each]) != list(rows[same[0]]) for each in same):
        raise ValueError(
            f"{path} has several sites at longitude {site[0]:g}, latitude {site[1]:g}: lines "
            f"{', '.join(str(first_line + each) for each in same)}; keep one of these lines in the file"
        )
    if apart[nearest] > SAME_PLACE:
        raise ValueError(
            f"{path} has no site at longitude {site[0]:g}, latitude {site[1]:g}; the nearest is "
            f"{places[nearest][0]:g}, {places[nearest][1]:g}: give the coordinates of a site in the file"
        )
    return nearest


def _positive(path: str | Path, intensity: np.ndarray, rate: np.ndarray) -> Points:
    """Return intensities and rates without points of rate 0 (intensities above the largest possible motion)."""
    if not np.all(rate >= 0):
        raise ValueError(
            f"{path}: an annual rate is {rate[~(rate >= 0)][0]:g}, but it must be at least 0: correct the file"
        )
    kept = rate > 0
    return _checked(path, intensity[kept], rate[kept])


def _checked(path: str | Path, intensity: np.ndarray, rate: np.ndarray) -> Points:
    if rate.size < 2:
        raise ValueError(
            f"{path}: fewer than 2 points of the curve have a rate above 0, but a curve needs "
            "2: give another site, or a file with lower intensities"
        )
    return intensity, rate


def _number(token: str, where: str) -> float:
    try:
        value = float(token)
    except ValueError:
        value = np.nan
    if not np.isfinite(value):
        raise ValueError(f"{where}: {token!r} is not a finite number: correct the file")
    return value
