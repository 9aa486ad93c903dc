"""The interface of structures, which scenes, the integration and datasets use."""

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
        family: The kernels that integrate it: "chain" or "dense".
        demand: The recorder whose error is controlled.
        can_yield: Whether an earthquake may change its state permanently.
        is_many: Whether it represents many structures of several kinds.
        is_scaled: Whether its parameters are matrices, which scatter can only multiply.
        law: Name of the storey laws and devices; "elastic" for a linear structure.
        storey_laws: The law of each storey, or one law for all.
        storey_law: The laws of all storeys, combined.
        devices: Names of the devices parallel to the storeys' springs.
        damping: Name of the kind of damping.
        parameters: Values by name.
        parameter_table: Units, bounds and defaults by name.
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
        """Values that scatter multiplies or replaces, each of shape [storey] or []."""

    @abstractmethod
    def is_by_storey(self, name: str) -> bool:
        """Return whether a parameter has one value per storey."""

    @abstractmethod
    def input_name(self, name: str) -> str:
        """Return the name of a parameter's random values in the dataset."""

    @abstractmethod
    def chosen(self) -> dict[str, Any]:
        """Return the choices other than parameters, such as the law, for its JSON."""

    def description(self) -> dict[str, Any]:
        """Return the structure as a dictionary, for its JSON."""
        return {"type": type(self).__name__, **self.chosen(), **self.parameters}

    def _repr_html_(self) -> str:
        return html_table(repr(self), self.told(), ("", "name", "values, from the ground up", "units"))

    def told(self) -> list[tuple[object, ...]]:
        """Return the rows of its table in notebooks: its parameters."""
        known = self.parameter_table.items()
        return [(each.long_name, name, self.parameters[name], each.units) for name, each in known]

    @abstractmethod
    def numbered(self, recorders: tuple[str, ...]) -> dict[str, tuple]:
        """Return the coordinates along the dimensions of the recorded variables."""

    @property
    def default_collapse_drift_ratio(self) -> float | None:
        """The storey drift ratio of collapse if neither scene nor structure gives one; None: it does not collapse."""
        return None

    @property
    def forgets(self) -> bool:
        """Whether its forces depend only on present displacements and velocities, not on their history."""
        return self.storey_law.has_only_linear_springs


def count_along(dim: str, count: int, text: str) -> tuple:
    """Return a coordinate that counts from 1 along a dimension."""
    return dim, np.arange(1, count + 1, dtype=np.int32), {"long_name": text, "units": "1"}
