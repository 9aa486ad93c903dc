"""Damage that accumulates over years of repeated events: a Markov chain of the damage states."""

from __future__ import annotations

from collections.abc import Sequence

import numpy as np
import xarray as xr

from warpdyn.answers.fragility.curve_variables import variable
from warpdyn.answers.fragility.lognormal_fit import check_confidence
from warpdyn.answers.risk.annual_rates import weighted_bounds
from warpdyn.answers.risk.curves.curve_set import CurveSet
from warpdyn.answers.risk.curves.curve_warnings import warn_of_extrapolation, warn_of_table_ends
from warpdyn.answers.risk.hazard_curves import Hazard, branches_of
from warpdyn.answers.risk.losses import checked_periods
from warpdyn.foundations.core.checks import check_dataset
from warpdyn.foundations.core.near_misses import suggests_names

ADVICE = "give the result of state_dependent_fragility(run, limits)"
YEARS = (1.0, 10.0, 50.0, 100.0)


@suggests_names
def damage_in_time(
    curves: xr.Dataset, hazard: Hazard, *, years: Sequence[float] = YEARS, confidence: float = 0.95
) -> xr.Dataset:
    """Return the probability of each damage state after years of repeated events without repair.

    Events are a Poisson process with the rates of the hazard curve, with independent motions, and an event moves the
    structure from its damage state to the same or a heavier state with the probabilities of the state-dependent curves.
    So the state is a continuous-time Markov chain: the rate from state i to state j is the integral of the transition
    probability over the hazard curve, and the probabilities after t years are the matrix exponential of t times the
    matrix of rates. At every intensity, a heavier state is at most as likely as a lighter one, as in `annual_losses`. A
    warning names the rates with a share above 1 % from intensities beyond the points of the hazard.

    Source: Iervolino, Giorgio and Chioccarelli (2016), "Markovian modeling of seismic damage accumulation", Earthquake
    Engineering & Structural Dynamics 45(3).

    Args:
        curves: The result of `state_dependent_fragility`; or a dataset with `fragility_median` and
            `fragility_dispersion(from_state, damage_state)`, where from_state is "none" and all damage states but the
            heaviest, in this order.
        hazard: The hazard, of the same intensity measure as the curves.
        years: Periods [year].
        confidence: Probability that the intervals cover the true value [1].

    Returns:
        `transition_rate(from_state, to_state)` [1/year], the annual rate of events that move the structure to exactly
        this state; `probability(from_state, to_state, years)` [1]; `mean_time_to_heaviest(from_state)` [year]. Each has
        bounds `_lower` and `_upper` (NaN without replicates and branches).

    Raises:
        TypeError: If `curves` is not a Dataset, or `hazard` is not a HazardCurve or HazardLogicTree.
        ValueError: If the states do not fit each other, a state has no curve, years are not above 0, or the hazard has
            another unit or intensity measure.

    Example:
        >>> import xarray as xr
        >>> states = {"from_state": ["none", "slight"], "damage_state": ["slight", "complete"]}
        >>> dims = ("from_state", "damage_state")
        >>> values = {"fragility_median": (dims, [[0.4, 1.2], [np.nan, 0.9]], {"units": "g"})}
        >>> values["fragility_dispersion"] = (dims, [[0.4, 0.4], [np.nan, 0.5]])
        >>> found = wd.damage_in_time(xr.Dataset(values, states), hazard, years=[50.0])
        >>> found["probability"].sel(from_state="none").round(3).values[:, 0]
        array([0.953, 0.043, 0.004])
    """
    name = "damage_in_time"
    check_dataset(
        name, curves, "from_state", "fragility_median", "fragility_dispersion", advice=ADVICE, argument="curves"
    )
    tree = branches_of(name, hazard)
    check_confidence(confidence)
    periods = checked_periods(years, "years")
    origins = [str(each) for each in np.atleast_1d(curves["from_state"].values)]
    states = [str(each) for each in np.atleast_1d(curves["damage_state"].values)]
    if origins[1:] != states[:-1] or len(origins) != len(states):
        raise ValueError(
            f"{name}: from_state must be the undamaged state and all damage states but the heaviest, in the order of "
            f"damage_state ({', '.join(states)}), got {', '.join(origins)}: {ADVICE}"
        )
    count = len(states)
    rates = np.zeros((1, len(tree.curves), count, count + 1))
    sampled, shares, moves = None, [], []
    for place, origin in enumerate(origins):
        _check_has_curves(curves, place, origin, states)
        part = curves.isel(from_state=place, damage_state=slice(place, None)).drop_vars("from_state")
        try:
            found = CurveSet.from_dataset(name, part, tree)
        except ValueError as error:
            raise ValueError(f"curves from state {origin!r}: {error}") from error
        of_origin = found.rates(tree, ordered=True)
        rates[0, :, place, place:] = _rates_to(of_origin)
        shares.append(found.shares_beyond(tree))
        moves += [f"the rate from {origin!r} to {state!r}" for state in states[place:]]
        warn_of_table_ends(f"{name}: rate from state {origin!r}", found, tree, tree.weights @ of_origin)
        of_draws = found.sampled_rates(tree, ordered=True)
        if sampled is None:
            sampled = np.zeros((len(of_draws), len(tree.curves), count, count + 1))
        if len(of_draws) != len(sampled):
            raise ValueError(f"{name}: the curves from {origins[0]!r} and {origin!r} have other numbers of replicates")
        sampled[:, :, place, place:] = _rates_to(of_draws)
    assert sampled is not None
    warn_of_extrapolation(tuple(moves), np.concatenate(shares, axis=1), tree.curves, name)
    outcomes = [_outcomes(each, periods) for each in (rates, sampled)]
    result: dict[str, tuple] = {}
    pair = ("from_state", "to_state")
    meanings = {
        "transition_rate": (pair, "annual rate of events that move the structure to the state", "year-1"),
        "probability": ((*pair, "years"), "probability of the state after the years", "1"),
        "mean_time_to_heaviest": (("from_state",), "mean time until the heaviest state", "year"),
    }
    for (key, (dims, words, units)), estimate, draws in zip(meanings.items(), *outcomes, strict=True):
        mean = np.einsum("b,b...->...", tree.weights, estimate[0])
        bounds = weighted_bounds(draws, tree.weights, confidence)
        for end, value, side in (("", mean, ""), ("_lower", bounds[0], ", lower"), ("_upper", bounds[1], ", upper")):
            result[key + end] = variable(dims, value, words + side, units=units)
    return xr.Dataset(
        result,
        {
            "from_state": ("from_state", np.array(origins), {"long_name": "present damage state"}),
            "to_state": ("to_state", np.array([origins[0], *states]), {"long_name": "damage state in the future"}),
            "years": variable("years", periods, "period", units="year"),
        },
        {"intensity_measure": tree.measure, "confidence": float(confidence)},
    )


def _check_has_curves(curves: xr.Dataset, place: int, origin: str, states: list[str]) -> None:
    """Raise a ValueError if a curve from the state `origin` (index `place`) to a heavier state is missing."""
    median, dispersion = (
        curves[f"fragility_{key}"].isel(from_state=place).transpose("damage_state").values[place:]
        for key in ("median", "dispersion")
    )
    missing = [
        state
        for state, is_known in zip(states[place:], np.isfinite(median) & np.isfinite(dispersion), strict=True)
        if not is_known
    ]
    if not missing:
        return
    lacking = origin if place and len(missing) == len(states) - place else missing[0]
    to = " or ".join(f"state {state!r}" for state in missing)
    raise ValueError(
        f"damage_in_time: there is no curve from state {origin!r} to {to}, so the rate is unknown. Fit the curves "
        f"without state {lacking!r}: state_dependent_fragility(run, {{state: limit for state, limit in limits.items() "
        f"if state != {lacking!r}}}); or simulate more structures or levels"
    )


def _rates_to(reaching: np.ndarray) -> np.ndarray:
    """Return the row of a matrix of rates from one state: minus their sum, then the rate to exactly each heavier state.

    Args:
        reaching: Annual rates of reaching or exceeding each heavier state [1/year], shape [..., state].
    """
    ordered = np.minimum.accumulate(reaching, axis=-1)
    exactly = ordered - np.concatenate([ordered[..., 1:], np.zeros_like(ordered[..., :1])], axis=-1)
    return np.concatenate([-ordered[..., :1], exactly], axis=-1)


def _outcomes(rates: np.ndarray, periods: np.ndarray) -> tuple[np.ndarray, np.ndarray, np.ndarray]:
    """Return rates without the diagonal, probabilities after each period, and mean times to the heaviest state.

    Args:
        rates: Matrices of rates [1/year], shape [replicate, branch, from, to].
        periods: Periods [year], shape [period].
    """
    from scipy.linalg import expm  # its import takes 0.1 s

    count = rates.shape[-2]
    off = rates * (1 - np.eye(count, count + 1))
    whole = np.concatenate([rates, np.zeros_like(rates[..., :1, :])], axis=-2)  # the heaviest state is absorbing
    is_known = np.isfinite(whole).all(axis=(-2, -1))
    after = np.full((*whole.shape, periods.size), np.nan)
    for place, period in enumerate(periods):
        after[is_known, :, :, place] = expm(whole[is_known] * period)
    time = np.full((*is_known.shape, count), np.nan)
    staying = -rates[..., :count]
    with np.errstate(divide="ignore", invalid="ignore"):
        steps = off[..., :count] / np.einsum("...ii->...i", staying)[..., None]
        for place in range(count)[::-1]:  # the mean time in a state, and then from the next state on
            own = 1 / staying[..., place, place]
            later = np.nansum(steps[..., place, place + 1 :] * time[..., place + 1 :], axis=-1)
            time[..., place] = own + later
    time[~is_known] = np.nan
    return off, np.clip(after[..., :count, :, :], 0.0, 1.0), time
