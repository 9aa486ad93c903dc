"""The inventory, a table that all readers of inventories return, and the checks of its values."""

from __future__ import annotations

from collections.abc import Callable, Mapping
from typing import Any

import numpy as np
import pandas as pd
import xarray as xr

from warpdyn.foundations.core.checks import shortened
from warpdyn.foundations.core.messages import warn_caller
from warpdyn.foundations.core.near_misses import did_you_mean
from warpdyn.foundations.files.text import check_names, comma_hint, separator_hint

# Names of the columns with a meaning, in the order in which the inventory has them.
NEEDED = ("id", "longitude", "latitude")
COLUMNS = (*NEEDED, "storeys", "year", "occupancy", "structure_type", "plan_area", "replacement_cost", "number")
TEXTS = ("occupancy", "structure_type")
NUMBERS = tuple(name for name in COLUMNS if name not in ("id", *TEXTS))
MOST_SHOWN = 3  # rows that a message names
FIRST_YEAR, LAST_YEAR = 1000, 2100  # allowed years of construction; some files have 0 or 9999 for unknown years
FACTORS = {"m2": 1.0, "ft2": 0.3048**2}  # unit of area -> its size [m2]; the foot is the international foot


def from_table(table: pd.DataFrame | xr.Dataset, columns: Mapping[str, str] | None = None) -> pd.DataFrame:
    """Return the inventory of buildings in a pandas or xarray table.

    Args:
        table: One row per asset: a DataFrame, or a Dataset whose variables have one common dimension.
        columns: Meaning -> name of the column in the table, such as `{"storeys": "N_STORIES"}`, for columns that have
            other names than their meanings. Required meanings are `id`, `longitude` and `latitude` [degree]. Optional
            ones are `storeys`, `year` (of construction), `occupancy`, `structure_type`, `plan_area` (ground plan of one
            building [m2]), `replacement_cost` (of all buildings of the asset, in one currency) and `number` (of
            buildings; default: 1).

    Returns:
        A DataFrame with the index `building` and these columns. Texts are categories; other columns are unchanged.

    Raises:
        ValueError: If a column is missing, or rows have impossible values, such as repeated ids, latitudes beyond
            90 degrees, or storeys that are not whole numbers of at least 1. The message counts these rows and names
            some.
        TypeError: If `table` is neither a DataFrame nor a Dataset.

    Example:
        >>> frame = pd.DataFrame({"id": ["a"], "longitude": [-122.3], "latitude": [37.8], "floors": [2]})
        >>> wd.inventories.from_table(frame, {"storeys": "floors"})["storeys"].tolist()
        [2.0]
    """
    if isinstance(table, xr.Dataset):
        if len(table.dims) != 1:
            raise ValueError(
                f"from_table: the dataset must have one dimension, but it has {', '.join(map(str, table.dims))}: "
                "select one element along the others, as by table.isel(...)"
            )
        table = table.to_dataframe().reset_index()
    if not isinstance(table, pd.DataFrame):
        raise TypeError(
            f"from_table() takes a pandas DataFrame or an xarray Dataset, got {type(table).__name__}: for a file give "
            "pandas.read_csv(path)"
        )
    return checked_inventory("from_table", table, {} if columns is None else columns)


def checked_inventory(what: str, table: pd.DataFrame, columns: Mapping[str, str]) -> pd.DataFrame:
    """Return the inventory that a table contains: columns are named by their meaning, and values are checked.

    Args:
        what: Name of the function or the file, for errors.
        table: The table, which is not changed.
        columns: Meaning -> name of the column in the table.

    Raises:
        ValueError: As in `from_table`.
    """
    check_names(table.columns, f"{what}: ")
    for meaning, name in names_of_columns(what, columns).items():
        if meaning not in COLUMNS:
            raise ValueError(
                f"{what}: unknown meaning {meaning!r} in columns={did_you_mean(meaning, COLUMNS)}; allowed are "
                f"{', '.join(COLUMNS)}"
            )
        if name not in table.columns:
            raise no_column(what, str(name), table)
    source = {name: name for name in COLUMNS if name in table.columns} | dict(columns)
    for meaning, name in columns.items():
        others = [other for other, its in source.items() if its == name and other != meaning]
        if others:
            raise ValueError(
                f"{what}: the column {name!r} cannot be both {others[0]!r} and {meaning!r}: name another column for "
                "one of them in columns="
            )
    for name in NEEDED:
        if name not in source:
            raise no_column(what, name, table)
    if not len(table):
        raise ValueError(f"{what}: the table contains no building: give a table with at least one row")
    taken = set(source.values())
    found: dict[str, Any] = {name: table[source[name]] for name in COLUMNS if name in source}
    found |= {name: table[name] for name in table.columns if name not in taken and name not in source}
    return _checked_rows(what, pd.DataFrame(found).reset_index(drop=True).rename_axis("building"))


def names_of_columns(what: str, columns: object) -> dict[str, str]:
    """Return `columns` as a dictionary, meaning -> name of the column; raise a TypeError if it is not a mapping."""
    if isinstance(columns, Mapping) and not isinstance(columns, xr.Dataset):
        names = dict(columns)
        if all(isinstance(name, str) for name in names.values()):
            return names
    raise TypeError(
        f"{what}: columns must map meanings to names of columns, such as {{'storeys': 'N_STORIES'}}, got "
        f"{shortened(columns)}"
    )


def is_in_inventory_order(values: object) -> bool:
    """Return whether `values` is a column of an inventory in the order of its rows, recognised by the index."""
    index = getattr(values, "index", None)
    return isinstance(index, pd.RangeIndex) and index.name == "building"


def warn_of_inventory_order(what: str, archetypes: int) -> None:
    """Warn that `what` is a column in the order of the inventory; a portfolio orders its buildings by archetype.

    With one archetype, both orders are equal, and no warning is given.
    """
    if archetypes > 1:
        warn_caller(
            f"{what} is a column of the inventory, in the order of its rows, but a portfolio's buildings are ordered "
            "by archetype: give stock.replacement_costs(inventory), or a column of stock.buildings(inventory)"
        )


def no_column(what: str, name: str, table: pd.DataFrame) -> ValueError:
    """Return the error that the table `table` has no column `name`; the message suggests a similar name."""
    names = [str(each) for each in table.columns]
    return ValueError(
        f"{what}: there is no column {name!r}{did_you_mean(name, names)}; the columns are {', '.join(names)}"
        + (separator_hint(names) or ". Rename or add the column")
    )


def _checked_rows(what: str, table: pd.DataFrame) -> pd.DataFrame:
    """Return the table with columns converted to float64 or to categories; raise a ValueError if rows are invalid.

    The message states, for each kind of mistake, in how many rows it occurs.
    """
    problems, advice = [], ""
    table["id"], twice, has_none = _ids(table["id"])
    problems += _problem(table, twice, "have an id that is not unique", "")
    problems += _problem(table, has_none, "have no id", "")
    for name in NUMBERS:
        if name not in table:
            continue
        given, values = table[name], pd.to_numeric(table[name], errors="coerce").astype("float64")
        is_text = (values.isna() & given.notna()).to_numpy()
        problems += _problem(table, is_text, f"have no number in the column {name}", name)
        advice = advice or (comma_hint(given[is_text].iloc[0]) if is_text.any() else "")
        table[name] = values
        bad, rule = RULES[name](values.to_numpy())
        problems += _problem(table, bad & ~is_text, rule, name)
    for name in TEXTS:
        if name in table:
            table[name] = _without_blanks(table[name].astype("category"))
    if "number" not in table:
        table.insert(min(len(COLUMNS) - 1, table.shape[1]), "number", 1.0)
    if problems:
        hint = advice or _swapped(table)
        raise ValueError(
            f"{what}: of {len(table):,} buildings " + "; ".join(problems) + (hint or ". Correct these rows")
        )
    nowhere = ((table["longitude"] == 0) & (table["latitude"] == 0)).to_numpy()
    if nowhere.any():
        warn_caller(
            f"{what}: of {len(table):,} buildings {named_rows(table, nowhere)} are at longitude 0 and latitude 0, in "
            "the Atlantic: their coordinates seem to be unknown. Correct or remove these rows"
        )
    return table


def _without_blanks(texts: pd.Series) -> pd.Series:
    """Return a categorical column whose categories have no blanks at the beginning and end."""
    names = {name: name.strip() if isinstance(name, str) else name for name in texts.cat.categories}
    if all(name == bare for name, bare in names.items()):
        return texts
    return texts.map(names).astype("category")


def _ids(given: pd.Series) -> tuple[pd.Series, np.ndarray, np.ndarray]:
    """Return ids as text without blanks at both ends, whether each id is repeated, and whether each is missing."""
    if isinstance(given.dtype, np.dtype) and given.dtype.kind in "iu":
        # Whole numbers are compared as numbers, which is much faster than comparing their texts.
        return given.astype(str), _repeated(given), np.zeros(given.size, bool)
    has_none = given.isna().to_numpy()
    # Before version 3, pandas converts missing values to text, so that they are marked again.
    ids = given.astype(str).str.strip().mask(has_none)
    has_none = has_none | (ids.isna() | (ids == "")).to_numpy()
    return ids, _repeated(ids) & ~has_none, has_none


def _repeated(values: pd.Series) -> np.ndarray:
    """Return whether each value occurs more than once, shape [row]."""
    # First check is_unique, which takes half the time of duplicated.
    return np.zeros(values.size, bool) if values.is_unique else values.duplicated(keep=False).to_numpy()


def named_rows(table: pd.DataFrame, bad: np.ndarray, column: str = "") -> str:
    """Return text such as "5 ('a' (0.2), 'b' (0.3), ...)": the number of bad rows, and the ids of the first ones.

    Args:
        table: The inventory.
        bad: Whether each row is bad, shape [row].
        column: Column whose values are added in brackets; "": none.
    """
    rows = np.flatnonzero(bad)
    shown = []
    for row in rows[:MOST_SHOWN]:
        name = table["id"].iloc[row]
        value = f" ({table[column].iloc[row]})" if column else ""
        shown.append((repr(name) if isinstance(name, str) and name else f"row {row}") + value)
    return f"{rows.size:,} ({', '.join(shown)}{', ...' if rows.size > MOST_SHOWN else ''})"


def _problem(table: pd.DataFrame, bad: np.ndarray, what: str, column: str) -> list[str]:
    return [f"{named_rows(table, bad, column)} {what}"] if bad.any() else []


def _swapped(table: pd.DataFrame) -> str:
    """Return a hint if longitudes and latitudes seem to be exchanged, or longitudes to be from 0 to 360; else ""."""
    beyond = table["latitude"].abs() > 90
    fits = table["longitude"].abs().max() <= 90
    if beyond.any() and fits:
        return "; longitude and latitude seem to be exchanged"
    is_full_circle = table["longitude"].max() > 180 and table["longitude"].between(0, 360).all() and not beyond.any()
    return "; longitudes seem to be from 0 to 360: subtract 360 from those above 180" if is_full_circle else ""


def _within(low: float, high: float, what: str) -> Callable[[np.ndarray], tuple[np.ndarray, str]]:
    return lambda values: (~((values >= low) & (values <= high)), f"have {what} outside {low:g} to {high:g} degrees")


def _at_least_zero(what: str) -> Callable[[np.ndarray], tuple[np.ndarray, str]]:
    # Unknown values may be NaN, or 0 as in SimCenter's files; functions that use the column check for these values.
    return lambda values: (
        ~np.isnan(values) & ~((values >= 0) & np.isfinite(values)),
        f"have a {what} below 0 or infinite",
    )


def _storeys(values: np.ndarray) -> tuple[np.ndarray, str]:
    whole = (values >= 1) & (values == np.floor(values)) & np.isfinite(values)
    return ~np.isnan(values) & ~whole, "have storeys that are not a whole number of at least 1"


def _years(values: np.ndarray) -> tuple[np.ndarray, str]:
    bad = ~np.isnan(values) & ~((values >= FIRST_YEAR) & (values <= LAST_YEAR) & (values == np.floor(values)))
    return bad, f"have a year that is not a whole number from {FIRST_YEAR} to {LAST_YEAR} (leave unknown years empty)"


# Column -> function that returns whether each value is bad, and words about bad values for a message.
RULES: Mapping[str, Callable[[np.ndarray], tuple[np.ndarray, str]]] = {
    "longitude": _within(-180, 180, "a longitude"),
    "latitude": _within(-90, 90, "a latitude"),
    "storeys": _storeys,
    "year": _years,
    "plan_area": _at_least_zero("plan area"),
    "replacement_cost": _at_least_zero("replacement cost"),
    "number": lambda values: (~((values > 0) & np.isfinite(values)), "have a number of buildings not above 0"),
}
