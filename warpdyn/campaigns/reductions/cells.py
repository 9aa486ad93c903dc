"""Cells of a statistic, in which samples are counted: one for each combination of indices along its dimensions."""

from __future__ import annotations

from collections.abc import Iterable, Mapping, Sequence
from copy import copy
from functools import cached_property
from typing import Any

import numpy as np

from warpdyn.campaigns.reductions.population import Population, numbered_events
from warpdyn.campaigns.reductions.rows import Places, Rows, one_unit
from warpdyn.foundations.core.checks import one_of, unmasked
from warpdyn.model.ground_motions.designs import Stripes
from warpdyn.model.ground_motions.motions import motion_names, motion_numbers

Coordinates = dict[str, tuple]
Variables = dict[str, tuple]
EVENT = {"long_name": "event"}


class Cells:
    """The cells of a statistic: one for each combination of indices along its dimensions, such as (archetype, motion).

    Args:
        population: Structures, motions and levels of the samples.
        over: Names of the dimensions.
        labels: Label of each structure, by the names of further dimensions.
        events: Event of each motion, if only the worst motion of an event counts; None: each motion counts separately.

    Attributes:
        dims: Names of the dimensions; in a portfolio, "building" replaces "structure".
        shape: Lengths of the dimensions.
    """

    def __init__(
        self,
        population: Population,
        over: Sequence[str],
        labels: Mapping[str, Any],
        events: Sequence[str] | Sequence[int] | None,
    ) -> None:
        self.population, self._labels = population, dict(labels)
        self._check_labels()
        self.event_of_motion, self._event_names = self._checked_events(events)
        own = population.structure_dim
        self.dims = tuple(own if name == "structure" else name for name in over)
        has_motions, portfolio = bool(population.scene.excitation.motions), population.portfolio is not None
        stripes = all(isinstance(design, Stripes) for design in population.designs)
        allowed = {
            own: True,
            "structure_group": not population.is_sequence,
            "archetype": portfolio,
            "motion": has_motions and events is None,
            "stripe": stripes,
            "event": events is not None or population.is_sequence,
            "earthquake": population.at_sites is not None,
        }
        known = [name for name, is_so in allowed.items() if is_so] + list(self._labels)
        for name in self.dims:
            if name == "event" and name not in known:
                raise ValueError(
                    "over='event' needs events=, the event of each motion; without it, over may name "
                    + ", ".join(map(repr, known))
                )
            one_of("over", name, known)
        if len(set(self.dims)) < len(self.dims):
            raise ValueError(f"over={list(over)} contains a name twice: name each dimension at most once")
        if population.is_sequence and "event" not in self.dims:
            raise ValueError("statistics of an EventSequence need the dimension 'event': add 'event' to over=")
        self.coordinates: Coordinates = {}
        self._codes: dict[str, np.ndarray] = {}  # place of each structure along the dimension of each label
        self._lay_out(tuple(self._size_of(name) for name in self.dims))
        if self.count >= 2**31:
            raise ValueError(
                f"a statistic over {', '.join(self.dims)} has {self.count:,} cells, but at most 2^31 are possible: "
                "name fewer dimensions in over="
            )
        self._run, self._structures = self, np.arange(0)

    def _lay_out(self, shape: tuple[int, ...]) -> None:
        """Set the shape of the cells, and number the cells in the order of the dimensions (the last one is fastest)."""
        self._found_places: dict[int, Places] = {}
        self.shape, self.count = shape, int(np.prod([float(size) for size in shape]))
        strides = np.cumprod([1, *shape[::-1]])[::-1][1:]
        self._stride = {name: int(stride) for name, stride in zip(self.dims, strides, strict=True)}

    def of_structures(self, structures: np.ndarray) -> Cells:
        """Return the cells of the same statistic for some structures only, given by increasing numbers."""
        part, own = copy(self), self.population.structure_dim
        part._run, part._structures = self._run, structures
        part._lay_out(
            tuple(structures.size if n == own else size for n, size in zip(self.dims, self.shape, strict=True))
        )
        return part

    def of_run(self, cells: np.ndarray) -> np.ndarray:
        """Return the numbers of these structures' cells in the numbering of all cells of the run, shape [cell]."""
        own = self.population.structure_dim
        if self._run is self or own not in self.dims:
            return cells
        place = list(np.unravel_index(cells, self.shape))
        place[self.dims.index(own)] = self._structures[place[self.dims.index(own)]]
        return np.ravel_multi_index(tuple(place), self._run.shape)

    @property
    def needs_motions(self) -> bool:
        """Whether the assignment of samples to cells needs the motion of every sample."""
        by_motion = "motion" in self.dims or self.event_of_motion is not None
        return by_motion and not self.population.motions_by_place

    def needs(self, demands: Iterable[str]) -> frozenset[str]:
        """Return the names of the variables of samples that a statistic of the given demands needs."""
        return frozenset(demands) | ({"motion_index"} if self.needs_motions else set())

    @property
    def suffix(self) -> str:
        """Ending of the names of the statistic's variables, such as "_by_archetype_motion"."""
        return f"_by_{'_'.join(self.dims)}" if self.dims else ""

    def rows(self, structures: np.ndarray, motion: np.ndarray | None, event: int) -> Rows:
        """Return the assignment of the samples of some structures to the cells.

        Args:
            structures: Numbers of the structures in the run.
            motion: Index of the motion of each of their samples if `needs_motions`; otherwise None.
            event: Number of the event.
        """
        samples = self.population.samples(event)
        row = np.zeros(structures.size, dtype=np.int64)
        for name in self.dims:
            if name in self._of_structures:
                row += self._stride[name] * self._places_of(name, structures)
        if self.population.is_sequence:
            row += self._stride["event"] * event
        places = self._places(event)
        if motion is None:
            return Rows(1, structures, row, places)
        name = "motion" if self.event_of_motion is None else "event"
        stride = self._stride.get(name, 0)
        codes = np.arange(len(self.population.scene.excitation.motions))
        codes = codes if self.event_of_motion is None else self.event_of_motion
        at_sites = self.population.at_sites
        motion = motion.reshape(structures.size, samples)
        if at_sites is None and (motion == motion[:, :1]).all():
            return Rows(1, structures, row + stride * codes[motion[:, 0]], places)
        # A row is one sample, or one draw of MotionsAtSites; only the worst component of a draw counts.
        each = 1 if at_sites is None or self.event_of_motion is None else at_sites.components
        cell_of_row = (row[:, None] + stride * codes[motion[:, ::each]] + places.cell[::each]).ravel()
        return Rows(samples // each, np.repeat(structures, samples // each), cell_of_row, one_unit(each))

    def _places_of(self, name: str, structures: np.ndarray) -> np.ndarray:
        """Return the index of each of the given structures along the dimension `name`, shape [structure]."""
        if name == self.population.structure_dim and self._run is not self:
            return np.searchsorted(self._structures, structures)
        return self._run._of_structures[name][structures]  # computed once for all parts of the run

    @cached_property
    def _of_structures(self) -> dict[str, np.ndarray]:
        """The index of every structure along each dimension that depends only on the structure, by dimension."""
        population = self.population
        known = {"archetype": population.archetype, "structure_group": population.group} | self._codes
        if population.structure_dim in self.dims:
            known[population.structure_dim] = np.arange(population.structures)
        return known

    def _places(self, event: int) -> Places:
        """Return the cells and units of a structure's samples in an event; they are computed once and kept."""
        if event not in self._found_places:
            self._found_places[event] = Places(*self._cells_and_units(event))
        return self._found_places[event]

    def _cells_and_units(self, event: int) -> tuple[np.ndarray, np.ndarray]:
        """Return, for each sample of a structure: the offset of its cell, and its unit; shape [sample].

        Samples of the same unit count as one sample.
        """
        population, samples = self.population, self.population.samples(event)
        levels = population.levels_of(event)
        place = np.arange(samples)
        level, repeats = population.level_of_places(event), levels.size
        cell = np.zeros(samples, dtype=np.int64)
        if population.at_sites is not None:
            draw = place // population.at_sites.components
            cell += self._stride.get("earthquake", 0) * np.asarray(population.at_sites.earthquake)[draw]
            level, repeats = draw, samples // population.at_sites.components
        if "stripe" in self.dims:
            cell += self._stride["stripe"] * np.searchsorted(self._levels, levels)[level]
        motion = population.motion_of_place
        if motion is None:
            return cell, place
        if self.event_of_motion is None:
            return cell + self._stride.get("motion", 0) * motion, place
        of_place = self.event_of_motion[motion]
        return cell + self._stride.get("event", 0) * of_place, of_place * repeats + level

    @property
    def _levels(self) -> np.ndarray:
        events = range(len(self.population.designs))
        return np.unique(np.concatenate([self.population.levels_of(event) for event in events]))

    def _size_of(self, name: str) -> int:
        """Set the coordinates of the dimension `name`, and return its length."""
        population, coordinates = self.population, self.coordinates
        numbers: dict[str, object] = {"units": "1"}
        if name in self._labels:
            values, self._codes[name] = np.unique(np.asarray(self._labels[name]), return_inverse=True)
            coordinates[name] = (name, values, {"long_name": name} | ({} if values.dtype.kind in "US" else numbers))
        elif name == population.structure_dim:
            said = "index of the drawn structure" if name == "structure" else "number of the building in the portfolio"
            values = np.arange(population.structures, dtype=np.int32)
            coordinates[name] = (name, values, numbers | {"long_name": said})
        elif name == "archetype":
            assert population.portfolio is not None
            values = np.array(list(population.portfolio.archetypes), dtype=str)
            coordinates[name] = (name, values, {"long_name": "name of the archetype"})
        elif name == "structure_group":
            values = np.arange(int(population.group.max()) + 1, dtype=np.int32)
            said = "group of structures that a jackknife leaves out at once"
            coordinates[name] = (name, values, numbers | {"long_name": said})
        elif name == "motion":
            motions = population.scene.excitation.motions
            coordinates |= {"motion": motion_numbers(len(motions)), "motion_name": motion_names(motions)}
            values = np.arange(len(motions))
        elif name == "earthquake":
            assert population.at_sites is not None
            values = np.array(list(population.at_sites.names or ()), dtype=str)
            coordinates[name] = (name, values, {"long_name": "name of the earthquake"})
        elif name == "stripe":
            values = self._levels
            coordinates[name] = (name, values, population.level_attributes)
        else:
            values = self._event_names
            coordinates[name] = (name, values, EVENT if values.dtype.kind == "U" else EVENT | numbers)
        return len(values)

    def _checked_events(self, events: object) -> tuple[np.ndarray | None, np.ndarray]:
        """Return the number of each motion's event (None: motions are counted separately) and the events' names."""
        if self.population.is_sequence:
            if events is not None:
                raise ValueError(
                    "events= names the events of single motions; an EventSequence has its own events: remove events"
                )
            return None, np.array(self.population.scene.excitation.event_names)
        if events is None:
            return None, np.arange(0)
        found = numbered_events(events, len(self.population.scene.excitation.motions))
        at_sites = self.population.at_sites
        if at_sites is not None and not self.population.motions_by_place:
            of_draws = found[0][np.asarray(at_sites.motion)]
            others = np.argwhere(of_draws != of_draws[..., :1])
            if len(others):
                site, earthquake, _ = others[0].tolist()
                names = " and ".join(
                    repr(found[1][event].item()) for event in dict.fromkeys(of_draws[site, earthquake])
                )
                raise ValueError(
                    f"events= must give all components of a draw the same event, but those at site {site} in "
                    f"earthquake {earthquake} have the events {names}"
                )
        return found

    def _check_labels(self) -> None:
        """Raise an error unless each structure has one value of each label and no label has the name of a dimension."""
        taken = {"structure", "building", "structure_group", "archetype", "motion", "stripe", "event", "earthquake"}
        taken |= {"damage_state", "failure", "storey", "floor"}
        for name, values in self._labels.items():
            array = unmasked(f"labels[{name!r}]", values)
            if not isinstance(name, str) or not name.isidentifier() or name in taken:
                raise ValueError(
                    f"labels: {name!r} cannot name a dimension: give a Python identifier that is not the name of "
                    "another dimension, such as 'cell'"
                )
            count, what = self.population.structures, self.population.structure_dim
            if array.shape != (count,):
                raise ValueError(
                    f"labels[{name!r}] must contain a label for each of the {count} {what}s, got shape {array.shape}"
                )
            if array.dtype.kind not in "iuUS":
                raise ValueError(f"labels[{name!r}] must be names or whole numbers, got values of type {array.dtype}")
