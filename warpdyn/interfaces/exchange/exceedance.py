"""What the curves of one building must hold before they are written for another tool."""

from __future__ import annotations

import numpy as np

from warpdyn.answers.risk.curves.curve_set import CurveSet

# Lognormal curves of different dispersions cross somewhere. A tool that subtracts one from the next gets a negative
# share of the buildings there, which so small a probability keeps below what matters.
LARGEST_CROSSING = 1e-3
CHECKED_POINTS = 1000  # of curves without points
LEAST_CHECKED = 1e-3  # of the greatest intensity: the first of these points, if curves begin at 0


def check_order(what: str, curves: CurveSet) -> None:
    """Raise a ValueError if the median of a damage state is below that of a lighter state."""
    for i in np.flatnonzero(np.diff(curves.median) < 0):
        raise ValueError(
            f"{what}: the medians of {curves.names[i]!r} and {curves.names[i + 1]!r} fall, {curves.median[i]:.4g} and "
            f"{curves.median[i + 1]:.4g} {curves.units}: damage states must be in order from the lightest to the "
            "heaviest"
        )


def check_exceedance(what: str, curves: CurveSet, levels: np.ndarray, probability: np.ndarray) -> None:
    """Raise a ValueError unless probabilities rise with the intensity and the curves do not cross.

    Args:
        what: The curves in words, for messages.
        curves: The curves.
        levels: Intensities.
        probability: Probability of exceedance, shape [damage_state, level].
    """
    states, units = curves.names, curves.units
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
