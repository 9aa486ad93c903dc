"""Public function `join`, which joins runs and renumbers their structures and motions by identity."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from typing import Any

import numpy as np
import pandas as pd
import xarray as xr

from warpdyn.campaigns.running.joining.archetypes import as_portfolio
from warpdyn.campaigns.running.joining.attributes import check_comparable, check_start_times, joined_attributes
from warpdyn.campaigns.running.joining.capacities import join_capacities
from warpdyn.campaigns.running.joining.identity import OF_BUILDING, OF_INPUTS, OF_MOTIONS, OF_SAMPLES, Identities
from warpdyn.foundations.core.checks import check_dataset
from warpdyn.foundations.core.near_misses import suggests_names
from warpdyn.model.ground_motions.motions import motion_numbers

ADVICE = "give results of simulate(), such as wd.join([run, other])"
SAMPLING = ("sobol", "latin_hypercube", "monte_carlo", "given")  # the first that occurs decides the intervals


@suggests_names
def join(runs: Sequence[xr.Dataset] | Mapping[str, xr.Dataset]) -> xr.Dataset:
    """Join several runs into one run, for `fragility` and all other estimators.

    Numbers of structures and motions are valid only within one run: structure 0 of another seed is another structure,
    and motion 0 of another scene may be another record. The joined run has new numbers. Two structures are the same if
    their building, scatter, seed, number and drawn parameters are equal. Two motions are the same if their names and
    samples are equal.

    Runs of different buildings, or with different collapse limits, become the archetypes of a portfolio's run. This run
    has `building` and `archetype_index` instead of `structure`, and NaN at storeys that a building does not have. Use
    `select_archetype` to get one archetype, or `damage_shares` for all of them.

    Runs of the same EventSequence with different seeds can be joined. Capacities of one building can be joined along
    `structure` if the motions are the same, or along `motion` if the structures are the same.

    Args:
        runs: Results of `simulate`, `capacities` or `join`, in memory or opened from files. A mapping from names to
            runs gives the buildings these names, if the buildings differ.

    Returns:
        The joined run; the samples are in the order of the runs. The variables
        `structure_identity(sample)` and `motion_identity(motion)` identify structures and motions in further calls of
        `join`. If the runs differ in an attribute, it contains all values; `scene` is kept only if it is the same in
        all runs.

    Raises:
        TypeError: If `runs` is not a list or mapping of Datasets.
        ValueError: If a sample is in two runs (it would count twice); if the intensities have different measures; if
            the peaks are recorded from different times on; or if a run lacks variables of another run, contains whole
            histories, is one archetype of a portfolio, or is not a run.

    Example:
        >>> parts = [wd.simulate(scene, structures=2, seed=seed) for seed in (1, 2)]
        >>> both = wd.join(parts)
        >>> both.sizes["sample"], int(both["structure"].max()) + 1
        (192, 4)
    """
    names, datasets = _checked_runs(runs)
    if any("capacity" in run for run in datasets):
        return join_capacities(datasets)
    for place, run in enumerate(datasets):
        _check_run(place, run)
    check_comparable(datasets)
    check_start_times(datasets)
    identities = [Identities(place, run) for place, run in enumerate(datasets)]
    _check_events(identities)
    _check_duplicates(identities)
    kinds = dict.fromkeys(kind for each in identities for kind in each.buildings.values())
    is_portfolio = len(kinds) > 1 or any(each.is_portfolio for each in identities)
    _check_variables(identities)
    parts = _renumbered(identities)
    attributes = joined_attributes("join", datasets)
    if is_portfolio:
        joined = as_portfolio(identities, names, parts)
        attributes.pop("scene", None)
    else:
        joined = _together(parts)
        joined["structure"].attrs["sampling"] = _sampling(datasets)
        attributes[OF_BUILDING] = str(next(iter(kinds)))
    attributes[OF_INPUTS] = " ".join(dict.fromkeys(name for each in identities for name in each.inputs))
    joined.attrs = attributes
    return joined


def _checked_runs(runs: object) -> tuple[list[str], list[xr.Dataset]]:
    """Return the names of the runs ("" without a name) and the runs, after a check of their types."""
    if isinstance(runs, xr.Dataset) or not isinstance(runs, Sequence | Mapping) or isinstance(runs, str):
        raise TypeError(
            f"join() takes a list of runs, or a mapping of names to runs, got {type(runs).__name__}: {ADVICE}"
        )
    names = [str(name) for name in runs] if isinstance(runs, Mapping) else [""] * len(runs)
    datasets = list(runs.values()) if isinstance(runs, Mapping) else list(runs)
    if not datasets:
        raise ValueError(f"join: there is no run: {ADVICE}")
    for run in datasets:
        check_dataset("join", run, advice=ADVICE)
    return names, datasets


def _check_run(place: int, run: xr.Dataset) -> None:
    """Raise a ValueError unless the dataset number `place` contains the samples of a run."""
    if "sample" not in run.dims or "status" not in run:
        what = "statistics, which keep no samples" if "failed_samples" in run else "not a run"
        raise ValueError(
            f"join: run {place} is {what}, with the dimensions {', '.join(map(str, run.dims)) or 'none'}. {ADVICE}; "
            "statistics of several runs cannot be joined, because their counts do not identify the structures"
        )
    if "archetype_index" in run.coords and "archetype" not in run.dims:
        raise ValueError(
            f"join: run {place} is one archetype of a portfolio, which does not name its building. Join the runs of "
            "the portfolios and select afterwards: wd.select_archetype(wd.join([run, other]), name)"
        )
    if not run.sizes["sample"]:
        raise ValueError(f"join: run {place} has no samples: remove it from the list, or correct its selection")
    if "history" in run.dims:
        raise ValueError(
            f"join: run {place} has whole histories, which cannot be joined: give run.drop_dims('history'), and use "
            "the histories of each run separately"
        )


def _check_events(identities: list[Identities]) -> None:
    """If a run is the run of an EventSequence, raise a ValueError unless all have the same sequence and building."""
    if not any("event" in each.run.dims for each in identities):
        return
    first = identities[0]
    for each in identities:
        same = "event" in each.run.dims and each.buildings.keys() == first.buildings.keys()
        if not same or each.scene["excitation"] != first.scene["excitation"]:
            raise ValueError(
                f"join: run {each.place} is not of the same EventSequence as run 0; join runs of one sequence with "
                "other seeds, or single events of them, by select_event(run, name)"
            )
        copies = int(each.run["samples_per_history"].max())
        if each.run.sizes["sample"] % copies:
            raise ValueError(f"join: run {each.place} is a selection of samples of a sequence; join whole runs")


def _check_duplicates(identities: list[Identities]) -> None:
    """Raise a ValueError if a sample occurs in two runs."""
    seen: pd.MultiIndex | None = None
    origin: list[np.ndarray] = []
    for each in identities:
        keys = each.samples
        if seen is not None:
            found = seen.get_indexer(keys)
            if (found >= 0).any():
                mine = int(np.flatnonzero(found >= 0)[0])
                place, theirs = np.concatenate(origin)[found[mine]]
                twice, sizes = int((found >= 0).sum()), {each.place: keys.size, place: identities[place].samples.size}
                raise ValueError(
                    f"join: {twice} of the {keys.size} samples of run {each.place} are in run "
                    f"{place} too: sample {mine} is its sample {theirs}, of the same structure under the same motion "
                    "at the same level. They would count twice, and intervals would be too narrow. "
                    + _remedy(twice, sizes)
                )
        own = np.column_stack([np.full(keys.size, each.place), np.arange(keys.size)])
        seen = keys if seen is None else seen.append(keys)
        origin.append(own)


def _remedy(twice: int, sizes: dict[int, int]) -> str:
    """Return what to do about two runs with `twice` samples in common.

    Args:
        twice: Number of samples that both runs contain.
        sizes: Number of samples of both runs, by their places in the list.
    """
    small, large = sorted(sizes, key=lambda place: sizes[place])
    if twice == sizes[small] < sizes[large]:
        return (
            f"Run {large} contains all samples of run {small}, as a run of more structures with the same seed does: "
            f"use it without run {small}"
        )
    return (
        "Remove one of the two runs from the list, or run simulate() with another seed= (of a scene without scatter, "
        "with other motions or levels)"
    )


def _check_variables(identities: list[Identities]) -> None:
    """Raise a ValueError unless all runs have the same demands along `sample`; drawn parameters may differ."""
    inputs = {name for each in identities for name in each.inputs}
    of_samples = [{str(n) for n, v in each.run.variables.items() if "sample" in v.dims} - inputs for each in identities]
    labels = {"structure", "building", "archetype_index", OF_SAMPLES}
    for each, own in zip(identities, of_samples, strict=True):
        for other, theirs in zip(identities, of_samples, strict=True):
            missing = sorted(theirs - own - labels)
            if missing:
                raise ValueError(
                    f"join: run {each.place} has no {missing[0]!r}, which run {other.place} has: record the same in "
                    f"both, or drop it, runs[{other.place}].drop_vars({missing!r})"
                )


def _renumbered(identities: list[Identities]) -> list[xr.Dataset]:
    """Return the samples of each run, with new numbers of samples, structures and motions that are unique in all runs.

    The first dataset also contains the variables along `motion` of all runs.
    """
    structures, _ = pd.factorize(np.concatenate([each.structures for each in identities]))
    motions, distinct = pd.factorize(np.concatenate([each.motions for each in identities]))
    of_run = np.cumsum([0, *(each.run.sizes["sample"] for each in identities)])
    of_motions = np.cumsum([0, *(each.motions.size for each in identities)])
    tables, parts = [], []
    for place, each in enumerate(identities):
        begin, end = of_run[place], of_run[place + 1]
        run, label = each.run, "building" if each.is_portfolio else "structure"
        numbers: dict[str, Any] = {
            "sample": ("sample", np.arange(begin, end, dtype=np.int32), run["sample"].attrs),
            label: ("sample", structures[begin:end].astype(np.int32), run[label].attrs),
            OF_SAMPLES: ("sample", each.structures, {"long_name": "digest of what the structure is", "units": "1"}),
        }
        number = motions[of_motions[place] : of_motions[place + 1]].astype(np.int32)
        if number.size:
            old = run["motion_index"]
            numbers["motion_index"] = (old.dims, number[old.values], old.attrs)
            table = run[[n for n, v in run.variables.items() if v.dims == ("motion",)]].reset_coords()
            identity = {"long_name": "digest of what the motion is", "units": "1"}
            table[OF_MOTIONS] = "motion", each.motions, identity
            tables.append(table.assign_coords(motion=number))
        parts.append(run.drop_dims("motion", errors="ignore").assign_coords(numbers))
    if tables:
        table = xr.concat(tables, "motion", data_vars="all", combine_attrs="override")
        first = pd.Index(table["motion"].values).duplicated()
        table = table.isel(motion=np.flatnonzero(~first)).sortby("motion")
        parts[0] = (
            parts[0].assign(table.drop_vars("motion").data_vars).assign_coords(motion=motion_numbers(distinct.size))
        )
    return parts


def _together(parts: list[xr.Dataset]) -> xr.Dataset:
    """Return the samples of all runs in one dataset, with the variables without samples from the first run.

    `estimated_relative_error` is the largest value of all runs. Other variables without samples must be equal.
    """
    rest, error = parts[0].drop_dims("sample"), "estimated_relative_error"
    for place, part in enumerate(parts[1:], start=1):
        for name, variable in part.drop_dims("sample").variables.items():
            if name in rest.variables and name != error and not variable.equals(rest[name].variable):
                raise ValueError(
                    f"join: {name!r} of run {place} differs from that of run 0, and it is not along sample: drop it, "
                    f"run.drop_vars({name!r})"
                )
    found = [part[error] for part in parts if error in part]
    rows = [part[[n for n, v in part.variables.items() if "sample" in v.dims]] for part in parts]
    options: Any = {"data_vars": "all", "coords": "different", "compat": "equals", "join": "outer"}
    joined = xr.concat(rows, "sample", combine_attrs="override", **options)
    joined = joined.merge(rest, compat="override", combine_attrs="override")
    if found:  # the largest bounds every quantile over all samples
        joined[error] = found[0].copy(data=np.fmax.reduce([each.values for each in found]))
    return joined


def _sampling(runs: list[xr.Dataset]) -> str:
    """Return how structures were sampled; if the runs differ, the kind that comes first in SAMPLING; "" if unknown."""
    kinds = {str(run["structure"].attrs.get("sampling", "")) for run in runs}
    return next((kind for kind in SAMPLING if kind in kinds), "")
