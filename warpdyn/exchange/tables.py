"""Long tables of results, as pandas and spreadsheets take them: CSV and Parquet."""

from __future__ import annotations

import os
import re
from collections.abc import Sequence
from pathlib import Path
from typing import Any

import numpy as np
import pandas as pd
import xarray as xr

from warpdyn.core.checks import check_kind, is_row_of_text, one_of, shortened
from warpdyn.core.near_misses import suggests_names
from warpdyn.exchange.text_files import checked_path, write_in_place

FUNCTION = "write_table"
DEFAULT_ROWS = "damage_state"


@suggests_names
def write_table(dataset: xr.Dataset, path: str | os.PathLike, *, rows: str | Sequence[str] | None = None) -> Path:
    """Write results as one long table, CSV or Parquet, that plain pandas reads.

    A table has one row for each combination of the dimensions of its rows, such as one a damage state, or one a damage
    state and stripe. Its columns are these dimensions and all variables along them (along some of them: the values are
    repeated), with the unit in the name: `fragility_median_g`, `peak_floor_acceleration_m_per_s2`; what has no unit has
    its plain name. Flags such as `fit_status` are written as what they mean. A Parquet file has the dataset's
    attributes in `DataFrame.attrs`.

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
    table = _long_table(dataset, _row_dimensions(dataset, rows))
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
            raise ValueError(f"{FUNCTION}: say by rows= which of the dimensions {', '.join(dimensions)} rows are along")
        return (dimensions[0] if len(dimensions) == 1 else DEFAULT_ROWS,)
    if not isinstance(rows, str) and not is_row_of_text(rows):
        raise TypeError(f"{FUNCTION}: rows must be the name of a dimension or several, got {shortened(rows)}")
    chosen = (rows,) if isinstance(rows, str) else tuple(rows)
    for dimension in chosen:
        one_of("dimension of rows", dimension, dimensions)
    if not chosen or len(set(chosen)) < len(chosen):
        raise ValueError(f"{FUNCTION}: rows must name dimensions, each once, got {rows!r}")
    return chosen


def _long_table(dataset: xr.Dataset, rows: tuple[str, ...]) -> pd.DataFrame:
    """Return the table of all variables along some or all of the dimensions of rows, and along no other."""
    kept = [name for name, variable in dataset.variables.items() if variable.dims and set(variable.dims) <= set(rows)]
    if not set(kept) - set(rows):
        raise ValueError(
            f"{FUNCTION}: no variable lies along {' and '.join(rows)} alone; the dataset has "
            + ", ".join(f"{name}({', '.join(map(str, dataset[name].dims))})" for name in dataset.data_vars)
        )
    # Dimensions, other coordinates, variables.
    kept.sort(key=lambda name: (name not in rows, name not in dataset.coords))
    names = [*rows, *(name for name in kept if name not in rows)]
    shape = tuple(dataset.sizes[dimension] for dimension in rows)
    columns: dict[str, np.ndarray] = {}
    for name in names:
        variable = (
            dataset[name].variable if name in dataset.variables else xr.Variable(name, np.arange(dataset.sizes[name]))
        )
        label = column_name(str(name), variable.attrs.get("units"))
        if label in columns:
            raise ValueError(f"{FUNCTION}: two variables would be called {label!r}; rename one of them")
        values = _decoded(variable).set_dims(dict(zip(rows, shape, strict=True))).transpose(*rows)
        columns[label] = values.values.reshape(-1)
    return pd.DataFrame(columns)


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
