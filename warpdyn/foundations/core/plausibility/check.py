"""The class of a plausibility check, and the mistakes in units that lead to unusual values.

Impossible values are errors. A plausibility check warns of possible values that users rarely intend, mostly because of
a wrong unit. The range of usual values is wider than in practice; comments give sources. A check of a building also has
a function that computes the checked quantity from a `BuildingView` (warpdyn/model/scene), the table of its parameters.
"""

from __future__ import annotations

from collections.abc import Callable, Mapping
from dataclasses import dataclass
from typing import Any

import numpy as np

from warpdyn.foundations.core.units import STANDARD_GRAVITY

MOST_MISTAKES = 2  # likely mistakes in one warning, each with the value that would be meant
MOST_NAMED = 3  # mistakes that a warning excludes if no mistake explains the value
LEAST_YIELD_DRIFT_RATIO = 7e-5  # top storeys of old Hazus buildings: 9.5e-5; forces in kN lead to at most 5e-5
HIGHEST_HAZARD_SLOPE = 1.7  # of the highest hazard of any site, ln(rate) over ln(intensity)
LIGHTEST_PENTHOUSE = 80.0  # mass of the floor below over that of a top floor; 102 if one is a weight in kN
LARGEST_RECORDED = 2 * STANDARD_GRAVITY  # exceeded only rarely: 2.7 g at Tsukidate in 2011 (K-NET, MYG004)

# Clause that describes a likely mistake -> factor from the given to the intended value. None: no factor corrects the
# mistake. A function: no factor corrects it, and the function returns whether a value may be due to the mistake.
Mistakes = dict[str, float | Callable[[float], bool] | None]
G = STANDARD_GRAVITY
# Units that users give in place of SI units, each with its size in SI units.
LENGTH = {"mm": 1e-3, "cm": 1e-2, "feet": 0.3048}
VELOCITY = {"cm/s": 1e-2, "mm/s": 1e-3}
TIME = {"ms": 1e-3}
FORCE = {"kN": 1e3, "MN": 1e6, "kg": G, "tonnes": 1e3 * G}
STIFFNESS = {"kN/m or N/mm": 1e3, "kN/mm or MN/m": 1e6}
MASS = {"tonnes": 1e3, "kN of weight": 1e3 / G}
ACCELERATION = {"g": G, "cm/s2 (gal)": 1e-2, "mm/s2": 1e-3, "% g": G / 100}
ACCELERATION_IN_G = {unit: size / G for unit, size in ACCELERATION.items() if unit != "g"} | {"m/s2": 1 / G}
PERCENT = {"percent": 1e-2}
DASHPOT = {"kN s/m": 1e3, "MN s/m": 1e6}


@dataclass(frozen=True)
class Check:
    """The plausibility check of one quantity, such as the storey height.

    Args:
        words: The quantity in words.
        units: Unit of the quantity in warpdyn.
        low: Smallest usual value.
        high: Largest usual value; infinity: there is no upper bound.
        mistakes: Likely mistakes, as clause -> factor from the given to the intended value.
        typical: Typical value; the mistakes whose corrected values are nearest to it are named first. None: the
            geometric mean of `low` and `high`.
        of_building: Function that computes the quantity from a `BuildingView`, shape [row]; None: the value is passed
            to the check.
        of_storeys: As `of_building`, for a quantity of storeys, shape [row, storey].
    """

    words: str
    units: str
    low: float
    high: float
    mistakes: Mistakes
    typical: float | None = None
    of_building: Callable[[Any], np.ndarray] | None = None
    of_storeys: Callable[[Any], np.ndarray] | None = None

    def finding(self, value: float, where: str, high: float) -> str:
        """Return a sentence about an implausible value: the value, the usual values and likely mistakes."""
        unit = "" if self.units == "1" else f" {self.units}"
        usual = f"at most {high:.4g}" if self.low == 0 else f"{self.low:g} to {high:.4g}"
        usual = f"at least {self.low:g}" if np.isinf(high) else usual
        meant = {clause: value * factor for clause, factor in self.mistakes.items() if isinstance(factor, float)}
        fitting = {clause: m for clause, m in meant.items() if self.low <= m <= high}
        middle = self.typical or (np.sqrt(self.low * high) if self.low > 0 else high)
        likely = sorted(fitting, key=lambda clause: abs(np.log(fitting[clause] / middle)))[:MOST_MISTAKES]
        reasons = [f"{clause}, it would be {fitting[clause]:.3g}{unit}" for clause in likely]
        for clause, factor in self.mistakes.items():
            if factor is None or (callable(factor) and factor(value)):
                reasons.append(clause)
        if value == 0 and meant:
            reasons = ["it is zero in any unit"]
        elif not reasons:
            excluded = f" alone explains it ({', '.join(list(meant)[:MOST_NAMED])})" if meant else " explains it"
            reasons = [f"no usual mistake{excluded}"]
        return f"{self.words}{where} is {value:.6g}{unit} (usual: {usual}{unit}): {', or '.join(reasons)}"


def given_in(units: Mapping[str, float]) -> Mistakes:
    """Return the mistakes "the checked quantity itself was given in another unit", one per unit."""
    return {f"if given in {unit}": size for unit, size in units.items()}


def with_units(name: str, units: Mapping[str, float], power: float = 1.0) -> Mistakes:
    """Return the mistakes "argument `name` was given in another unit"; the quantity is proportional to name^power."""
    return {f"with {name} given in {unit}": size**power for unit, size in units.items()}


def one_in(units: Mapping[str, float]) -> Mistakes:
    """Return the mistakes "one of several values is in another unit"; the quantity is the larger over the smaller."""
    mistakes: Mistakes = {f"with one given in {unit}": 1 / size for unit, size in units.items() if size > 10}
    return mistakes | {"one of them may be in another unit than the others": None}


def over_highest(units: Mapping[str, float], power: float = 1.0) -> Check:
    """Return the check that compares the rates of a hazard curve with the highest known seismic hazard.

    Args:
        units: Units in which the intensities may have been given by mistake, with their sizes.
        power: The intensity measure is proportional to this power of the ground acceleration.
    """
    mistakes = with_units("intensities", units, HIGHEST_HAZARD_SLOPE / power)
    mistakes |= {"with probabilities in 50 years given as annual rates (see HazardCurve.from_probabilities)": 1 / 50}
    return Check(
        "annual rate of the hazard curve over the highest of any site at the same intensity", "1", 0, 1, mistakes
    )
