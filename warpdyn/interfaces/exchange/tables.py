"""Tables of results, as pandas and spreadsheets read them: CSV and Parquet."""

from __future__ import annotations

import os
import re
from collections.abc import Sequence
from pathlib import Path
from typing import Any

import numpy as np
import pandas as pd
import xarray as xr

from warpdyn.foundations.core.checks import check_kind, is_row_of_text, one_of, shortened
from warpdyn.foundations.core.messages import tell
from warpdyn.foundations.core.near_misses import suggests_names
from warpdyn.interfaces.exchange.text_files import checked_path, write_in_place

FUNCTION = "write_table"
DEFAULT_ROWS = "damage_state"
PLACES = ("storey", "floor", "dof")  # dimensions that may have a column for each of their places
MOST_SHOWN = 4  # names of variables in a message


@suggests_names
def write_table(dataset: xr.Dataset, path: str | os.PathLike, *, rows: str | Sequence[str] | None = None) -> Path:
    """Write results as one table, CSV or Parquet, that plain pandas reads.

    A table has one row for each combination of the dimensions of its rows, such as one per sample, or one per damage
    state and stripe. Its columns are these dimensions and all variables along some or all of them, with the unit in the
    name: `fragility_median_g`, `peak_base_shear_N`; what has no unit has its plain name. Values along fewer dimensions
    are repeated. Variables along storeys, floors or degrees of freedom besides have one column for each, such as
    `peak_storey_drift_storey_2_m`, unless rows are along one of these. What each sample has by an index, such as
    `motion_name` by `motion_index`, is in its row. Flags such as `fit_status` are written as what they mean. A Parquet
    file has the dataset's attributes in `DataFrame.attrs`.

    A message (to the logger "warpdyn", which prints it) names the variables that a table of these rows does not contain
    and the `rows` of another table for them.

    Args:
        dataset: What `fragility`, `capacities`, `annual_rates`, `annual_losses` or `damage_shares` returned, or a run.
        path: The file, whose name ends in ".csv" or ".parquet"; an older one is replaced. Parquet needs pyarrow.
        rows: The dimensions that rows are along. None takes the only one, or "damage_state" of several.

    Returns:
        The path.

    Raises:
        ValueError: If the dataset has no such dimension or nothing along it, or has several without "damage_state" and
            `rows` does not say which.
        ImportError: If the file is Parquet and pyarrow is not installed.
        TypeError: If `dataset` is no Dataset.
        OSError: If the file cannot be written.

    Example:
        >>> path = wd.write_table(curves, "curves.csv")
        >>> pd.read_csv(path)["fragility_median_g"].round(2).tolist()
        [0.49, 1.24]
        >>> wd.write_table(curves, "stripes.parquet", rows=("damage_state", "stripe")).name
        'stripes.parquet'
    """
    path = checked_path(FUNCTION, path, ".csv", ".parquet")
    check_kind(FUNCTION, "a Dataset", dataset, xr.Dataset)
    if path.suffix.lower() == ".parquet":
        try:
            import pyarrow  # noqa: F401 # asked for before anything is computed
        except ImportError:
            raise ImportError(
                f'{FUNCTION}: Parquet is written by pyarrow, which is not installed: pip install "pyarrow>=17", '
                "or write CSV"
            ) from None
    along = _row_dimensions(dataset, rows)
    table, left_out = _table_of_rows(dataset, along)
    _tell_of_left_out(dataset, path, along, left_out)
    if path.suffix.lower() == ".csv":
        return write_in_place(path, lambda name: table.to_csv(name, index=False, lineterminator="\n"))
    table.attrs = {str(name): _plain(value) for name, value in dataset.attrs.items()}
    return write_in_place(path, lambda name: table.to_parquet(name, index=False))


def _row_dimensions(dataset: xr.Dataset, rows: str | Sequence[str] | None) -> tuple[str, ...]:
    """Return the dimensions of the table's rows, in the order asked for."""
    dimensions = [str(dimension) for dimension in dataset.sizes]
    if not dimensions:
        raise ValueError(f"{FUNCTION}: the dataset has no dimension that rows could be along")
    if rows is None:
        if len(dimensions) > 1 and DEFAULT_ROWS not in dimensions:
            raise ValueError(_which_rows(dimensions))
        return (dimensions[0] if len(dimensions) == 1 else DEFAULT_ROWS,)
    if not isinstance(rows, str) and not is_row_of_text(rows):
        raise TypeError(f"{FUNCTION}: rows must be the name of a dimension or several, got {shortened(rows)}")
    chosen = (rows,) if isinstance(rows, str) else tuple(rows)
    for dimension in chosen:
        one_of("dimension of rows", dimension, dimensions)
    if not chosen or len(set(chosen)) < len(chosen):
        raise ValueError(f"{FUNCTION}: rows must name dimensions, each once, got {rows!r}")
    return chosen


def _which_rows(dimensions: list[str]) -> str:
    """Return what to say of a dataset of several dimensions of which none is that of the rows by default."""
    choices = [repr(name) for name in dimensions[:1]]
    choices += [f"({dimensions[0]!r}, {other!r})" for other in dimensions if other in PLACES][:1]
    return (
        f"{FUNCTION}: the dataset has the dimensions {', '.join(dimensions)}: choose one row per combination of some, "
        f"such as rows={' or rows='.join(choices)}"
    )


def _table_of_rows(dataset: xr.Dataset, rows: tuple[str, ...]) -> tuple[pd.DataFrame, list[str]]:
    """Return the table of all variables that fit into rows along some dimensions, and the names of the others."""
    is_wide = not set(rows) & set(PLACES)
    found: dict[str, xr.Variable] = {}  # by what the column is called without its unit
    left_out: list[str] = []
    # Dimensions, other coordinates, variables.
    names = sorted(map(str, dataset.variables), key=lambda name: (name not in rows, name not in dataset.coords))
    for name in [*(row for row in rows if row not in dataset.variables), *names]:
        variable = _of_rows(dataset, name, rows)
        extra = [str(dimension) for dimension in variable.dims if dimension not in rows]
        if variable.dims and not extra:
            found[name] = variable
        elif is_wide and extra and set(extra) < set(variable.dims) and set(extra) <= set(PLACES):
            for place in np.ndindex(*(variable.sizes[dimension] for dimension in extra)):
                at = dict(zip(extra, place, strict=True))
                label = "_".join(f"{each}_{_label(dataset, each, at[each])}" for each in extra)
                found[f"{name}_{label}"] = variable.isel(at)
        elif name not in dataset.dims:
            left_out.append(name)
    if not set(found) - set(rows):
        raise ValueError(
            f"{FUNCTION}: no variable lies along {' and '.join(rows)} alone; the dataset has "
            + ", ".join(f"{name}({', '.join(map(str, dataset[name].dims))})" for name in dataset.data_vars)
        )
    shape = tuple(dataset.sizes[dimension] for dimension in rows)
    columns: dict[str, np.ndarray] = {}
    for name in [*rows, *(name for name in found if name not in rows)]:
        label = column_name(name, found[name].attrs.get("units"))
        if label in columns:
            raise ValueError(f"{FUNCTION}: two variables would be called {label!r}; rename one of them")
        values = _decoded(found[name]).set_dims(dict(zip(rows, shape, strict=True))).transpose(*rows)
        columns[label] = values.values.reshape(-1)
    return pd.DataFrame(columns), left_out


def _of_rows(dataset: xr.Dataset, name: str, rows: tuple[str, ...]) -> xr.Variable:
    """Return a variable; of one along a dimension that rows have an index into, its values at these indices."""
    if name not in dataset.variables:
        return xr.Variable(name, np.arange(dataset.sizes[name]))
    variable = dataset[name].variable
    if name in dataset.dims:
        return variable
    for dimension in variable.dims:
        index = dataset.variables.get(f"{dimension}_index")
        if dimension not in rows and index is not None and index.dims and set(index.dims) <= set(rows):
            if index.size and (index.values.min() < 0 or index.values.max() >= variable.sizes[dimension]):
                continue  # not into this dimension
            variable = variable.isel({dimension: index})
    return variable


def _label(dataset: xr.Dataset, dimension: str, place: int) -> object:
    """Return what a place along a dimension is called: its coordinate, or its number from 0."""
    return dataset[dimension].values[place] if dimension in dataset.coords else place


def _tell_of_left_out(dataset: xr.Dataset, path: Path, rows: tuple[str, ...], names: list[str]) -> None:
    """Say which variables a table does not contain, and how another one does."""
    by_rows: dict[str, list[str]] = {}
    for name in names:
        dimensions = tuple(map(str, dataset[name].dims))
        told = repr(dimensions[0] if len(dimensions) == 1 else dimensions) if dimensions else ""
        by_rows.setdefault(told, []).append(name)
    parts = []
    for told, of_rows in by_rows.items():
        shown = ", ".join(of_rows[:MOST_SHOWN]) + (
            f" and {len(of_rows) - MOST_SHOWN} more" if len(of_rows) > MOST_SHOWN else ""
        )
        parts.append(f"{shown} (rows={told})" if told else f"{shown} (a single value)")
    if parts:
        tell(
            f"{FUNCTION}: {path.name} has one row per {' and '.join(rows)} and does not contain {'; '.join(parts)}: "
            "write another table with these rows for them"
        )


def column_name(name: str, units: object) -> str:
    """Return a name with its unit: "m s-2" gives `_m_per_s2`, "1" and text nothing."""
    over: list[str] = []
    under: list[str] = []
    for symbol, power in re.findall(r"([A-Za-z%]+)\^?(-?\d+)?", str(units or "").replace("percent", "%")):
        power = int(power or 1)
        word = {"%": "percent"}.get(symbol, symbol) + (str(abs(power)) if abs(power) > 1 else "")
        (over if power > 0 else under).append(word)
    per = ["per", *under] if under else []
    return "_".join([name, *over, *per])


def _decoded(variable: xr.Variable) -> xr.Variable:
    """Return a flag variable as the text that its values mean, others as they are."""
    meanings = str(variable.attrs.get("flag_meanings", "")).split()
    codes = np.atleast_1d(variable.attrs.get("flag_values", ()))
    if not meanings or len(meanings) != len(codes):
        return variable
    text = np.full(variable.shape, "", dtype=f"U{max(map(len, meanings))}")
    for code, meaning in zip(codes, meanings, strict=True):
        text[variable.values == code] = meaning
    return xr.Variable(variable.dims, text)


def _plain(value: Any) -> Any:
    """Return an attribute as what JSON holds."""
    if isinstance(value, np.ndarray | np.generic):
        return value.tolist()
    return value if isinstance(value, str | int | float | bool | list) else str(value)
