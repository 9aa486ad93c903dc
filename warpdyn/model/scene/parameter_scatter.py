"""Base class of scatter: how the value of one parameter differs between the structures of a scene."""

from __future__ import annotations

from abc import ABC, abstractmethod

import numpy as np

from warpdyn.model.structures.shear_building import ShearBuilding
from warpdyn.model.structures.structure import Structure


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
    """Return the start of a message if one value would replace those of the building and of isolators or a damper.

    None: the structure has no added storeys, or only one of both kinds of storeys has the parameter.
    """
    if not structure.is_by_storey(name):
        return None
    if not isinstance(structure, ShearBuilding):
        return _also_of_groups(name, structure)
    if structure.own_storeys.all():
        return None
    own, has = structure.own_storeys, ~np.isnan(structure.nominal_values[name])
    if not (has[own].any() and has[~own].any()):
        return None
    added = ", ".join(map(str, np.flatnonzero(~own) + 1))
    return (
        f"scatter[{name!r}]: one value would replace the values of the building's storeys and those of storey {added} "
        "(isolators or tuned mass damper)"
    )


def _also_of_groups(name: str, structure: Structure) -> str | None:
    """Return the start of a message if one value would replace those of a building and of equipment, or None."""
    own, has = structure.varied(name, None), ~np.isnan(structure.nominal_values[name])
    if own is None or not (has[own].any() and has[~own].any()):
        return None
    names = structure.names_along(structure.dim_of(name)) or ()
    others = [names[place] for place in np.flatnonzero(~own)]
    return (
        f"scatter[{name!r}]: one value would replace the values of the building and those of {', '.join(others[:4])} "
        "(soil, equipment or absorbers)"
    )
