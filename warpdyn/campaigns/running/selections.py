"""Functions that return a part of a run as an ordinary run: one event, one archetype, or some storeys."""

from __future__ import annotations

from typing import Any

import numpy as np
import xarray as xr

from warpdyn.foundations.core.checks import check_dataset, one_of, whole_number
from warpdyn.foundations.core.output_variables import (
    ADDED_GROUPS,
    DAMPING,
    EARLIER_HISTORY,
    KIND_ATTRIBUTES,
    KIND_OF_ARCHETYPES,
    MEASURE,
    PERIOD,
    STOREY_KIND,
    UNNAMED,
    measure_attributes,
)
from warpdyn.foundations.core.units import unit_attributes

OF_THE_LARGEST = ("time_of_peak_drift", "storey_of_peak_drift")  # belong to the largest drift ratio over all storeys
OF_COLLAPSE = "storey_of_collapse"
# Attributes of `im_level` that differ by event in an EventSequence, with the value that replaces a missing attribute.
OF_EVENTS: dict[str, str | float] = {
    "long_name": "",
    "units": "1",
    "design": "",
    MEASURE: UNNAMED[1],
    PERIOD: np.nan,
    DAMPING: np.nan,
}


def select_event(run: xr.Dataset, name: str) -> xr.Dataset:
    """Return one event of a run of an EventSequence as an ordinary run, in which each history of the event occurs once.

    In a run of a sequence, several samples may share one history of an early event and differ only in later events.
    `select_event` returns the first of these samples only. `run.sel(event=name)` returns all samples, and so repeats
    these histories.

    In an event after the first one, samples with the same structure, motion and level differ by the earlier events:
    `earlier_history(sample)` is the number of the structure's history in these earlier events.

    Args:
        run: A run, or some of its samples.
        name: Name of the event.

    Raises:
        ValueError: If the run is not the run of an EventSequence, or has no event of this name.
        TypeError: If `run` is not a Dataset.

    Example:
        >>> events = wd.EventSequence({"mainshock": stripes, "aftershock": wd.Cloud(motions[:2])})
        >>> run = wd.simulate(wd.Scene(building, events, recorders=("drift",)))
        >>> wd.select_event(run, "mainshock").sizes["sample"], run.sizes["sample"]
        (48, 96)
    """
    check_dataset("select_event", run, advice="give the result of simulate() for an EventSequence", argument="run")
    if "event" not in run.dims or "im_level_design" not in run.coords:
        raise ValueError(
            "select_event: the dataset has no events: give the result of simulate() for an EventSequence as run"
        )
    names = run["event"].values.tolist()
    one_of("name of an event of the run", name, names)
    place = names.index(name)
    event = run.isel(event=place)
    if place:
        earlier = event["sample"].values // int(run["samples_per_history"].values[place - 1])
        attributes = {"long_name": "number of the history of the earlier events", "units": "1"}
        event = event.assign_coords({EARLIER_HISTORY: ("sample", earlier, attributes)})
    if event["samples_per_history"] > 1:
        history = event["sample"].values // int(event["samples_per_history"])
        event = event.isel(sample=np.unique(history, return_index=True)[1])
    of_level: dict[str, Any] = {}
    for key, missing in OF_EVENTS.items():
        value = event[f"im_level_{key}"].values[()] if f"im_level_{key}" in event.coords else missing
        if not (isinstance(missing, float) and np.isnan(value)):
            of_level[key] = float(value) if isinstance(missing, float) else str(value)
    of_level |= unit_attributes(of_level["units"])
    event = event.drop_vars(
        ["event", "samples_per_history", *(f"im_level_{key}" for key in OF_EVENTS)], errors="ignore"
    )
    event["im_level"].attrs = of_level
    return event.assign_attrs(measure_attributes(of_level))


def select_archetype(run: xr.Dataset, name: str) -> xr.Dataset:
    """Return the samples of one archetype of a portfolio as an ordinary run with the storeys of this archetype.

    Args:
        run: The run of a portfolio, or some of its samples.
        name: Name of the archetype.

    Raises:
        ValueError: If the run has no archetype of this name, or is not the run of a portfolio.
        TypeError: If `run` is not a Dataset.

    Example:
        >>> run = wd.simulate(region)
        >>> wd.select_archetype(run, "C1L high 2").sizes["sample"]
        8
    """
    check_dataset("select_archetype", run, advice="give the result of simulate() for a portfolio", argument="run")
    names = archetypes_of("select_archetype", run, "use the run itself").tolist()
    one_of("name of an archetype of the run", name, names)
    place = names.index(name)
    part = run.isel(sample=np.flatnonzero(run["archetype_index"].values == place))
    storeys = int(run["storeys_of_archetype"].values[place])
    part = part.isel({dim: slice(storeys) for dim in ("storey", "floor") if dim in run.dims})
    kinds = part[KIND_OF_ARCHETYPES].values[place] if KIND_OF_ARCHETYPES in part.coords else np.zeros(1)
    part = part.drop_vars([name for name, variable in part.variables.items() if "archetype" in variable.dims])
    return part.assign_coords({STOREY_KIND: ("storey", kinds, KIND_ATTRIBUTES)}) if kinds.any() else part


def select_storeys(run: xr.Dataset, first: int, last: int) -> xr.Dataset:
    """Return a run with some of its storeys and floors only; they are numbered from 1 again.

    `fragility`, `damage_shares` and similar functions use only the storeys of the building itself, without isolators
    and tuned mass dampers. To use another storey, such as the isolators (storey 1), select it by this function. The
    variables of the largest drift ratio of all storeys are removed. The status, which includes collapse, and other
    variables of the whole building stay. `storey_of_collapse` is -1 if the storey that collapsed is not selected.

    Args:
        run: A run, or a result of `select_archetype`. A portfolio is allowed only if all its buildings are on
            isolators.
        first, last: Lowest and highest storey, counted from 1.

    Raises:
        ValueError: If the run has no such storeys.
        TypeError: If `run` is not a Dataset.

    Example:
        >>> upper = wd.select_storeys(run, first=2, last=2)
        >>> upper.sizes["storey"]
        1
    """
    check_dataset("select_storeys", run, advice="give the result of simulate()", argument="run")
    storeys = run.sizes.get("storey", 0)
    first, last = whole_number("first", first, 1), whole_number("last", last, 1)
    if not first <= last <= storeys:
        raise ValueError(
            f"first={first} to last={last} are not in the run, which has storeys 1 to {storeys}: "
            "give first= and last= in this range"
        )
    dims = [dim for dim in ("storey", "floor") if dim in run.dims]
    part = run.isel({dim: slice(first - 1, last) for dim in dims})
    for dim in dims:
        numbers = np.arange(1, last - first + 2, dtype=np.int32)
        part = part.assign_coords({dim: (dim, numbers, run[dim].attrs if dim in run.coords else {})})
    if OF_COLLAPSE in run:
        storey = run[OF_COLLAPSE]
        is_kept = (storey >= first) & (storey <= last)
        part[OF_COLLAPSE] = xr.where(is_kept, storey - (first - 1), -1).astype(storey.dtype).assign_attrs(storey.attrs)
    return part.drop_vars(OF_THE_LARGEST, errors="ignore")


def without_added_storeys(run: xr.Dataset) -> xr.Dataset:
    """Return a run without the storeys (and their floors) of isolators and tuned mass dampers, if it has any.

    The numbers of the other storeys do not change. A run that has only such storeys, because they were selected, is
    returned unchanged.

    Args:
        run: The run of one structure, or of one archetype of a portfolio.
    """
    if STOREY_KIND not in run.coords or run[STOREY_KIND].dims != ("storey",):
        return run
    own = np.flatnonzero(run[STOREY_KIND].values == 0)
    if own.size in (0, run.sizes["storey"]):
        return run
    return run.isel({dim: own for dim in ("storey", "floor") if dim in run.dims})


def without_added_places(run: xr.Dataset) -> xr.Dataset:
    """Return a run without storeys, degrees of freedom and springs that are not part of the building.

    These are the storeys of isolators and tuned mass dampers, and the places of the groups ADDED_GROUPS (equipment,
    absorbers, soil, contacts) of a lumped structure. If only such places are left, because they were selected,
    they are kept.

    Args:
        run: The run of one structure, or of one archetype of a portfolio.
    """
    run = without_added_storeys(run)
    for dim in ("dof", "spring"):
        group = f"{dim}_group"
        if group in run.coords and run[group].dims == (dim,):
            own = np.flatnonzero(~np.isin(run[group].values, ADDED_GROUPS))
            if own.size:
                run = run.isel({dim: own})
    return run


def check_one_unit(function: str, run: xr.Dataset, demand: str) -> None:
    """Raise a ValueError if the largest value of a demand would compare places of different units.

    Args:
        function: Name of the public function, for messages.
        run: The run.
        demand: Name of the demand.
    """
    for dim in ("dof", "spring", "output"):
        if demand not in run or dim not in run[demand].dims or run.sizes[dim] < 2:
            continue
        unit = f"{dim}_unit"
        units = [str(each) for each in np.atleast_1d(run[unit].values)] if unit in run.coords else []
        advice = f"run.sel({dim}=[{str(run[dim].values[0])!r}])"
        if dim == "output" and (not units or "" in units):
            raise ValueError(
                f"{function}: the units of some outputs are unknown, so that their values cannot be compared: give "
                f"LumpedStructure(..., output_units={{{str(run[dim].values[0])!r}: 'm', ...}}), or select one output: "
                f"{advice}"
            )
        if len(set(units)) > 1:
            raise ValueError(
                f"{function}: the largest {demand} of all places would compare {' with '.join(dict.fromkeys(units))}: "
                f"select places of one unit: run.isel({dim}=run[{unit!r}].values == {units[0]!r}), or {advice}"
            )


def of_building(run: xr.Dataset, demand: str) -> xr.DataArray:
    """Return a demand of a run without the storeys of isolators and of tuned mass dampers.

    In a run of several archetypes, which may differ in these storeys, the demand is NaN at them instead.

    Args:
        run: The run.
        demand: Name of the demand, such as "peak_storey_drift_ratio".
    """
    if STOREY_KIND in run.coords or KIND_OF_ARCHETYPES not in run.coords:
        return without_added_places(run)[demand]
    values = run[demand]
    kinds = run[KIND_OF_ARCHETYPES].transpose("archetype", "storey").values
    if "sample" not in values.dims or not {"storey", "floor"} & set(values.dims):
        return values
    dims = "sample", "storey" if "storey" in values.dims else "floor"
    return values.where(xr.DataArray(kinds[run["archetype_index"].values] == 0, dims=dims))


def archetypes_of(function: str, run: xr.Dataset, of_one: str) -> np.ndarray:
    """Return the names of the archetypes in the run of a portfolio, shape [archetype].

    Args:
        function: Name of the public function that was called, for error messages.
        run: The run of a portfolio.
        of_one: Advice for a user who gives the run of one structure, for the error message.

    Raises:
        ValueError: If the run is not the run of a whole portfolio.
    """
    check_portfolio(function, run, of_one)
    needed = ("archetype", "archetype_index", "building", "status")
    missing = [name for name in needed if name not in run.variables]
    if missing:
        raise ValueError(
            f"{function}: run has no {missing[0]!r}: give the run of a portfolio as simulate() returned it, not the "
            "result of select_archetype() or another part of it"
        )
    return run["archetype"].values.astype(str)


def check_portfolio(function: str, run: xr.Dataset, of_one: str) -> None:
    """Raise a ValueError if a run is the run of one structure, not of a portfolio; arguments: see `archetypes_of`."""
    scene = str(run.attrs.get("scene", ""))[:200]  # the rest may list a million buildings
    if scene and '"archetypes"' not in scene and "archetype" not in run.variables:
        raise ValueError(
            f"{function}: run contains one structure, not a wd.Portfolio, so that it has no archetypes: {of_one}"
        )
