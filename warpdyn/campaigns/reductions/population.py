"""Structures, archetypes, motions, stripes and events of a run's samples, by which statistics group them."""

from __future__ import annotations

from dataclasses import dataclass
from functools import cached_property
from numbers import Integral

import numpy as np

from warpdyn.engine.kernels.output_table import RECORDERS
from warpdyn.foundations.core.output_variables import DRIFT_RATIO, MEASURE, Variable, label_of_levels
from warpdyn.foundations.core.units import unit_attributes
from warpdyn.model.ground_motions.designs import Cloud, Stripes
from warpdyn.model.ground_motions.event_sequences import EventSequence
from warpdyn.model.ground_motions.excitation import Excitation
from warpdyn.model.ground_motions.motions_at_sites import MotionsAtSites
from warpdyn.model.scene.portfolio import Portfolio
from warpdyn.model.scene.scene import Scene
from warpdyn.model.structures.shear_building import ShearBuilding
from warpdyn.model.structures.structure import Structure

MOST_GROUPS = 64  # of structures; with more, the variance among records would still not be known better


def group_numbers(structures: int, sampling: str) -> np.ndarray:
    """Return the number of the group of each structure, from 0; a jackknife leaves out one group at a time.

    Independent structures are assigned to the groups one after the other. Structures of a Sobol sequence stay in
    blocks of 2^k consecutive points, because each such block covers the parameter space evenly.

    Args:
        structures: How many structures there are.
        sampling: How they were sampled, as `Scene.sampling`.
    """
    number = np.arange(structures)
    if sampling == "sobol":
        together = 2 ** int(np.log2(structures) / 2)
        return number // max(together, -(-structures // MOST_GROUPS))
    return number % min(structures, MOST_GROUPS)


@dataclass(frozen=True, eq=False)
class Population:
    """The structures, motions and levels of a run's samples.

    Args:
        scene: The scene.
        structures: Number of its structures, or of a portfolio's buildings.
    """

    scene: Scene
    structures: int

    @property
    def structure_dim(self) -> str:
        """Dimension of the structures."""
        return "structure" if self.portfolio is None else "building"

    @property
    def portfolio(self) -> Portfolio | None:
        """The portfolio; None for a scene of one structure."""
        return self.scene.structure if isinstance(self.scene.structure, Portfolio) else None

    @cached_property
    def archetype(self) -> np.ndarray:
        """Number of the archetype of each structure; 0 without archetypes."""
        if self.portfolio is None:
            return np.zeros(self.structures, dtype=np.int32)
        return np.repeat(np.arange(len(self.portfolio.counts), dtype=np.int32), self.portfolio.counts)

    @cached_property
    def group(self) -> np.ndarray:
        """Jackknife group of each structure; each archetype of a portfolio has groups from 0."""
        if not self.is_crossed:
            return np.zeros(self.structures, dtype=np.int64)
        if self.portfolio is None:
            return group_numbers(self.structures, self.scene.sampling_of_structures)
        return np.concatenate([group_numbers(int(count), "") for count in self.portfolio.counts])

    @cached_property
    def designs(self) -> list[Excitation]:
        """The excitation of each event."""
        excitation = self.scene.excitation
        return list(excitation.events.values()) if isinstance(excitation, EventSequence) else [excitation]  # type: ignore[arg-type]  # designs of single motions are wrapped when a sequence is made

    @property
    def is_sequence(self) -> bool:
        """Whether events follow one another."""
        return isinstance(self.scene.excitation, EventSequence)

    @property
    def at_sites(self) -> MotionsAtSites | None:
        """The design, if it is MotionsAtSites; else None."""
        design = self.designs[0]
        return design if isinstance(design, MotionsAtSites) and not self.is_sequence else None

    @cached_property
    def motion_of_place(self) -> np.ndarray | None:
        """Motion of each sample of a structure; None if not all structures have the same motions in the same order."""
        (design, *more) = self.designs
        if more:
            return None
        if isinstance(design, MotionsAtSites):
            at_sites = np.asarray(design.motion)
            is_shared = bool((at_sites == at_sites[:1]).all())
            return at_sites[0, np.asarray(design.earthquake)].ravel() if is_shared else None
        if isinstance(design, Stripes) and not design.own_structures:
            return design.places[0].astype(np.int64)
        return np.arange(len(design.motions)) if isinstance(design, Cloud) else None

    @property
    def motions_by_place(self) -> bool:
        """Whether the motion of a sample depends only on the sample's place among the samples of its structure."""
        return self.motion_of_place is not None

    @property
    def is_crossed(self) -> bool:
        """Whether the same structures run under several motions."""
        return len(self.scene.excitation.motions) > 1 and self.motions_by_place

    def counted_places(self, demand: str, structures: np.ndarray, *, added_storeys: bool) -> tuple[int, int] | None:
        """Return the first storey or floor that counts for a demand, and the one after the last; None: all count.

        Isolators are below the storeys of the building and tuned mass dampers above them, so that the storeys of the
        building itself are consecutive.

        Args:
            demand: The demand; for demands without a value for each storey or floor the result is None.
            structures: Numbers of some structures with the same kinds of storeys.
            added_storeys: Whether isolators and tuned mass dampers count.
        """
        structure: Structure = self.scene.structure
        if self.portfolio is not None:
            kind = int(self.archetype[structures[0]])
            structure = list(self.portfolio.archetypes.values())[kind].building
        is_of_storeys = self.demand(demand).dims in (("storey",), ("floor",))
        if added_storeys or not is_of_storeys or not isinstance(structure, ShearBuilding):
            return None
        own = np.flatnonzero(structure.own_storeys)
        return None if own.size == structure.storeys else (int(own[0]), int(own[-1]) + 1)

    def samples(self, event: int) -> int:
        """Return the number of samples of a structure in an event."""
        return self.scene.excitation.samples_by_event[event]

    def levels_of(self, event: int) -> np.ndarray:
        """Return the levels of an event's stripes [g, or SI units of other measures]; a single 0 without stripes."""
        design = self.designs[event]
        return np.asarray(design.levels, dtype=np.float64) if isinstance(design, Stripes) else np.zeros(1)

    def level_of_places(self, event: int) -> np.ndarray:
        """Return the number of the level of each sample of a structure in an event; 0 without stripes."""
        design, samples = self.designs[event], self.samples(event)
        if isinstance(design, Stripes) and not design.own_structures:
            of_design = design.places[1]  # in a sequence, repeated for each history of the earlier events
            return of_design[np.arange(samples) % of_design.size]
        return np.arange(samples) % self.levels_of(event).size

    @cached_property
    def level_attributes(self) -> dict[str, object]:
        """Attributes of the levels: intensity measure and units."""
        striped = [design for design in self.designs if isinstance(design, Stripes)]
        measures = {design.measure.name: design.measure.attributes() for design in striped}
        units = dict.fromkeys(design.intensity_units for design in striped)
        name = " or ".join(measures)
        own = next(iter(measures.values())) if len(measures) == 1 else {MEASURE: name}
        label: dict[str, object] = {"long_name": label_of_levels(name)}
        return label | own | unit_attributes(" or ".join(units))

    @cached_property
    def demands(self) -> dict[str, Variable]:
        """The demands that the scene records, by name."""
        of_family = RECORDERS[self.scene.structure.family]
        found = {name: each for row in self.scene.recorders for name, each in of_family[row].items() if each.is_demand}
        return found | ({"peak_storey_drift_ratio": DRIFT_RATIO} if "peak_storey_drift" in found else {})

    def demand(self, name: str) -> Variable:
        """Return a demand that the scene records, or raise a ValueError."""
        if name not in self.demands:
            raise ValueError(
                f"statistics: the scene records no {name!r}; it records {', '.join(self.demands) or 'no demand'}: "
                "add the recorder of this demand to the scene, Scene(..., recorders=(...))"
            )
        return self.demands[name]


def numbered_events(events: object, motions: int) -> tuple[np.ndarray, np.ndarray]:
    """Return the number of the event of each motion, and the names of the events in the order of their first use.

    Raises:
        ValueError, TypeError: If the number of events is not that of the motions, names and whole numbers are mixed, or
            a name is empty.
    """
    labels = [] if isinstance(events, str) else list(events)  # type: ignore[call-overload]  # checked here
    if len(labels) != motions:
        given = repr(events) if isinstance(events, str) else f"{len(labels)} events"
        raise ValueError(f"events must contain the event of each of the {motions} motions, got {given}")
    for kind in (str, Integral):
        if all(isinstance(label, kind) and not isinstance(label, bool) for label in labels):
            break
    else:
        raise TypeError(f"events must be names or whole numbers, all of one kind, got {labels[:4]!r}")
    if "" in labels:
        raise ValueError(
            f"events must have names, but that of motion {labels.index('')} is '': name the records, as in "
            "GroundMotion(acceleration, step, record='RSN182')"
        )
    order = {label: i for i, label in enumerate(dict.fromkeys(labels))}
    return np.array([order[label] for label in labels]), np.array(list(order))
