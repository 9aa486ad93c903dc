"""Structures that follow from given standard normal values of the random parameters of a scene."""

from __future__ import annotations

from collections.abc import Mapping

import numpy as np

from warpdyn.model.scene.correlation import correlation_factor
from warpdyn.model.scene.scatter import DrawnValues, Scatter, combined
from warpdyn.model.structures.structure import Structure


def values_of_normals(structure: Structure, scatter: Scatter, normals: np.ndarray) -> dict[str, np.ndarray]:
    """Return the random parameters of structures by name, shape [structure, storey] or [structure].

    Args:
        structure: The nominal structure.
        scatter: Scatter of the random parameters; no given values.
        normals: Correlated standard normal values of the random variables, shape [variable, structure].
    """
    start, every, found = 0, np.arange(normals.shape[1]), {}
    for name, spread in scatter.items():
        count = spread.variables(structure.length_of(name))
        nominal, varied = structure.nominal_values[name], spread.varied(name, structure)
        drawn = combined(nominal, spread, normals[start : start + count], every, varied)
        found[name] = structure.tied(name, drawn).T
        start += count
    return found


class ValuesOfNormals(DrawnValues):
    """Values of a random parameter in given structures, with the values of the two representative structures.

    The default step and the kernel of a run depend on representative structures, whose normal values are all 0 and all
    1. They are the same for all structures of a scene, so that the result of a structure depends only on its own normal
    values, and all runs share one kernel.

    Args:
        values: Values in the parameter's units, shape [structure, storey] or [structure].
        representative: Values in the representative structures, shape [2, storey] or [2].
    """

    def __init__(self, values: np.ndarray, representative: np.ndarray) -> None:
        super().__init__(values)
        object.__setattr__(self, "_representative", representative)

    def rows(self, count: int) -> np.ndarray:  # type: ignore[override] # indices instead of a slice
        """Return negative indices, which mean the representative structures."""
        return -1 - np.arange(count)

    def draw(self, nominal: np.ndarray, normals: np.ndarray, structures: np.ndarray | slice) -> np.ndarray:
        """Return the values in the structures, shape [storey, structure] or [structure]."""
        if isinstance(structures, np.ndarray) and structures.size and structures[0] < 0:
            return self.placed(self._representative[-1 - structures], nominal)  # type: ignore[attr-defined]
        return super().draw(nominal, normals, structures)


class StructuresOfNormals:
    """Structures of a scene for given standard normal values of its random parameters.

    Args:
        structure: The nominal structure.
        scatter: Scatter of the random parameters; no given values.
        correlation: Correlation of pairs of parameters.
    """

    def __init__(self, structure: Structure, scatter: Scatter, correlation: Mapping[tuple[str, str], float]) -> None:
        self.structure, self.scatter = structure, scatter
        _, self._factor = correlation_factor(structure, scatter, correlation)
        both = np.broadcast_to([0.0, 1.0], (self.variables, 2))
        self._representative = values_of_normals(structure, scatter, both)

    @property
    def variables(self) -> int:
        """Number of standard normal variables of a structure."""
        return len(self._factor)

    def scatter_of(self, normals: np.ndarray) -> dict[str, ValuesOfNormals]:
        """Return the scatter of structures for independent standard normal values, shape [structure, variable]."""
        values = values_of_normals(self.structure, self.scatter, self._factor @ normals.T)
        return {name: ValuesOfNormals(each, self._representative[name]) for name, each in values.items()}
