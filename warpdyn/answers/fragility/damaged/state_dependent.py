"""State-dependent fragility: curves of an event for each damage state that the earlier events have left."""

from __future__ import annotations

from collections.abc import Mapping
from typing import Any

import numpy as np
import xarray as xr

from warpdyn.answers.fragility.curve_variables import variable
from warpdyn.answers.fragility.demands import damage_of
from warpdyn.answers.fragility.fragility_curves import OVER, curves_of_stripes
from warpdyn.answers.fragility.intervals.jackknife import RecordNumbers
from warpdyn.answers.fragility.lognormal_fit import check_confidence
from warpdyn.answers.fragility.stripe_counts import checked_failures, decoded_status
from warpdyn.campaigns.reductions.limits import DRIFT, NO_DAMAGE, DamageLimits, Limit
from warpdyn.campaigns.running.selections import select_event, without_added_places
from warpdyn.foundations.core.checks import MOST_REPLICATES, check_dataset, one_of, whole_number
from warpdyn.foundations.core.messages import collected_warnings, warn_of_all
from warpdyn.foundations.core.near_misses import suggests_names
from warpdyn.foundations.core.output_variables import COLLAPSED, OK, STRIPED
from warpdyn.foundations.core.units import unit_attributes

CURVES = ("fragility_median", "fragility_dispersion")
FRACTION = "exceedance_fraction"
REPLICATES = ("replicate_median", "replicate_dispersion")
BOUNDS = ("", "_lower", "_upper")
UNKNOWN = -1  # state of a sample that failed in an earlier event


@suggests_names
def state_dependent_fragility(
    run: xr.Dataset,
    limits: Mapping[str, Limit],
    *,
    demand: str = DRIFT,
    event: str | None = None,
    replicates: int = 1000,
    confidence: float = 0.95,
    seed: int = 0,
) -> xr.Dataset:
    """Return the fragility curves of one event of a sequence for each damage state after the earlier events.

    The damage state of a structure is the heaviest state that it reached in any event so far. The samples of the event
    are divided by the state in which the earlier events left their structure, from "none" to the second heaviest state,
    and `fragility` is applied to each part, with the limits of the heavier states. At an intensity, the curves of one
    part are a row of the damage-state transition matrix: the probability of moving from this state to a heavier one is
    the difference of two curves.

    A structure without P-Delta and without deterioration depends little on its state: in the verification the medians
    of a bilinear oscillator differ by 2 %.

    Source: Iervolino, Giorgio and Chioccarelli (2016), "Markovian modeling of seismic damage accumulation", Earthquake
    Engineering & Structural Dynamics 45(3) (state-dependent fragility; transition matrix).

    Args:
        run: A run of an `EventSequence`, as `simulate` returned it; the event has `Stripes`.
        limits: Limit of each damage state, from the lightest to the heaviest [units of the demand], as in `fragility`.
        demand: Name of the demand; the worst storey or floor counts.
        event: Name of the event; None: the last one.
        replicates: Number of draws from the joint sampling distribution of medians and dispersions. The
            draws of different `from_state` are correlated by the motions that they have in common.
        confidence: Probability that the intervals cover the true value [1].
        seed: Seed of the draws.

    Returns:
        With the dimension `from_state` ("none" and all states but the heaviest) and the dimension `damage_state` (state
        that is reached or exceeded): `fragility_median` [g, or the unit of the levels] and `fragility_dispersion` [1],
        with `_lower` and `_upper`; `exceedance_fraction(..., stripe)` [1] with bounds; `replicate_median` and
        `replicate_dispersion(from_state, replicate, damage_state)`; `samples(from_state)`, the number of samples that
        begin in this state (without those that failed in an earlier event);
        `transition_probability(from_state, to_state, stripe)` [1], the shares of samples that end in exactly this
        state. Values of states that are not heavier than `from_state` are NaN, as are those of states without samples
        or without a fit (a warning names them).

    Raises:
        TypeError: If `run` is not a Dataset.
        ValueError: If the run has no earlier event, the event has no stripes, limits are invalid or name the state
            "none", or more than 1 % of the samples failed.

    Example:
        >>> mainshock = wd.Stripes(motions[:4], [0.15, 0.8], wd.PeakGroundAcceleration())  # g
        >>> sequence = wd.EventSequence({"mainshock": mainshock, "aftershock": stripes})
        >>> shocks = wd.simulate(wd.Scene(building, sequence, scatter, recorders=("drift",)), structures=8)
        >>> damaged = wd.state_dependent_fragility(shocks, {"slight": 0.004, "complete": 0.015})
        >>> damaged["fragility_median"].sel(damage_state="complete").round(1).values  # g; from "none", from "slight"
        array([1.2, 1.1])
    """
    name = "state_dependent_fragility"
    check_dataset(name, run, advice="give the result of simulate() for an EventSequence", argument="run")
    check_confidence(confidence)
    replicates, seed = whole_number("replicates", replicates, 1, MOST_REPLICATES), whole_number("seed", seed, 0)
    if "event" not in run.dims or "im_level_design" not in run.coords or run.sizes["event"] < 2:
        raise ValueError(
            f"{name}: the run has no earlier event: simulate wd.EventSequence({{'mainshock': design, 'aftershock': "
            "stripes})"
        )
    names = [str(each) for each in run["event"].values]
    chosen = names[-1] if event is None else event
    one_of("name of an event of the run", chosen, names[1:])
    place = names.index(chosen)
    if isinstance(limits, Mapping) and NO_DAMAGE in limits:
        raise ValueError(
            f"{name}: {NO_DAMAGE!r} is the name of the undamaged state, so it cannot have a limit: rename this damage "
            f"state, such as {{'slight': {limits[NO_DAMAGE]!r}, ...}}, or remove it from limits"
        )
    checked = DamageLimits.of(limits, demand)
    after = without_added_places(select_event(run, chosen))
    if after["im_level"].attrs.get("design") != STRIPED:
        raise ValueError(f"{name}: event {chosen!r} has no stripes: give it Stripes(motions, levels, measure)")
    units = str(after["im_level"].attrs.get("units", "g"))
    checked_failures(decoded_status(after["status"]), after["motion_index"].values, after["im_level"].values, units)
    before = np.zeros(after.sizes["sample"], np.int64)
    is_valid = np.ones(before.size, bool)
    own = run.sel(sample=after["sample"].values) if "sample" in run.indexes else run
    for earlier in range(place):
        part = own.isel(event=earlier)
        status = decoded_status(part["status"])
        passed = damage_of(name, without_added_places(part), checked, status).passed[-1]
        before = np.maximum(before, passed)
        is_valid &= np.isin(status, (OK, COLLAPSED))
    before = np.where(is_valid, before, UNKNOWN)
    how = {"demand": demand, "replicates": replicates, "confidence": confidence, "seed": seed}
    how |= {"estimator": "lognormal", "intervals_over": OVER[0], "added_storeys": False}
    parts, remarks = _fits(after, before, limits, how)
    warn_of_all(name, remarks)
    samples = np.bincount(before[is_valid], minlength=len(parts) + 1)[: len(parts)]
    return _gathered(parts, samples, list(checked.states), after["im_level"], replicates).assign_attrs(
        intensity_measure=str(after.attrs.get("intensity_measure", "")),
        demand=", ".join(checked.demands),
        fragility_shape="lognormal",
        event=chosen,
        confidence=float(confidence),
        replicates_seed=seed,
    )


def _fits(
    after: xr.Dataset, before: np.ndarray, limits: Mapping[str, Limit], how: dict[str, Any]
) -> tuple[list[xr.Dataset | None], list[str]]:
    """Return the result of `fragility` for the samples of each state before the event, and sentences for a warning.

    The records are the same for all states, so the draws use the same random number for a record in all of them: its
    influence on the curves is joint. The random numbers of groups of structures are independent.

    Args:
        after: Samples of the event.
        before: Number of damage states that each sample has reached before the event, shape [sample]; or UNKNOWN.
        limits: Limit of each damage state.
        how: Arguments of `fragility`.

    Returns:
        One result per state, from "none" to the second heaviest one, or None if its samples have no curves; sentences.
    """
    numbers = RecordNumbers.of(np.unique(after["motion_index"].values), how["replicates"], how["seed"])
    states, stripes = list(limits), np.unique(after["im_level"].values).size
    found: list[xr.Dataset | None] = []
    remarks = []
    for place, origin in enumerate([NO_DAMAGE, *states[:-1]]):
        rows = np.flatnonzero(before == place)
        if not rows.size:
            remarks.append(f"no sample begins in state {origin!r}: no curves from this state")
            found.append(None)
            continue
        part = after.isel(sample=rows)
        heavier = {state: limits[state] for state in states[place:]}
        own = int(np.random.SeedSequence([how["seed"], place]).generate_state(1, np.uint64)[0] >> np.uint64(1))
        with collected_warnings() as known:  # of implausible limits, which were given for all states
            DamageLimits.of(heavier, how["demand"])
        try:
            with collected_warnings() as caught:
                found.append(curves_of_stripes(part, heavier, **(how | {"seed": own}), numbers=numbers))
        except ValueError as error:
            if rows.size >= 2 * stripes:
                raise ValueError(f"samples that begin in state {origin!r}: {error}") from error
            remarks.append(f"only {rows.size} samples begin in state {origin!r}: no curves from this state ({error})")
            found.append(None)
            continue
        new = [message for message, kind in caught if (message, kind) not in known]
        sentences = [each for message in new for each in message.removeprefix("fragility:").split("\n- ")]
        remarks += [f"from state {origin!r}: {each.strip()}" for each in sentences if each.strip()]
    return found, remarks


def _gathered(
    parts: list[xr.Dataset | None], samples: np.ndarray, states: list[str], level: xr.DataArray, replicates: int
) -> xr.Dataset:
    """Return one dataset with the curves of all states before the event, without attributes.

    Args:
        parts: Result of `fragility` for each state before the event; None: no curves.
        samples: Number of samples that begin in each state, shape [from_state].
        states: Names of the damage states.
        level: Level of each sample, with its units.
        replicates: Number of draws.
    """
    levels, count = np.unique(level.values), len(states)
    found = {f"{key}{end}": np.full((count, count), np.nan) for key in CURVES for end in BOUNDS}
    found |= {f"{FRACTION}{end}": np.full((count, count, levels.size), np.nan) for end in BOUNDS}
    found |= {key: np.full((count, replicates, count), np.nan) for key in REPLICATES}
    for place, part in enumerate(parts):
        if part is None:
            continue
        at = np.searchsorted(levels, part["stripe"].values)
        for key in (f"{each}{end}" for each in CURVES for end in BOUNDS):
            found[key][place, place:] = part[key].values
        for key in (f"{FRACTION}{end}" for end in BOUNDS):
            found[key][place, place:, at] = part[key].transpose("stripe", "damage_state").values
        for key in REPLICATES:
            if key in part:
                found[key][place, :, place:] = part[key].transpose("replicate", "damage_state").values
    pair, of_measure = ("from_state", "damage_state"), unit_attributes(str(level.attrs.get("units", "g")))
    words = {CURVES[0]: ("median capacity", of_measure), CURVES[1]: ("dispersion of the capacity", {})}
    result: dict[str, tuple] = {}
    for end, side in zip(BOUNDS, ("", ", lower bound", ", upper bound"), strict=True):
        for key in CURVES:
            result[key + end] = variable(pair, found[key + end], words[key][0] + side, **words[key][1])
        exceeding = f"fraction of samples exceeding{side}"
        result[FRACTION + end] = variable((*pair, "stripe"), found[FRACTION + end], exceeding)
    for key, each in zip(REPLICATES, CURVES, strict=True):
        dims = ("from_state", "replicate", "damage_state")
        result[key] = variable(dims, found[key], f"{words[each][0]}, draws", **words[each][1])
    result["samples"] = variable("from_state", samples, "samples that begin in the state")
    shares, dims = _transitions(found[FRACTION]), ("from_state", "to_state", "stripe")
    result["transition_probability"] = variable(dims, shares, "share of samples that end in the state")
    names = {
        "from_state": ([NO_DAMAGE, *states[:-1]], "damage state before the event"),
        "damage_state": (states, "damage state that is reached or exceeded"),
        "to_state": ([NO_DAMAGE, *states], "damage state after the event"),
    }
    coordinates = {key: (key, np.array(each), {"long_name": text}) for key, (each, text) in names.items()}
    return xr.Dataset(
        result, coordinates | {"stripe": variable("stripe", levels, "intensity of the stripe", **of_measure)}
    )


def _transitions(exceeding: np.ndarray) -> np.ndarray:
    """Return shares of samples that end in exactly each state, shape [from, to, stripe].

    Args:
        exceeding: Fractions of samples that reach or exceed a state, shape [from, state, stripe]; NaN for states that
            are not heavier than the first one.
    """
    count, _, stripes = exceeding.shape
    found = np.zeros((count, count + 1, stripes))
    for place in range(count):
        reached = np.concatenate([np.ones((1, stripes)), exceeding[place, place:], np.zeros((1, stripes))])
        found[place, place:] = reached[:-1] - reached[1:]
    return found
