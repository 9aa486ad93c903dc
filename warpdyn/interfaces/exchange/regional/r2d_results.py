"""Results of each building as SimCenter's R2D tool shows them: R2D_results.geojson."""

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
from warpdyn.interfaces.exchange.text_files import checked_path, write_in_place
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


def write_r2d_results(results: pd.DataFrame, path: str | os.PathLike, *, area_unit: str = "ft2") -> Path:
    """Write each building's results as `R2D_results.geojson`, which SimCenter's R2D tool makes of pelicun's and shows.

    A building is a point with its columns under R2D's names (`NumberOfStories`, `ReplacementCost` and so on, others
    under their own), `assetType` and R2D's results: `R2Dres_MostLikelyCriticalDamageState`, the number of the damage
    state with the most samples (0 for none; the mean of several with as many), and with losses
    `R2Dres_mean_RepairCost_loss_ratio`, `R2Dres_std_RepairCost_loss_ratio` and, in currency, `R2Dres_mean_RepairCost`
    and `R2Dres_std_RepairCost`. The names are those of SimCenterBackendApplications in July 2026. Probabilities and
    standard errors stay under their own names, which R2D shows as other columns.

    Args:
        results: What `building_results` returned.
        path: The file, whose name ends in ".geojson"; an older one is replaced.
        area_unit: Unit of `PlanArea` in the file: "ft2", as in SimCenter's examples, or "m2".

    Returns:
        The path.

    Raises:
        ValueError: If the name has another ending, the table lacks a column or a place, has values that
            cannot be or a column named as one of the file, or the unit is unknown.
        TypeError: If `results` is no DataFrame.
        OSError: If the file cannot be written.

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
            f"{_FUNCTION}: the table has a column {taken[0]!r} of its own, which is one of the file's: rename it or "
            "leave it out"
        )
    shares = table[[PROBABILITY + state for state in states]].to_numpy()
    is_most = shares == shares.max(axis=1, keepdims=True)
    with np.errstate(invalid="ignore"):  # of buildings all of whose samples failed
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
    head = {"crs": CRS, "metadata": metadata}
    return write_in_place(path, lambda name: geojson.write_points(name, properties, table, head))
