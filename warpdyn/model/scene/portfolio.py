"""Portfolios: a list of building types (archetypes), each with a number of buildings."""

from __future__ import annotations

from collections.abc import Iterator, Mapping
from contextlib import contextmanager
from dataclasses import dataclass, field
from typing import Any

import numpy as np

from warpdyn.foundations.core.checks import whole_number
from warpdyn.foundations.core.description import html_table
from warpdyn.foundations.core.frozen_values import FrozenMapping
from warpdyn.foundations.core.messages import amount_of
from warpdyn.foundations.core.near_misses import with_suggestions
from warpdyn.foundations.core.output_variables import KIND_ATTRIBUTES, KIND_OF_ARCHETYPES
from warpdyn.model.scene.correlation import check_correlation
from warpdyn.model.scene.scatter import GivenValues, Scatter, check_scatter
from warpdyn.model.structures.lumped.places.storeys import needs_storeys
from warpdyn.model.structures.lumped.structure import LumpedStructure
from warpdyn.model.structures.shear_building import ShearBuilding, numbered_storeys
from warpdyn.model.structures.structure import Structure

MOST_BUILDINGS = 2**31 - 1  # kernels count buildings in 32-bit integers


@with_suggestions
@dataclass(frozen=True, eq=False)
class Archetype:
    """Buildings of one type: the same number of storeys, storey laws and kind of damping.

    Args:
        building: The nominal building: a ShearBuilding or a LumpedStructure with storeys, such as a
            FlexuralShearBuilding, under one component of base motion.
        count: Number of buildings; None: the number of values in `scatter`'s GivenValues, or 1.
        scatter: Differences between the buildings, as in a Scene: parameter name -> RandomFactor, RandomValue or
            GivenValues with one value per building.
        correlation: Correlation of pairs of scattered parameters [1], as in a Scene.

    Raises:
        ValueError, TypeError: If an argument is invalid, or the scatter does not fit the building or the count.

    Example:
        >>> archetype = wd.Archetype(building, count=20, scatter=scatter)
        >>> archetype.count
        20
    """

    building: ShearBuilding | LumpedStructure
    count: int | None = None
    scatter: Scatter = field(default_factory=dict)
    correlation: Mapping[tuple[str, str], float] = field(default_factory=dict)

    def __post_init__(self) -> None:
        if not isinstance(self.building, ShearBuilding | LumpedStructure):
            given = self.building
            got = f"the class {given.__name__} itself" if isinstance(given, type) else type(given).__name__
            raise TypeError(
                f"building must be a ShearBuilding or a LumpedStructure with storeys, got {got}: give "
                "Archetype(wd.ShearBuilding(...), count)"
            )
        if "drift" in self.building.lacking:
            raise ValueError(
                f"building: a {type(self.building).__name__} in a portfolio {needs_storeys(self.building)}"
            )
        if self.building.components > 1:
            raise ValueError(
                f"building: the structure has {self.building.components} components of base motion, but buildings of a "
                "portfolio have one: give one influence vector, or base_motion='x' to a TorsionalBuilding"
            )
        if self.count is not None:
            whole_number("count", self.count, 1, MOST_BUILDINGS)
        check_scatter(self.building, self.scatter)
        check_correlation(self.building, self.scatter, self.correlation)
        self.buildings()  # raises an error if GivenValues list another number of values than `count`

    def buildings(self) -> int:
        """Return the number of buildings: `count` or, if it is None, the number of values in GivenValues, or else 1."""
        listed = {key: len(spread.values) for key, spread in self.scatter.items() if isinstance(spread, GivenValues)}
        count = next(iter(listed.values()), 1) if self.count is None else int(self.count)
        for key, length in listed.items():
            if length != count:
                raise ValueError(
                    f"scatter[{key!r}] lists values of {length} buildings, but the archetype has {count}: "
                    f"remove count=, or list {amount_of(count, 'value')}"
                )
        return count


@with_suggestions
@dataclass(frozen=True, eq=False)
class Portfolio(Structure):
    """Buildings of several archetypes, numbered from 0 in the order of the archetypes.

    A building's random values depend only on the seed, the name of its archetype and its number in this archetype.

    Args:
        archetypes: Archetypes by name.

    Attributes:
        counts: Number of buildings of each archetype, shape [archetype].
        first: Number of the first building of each archetype, shape [archetype].

    Raises:
        ValueError, TypeError: If there is no archetype, or one is invalid; the message names it.

    Example:
        >>> stiffer = wd.ShearBuilding(1e5, 6e7, 3.0, law=law, **damped)
        >>> town = wd.Portfolio({"old": wd.Archetype(building, 20, scatter), "new": wd.Archetype(stiffer, 5, scatter)})
        >>> town.buildings
        25
    """

    family = "chain"
    demand = "drift"
    is_many = True
    parameters = FrozenMapping({})
    parameter_table = FrozenMapping({})

    archetypes: Mapping[str, Archetype]
    counts: np.ndarray = field(init=False, repr=False)
    first: np.ndarray = field(init=False, repr=False)

    def __post_init__(self) -> None:
        if not isinstance(self.archetypes, Mapping) or not self.archetypes:
            raise TypeError(
                f"archetypes must map names to at least one Archetype, such as {{'houses': Archetype(building)}}, got "
                f"{self.archetypes!r}"
            )
        counts = []
        for name, archetype in self.archetypes.items():
            if not isinstance(name, str) or not name:
                raise TypeError(f"the name of an archetype must be text, got {name!r}")
            with named(name):
                if not isinstance(archetype, Archetype):
                    raise TypeError(
                        f"it must be an Archetype, such as Archetype(building), got {type(archetype).__name__}"
                    )
                counts.append(archetype.buildings())
        object.__setattr__(self, "archetypes", FrozenMapping(dict(self.archetypes)))
        if sum(counts) > MOST_BUILDINGS:
            raise ValueError(
                f"archetypes have {sum(counts):,} buildings, but a portfolio has at most {MOST_BUILDINGS:,}: divide it "
                "into several portfolios"
            )
        object.__setattr__(self, "counts", np.array(counts))
        object.__setattr__(self, "first", np.cumsum(counts) - counts)

    @property
    def buildings(self) -> int:
        """Number of buildings in the portfolio, the sum over all archetypes."""
        return int(self.counts.sum())

    @property
    def storeys(self) -> np.ndarray:
        """Number of storeys of each archetype, shape [archetype]."""
        return np.array([archetype.building.storeys for archetype in self.archetypes.values()])

    @property
    def dofs(self) -> int:
        """The largest number of storeys of an archetype."""
        return int(self.storeys.max())

    @property
    def nominal_values(self) -> Mapping[str, np.ndarray]:
        """An empty mapping, because a portfolio itself has no parameters (its archetypes have parameters)."""
        return {}

    def is_by_storey(self, name: str) -> bool:
        """Return False for any name, because a portfolio itself has no parameters (its archetypes have parameters)."""
        return False

    def input_name(self, name: str) -> str:
        """Return the unchanged name of a parameter, which is also its name in the dataset."""
        return name

    def chosen(self) -> dict[str, Any]:
        """Return the archetypes of the portfolio as a dictionary, for the JSON of the scene."""
        found = {}
        for (name, archetype), count in zip(self.archetypes.items(), self.counts, strict=True):
            of_scene = {"scatter": archetype.scatter, "correlation": archetype.correlation}
            found[name] = {"count": int(count), "structure": archetype.building, **of_scene}
        return {"archetypes": found}

    def numbered(self, recorders: tuple[str, ...]) -> dict[str, tuple]:
        """Return the coordinates `storey` and, if a recorder needs it, `floor`, up to the largest number of storeys.

        If an archetype has isolators or a tuned mass damper, the kinds of the storeys of each archetype (building,
        isolators or tuned mass damper) are also returned.
        """
        coordinates = numbered_storeys(self.dofs, recorders)
        chains = {
            place: each.building
            for place, each in enumerate(self.archetypes.values())
            if isinstance(each.building, ShearBuilding)
        }
        if all(building.own_storeys.all() for building in chains.values()):
            return coordinates
        kinds = np.zeros((len(self.archetypes), self.dofs), dtype=np.int8)
        for place, building in chains.items():
            kinds[place, : building.storeys] = building.storey_kinds
        return coordinates | {KIND_OF_ARCHETYPES: (("archetype", "storey"), kinds, KIND_ATTRIBUTES)}

    def _repr_html_(self) -> str:
        heads = ("archetype", "buildings", "storeys", "law", "damping", "scatter")
        rows = [
            (name, int(count), each.building.storeys, each.building.law, each.building.damping, ", ".join(each.scatter))
            for (name, each), count in zip(self.archetypes.items(), self.counts, strict=True)
        ]
        return html_table(repr(self), rows, heads)

    def __repr__(self) -> str:
        return f"Portfolio({self.buildings} buildings of {len(self.archetypes)} archetypes)"


@contextmanager
def named(archetype: str) -> Iterator[None]:
    """Put the name of an archetype before the message of an error that is raised within the `with` block."""
    try:
        yield
    except (ValueError, TypeError) as error:
        raise type(error)(f"archetype {archetype!r}: {error}") from error
