"""Readers of damage counts from the statistics of a run, i.e. from a run that does not contain single samples."""

from __future__ import annotations

import json
from collections.abc import Mapping
from typing import Any

import numpy as np
import xarray as xr

from warpdyn.campaigns.reductions.limits import DAMAGE_COUNT, DRIFT, LEAST_DRIFT, NO_DAMAGE, DamageLimits, Limit

OF_STRIPES = ("motion", "structure_group", "stripe")
_STATE, _FAILURE = "damage_state", "failure"


def is_reduced(dataset: xr.Dataset) -> bool:
    """Return whether a dataset contains damage counts of a run instead of samples."""
    return "sample" not in dataset.dims and any(str(name).startswith(DAMAGE_COUNT) for name in dataset.data_vars)


def counts_over(function: str, dataset: xr.Dataset, *choices: tuple[str, ...]) -> str:
    """Return the name of the damage counts whose dimensions are one of `choices`, or raise a ValueError.

    Args:
        function: Name of the public function, for messages.
        dataset: The statistics of a run.
        choices: Tuples of dimensions, in the order of preference, without "damage_state".
    """
    for dims in choices:
        for name, variable in dataset.data_vars.items():
            if str(name).startswith(DAMAGE_COUNT) and set(variable.dims) == {*dims, _STATE}:
                return str(name)
    if not is_reduced(dataset):
        raise ValueError(
            f"{function}: the dataset has no damage counts: give the result of simulate(..., "
            f"statistics=DamageCounts(limits, over={choices[0]!r}))"
        )
    over = " or ".join(str(dims) for dims in choices)
    found = [f"{name}{variable.dims}" for name, variable in dataset.data_vars.items() if DAMAGE_COUNT in str(name)]
    raise ValueError(
        f"{function}: the statistics have no damage counts over {over}, only {', '.join(found)}: simulate with "
        f"DamageCounts(limits, over={choices[0]!r})"
    )


def part_of_scene(dataset: xr.Dataset, name: str, holds: str) -> dict[str, Any] | None:
    """Return a part of a run's scene, "structure" or "excitation", parsed from the JSON in the attribute `scene`.

    Only this part of the text is parsed, because another part may list a million buildings. The result is None unless
    the first 200 characters of the part contain the text `holds`.
    """
    text, key = str(dataset.attrs.get("scene", "")), f'"{name}":'
    begin = text.find(key) + len(key)
    if begin < len(key) or holds not in text[begin : begin + 200]:
        return None
    found: dict[str, Any] = json.JSONDecoder().raw_decode(text, begin)[0]
    return found


def archetype_counts(dataset: xr.Dataset) -> dict[str, int] | None:
    """Return the number of buildings of each archetype in the run of a portfolio; None for other runs."""
    structure = part_of_scene(dataset, "structure", '"archetypes"')
    return None if structure is None else {name: int(each["count"]) for name, each in structure["archetypes"].items()}


def limits_of(dataset: xr.Dataset, limits: Mapping[str, Limit] | None, demand: str) -> DamageLimits:
    """Return the checked limits of the damage states; if the dataset contains counts, those with which it was counted.

    Args:
        dataset: A run, or the damage counts of a run.
        limits: Limits from the user; for counts they must be None or equal to the limits of the counts.
        demand: Name of the demand to which limits that are plain numbers apply.

    Raises:
        ValueError, TypeError: If limits are invalid, or differ from the limits of the counts.
    """
    if not is_reduced(dataset):
        return DamageLimits.of(limits, demand)  # type: ignore[arg-type]  # None raises a TypeError
    counts_over("fragility", dataset, OF_STRIPES)
    given = dataset["damage_limit"]
    states = tuple(str(state) for state in given[_STATE].values if state != NO_DAMAGE)
    values = given.sel({_STATE: list(states)}).transpose(..., _STATE).values.reshape(-1, len(states))
    found = DamageLimits(states, tuple(str(given.attrs["demand"]).split(", ")), values)
    if limits is not None:
        asked = DamageLimits.of(limits, demand)
        same = (asked.states, asked.demands) == (found.states, found.demands)
        if not same or not np.array_equal(asked.values, found.values, equal_nan=True):
            raise ValueError(
                f"the run has counts for the limits {dict(zip(states, values[0].tolist(), strict=True))} of "
                f"{', '.join(found.demands)}, and single samples are not available: remove limits="
            )
    return found


def labels_of_run(dataset: xr.Dataset) -> xr.Dataset:
    """Return a dataset without values whose attributes describe the demands, levels and storeys of a run's counts."""
    counts = dataset[counts_over("fragility", dataset, OF_STRIPES)]
    demands, units = (str(counts.attrs[name]).split(", ") for name in ("demand", "demand_units"))
    empty: dict[str, Any] = {name: ((), np.nan, {"units": each}) for name, each in zip(demands, units, strict=True)}
    empty["im_level"] = ((), np.nan, dataset["stripe"].attrs)
    places = {name: dataset[name] for name in ("storey", "floor", "dof") if name in dataset.coords}
    return xr.Dataset(empty, places, dataset.attrs)


def stripe_counts_of(dataset: xr.Dataset, limits: DamageLimits) -> dict[str, Any]:
    """Return the fields of `StripeCounts` from damage counts, with "failed" and "failures" instead of "excluded".

    The arrays `exceeding` and `valid` still contain records and levels without samples, which `_counted` removes.
    """
    name = counts_over("fragility", dataset, OF_STRIPES)
    table = dataset[name].transpose(*OF_STRIPES, _STATE).values
    failed = dataset[name.replace(DAMAGE_COUNT, "failed_count")].transpose(*OF_STRIPES, _FAILURE)
    (dim,) = [str(each) for each in dataset.dims if f"{each}_{name}" in dataset] or [""]
    tables, places = table[..., None, :], np.arange(0)
    if dim:
        of_places = dataset[f"{dim}_{name}"].transpose(*OF_STRIPES, dim, _STATE).values
        is_there = of_places.any(axis=(0, 1, 2, 4)) | ~table.any()  # an archetype may have fewer storeys
        places = dataset[dim].values[is_there]
        tables = np.concatenate([of_places[..., is_there, :], tables], axis=-2)
    has_samples = table.any(axis=(0, 2, 3)) | failed.values.any(axis=(0, 2, 3))
    groups = int(np.flatnonzero(has_samples).max(initial=0)) + 1
    return {
        "levels": dataset["stripe"].values,
        "units": str(dataset["stripe"].attrs.get("units", "g")),
        "dim": dim,
        "places": places,
        # A sample that has reached a state has also reached all lighter states, so the counts are summed.
        "exceeding": tables[:, :groups, ..., ::-1].cumsum(axis=-1)[..., ::-1][..., 1:],
        "valid": table.sum(axis=-1)[:, :groups],
        "failed": failed.values[:, :groups],
        "failures": [str(each) for each in failed[_FAILURE].values],
        "records": dataset["motion"].values,
        "is_crossed": dataset[name].attrs["structures_of_motions"] == "the same",
        "least_drift": float(dataset[LEAST_DRIFT]) if LEAST_DRIFT in dataset and DRIFT in limits.demands else np.inf,
    }
