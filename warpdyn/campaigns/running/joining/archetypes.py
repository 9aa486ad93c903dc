"""Joining of runs of different buildings to the run of a portfolio, in which each building is an archetype."""

from __future__ import annotations

from typing import Any

import numpy as np
import xarray as xr

from warpdyn.campaigns.portfolio.labels import OF_SAMPLE, table_of_archetypes
from warpdyn.campaigns.running.joining.identity import OF_ARCHETYPES, Identities
from warpdyn.foundations.core.output_variables import KIND_ATTRIBUTES, KIND_OF_ARCHETYPES, STOREY_KIND
from warpdyn.model.structures.structure import count_along

PLACES = ("storey", "floor")


def as_portfolio(identities: list[Identities], names: list[str], parts: list[xr.Dataset]) -> xr.Dataset:
    """Return the samples of runs of several buildings in the form of a portfolio's run from `simulate`.

    Args:
        identities: The runs with the identities of their buildings, structures and motions.
        names: Name of each run that the user gave; "" without a name.
        parts: Samples of each run, with numbers of structures and motions that are unique in all runs.

    Raises:
        ValueError: If a run is not the run of a ShearBuilding.
    """
    for each in identities:
        if "dof" in each.run.dims or not set(PLACES) & set(each.run.dims):
            raise ValueError(
                f"join: run {each.place} is not of a ShearBuilding, and the runs are of different structures: join "
                "runs of one structure, or of ShearBuildings"
            )
    known = _names_of_buildings(identities, names)
    numbers = {kind: place for place, kind in enumerate(known.values())}
    storeys = np.zeros(len(known), dtype=np.int32)
    highest = max(_storeys(each.run) for each in identities)
    kinds = np.zeros((len(known), highest), dtype=np.int8)
    found = []
    for each, part in zip(identities, parts, strict=True):
        index = np.array([numbers[kind] for kind in each.building_of_sample.tolist()], dtype=np.int32)
        for place in np.unique(index):
            storeys[place], own = _own_storeys(each, int(np.flatnonzero(index == place)[0]))
            kinds[place, : own.size] = own
        rows = part[[name for name, variable in part.variables.items() if "sample" in variable.dims]]
        rows = rows.drop_vars("structure" if "structure" in rows.coords else "building")
        # Remove the storey kinds of this building: KIND_OF_ARCHETYPES contains the storey kinds of all buildings.
        rows = rows.drop_vars((*PLACES, STOREY_KIND), errors="ignore")
        rows = rows.pad({dim: (0, highest - rows.sizes[dim]) for dim in PLACES if dim in rows.dims})
        own_number = part["building" if each.is_portfolio else "structure"]
        sampling = own_number.attrs.get("sampling")
        said = OF_SAMPLE["building"] | ({"sampling": sampling} if sampling else {})
        numbered = {
            "building": ("sample", own_number.values, said),
            "archetype_index": ("sample", index, OF_SAMPLE["archetype_index"]),
        }
        found.append(rows.assign_coords(numbered))
    joined = _filled(found)
    if "motion" in parts[0].dims:
        table = parts[0][[n for n, v in parts[0].variables.items() if v.dims == ("motion",)]]
        joined = joined.assign(table.data_vars).assign_coords(motion=parts[0]["motion"])
    index, building = joined["archetype_index"].values, joined["building"].values
    counts = [np.unique(building[index == place]).size for place in range(len(known))]
    joined = joined.assign(table_of_archetypes(known, storeys, counts))
    identity = {"long_name": "digest of what it is", "units": "1"}
    joined[OF_ARCHETYPES] = "archetype", np.array(list(known.values())), identity
    if kinds.any():
        joined = joined.assign_coords({KIND_OF_ARCHETYPES: (("archetype", "storey"), kinds, KIND_ATTRIBUTES)})
    places = [dim for dim in PLACES if dim in joined.dims]
    return joined.assign_coords({dim: count_along(dim, highest, f"{dim}, from the ground up") for dim in places})


def _names_of_buildings(identities: list[Identities], names: list[str]) -> dict[str, int]:
    """Return the identity of each building type in the runs, by a unique name.

    Args:
        identities: The runs.
        names: Name of each run that the user gave; "" without a name.
    """
    known: dict[str, int] = {}
    for each, name in zip(identities, names, strict=True):
        for own, kind in each.buildings.items():
            if kind in known.values():
                continue
            wanted = own if each.is_portfolio else name or own
            chosen, number = wanted, 2
            while chosen in known:
                chosen, number = f"{wanted} ({number})", number + 1
            known[chosen] = kind
    return known


def _storeys(run: xr.Dataset) -> int:
    return max(run.sizes.get(dim, 0) for dim in PLACES)


def _own_storeys(each: Identities, sample: int) -> tuple[int, np.ndarray]:
    """Return the number of storeys of a sample's building, and the kind of each storey (0: of the building itself)."""
    run = each.run
    if not each.is_portfolio:
        kinds = run[STOREY_KIND].values if STOREY_KIND in run.coords else np.zeros(_storeys(run), dtype=np.int8)
        return _storeys(run), kinds
    place = int(run["archetype_index"].values[sample])
    storeys = int(run["storeys_of_archetype"].values[place])
    if KIND_OF_ARCHETYPES not in run.coords:
        return storeys, np.zeros(storeys, dtype=np.int8)
    return storeys, run[KIND_OF_ARCHETYPES].transpose("archetype", "storey").values[place, :storeys]


def _filled(parts: list[xr.Dataset]) -> xr.Dataset:
    """Return the samples of all runs in one dataset; inputs that only some runs have are NaN in the other runs."""
    names = dict.fromkeys(name for part in parts for name in part.data_vars)
    for place, part in enumerate(parts):
        for name in names:
            if name not in part:
                other = next(each[name] for each in parts if name in each)
                shape = tuple(part.sizes["sample"] if dim == "sample" else other.sizes[dim] for dim in other.dims)
                part = part.assign({name: (other.dims, np.full(shape, np.nan, other.dtype), other.attrs)})
        parts[place] = part
    options: Any = {"data_vars": "all", "coords": "different", "compat": "equals", "join": "outer"}
    return xr.concat(parts, "sample", combine_attrs="override", **options)
