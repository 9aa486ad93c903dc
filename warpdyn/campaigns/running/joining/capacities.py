"""Joining of capacities (results of incremental dynamic analysis) with other structures, or with other motions."""

from __future__ import annotations

from collections.abc import Sequence
from typing import Any

import numpy as np
import pandas as pd
import xarray as xr

from warpdyn.campaigns.running.joining.attributes import check_comparable, check_start_times, joined_attributes
from warpdyn.campaigns.running.joining.identity import Identities, number_of
from warpdyn.foundations.core.messages import amount_of
from warpdyn.model.ground_motions.motions import motion_numbers


def join_capacities(datasets: Sequence[xr.Dataset]) -> xr.Dataset:
    """Return the capacities of all datasets as one dataset; errors: see `join`.

    Args:
        datasets: Results of `capacities` for one building and the same limits.
    """
    first = datasets[0]
    for place, found in enumerate(datasets):
        if "capacity" not in found or "drawn_structure" not in found.coords:
            raise ValueError(
                f"join: dataset {place} is not a result of capacities(), but others are: join results of one kind"
            )
        if "sample" in found.dims:
            raise ValueError(
                f"join: the curves of dataset {place} cannot be joined: give found.drop_dims('sample'), or remove "
                "keep_curves from capacities()"
            )
        for name in ("damage_state", "damage_limit"):
            if not np.array_equal(found[name].values, first[name].values):
                raise ValueError(
                    f"join: {name} of dataset {place} is {found[name].values.tolist()}, and that of dataset 0 "
                    f"{first[name].values.tolist()}: join capacities of the same limits"
                )
        if found.attrs.get("demand") != first.attrs.get("demand"):
            raise ValueError(
                f"join: the demand of dataset {place} is {found.attrs.get('demand')!r}, and that of dataset 0 is "
                f"{first.attrs.get('demand')!r}: join capacities that were computed with the same demand="
            )
    check_comparable(datasets)
    check_start_times(datasets)
    identities = [Identities(place, found) for place, found in enumerate(datasets)]
    kinds = {kind for each in identities for kind in each.buildings.values()}
    if len(kinds) > 1:
        raise ValueError(
            "join: the capacities are of different buildings or scatters, and cannot be joined: call "
            "fragility_from_capacities() for each of them"
        )
    drawn = [_drawn(each) for each in identities]
    motions = [each.motions for each in identities]
    _check_duplicates(drawn, motions)
    numbers, _ = pd.factorize(np.concatenate([each.ravel() for each in drawn]))
    sizes = np.cumsum([0, *(each.size for each in drawn)])
    parts = []
    for place, found in enumerate(datasets):
        own = numbers[sizes[place] : sizes[place + 1]].reshape(drawn[place].shape).astype(np.int32)
        parts.append(
            found.assign_coords(drawn_structure=(("structure", "motion"), own, found["drawn_structure"].attrs))
        )
    same_motions = all(np.array_equal(each, motions[0]) for each in motions)
    # True if each dataset has the same structures under every motion (crossed design), and all datasets share them.
    same_structures = all(len(each) == len(drawn[0]) and (each == drawn[0][:, :1]).all() for each in drawn)
    options: Any = {"data_vars": "minimal", "coords": "minimal", "compat": "override", "combine_attrs": "override"}
    if same_motions:
        joined = xr.concat(parts, "structure", **options)
        count = np.arange(joined.sizes["structure"], dtype=np.int32)
        joined = joined.assign_coords(structure=("structure", count, first["structure"].attrs))
    elif same_structures:
        joined = xr.concat(parts, "motion", **options)
        joined = joined.assign_coords(motion=motion_numbers(joined.sizes["motion"]))
    else:
        raise ValueError(
            "join: the capacities have neither the same motions nor the same structures, and a table of structures and "
            "motions would have gaps: join those of other seeds under the same motions, or of other motions with the "
            "same seed and number of structures"
        )
    return joined.assign_attrs(joined_attributes("join", datasets))


def _drawn(each: Identities) -> np.ndarray:
    """Return the identity (digest) of the structure of each pair, shape [structure, motion]."""
    table = each.run["drawn_structure"].transpose("structure", "motion")
    sampling = str(table.attrs.get("sampling", ""))
    of_all = (int(table.max()) + 1,) if sampling == "latin_hypercube" else ()
    building = next(iter(each.buildings.values()))
    known = {int(number): number_of(building, each.seed, int(number), *of_all) for number in np.unique(table.values)}
    return np.vectorize(known.__getitem__, otypes=[np.int64])(table.values)


def _check_duplicates(drawn: list[np.ndarray], motions: list[np.ndarray]) -> None:
    """Raise a ValueError if two datasets contain the same pair of a structure and a motion.

    Args:
        drawn: For each dataset, the identity of each structure, shape [structure, motion].
        motions: For each dataset, the identity of each motion, shape [motion].
    """
    seen: dict[tuple[int, int], int] = {}
    for place, (structures, of_motions) in enumerate(zip(drawn, motions, strict=True)):
        pairs = set(zip(structures.ravel().tolist(), np.tile(of_motions, len(structures)).tolist(), strict=True))
        shared = [seen[pair] for pair in pairs if pair in seen]
        if shared:
            raise ValueError(
                f"join: dataset {place} and dataset {shared[0]} have {amount_of(len(shared), 'pair')} of a structure "
                "and a motion in common, which would count twice: remove one of them, or run capacities() with another "
                "seed="
            )
        seen |= dict.fromkeys(pairs, place)
