"""Damage of a portfolio: the share of its buildings in each damage state, with separate limits for each archetype."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from dataclasses import dataclass
from typing import Any

import numpy as np
import xarray as xr
from numpy.typing import ArrayLike

from warpdyn.answers.fragility.curve_variables import variable
from warpdyn.answers.fragility.reduced_counts import counts_over, is_reduced
from warpdyn.answers.fragility.stripe_counts import decoded_status
from warpdyn.campaigns.reductions.limits import BUILDING_NUMBER, DAMAGE_COUNT, limits_by_archetype
from warpdyn.campaigns.reductions.population import numbered_events
from warpdyn.campaigns.running.joining.duplicates import check_samples
from warpdyn.campaigns.running.selections import archetypes_of, check_portfolio, without_added_storeys
from warpdyn.foundations.core.checks import check_dataset, finite_numbers, true_or_false
from warpdyn.foundations.core.messages import warn_caller
from warpdyn.foundations.core.near_misses import suggests_names
from warpdyn.foundations.core.output_variables import (
    COLLAPSED,
    DIVERGED,
    KIND_OF_ARCHETYPES,
    LARGEST_EXCLUDED_FRACTION,
    OK,
    STRIPED,
    measure_of_dataset,
)
from warpdyn.foundations.core.plausibility import warn_of_implausible_limits
from warpdyn.foundations.core.units import unit_attributes
from warpdyn.model.ground_motions.motions import motion_numbers
from warpdyn.model.inventories.table import is_in_inventory_order, warn_of_inventory_order

SAMPLES_AT_A_TIME = 2**18  # number of samples read from a file at a time
FAILED = -1  # damage state of a sample or building without a valid result
OF_ONE = (
    "simulate wd.Scene(wd.Portfolio({'houses': wd.Archetype(building, count)}), ...) and give "
    "limits={'houses': limits}; for the probabilities of a single building on stripes, use wd.fragility(run, limits)"
)
Limits = Mapping[str, Mapping[str, float]]
Events = Sequence[str] | Sequence[int] | xr.DataArray | None


@suggests_names
def damage_shares(
    run: xr.Dataset,
    limits: Limits | None = None,
    *,
    events: Events = None,
    number: ArrayLike | None = None,
    added_storeys: bool = False,
) -> xr.Dataset:
    """Return the share of a portfolio's buildings in each damage state, per motion (and per stripe).

    A building is in the heaviest damage state whose limit its largest storey drift ratio exceeds. It is in "none" if it
    exceeds no limit, and in the heaviest of all states if it collapsed. Storeys of isolators or of a tuned mass damper
    do not count, unless `added_storeys` is True.

    Args:
        run: The result of `simulate` for a portfolio, with the recorder "drift"; or with the statistics DamageCounts
            over ("archetype", "motion") or ("archetype", "event"), with "stripe" added if the run has stripes.
        limits: Storey drift ratio limit [1] of each damage state, from the lightest to the heaviest, for each
            archetype. All archetypes must have the same damage states. None: use the limits of DamageCounts.
        events: Event of each motion, shape [motion], as names or whole numbers, if several motions belong to one event
            (such as both components of a record); only the worst motion of an event counts. Or a coordinate of the run
            with the event of each sample, such as `events=run["draw_index"]` after `wd.sites.label_samples`. None:
            every motion is one event. Do not give it for DamageCounts, which have their own `events`.
        number: Number of buildings that each building of the portfolio represents [1], shape [building], such as
            `stock.buildings(inventory)["number"]`. Shares, counted and failed buildings are weighted by it. None: 1.
            For DamageCounts, give `DamageCounts(number=...)` instead.
        added_storeys: Whether storeys of isolators or of a tuned mass damper count as storeys of the building. For
            DamageCounts, give `DamageCounts(added_storeys=...)` instead.

    Returns:
        `damage_share(event, damage_state)` and `archetype_damage_share(archetype, event, damage_state)` [1];
        `counted_buildings(archetype, event)` and `failed_buildings(archetype, event)`, numbers of buildings. A building
        failed in an event if one of its motions failed, unless another motion of the event left it in the heaviest
        state; failed buildings are not counted. If `events` is None, the dimension is `motion` instead of `event`; a
        run on stripes adds the dimension `stripe`. A share is NaN if no building is counted. The result has the
        attributes of the run.

    Raises:
        ValueError, TypeError: If the run has no portfolio or no drifts; if limits are missing, not positive or do not
            increase; if the number of events is not the number of motions; or if more than 1 % of all buildings
            (summed over the events) failed. If more than 1 % of an archetype failed in one event, a warning names both.

    Example:
        >>> shares = wd.damage_shares(wd.simulate(region), stock.limits)
        >>> shares["damage_share"].mean("motion").sel(damage_state=["none", "slight"]).round(2).values
        array([0.25, 0.71])
    """
    check_dataset("damage_shares", run, advice="give the result of simulate() for a portfolio", argument="run")
    check_portfolio("damage_shares", run, OF_ONE)
    if limits is None and not is_reduced(run):
        raise TypeError(
            "give limits=, a mapping from each archetype to its limits; only runs with DamageCounts need none"
        )
    if is_reduced(run):
        if number is not None:
            raise ValueError(
                "these are counts of a run with DamageCounts: give number= to DamageCounts(...) in simulate(), not to "
                "damage_shares()"
            )
        if true_or_false("added_storeys", added_storeys):
            raise ValueError(
                "these are counts of a run with DamageCounts: give added_storeys=True to DamageCounts(...) in "
                "simulate(), not to damage_shares()"
            )
        found = _read(run, limits, events)
    else:
        if not true_or_false("added_storeys", added_storeys):
            run = without_added_storeys(run)  # the run of a single archetype
        found = _count(run, {} if limits is None else limits, events, number, added_storeys)
    names, states, counts, failures = found.names, found.states, found.counts, found.failures
    event_names, levels = found.event_names, found.levels
    _check_failures(failures, counts.sum(axis=-1), names, event_names if found.along == "event" else None)
    dims: tuple[str, ...] = (found.along, "stripe", "damage_state")
    if levels is None:
        counts, failures, dims = counts[:, :, 0], failures[:, :, 0], (found.along, "damage_state")
    counted = counts.sum(axis=-1)
    with np.errstate(invalid="ignore", divide="ignore"):
        archetype_shares, of_all = counts / counted[..., None], counts.sum(axis=0) / counted.sum(axis=0)[..., None]
    limits_of_states = np.concatenate([np.zeros((len(names), 1)), found.limits], axis=1)
    of_archetype, of_state = "share of the archetype's buildings in the damage state", ("archetype", "damage_state")
    above = "storey drift ratio above which a building is in the damage state"
    not_counted = "buildings not counted, because their integration failed"
    variables: dict[str, Any] = {
        "damage_share": variable(dims, of_all, "share of all buildings in the damage state"),
        "archetype_damage_share": variable(("archetype", *dims), archetype_shares, of_archetype),
        "counted_buildings": variable(("archetype", *dims[:-1]), counted, "buildings counted, also collapsed ones"),
        "failed_buildings": variable(("archetype", *dims[:-1]), failures, not_counted),
        "damage_limit": variable(of_state, limits_of_states, above),
        "failed_samples": variable((), found.failed_samples, "samples that failed"),
    }
    coordinates: dict[str, tuple] = {
        "archetype": ("archetype", names, {"long_name": "name of the archetype"}),
        "damage_state": ("damage_state", np.array(states), {"long_name": "damage state"}),
    }
    if found.along == "event":
        is_text = event_names.dtype.kind == "U"
        coordinates["event"] = ("event", event_names, {"long_name": "event"} | ({} if is_text else {"units": "1"}))
    else:
        coordinates["motion"] = motion_numbers(len(event_names))
        if "motion_name" in run:
            variables["motion_name"] = run["motion_name"].variable
    if levels is not None:
        units_of_level = str(run["im_level" if "im_level" in run else "stripe"].attrs.get("units", "g"))
        level = {"long_name": "intensity of the stripe"} | unit_attributes(units_of_level) | measure_of_dataset(run)
        coordinates["stripe"] = ("stripe", levels, level)
    return xr.Dataset(variables, coordinates, run.attrs)


@dataclass(frozen=True, eq=False)
class _Counted:
    """Numbers of buildings by archetype, event (or motion), stripe and damage state.

    Args:
        names: Names of the archetypes.
        states: Names of the damage states, "none" first.
        limits: Drift ratio limits [1], shape [archetype, damage_state - 1].
        counts: Numbers of buildings, weighted by `number` if it is given, shape [archetype, event, stripe,
            damage_state].
        failures: Numbers of buildings that failed, shape [archetype, event, stripe].
        failed_samples: Number of failed samples.
        along: Name of the dimension: "event", or "motion" if motions count separately.
        event_names: Names of the events.
        levels: Levels of the stripes [g]; None: no stripes.
    """

    names: np.ndarray
    states: list[str]
    limits: np.ndarray
    counts: np.ndarray
    failures: np.ndarray
    failed_samples: int
    along: str
    event_names: np.ndarray
    levels: np.ndarray | None


def _count(run: xr.Dataset, limits: Limits, events: Events, number: ArrayLike | None, added_storeys: bool) -> _Counted:
    """Return numbers of buildings by archetype, event, stripe and damage state; arguments: see `damage_shares`."""
    if not run.sizes.get("sample", 0):
        raise ValueError("damage_shares: the run has no samples: give a run with at least one sample")
    names = archetypes_of("damage_shares", run, OF_ONE)
    check_samples("damage_shares", run)
    states, table = limits_by_archetype(names.tolist(), limits)
    warn_of_implausible_limits(
        {f" of {state!r} of {name!r}": limit for name in limits for state, limit in limits[name].items()}
    )
    record, event_names = _events_of(run, events)
    state = _states_of_samples(run, table, added_storeys)
    failed_samples = int(np.count_nonzero(state == FAILED))
    is_striped = "im_level" in run and run["im_level"].attrs.get("design") == STRIPED
    levels, stripe = np.zeros(1), np.zeros(state.size, dtype=np.int64)
    if is_striped:
        levels, stripe = np.unique(run["im_level"].values, return_inverse=True)
    archetype, building = run["archetype_index"].values, run["building"].values.astype(np.int64)
    if events is not None:
        key = (building * len(event_names) + record) * levels.size + stripe
        _, first, unit = np.unique(key, return_index=True, return_inverse=True)
        worst = np.zeros(first.size, dtype=np.int64)
        np.maximum.at(worst, unit, state)
        # If a motion failed, the damage of the event is known only if another motion caused the heaviest state.
        failed = unit[state == FAILED]
        worst[failed[worst[failed] < len(states) - 1]] = FAILED
        state, archetype, record, stripe = worst, archetype[first], record[first], stripe[first]
        building = building[first]

    shape = (len(names), len(event_names), levels.size, len(states))
    # Failures are counted as an additional state after the last one.
    places = archetype, record, stripe, np.where(state == FAILED, len(states), state)
    wide = (*shape[:-1], len(states) + 1)
    cells = np.ravel_multi_index(tuple(values.astype(np.int64) for values in places), wide)
    if is_in_inventory_order(number):
        warn_of_inventory_order("damage_shares: number", len(names))
    weights = None if number is None else _checked_number(number, building)
    counts = np.bincount(cells, weights, minlength=np.prod(wide)).reshape(wide)
    counts, failures = counts[..., :-1], counts[..., -1]
    along = "motion" if events is None else "event"
    of_stripes = levels if is_striped else None
    return _Counted(names, states, table, counts, failures, failed_samples, along, event_names, of_stripes)


def _read(run: xr.Dataset, limits: Limits | None, events: Events) -> _Counted:
    """Return the numbers of buildings from the DamageCounts of a run; arguments: see `damage_shares`."""
    if events is not None:
        raise ValueError(
            "these are counts of a run with DamageCounts: give events= to DamageCounts(...) in simulate(), not to "
            "damage_shares()"
        )
    stripe = ("stripe",) if "stripe" in run.dims else ()
    name = counts_over("damage_shares", run, *((("archetype", along, *stripe)) for along in ("event", "motion")))
    along = "event" if "event" in run[name].dims else "motion"
    names, table = run["archetype"].values.astype(str), run["damage_limit"].transpose("archetype", "damage_state")
    states, values = [str(state) for state in table["damage_state"].values], table.values[:, 1:]
    if limits is not None:
        asked = limits_by_archetype(names.tolist(), limits)
        if asked[0] != states or not np.array_equal(asked[1], values):
            raise ValueError(
                "the run has counts for other limits (see its damage_limit), and single samples are not available: "
                "remove "
                "limits="
            )
    numbers = name.replace(DAMAGE_COUNT, BUILDING_NUMBER)  # missing if each structure represents one building
    counts = run[numbers if numbers in run else name].transpose("archetype", along, *stripe, "damage_state").values
    failures = run[name.replace(DAMAGE_COUNT, "failed_count")].sum("failure")
    failures = run.get(f"failed_{numbers}", failures).transpose("archetype", along, *stripe)
    failed_samples = int(run["failed_samples"].sum())
    shape = (len(names), run.sizes[along], -1)
    of_stripes = run["stripe"].values if stripe else None
    counts, failed = counts.reshape(*shape, len(states)), failures.values.reshape(shape)
    return _Counted(names, states, values, counts, failed, failed_samples, along, run[along].values, of_stripes)


def _checked_number(number: ArrayLike, building: np.ndarray) -> np.ndarray:
    """Return the number of buildings that each sample represents, shape [sample], after a check.

    Args:
        number: Number of buildings that each building of the portfolio represents, shape [building].
        building: Number of the building of each sample, shape [sample].
    """
    values = finite_numbers("damage_shares: number", number)
    if values.ndim != 1 or values.size <= building.max() or np.any(values <= 0):
        raise ValueError(
            f"damage_shares: number must be above 0 and have one value for each building of the portfolio, at least "
            f"{building.max() + 1:,} values; got shape {values.shape}"
            + (f" and a least value of {values.min():g}" if values.size else "")
        )
    return values[building]


def _check_failures(failures: np.ndarray, counted: np.ndarray, names: np.ndarray, events: np.ndarray | None) -> None:
    """Raise an error if too many buildings failed in total; warn if many buildings of an archetype failed in an event.

    Args:
        failures: Numbers of failed buildings, shape [archetype, event, stripe].
        counted: Numbers of counted buildings, of the same shape.
        names: Names of the archetypes.
        events: Names of the events; None: the dimension is `motion`.
    """
    allowed, total = f"{100 * LARGEST_EXCLUDED_FRACTION:g} %", failures + counted
    if failures.sum() > LARGEST_EXCLUDED_FRACTION * total.sum():
        once = "" if events is None else ", each counted once per event,"
        unit = "samples" if events is None and failures.dtype.kind in "iu" else f"buildings{once}"
        raise ValueError(
            f"{failures.sum():,.12g} of {total.sum():,.12g} {unit} failed; at most {allowed} may fail: simulate with a "
            "smaller step= or another method="
        )
    failures, total = failures.sum(axis=2), total.sum(axis=2)
    many = np.argwhere(failures > LARGEST_EXCLUDED_FRACTION * total)
    if not len(many):
        return
    worst = sorted(many.tolist(), key=lambda place: -failures[tuple(place)] / total[tuple(place)])
    shown = [
        f"{failures[i, j]:,.12g} of {total[i, j]:,.12g} of archetype {str(names[i])!r} in "
        + (f"motion {j}" if events is None else f"event {events[j].item()!r}")
        for i, j in worst[:3]
    ]
    warn_caller(
        f"of {len(many)} archetypes in an event more than {allowed} failed and are not counted (simulate with a "
        f"smaller step= or another method=): {'; '.join(shown + ['...'] * (len(worst) > 3))}"
    )


def _events_of(run: xr.Dataset, events: Events) -> tuple[np.ndarray, np.ndarray]:
    """Return the index of each sample's event, shape [sample], and the names of the events, shape [event]."""
    if "motion_index" not in run.variables:
        raise ValueError("the dataset has no 'motion_index': give the result of simulate() for a portfolio")
    record, motions = run["motion_index"].values, run.sizes["motion"]
    if events is None:
        return record, np.arange(motions)
    if isinstance(events, xr.DataArray) and "sample" in events.dims:
        if events.shape != record.shape:
            raise ValueError(
                f"events must have the shape [{record.size}], one event per sample, got {list(events.shape)}"
            )
        names, place = np.unique(events.values, return_inverse=True)
        return place, names
    of_motion, names = numbered_events(events, motions)
    return of_motion[record], names


def _states_of_samples(run: xr.Dataset, table: np.ndarray, added_storeys: bool) -> np.ndarray:
    """Return the damage state of every sample, shape [sample]: 0 without damage, FAILED without a valid result.

    Args:
        run: The run of a portfolio.
        table: Drift ratio limits [1], shape [archetype, damage_state - 1].
        added_storeys: Whether storeys of isolators or of a tuned mass damper count.
    """
    if "peak_storey_drift_ratio" not in run:
        raise ValueError("the run has no 'peak_storey_drift_ratio': add 'drift' to Scene(recorders=...)")
    status, archetype = decoded_status(run["status"]), run["archetype_index"].values
    states = np.empty(status.size, dtype=np.int8)
    is_added = None
    if KIND_OF_ARCHETYPES in run.coords and not added_storeys:
        is_added = run[KIND_OF_ARCHETYPES].transpose("archetype", "storey").values > 0
    for first in range(0, status.size, SAMPLES_AT_A_TIME):
        part = slice(first, first + SAMPLES_AT_A_TIME)
        drift = run["peak_storey_drift_ratio"][part].values
        if is_added is not None:
            drift = np.where(is_added[archetype[part]], np.nan, drift)
        worst = np.fmax.reduce(drift.astype(np.float64), axis=1)  # NaN: a storey that the building does not have
        bad = np.flatnonzero(np.isnan(worst) & (status[part] == OK))
        if bad.size:
            raise ValueError(
                f"sample {first + bad[0]} is 'ok', but its peak_storey_drift_ratio is NaN at every storey: its demands "
                "were removed or changed after the run; give the run as simulate() returned it"
            )
        states[part] = (worst[:, None] > table[archetype[part]]).sum(axis=1)
    states[status == COLLAPSED] = table.shape[1]
    states[status >= DIVERGED] = FAILED
    return states
