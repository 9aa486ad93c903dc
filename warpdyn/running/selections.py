"""Parts of a run as ordinary runs: one event, one archetype, some storeys."""

from __future__ import annotations

import numpy as np
import xarray as xr

from warpdyn.core.checks import check_dataset, one_of, whole_number
from warpdyn.core.units import unit_attributes

OF_THE_LARGEST = ("time_of_peak_drift", "storey_of_peak_drift")  # belong to the largest drift ratio of all storeys
OF_COLLAPSE = "storey_of_collapse"


def select_event(run: xr.Dataset, name: str) -> xr.Dataset:
    """Return one event of a run of an EventSequence as an ordinary run, with each history of the event once.

    A history of an event belongs to all samples of later events that follow from it; here the first of these samples
    represents it. In `run.sel(event=name)` it is in all of them, sample by sample beside the later events.

    Args:
        run: What `simulate` returned, or some of its samples.
        name: The event.

    Raises:
        ValueError: If the run is not of an EventSequence, or has no such event.
        TypeError: If `run` is no Dataset.

    Example:
        >>> events = wd.EventSequence({"mainshock": stripes, "aftershock": wd.Cloud(motions[:2])})
        >>> run = wd.simulate(wd.Scene(building, events, recorders=("drift",)))
        >>> wd.select_event(run, "mainshock").sizes["sample"], run.sizes["sample"]
        (48, 96)
    """
    check_dataset("select_event", run, advice="give what simulate() returned of an EventSequence", argument="run")
    if "event" not in run.dims or "im_level_design" not in run.coords:
        raise ValueError("the dataset has no events: it is not what simulate() returned of an EventSequence")
    names = run["event"].values.tolist()
    one_of("name of an event of the run", name, names)
    event = run.isel(event=names.index(name))
    if event["samples_per_history"] > 1:
        history = event["sample"].values // int(event["samples_per_history"])
        event = event.isel(sample=np.unique(history, return_index=True)[1])
    keys = ("long_name", "units", "design")
    attributes = {key: str(event[f"im_level_{key}"].values) for key in keys}
    attributes |= unit_attributes(attributes["units"])
    event = event.drop_vars(["event", "samples_per_history", *(f"im_level_{key}" for key in keys)])
    event["im_level"].attrs = attributes
    return event


def select_archetype(run: xr.Dataset, name: str) -> xr.Dataset:
    """Return the samples of one archetype, with its number of storeys, as an ordinary run.

    Args:
        run: What `simulate` returned of a portfolio, or some of its samples.
        name: The archetype.

    Raises:
        ValueError: If there is no such archetype.
        TypeError: If `run` is no Dataset.

    Example:
        >>> run = wd.simulate(region)
        >>> wd.select_archetype(run, "C1L high 2").sizes["sample"]
        8
    """
    check_dataset("select_archetype", run, advice="give what simulate() returned of a portfolio", argument="run")
    names = archetypes_of(run).tolist()
    one_of("name of an archetype of the run", name, names)
    place = names.index(name)
    part = run.isel(sample=np.flatnonzero(run["archetype_index"].values == place))
    storeys = int(run["storeys_of_archetype"].values[place])
    part = part.isel({dim: slice(storeys) for dim in ("storey", "floor") if dim in run.dims})
    return part.drop_vars([name for name, variable in part.variables.items() if "archetype" in variable.dims])


def select_storeys(run: xr.Dataset, first: int, last: int) -> xr.Dataset:
    """Return a run with some of its storeys and floors, for demands of a building without isolators or mass damper.

    The storeys are counted from 1 again. The own storeys of a building on isolators begin with the second; with a tuned
    mass damper they end with the last but one. Variables of the largest drift ratio of all storeys are removed; the
    status, with collapse, and variables of the whole building stay. `storey_of_collapse` is -1 where a storey collapsed
    that is left out.

    Args:
        run: What `simulate` or `select_archetype` returned; a portfolio only if all its buildings are on isolators.
        first, last: Lowest and highest storey, counted from 1.

    Raises:
        ValueError: If the run has no such storeys.
        TypeError: If `run` is no Dataset.

    Example:
        >>> upper = wd.select_storeys(run, first=2, last=2)
        >>> upper.sizes["storey"]
        1
    """
    check_dataset("select_storeys", run, advice="give what simulate() returned", argument="run")
    storeys = run.sizes.get("storey", 0)
    first, last = whole_number("first", first, 1), whole_number("last", last, 1)
    if not first <= last <= storeys:
        raise ValueError(f"first={first} to last={last} are not in the run, which has storeys 1 to {storeys}")
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


def archetypes_of(run: xr.Dataset) -> np.ndarray:
    """Return the names of a run's archetypes."""
    needed = ("archetype", "archetype_index", "building", "status")
    missing = [name for name in needed if name not in run.variables]
    if missing:
        raise ValueError(f"the dataset has no {missing[0]!r}: it is not what simulate() returned of a portfolio")
    return run["archetype"].values.astype(str)
