"""Reader of demand samples of pelicun, SimCenter's engine for loss assessment by FEMA P-58."""

from __future__ import annotations

import csv
import io
import os
import re
from collections.abc import Mapping

import numpy as np
import pandas as pd
import xarray as xr

from warpdyn.foundations.core.checks import one_of, whole_number
from warpdyn.foundations.core.messages import amount_of
from warpdyn.foundations.core.output_variables import DAMPING, MEASURE, PERIOD, label_of_levels
from warpdyn.foundations.core.units import STANDARD_GRAVITY, unit_attributes
from warpdyn.foundations.files.text import check_names, check_separator, read_csv_text
from warpdyn.model.ground_motions.measures.names import measure_named

FUNCTION = "read_pelicun_demands"
# Factors from units of pelicun to SI units. pelicun uses the factor 1 for an unknown unit; warpdyn raises an error.
ACCELERATIONS = {"mps2": 1.0, "g": STANDARD_GRAVITY, "inps2": 0.0254, "inchps2": 0.0254, "ftps2": 0.3048}
RATIOS = {"rad": 1.0, "unitless": 1.0}
VELOCITIES = {"mps": 1.0, "cmps": 0.01, "inps": 0.0254, "inchps": 0.0254, "ftps": 0.3048}
LENGTHS = {"m": 1.0, "cm": 0.01, "mm": 0.001, "in": 0.0254, "inch": 0.0254, "ft": 0.3048}
FACTORS = {"PFA": ACCELERATIONS, "PID": RATIOS, "RID": RATIOS, "PGA": ACCELERATIONS, "SA": ACCELERATIONS}
FACTORS |= {"PGV": VELOCITIES, "PGD": LENGTHS}


def read_pelicun_demands(
    path: str | os.PathLike, *, direction: int = 1, units: Mapping[str, str] | None = None
) -> xr.Dataset:
    """Read the demands in one direction from a demand sample of pelicun, which warpdyn or another program wrote.

    Args:
        path: Path of the CSV file, with columns `[event-]TYPE-location-direction` and a row of units below their names.
        direction: Number of the direction whose demands are read; columns of other directions are ignored.
        units: Unit of each kind of demand, for a file without a row of units, such as
            `{"PFA": "mps2", "PID": "rad", "SA": "g"}`. If the file has a row of units, both must agree.

    Returns:
        Dataset like the result of `simulate`, with the variables that the file contains:
            `peak_storey_drift_ratio(sample, storey)` [1], `residual_drift_ratio(sample, storey)` [1],
            `peak_floor_acceleration(sample, floor)` [m/s2] and `peak_ground_acceleration(sample)` [m/s2] (floor 0).
            `failed(sample)` is 1 for a sample with ERROR in the file, else 0. The intensity measure is the coordinate
            `im_level(sample)` [g; PGV in m/s, PGD in m]. If the file has several measures, each is a coordinate with
            the name that pelicun uses. A collapsed sample has NaN, or a drift ratio at or above the collapse limit with
            which the file was written.

    Raises:
        ValueError: If a unit is missing or wrong for the demand, if a column occurs twice, if a value is infinite or
            negative (residual drifts may be negative), or if there is no demand in this direction. The error names the
            file.
        FileNotFoundError: If the file does not exist.
        TypeError: If `path` is not a path.

    Example:
        >>> path = wd.write_pelicun_demands(run, "demands.csv", level=0.4, collapse_drift_ratio=0.1)  # g
        >>> demands = wd.read_pelicun_demands(path)
        >>> demands["peak_storey_drift_ratio"].sizes["storey"]
        2
    """
    direction = whole_number("direction", direction, 0)
    text = read_csv_text(FUNCTION, path)
    try:
        head = text.partition("\n")[0]
        check_separator(head)
        check_names(next(csv.reader([head])))
    except ValueError as error:
        raise ValueError(f"{FUNCTION}: {path}: {error}") from None
    try:
        table = pd.read_csv(io.StringIO(text), index_col=0, dtype=str, keep_default_na=False)
    except (pd.errors.ParserError, pd.errors.EmptyDataError) as error:
        raise ValueError(f"{FUNCTION}: {path} is not CSV: {' '.join(str(error).split())}. Export it again") from None
    rows = [row for row in table.index if str(row).strip().lower() == "units"]
    if len(rows) > 1 or (not rows and units is None):
        raise ValueError(
            f"{FUNCTION}: {path} has {len(rows)} rows of units, but it must have one, directly below the names, such "
            "as "
            "'Units,mps2,rad': add or keep only this row, or remove all and give units={'PFA': 'mps2', 'PID': 'rad'}"
        )
    of_columns, table = (table.loc[rows[0]], table.drop(index=rows[0])) if rows else (None, table)
    given = _given_units(units)
    found: dict[str, dict[int, np.ndarray]] = {}
    failed = np.zeros(len(table), dtype=np.int8)
    for name in table.columns:
        parts = [part.strip() for part in str(name).split("-")]
        if "ERROR" in parts[:2]:
            failed |= (_numbers(path, name, table[name], False) != 0).astype(np.int8)
            continue
        kind, place, along = parts[-3:] if len(parts) in (3, 4) else ("", "", "")
        kind = kind.upper()
        if not (place.isdigit() and along.isdigit()):
            raise ValueError(
                f"{FUNCTION}: {path} has a column {name!r}; names must be [event-]TYPE-location-direction, such as "
                "1-PID-1-1: rename the column"
            )
        family = kind.partition("_")[0]
        if int(along) != direction or family not in FACTORS:
            continue
        if of_columns is None and family not in given:
            raise ValueError(
                f"{FUNCTION}: {path} has no row of units, and units= has no unit of {family}: give units={{..., "
                f"{family!r}: {next(iter(FACTORS[family]))!r}}}"
            )
        unit = given[family] if of_columns is None else of_columns[name].strip()
        if of_columns is not None and given.get(family, unit) != unit:
            raise ValueError(
                f"{FUNCTION}: {path}: column {name!r} is in {unit!r}, but units= has {given[family]!r} for {family}: "
                "remove units="
            )
        if unit not in FACTORS[family]:
            allowed = ", ".join(FACTORS[family])
            raise ValueError(
                f"{FUNCTION}: {path}: column {name!r} is in {unit!r}; units of {kind} are {allowed}: convert it"
            )
        by_place = found.setdefault(kind, {})
        if int(place) in by_place:
            raise ValueError(
                f"{FUNCTION}: {path} has {kind} at location {place} of direction {direction} twice: remove one of "
                "these columns"
            )
        by_place[int(place)] = _numbers(path, name, table[name], family != "RID") * FACTORS[family][unit]
    if not found:
        raise ValueError(f"{FUNCTION}: {path} has no demand in direction {direction}: give another direction=")
    return _labelled(found, failed)


def _given_units(units: Mapping[str, str] | None) -> Mapping[str, str]:
    """Return the argument `units` as a mapping; raise an error unless it maps kinds of demand to known units."""
    if units is None:
        return {}
    if not isinstance(units, Mapping):
        raise TypeError(f"{FUNCTION}: units must map kinds of demand to units, got {units!r}: give {{'PID': 'rad'}}")
    for kind, unit in units.items():
        one_of("kind of demand in units", kind, FACTORS)
        one_of(f"unit of {kind}", unit, FACTORS[kind])
    return units


def _numbers(path: object, name: object, column: pd.Series, is_magnitude: bool) -> np.ndarray:
    """Return a column as numbers, NaN for empty cells; infinite values and negative magnitudes raise an error."""
    words = [re.sub(r"^(nan|na|n/a|)$", "nan", word.strip(), flags=re.IGNORECASE) for word in column]
    try:
        values = np.array([float(word) for word in words])
    except ValueError as error:
        raise ValueError(
            f"{FUNCTION}: {path}: column {name!r} must contain numbers: {error}. Correct the file"
        ) from None
    bad = np.isinf(values) | (is_magnitude & (values < 0))
    if bad.any():
        row = int(bad.argmax())
        raise ValueError(
            f"{FUNCTION}: {path}: column {name!r} has {amount_of(int(bad.sum()), 'impossible value')}, the first is "
            f"{values[row]:g} of sample {column.index[row]}; they must be "
            f"finite{' and at least 0' if is_magnitude else ''}: correct the file"
        )
    return values


def _labelled(found: dict[str, dict[int, np.ndarray]], failed: np.ndarray) -> xr.Dataset:
    """Return a dataset with one variable per kind of demand, from values by kind and location, and failed samples."""
    numbers = {"sample": np.arange(len(failed), dtype=np.int32)}
    dataset = xr.Dataset(
        {"failed": ("sample", failed, {"long_name": "1 if the sample failed, else 0", "units": "1"})}, numbers
    )
    ground = found.get("PFA", {}).pop(0, None)
    if ground is not None:
        said = {"long_name": "peak ground acceleration of the scaled motion", "units": "m s-2"}
        dataset["peak_ground_acceleration"] = "sample", ground, said
    for kind, name, along, long_name, units in (
        ("PID", "peak_storey_drift_ratio", "storey", "peak absolute storey drift ratio", "1"),
        ("RID", "residual_drift_ratio", "storey", "residual storey drift ratio", "1"),
        ("PFA", "peak_floor_acceleration", "floor", "peak absolute floor acceleration", "m s-2"),
    ):
        by_place = found.pop(kind, {})
        if by_place:
            places = sorted(by_place)
            values = np.stack([by_place[place] for place in places], axis=1)
            own = xr.DataArray(
                values, {along: places}, ("sample", along), name, {"long_name": long_name, "units": units}
            )
            dataset[name] = own
    for kind, by_place in found.items():
        family, _, period = kind.partition("_")
        known = measure_named(f"SA({period})" if period else family)
        if known is None:
            raise ValueError(
                f"{FUNCTION}: the period of {kind!r} must be above 0 s, as in 1-SA_0.75-0-1: rename the column"
            )
        units, measure = known.level_units, known.name
        text: dict[str, object] = {"long_name": label_of_levels(measure), MEASURE: measure, **unit_attributes(units)}
        text |= {PERIOD: float(period), DAMPING: 0.05} if period else {}
        values = by_place[min(by_place)] / (STANDARD_GRAVITY if units == "g" else 1.0)
        name = "im_level" if len(found) == 1 else kind  # several measures: the names in pelicun
        dataset = dataset.assign_coords({name: ("sample", values, text)})
    return dataset
