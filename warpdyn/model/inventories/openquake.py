"""Inventories of the OpenQuake engine: exposure models in CSV files, with or without their XML file."""

from __future__ import annotations

import os
import xml.etree.ElementTree as ElementTree
from collections.abc import Mapping, Sequence
from pathlib import Path
from typing import Any

import pandas as pd

from warpdyn.foundations.core.checks import one_of, shortened
from warpdyn.foundations.core.messages import warn_caller
from warpdyn.foundations.core.near_misses import did_you_mean
from warpdyn.foundations.files.text import existing_file, inside_folder, read_csv, xml_root
from warpdyn.model.inventories.places_of_assets import UNIT_ID, with_places
from warpdyn.model.inventories.table import checked_inventory, named_rows, names_of_columns, no_column

# OpenQuake's names of columns (the engine's manual, "Exposure models").
OPENQUAKE_NAMES = {"id": "id", "longitude": "lon", "latitude": "lat", "structure_type": "taxonomy", "number": "number"}
# Names of these columns and of costs in exports of the engine (assetcol) and in GEM's Global Exposure Model.
VALUE = "value-"  # prefix of numbers, areas and costs in exports of the engine
GEM_NAMES = {"taxonomy": "TAXONOMY", "number": "BUILDINGS", "occupancy": "OCCUPANCY", "area": "TOTAL_AREA_SQM"}
GEM_COST = "COST_{}_USD"
AREA = "area"  # column of floor areas, which multiply costs per area
STRUCTURAL = ("structural",)  # default of the argument `costs`
COST_KINDS = ("aggregated", "per_asset", "per_area")


def read_openquake(
    path: str | os.PathLike,
    *,
    costs: Sequence[str] = STRUCTURAL,
    columns: Mapping[str, str] | None = None,
    places: pd.DataFrame | str | os.PathLike | None = None,
) -> pd.DataFrame:
    """Read an exposure model of the OpenQuake engine, or of GEM's Global Exposure Model.

    Args:
        path: A CSV file with columns `id`, `lon`, `lat` and `taxonomy` and, optionally, `number`, `area` and costs,
            also as exported by the engine (`value-number`, `value-structural`); or a file of GEM's Global Exposure
            Model (`ID_1`, `TAXONOMY`, `BUILDINGS`, `COST_STRUCTURAL_USD` and so on), which has neither ids nor
            coordinates; or the XML file (NRML 0.5) that names CSV files in `<assets>`, the kinds of costs in
            `<conversions>` and the names of columns in `<exposureFields>`. Names may be in upper or lower case. All
            other columns, such as tags and occupants, are kept.
        costs: The columns whose sum is the `replacement_cost`, such as ("structural", "nonstructural"). With an XML
            file, costs per building (per area) are multiplied by the number of buildings (the area). In a single CSV
            file, costs are costs of the whole asset. If the default column is missing, the inventory has no costs; if
            another column is missing, an error is raised.
        columns: Meaning -> name of the column in the file, as in `from_table`.
        places: Coordinates of administrative units, for files without coordinates: a table, or its CSV file, with one
            row per unit and the columns `longitude`, `latitude` [degree] and at least one column of ids, such as
            `ID_1`, with the same name as in the exposure file. Each asset gets the coordinates of its unit. GEM's files
            have units of the first administrative level (`ID_1`); boundary data sets such as geoBoundaries and GADM
            contain centroids.

    Returns:
        The inventory, as from `from_table`: one row per asset, with its `number` of buildings. If the file has no ids,
        an id consists of the file's name and the row number. Rows with 0 buildings, which GEM's files contain because
        of rounding, are removed, with a warning. Numbers of storeys are read from a column only if `columns` names it;
        otherwise `portfolio` reads them from the taxonomy.

    Raises:
        ValueError, FileNotFoundError: As in `from_table`, with the file's name; or if the file does not exist, a column
            of `costs` is missing, the XML is not an exposure model, contains the assets itself or names files outside
            its folder; or if the file has no coordinates and `places` is missing or lacks a unit.
        TypeError: If `costs` is a single name instead of a sequence of names.

    Example:
        >>> inventory = wd.inventories.read_openquake("exposure_model.xml", costs=("structural", "nonstructural"))
        >>> inventory["replacement_cost"].tolist()
        [1500.0, 220.0]
    """
    if not isinstance(costs, list | tuple) or not all(isinstance(name, str) for name in costs):
        raise TypeError(
            f"read_openquake: costs must be a sequence of names, such as ('structural',), got {shortened(costs)}"
        )
    columns = names_of_columns("read_openquake", {} if columns is None else columns)
    path = existing_file("read_openquake", path)
    kinds: dict[str, str] = {}
    fields: dict[str, str] = {}
    area_kind = "aggregated"
    if path.suffix.lower() == ".xml":
        model = _exposure_model(path)
        kinds = {each.get("name", ""): each.get("type", "") for each in model.iter("costType")}
        # The name of a cost in a formula is "value", so that its type is used as name.
        of_cost = [
            (each.get("type") if each.get("oq") == "value" else each.get("oq"), each) for each in model.iter("field")
        ]
        fields = {str(name): each.get("input", "") for name, each in of_cost}
        for name, kind in kinds.items():
            one_of(f"type of the cost {name!r} in {path}", kind, COST_KINDS)
        area = model.find("conversions/area")
        if area is not None:
            area_kind = area.get("type", "aggregated")
            one_of(f"type of the area in {path}", area_kind, ("aggregated", "per_asset"))
        files = [inside_folder(path.parent, name, str(path)) for name in (model.findtext("assets") or "").split()]
        if not files:
            raise ValueError(f"{path}: <assets> names no CSV files. Put the assets in a CSV file and name it there")
        table = pd.concat([_exposure_table(file, fields.get("id", "id")) for file in files], ignore_index=True)
    else:
        table = _exposure_table(path, "id")
    names = {str(name).lower(): str(name) for name in table.columns}  # names in the file may be in capitals
    wanted = (*OPENQUAKE_NAMES.values(), "occupancy", *costs, AREA)
    columns_of = {name: fields.get(name) or _name_in_file(name, names) for name in wanted}
    table = _with_ids_and_places(str(path), table, columns_of, columns, places)
    known = {meaning: columns_of[name] for meaning, name in OPENQUAKE_NAMES.items()}
    if columns_of["occupancy"] in table and columns_of["occupancy"] == GEM_NAMES["occupancy"]:
        known["occupancy"] = columns_of["occupancy"]
    known = {m: n for m, n in known.items() if n in table.columns or m in ("id", "longitude", "latitude")}
    source = known | columns
    table = _with_buildings(str(path), table, source.get("number", "number"))
    inventory = checked_inventory(str(path), table, source)
    return _with_costs(str(path), inventory, costs, columns_of, kinds, area_kind)


def _exposure_table(path: Path, identifier: str) -> pd.DataFrame:
    return read_csv(path, comment="#", identifier=identifier)


def _name_in_file(name: str, names: Mapping[str, str]) -> str:
    """Return the name that a column or cost of OpenQuake has in a file; `name` itself if the file does not have it."""
    gem = GEM_NAMES.get(name, GEM_COST.format(name.upper()))
    return next((names[each] for each in (name, VALUE + name, gem.lower()) if each in names), name)


def _with_ids_and_places(
    what: str,
    table: pd.DataFrame,
    names: Mapping[str, str],
    columns: Mapping[str, str],
    places: pd.DataFrame | str | os.PathLike | None,
) -> pd.DataFrame:
    """Return the table of assets with ids, and with coordinates of administrative units if `places` is given."""
    is_of_units = any(UNIT_ID.fullmatch(str(name)) for name in table.columns)
    has_places = all(columns.get(m, names[n]) in table for m, n in (("longitude", "lon"), ("latitude", "lat")))
    if places is not None:
        if has_places:
            raise ValueError(f"{what} has coordinates: remove places=")
        table = with_places(what, table, places)
    elif is_of_units and not has_places:
        raise ValueError(
            f"{what} has ids of administrative units instead of coordinates: give places=, a table (or its CSV file) "
            "with these ids in a column of the same name, such as ID_1, and with longitude and latitude"
        )
    if is_of_units and columns.get("id", names["id"]) not in table:
        table = table.assign(id=[f"{Path(what).stem} {row}" for row in range(1, len(table) + 1)])
    return table


def _with_buildings(what: str, table: pd.DataFrame, number: str) -> pd.DataFrame:
    """Return the rows with at least one building. GEM's files contain rows whose number was rounded to 0."""
    if number != GEM_NAMES["number"] or number not in table:
        return table
    is_none = (pd.to_numeric(table[number], errors="coerce") == 0).to_numpy()
    if is_none.all():
        raise ValueError(f"{what}: every row has 0 buildings in the column {number}: correct this column")
    if is_none.any():
        warn_caller(
            f"{what}: {is_none.sum():,} of {len(table):,} rows have 0 buildings, by rounding, and are removed with "
            "their costs. To keep them, give these rows a number above 0"
        )
    return table[~is_none]


def _with_costs(
    what: str,
    inventory: pd.DataFrame,
    costs: Sequence[str],
    places: Mapping[str, str],
    kinds: Mapping[str, str],
    area_kind: str,
) -> pd.DataFrame:
    """Return the inventory with the column `replacement_cost`, the cost of the whole asset.

    Args:
        what: Name of the file, for errors.
        inventory: The inventory.
        costs: Names of the costs that are summed.
        places: Name of a cost or "area" -> name of its column.
        kinds: Name of a cost -> its kind, one of COST_KINDS: cost of the asset, of one building, or per unit of area.
        area_kind: "aggregated" (area of the whole asset) or "per_asset" (area of one building).
    """
    if "replacement_cost" in inventory or not costs:
        return inventory
    absent = [name for name in costs if places[name] not in inventory]
    if absent == list(costs) == list(STRUCTURAL):  # the default, in a file without costs
        return inventory
    if absent:
        known = [*kinds, *(str(name) for name in inventory.columns)]
        raise ValueError(
            f"{what}: there is no cost {absent[0]!r}{did_you_mean(absent[0], known)}; "
            + (f"the kinds of costs are {', '.join(kinds)}, and " if kinds else "")
            + f"the columns are {', '.join(map(str, inventory.columns))}: correct costs="
        )
    total: Any = 0.0
    for name in costs:
        cost, kind = _numbers(what, inventory, places[name]), kinds.get(name, "aggregated")
        if kind == "per_area":
            cost = cost * _numbers(what, inventory, places[AREA])
        if kind == "per_asset" or (kind == "per_area" and area_kind == "per_asset"):
            cost = cost * inventory["number"]
        total = total + cost
    inventory = inventory.assign(replacement_cost=total)
    return checked_inventory(what, inventory, {})


def _exposure_model(path: Path) -> ElementTree.Element:
    """Return the element <exposureModel> of an NRML file, with namespaces removed from all tags."""
    model = xml_root(path).find("exposureModel")
    if model is None:
        raise ValueError(
            f"{path} has no <exposureModel>: it is not an exposure model of OpenQuake: give the XML file of an "
            "exposure model, or read a CSV file with wd.inventories.from_table"
        )
    return model


def _numbers(what: str, inventory: pd.DataFrame, column: str) -> pd.Series:
    """Return a column as numbers, with NaN for empty cells; raise a ValueError if a cell contains other text."""
    if column not in inventory:
        raise no_column(what, column, inventory)
    values = pd.to_numeric(inventory[column], errors="coerce")
    is_text = (values.isna() & inventory[column].notna()).to_numpy()
    if is_text.any():
        raise ValueError(
            f"{what}: {named_rows(inventory, is_text, column)} have no number in the column {column}: correct these "
            "rows"
        )
    return values
