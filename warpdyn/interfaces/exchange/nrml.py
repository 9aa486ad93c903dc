"""Helpers for NRML 0.5, the XML format of OpenQuake: reading and writing elements, and checks of names."""

from __future__ import annotations

import os
import re
import xml.etree.ElementTree as ElementTree
from collections.abc import Iterable, Mapping
from pathlib import Path

import numpy as np
import xarray as xr

from warpdyn.foundations.core.checks import check_kind
from warpdyn.foundations.files.text import existing_file
from warpdyn.interfaces.exchange.text_files import check_same_format, write_text

PROGRAM = "warpdyn"  # value of the XML attribute `id` in the models that warpdyn writes
NAMESPACE = "http://openquake.org/xmlns/nrml/0.5"
LOSS_TYPES = (
    *("structural", "nonstructural", "contents", "business_interruption"),
    *("occupants", "occupants_day", "occupants_night", "occupants_transit"),
)
LONGEST_NAME = 75  # largest number of characters in the name of a damage state; MAX_ID_LENGTH in OpenQuake


def check_by_taxonomy(function: str, datasets: object, argument: str) -> None:
    """Raise an error unless an argument is a mapping of taxonomy names to datasets with at least one entry."""
    advice = "pass {'taxonomy': dataset}"
    if isinstance(datasets, xr.Dataset):  # a Dataset is a mapping, too
        raise TypeError(
            f"{function}() needs a mapping of taxonomies to datasets, got one Dataset; {advice} as {argument}"
        )
    check_kind(function, "a mapping of taxonomies to datasets", datasets, Mapping, advice, argument=argument)
    assert isinstance(datasets, Mapping)
    if not datasets:
        raise ValueError(
            f"{function}() needs at least one taxonomy, but {argument} is an empty mapping: give {{'CR/H:5': dataset}}"
        )
    for taxonomy, dataset in datasets.items():
        check_taxonomy(function, taxonomy)
        check_kind(function, f"a Dataset for taxonomy {taxonomy!r} of {argument}", dataset, xr.Dataset)


def check_taxonomy(function: str, taxonomy: object, what: str = "taxonomy") -> None:
    """Raise a ValueError unless OpenQuake accepts the name of a taxonomy: ASCII text without spaces, quotes or '#'."""
    good = isinstance(taxonomy, str) and taxonomy and taxonomy.isascii() and not re.search(r"[\s#'\"]", taxonomy)
    if not good:
        raise ValueError(
            f"{function}: {what} {taxonomy!r} must be ASCII text without spaces, quotes or '#': rename it, such as "
            "'CR/H:5'"
        )


def check_state_names(function: str, states: Iterable[object]) -> None:
    """Raise a ValueError unless OpenQuake accepts the name of each damage state (characters and length)."""
    for state in states:
        if not re.fullmatch(r"[A-Za-z0-9_\-:]+", str(state)) or len(str(state)) > LONGEST_NAME:
            raise ValueError(
                f"{function}: OpenQuake splits or refuses the name of damage state {str(state)!r}; use at most "
                f"{LONGEST_NAME} letters, digits, '_', '-' and ':'; rename it by assign_coords(damage_state=[...])"
            )


def checked_description(function: str, description: str | None, default: str) -> str:
    """Return the description of a model without surrounding spaces; raise a ValueError if the text is empty."""
    text = default if description is None else description
    if not isinstance(text, str) or not text.strip():
        raise ValueError(
            f"{function}: description must be text, because OpenQuake requires it, got {description!r}: remove "
            "description= or give a text"
        )
    return text.strip()


def model(tag: str, loss_type: str, description: str) -> tuple[ElementTree.Element, ElementTree.Element]:
    """Create an NRML document; return its root element and the element of the model, which contains its description."""
    root = ElementTree.Element("nrml", xmlns=NAMESPACE)
    attributes = {"id": PROGRAM, "assetCategory": "buildings", "lossCategory": loss_type}
    found = ElementTree.SubElement(root, tag, attributes)
    ElementTree.SubElement(found, "description").text = description
    return root, found


def write_xml(function: str, path: Path, root: ElementTree.Element, overwrite: bool) -> Path:
    """Write an NRML document to a file, and return the path.

    Raises:
        FileExistsError: If the file exists, `overwrite` is False, and warpdyn did not write a model of this kind to it.
    """
    tag = root[0].tag
    mark = f'<{tag} id="{PROGRAM}"'
    check_same_format(function, path, mark, f"a {tag} that warpdyn wrote", overwrite)
    ElementTree.indent(root)
    text = ElementTree.tostring(root, encoding="unicode")
    return write_text(path, f'<?xml version="1.0" encoding="utf-8"?>\n{text}\n')


def row(values: Iterable[float]) -> str:
    """Return numbers as text, separated by spaces, with all digits, so that reading the text gives the same numbers."""
    return " ".join(repr(float(value)) for value in values)


def read_model(function: str, path: str | os.PathLike, tag: str) -> ElementTree.Element:
    """Read an NRML 0.5 file and return the XML element of its model `tag`; namespaces are removed from element names.

    Raises:
        ValueError: If the file is not NRML 0.5 or does not contain such a model.
        FileNotFoundError: If the file does not exist.
    """
    path = existing_file(function, path)
    try:
        root = ElementTree.parse(path).getroot()
    except (ElementTree.ParseError, LookupError, ValueError) as error:  # the last two: unknown encoding
        raise ValueError(f"{function}: {path} is not XML: {error}. Export the file again, or correct it") from None
    if root.tag != f"{{{NAMESPACE}}}nrml":
        raise ValueError(
            f"{function}: {path} is not NRML 0.5: its root is {root.tag!r}, not 'nrml' of "
            f"{NAMESPACE}: export the model as NRML 0.5"
        )
    for element in root.iter():
        element.tag = element.tag.rpartition("}")[2]
    found = root.find(tag)
    if found is None:
        raise ValueError(
            f"{function}: {path} contains no {tag}; it contains "
            f"{', '.join(child.tag for child in root) or 'nothing'}. Give a file with this model"
        )
    return found


def child(path: object, parent: ElementTree.Element, tag: str) -> ElementTree.Element:
    """Return the child element `tag` of an XML element; if it is missing, raise a ValueError that names both."""
    found = parent.find(tag)
    if found is None:
        raise ValueError(f"{path}: {_named(parent)} has no {tag}: correct the file")
    return found


def attribute(path: object, element: ElementTree.Element, name: str) -> str:
    """Return the text of an XML attribute; if it is missing, raise a ValueError that names element and attribute."""
    value = element.get(name)
    if value is None:
        raise ValueError(f"{path}: {_named(element)} has no attribute {name!r}: correct the file")
    return value


def number(path: object, element: ElementTree.Element, name: str, least: float = -np.inf) -> float:
    """Return an XML attribute as a number; raise a ValueError if it is not a finite number or is below `least`."""
    what = f"{name} of {_named(element)}"
    value = float(_numbers(path, what, attribute(path, element, name), 1)[0])
    if value < least:
        raise ValueError(f"{path}: {what} is {value:g}; it must be at least {least:g}: correct the file")
    return value


def numbers(path: object, element: ElementTree.Element, count: int | None = None) -> np.ndarray:
    """Return the numbers in the text of an XML element; raise a ValueError unless there are `count` finite numbers."""
    return _numbers(path, _named(element), element.text or "", count)


def _numbers(path: object, what: str, text: str, count: int | None) -> np.ndarray:
    try:
        values = np.array([float(word) for word in text.split()])
    except ValueError:
        raise ValueError(f"{path}: {what} must contain numbers, got {text.strip()!r}: correct the file") from None
    if not np.isfinite(values).all():
        raise ValueError(
            f"{path}: {what} contains {values[~np.isfinite(values)][0]:g}; every number must "
            "be finite: correct the file"
        )
    if count is not None and len(values) != count:
        raise ValueError(f"{path}: {what} must contain {count} numbers, got {len(values)}: correct the file")
    return values


def _named(element: ElementTree.Element) -> str:
    name = element.get("id") or element.get("ls")
    return f"{element.tag} {name!r}" if name else element.tag
