"""Tables of text: CSV files, of which every row is read whole or none is."""

from __future__ import annotations

import os
import warnings
from collections import Counter

import pandas as pd


def read_csv(path: str | os.PathLike, *, comment: str | None = None, identifier: str = "id") -> pd.DataFrame:
    """Return the table of a CSV file, with names of columns as they are but for spaces around them.

    Args:
        path: The file, UTF-8, with or without a mark of its byte order.
        comment: What lines that are no rows begin with.
        identifier: The column, in any case, that is text: "007" is another building than "7".

    Raises:
        ValueError: If it is empty, its columns are separated by semicolons, it has a column twice, or has a row with
            more values than columns.
        FileNotFoundError: If there is no such file.
    """
    try:
        with open(path, encoding="utf-8-sig") as file:
            line = next((line for line in file if not comment or not line.startswith(comment)), "")
        if "," not in line and ";" in line:
            raise ValueError("its columns are separated by ';', and by ',' in the files that are read")
        names = [name.strip().strip('"') for name in line.rstrip("\r\n").split(",")]
        twice = sorted(name for name, count in Counter(names).items() if name and count > 1)
        if twice:
            raise ValueError(f"it has the column {twice[0]!r} twice")
        ids = {
            name: str
            for name in line.rstrip("\r\n").split(",")
            if name.strip().strip('"').lower() == identifier.lower()
        }
        with warnings.catch_warnings():
            warnings.simplefilter("error", pd.errors.ParserWarning)  # of values that would be dropped
            table = pd.read_csv(
                path,
                encoding="utf-8-sig",
                skipinitialspace=True,
                index_col=False,
                comment=comment,
                dtype=ids,
                low_memory=False,
            )
    except UnicodeDecodeError as error:
        raise ValueError(f"{path} is no text in UTF-8: {error}") from None
    except (ValueError, pd.errors.ParserWarning) as error:
        raise ValueError(f"{path}: {error}") from None
    return table.rename(columns=lambda name: str(name).strip())
