"""Intensities at the stations (grid points) of SimCenter's EventGrid.csv."""

from __future__ import annotations

import os
import re
from pathlib import Path

import numpy as np
import xarray as xr

from warpdyn.foundations.core.units import STANDARD_GRAVITY
from warpdyn.model.sites.grid_stations import (
    MOTIONS,
    acceleration_factor,
    number_of_station,
    read_stations,
    warn_of_points_left_out,
)
from warpdyn.model.sites.intensity_fields import field_dataset

MEASURES = ("PGA", "PGV", "PGD", "IA", "CAV")  # measures that, like SA, are never below 0
LENGTHS = {"m": 1.0, "cm": 0.01, "mm": 1e-3, "in": 0.0254, "ft": 0.3048}  # [m]; units of PGD and, per second, of PGV
_SPECTRAL = re.compile(r"P?SA[_( ]*(\d+(?:\.\d+)?) *s?\)?", re.IGNORECASE)


def read_intensity_grid(path: str | os.PathLike, unit: str | None = None) -> xr.Dataset:
    """Read the intensities at the points of a grid, in the format of SimCenter's R2D tool.

    The folder has the same files as in `read_event_grid`, but no motions. The file of a point has one column per
    intensity measure, such as `PGA` or `SA(0.3)` (also written `SA_0.3`), and one row per earthquake. The name of a
    column may contain its unit: `PGA [in/s2]`, `SA_0.3 [g]`, `PGV [cm/s]`.

    Args:
        path: EventGrid.csv, or its folder.
        unit: Unit of accelerations in columns without a unit: one of `records.UNITS`, or R2D's "g", "mps2", "inps2" or
            "ftps2". There is no default, because R2D's files are in the unit that its user chose in the input panel.

    Returns:
        Dataset with the fields `PGA`, `SA(0.3)` and so on, dimensions (earthquake, point), in g, and the coordinates
        `longitude` and `latitude`. PGV and PGD are in m/s and m if their columns give the unit. Other measures are
        unchanged and have no unit. Points without coordinates or with NaN are removed; a warning counts and names
        these points. Give one of the fields to `scale_records`.

    Raises:
        ValueError: As in `read_event_grid`; or if the unit of accelerations is missing or differs from that of a
            column, points have different columns, or an intensity is below 0 or infinite.
        TypeError, FileNotFoundError: As in `read_event_grid`.

    Example:
        >>> field = wd.sites.read_intensity_grid("intensities/EventGrid.csv", unit="g")["SA(1.0)"]
        >>> field.dims, field.attrs["units"]
        (('earthquake', 'point'), 'g')
    """
    file, names, (longitude, latitude), rows = read_stations("read_intensity_grid", path)
    columns = [str(name) for name in rows[0][0]]
    if MOTIONS in columns:
        raise ValueError(f"{file}: {names[0]} has the column {MOTIONS!r}: use read_event_grid, which reads motions")
    for name, of_point in zip(names, rows, strict=True):
        if of_point[0].keys() != rows[0][0].keys():
            raise ValueError(
                f"{file}: {name} has the columns {', '.join(of_point[0])}, and {names[0]} has {', '.join(columns)}: "
                "all points must have the same measures in the same units. Use the same columns in all files"
            )
    fields, kept = {}, np.ones(len(names), dtype=bool)
    for column in columns:
        measure, units, factor = _measure_of_column(file, names[0], column, unit)
        least = 0.0 if measure.startswith("SA(") or measure in MEASURES else None
        values = np.array(
            [
                [
                    number_of_station(
                        f"{file.parent / name}, row {i + 1}: {column}", row.get(column) or "", least=least
                    )
                    for i, row in enumerate(of_point)
                ]
                for name, of_point in zip(names, rows, strict=True)
            ]
        )
        if measure in fields:
            raise ValueError(f"{file}: {names[0]} has the measure {measure} in two columns: remove one")
        kept &= ~np.isnan(values).any(axis=1)
        fields[measure] = factor * values.T, units
    warn_of_points_left_out(file, names, kept, "NaN among their intensities")
    fields = {measure: (values[:, kept], units) for measure, (values, units) in fields.items()}
    names = [name for name, is_kept in zip(names, kept, strict=True) if is_kept]
    return field_dataset(str(file), longitude[kept], latitude[kept], fields, names)


def _measure_of_column(file: Path, station: str, column: str, unit: str | None) -> tuple[str, str, float]:
    """Return the measure in a column, the unit of its field, and the factor that converts the column to this unit."""
    bare, _, own = column.strip().partition("[")
    bare, own = bare.strip(), own.rstrip("] ").strip()
    spectral = _SPECTRAL.fullmatch(bare)
    measure = f"SA({float(spectral[1])})" if spectral else bare
    where = f"{file}: column {column!r} of {station}"
    if not spectral and measure != "PGA":
        if measure not in ("PGV", "PGD") or not own:
            return measure, "", 1.0
        per = "/s" if measure == "PGV" else ""
        length = own.removesuffix("ps").removesuffix("/s") if per else own
        if length not in LENGTHS or (per and own == length):
            raise ValueError(f"{where} has the unit {own!r}; allowed are {', '.join(each + per for each in LENGTHS)}")
        return measure, "m s-1" if per else "m", LENGTHS[length]
    if not own and unit is None:
        raise ValueError(
            f"{where} does not give the unit of the acceleration: give unit=, such as unit='g' or unit='inps2', the "
            "unit of R2D's input panel"
        )
    factor = acceleration_factor(own or str(unit), where)
    if own and unit is not None and factor != acceleration_factor(unit, "read_intensity_grid"):
        raise ValueError(f"{where} has the unit {own!r}, but unit={unit!r} is given: remove unit=")
    return measure, "g", factor / STANDARD_GRAVITY
