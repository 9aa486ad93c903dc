"""Stripes of force levels: force histories of several levels, such as mean wind speeds."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass
from typing import TYPE_CHECKING, Any

import numpy as np
from numpy.typing import ArrayLike

from warpdyn.foundations.core.checks import checked_text, shortened, whole_number
from warpdyn.foundations.core.description import NAMED_BY_SHAPE
from warpdyn.foundations.core.near_misses import with_suggestions
from warpdyn.foundations.core.output_variables import MEASURE
from warpdyn.model.ground_motions.excitation import Assignment, Excitation
from warpdyn.model.ground_motions.forces import ForceHistory
from warpdyn.model.ground_motions.intensities import checked_levels

if TYPE_CHECKING:
    from warpdyn.model.structures.structure import Structure


EXAMPLES = {"quantity": "mean wind speed", "units": "m s-1"}


def _is_row(value: object) -> bool:
    return isinstance(value, list | tuple)


@with_suggestions
@dataclass(frozen=True, eq=False, repr=False)
class ForceStripes(Excitation):
    """Force histories of several levels of an intensity, such as a mean wind speed; each level has its own histories.

    Crossed design: every history acts on every structure. Nested design (`structures_per_history=3`): the first 3
    structures are under the first history of every level, the next 3 under the second, and so on.

    `wd.fragility` of a run is a function of the level; its intervals contain the variability among the histories of a
    level.

    Args:
        histories: One list of force histories per level.
        levels: Levels of the intensity [units], increasing, shape [im_level].
        quantity: Name of the intensity.
        units: Units of the levels.
        structures_per_history: Number of structures per history (nested design; the levels must have equal numbers of
            histories); None: crossed design.

    Raises:
        ValueError: If the numbers of lists and of levels differ, a list is empty, levels are not above 0 and
            increasing, or histories have different numbers of degrees of freedom or an initial state.
        TypeError: If a history is not a ForceHistory, or `quantity` or `units` is not text.

    Example:
        >>> push = [wd.ForceHistory([[0.0, 0.0], [1e4, size], [0.0, 0.0]], step=0.1) for size in (1e4, 2e4, 4e4)]
        >>> design = wd.ForceStripes([[push[0]], [push[1], push[2]]], [10.0, 20.0], "impact speed", "m s-1")
        >>> design.samples_per_structure
        3
    """

    histories: Sequence[Sequence[ForceHistory]]
    levels: ArrayLike
    quantity: str = "mean wind speed"
    units: str = "m s-1"
    structures_per_history: int | None = None

    kernel_load = "force_history"
    is_force = True

    def __post_init__(self) -> None:
        for name in ("quantity", "units"):
            if not checked_text(f"ForceStripes.{name}", getattr(self, name)):
                raise ValueError(f"ForceStripes.{name} is empty: give, for example, {EXAMPLES[name]!r}")
        levels = checked_levels(self.levels, self.units)
        if not _is_row(self.histories) or not all(_is_row(each) for each in self.histories):
            raise TypeError(
                "ForceStripes.histories must be one list of ForceHistory per level, such as [[first], [second, third]] "
                f"for two levels, got {shortened(self.histories)}"
            )
        histories = tuple(tuple(each) for each in self.histories)
        if len(histories) != levels.size:
            raise ValueError(
                f"ForceStripes has {len(histories)} lists of histories and {levels.size} levels: give one list of "
                "ForceHistory per level"
            )
        first: ForceHistory | None = None
        for place, of_level in enumerate(histories):
            if not of_level:
                raise ValueError(
                    f"histories[{place}] is empty: give at least one ForceHistory for level {levels[place]:g}"
                )
            for each in of_level:
                if not isinstance(each, ForceHistory):
                    raise TypeError(f"histories[{place}] must contain ForceHistory, got {type(each).__name__}")
                first = each if first is None else first
                if each.values.shape[1] != first.values.shape[1]:
                    raise ValueError(
                        f"histories[{place}] has a history with {each.values.shape[1]} degrees of freedom, but the "
                        f"first history has {first.values.shape[1]}: give all the same"
                    )
                if np.any(each.start[0]) or np.any(each.start[1]):
                    raise ValueError(
                        f"histories[{place}] has a history with an initial state: ForceStripes start at rest; remove "
                        "initial_displacement= and initial_velocity="
                    )
        if self.structures_per_history is not None:
            own = whole_number("structures_per_history", self.structures_per_history, 1)
            object.__setattr__(self, "structures_per_history", own)
            if len({len(each) for each in histories}) > 1:
                raise ValueError(
                    "structures_per_history needs the same number of histories for each level, got "
                    f"{[len(each) for each in histories]}: give equal numbers, or remove structures_per_history="
                )
        object.__setattr__(self, "histories", histories)
        object.__setattr__(self, "levels", levels)

    def __repr__(self) -> str:
        counts = sorted({len(each) for each in self.histories})
        each = str(counts[0]) if len(counts) == 1 else f"{counts[0]} to {counts[-1]}"
        return f"ForceStripes({np.size(self.levels)} levels of {self.quantity} [{self.units}], {each} histories each)"

    @property
    def motions(self) -> tuple[ForceHistory, ...]:
        """All force histories, in the order of the levels."""
        return tuple(each for of_level in self.histories for each in of_level)

    def told(self) -> list[tuple[object, ...]]:
        """Return the rows of the table that notebooks show."""
        return [
            (f"{self.quantity} [{self.units}]", self.levels),
            ("histories per level", [len(each) for each in self.histories]),
            ("structures per history", self.structures_per_history or "all"),
        ]

    def description(self) -> dict[str, Any]:
        """Return the design as a dictionary, for the JSON of its scene; the histories are named by their number."""
        counts = [len(each) for each in self.histories]
        told: dict[str, Any] = {"type": type(self).__name__, "histories": f"{NAMED_BY_SHAPE}({sum(counts)},)"}
        told |= {"levels": self.levels, "quantity": self.quantity, "units": self.units}
        return told | {"structures_per_history": self.structures_per_history, "histories_per_level": counts}

    @property
    def is_same_for_all(self) -> bool:  # type: ignore[override] # an attribute of the base class
        """Whether the samples of all structures have the same force histories (crossed design)."""
        return self.structures_per_history is None

    @property
    def samples_per_structure(self) -> int:
        """Number of samples per structure: all histories (crossed design), or one per level (nested design)."""
        return len(self.motions) if self.structures_per_history is None else len(self.histories)

    @property
    def structures_given(self) -> int:
        """Number of structures in a nested design; 0 in a crossed design, where `simulate` gets the number."""
        return len(self.histories[0]) * (self.structures_per_history or 0)

    def check_structures(self, structures: int) -> None:
        """Raise a ValueError if the design is nested and needs another number of structures than `structures`."""
        if self.structures_per_history is not None and structures != self.structures_given:
            raise ValueError(
                f"{len(self.histories[0])} histories per level with structures_per_history="
                f"{self.structures_per_history} have {self.structures_given} structures, got structures={structures}: "
                "remove structures="
            )

    def check_fits(self, structure: Structure) -> None:
        """Raise a ValueError if the histories do not fit the structure's degrees of freedom."""
        self.histories[0][0].check_fits(structure)

    def assign(self, structures: np.ndarray, seed: int, event: int = 0) -> Assignment:
        """Return structure, force history and level of each sample, for the structures with the given indices."""
        index = np.asarray(structures, dtype=np.int32)
        counts = np.array([len(each) for each in self.histories])
        if self.structures_per_history is None:
            motion = np.tile(np.arange(counts.sum(), dtype=np.int32), index.size)
            level = np.tile(np.repeat(np.arange(counts.size), counts), index.size)
        else:
            level = np.tile(np.arange(counts.size), index.size)
            own = np.repeat(index // np.int32(self.structures_per_history), counts.size)
            motion = (level * counts[0] + own).astype(np.int32)
        structure = np.repeat(index, self.samples_per_structure)
        label: dict[str, Any] = {MEASURE: self.quantity}
        values = np.asarray(self.levels)[level]
        return Assignment(structure, motion, np.ones(structure.size), values, label, self.units, is_striped=True)

    def modal_load(self, shape: np.ndarray, momentum: np.ndarray, influence: np.ndarray) -> np.ndarray:
        """Return the modal loads of a unit force on each degree of freedom, shape [structure, dof, mode]."""
        return shape
