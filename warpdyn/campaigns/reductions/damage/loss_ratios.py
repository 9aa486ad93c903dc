"""Loss ratios of damage states (loss divided by replacement value), and checks of loss ratios."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from dataclasses import dataclass
from typing import cast

import numpy as np
from scipy.special import betaincc

from warpdyn.foundations.core.checks import real_number

Ratios = Mapping[str, float | tuple[float, float]]


@dataclass(frozen=True, eq=False)
class LossRatios:
    """Loss ratios of damage states; the loss ratio in each state has a beta distribution.

    Args:
        mean: Mean loss ratio [1], shape [damage_state].
        deviation: Standard deviation of the loss ratio [1], shape [damage_state]; 0: the ratio is certain.
    """

    mean: np.ndarray
    deviation: np.ndarray

    def exceeding(self, ratio: float) -> np.ndarray:
        """Return, for each state, the probability that the loss ratio is above `ratio`, shape [damage_state]."""
        certain = self.deviation == 0
        mean, variance = np.where(certain, 0.5, self.mean), np.where(certain, 0.05, self.deviation) ** 2
        size = mean * (1 - mean) / variance - 1
        return np.where(certain, self.mean > ratio, betaincc(mean * size, (1 - mean) * size, min(max(ratio, 0.0), 1.0)))


def checked_ratios(function: str, ratios: Ratios, states: Sequence[str], where: str = "") -> LossRatios:
    """Return the loss ratios of damage states, or raise an error that names the state.

    Args:
        function: Name of the public function, for messages.
        ratios: Loss ratio of each state: its mean [1], or (mean, coefficient of variation).
        states: The damage states, from the lightest to the heaviest.
        where: Text that identifies the archetype in messages.

    Raises:
        TypeError: If `ratios` is not a mapping.
        ValueError: If a state is missing or unknown, a mean is not between 0 and 1 or falls from one state to the next,
            or a coefficient of variation is negative or too large for a beta distribution.
    """
    if not isinstance(ratios, Mapping):
        raise TypeError(
            f"{function}: loss_ratios{where} must map each damage state to its loss ratio, such as {{'slight': 0.02}}, "
            f"got {ratios!r}"
        )
    _check_named(function, f"loss_ratios{where}", "damage states", states, ratios)
    means: list[float] = []
    deviations: list[float] = []
    for state in states:
        given = ratios[state]
        what = f"{function}: loss ratio of {state!r}{where}"
        if isinstance(given, Sequence) and not isinstance(given, str):
            if len(given) != 2:
                raise ValueError(
                    f"{what} must be a mean, such as 0.1, or a mean and a coefficient of variation, such as (0.1, "
                    f"0.5), got {given!r}"
                )
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
            raise ValueError(
                f"{what} is {mean:g}, below that of the lighter state before it ({means[-1]:g}): correct the ratios, "
                "or sort the damage states with the lightest first"
            )
        means.append(mean)
        deviations.append(variation * mean)
    return LossRatios(np.array(means), np.array(deviations))


def ratios_of_archetypes(
    function: str, names: Sequence[str], states: Sequence[str], given: Ratios | Mapping[str, Ratios]
) -> list[LossRatios]:
    """Return the loss ratios of each archetype of a portfolio, as a list in the order of `names`.

    Args:
        function: Name of the public function, for messages.
        names: Names of the archetypes.
        states: The damage states, from the lightest to the heaviest.
        given: Loss ratios by damage state, which apply to all archetypes; or such mappings by archetype.
    """
    if not isinstance(given, Mapping):
        raise TypeError(
            f"{function}: loss_ratios must map damage states to loss ratios, such as {{'slight': 0.02}}, or archetypes "
            f"to such mappings, got {given!r}"
        )
    if not any(isinstance(each, Mapping) for each in given.values()):
        return [checked_ratios(function, cast("Ratios", given), states)] * len(names)
    check_archetypes(function, names, given, "loss_ratios")
    own = cast("Mapping[str, Ratios]", given)
    return [checked_ratios(function, own[name], states, f" of archetype {name!r}") for name in names]


def check_archetypes(function: str, names: Sequence[str], given: Mapping[str, object], what: str) -> None:
    """Raise a ValueError unless the keys of a mapping are exactly the names of all archetypes."""
    _check_named(function, what, "archetypes", names, given)


def _check_named(function: str, what: str, kind: str, names: Sequence[str], given: Mapping[str, object]) -> None:
    """Raise a ValueError that lists missing and unknown keys, unless the keys of `given` are exactly `names`."""
    missing = [name for name in names if name not in given]
    unknown = [str(name) for name in given if name not in names]
    if missing or unknown:
        raise ValueError(
            f"{function}: {what} must name the {kind} {', '.join(names)}"
            + (f"; {', '.join(missing)} missing" if missing else "")
            + (f"; {', '.join(unknown)} unknown" if unknown else "")
        )
