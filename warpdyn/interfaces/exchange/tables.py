"""Writer of results as tables for pandas and spreadsheets: CSV, Parquet and Excel."""

from __future__ import annotations

import importlib
import os
import re
from collections.abc import Sequence
from pathlib import Path
from typing import Any

import numpy as np
import pandas as pd
import xarray as xr

from warpdyn.campaigns.running.joining.duplicates import check_numbers
from warpdyn.foundations.core.checks import check_kind, is_row_of_text, one_of, shortened
from warpdyn.foundations.core.messages import tell
from warpdyn.foundations.core.near_misses import suggests_names
from warpdyn.interfaces.exchange.text_files import check_same_table, checked_path, write_in_place

FUNCTION = "write_table"
DEFAULT_ROWS = "damage_state"
WIDE = ("storey", "floor", "dof")  # dimensions that may be written as columns, one per storey, floor or dof
# File formats that need a further package: name of the format, name of the package, and its oldest allowed version.
NEEDED = {".parquet": ("Parquet", "pyarrow", "17"), ".xlsx": ("Excel", "openpyxl", "3.1")}
SHEET = (2**20, 2**14)  # largest number of rows and of columns in a sheet of Excel
SHEET_NAME = "warpdyn"
LARGEST_WHOLE = 10**15 - 1  # largest whole number whose digits a cell of Excel keeps
MOST_SHOWN = 4  # largest number of variables that a message names


@suggests_names
def write_table(
    dataset: xr.Dataset,
    path: str | os.PathLike,
    *,
    rows: str | Sequence[str] | None = None,
    overwrite: bool = False,
) -> Path:
    """Write a dataset of results as one table in a CSV, Parquet or Excel file.

    The table has one row per combination of the dimensions in `rows`, such as one row per sample, or one row per damage
    state and stripe (intensity level). The columns are:

    - The dimensions of the rows, and all variables with some or all of these dimensions. The unit is part of the name
      of the column: `fragility_median_g`, `peak_base_shear_N`. A value that does not depend on one of the dimensions is
      repeated along it.
    - For a variable that also has the dimension of storeys, floors or degrees of freedom, one column per storey, floor
      or degree of freedom, such as `peak_storey_drift_storey_2_m`, unless `rows` contains this dimension.
    - Variables that belong to an index in the row, such as `motion_name` for `motion_index`, and the name `archetype`
      for `archetype_index`.

    Flags such as `fit_status` are written as text. In a Parquet file, `DataFrame.attrs` contains the attributes of the
    dataset.

    Variables with other dimensions are left out. A message of the logger "warpdyn" (printed by default) names them, and
    the value of `rows` for a table that contains them.

    Args:
        dataset: Result of `simulate`, `fragility`, `capacities`, `annual_rates`, `annual_losses` or `damage_shares`.
        path: Path of the file that is written; its name ends in ".csv", ".parquet" or ".xlsx". Parquet needs the
            package pyarrow. Excel needs openpyxl and keeps 16 digits; whole numbers with more than 15 digits, such as
            `structure_identity` after `join`, are written as text.
        rows: Name or names of the dimensions of the rows. None: the only dimension, or "damage_state" if there are
            several.
        overwrite: If True, replace an existing file of any content. If False, replace only a table with the same
            columns.

    Returns:
        Path of the written file.

    Raises:
        ValueError: If the dataset has no such dimension or no variable with it; if `rows` is None and the dataset has
            several dimensions, but not "damage_state"; if runs were put together by xr.concat instead of `join`;
            or if the table has more rows or columns than a sheet of Excel.
        ImportError: If the file is Parquet and pyarrow is not installed, or Excel and openpyxl is not installed.
        TypeError: If `dataset` is not a Dataset.
        OSError: If the file cannot be written, or exists with other content and `overwrite` is False.

    Example:
        >>> path = wd.write_table(curves, "curves.csv")
        >>> pd.read_csv(path)["fragility_median_g"].round(2).tolist()
        [0.49, 1.24]
        >>> wd.write_table(curves, "stripes.parquet", rows=("damage_state", "stripe")).name
        'stripes.parquet'
    """
    path = checked_path(FUNCTION, path, ".csv", *NEEDED)
    check_kind(FUNCTION, "a Dataset", dataset, xr.Dataset)
    if path.suffix.lower() in NEEDED:  # checked before anything is computed
        kind, package, version = NEEDED[path.suffix.lower()]
        try:
            importlib.import_module(package)
        except ImportError:
            raise ImportError(
                f'{FUNCTION}: {kind} needs {package}, which is not installed: pip install "{package}>={version}", or '
                "write CSV"
            ) from None
    along = _row_dimensions(dataset, rows)
    if "sample" in along:
        check_numbers(FUNCTION, dataset)
    table, left_out = _table_of_rows(dataset, along)
    check_same_table(FUNCTION, path, table.columns, overwrite)
    _report_left_out(dataset, path, along, left_out)
    if path.suffix.lower() == ".csv":
        return write_in_place(path, lambda name: table.to_csv(name, index=False, lineterminator="\n"))
    if path.suffix.lower() == ".xlsx":
        _check_sheet(table)
        # An Excel cell cannot contain an infinite or missing number: the text "inf" or an empty cell is written.
        return write_in_place(path, lambda name: _write_sheet(table, name))
    table.attrs = {str(name): _plain(value) for name, value in dataset.attrs.items()}
    return write_in_place(path, lambda name: table.to_parquet(name, index=False))


def _check_sheet(table: pd.DataFrame) -> None:
    """Raise a ValueError if a table has more rows or columns than a sheet of Excel."""
    for count, most, noun in zip((len(table) + 1, len(table.columns)), SHEET, ("rows", "columns"), strict=True):
        if count > most:
            raise ValueError(
                f"{FUNCTION}: the table has {count:,} {noun}, but a sheet of Excel has at most {most:,}: write CSV or "
                "Parquet, or select a part of the dataset by isel(...)"
            )


def _write_sheet(table: pd.DataFrame, name: str) -> None:
    """Write a table as an Excel file; the name of the file may have any ending, because it is temporary.

    Columns of whole numbers with more digits than a cell keeps, such as `structure_identity`, are written as text.
    """
    long = [name for name, values in table.items() if values.dtype.kind in "iu" and values.abs().max() > LARGEST_WHOLE]
    table = table.astype(dict.fromkeys(long, str))
    with open(name, "wb") as file, pd.ExcelWriter(file, engine="openpyxl") as writer:
        table.to_excel(writer, sheet_name=SHEET_NAME, index=False, inf_rep="inf", freeze_panes=(1, 0))


def _row_dimensions(dataset: xr.Dataset, rows: str | Sequence[str] | None) -> tuple[str, ...]:
    """Return the names of the dimensions that the rows of the table have, in the order of the argument `rows`."""
    dimensions = [str(dimension) for dimension in dataset.sizes]
    if not dimensions:
        raise ValueError(
            f"{FUNCTION}: the dataset has no dimension for the rows, because its values are "
            "single numbers: write it by wd.write(dataset, 'result.nc')"
        )
    if rows is None:
        if len(dimensions) > 1 and DEFAULT_ROWS not in dimensions:
            raise ValueError(_which_rows(dimensions))
        return (dimensions[0] if len(dimensions) == 1 else DEFAULT_ROWS,)
    if not isinstance(rows, str) and not is_row_of_text(rows):
        raise TypeError(
            f"{FUNCTION}: rows must be the name of a dimension or a list of such names, got {shortened(rows)}: give "
            f"rows={dimensions[0]!r}"
        )
    chosen = (rows,) if isinstance(rows, str) else tuple(rows)
    for dimension in chosen:
        one_of("dimension of rows", dimension, dimensions)
    if not chosen or len(set(chosen)) < len(chosen):
        raise ValueError(
            f"{FUNCTION}: rows must name one or more different dimensions, got {rows!r}: give rows={dimensions[0]!r}"
        )
    return chosen


def _which_rows(dimensions: list[str]) -> str:
    """Return the error message for a dataset with several dimensions and without "damage_state"; it suggests `rows`."""
    choices = [repr(name) for name in dimensions[:1]]
    choices += [f"({dimensions[0]!r}, {other!r})" for other in dimensions if other in WIDE][:1]
    return (
        f"{FUNCTION}: the dataset has the dimensions {', '.join(dimensions)}: choose those of the rows, such as "
        f"rows={' or rows='.join(choices)}"
    )


def _table_of_rows(dataset: xr.Dataset, rows: tuple[str, ...]) -> tuple[pd.DataFrame, list[str]]:
    """Return the table of all variables that fit into rows with these dimensions, and the names of other variables."""
    is_wide = not set(rows) & set(WIDE)
    found: dict[str, xr.Variable] = {}  # keys: names of the columns without units
    left_out: list[str] = []
    # Order of the columns: dimensions, other coordinates, variables.
    names = sorted(map(str, dataset.variables), key=lambda name: (name not in rows, name not in dataset.coords))
    for name in [*(row for row in rows if row not in dataset.variables), *names]:
        variable = _of_rows(dataset, name, rows)
        extra = [str(dimension) for dimension in variable.dims if dimension not in rows]
        if variable.dims and not extra:
            found[name] = variable
        elif is_wide and extra and set(extra) < set(variable.dims) and set(extra) <= set(WIDE):
            for position in np.ndindex(*(variable.sizes[dimension] for dimension in extra)):
                at = dict(zip(extra, position, strict=True))
                label = "_".join(f"{each}_{_label(dataset, each, at[each])}" for each in extra)
                found[f"{name}_{label}"] = variable.isel(at)
        elif name not in dataset.dims:
            left_out.append(name)
    if not set(found) - set(rows):
        raise ValueError(
            f"{FUNCTION}: no variable has only the dimensions {', '.join(rows)}: choose rows= from "
            + ", ".join(f"{name}({', '.join(map(str, dataset[name].dims))})" for name in dataset.data_vars)
        )
    shape = tuple(dataset.sizes[dimension] for dimension in rows)
    columns: dict[str, np.ndarray] = {}
    for name in [*rows, *(name for name in found if name not in rows)]:
        label = column_name(name, found[name].attrs.get("units"))
        if label in columns:
            raise ValueError(f"{FUNCTION}: two columns would have the name {label!r}: rename a variable by .rename()")
        values = _decoded(found[name]).set_dims(dict(zip(rows, shape, strict=True))).transpose(*rows)
        columns[label] = values.values.reshape(-1)
    return pd.DataFrame(columns), left_out


def _of_rows(dataset: xr.Dataset, name: str, rows: tuple[str, ...]) -> xr.Variable:
    """Return a variable of the dataset for rows with the given dimensions.

    If the rows have an index for a dimension of the variable, such as `motion_index` for `motion`, the values at this
    index are returned.
    """
    if name not in dataset.variables:
        return xr.Variable(name, np.arange(dataset.sizes[name]))
    variable = dataset[name].variable
    if name in dataset.dims and (name in rows or variable.dtype.kind not in "UO"):  # a name is needed, a number is not
        return variable
    for dimension in variable.dims:
        index = dataset.variables.get(f"{dimension}_index")
        if dimension not in rows and index is not None and index.dims and set(index.dims) <= set(rows):
            if index.size and (index.values.min() < 0 or index.values.max() >= variable.sizes[dimension]):
                continue  # not an index for this dimension
            variable = variable.isel({dimension: index})
    return variable


def _label(dataset: xr.Dataset, dimension: str, position: int) -> object:
    """Return the coordinate value at a position along a dimension; if it has no coordinate, return the position."""
    return dataset[dimension].values[position] if dimension in dataset.coords else position


def _report_left_out(dataset: xr.Dataset, path: Path, rows: tuple[str, ...], names: list[str]) -> None:
    """Report the variables that a table does not contain, with the value of `rows` for a table that contains them."""
    by_rows: dict[str, list[str]] = {}
    for name in names:
        dimensions = tuple(map(str, dataset[name].dims))
        argument = repr(dimensions[0] if len(dimensions) == 1 else dimensions) if dimensions else ""
        by_rows.setdefault(argument, []).append(name)
    parts = []
    for argument, group in by_rows.items():
        more = f" and {len(group) - MOST_SHOWN} more" if len(group) > MOST_SHOWN else ""
        parts.append(f"{', '.join(group[:MOST_SHOWN])}{more} ({f'rows={argument}' if argument else 'a single value'})")
    if parts:
        tell(
            f"{FUNCTION}: {path.name} has one row per {' and '.join(rows)} and does not contain {'; '.join(parts)}: "
            "write another table with this rows= for them"
        )


def column_name(name: str, units: object) -> str:
    """Return the name of a column with its unit, such as `peak_floor_acceleration_m_per_s2` for "m s-2".

    Nothing is added for the unit "1" or a missing unit.
    """
    over: list[str] = []
    under: list[str] = []
    for symbol, power in re.findall(r"([A-Za-z%]+)\^?(-?\d+)?", str(units or "").replace("percent", "%")):
        power = int(power or 1)
        word = {"%": "percent"}.get(symbol, symbol) + (str(abs(power)) if abs(power) > 1 else "")
        (over if power > 0 else under).append(word)
    per = ["per", *under] if under else []
    return "_".join([name, *over, *per])


def _decoded(variable: xr.Variable) -> xr.Variable:
    """Return a variable of flags as text, by its attribute `flag_meanings`; return any other variable unchanged."""
    meanings = str(variable.attrs.get("flag_meanings", "")).split()
    codes = np.atleast_1d(variable.attrs.get("flag_values", ()))
    if not meanings or len(meanings) != len(codes):
        return variable
    text = np.full(variable.shape, "", dtype=f"U{max(map(len, meanings))}")
    for code, meaning in zip(codes, meanings, strict=True):
        text[variable.values == code] = meaning
    return xr.Variable(variable.dims, text)


def _plain(value: Any) -> Any:
    """Return the value of an attribute in a type that JSON can store."""
    if isinstance(value, np.ndarray | np.generic):
        return value.tolist()
    return value if isinstance(value, str | int | float | bool | list) else str(value)
