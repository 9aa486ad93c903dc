"""Checks of fragility curves before they are written for another program."""

from __future__ import annotations

from typing import Any

import numpy as np
import xarray as xr

from warpdyn.answers.risk.curves import warn_of_extrapolated, warn_of_penalised

# Lognormal curves with different dispersions cross somewhere. There, a program that subtracts one curve from the next
# gets a negative share of buildings; shares above this limit are refused.
LARGEST_CROSSING = 1e-3
CHECKED_POINTS = 1000  # intensities at which continuous curves are checked
LEAST_CHECKED = 1e-3  # first of these points over the greatest intensity, if the curves begin at 0


def damage_states(what: str, curves: xr.Dataset) -> list[str]:
    """Return the damage states of curves, the lightest first."""
    if "damage_state" not in curves.coords:
        raise ValueError(f"{what}: the dataset has no coordinate 'damage_state'; pass the result of fragility()")
    names = [str(name) for name in curves["damage_state"].values.ravel()]
    if len(set(names)) < len(names):
        raise ValueError(f"{what}: two damage states have the same name: {', '.join(names)}")
    return names


def fitted(what: str, curves: xr.Dataset) -> tuple[np.ndarray, np.ndarray]:
    """Return medians and dispersions of curves, shape [damage_state], after checking that every state has a fit.

    Raises:
        ValueError: If the dataset has no fitted curves, a state has no fit, a median or dispersion is not above 0, or a
            median is below the median of a lighter state.
    """
    states = damage_states(what, curves)
    found = []
    for name in ("fragility_median", "fragility_dispersion"):
        if name not in curves or curves[name].dims != ("damage_state",):
            raise ValueError(f"{what}: the dataset has no {name}(damage_state); pass the result of fragility()")
        found.append(curves[name].values.astype(np.float64))
        for state, value in zip(states, found[-1], strict=True):
            if np.isnan(value):
                raise ValueError(
                    f"{what}: damage state {state!r} has no lognormal fit ({name} is NaN): add levels to the stripes, "
                    f"drop the state by .drop_sel(damage_state=[{state!r}]), or write stripe fractions by "
                    "format='discrete'"
                )
            if not 0 < value < np.inf:
                raise ValueError(f"{what}: {name} of damage state {state!r} is {value:g}; it must be finite, above 0")
    warn_of_penalised(curves, tuple(states))
    warn_of_extrapolated(curves, tuple(states))
    median, dispersion = found
    for i in np.flatnonzero(np.diff(median) < 0):
        raise ValueError(
            f"{what}: the median of {states[i + 1]!r} ({median[i + 1]:g}) is below the median of {states[i]!r} "
            f"({median[i]:g}): sort the damage states with the lightest first"
        )
    return median, dispersion


def check_exceedance(what: str, states: list[str], levels: np.ndarray, probability: np.ndarray, units: Any) -> None:
    """Raise a ValueError unless the curves rise and do not cross.

    Args:
        what: Name of the curves in errors.
        states: Names of the damage states, the lightest first.
        levels: Intensities.
        probability: Probability of exceedance, shape [damage_state, level].
        units: Unit of the intensities in errors.
    """
    for state, values in zip(states, probability, strict=True):
        for level, value in zip(levels, values, strict=True):
            if not 0 <= value <= 1:  # NaN too
                raise ValueError(
                    f"{what}: the probability of exceeding {state!r} is {value:g} at {level:g} {units}; it must be "
                    "from 0 to 1"
                )
        for i in np.flatnonzero(np.diff(values) < 0):
            raise ValueError(
                f"{what}: the probability of exceeding {state!r} falls from {values[i]:.4g} at {levels[i]:g} {units} "
                f"to {values[i + 1]:.4g} at {levels[i + 1]:g} {units}; write the fitted curves by intensities=[...] "
                "instead of the stripe fractions"
            )
    for lighter in range(len(states) - 1):
        excess = probability[lighter + 1] - probability[lighter]
        worst = int(np.argmax(excess))
        if excess[worst] > LARGEST_CROSSING:
            raise ValueError(
                f"{what}: the curves of {states[lighter]!r} and {states[lighter + 1]!r} cross: at {levels[worst]:.4g} "
                f"{units} the probability of exceeding the heavier state is {probability[lighter + 1, worst]:.4g}, "
                f"that of the lighter state {probability[lighter, worst]:.4g}. The share of buildings in the lighter "
                f"state would be negative (beyond -{LARGEST_CROSSING:g}). Give both states one dispersion, or write "
                "a range of intensities in which the curves do not cross"
            )
