"""The interface of structures: what a scene, the integration and the dataset read of every kind."""

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
    """A structure that a scene can have, checked when it is built.

    Attributes:
        family: Which kernels integrate it.
        demand: The recorder that errors are controlled by.
        can_yield: Whether it may come out of an earthquake in another state than it went into it.
        is_many: Whether it stands for many structures of several kinds, each of which is one.
        is_scaled: Whether scatter can only multiply its parameters, being matrices.
        law: Name of the storey laws and devices; "elastic" of a linear structure.
        storey_laws: The law of each storey, or the one of all.
        storey_law: The law of all storeys as one.
        devices: What stands beside the storeys' springs.
        damping: Name of the kind of damping.
        parameters: Values by name.
        parameter_table: What is known of each of them.
    """

    family: ClassVar[str]
    demand: ClassVar[str]
    can_yield: ClassVar[bool] = True
    is_many: ClassVar[bool] = False
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
        """Degrees of freedom."""

    @property
    @abstractmethod
    def nominal_values(self) -> Mapping[str, np.ndarray]:
        """What scatter multiplies or replaces, each of shape [storey] or []."""

    @abstractmethod
    def is_by_storey(self, name: str) -> bool:
        """Return whether a parameter has one value a storey."""

    @abstractmethod
    def input_name(self, name: str) -> str:
        """Return what the dataset calls the drawn values of a parameter."""

    @abstractmethod
    def chosen(self) -> dict[str, Any]:
        """Return what was chosen beside the parameters, as JSON tells it."""

    def description(self) -> dict[str, Any]:
        """Return what the structure's JSON says."""
        return {"type": type(self).__name__, **self.chosen(), **self.parameters}

    def _repr_html_(self) -> str:
        return html_table(repr(self), self.told(), ("", "name", "values, from the ground up", "units"))

    def told(self) -> list[tuple[object, ...]]:
        """Return what tables of notebooks say of it, a row each: its parameters, name by name."""
        known = self.parameter_table.items()
        return [(each.long_name, name, self.parameters[name], each.units) for name, each in known]

    @abstractmethod
    def numbered(self, recorders: tuple[str, ...]) -> dict[str, tuple]:
        """Return the coordinates along the dimensions of what these recorders keep."""

    @property
    def default_collapse_drift_ratio(self) -> float | None:
        """The storey drift ratio at which it collapses where neither scene nor structure names one; None for none."""
        return None

    @property
    def forgets(self) -> bool:
        """Whether its forces follow from where it is and how it moves, however it came there."""
        return self.storey_law.has_only_linear_springs


def count_along(dim: str, count: int, text: str) -> tuple:
    """Return a coordinate that counts from 1 along a dimension."""
    return dim, np.arange(1, count + 1, dtype=np.int32), {"long_name": text, "units": "1"}
