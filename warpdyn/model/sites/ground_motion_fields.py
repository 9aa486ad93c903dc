"""Ground motion fields of OpenQuake: CSV files with the intensity at each site in each event of a calculation."""

from __future__ import annotations

import os
from collections.abc import Sequence

import numpy as np
import pandas as pd
import xarray as xr

from warpdyn.foundations.core.checks import whole_number
from warpdyn.foundations.core.messages import counted, warn_caller
from warpdyn.foundations.files.text import existing_file, read_csv
from warpdyn.model.ground_motions.measures.names import measure_named
from warpdyn.model.inventories.table import no_column
from warpdyn.model.sites.intensity_fields import field_dataset

# Names of the columns of events and sites in recent and older versions of the OpenQuake engine.
EVENTS, SITES = ("event_id", "eid"), ("custom_site_id", "site_id", "sid")
PREFIX = "gmv_"
KINDS = ("PGA", "SA", "AvgSA", "PGV", "PGD")  # measures that are converted to warpdyn's units
MOST_VALUES = 2**28  # of one field: 2 GiB


def read_ground_motion_field(
    fields: str | os.PathLike,
    sites: str | os.PathLike,
    *,
    events: int | Sequence[int] | str | os.PathLike | None = None,
) -> xr.Dataset:
    """Read ground motion fields of the OpenQuake engine.

    The engine does not write intensities below its `minimum_intensity`; they are read as 0. If all intensities of an
    event are below it, the event is not in the file. Event ids start at 0, and every number up to the largest id in the
    file is an event. If the last events of the calculation are not in the file, give `events`.

    Args:
        fields: The CSV file of the fields (gmf-data), with columns `event_id`, `gmv_PGA`, `gmv_SA(0.3)` and so on, and
            `site_id` or `custom_site_id`.
        sites: The CSV file of the sites (sitemesh), with the same column of sites, `lon` and `lat`.
        events: Number of events of the calculation, with ids from 0; or the ids of all events; or the CSV file of
            events with a column `event_id`. None: ids from 0 to the largest in `fields`; a warning counts the events
            without rows.

    Returns:
        Dataset with the fields `PGA`, `SA(0.3)` and so on, dimensions (earthquake, point), and the coordinates
        `longitude`, `latitude` and `point_name`. Accelerations are in g, velocities in m/s and displacements in m;
        other measures are unchanged and have no unit. Give one of the fields to `scale_records`.

    Raises:
        ValueError: If a column is missing, a site of the fields is not among the sites, an event is not among `events`,
            a site or a value is repeated, or a value is below 0 or not finite. The message names the file.
        FileNotFoundError: If a file does not exist.
        TypeError, IsADirectoryError: If a path is not text or a Path, or is a folder.

    Example:
        >>> shaking = wd.sites.read_ground_motion_field("gmf-data_1.csv", "sitemesh_1.csv")
        >>> shaking["SA(1.0)"].values  # g, by earthquake and point
        array([[0.3, 0.4],
               [0.2, 0. ]])
    """
    values, mesh = (
        read_csv(existing_file("read_ground_motion_field", path, argument), comment="#")
        for argument, path in (("fields", fields), ("sites", sites))
    )
    event = _column(fields, values, EVENTS)
    site = _column(fields, values, [name for name in SITES if name in mesh] or SITES)
    for name in (site, "lon", "lat"):
        if name not in mesh:
            raise no_column(str(sites), name, mesh)
    names = mesh[site].astype(str)
    if names.duplicated().any():
        raise ValueError(f"{sites}: site {names[names.duplicated()].iloc[0]!r} has two rows: remove one of them")
    measures = [name for name in values.columns if name.startswith(PREFIX)]
    if not measures or not len(values):
        what = "rows" if measures else f"columns {PREFIX}<measure>, such as {PREFIX}PGA"
        raise ValueError(f"{fields} has no {what}; its columns are {', '.join(values)}: export the fields again")
    missing = values[[event, site]].isna().any(axis=1).to_numpy()
    if missing.any():
        raise ValueError(
            f"{fields}: row {int(missing.argmax()) + 1} below the names of the columns has no event or no "
            "site: complete or remove this row"
        )
    place = pd.Index(names).get_indexer(values[site].astype(str))
    if np.any(place < 0):
        unknown = values[site].astype(str)[place < 0].unique()
        raise ValueError(
            f"{fields}: sites that are not in {sites}: {counted(unknown)}. Give the sites file of the same calculation"
        )
    earthquakes = _events(fields, values[event], events, len(names))
    number = pd.Index(earthquakes).get_indexer(values[event])
    cell = number.astype(np.int64) * len(names) + place
    if pd.Series(cell).duplicated().any():
        twice = int(np.flatnonzero(pd.Series(cell).duplicated())[0])
        raise ValueError(
            f"{fields}: site {values[site].iloc[twice]} has event {values[event].iloc[twice]} twice: remove one row"
        )
    silent = len(names) - np.unique(place).size
    if silent:
        first = names[np.setdiff1d(np.arange(len(names)), place)[0]]
        warn_caller(
            f"{fields}: {silent:,} of {len(names):,} sites ({first}, ...) have no value: 0 is used as their intensity. "
            "Complete the file if they were shaken"
        )
    made = {}
    for column in measures:
        given = pd.to_numeric(values[column], errors="coerce").to_numpy(dtype=np.float64)
        bad = ~(np.isfinite(given) & (given >= 0))
        if bad.any():
            raise ValueError(
                f"{fields}: values of {column} must be finite numbers of at least 0, but {np.count_nonzero(bad):,} of "
                f"{bad.size:,} are not: the first is {values[column].iloc[int(np.argmax(bad))]} at site "
                f"{values[site].iloc[int(np.argmax(bad))]}: correct the file"
            )
        name = _measure_name(column.removeprefix(PREFIX))
        measure = measure_named(name)
        unit, factor = measure.from_openquake() if measure and measure.kind in KINDS else ("", 1.0)
        field = np.zeros((earthquakes.size, len(names)))
        field.ravel()[cell] = factor * given
        made[name] = (field, unit)
    lon, lat = (pd.to_numeric(mesh[name], errors="coerce").to_numpy(dtype=np.float64) for name in ("lon", "lat"))
    return field_dataset(str(sites), lon, lat, made, names.tolist(), [str(each) for each in earthquakes])


def _events(
    fields: str | os.PathLike, found: pd.Series, events: int | Sequence[int] | str | os.PathLike | None, sites: int
) -> np.ndarray:
    """Return the ids of all events in increasing order, shape [event].

    Args:
        fields: The file of fields, for messages.
        found: Ids in the rows of the file.
        events: Argument of `read_ground_motion_field`.
        sites: Number of sites.
    """
    ids = pd.to_numeric(found, errors="coerce").to_numpy(np.float64)
    if not np.all((ids >= 0) & (ids == np.floor(ids)) & (ids < 2**62)):
        row = int(np.argmin((ids >= 0) & (ids == np.floor(ids))))
        raise ValueError(
            f"{fields}: the event {found.iloc[row]!r} is not a whole number of at least 0: correct the file"
        )
    last = int(ids.max())
    if isinstance(events, str | os.PathLike):
        path = existing_file("read_ground_motion_field", events)
        table = read_csv(path, comment="#")
        every = _distinct_events(str(path), table[_column(path, table, EVENTS)])
    elif isinstance(events, Sequence | np.ndarray):
        every = _distinct_events("read_ground_motion_field: events", pd.Series(events))
    else:
        count = last + 1 if events is None else whole_number("read_ground_motion_field: events", events, 1)
        if count * sites > MOST_VALUES:
            raise ValueError(
                f"{fields}: the largest event id is {last:,}, and {count:,} events at {sites:,} sites are more than "
                f"{MOST_VALUES:,} values: give events=, the file of the calculation's events, or split the files"
            )
        every = np.arange(count, dtype=np.float64)
    unknown = np.setdiff1d(ids, every)
    if unknown.size:
        raise ValueError(
            f"{fields}: the event {unknown[0]:g} is not among the events, {every[0]:g} to {every[-1]:g}: give events= "
            "of the same calculation"
        )
    silent = np.setdiff1d(every, ids)
    if silent.size:
        after = (
            ""
            if events is not None
            else f"; for weak events after {last:,} give the number of events, such as events={last + 1}"
        )
        warn_caller(
            f"{fields}: {counted([f'{each:g}' for each in silent])} of {every.size:,} events have no row: their "
            f"intensities are read as 0 at all sites{after}"
        )
    return every.astype(np.int64)


def _distinct_events(what: str, ids: pd.Series) -> np.ndarray:
    """Return event ids in increasing order; raise a ValueError if an id is repeated or is not a whole number."""
    found = pd.to_numeric(ids, errors="coerce").to_numpy(np.float64)
    good = found.size > 0 and bool(np.all((found >= 0) & (found == np.floor(found)) & (found < 2**62)))
    if not good or np.unique(found).size < found.size:
        raise ValueError(f"{what}: ids of events must be whole numbers of at least 0, without repetition")
    return np.sort(found)


def _measure_name(text: str) -> str:
    """Return the name of an intensity measure with its period as a decimal number: "SA(1)" becomes "SA(1.0)"."""
    name, _, period = text.partition("(")
    try:
        return f"SA({float(period.rstrip(')'))})" if name == "SA" else text
    except ValueError:
        return text


def _column(path: object, table: pd.DataFrame, names: tuple[str, ...] | list[str]) -> str:
    for name in names:
        if name in table:
            return name
    raise ValueError(
        f"{path}: there is no column {' or '.join(names)}; the columns are {', '.join(table.columns)}. Rename or add "
        "the column"
    )
