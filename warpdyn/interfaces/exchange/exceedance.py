"""Checks of fragility curves before a function writes them to a file for another program."""

from __future__ import annotations

import numpy as np

from warpdyn.answers.risk.curves.curve_set import CurveSet

# Two lognormal curves with different dispersions cross at some intensity. Beyond it, a program that subtracts the
# curves of successive damage states gets a negative share of buildings. An error is raised if a negative share exceeds
# this limit in size.
LARGEST_CROSSING = 1e-3
CHECKED_POINTS = 1000  # number of intensities at which continuous curves are checked
LEAST_CHECKED = 1e-3  # lowest checked intensity divided by the highest one, for curves that begin at intensity 0


def check_order(what: str, curves: CurveSet) -> None:
    """Raise a ValueError if the median capacity of a damage state is below the median of a lighter state."""
    for i in np.flatnonzero(np.diff(curves.median) < 0):
        raise ValueError(
            f"{what}: the median of {curves.names[i + 1]!r} ({curves.median[i + 1]:.4g} {curves.units}) is below the "
            f"median of {curves.names[i]!r} ({curves.median[i]:.4g} {curves.units}): sort the damage states with the "
            "lightest first"
        )


def check_exceedance(what: str, curves: CurveSet, levels: np.ndarray, probability: np.ndarray) -> None:
    """Raise a ValueError if a fragility curve falls with the intensity, leaves 0 to 1, or crosses the next curve.

    Args:
        what: Text that names the curves in error messages.
        curves: The fragility curves, with the names of the damage states and the unit of the intensity.
        levels: Intensities at which the curves are checked, shape [level].
        probability: Probability of exceeding each damage state at each intensity, shape [damage_state, level].
    """
    states, units = curves.names, curves.units
    for state, values in zip(states, probability, strict=True):
        for level, value in zip(levels, values, strict=True):
            if not 0 <= value <= 1:  # NaN too
                raise ValueError(
                    f"{what}: the probability of exceeding {state!r} is {value:g} at {level:g} {units}; it must be "
                    "from 0 to 1: correct the curves"
                )
        for i in np.flatnonzero(np.diff(values) < 0):
            raise ValueError(
                f"{what}: the probability of exceeding {state!r} falls from {values[i]:.4g} at {levels[i]:g} {units} "
                f"to {values[i + 1]:.4g} at {levels[i + 1]:g} {units}: correct the curves, or give "
                "write_nrml_fragility(intensities=[...]) to write the fitted curves instead of the stripe fractions"
            )
    for lighter in range(len(states) - 1):
        excess = probability[lighter + 1] - probability[lighter]
        worst = int(np.argmax(excess))
        if excess[worst] > LARGEST_CROSSING:
            raise ValueError(
                f"{what}: the curves of {states[lighter]!r} and {states[lighter + 1]!r} cross: at {levels[worst]:.4g} "
                f"{units} the probability of exceeding the heavier state is {probability[lighter + 1, worst]:.4g}, "
                f"that of the lighter state {probability[lighter, worst]:.4g}. The share of buildings in the lighter "
                f"state would be negative (beyond -{LARGEST_CROSSING:g}). Give both states the same dispersion, or "
                "choose a range of intensities in which the curves do not cross, by intensities= (discrete) or "
                "minimum_intensity= and maximum_intensity= (continuous) of write_nrml_fragility()"
            )
