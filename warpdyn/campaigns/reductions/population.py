"""Structures, archetypes, motions, stripes and events of a run's samples, by which statistics group the samples."""

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
from warpdyn.model.structures.lumped.structure import LumpedStructure
from warpdyn.model.structures.shear_building import ShearBuilding
from warpdyn.model.structures.structure import Structure

MOST_GROUPS = 64  # most groups of structures; with more groups the variance among records is not known better


def group_numbers(structures: int, sampling: str) -> np.ndarray:
    """Return the group number of each structure, shape [structure]; a jackknife leaves out one group at a time.

    Independent structures are assigned to the groups one after the other. Structures of a Sobol sequence are grouped in
    blocks of
    2^k consecutive points, because each such block covers the parameter space evenly.

    Args:
        structures: Number of structures.
        sampling: How the structures were sampled, such as "sobol"; see `Scene.sampling`.
    """
    number = np.arange(structures)
    if sampling == "sobol":
        together = 2 ** int(np.log2(structures) / 2)
        return number // max(together, -(-structures // MOST_GROUPS))
    return number % min(structures, MOST_GROUPS)


@dataclass(frozen=True, eq=False)
class Population:
    """Structures, motions, levels and events of a run's samples.

    Args:
        scene: Scene of the run.
        structures: Number of structures of the scene, or of buildings of the portfolio.
    """

    scene: Scene
    structures: int

    @property
    def structure_dim(self) -> str:
        """Name of the dimension of the structures: "structure", or "building" in a portfolio."""
        return "structure" if self.portfolio is None else "building"

    @property
    def portfolio(self) -> Portfolio | None:
        """The portfolio; None for a scene of one structure."""
        return self.scene.structure if isinstance(self.scene.structure, Portfolio) else None

    @cached_property
    def archetype(self) -> np.ndarray:
        """Number of the archetype of each structure, shape [structure]; 0 for a scene of one structure."""
        if self.portfolio is None:
            return np.zeros(self.structures, dtype=np.int32)
        return np.repeat(np.arange(len(self.portfolio.counts), dtype=np.int32), self.portfolio.counts)

    @cached_property
    def group(self) -> np.ndarray:
        """Jackknife group of each structure, shape [structure]; in each archetype of a portfolio, groups start at 0."""
        if not self.is_crossed:
            return np.zeros(self.structures, dtype=np.int64)
        if self.portfolio is None:
            return group_numbers(self.structures, self.scene.sampling_of_structures)
        return np.concatenate([group_numbers(int(count), "") for count in self.portfolio.counts])

    @cached_property
    def designs(self) -> list[Excitation]:
        """The excitation of each event, such as Stripes or Cloud."""
        excitation = self.scene.excitation
        return list(excitation.events.values()) if isinstance(excitation, EventSequence) else [excitation]  # type: ignore[arg-type]  # designs of single motions are wrapped when a sequence is made

    @property
    def is_sequence(self) -> bool:
        """Whether the excitation is an EventSequence, whose events follow one another."""
        return isinstance(self.scene.excitation, EventSequence)

    @property
    def at_sites(self) -> MotionsAtSites | None:
        """The excitation, if it is MotionsAtSites; otherwise None."""
        design = self.designs[0]
        return design if isinstance(design, MotionsAtSites) and not self.is_sequence else None

    @cached_property
    def motion_of_place(self) -> np.ndarray | None:
        """Index of the motion of each sample of a structure, shape [sample]; None if it differs between structures."""
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
        """Whether the motion of a sample depends only on its position among the samples of its structure."""
        return self.motion_of_place is not None

    @property
    def is_crossed(self) -> bool:
        """Whether the same structures run under several motions (crossed design)."""
        return len(self.scene.excitation.motions) > 1 and self.motions_by_place

    def counted_places(self, demand: str, structures: np.ndarray, *, added_storeys: bool) -> tuple[int, int] | None:
        """Return the range of storeys or floors that count for a demand, as (first, last + 1); None: all count.

        Isolators are below the storeys of the building and tuned mass dampers are above them, so the storeys of the
        building itself are consecutive.

        Args:
            demand: Name of the demand; for a demand without a value for each storey or floor the result is None.
            structures: Numbers of structures, which must all have the same kinds of storeys.
            added_storeys: Whether storeys of isolators and tuned mass dampers count.
        """
        structure: Structure = self.scene.structure
        if self.portfolio is not None:
            kind = int(self.archetype[structures[0]])
            structure = list(self.portfolio.archetypes.values())[kind].building
        dims = self.demand(demand, each_period=True).dims
        if "period" in dims:
            return None  # each place has its own value
        if isinstance(structure, LumpedStructure) and dims and dims != ("storey",) and not added_storeys:
            counted = np.flatnonzero(structure.kinds.of_building(dims[0]))
            if counted.size == structure.length_along(dims[0]):
                return None
            if counted[-1] + 1 - counted[0] > counted.size:
                raise ValueError(
                    f"statistics: equipment, absorbers, soil or contacts are between the other places along "
                    f"{dims[0]!r}, so that {demand} cannot be reduced during the run: simulate without statistics, or "
                    "give added_storeys=True"
                )
            return int(counted[0]), int(counted[-1]) + 1
        is_of_storeys = dims in (("storey",), ("floor",))
        if added_storeys or not is_of_storeys or not isinstance(structure, ShearBuilding):
            return None
        own = np.flatnonzero(structure.own_storeys)
        return None if own.size == structure.storeys else (int(own[0]), int(own[-1]) + 1)

    def samples(self, event: int) -> int:
        """Return the number of samples of one structure in event number `event`."""
        return self.scene.excitation.samples_by_event[event]

    def levels_of(self, event: int) -> np.ndarray:
        """Return the levels of an event's stripes [g, or SI units of other measures]; [0] if it has no stripes."""
        design = self.designs[event]
        return np.asarray(design.levels, dtype=np.float64) if isinstance(design, Stripes) else np.zeros(1)

    def level_of_places(self, event: int) -> np.ndarray:
        """Return the number of the level of each sample of a structure in an event, shape [sample]; 0: no stripes."""
        design, samples = self.designs[event], self.samples(event)
        if isinstance(design, Stripes) and not design.own_structures:
            of_design = design.places[1]  # in a sequence, these samples repeat for each history of earlier events
            return of_design[np.arange(samples) % of_design.size]
        return np.arange(samples) % self.levels_of(event).size

    @cached_property
    def level_attributes(self) -> dict[str, object]:
        """Attributes of the levels for the dataset: long name, intensity measure and units."""
        striped = [design for design in self.designs if isinstance(design, Stripes)]
        measures = {design.measure.name: design.measure.attributes() for design in striped}
        units = dict.fromkeys(design.intensity_units for design in striped)
        name = " or ".join(measures)
        own = next(iter(measures.values())) if len(measures) == 1 else {MEASURE: name}
        label: dict[str, object] = {"long_name": label_of_levels(name)}
        return label | own | unit_attributes(" or ".join(units))

    @cached_property
    def demands(self) -> dict[str, Variable]:
        """The demands that the scene's recorders record, by name."""
        of_family = RECORDERS[self.scene.structure.family]
        found = {name: each for row in self.scene.recorders for name, each in of_family[row].items() if each.is_demand}
        return found | ({"peak_storey_drift_ratio": DRIFT_RATIO} if "peak_storey_drift" in found else {})

    def length_along(self, dim: str) -> int:
        """Return the length of a dimension of recorded variables, such as "storey" or "period"."""
        spectra = self.scene.floor_spectra
        return len(spectra.periods) if dim == "period" and spectra else self.scene.structure.length_along(dim)

    def demand(self, name: str, *, added_storeys: bool = False, each_period: bool = False) -> Variable:
        """Return the demand of this name; raise a ValueError if it is not recorded or its places differ in units.

        Args:
            name: Name of the demand.
            added_storeys: Whether places that are not part of the building (equipment, absorbers, soil) count.
            each_period: Whether the statistic has a value for each period of a floor spectrum.
        """
        if name not in self.demands:
            raise ValueError(
                f"statistics: the scene records no {name!r}; it records {', '.join(self.demands) or 'no demand'}: "
                "add the recorder of this demand to the scene, Scene(..., recorders=(...))"
            )
        structure, dims = self.scene.structure, self.demands[name].dims
        if "period" in dims and not each_period:
            raise ValueError(
                f"statistics: {name} has several periods, whose values cannot be compared: give DemandMoments or "
                "LargestDemand with each_place=True, or simulate without statistics and select a period, such as "
                f"run.sel(period={self.scene.floor_spectra.periods[0] if self.scene.floor_spectra else 0.1:g})"
            )
        if isinstance(structure, LumpedStructure) and dims:
            problem = structure.kinds.unit_problem(name, dims[0], added_storeys=added_storeys)
            if problem:
                raise ValueError(f"statistics: {problem}")
        return self.demands[name]


def numbered_events(events: object, motions: int) -> tuple[np.ndarray, np.ndarray]:
    """Return the number of each motion's event, shape [motion], and the names of the events in order of first use.

    Raises:
        ValueError, TypeError: If `events` does not contain one label for each of the `motions` motions, mixes texts and
            whole numbers, or contains an empty text.
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
