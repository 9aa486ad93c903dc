"""Writer of the damage of each asset in the format of OpenQuake's damage calculators."""

from __future__ import annotations

import csv
import datetime
import os
from pathlib import Path

import numpy as np
import pandas as pd

from warpdyn import __version__
from warpdyn.answers.fragility.building_results import PROBABILITY
from warpdyn.campaigns.reductions.limits import NO_DAMAGE
from warpdyn.foundations.core.checks import one_of
from warpdyn.foundations.core.messages import amount_of
from warpdyn.interfaces.exchange.regional.building_table import checked_results
from warpdyn.interfaces.exchange.text_files import check_same_format, checked_path, write_in_place

_FUNCTION = "write_openquake_damages"
_WRITTEN = "generated_by='warpdyn"  # in the first line; OpenQuake writes the name of its engine there
LOSS_TYPES = ("structural", "nonstructural", "contents", "business_interruption")


def write_openquake_damages(
    results: pd.DataFrame, path: str | os.PathLike, *, loss_type: str = "structural", overwrite: bool = False
) -> Path:
    """Write the mean damage of each asset in the format of `avg_damages` of OpenQuake's scenario damage calculation.

    The columns are `asset_id`, `taxonomy`, `lon`, `lat`, and one column per damage state: `structural-no_damage`,
    `structural-slight` and so on. It contains the expected number of buildings of the asset in this state, which is
    `number` times the probability. If the results contain losses, `structural-losses` is the expected loss in the
    currency of the replacement cost. The first line is a comment with the name of the program. The format is that of
    OpenQuake 3.26.

    Args:
        results: Result of `building_results`. The column `structure_type` is written as the taxonomy, because
            `read_openquake` reads the taxonomy into it. If the table lacks this column, the archetype is written.
        path: Path of the file that is written; its name ends in ".csv".
        loss_type: Loss type in the names of the columns: "structural", "nonstructural", "contents" or
            "business_interruption".
        overwrite: If True, replace an existing file of any content. If False, replace only a table that this function
            wrote.

    Returns:
        Path of the written file.

    Raises:
        ValueError: If the name has another ending, the table lacks a column or a location, a value is impossible, the
            loss type is unknown, or a building has no probability because all its samples failed.
        TypeError: If `results` is not a DataFrame.
        OSError: If the file cannot be written, or exists with other content and `overwrite` is False.

    Example:
        >>> path = wd.write_openquake_damages(results, "avg_damages-rlz-000_1.csv")
        >>> pd.read_csv(path, skiprows=1)["structural-slight"].tolist()
        [0.875, 0.75, 0.5]
    """
    path = checked_path(_FUNCTION, path, ".csv")
    table, states = checked_results(_FUNCTION, results, "number")
    one_of("loss_type", loss_type, LOSS_TYPES)
    unknown = table[PROBABILITY + states[0]].isna().to_numpy()
    if unknown.any():
        raise ValueError(
            f"{_FUNCTION}: all samples of {amount_of(int(unknown.sum()), 'building')} failed, such as "
            f"{table['id'].iloc[unknown.argmax()]!r}: drop them by "
            f"results[results[{PROBABILITY + states[0]!r}].notna()]"
        )
    taxonomy = table["structure_type" if "structure_type" in table else "archetype"]
    places = {"lon": _shown(table["longitude"], "%.5f"), "lat": _shown(table["latitude"], "%.5f")}
    columns = {"asset_id": table["id"], "taxonomy": taxonomy} | places
    for state in states:
        name = "no_damage" if state == NO_DAMAGE else state
        columns[f"{loss_type}-{name}"] = _shown(table["number"] * table[PROBABILITY + state])
    if "expected_loss" in table:
        columns[f"{loss_type}-losses"] = _shown(table["expected_loss"])
    written = pd.DataFrame(columns)
    check_same_format(_FUNCTION, path, _WRITTEN, f"a table that {_FUNCTION} wrote", overwrite)

    def write(name: str) -> None:
        with open(name, "w", encoding="utf-8", newline="") as file:
            head = ["#", *[""] * (written.shape[1] - 2), _generated_by()]
            csv.writer(file, lineterminator="\n").writerow(head)
            written.to_csv(file, index=False, lineterminator="\n")

    return write_in_place(path, write)


def _shown(values: pd.Series, digits: str = "%.6E") -> np.ndarray:
    """Return numbers as texts in the format that OpenQuake writes: six digits after the point, with an exponent."""
    return np.char.mod(digits, values.to_numpy(dtype=np.float64)).astype(object)


def _generated_by() -> str:
    """Return the text of the comment in the first line of the file: name and version of warpdyn, and the date."""
    now = datetime.datetime.now(datetime.UTC)
    return f"{_WRITTEN} {__version__}', start_date='{now:%Y-%m-%dT%H:%M:%S}'"
