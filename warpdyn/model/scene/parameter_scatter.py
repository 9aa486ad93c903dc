"""Base class of scatter: how the value of one parameter differs between the structures of a scene."""

from __future__ import annotations

from abc import ABC, abstractmethod

import numpy as np

from warpdyn.model.structures.shear_building import ShearBuilding
from warpdyn.model.structures.structure import Structure

MOST_NAMED = 4  # added storeys, springs or degrees of freedom that a message names


class ParameterScatter(ABC):
    """Base class: how the value of one parameter differs between structures."""

    def variables(self, storeys: int) -> int:
        """Return the number of random variables that this scatter draws for a structure with `storeys` storeys."""
        return 0

    def varied(self, name: str, structure: Structure) -> np.ndarray | None:
        """Return which values of a parameter are drawn, shape [place]; the others are nominal. None: all are drawn."""
        return None

    def rows(self, count: int) -> np.ndarray | slice:
        """Return the indices of `count` random structures; for GivenValues, a slice of all given structures."""
        return np.arange(count)

    @abstractmethod
    def problem(self, name: str, structure: Structure) -> str | None:
        """Return a message if the scatter does not fit the parameter `name` of the structure; None if it fits."""

    @abstractmethod
    def draw(self, nominal: np.ndarray, normals: np.ndarray, structures: np.ndarray | slice) -> np.ndarray:
        """Return the values of the parameter in each structure.

        Args:
            nominal: Nominal value, shape [storey] or [].
            normals: Standard normal values of the parameter's random variables, shape [variable, structure].
            structures: Indices of the structures.

        Returns:
            Values of shape [storey, structure] or [structure].
        """


def also_of_added_storeys(name: str, structure: Structure) -> str | None:
    """Return the start of a message if one value would replace those of the building and of isolators or equipment.

    None: the structure has no added storeys, springs or degrees of freedom, or only one of both kinds has the
    parameter.
    """
    if not structure.is_by_storey(name):
        return None
    is_chain = isinstance(structure, ShearBuilding)
    own = structure.own_storeys if isinstance(structure, ShearBuilding) else structure.varied(name, None)
    has = ~np.isnan(structure.nominal_values[name])
    if own is None or not (has[own].any() and has[~own].any()):
        return None
    names = structure.names_along(structure.dim_of(name)) or range(1, own.size + 1)
    added = ", ".join(str(names[place]) for place in np.flatnonzero(~own)[:MOST_NAMED])
    places = f"the building's storeys and those of storey {added}" if is_chain else f"the building and those of {added}"
    kinds = "isolators or tuned mass damper" if is_chain else "soil, equipment or absorbers"
    return f"scatter[{name!r}]: one value would replace the values of {places} ({kinds})"
