"""What the curves of one building must hold before they are written for another tool."""

from __future__ import annotations

from typing import Any

import numpy as np
import xarray as xr

from warpdyn.answers.risk.curves import warn_of_extrapolated, warn_of_penalised

# Lognormal curves of different dispersions cross somewhere. A tool that subtracts one from the next gets a negative
# share of the buildings there, which so small a probability keeps below what matters.
LARGEST_CROSSING = 1e-3
CHECKED_POINTS = 1000  # of curves without points
LEAST_CHECKED = 1e-3  # of the greatest intensity: the first of these points, if curves begin at 0


def damage_states(what: str, curves: xr.Dataset) -> list[str]:
    """Return the damage states of curves, from the lightest on."""
    if "damage_state" not in curves.coords:
        raise ValueError(f"{what}: the dataset has no coordinate 'damage_state'; give what fragility() returned")
    names = [str(name) for name in curves["damage_state"].values.ravel()]
    if len(set(names)) < len(names):
        raise ValueError(f"{what}: two damage states have one name: {', '.join(names)}")
    return names


def fitted(what: str, curves: xr.Dataset) -> tuple[np.ndarray, np.ndarray]:
    """Return medians and dispersions of curves, shape [damage_state], once every state is known to have a fit.

    Raises:
        ValueError: If the dataset has none; if a state has no fit, a median or dispersion that is not above 0, or a
            median below that of a lighter state.
    """
    states = damage_states(what, curves)
    found = []
    for name in ("fragility_median", "fragility_dispersion"):
        if name not in curves or curves[name].dims != ("damage_state",):
            raise ValueError(f"{what}: the dataset has no {name}(damage_state); give what fragility() returned")
        found.append(curves[name].values.astype(np.float64))
        for state, value in zip(states, found[-1], strict=True):
            if np.isnan(value):
                raise ValueError(
                    f"{what}: damage state {state!r} has no lognormal fit ({name} is NaN): add levels to the stripes, "
                    "leave the state out by .drop_sel(damage_state=...), or write stripe fractions "
                    "(format='discrete')"
                )
            if not 0 < value < np.inf:
                raise ValueError(f"{what}: {name} of damage state {state!r} is {value:g}; it must be finite, above 0")
    warn_of_penalised(curves, tuple(states))
    warn_of_extrapolated(curves, tuple(states))
    median, dispersion = found
    for i in np.flatnonzero(np.diff(median) < 0):
        raise ValueError(
            f"{what}: the medians of {states[i]!r} and {states[i + 1]!r} fall, {median[i]:g} and {median[i + 1]:g}: "
            "damage states must come from the lightest on"
        )
    return median, dispersion


def check_exceedance(what: str, states: list[str], levels: np.ndarray, probability: np.ndarray, units: Any) -> None:
    """Raise a ValueError unless probabilities are of curves that rise and do not cross.

    Args:
        what: What they are of, in errors.
        states: Names, from the lightest on.
        levels: Intensities.
        probability: Probability of exceedance, shape [damage_state, level].
        units: The unit of the intensities, in errors.
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
                f"to {values[i + 1]:.4g} at {levels[i + 1]:g} {units}; write the fitted curve at intensities= instead "
                "of stripe fractions"
            )
    for lighter in range(len(states) - 1):
        excess = probability[lighter + 1] - probability[lighter]
        worst = int(np.argmax(excess))
        if excess[worst] > LARGEST_CROSSING:
            raise ValueError(
                f"{what}: damage states {states[lighter]!r} and {states[lighter + 1]!r} cross: at "
                f"{levels[worst]:.4g} {units} the heavier is exceeded with probability "
                f"{probability[lighter + 1, worst]:.4g} and the lighter with {probability[lighter, worst]:.4g}, so "
                f"that a negative share of buildings (more than {LARGEST_CROSSING:g}) would be between them; give both "
                "one dispersion, or write a range of intensities where they do not cross"
            )
