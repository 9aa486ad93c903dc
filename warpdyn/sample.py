"""Random parameters of the structures, drawn by index and kept with the results."""

from __future__ import annotations

from collections.abc import Mapping

import numpy as np
from scipy.special import ndtri
from scipy.stats import qmc

from warpdyn.laws import LAWS
from warpdyn.p_delta import buckling_problem
from warpdyn.random_numbers import SCATTER, consecutive, generator_of, uniform_rows
from warpdyn.scatter import Factor, Listed, Scatter, Value, correlation_factor
from warpdyn.structures import LinearSystem, ShearBuilding

SAMPLING = ("monte_carlo", "latin_hypercube", "sobol")


class Sampler:
    """Draws the scattered parameters of structures, any of them at a time.

    What is drawn of a structure depends on the seed and the structure's index alone; of a Latin hypercube also on how
    many structures there are, and all its points are held.

    Args:
        structure: The nominal structure.
        scatter: What is random of it.
        correlation: Correlation of pairs of scattered parameters.
        sampling: Row of SAMPLING.
        samples: Structures there are.
        seed: Seed.

    Raises:
        ValueError: If a scatter lists values of another number of structures.
    """

    def __init__(
        self,
        structure: ShearBuilding | LinearSystem,
        scatter: Scatter,
        correlation: Mapping[tuple[str, str], float],
        sampling: str,
        samples: int,
        seed: int,
    ) -> None:
        for name, spread in scatter.items():
            if isinstance(spread, Listed) and len(spread.values) != samples:
                raise ValueError(
                    f"scatter[{name!r}] lists {len(spread.values)} structures, and samples={samples} are asked for: "
                    "they must agree"
                )
        self.structure, self.scatter, self.seed = structure, scatter, seed
        self.variables, self.factor = correlation_factor(structure, scatter, correlation)
        self._points: np.ndarray | None = None
        self._sobol: qmc.Sobol | None = None
        if self.variables and sampling == "latin_hypercube":
            generator = generator_of(seed, SCATTER)
            self._points = qmc.LatinHypercube(len(self.variables), rng=generator).random(samples)
        elif self.variables and sampling == "sobol":
            self._sobol = qmc.Sobol(len(self.variables), rng=generator_of(seed, SCATTER))

    def draw(self, structures: np.ndarray) -> dict[str, np.ndarray]:
        """Return the scattered parameters of some structures, of shape [structure, storey] or [structure].

        Of a LinearSystem they are the factors on its matrices.

        Args:
            structures: Their indices, increasing.

        Raises:
            ValueError: If a drawn value is out of its parameter's bounds; the message names the parameter and the
                place.
        """
        z = self._standard_normals(structures) if self.variables else np.empty((structures.size, 0))
        # A sum in a fixed order, column by column: a matrix product's rounding depends on the number of rows.
        columns: dict[str, list[np.ndarray]] = {name: [] for name in self.scatter}
        for row, (name, _) in enumerate(self.variables):
            correlated = np.zeros(structures.size)
            for k in np.flatnonzero(self.factor[row]):
                correlated += self.factor[row, k] * z[:, k]
            columns[name].append(self.scatter[name].distribution.from_standard_normal(correlated))
        drawn = {
            name: _combined(self.structure, name, spread, columns[name], structures)
            for name, spread in self.scatter.items()
        }
        axes = ("structure", "storey")
        for name, values in drawn.items():
            parameter = self.structure.parameter_table[name]
            problem = parameter.first_violation(f"the drawn {name}", values, axes[: values.ndim], structures)
            if problem:
                raise ValueError(f"{problem}; narrow its scatter or use a distribution that stays within bounds")
        values = {**self.structure.parameters, **drawn}
        problem = LAWS[self.structure.law].problem(values) or buckling_problem(values)
        if problem:
            counted = f", counted from structure {structures[0]}" if structures[0] else ""
            raise ValueError(f"drawn{counted}: {problem}")
        return drawn

    def _standard_normals(self, structures: np.ndarray) -> np.ndarray:
        """Return independent standard normal values, shape [structure, variable]."""
        if self._points is not None:
            uniform = self._points[structures]
        elif self._sobol is not None:
            uniform = np.concatenate([self._sobol_rows(structures[part]) for part in consecutive(structures)])
        else:
            uniform = uniform_rows(self.seed, SCATTER, structures, len(self.variables))
        # The normal value of exactly 0 would be infinite.
        return ndtri(np.clip(uniform, 2.0**-54, 1 - 2.0**-53, out=uniform), out=uniform)

    def _sobol_rows(self, structures: np.ndarray) -> np.ndarray:
        """Return Sobol points of consecutive indices; those before them are skipped, which takes 5 ns each."""
        first, count = int(structures[0]), structures.size
        if first < self._sobol.num_generated:
            self._sobol.reset()
        if first > self._sobol.num_generated:
            self._sobol.fast_forward(first - self._sobol.num_generated)
        if first == 0 and count > 1:  # the first alone: scipy warns of a first part that is no power of 2 long
            return np.concatenate([self._sobol.random(1), self._sobol.random(count - 1)])
        return self._sobol.random(count)


def central(structure: ShearBuilding | LinearSystem, scatter: Scatter) -> dict[str, np.ndarray]:
    """Return the scattered parameters at the middle of their distributions, of shape [storey] or []."""
    middle = _at(structure, scatter, np.zeros(1))
    return {
        name: np.median(values, axis=0) if isinstance(scatter[name], Listed) else values[0]
        for name, values in middle.items()
    }


def representative(structure: ShearBuilding | LinearSystem, scatter: Scatter) -> dict[str, np.ndarray]:
    """Return values of the scattered parameters that are all alike only where all that can be drawn are.

    They are those at two places of each distribution, or all that are listed, of shape [value, storey] or [value].
    """
    return _at(structure, scatter, np.array([0.0, 1.0]))


def _at(structure: ShearBuilding | LinearSystem, scatter: Scatter, z: np.ndarray) -> dict[str, np.ndarray]:
    """Return the scattered parameters at some standard normal values of their distributions; all of those listed."""
    values = {}
    for name, spread in scatter.items():
        count = structure.dofs if isinstance(spread, Factor) and spread.per == "storey" else 1
        columns = [spread.distribution.from_standard_normal(z)] * count if isinstance(spread, Factor) else []
        rows = np.arange(len(spread.values) if isinstance(spread, Listed) else z.size)
        values[name] = _combined(structure, name, spread, columns, rows)
    return values


def _combined(
    structure: ShearBuilding | LinearSystem,
    name: str,
    spread: Factor | Value | Listed | float,
    columns: list[np.ndarray],
    structures: np.ndarray,
) -> np.ndarray:
    """Return a parameter's values [structure] or [structure, storey] from the draws of its distribution."""
    nominal = structure.parameters[name] if structure.family == "chain" else np.array(1.0)
    if isinstance(spread, Listed):
        listed = spread.values[structures]
        values = listed.reshape(structures.size, -1) if nominal.ndim else listed
        return np.array(np.broadcast_to(values, (structures.size, *nominal.shape)))
    if not isinstance(spread, Factor):
        return np.full((structures.size, *nominal.shape), float(spread))
    values = np.stack(columns, axis=1) if spread.per == "storey" else columns[0].reshape(-1, *(1,) * nominal.ndim)
    if type(spread) is Factor:
        return nominal * values
    return np.ascontiguousarray(np.broadcast_to(values, (structures.size, *nominal.shape)))
