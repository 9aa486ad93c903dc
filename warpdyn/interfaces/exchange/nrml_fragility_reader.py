"""Reader of fragility models of OpenQuake (NRML 0.5)."""

from __future__ import annotations

import os
import xml.etree.ElementTree as ElementTree
from typing import Any

import numpy as np
import xarray as xr

from warpdyn.answers.risk.curves.curve_set import CurveSet
from warpdyn.answers.risk.integrals.intensity_limits import MAXIMUM, MINIMUM, NO_DAMAGE
from warpdyn.foundations.core.checks import one_of
from warpdyn.foundations.core.units import unit_attributes
from warpdyn.interfaces.exchange import nrml
from warpdyn.interfaces.exchange.exceedance import CHECKED_POINTS, LEAST_CHECKED, check_exceedance, check_order
from warpdyn.interfaces.exchange.measures import from_openquake, own_name

READER = "read_nrml_fragility"


def read_nrml_fragility(path: str | os.PathLike) -> dict[str, xr.Dataset]:
    """Read a fragility model of OpenQuake (NRML 0.5) that `write_nrml_fragility` or another program wrote.

    Args:
        path: Path of the XML file.

    Returns:
        For each taxonomy, a dataset like the result of `fragility`. For continuous functions it contains
        `fragility_median(damage_state)` [g or SI] and `fragility_dispersion(damage_state)` [1], for discrete functions
        `exceedance_fraction(damage_state, stripe)` [1]. The attributes `no_damage_limit`, `minimum_intensity` and
        `maximum_intensity` (in the file: noDamageLimit, minIML and maxIML) have the unit of the medians. warpdyn
        applies these limits as OpenQuake does: it replaces intensities outside the minimum and the maximum by the
        nearest of the two, and there is no damage at or below `no_damage_limit`.

    Raises:
        ValueError: If the file is not a fragility model; if a required element is missing; or if values are not finite,
            are outside their range, decrease, or belong to curves that cross by more than `write_nrml_fragility`
            allows. The error names the file and the function.
        FileNotFoundError: If the file does not exist.

    Example:
        >>> path = wd.write_nrml_fragility({"CR/LFM/HEX:2": curves}, "fragility.xml")
        >>> again = wd.read_nrml_fragility(path)["CR/LFM/HEX:2"]
        >>> again["fragility_median"].round(2).values  # g
        array([0.49, 1.24])
    """
    model = nrml.read_model(READER, path, "fragilityModel")
    states = (nrml.child(path, model, "limitStates").text or "").replace(",", " ").split()
    described = (nrml.child(path, model, "description").text or "").strip()
    if not states:
        raise ValueError(
            f"{path}: the element limitStates is empty; it must contain the names of the damage states: correct the "
            "file"
        )
    if len(set(states)) < len(states):
        raise ValueError(
            f"{path}: limitStates contains a name twice: {' '.join(states)}; names must be different: correct the file"
        )
    found: dict[str, xr.Dataset] = {}
    for function in model.iter("fragilityFunction"):
        taxonomy = nrml.attribute(path, function, "id")
        if taxonomy in found:
            raise ValueError(
                f"{path}: two functions have the id {taxonomy!r}; write the functions of each intensity measure into a "
                "separate file"
            )
        levels = nrml.child(path, function, "imls")
        imt = nrml.attribute(path, levels, "imt")
        units, factor = from_openquake(path, imt)
        format = nrml.attribute(path, function, "format").lower()
        one_of(f"format of {taxonomy!r} in {path}", format, ("continuous", "discrete"))
        attributes: dict[str, Any] = {
            "intensity_measure": own_name(imt),
            "fragility_method": f"read from {os.path.basename(path)}: {described}",
        }
        if levels.get("noDamageLimit") is not None:
            attributes[NO_DAMAGE] = nrml.number(path, levels, "noDamageLimit", 0) * factor
        read = _continuous if format == "continuous" else _discrete
        variables, coordinates = read(path, function, states, units, factor, attributes)
        coordinates["damage_state"] = ("damage_state", np.array(states), {"long_name": "damage state"})
        found[taxonomy] = xr.Dataset(variables, coordinates, attributes)
        _check(f"{path}: function {taxonomy!r}", found[taxonomy])
    if not found:
        raise ValueError(
            f"{READER}: {path} has a fragilityModel without a fragilityFunction: give a file with at least one function"
        )
    return found


def _rows(path: object, function: ElementTree.Element, tag: str, states: list[str]) -> list[ElementTree.Element]:
    """Return the XML elements `tag` of a function, one per damage state; raise a ValueError if their order is wrong."""
    rows = function.findall(tag)
    names = [nrml.attribute(path, row, "ls") for row in rows]
    if names != states:
        raise ValueError(
            f"{path}: function {function.get('id')!r} has {tag} for {', '.join(names) or 'no state'}, but it must have "
            f"those of limitStates, in the same order: {', '.join(states)}. Correct the file"
        )
    return rows


def _continuous(
    path: object, function: ElementTree.Element, states: list[str], units: str, factor: float, attributes: dict
) -> tuple[dict[str, Any], dict[str, Any]]:
    """Return the dataset variables and coordinates of a continuous function.

    The minimum and maximum intensity of the function are added to the dictionary `attributes`.
    """
    rows = _rows(path, function, "params", states)
    mean, stddev = (np.array([nrml.number(path, row, name) for row in rows]) for name in ("mean", "stddev"))
    for state, m, s in zip(states, mean, stddev, strict=True):
        if not (0 < m < np.inf and 0 < s < np.inf):
            where = f"function {function.get('id')!r}, {state!r}"
            raise ValueError(
                f"{path}: {where}: mean {m:g} and stddev {s:g} must both be finite and above 0: correct the file"
            )
    variance = np.log1p((stddev / mean) ** 2)
    levels = nrml.child(path, function, "imls")
    for name, key in (("minIML", MINIMUM), ("maxIML", MAXIMUM)):
        attributes[key] = nrml.number(path, levels, name, 0) * factor
    least, greatest = attributes[MINIMUM], attributes[MAXIMUM]
    if not greatest > least:
        raise ValueError(
            f"{path}: function {function.get('id')!r} has maxIML {greatest / factor:g}, which must be above minIML, "
            f"{least / factor:g}: correct the file"
        )
    if attributes.get(NO_DAMAGE, 0) >= greatest:
        raise ValueError(
            f"{path}: function {function.get('id')!r} has noDamageLimit {attributes[NO_DAMAGE] / factor:g} and maxIML "
            f"{greatest / factor:g}, so no intensity would cause damage: correct the file"
        )
    median = mean * np.exp(-variance / 2) * factor
    said = {"long_name": "median capacity"} | unit_attributes(units)
    return {
        "fragility_median": ("damage_state", median, said),
        "fragility_dispersion": (
            "damage_state",
            np.sqrt(variance),
            {"long_name": "dispersion of the capacity", "units": "1"},
        ),
    }, {}


def _check(what: str, dataset: xr.Dataset) -> None:
    """Raise a ValueError unless `write_nrml_fragility` would accept the curves of a function."""
    points = "exceedance_fraction" if "exceedance_fraction" in dataset else ""
    curves = CurveSet.from_dataset(what, dataset, points=points)
    if curves.table is not None:
        check_exceedance(what, curves, *curves.table[1:])
        return
    check_order(what, curves)
    least, greatest = curves.limits.minimum, curves.limits.maximum
    levels = np.geomspace(least or LEAST_CHECKED * greatest, greatest, CHECKED_POINTS)
    check_exceedance(what, curves, levels, curves.shape.probability(levels, curves.median, curves.dispersion))


def _discrete(
    path: object, function: ElementTree.Element, states: list[str], units: str, factor: float, attributes: dict
) -> tuple[dict[str, Any], dict[str, Any]]:
    """Return the dataset variables and coordinates of a discrete function."""
    rows = _rows(path, function, "poes", states)
    levels = nrml.numbers(path, nrml.child(path, function, "imls"))
    probability = np.array([nrml.numbers(path, row, len(levels)) for row in rows])
    said = {"long_name": "intensity of the stripe"} | unit_attributes(units)
    share = {"long_name": "probability of exceedance", "units": "1"}
    variables = {"exceedance_fraction": (("damage_state", "stripe"), probability, share)}
    return variables, {"stripe": ("stripe", levels * factor, said)}
