"""Reading of tables in CSV files; an error is raised if a row has fewer or more values than there are columns."""

from __future__ import annotations

import csv
import os
import warnings
from itertools import islice

import pandas as pd

from warpdyn.foundations.core.messages import amount_of
from warpdyn.foundations.files.text import check_names, check_separator


def read_csv(path: str | os.PathLike, *, comment: str | None = None, identifier: str = "id") -> pd.DataFrame:
    """Return the table in a CSV file; blanks at the beginning and end of column names are removed.

    Args:
        path: The file, in UTF-8, with or without a byte order mark.
        comment: Characters with which comment lines before the column names begin; None: no comment lines.
        identifier: Name of the column (in upper or lower case) that is read as text, so that "007" and "7" differ.

    Raises:
        ValueError: If the file is empty, its columns are not separated by commas, two columns have the same name (apart
            from upper and lower case and blanks), or a row has more or fewer values than there are columns. The message
            names the file.
        FileNotFoundError: If the file does not exist.
    """
    try:
        with open(path, encoding="utf-8-sig", newline="") as file:
            lines = iter(file)
            skipped, line = 0, next(lines, "")
            while comment and line.startswith(comment):
                skipped, line = skipped + 1, next(lines, "")
        if not line.strip():
            raise ValueError("it is empty: the first line must contain the names of columns")
        check_separator(line)
        names = next(csv.reader([line], skipinitialspace=True), [])
        check_names(names)
        ids: dict[str, type] = {name: str for name in names if name.strip().lower() == identifier.lower()}
        with warnings.catch_warnings():
            warnings.simplefilter("error", pd.errors.ParserWarning)  # pandas warns if it drops values
            try:
                table = pd.read_csv(
                    path,
                    encoding="utf-8-sig",
                    skipinitialspace=True,
                    index_col=False,
                    skiprows=skipped,
                    dtype=ids,
                    low_memory=False,
                )
            except pd.errors.ParserWarning:
                _check_lengths(path, len(names), skipped)
                raise
        if len(table.columns) and table.iloc[:, -1].isna().any():
            _check_lengths(path, len(names), skipped)
    except UnicodeDecodeError as error:
        raise ValueError(f"{path} is not text in UTF-8: {error}. Save the table as CSV UTF-8") from None
    except (ValueError, pd.errors.ParserWarning, csv.Error) as error:
        raise ValueError(f"{path}: {error}") from None
    return table.rename(columns=lambda name: str(name).strip())


def _check_lengths(path: str | os.PathLike, columns: int, skipped: int) -> None:
    """Raise a ValueError that names the first line whose number of values differs from the number of columns."""
    with open(path, encoding="utf-8-sig", newline="") as file:
        rows = csv.reader(islice(file, skipped, None), skipinitialspace=True)
        for row in rows:
            if row and len(row) != columns:
                raise ValueError(
                    f"line {skipped + rows.line_num} has {amount_of(len(row), 'value')}, but there are {columns} "
                    "columns: correct the line"
                )
