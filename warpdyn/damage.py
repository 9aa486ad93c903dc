"""Damage of a portfolio: the share of its buildings in each damage state, each archetype by limits of its own."""

from __future__ import annotations

from collections.abc import Hashable, Mapping, Sequence

import numpy as np
import xarray as xr

from warpdyn.checks import real_number
from warpdyn.motions import IN_G
from warpdyn.recorders import COLLAPSED, DIVERGED, OK, STRIPED
from warpdyn.stripe_counts import LARGEST_EXCLUDED_FRACTION, decoded_status

SAMPLES_AT_A_TIME = 2**18  # read from a file
FAILED = -1
NO_DAMAGE = "none"


def damage_shares(
    run: xr.Dataset, limits: Mapping[str, Mapping[str, float]], *, events: Sequence[Hashable] | None = None
) -> xr.Dataset:
    """Count the buildings of a portfolio in each damage state by record (and by stripe, if the run has stripes).

    A building is in the last damage state whose limit its largest storey drift ratio is above (strictly), in "none" if
    it is above no limit, and in the last state of all if it collapsed.

    Args:
        run: What `simulate_portfolio` returned, with the recorder "drift".
        limits: Of each archetype the storey drift ratio limit [1] of each damage state, from the lightest on; the
            states' names are the same for all.
        events: The event that each motion is of, shape [motion], as labels: where several motions are of one event,
            such as both components of a record, the worst of them counts. None for every motion by itself.

    Returns:
        `damage_share(event, damage_state)`, `archetype_damage_share(archetype_name, event, damage_state)` and
        `counted_buildings(archetype_name, event)`; the dimension is `motion` instead of `event` where no events are
        given, and on stripes `stripe` comes after it. Shares of no building are NaN.

    Raises:
        ValueError: If the run is not of a portfolio or has no drifts, limits are missing, not positive or do not
            increase, events are not one a motion, or more than 1 % of the samples failed.
    """
    names = _archetypes_of(run)
    states, table = _checked_limits(names, limits)
    record, event_names = _events_of(run, events)
    state = _states_of_samples(run, table)
    # Failed samples are those that diverged and the like; a pair of motions fails with either of them.
    failures = np.count_nonzero(state == FAILED)
    if failures > LARGEST_EXCLUDED_FRACTION * state.size:
        raise ValueError(
            f"{failures} of {state.size} samples failed; at most {100 * LARGEST_EXCLUDED_FRACTION:g} % may: "
            "take a smaller step or another method"
        )
    is_striped = "im_level" in run and run["im_level"].attrs.get("design") == STRIPED
    levels, stripe = np.zeros(1), np.zeros(state.size, dtype=np.int64)
    if is_striped:
        levels, stripe = np.unique(run["im_level"].values, return_inverse=True)
    archetype = run["archetype"].values
    if events is not None:
        key = (run["building"].values.astype(np.int64) * len(event_names) + record) * levels.size + stripe
        _, first, unit = np.unique(key, return_index=True, return_inverse=True)
        worst = np.zeros(first.size, dtype=np.int64)
        np.maximum.at(worst, unit, state)
        worst[unit[state == FAILED]] = FAILED
        state, archetype, record, stripe = worst, archetype[first], record[first], stripe[first]

    shape = (len(names), len(event_names), levels.size, len(states))
    valid = state != FAILED
    places = tuple(values[valid].astype(np.int64) for values in (archetype, record, stripe, state))
    counts = np.bincount(np.ravel_multi_index(places, shape), minlength=np.prod(shape)).reshape(shape)
    along = "motion" if events is None else "event"
    dims = (along, "stripe", "damage_state")
    if not is_striped:
        counts, dims = counts[:, :, 0], (along, "damage_state")
    counted = counts.sum(axis=-1)
    with np.errstate(invalid="ignore", divide="ignore"):
        of_archetype_, of_all = counts / counted[..., None], counts.sum(axis=0) / counted.sum(axis=0)[..., None]
    units = {"units": "1"}
    variables = {
        "damage_share": (dims, of_all, units | {"long_name": "share of all buildings in the damage state"}),
        "archetype_damage_share": (
            ("archetype_name", *dims),
            of_archetype_,
            units | {"long_name": "share of the archetype's buildings in the damage state"},
        ),
        "counted_buildings": (
            ("archetype_name", *dims[:-1]),
            counted,
            units | {"long_name": "buildings counted, collapsed ones included, failed ones not"},
        ),
        "damage_limit": (
            ("archetype_name", "damage_state"),
            np.concatenate([np.zeros((len(names), 1)), table], axis=1),
            units | {"long_name": "storey drift ratio above which a building is in the damage state"},
        ),
        "failed_samples": ((), failures, units | {"long_name": "samples kept out"}),
    }
    coordinates = {
        "archetype_name": ("archetype_name", names, {"long_name": "name of the archetype", "units": "1"}),
        "damage_state": ("damage_state", np.array(states), {"long_name": "damage state", "units": "1"}),
    }
    if events is not None:
        coordinates["event"] = ("event", event_names, {"long_name": "event", "units": "1"})
    elif "motion_name" in run:
        variables["motion_name"] = run["motion_name"].variable
    if is_striped:
        level = {"long_name": "intensity of the stripe", "units": "g", "comment": IN_G}
        coordinates["stripe"] = ("stripe", levels, level)
    return xr.Dataset(variables, coordinates)


def of_archetype(run: xr.Dataset, name: str) -> xr.Dataset:
    """Return the samples of one archetype, with as many storeys as it has, as an ordinary run.

    Args:
        run: What `simulate_portfolio` returned.
        name: The archetype.

    Raises:
        ValueError: If there is no such archetype.
    """
    names = _archetypes_of(run).tolist()
    if name not in names:
        raise ValueError(f"no archetype {name!r} in the run; it has {', '.join(names)}")
    place = names.index(name)
    buildings = run["buildings_of_archetype"].values
    each = run.sizes["sample"] // int(buildings.sum())
    first = int(buildings[:place].sum()) * each
    part = run.isel(sample=slice(first, first + int(buildings[place]) * each))
    storeys = int(run["storeys_of_archetype"].values[place])
    part = part.isel({dim: slice(storeys) for dim in ("storey", "floor") if dim in run.dims})
    return part.drop_vars([name for name, variable in part.variables.items() if "archetype_name" in variable.dims])


def _archetypes_of(run: xr.Dataset) -> np.ndarray:
    """Return the names of a run's archetypes."""
    needed = ("archetype_name", "archetype", "building", "status")
    missing = [name for name in needed if name not in run.variables]
    if missing:
        raise ValueError(f"the dataset has no {missing[0]!r}: it is not what simulate_portfolio() returned")
    return run["archetype_name"].values.astype(str)


def _checked_limits(names: np.ndarray, limits: Mapping[str, Mapping[str, float]]) -> tuple[list[str], np.ndarray]:
    """Return the damage states, that of no damage first, and the limits, shape [archetype, damage_state - 1]."""
    if not isinstance(limits, Mapping):
        raise TypeError(f"limits must map each archetype to its limits, got {limits!r}")
    unknown = [name for name in limits if name not in names]
    if unknown:
        raise ValueError(f"limits name {unknown[0]!r}, which is no archetype of the run; it has {', '.join(names)}")
    states, rows = None, []
    for name in names:
        own = limits.get(str(name))
        if not isinstance(own, Mapping) or not own:
            raise ValueError(
                f"archetype {str(name)!r}: limits must hold a drift ratio for each damage state, got {own!r}"
            )
        if states is not None and list(own) != states:
            raise ValueError(
                f"archetype {str(name)!r}: its damage states are {', '.join(own)}, those of {str(names[0])!r} "
                f"{', '.join(states)}; they must be the same"
            )
        states = list(own)
        row = [real_number(f"archetype {str(name)!r}: limit of {state!r}", own[state], above=0) for state in states]
        if np.any(np.diff(row) <= 0):
            raise ValueError(f"archetype {str(name)!r}: limits must increase, got {row}")
        rows.append(row)
    if NO_DAMAGE in states:
        raise ValueError(f"{NO_DAMAGE!r} is the state of a building above no limit; give the other states")
    return [NO_DAMAGE, *states], np.array(rows)


def _events_of(run: xr.Dataset, events: Sequence[Hashable] | None) -> tuple[np.ndarray, np.ndarray]:
    """Return the event of each sample as an index, and the names of the events in the order they are first named."""
    if "record" not in run.variables:
        raise ValueError("the dataset has no 'record': it is not what simulate_portfolio() returned")
    record, motions = run["record"].values, run.sizes["motion"]
    if events is None:
        return record, np.arange(motions)
    labels = list(events)
    if len(labels) != motions:
        raise ValueError(f"events names {len(labels)} motions, and the run has {motions}: they must agree")
    order = {label: i for i, label in enumerate(dict.fromkeys(labels))}
    return np.array([order[label] for label in labels])[record], np.array(list(order))


def _states_of_samples(run: xr.Dataset, table: np.ndarray) -> np.ndarray:
    """Return the damage state of every sample, counted from 0 for none; FAILED where it has none."""
    if "peak_storey_drift_ratio" not in run:
        raise ValueError("the run has no 'peak_storey_drift_ratio': leave 'drift' in what is recorded")
    status, archetype = decoded_status(run["status"]), run["archetype"].values
    states = np.empty(status.size, dtype=np.int8)
    for first in range(0, status.size, SAMPLES_AT_A_TIME):
        part = slice(first, first + SAMPLES_AT_A_TIME)
        drift = run["peak_storey_drift_ratio"][part].values
        worst = np.fmax.reduce(drift.astype(np.float64), axis=1)  # NaN are storeys that a building does not have
        bad = np.flatnonzero(np.isnan(worst) & (status[part] == OK))
        if bad.size:
            raise ValueError(f"sample {first + bad[0]} is 'ok', but its peak_storey_drift_ratio is NaN at every storey")
        states[part] = (worst[:, None] > table[archetype[part]]).sum(axis=1)
    states[status == COLLAPSED] = table.shape[1]
    states[status >= DIVERGED] = FAILED
    return states
