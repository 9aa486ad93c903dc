"""Rules that assign an archetype to each building of an inventory: HazusRule, a mapping or a function."""

from __future__ import annotations

from collections.abc import Callable, Mapping
from dataclasses import dataclass

import numpy as np
import pandas as pd

from warpdyn.foundations.core.checks import one_of
from warpdyn.foundations.core.messages import warn_caller
from warpdyn.foundations.core.near_misses import with_suggestions
from warpdyn.model.inventories.table import named_rows
from warpdyn.model.inventories.taxonomies import MOST_STOREYS, MOST_STOREYS_OF_W1, families, structure_of
from warpdyn.model.structures.hazus import DESIGN_LEVELS, building_types

# Design levels of buildings built before 1941, from 1941 to 1975, and after 1975, for each seismic zone of the Uniform
# Building Code (FEMA, Hazus Earthquake Model Technical Manual, chapter 5, "Guidelines for selection of damage functions
# for typical buildings based on UBC seismic zone and building age").
ERAS = (1941, 1976)  # first years of the second and of the third era
LEVELS = {
    "4": ("pre", "moderate", "high"),
    "3": ("pre", "moderate", "moderate"),
    "2B": ("pre", "low", "moderate"),
    "2A": ("pre", "low", "low"),
    "1": ("pre", "pre", "low"),
    "0": ("pre", "pre", "pre"),
}
# Design levels of wood houses (type W1) in the same table; they are higher.
LEVELS_OF_W1 = {
    "4": ("moderate", "moderate", "high"),
    "3": ("moderate", "moderate", "moderate"),
    "2B": ("low", "low", "moderate"),
    "2A": ("low", "low", "low"),
    "1": ("low", "low", "low"),
    "0": ("low", "low", "low"),
}
NOT_TO_CODE = ("URM", "C3", "S5")  # pre-code in any year: unreinforced masonry, and frames with infills of it
MOST_NAMED = 8  # types that a message names


@dataclass(frozen=True, eq=False)
class Named:
    """The archetypes that a rule assigns to the buildings of an inventory.

    Args:
        names: Names of the archetypes.
        code: Index into `names` of the archetype of each building, shape [building]; -1: no archetype.
        reasons: Reasons why buildings have no archetype, each with the number of buildings and some of their ids.
        hazus: Name of a Hazus archetype -> building type, design level and number of storeys.
    """

    names: list[str]
    code: np.ndarray
    reasons: list[str]
    hazus: Mapping[str, tuple[str, str, int]]


@with_suggestions
@dataclass(frozen=True)
class HazusRule:
    """The rule that assigns a Hazus type to a building by structure type and storeys, and a design level by year.

    - Type: the structure type is a Hazus type with height class ("C1M") or without ("C1"), or a string of GEM's
      building taxonomy, such as "CR/LFINF+DUL/H:2", which is converted to the equivalent Hazus type. If the height
      class is missing, the number of storeys determines it: for C1, L up to 3 storeys, M up to 7, H above; for URM, L
      up to 2.
    - Storeys: the number in the column `storeys`; if it is missing, the number in the taxonomy string.
    - Design level: the ductility or code level in the taxonomy string (DUH, CDM and so on). If the string has no level,
      year of construction and seismic zone determine the design level, as in chapter 5 of the Hazus Earthquake Model
      Technical Manual. In zone 4: high code from 1976, moderate code from 1941, before that pre-code (W1: moderate
      code).
      Unreinforced masonry (URM) and frames with unreinforced masonry infills (C3, S5) are pre-code in any year, because
      they were not built to a seismic code.

    Args:
        seismic_zone: Zone of the Uniform Building Code: "4" (coastal California), "3", "2B", "2A", "1" or "0".

    Raises:
        ValueError: If the zone is unknown.

    Example:
        >>> stock = wd.inventories.portfolio(inventory, wd.inventories.HazusRule(seismic_zone="3"))
        >>> list(stock.portfolio.archetypes)
        ['W1 moderate 2', 'C1L moderate 2']
    """

    seismic_zone: str = "4"

    def __post_init__(self) -> None:
        one_of("seismic zone", self.seismic_zone, tuple(LEVELS))

    def named(self, inventory: pd.DataFrame) -> Named:
        """Return the archetype of each building, named by type, design level and storeys, such as "C1M high 5"."""
        if "structure_type" not in inventory:
            raise ValueError(
                "HazusRule: the inventory has no column structure_type: name it by columns= of the reader, or give "
                "archetype_of= a function of the inventory"
            )
        column = inventory["structure_type"].astype("category")
        texts, place = column.cat.categories.astype(str), column.cat.codes.to_numpy()
        said = [structure_of(text) for text in texts]
        tables = families()
        family_names = list(tables)

        def of_building(values: list[float], otherwise: float) -> np.ndarray:
            return np.array([*values, otherwise])[place]  # a missing type has the code -1, which selects `otherwise`

        family = of_building([family_names.index(each.family) if each.family else -1 for each in said], -1).astype(int)
        storeys = of_building([each.storeys for each in said], np.nan)
        if "storeys" in inventory:
            given = inventory["storeys"].to_numpy(dtype=np.float64)
            storeys = np.where(np.isnan(given), storeys, given)
        reasons = []
        reasons += _reason(inventory, place < 0, "have no structure type", "")
        without = (family < 0) & (place >= 0)
        known = f"known are Hazus' {', '.join(family_names)}, and GEM's taxonomy; give archetype_of= for other types"
        reasons += _unknown_types(inventory, without, column, known)
        has_type = family >= 0
        reasons += _reason(inventory, has_type & np.isnan(storeys), "have no number of storeys", "structure_type")
        whole = np.where(np.isnan(storeys), 0, np.minimum(storeys, MOST_STOREYS + 1)).astype(np.int64)
        types = np.array([*(np.append(tables[name], -1) for name in family_names)])[family, whole]
        types[~has_type] = -1
        wrong = has_type & ~np.isnan(storeys) & (types < 0)
        what = f"have storeys that disagree with their structure type{_allowed_storeys(tables, family[wrong])}"
        reasons += _reason(inventory.assign(storeys=storeys), wrong, what, "structure_type", "storeys")

        level = of_building([DESIGN_LEVELS.index(each.level) if each.level else -1 for each in said], -1).astype(int)
        by_age = self._levels_by_age(inventory, types)
        level = np.where(level >= 0, level, by_age)
        no_year = (types >= 0) & (level < 0)
        reasons += _reason(
            inventory, no_year, "have no year of construction, from which their design level follows", ""
        )
        self._warn_of_tall_wood(inventory, types, storeys)

        known = (types >= 0) & (level >= 0)
        key = np.where(known, (types * len(DESIGN_LEVELS) + level) * (MOST_STOREYS + 2) + whole, -1)
        codes, uniques = pd.factorize(key[known])
        order = np.argsort(uniques)
        rank = np.empty_like(order)
        rank[order] = np.arange(order.size)
        code = np.full(len(inventory), -1, dtype=np.int32)
        code[known] = rank[codes]
        hazus = {}
        for each in uniques[order].tolist():
            (kind, lev), n = divmod(each // (MOST_STOREYS + 2), len(DESIGN_LEVELS)), each % (MOST_STOREYS + 2)
            parts = building_types()[kind], DESIGN_LEVELS[lev], n
            hazus[" ".join(map(str, parts))] = parts
        return Named(list(hazus), code, reasons, hazus)

    def _levels_by_age(self, inventory: pd.DataFrame, types: np.ndarray) -> np.ndarray:
        """Return the design level that follows from the year of construction, as an index in DESIGN_LEVELS.

        The shape is [building]; -1: the year is unknown.
        """
        old = np.unique(np.concatenate([families()[name] for name in NOT_TO_CODE]))
        always = np.isin(types, old[old >= 0])
        level = np.where(always, DESIGN_LEVELS.index("pre"), -1)
        if "year" not in inventory:
            return level
        year = inventory["year"].to_numpy(dtype=np.float64)
        era = np.searchsorted(ERAS, year, side="right")
        of_others = np.array([DESIGN_LEVELS.index(each) for each in LEVELS[self.seismic_zone]])
        of_houses = np.array([DESIGN_LEVELS.index(each) for each in LEVELS_OF_W1[self.seismic_zone]])
        era = np.minimum(era, len(ERAS))
        by_year = np.where(types == building_types().index("W1"), of_houses[era], of_others[era])
        return np.where(always, level, np.where(np.isnan(year), -1, by_year))

    def _warn_of_tall_wood(self, inventory: pd.DataFrame, types: np.ndarray, storeys: np.ndarray) -> None:
        tall = (types == building_types().index("W1")) & (storeys > MOST_STOREYS_OF_W1)
        if tall.any():
            warn_caller(
                f"{named_rows(inventory.assign(storeys=storeys), tall, 'storeys')} buildings of type W1 have more than "
                f"{MOST_STOREYS_OF_W1} storeys: in Hazus, such wood buildings are of type W2. Correct the type or the "
                "storeys"
            )


Rule = HazusRule | Mapping[str, str] | Callable[[pd.DataFrame], object]


def named_by(rule: Rule, inventory: pd.DataFrame) -> Named:
    """Return the archetypes that a rule assigns to the buildings of an inventory.

    Args:
        rule: A HazusRule; or a mapping from structure types to names of archetypes; or a function of the inventory that
            returns the name of each building's archetype, None or NaN for no archetype.
        inventory: The inventory.
    """
    if isinstance(rule, HazusRule):
        return rule.named(inventory)
    if isinstance(rule, Mapping):
        if "structure_type" not in inventory:
            raise ValueError(
                "portfolio: archetype_of is a mapping of structure types, but the inventory has no column "
                "structure_type: name it by columns= of the reader"
            )
        column = inventory["structure_type"].astype("category")
        place = column.cat.codes.to_numpy()
        names = list(dict.fromkeys(rule.values()))
        of_type = [names.index(rule[text]) if text in rule else -1 for text in column.cat.categories]
        code = np.array([*of_type, -1], dtype=np.int32)[place]
        reasons = _reason(inventory, place < 0, "have no structure type", "")
        known = f"archetype_of has {', '.join(map(repr, rule))}"
        reasons += _unknown_types(inventory, (code < 0) & (place >= 0), column, known)
    elif callable(rule):
        returned = pd.Series(rule(inventory))
        if len(returned) != len(inventory):
            raise ValueError(
                f"portfolio: archetype_of returned {len(returned)} names for {len(inventory)} buildings; it must "
                "return one name per building"
            )
        chosen = pd.Categorical(returned.to_numpy())
        names, code = [str(each) for each in chosen.categories], chosen.codes.astype(np.int32)
        reasons = _reason(inventory, code < 0, "have no name from archetype_of", "")
    else:
        raise TypeError(f"archetype_of must be a HazusRule, a mapping or a function, got {type(rule).__name__}")
    used = np.flatnonzero(np.bincount(code[code >= 0], minlength=len(names)))
    renumbered = np.full(len(names) + 1, -1, dtype=np.int32)
    renumbered[used] = np.arange(used.size)
    return Named([names[place] for place in used], renumbered[code], reasons, {})


def _unknown_types(inventory: pd.DataFrame, unknown: np.ndarray, column: pd.Series, known: str) -> list[str]:
    """Return a list with one reason that counts the buildings of each unknown type, the most frequent type first.

    Args:
        inventory: The inventory.
        unknown: Whether the type of each building is unknown, shape [building].
        column: Structure type of each building.
        known: Words about known types that end the reason.
    """
    if not unknown.any():
        return []
    counts = column[unknown].value_counts()
    counts = counts[counts > 0]
    shown = ", ".join(f"{name!r} ({count:,})" for name, count in list(counts.items())[:MOST_NAMED])
    more = f" and {counts.size - MOST_NAMED:,} more types" if counts.size > MOST_NAMED else ""
    return [f"{np.count_nonzero(unknown):,} are of unknown types: {shown}{more} ({known})"]


def _allowed_storeys(tables: Mapping[str, np.ndarray], families_of_rows: np.ndarray) -> str:
    """Return text such as " (C1 has 1 to 50)": the allowed numbers of storeys of types, at most MOST_NAMED of them."""
    if not families_of_rows.size:
        return ""
    names = [list(tables)[place] for place in np.unique(families_of_rows)]
    spans = [(name, np.flatnonzero(tables[name] >= 0)) for name in names[:MOST_NAMED]]
    shown = ", ".join(f"{name} has {span.min()} to {span.max()}" for name, span in spans)
    return f" ({shown}{', ...' if len(names) > MOST_NAMED else ''})"


def _reason(inventory: pd.DataFrame, bad: np.ndarray, what: str, *columns: str) -> list[str]:
    """Return a list with one reason why buildings have no archetype: their number, some ids, and values in columns.

    Args:
        inventory: The inventory.
        bad: Whether each building has no archetype for this reason, shape [building].
        what: The reason in words, such as "have no structure type".
        columns: Columns whose values are shown.
    """
    if not bad.any():
        return []
    shown = [name for name in columns if name]
    if len(shown) > 1:
        rows = inventory.loc[bad, shown].astype(str).agg(", ".join, axis=1) if bad.sum() < 10_000 else None
        if rows is not None:
            return [f"{named_rows(inventory.assign(_shown=rows), bad, '_shown')} {what}"]
    return [f"{named_rows(inventory, bad, shown[0] if shown else '')} {what}"]
