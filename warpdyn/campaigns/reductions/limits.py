"""Limits of damage states for one or several demands, and checks of these limits."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from dataclasses import dataclass
from itertools import pairwise
from numbers import Real

import numpy as np

from warpdyn.foundations.core.plausibility import warn_of_implausible_limits

NO_DAMAGE = "none"
# Names of variables that are counted during a run, and that fragility() and damage_shares() read.
DAMAGE_COUNT, LEAST_DRIFT = "damage_count", "least_drift_ratio_of_collapse"
BUILDING_NUMBER = "number_of_buildings"
DRIFT = "peak_storey_drift_ratio"
# Names of the ranges of plausible limits, by demand.
LIMIT_BANDS = {
    DRIFT: "drift_limit",
    "residual_drift_ratio": "drift_limit",
    "peak_storey_drift": "drift_limit_in_metres",
    "peak_floor_acceleration": "acceleration_limit",
}
Limit = float | Mapping[str, float]


def is_peak(demand: str) -> bool:
    """Return whether a demand is a recorded peak (its name begins with "peak_"), which is never negative."""
    return demand.startswith("peak_")


def magnitudes(demand: str, values: np.ndarray) -> np.ndarray:
    """Return the values that are compared with limits: peaks unchanged, absolute values of all other demands.

    Recorded peaks are not negative. If a peak is negative, it is not from a run; it stays unchanged, so that a later
    check detects it.

    Args:
        demand: Name of the demand.
        values: Values of the demand, of any shape.
    """
    return values if is_peak(demand) else np.abs(values)


@dataclass(frozen=True, eq=False)
class DamageLimits:
    """Limits of damage states, for each demand.

    Args:
        states: Names of the damage states, from the lightest to the heaviest.
        demands: Names of the variables.
        values: Limits in the units of the variables, shape [demand, damage_state]; NaN: no limit.
    """

    states: tuple[str, ...]
    demands: tuple[str, ...]
    values: np.ndarray

    @staticmethod
    def of(limits: Mapping[str, Limit], demand: str = DRIFT) -> DamageLimits:
        """Return checked limits, as an object with one row for each demand.

        Args:
            limits: Limit of each damage state, from the lightest to the heaviest state: a number, which is a limit of
                `demand`, or a mapping from several demands to their limits.
            demand: Name of the demand to which plain numbers apply.

        Raises:
            ValueError, TypeError: If a limit is missing or not above 0, or if the limits of a demand do not increase
                from state to state.
        """
        if not isinstance(limits, Mapping) or not len(limits):
            given = repr(limits) if isinstance(limits, Mapping | list | tuple | int | float) else type(limits).__name__
            raise ValueError(
                f"limits must map at least one damage state to a limit of {demand}, as the dictionary "
                f"{{'slight': 0.005, 'complete': 0.04}}, got {given}"
            )
        if not isinstance(demand, str):
            raise TypeError(f"demand must be the name of a variable of the run, such as {DRIFT!r}, got {demand!r}")
        states = state_names(limits)
        rows = [dict(limit) if isinstance(limit, Mapping) else {demand: limit} for limit in limits.values()]
        demands = tuple(dict.fromkeys(str(name) for row in rows for name in row))
        values = np.full((len(demands), len(states)), np.nan)
        for place, (state, row) in enumerate(zip(states, rows, strict=True)):
            if not row:
                raise ValueError(f"limits of damage state {state!r} are empty: give a limit for at least one demand")
            for name, limit in row.items():
                value = limit_of_state(state, limit)
                values[demands.index(str(name)), place] = value
        for name, row_of_demand in zip(demands, values, strict=True):
            _check_increase(name, states, row_of_demand)
        for name, of in LIMIT_BANDS.items():
            if name in demands:
                row = values[demands.index(name)]
                finite = {f" of {state!r}": float(row[i]) for i, state in enumerate(states) if np.isfinite(row[i])}
                warn_of_implausible_limits(finite, of)
        return DamageLimits(states, demands, values)

    @property
    def single(self) -> str | None:
        """Name of the demand, if there is only one; None if there are several demands."""
        return self.demands[0] if len(self.demands) == 1 else None


def state_names(limits: Mapping) -> tuple[str, ...]:
    """Return the names of the damage states, or raise a TypeError if a name is not a text."""
    for state in limits:
        if not isinstance(state, str):
            raise TypeError(
                f"the name of a damage state must be text, as in {{{str(state)!r}: ...}}, got {state!r}, which is of "
                f"type {type(state).__name__}"
            )
    return tuple(str(state) for state in limits)


def limit_of_state(state: str, limit: object) -> float:
    """Return the limit of a damage state as a float, or raise a ValueError unless it is one number above 0.

    The limit may be infinite; then only collapsed samples exceed it.
    """
    value: object = getattr(limit, "item", lambda: limit)() if getattr(limit, "size", 0) == 1 else limit
    if not isinstance(value, Real) or isinstance(value, bool) or not float(value) > 0:
        hint = " (0.5 % is 0.005)" if isinstance(limit, str) and "%" in limit else ""
        hint = "; remove the state from limits, or give it math.inf if only collapse counts" if limit is None else hint
        raise ValueError(
            f"the limit of damage state {state!r} is {limit!r}; it must be one number above 0 (math.inf: only "
            f"collapse counts){hint}"
        )
    return float(value)


def _check_increase(demand: str, states: tuple[str, ...], values: np.ndarray) -> None:
    given = np.flatnonzero(~np.isnan(values))
    for i, j in pairwise(given):
        if values[j] <= values[i]:
            raise ValueError(
                f"limits must increase from one damage state to the next, but {states[i]!r} has {values[i]} "
                f"and {states[j]!r} after it {values[j]} ({demand}): correct the limits, "
                "or sort the states with the lightest first"
            )


def limits_by_archetype(
    names: Sequence[str], limits: Mapping[str, Mapping[str, float]]
) -> tuple[list[str], np.ndarray]:
    """Return the names of the damage states and the checked limits of each archetype of a portfolio.

    Args:
        names: Names of the archetypes.
        limits: Drift limits of the damage states, by archetype.

    Returns:
        The damage states, with no damage first; the limits [1], shape [archetype, damage_state - 1].
    """
    if not isinstance(limits, Mapping):
        raise TypeError(
            f"limits must map each archetype to its limits, such as {{'houses': {{'slight': 0.005}}}}, got "
            f"{type(limits).__name__}"
        )
    unknown = [name for name in limits if name not in names]
    if unknown:
        raise ValueError(
            f"limits name {unknown[0]!r}, which is not an archetype of the run: remove or correct this name; the "
            f"archetypes are {', '.join(names)}"
        )
    states: list[str] = []
    rows: list[list[float]] = []
    missing = [name for name in names if name not in limits]
    if missing:
        raise ValueError(
            f"limits lack archetype {', '.join(map(repr, missing))}: they must map each archetype of the run "
            f"({', '.join(map(repr, names))}) to its limits"
        )
    for name in names:
        own = limits.get(str(name))
        if not isinstance(own, Mapping) or not own:
            raise ValueError(
                f"archetype {str(name)!r}: limits must map each damage state to a drift ratio, got {own!r}"
            )
        state_names(own)
        if states and list(own) != states:
            raise ValueError(
                f"archetype {str(name)!r}: its damage states are {', '.join(own)}, those of {str(names[0])!r} "
                f"{', '.join(states)}: give all archetypes the same damage states in the same order"
            )
        states = list(own)
        try:
            row = [limit_of_state(state, own[state]) for state in states]
        except ValueError as error:
            raise ValueError(f"archetype {str(name)!r}: {error}") from None
        if any(not after > before for before, after in pairwise(row)):
            raise ValueError(
                f"archetype {str(name)!r}: limits must increase from the lightest to the heaviest state, got {row}: "
                "correct or sort them"
            )
        rows.append(row)
    if NO_DAMAGE in states:
        raise ValueError(f"{NO_DAMAGE!r} is the state of buildings that exceed no limit: remove it from limits")
    return [NO_DAMAGE, *states], np.array(rows)
