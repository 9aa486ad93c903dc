"""Sampling of the scattered parameters of a run's structures, by the index of the structure."""

from __future__ import annotations

from collections.abc import Callable, Collection, Mapping

import numpy as np

from warpdyn.engine.kernels.arguments import lane_rows
from warpdyn.engine.kernels.auxiliary.sampling import correlate_normals, entries_of, fill_uniforms
from warpdyn.engine.kernels.build import CPU_LANES
from warpdyn.foundations.core.checks import check_memory
from warpdyn.foundations.core.messages import amount_of
from warpdyn.foundations.core.random_numbers import Purpose
from warpdyn.foundations.core.thread_pool import in_parts, structures_of_a_part
from warpdyn.model.scene.correlation import correlation_factor
from warpdyn.model.scene.scatter import (
    GivenValues,
    Scatter,
    central,
    combined,
    storeys_with,
)
from warpdyn.model.scene.sobol_points import SobolPoints
from warpdyn.model.structures.physics import physics_problem
from warpdyn.model.structures.structure import Structure

REMEDY = "narrow its scatter or use a distribution that stays within bounds"
REMEDY_OF_COMBINATIONS = "narrow the scatter of these parameters, or correct their GivenValues"
BYTES_OF_A_POINT = 24  # for each variable: SciPy's permutations, its points and a copy


class Sampler:
    """Sampler of scattered parameters, for any structures of a run.

    The parameters of a structure depend only on the seed and on the index of the structure. In a Latin hypercube they
    also depend on the number of structures, and all points are kept in memory.

    Args:
        structure: The nominal structure.
        scatter: Scatter (distribution) of each scattered parameter.
        correlation: Correlation of pairs of scattered parameters.
        sampling: Kind of sampling, such as "sobol", "latin_hypercube" or "monte_carlo".
        structures: Number of structures of the run.
        seed: Seed of the random draws.

    Raises:
        ValueError: If the scatter of a parameter lists values for another number of structures.
    """

    def __init__(
        self,
        structure: Structure,
        scatter: Scatter,
        correlation: Mapping[tuple[str, str], float],
        sampling: str,
        structures: int,
        seed: int,
    ) -> None:
        for name, spread in scatter.items():
            if isinstance(spread, GivenValues) and len(spread.values) != structures:
                listed = amount_of(len(spread.values), "structure")
                raise ValueError(
                    f"scatter[{name!r}] lists values for {listed}, but the run has {amount_of(structures, 'structure')}"
                    ": all GivenValues, and structures= if it is given, must have the same number of structures"
                )
        self.structure, self.scatter, self.seed = structure, scatter, seed
        self.variables, self.factor = correlation_factor(structure, scatter, correlation)
        self._entries_of_factor = entries_of(self.factor)
        self._points: np.ndarray | None = None
        self._sobol: SobolPoints | None = None
        if not self.variables:
            return
        generator = np.random.default_rng([seed, Purpose.POINTS])
        if sampling == "sobol":
            self._sobol = SobolPoints(len(self.variables), generator, structures)
        elif sampling == "latin_hypercube":
            check_memory(
                f"a Latin hypercube of structures={structures}",
                BYTES_OF_A_POINT * structures * len(self.variables),
                'choose sampling="sobol" in the Scene, which needs no memory for its points',
            )
            from scipy.stats import qmc  # its import takes 0.3 s

            self._points = qmc.LatinHypercube(len(self.variables), rng=generator).random(structures)

    @property
    def digits(self) -> np.ndarray:
        """Shift and direction numbers of the Sobol sequence, shape [1 + bit, variable]; [[0]] for other samplings."""
        return np.zeros((1, 1), np.uint32) if self._sobol is None else self._sobol.digits

    @property
    def points(self) -> np.ndarray:
        """Points of the Latin hypercube, shape [structure, variable]; [[0]] for other samplings."""
        return np.zeros((1, 1)) if self._points is None else self._points

    def draw(
        self,
        structures: np.ndarray,
        threads: int = 1,
        *,
        is_all: bool = True,
        only: Collection[str] | None = None,
        at_a_time: int | None = None,
        then: Callable[[slice, dict[str, np.ndarray]], object] = lambda part, drawn: None,
    ) -> dict[str, np.ndarray]:
        """Return the scattered parameters of the given structures by name, shape [structure, storey] or [structure].

        Values of successive structures are contiguous in memory. For a LinearSystem the parameters are the factors on
        its matrices.

        Args:
            structures: Indices of the structures, increasing.
            threads: Number of CPU threads.
            is_all: Whether all other parameters have their nominal values. Then the drawn values are also checked for
                contradictions with the nominal values. Give False with `only`.
            only: Names of the parameters to return; None: all.
            at_a_time: Number of structures that a thread draws at a time; None: chosen by the number of threads.
            then: Called in the same thread with each slice of `structures` and its checked parameters.

        Raises:
            ValueError: If a drawn value is out of the bounds of its parameter; the message names the parameter, the
                structure and the storey.
        """
        nominal = self.structure.nominal_values
        names = self.scatter.keys() if only is None else only
        drawn = {name: np.empty((*nominal[name].shape, structures.size)).T for name in self.scatter if name in names}

        def fill(part: slice) -> None:
            normals = self._normals(structures[part])
            end = 0
            for name, spread in self.scatter.items():
                first, end = end, end + spread.variables(self.structure.length_of(name))
                if name not in drawn:
                    continue
                own, varied = normals[first:end], spread.varied(name, self.structure)
                values = combined(nominal[name], spread, own, structures[part], varied)
                if not isinstance(spread, GivenValues):
                    values = self.structure.tied(name, values)
                drawn[name][part] = values.T
            own_drawn = {name: values[part] for name, values in drawn.items()}
            self._check(own_drawn, structures[part], is_all)
            then(part, own_drawn)

        in_parts(fill, structures.size, threads, at_a_time or structures_of_a_part(structures.size, threads))
        return drawn

    def check_given_and_medians(self) -> None:
        """Raise a ValueError if a given value of any structure, or the median of a random value, is out of bounds.

        The default step is that of the median structure, so that its parameters must be valid before any is drawn.
        """
        for name, spread in self.scatter.items():
            is_given = isinstance(spread, GivenValues)
            values = (
                spread.in_structures(self.structure.nominal_values[name])
                if isinstance(spread, GivenValues)
                else central(self.structure, {name: spread})[name][None]
            )
            axes = ("structure", self.structure.dim_of(name))
            taken = storeys_with(self.structure.nominal_values[name]) if values.ndim == 2 else None
            what = f"the given {name}" if is_given else f"the median of the random {name}"
            problem = self.structure.parameter_table[name].first_violation(
                what, values, axes[: values.ndim], None, taken, self.structure.names_along(axes[1])
            )
            if problem:
                place = problem if is_given else problem.replace(" at structure 0; ", "; ").replace("structure 0, ", "")
                raise ValueError(f"{place}; {f'correct its {type(spread).__name__}' if is_given else REMEDY}")

    def _check(self, drawn: dict[str, np.ndarray], structures: np.ndarray, is_all: bool) -> None:
        """Raise a ValueError if a value is out of the bounds of its parameter, or if values contradict each other."""
        nominal = self.structure.nominal_values
        for name, values in drawn.items():
            axes = ("structure", self.structure.dim_of(name))
            parameter = self.structure.parameter_table[name]
            taken = storeys_with(nominal[name])
            spread = self.scatter[name]
            is_given = isinstance(spread, GivenValues)
            what = f"the given {name}" if is_given else f"the drawn {name}"
            problem = parameter.first_violation(
                what, values, axes[: values.ndim], structures, taken, self.structure.names_along(axes[1])
            )
            if problem:
                raise ValueError(f"{problem}; {f'correct its {type(spread).__name__}' if is_given else REMEDY}")
        if not is_all:
            return
        everything = {**self.structure.parameters, **drawn}
        problem = self.structure.problem(everything) or physics_problem(everything)
        if problem:
            shifted = f" (structure 0 of this message is structure {structures[0]})" if structures[0] else ""
            raise ValueError(f"drawn{shifted}: {problem}; {REMEDY_OF_COMBINATIONS}")

    def _normals(self, structures: np.ndarray) -> np.ndarray:
        """Return correlated standard normal values, shape [variable, structure], from points or random numbers."""
        points = self._points_of(structures)
        values = lane_rows(len(self.variables), structures.size, CPU_LANES, 0.5)
        if not self.variables:
            return values
        if points is None:
            fill_uniforms(values, self.seed, structures)
        else:  # a point at exactly 0 would give an infinite normal value
            np.clip(points.T, 2.0**-54, 1 - 2.0**-53, out=values[:, : structures.size])
        correlate_normals(values, self._entries_of_factor)
        return values[:, : structures.size]

    def _points_of(self, structures: np.ndarray) -> np.ndarray | None:
        """Return points of a Sobol sequence or Latin hypercube, shape [structure, variable]; None: random numbers."""
        if self._points is not None:
            return self._points[structures]
        if self._sobol is None:
            return None
        return self._sobol.at(structures)
