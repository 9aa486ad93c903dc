"""The base class of structures: the attributes and methods that scenes, integration and datasets use."""

from __future__ import annotations

from abc import ABC, abstractmethod
from collections.abc import Mapping
from typing import Any, ClassVar

import numpy as np

from warpdyn.engine.laws import Parameter
from warpdyn.engine.laws.building_law import BuildingLaw
from warpdyn.foundations.core.description import html_table

MAXIMUM_STOREYS = 60  # of a ShearBuilding


class Structure(ABC):
    """Base class of the structures of scenes; arguments are checked when an object is made.

    Attributes:
        family: Family of the kernels that integrate the structure: "chain" (shear buildings), "lumped" or
            "dense" (matrices).
        demand: Name of the recorder whose error the step control limits.
        can_yield: Whether an earthquake may cause residual drifts.
        is_many: Whether the object is a portfolio of several building types.
        is_machine: Whether it is a vehicle or a machine, to which usual values of buildings do not apply.
        is_scaled: Whether parameters are matrices, which scatter can only multiply by a factor.
        law: Names of the storey laws, dampers and stops, joined to one text; "elastic" for a linear structure.
        storey_laws: Names of the laws, one per storey, or one name for all storeys.
        storey_law: The laws of all storeys as one object.
        devices: Names of the dampers and stops parallel to the storey springs.
        damping: Name of the kind of damping.
        parameters: Parameter name -> values.
        parameter_table: Parameter name -> units, bounds and default value.
    """

    family: ClassVar[str]
    demand: ClassVar[str]
    can_yield: ClassVar[bool] = True
    is_many: ClassVar[bool] = False
    is_machine: bool = False
    is_scaled: ClassVar[bool] = False
    law: str
    storey_laws: tuple[str, ...]
    storey_law: BuildingLaw
    devices: tuple[str, ...]
    damping: str
    parameters: Mapping[str, np.ndarray]
    parameter_table: Mapping[str, Parameter]

    @property
    @abstractmethod
    def dofs(self) -> int:
        """Number of degrees of freedom of the structure."""

    @property
    @abstractmethod
    def nominal_values(self) -> Mapping[str, np.ndarray]:
        """Parameter values that scatter multiplies or replaces, each of shape [storey] or []."""

    @abstractmethod
    def is_by_storey(self, name: str) -> bool:
        """Return whether the parameter `name` has one value per storey."""

    def dim_of(self, name: str) -> str:
        """Return the dimension of the values of a parameter that has one per storey."""
        return "storey"

    def length_of(self, name: str) -> int:
        """Return the number of values of a parameter that has one per storey, otherwise the number of storeys."""
        return len(self.nominal_values[name]) if self.is_by_storey(name) else self.dofs

    def length_along(self, dim: str) -> int:
        """Return the length of a dimension of recorded variables, such as "storey"."""
        return self.dofs

    def names_along(self, dim: str) -> tuple[str, ...] | None:
        """Return the names of the degrees of freedom or springs along a dimension; None if they have only numbers."""
        return None

    def units_along(self, dims: tuple[str, ...], units: str) -> str:
        """Return the units of a variable with these dimensions, whose translations have the units `units`."""
        return units

    def varied(self, name: str, only: tuple[str, ...] | tuple[int, ...] | None) -> np.ndarray | None:
        """Return which values of a parameter a random scatter draws, shape [place]; None: all of them.

        Args:
            name: Name of the parameter.
            only: Numbers or names of the places, or names of groups, that are drawn; None: the default.
        """
        return None

    def only_problem(self, name: str, only: tuple[str, ...] | tuple[int, ...]) -> str | None:
        """Return why scatter of a parameter cannot be restricted to these names; None if it can."""
        return "only= needs a ShearBuilding or a LumpedStructure: remove only="

    def scatter_problem(self, name: str, *, is_common_factor: bool) -> str | None:
        """Return why a parameter cannot be random; None if it can.

        Args:
            name: Name of the parameter.
            is_common_factor: Whether one random factor multiplies all its values.
        """
        return None

    def tied(self, name: str, values: np.ndarray) -> np.ndarray:
        """Return drawn values of a parameter, shape [storey, structure], with equal values where they must be equal."""
        return values

    def problem(self, values: Mapping[str, np.ndarray]) -> str | None:
        """Return a sentence on parameters that contradict each other, or None."""
        return self.storey_law.problem(values)

    @property
    def lacking(self) -> tuple[str, ...]:
        """Names of recorders that this structure cannot have."""
        return ()

    @property
    def components(self) -> int:
        """Number of components of the base motion."""
        return 1

    @property
    def rotating_dofs(self) -> tuple[str, ...]:
        """Names of the degrees of freedom that are rotations [rad]; the others are translations [m]."""
        return ()

    @abstractmethod
    def input_name(self, name: str) -> str:
        """Return the name that the random values of the parameter `name` have in the dataset of a run."""

    @abstractmethod
    def chosen(self) -> dict[str, Any]:
        """Return the choices that are not parameters, such as the law, as a dictionary for the JSON of the scene."""

    def description(self) -> dict[str, Any]:
        """Return the structure as a dictionary, for the JSON of the scene."""
        return {"type": type(self).__name__, **self.chosen(), **self.parameters}

    def _repr_html_(self) -> str:
        return html_table(repr(self), self.told(), ("", "name", "values, from the ground up", "units"))

    def told(self) -> list[tuple[object, ...]]:
        """Return the rows of the table that notebooks show for the structure, one row per parameter."""
        known = self.parameter_table.items()
        return [(each.long_name, name, self.parameters[name], each.units) for name, each in known]

    @abstractmethod
    def numbered(self, recorders: tuple[str, ...]) -> dict[str, tuple]:
        """Return the coordinates, such as `storey`, along the dimensions of the variables that the recorders record."""

    @property
    def default_collapse_drift_ratio(self) -> float | None:
        """Storey drift ratio at which samples collapse if no collapse limit is given [1]; None: no collapse."""
        return None

    @property
    def forgets(self) -> bool:
        """Whether the forces depend only on the present displacements and velocities, not on the earlier response."""
        return self.storey_law.has_only_linear_springs


def count_along(dim: str, count: int, text: str) -> tuple:
    """Return a coordinate of a dataset: the numbers 1 to `count` along dimension `dim`, with the long name `text`."""
    return dim, np.arange(1, count + 1, dtype=np.int32), {"long_name": text, "units": "1"}
