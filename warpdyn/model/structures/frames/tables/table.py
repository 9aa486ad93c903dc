"""Tables of frames from dictionaries, pandas tables and CSV files, with checked columns."""

from __future__ import annotations

import os
from collections.abc import Mapping, Sequence
from dataclasses import dataclass
from typing import Any, TypeAlias

import numpy as np
import pandas as pd

from warpdyn.foundations.core.checks import one_of, real_number, shortened
from warpdyn.foundations.core.near_misses import did_you_mean
from warpdyn.foundations.files.text import comma_hint, existing_file, read_csv, separator_hint

TableLike: TypeAlias = Mapping[str, Any] | pd.DataFrame | str | os.PathLike
Rows: TypeAlias = dict[str, dict[str, Any]]


@dataclass(frozen=True)
class Column:
    """A column of a table.

    Attributes:
        default: Value if it is missing; None: the value is required.
        units: Units of a number, for messages; "" for text.
        above: Exclusive lower bound of a number.
        least: Inclusive lower bound of a number.
        allowed: Allowed texts; empty: any text.
        is_text: Whether the values are texts.
        may_be_infinite: Whether the number may be infinite.
    """

    default: Any = None
    units: str = ""
    above: float | None = None
    least: float | None = None
    allowed: tuple[str, ...] = ()
    is_text: bool = False
    may_be_infinite: bool = False

    def checked(self, what: str, value: Any) -> Any:
        """Return a value of the column, or raise an error that begins with `what`."""
        if self.is_text:
            text = str(value).strip() if isinstance(value, str | int | np.integer) else value
            if not isinstance(text, str) or not text:
                raise TypeError(f"{what} must be text, got {shortened(value)}")
            if self.allowed:
                one_of(what, text, self.allowed)
            return text
        if isinstance(value, str):
            try:
                value = float(value)
            except ValueError:
                hint = comma_hint(value)
                raise ValueError(f"{what} must be a number [{self.units}], got {shortened(value)}{hint}") from None
        if self.may_be_infinite and isinstance(value, float) and value == np.inf:
            return value
        return real_number(f"{what} [{self.units}]", value, above=self.above, least=self.least)


def read_table(argument: str, given: object, noun: str, columns: Mapping[str, Column]) -> Rows:
    """Return the rows of a table by their names.

    Args:
        argument: Name of the argument, for errors.
        given: {name: {column: value}} or {name: [values in the order of the columns]}; a DataFrame, whose index or
            column `noun` contains the names; or a CSV file with such a column. None and empty cells are missing values.
        noun: Noun for a row, such as "node".
        columns: Name of a column -> its properties.

    Raises:
        ValueError: If a column is unknown, a value is missing or out of its range, or a name occurs twice.
        TypeError: If the argument is not a table.
    """
    rows = _raw_rows(argument, given, noun, list(columns))
    if not rows:
        raise ValueError(f"{argument} is empty: give at least one {noun}")
    found: Rows = {}
    for name, row in rows:
        if name in found:
            raise ValueError(f"{argument}: two rows have the name {name!r}: give each {noun} another name")
        for key in row:
            if key not in columns:
                raise ValueError(
                    f"{argument}: {noun} {name!r} has the unknown column {key!r}{did_you_mean(key, list(columns))}; "
                    f"columns are {', '.join(columns)}"
                )
        found[name] = {}
        for key, column in columns.items():
            value = row.get(key)
            if value is None or value is pd.NA:
                if column.default is None:
                    units = f" [{column.units}]" if column.units else ""
                    raise ValueError(f"{argument}: {noun} {name!r} has no {key}{units}: give it")
                found[name][key] = column.default
            else:
                found[name][key] = column.checked(f"{argument}: {key} of {noun} {name!r}", value)
    return found


def _raw_rows(argument: str, given: object, noun: str, columns: Sequence[str]) -> list[tuple[str, dict[str, Any]]]:
    """Return (name, row) for each row of a table, without checks of the values."""
    if isinstance(given, str | os.PathLike):
        path = existing_file(argument, given)
        try:
            read = read_csv(path, identifier=noun)
        except ValueError as error:
            raise ValueError(f"{argument}: {error}") from None
        if noun not in read:
            listed = ", ".join(map(repr, read.columns))
            raise ValueError(f"{argument}: the file has no column {noun!r}, which names the rows; it has {listed}")
        given = read
    if isinstance(given, pd.DataFrame):
        if hint := separator_hint(given.columns):
            raise ValueError(f"{argument}: the table has the only column {given.columns[0]!r}{hint}")
        table = given.set_index(noun) if noun in given else given
        return [(str(name), row.dropna().to_dict()) for name, row in table.iterrows()]  # empty cells
    if not isinstance(given, Mapping):
        raise TypeError(
            f"{argument} must be a dictionary {{name: values}}, a DataFrame or the path of a CSV file, "
            f"got {shortened(given)}"
        )
    rows = []
    for name, row in given.items():
        if isinstance(row, Mapping):
            rows.append((str(name), dict(row)))
        elif isinstance(row, list | tuple | np.ndarray):
            if len(row) > len(columns):
                raise ValueError(
                    f"{argument}: {noun} {name!r} has {len(row)} values; the order of the columns is "
                    f"{', '.join(columns)}"
                )
            rows.append((str(name), dict(zip(columns, row, strict=False))))
        else:
            raise TypeError(
                f"{argument}: {noun} {name!r} must be a dictionary {{column: value}} or a list of values in the order "
                f"{', '.join(columns)}, got {shortened(row)}"
            )
    return rows


def column_of(rows: Rows, column: str) -> np.ndarray:
    """Return a column of numbers, shape [row]."""
    return np.array([row[column] for row in rows.values()], dtype=np.float64)


def check_names_known(what: str, names: Sequence[str], known: Sequence[str] | Mapping[str, Any], noun: str) -> None:
    """Raise a ValueError if a name is not among the known ones."""
    for name in names:
        if name not in known:
            listed = ", ".join(map(repr, list(known)[:12])) + (" ..." if len(known) > 12 else "")
            hint = did_you_mean(name, list(known))
            raise ValueError(f"{what} names the unknown {noun} {name!r}{hint}; there are {listed}")
