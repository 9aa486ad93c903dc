"""CSV tables that are part of warpdyn."""

from __future__ import annotations

import csv
from pathlib import Path


def packaged_rows(name: str) -> list[dict[str, str]]:
    """Return the rows of a CSV table of warpdyn as column name -> text; lines that begin with "#" are comments.

    Args:
        name: Name of the file, such as "hazus_buildings.csv".
    """
    package = Path(__file__).parents[2]
    # In an installed package, the folder `data` is in the package; in a checkout of the repository it is next to it.
    paths = (package / "data" / name, package.parent / "data" / name)
    text = next(path for path in paths if path.exists()).read_text(encoding="utf-8")
    return list(csv.DictReader(line for line in text.splitlines() if not line.startswith("#")))
