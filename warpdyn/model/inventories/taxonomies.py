"""Conversion of structure types in an inventory (Hazus names, or strings of GEM's building taxonomy) to Hazus types."""

from __future__ import annotations

import functools
import re
from collections.abc import Mapping
from dataclasses import dataclass
from types import MappingProxyType

import numpy as np

from warpdyn.model.structures.hazus import DESIGN_LEVELS, building_class, building_types

MOST_STOREYS = 50  # largest number of storeys of a Hazus type in warpdyn
WOOD, MOST_STOREYS_OF_W1 = "wood", 2  # Hazus Technical Manual, table 5.1: W1 has 1 to 2 storeys
HEIGHT_CLASSES = "LMH"

# Material and lateral system in GEM's building taxonomy (Brzev et al. 2013, GEM Building Taxonomy Version 2.0; Silva
# et al. 2022, Earthquake Spectra 38(1), for version 3) -> equivalent Hazus type (Technical Manual, chapter 5, model
# building types). Structures without a Hazus type, such as confined masonry, adobe and bamboo, are not listed.
_GEM = {
    ("W", "LFM"): WOOD,
    ("W", "LWAL"): WOOD,
    ("W", ""): WOOD,
    ("S", "LFM"): "S1",
    ("S", "LFBR"): "S2",
    ("S", "LDUAL"): "S4",
    ("S", "LFINF"): "S5",
    ("CR", "LFM"): "C1",
    ("CR", "LWAL"): "C2",
    ("CR", "LDUAL"): "C2",
    ("CR", "LFINF"): "C3",
    ("CR+PC", "LWAL"): "PC1",
    ("CR+PC", "LDUAL"): "PC2",
    ("MUR", "LWAL"): "URM",
    ("MUR", ""): "URM",
    # Reinforced masonry has two Hazus types, which are distinguished by their floors (third element).
    ("MR", "LWAL", "FW"): "RM1",
    ("MR", "LWAL", "FME"): "RM1",
    ("MR", "LWAL", "FC"): "RM2",
}
# Materials with one of these details have no Hazus type: heavy timber, bamboo, wattle and daub; adobe and stone.
_WITHOUT_TYPE = {"W": ("WHE", "WBB", "WWD", "WLO"), "MUR": ("ADO", "ST99", "STRUB", "STDRE", "STON")}
_LEVELS = {
    "CDN": "pre",
    "CDL": "low",
    "CDM": "moderate",
    "CDH": "high",
    "DNO": "pre",
    "DUL": "low",
    "DUM": "moderate",
    "DUH": "high",
}
_HEIGHT = re.compile(r"(?:^|[/+])H(?:EX|APP|BET)?:(\d+)(?:[-,](\d+))?(?=[/+]|$)")


@dataclass(frozen=True)
class Structure:
    """Hazus type, number of storeys and design level that a text such as "C1" or "CR/LFINF+DUL/H:2" contains.

    Args:
        family: Name of the Hazus type, a key of `families()`; "": there is no equivalent Hazus type.
        storeys: Number of storeys; NaN if the text does not contain it.
        level: Design level; "" if the text does not contain it.
    """

    family: str = ""
    storeys: float = np.nan
    level: str = ""


@functools.cache
def families() -> Mapping[str, np.ndarray]:
    """Return family -> Hazus types as indices into `building_types()`, one per number of storeys from 0 to 50.

    A family is a Hazus type ("C1M"), a type without height class ("C1"), or "wood", which is W1 up to two storeys and
    W2 above. The index is -1 if the family has no type with this number of storeys.
    """
    found: dict[str, np.ndarray] = {}
    for place, name in enumerate(building_types()):
        row = building_class(name, DESIGN_LEVELS[0])
        storeys = slice(int(row["min_storeys"]), int(row["max_storeys"]) + 1)
        bare = name[:-1] if name[-1] in HEIGHT_CLASSES and name != "MH" else name
        for each in dict.fromkeys((name, bare)):
            found.setdefault(each, np.full(MOST_STOREYS + 1, -1))[storeys] = place
    small, large = found["W1"].copy(), found["W2"]
    found[WOOD] = np.where(np.arange(MOST_STOREYS + 1) > MOST_STOREYS_OF_W1, large, small)
    return MappingProxyType(found)


def structure_of(text: str) -> Structure:
    """Return the type, storeys and design level in a text, which is a Hazus name or a string of GEM's taxonomy."""
    name = text.strip()
    if name.upper() in families():
        return Structure(name.upper())
    segments = [segment.split("+") for segment in name.split("/")]
    atoms = {atom for segment in segments for atom in segment}
    level = next((level for atom, level in _LEVELS.items() if atom in atoms), "")
    height = _HEIGHT.search(name)
    # If a range of storeys is given, use its mean, rounded up.
    storeys = np.ceil(np.mean([float(each) for each in height.groups() if each])) if height else np.nan
    return Structure(_family(segments), float(storeys), level)


def _family(segments: list[list[str]]) -> str:
    """Return the Hazus family of a string of GEM's taxonomy; "" if there is no equivalent Hazus type.

    Args:
        segments: The string, divided at "/" and then at "+".
    """
    for place, (material, *details) in enumerate(segments):
        if material not in ("W", "S", "CR", "MUR", "MR"):
            continue
        if set(details) & set(_WITHOUT_TYPE.get(material, ())):
            return ""
        heads = [segment[0] for segment in segments[place + 1 :]]
        system = next((head for head in heads if re.fullmatch(r"L[A-Z]+", head)), "")
        floor = next((head for head in heads if head in ("FW", "FME", "FC")), "")
        if material == "S" and "SL" in details:
            return "S3"  # Hazus type of light-gauge steel, which has any lateral system
        if material == "CR" and "PC" in details:
            material = "CR+PC"
        return _GEM.get((material, system)) or _GEM.get((material, system, floor), "")
    return ""
