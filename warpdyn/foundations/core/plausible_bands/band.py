"""What a band of usual values is, and the units that are often given in place of ours."""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import dataclass

import numpy as np

from warpdyn.foundations.core.units import STANDARD_GRAVITY

MOST_MISTAKES = 2  # told of one value with what it would be
MOST_NAMED = 3  # told of a value that no mistake explains


@dataclass(frozen=True)
class Band:
    """What is usual of a quantity.

    Args:
        words: The quantity in words.
        units: The unit that it is taken in.
        low: Least usual value.
        high: Largest usual value.
        mistakes: Likely mistakes, each a clause, and the factor that takes the value to what was then meant; None where
            no factor undoes the mistake.
        typical: Value that the likeliest mistakes lead to; None for the middle of the band.
    """

    words: str
    units: str
    low: float
    high: float
    mistakes: Mapping[str, float | None]
    typical: float | None = None

    def finding(self, value: float, where: str, high: float) -> str:
        """Return a sentence on a value outside the band: the quantity, the unit it was taken in, likely mistakes."""
        usual = f"at most {high:.4g}" if self.low == 0 else f"{self.low:g} to {high:.4g}"
        meant = {clause: value * factor for clause, factor in self.mistakes.items() if factor is not None}
        others = [clause for clause, factor in self.mistakes.items() if factor is None]
        fitting = {clause: m for clause, m in meant.items() if self.low <= m <= high}
        middle = self.typical or (np.sqrt(self.low * high) if self.low > 0 else high)
        likely = sorted(fitting, key=lambda clause: abs(np.log(fitting[clause] / middle)))[:MOST_MISTAKES]
        told = [f"{clause}, it would be {fitting[clause]:.3g}{self._unit}" for clause in likely] + others
        if value == 0 and meant:
            told = ["in any unit it is zero"]
        elif not told:
            told = [f"no usual mistake alone explains it ({', '.join(list(meant)[:MOST_NAMED])})"]
        return f"{self.words}{where} is {value:.6g}{self._unit} (usual: {usual}{self._unit}): {', or '.join(told)}"

    @property
    def _unit(self) -> str:
        return "" if self.units == "1" else f" {self.units}"


Mistakes = dict[str, float | None]
# Units that are often given in place of ours, each with what it is of ours.
LENGTH = {"mm": 1e-3, "cm": 1e-2, "feet": 0.3048}
TIME = {"ms": 1e-3}
FORCE = {"kN": 1e3, "MN": 1e6, "kg": STANDARD_GRAVITY, "tonnes": 1e3 * STANDARD_GRAVITY}
STIFFNESS = {"kN/m or N/mm": 1e3, "kN/mm or MN/m": 1e6}
MASS = {"tonnes": 1e3, "kN of weight": 1e3 / STANDARD_GRAVITY}
ACCELERATION = {"g": STANDARD_GRAVITY, "cm/s2 (gal)": 1e-2, "mm/s2": 1e-3, "% g": STANDARD_GRAVITY / 100}
# Of recorded horizontal components hardly one goes beyond 2 g: 2.7 g at Tsukidate in 2011 (K-NET, MYG004).
LARGEST_RECORDED = 2 * STANDARD_GRAVITY
TAKEN_FOR_G = {"given in m/s2 and taken for g": 1 / STANDARD_GRAVITY}
IN_PERCENT = {"percent": 1e-2}


def with_units(what: str, units: Mapping[str, float], power: float = 1.0) -> Mistakes:
    """Return the mistakes of giving an input in other units, of a quantity that goes by a power of this input."""
    return {f"with {what} given in {unit}": factor**power for unit, factor in units.items()}


def given_in(units: Mapping[str, float]) -> Mistakes:
    """Return the mistakes of giving the quantity itself in other units."""
    return {f"given in {unit}": factor for unit, factor in units.items()}


def given_one_in(units: Mapping[str, float]) -> Mistakes:
    """Return the mistakes of giving one value of several in other units, of the ratio of the larger to the smaller."""
    return {f"with one given in {unit}": 1 / factor for unit, factor in units.items() if factor > 10}
