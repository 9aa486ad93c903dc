"""Damage-to-loss ratios: what the repair of each damage state costs, as a share of the replacement value."""

from __future__ import annotations

import functools
from collections.abc import Mapping, Sequence
from dataclasses import dataclass
from types import MappingProxyType

import numpy as np
from scipy.special import betaincc

from warpdyn.core.checks import one_of, real_number
from warpdyn.files.packaged import packaged_rows
from warpdyn.structures.hazus import DAMAGE_STATES

PARTS = ("structural", "drift_sensitive", "acceleration_sensitive")
BUILDING = "building"
Ratios = Mapping[str, float | tuple[float, float]]


@functools.cache
def _hazus_ratios() -> Mapping[str, Mapping[str, float]]:
    """Return the rows of hazus_repair_cost_ratios.csv by occupancy."""
    rows = packaged_rows("hazus_repair_cost_ratios.csv")
    return MappingProxyType({row.pop("occupancy"): {name: float(value) for name, value in row.items()} for row in rows})


def hazus_loss_ratios(occupancy: str, part: str = BUILDING) -> dict[str, float]:
    """Return the repair cost ratios of an occupancy class of FEMA's Hazus, by damage state.

    Hazus gives the means alone. Of the whole building they are the sum over its parts, which are then taken to be in
    the same state: 2 % of the replacement cost in slight damage, 10 % in moderate, some 40 % in extensive and 100 % in
    complete damage. Hazus itself has fragility curves of their own for the parts that do not belong to the structure:
    take a part's ratios with that part's curves, and add the losses.

    Source: FEMA, Hazus Earthquake Model Technical Manual, version 5.1 (Hazus-MH: tables 15.2, 15.3 and 15.4).

    Args:
        occupancy: Occupancy class: "RES1" to "RES6", "COM1" to "COM10", "IND1" to "IND6", "AGR1", "REL1", "GOV1",
            "GOV2", "EDU1" or "EDU2".
        part: "structural", "drift_sensitive", "acceleration_sensitive" (both nonstructural), or "building" for the sum.

    Returns:
        Repair cost over the replacement cost of the building [1] in slight, moderate, extensive and complete damage.

    Raises:
        ValueError: If either is unknown.

    Example:
        >>> wd.hazus_loss_ratios("COM4")["complete"]
        1.0
    """
    one_of("Hazus occupancy class", occupancy, tuple(_hazus_ratios()))
    one_of("part of a building", part, (*PARTS, BUILDING))
    row = _hazus_ratios()[occupancy]
    parts = PARTS if part == BUILDING else (part,)
    # Three decimals are printed; the sum is rounded to them, as 0.234 + 0.5 + 0.266 is not 1 in binary.
    return {state: round(sum(row[f"{each}_{state}"] for each in parts), 3) for state in DAMAGE_STATES}


@dataclass(frozen=True, eq=False)
class LossRatios:
    """Loss ratios of damage states, each with a beta distribution.

    Args:
        mean: Mean loss ratio [1], shape [damage_state].
        deviation: Standard deviation [1], shape [damage_state]; 0 where the ratio is certain.
    """

    mean: np.ndarray
    deviation: np.ndarray

    def exceeding(self, ratio: float) -> np.ndarray:
        """Return the probability in each state that the loss ratio is above a value, shape [damage_state]."""
        certain = self.deviation == 0
        mean, variance = np.where(certain, 0.5, self.mean), np.where(certain, 0.05, self.deviation) ** 2
        size = mean * (1 - mean) / variance - 1
        return np.where(certain, self.mean > ratio, betaincc(mean * size, (1 - mean) * size, min(max(ratio, 0.0), 1.0)))


def checked_ratios(function: str, ratios: Ratios, states: Sequence[str], where: str = "") -> LossRatios:
    """Return the loss ratios of damage states, or raise an error that names the state.

    Args:
        function: The public function.
        ratios: Of each state the mean loss ratio, or mean and coefficient of variation.
        states: The damage states, from the lightest on.
        where: Whose ratios they are, for errors.

    Raises:
        TypeError: If `ratios` is no mapping.
        ValueError: If a state is missing or unknown, a mean is not between 0 and 1 or falls from one state to the next,
            or a coefficient of variation is negative or too large for a beta distribution.
    """
    if not isinstance(ratios, Mapping):
        raise TypeError(f"{function}: loss_ratios{where} must map each damage state to its loss ratio, got {ratios!r}")
    missing = [state for state in states if state not in ratios]
    unknown = [str(state) for state in ratios if state not in states]
    if missing or unknown:
        raise ValueError(
            f"{function}: loss_ratios{where} must name the damage states {', '.join(states)}"
            + (f"; {', '.join(missing)} missing" if missing else "")
            + (f"; {', '.join(unknown)} unknown" if unknown else "")
        )
    means: list[float] = []
    deviations: list[float] = []
    for state in states:
        given = ratios[state]
        what = f"{function}: loss ratio of {state!r}{where}"
        if isinstance(given, Sequence) and not isinstance(given, str):
            if len(given) != 2:
                raise ValueError(f"{what} must be a mean, or mean and coefficient of variation, got {given!r}")
            mean, variation = (real_number(what, value, least=0) for value in given)
        else:
            mean, variation = real_number(what, given, least=0), 0.0
        if mean > 1:
            raise ValueError(f"{what} is {mean:g}; it is a share of the replacement value, at most 1 (2 % is 0.02)")
        largest = np.sqrt((1 - mean) / mean) if mean > 0 else 0.0
        if variation > 0 and variation >= largest:
            raise ValueError(
                f"{what}: a coefficient of variation of {variation:g} is too large for a beta distribution of mean "
                f"{mean:g}; it must be below {largest:.3g}"
            )
        if means and mean < means[-1]:
            raise ValueError(f"{what} is {mean:g}, below that of the lighter state before it ({means[-1]:g})")
        means.append(mean)
        deviations.append(variation * mean)
    return LossRatios(np.array(means), np.array(deviations))
