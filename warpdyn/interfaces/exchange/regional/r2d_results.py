"""Writer of the results of each building for SimCenter's R2D tool: R2D_results.geojson."""

from __future__ import annotations

import datetime
import os
from pathlib import Path

import numpy as np
import pandas as pd

from warpdyn.answers.fragility.building_results import PROBABILITY
from warpdyn.foundations.core.checks import one_of
from warpdyn.interfaces.exchange.regional import geojson
from warpdyn.interfaces.exchange.regional.building_table import checked_results
from warpdyn.interfaces.exchange.text_files import check_same_table, checked_path, write_in_place
from warpdyn.model.inventories.r2d import ASSET_ID, R2D_NAMES
from warpdyn.model.inventories.table import FACTORS

_FUNCTION = "write_r2d_results"
CRS = {"type": "name", "properties": {"name": "urn:ogc:def:crs:OGC:1.3:CRS84"}}
ASSET_TYPE, TYPE, MOST_LIKELY = "Buildings", "assetType", "R2Dres_MostLikelyCriticalDamageState"
LOSSES = {
    "expected_loss_ratio": "R2Dres_mean_RepairCost_loss_ratio",
    "loss_ratio_standard_deviation": "R2Dres_std_RepairCost_loss_ratio",
    "expected_loss": "R2Dres_mean_RepairCost",
    "loss_standard_deviation": "R2Dres_std_RepairCost",
}
NAMES = R2D_NAMES | {"id": ASSET_ID} | LOSSES


def write_r2d_results(
    results: pd.DataFrame, path: str | os.PathLike, *, area_unit: str = "ft2", overwrite: bool = False
) -> Path:
    """Write the results of each building as `R2D_results.geojson`, the file that SimCenter's R2D tool displays.

    Each building is a point. If R2D has its own name for a column, such as `NumberOfStories` or `ReplacementCost`, this
    name is written; other columns keep their names. Further properties are `assetType` and the results that R2D
    displays. `R2Dres_MostLikelyCriticalDamageState` is the index of the most probable damage state (0: no damage); if
    several states are equally probable, it is the mean of their indices. If the results contain losses, there are also
    `R2Dres_mean_RepairCost_loss_ratio` and `R2Dres_std_RepairCost_loss_ratio` [1], and in currency
    `R2Dres_mean_RepairCost` and `R2Dres_std_RepairCost`. The names are those of SimCenterBackendApplications in July
    2026.

    Args:
        results: Result of `building_results`.
        path: Path of the file that is written; its name ends in ".geojson".
        area_unit: Unit of `PlanArea` in the file: "ft2", as in SimCenter's examples, or "m2".
        overwrite: If True, replace an existing file of any content. If False, replace only points with the same
            properties.

    Returns:
        Path of the written file.

    Raises:
        ValueError: If the name has another ending, the table lacks a column or a location, a value is impossible, the
            table already has a column with a name that the file needs, or the unit is unknown.
        TypeError: If `results` is not a DataFrame.
        OSError: If the file cannot be written, or exists with other content and `overwrite` is False.

    Example:
        >>> wd.write_r2d_results(results, "R2D_results.geojson").name
        'R2D_results.geojson'
    """
    path = checked_path(_FUNCTION, path, ".geojson")
    one_of("area_unit", area_unit, tuple(FACTORS))
    table, states = checked_results(_FUNCTION, results)
    written = [*(new for name, new in NAMES.items() if name in table), TYPE, MOST_LIKELY]
    taken = [name for name in written if name in table]
    if taken:
        raise ValueError(
            f"{_FUNCTION}: the file needs the name {taken[0]!r}, but the table has such a column: rename it by "
            ".rename(columns=...)"
        )
    shares = table[[PROBABILITY + state for state in states]].to_numpy()
    is_most = shares == shares.max(axis=1, keepdims=True)
    with np.errstate(invalid="ignore"):  # NaN: all samples of a building failed
        most_likely = (is_most * np.arange(len(states))).sum(axis=1) / is_most.sum(axis=1)
    properties = table.rename(columns=NAMES).assign(**{TYPE: ASSET_TYPE, MOST_LIKELY: most_likely})
    if "PlanArea" in properties:
        properties["PlanArea"] = properties["PlanArea"] / FACTORS[area_unit]
    metadata = {
        "Name": str(table.attrs.get("title", "")),
        "Units": {"length": "ft" if area_unit == "ft2" else "m"},
        "Author": str(table.attrs.get("source", "warpdyn")),
        "WorkflowType": "Regional Simulation",
        "Time": f"{datetime.datetime.now():%m-%d-%Y %H:%M:%S}",
    }
    check_same_table(_FUNCTION, path, properties.columns, overwrite)
    head = {"crs": CRS, "metadata": metadata}
    return write_in_place(path, lambda name: geojson.write_points(name, properties, table, head))
