"""Sequences of earthquakes, such as a mainshock and aftershocks that act on the damaged building."""

from __future__ import annotations

import math
from collections.abc import Mapping
from dataclasses import dataclass, replace
from typing import TYPE_CHECKING

import numpy as np

from warpdyn.foundations.core.frozen_values import FrozenMapping
from warpdyn.foundations.core.near_misses import with_suggestions
from warpdyn.model.ground_motions.designs import excitation_of
from warpdyn.model.ground_motions.excitation import Assignment, Excitation
from warpdyn.model.ground_motions.motions import GroundMotion

if TYPE_CHECKING:
    from warpdyn.model.structures.structure import Structure


class _Placed(Excitation):
    """Base class of EventSequence, with the fields that are computed from its arguments."""

    _designs: tuple[Excitation, ...]  # design of each event
    _places: list[np.ndarray]  # for each event, the indices of its motions in `motions`


@with_suggestions
@dataclass(frozen=True, eq=False, repr=False)
class EventSequence(_Placed):
    """Successive earthquakes (events); each acts on the building in the damaged state after the previous event.

    Displacements, velocities and the state of the storey laws are kept from one event to the next. Between events, the
    building vibrates freely for the scene's `tail`; if `tail` is None, until it is at rest. Every history of an event
    is continued with all motions (and levels) of the next event. Samples are ordered by structure, then by motion (and
    level) of the first event, then by motion (and level) of the second event, and so on. If a building collapses or its
    integration fails, later events are not run on it, and it keeps this status.

    Args:
        events: Name of the event -> its motions, at least two events, such as `{"mainshock": Stripes(...),
            "aftershock": Cloud(...)}`. Motions are Stripes, Cloud, OneMotionPerStructure or one GroundMotion.

    Raises:
        ValueError, TypeError: If there are fewer than two events, a name is not text, or the motions of an event are of
            another class.

    Example:
        >>> design = wd.EventSequence({"mainshock": stripes, "aftershock": wd.Cloud(motions[:2])})
        >>> design.samples_per_structure
        96
    """

    events: Mapping[str, Excitation | GroundMotion]

    def __post_init__(self) -> None:
        if not isinstance(self.events, Mapping):
            raise TypeError(
                f"EventSequence.events must map each event's name to its design, such as {{'mainshock': design, "
                f"'aftershock': design}}, got {self.events!r}"
            )
        if len(self.events) < 2:
            raise ValueError(
                f"an EventSequence has at least two events, got {len(self.events)}: give a single design to Scene"
            )
        designs = {}
        for name, design in self.events.items():
            if not isinstance(name, str) or not name:
                raise TypeError(f"an event's name must be text, such as 'mainshock', got {name!r}")
            excitation = excitation_of(design)
            if not isinstance(excitation, Excitation) or not excitation.is_design:
                raise TypeError(
                    f"event {name!r} must be Stripes, Cloud, OneMotionPerStructure or a GroundMotion, "
                    f"got {type(design).__name__}"
                )
            designs[name] = excitation
        counts = {name: design.base_components for name, design in designs.items()}
        if len(set(counts.values())) > 1:
            said = ", ".join(f"{name!r} has {count}" for name, count in counts.items())
            raise ValueError(f"all events need motions with the same number of components, but {said}")
        object.__setattr__(self, "events", FrozenMapping(designs))
        object.__setattr__(self, "_designs", tuple(designs.values()))
        # A motion that several events use is stored once.
        motions = list(dict.fromkeys(motion for design in designs.values() for motion in design.motions))
        place = {motion: index for index, motion in enumerate(motions)}
        places = [np.array([place[m] for m in design.motions], dtype=np.int32) for design in designs.values()]
        object.__setattr__(self, "motions", tuple(motions))
        object.__setattr__(self, "_places", places)

    def __repr__(self) -> str:
        return f"EventSequence({', '.join(f'{name}: {design!r}' for name, design in self.events.items())})"

    def told(self) -> list[tuple[object, ...]]:
        """Return the rows of the table that notebooks show for the sequence, one row per event."""
        return [(name, repr(design)) for name, design in self.events.items()]

    @property
    def event_names(self) -> tuple[str, ...]:
        """Names of the events of the sequence, in the order in which they occur."""
        return tuple(self.events)

    @property
    def samples_by_event(self) -> tuple[int, ...]:
        """Number of response histories per structure in each event, shape [event]."""
        counts = [design.samples_per_structure for design in self._designs]
        return tuple(math.prod(counts[: event + 1]) for event in range(len(counts)))

    @property
    def samples_per_structure(self) -> int:
        """Number of response histories per structure in the last event."""
        return self.samples_by_event[-1]

    def check_structures(self, structures: int) -> None:
        """Raise a ValueError if an event lists values for another number of structures than `structures`."""
        for name, design in zip(self.events, self._designs, strict=True):
            try:
                design.check_structures(structures)
            except ValueError as error:
                raise ValueError(f"event {name!r}: {error}") from None

    @property
    def structures_given(self) -> int:
        """Number of structures for which an event lists values; 0 if no event lists values."""
        return max(design.structures_given for design in self._designs)

    @property
    def base_components(self) -> int:
        """Number of components of each motion."""
        return self._designs[0].base_components

    def check_fits(self, structure: Structure) -> None:
        """Raise a TypeError for a LinearSystem: an earthquake does not change it, so that a sequence is useless."""
        if not structure.can_yield:
            raise TypeError(
                "an EventSequence needs a ShearBuilding, because an earthquake does not change a LinearSystem: run "
                "each event separately"
            )

    def assign(self, structures: np.ndarray, seed: int, event: int = 0) -> Assignment:
        """Return structure, motion and scale factor of each sample in the event with index `event`, from 0."""
        assignment = self._designs[event].assign(structures, seed, event)
        return replace(assignment, motion=self._places[event][assignment.motion])
