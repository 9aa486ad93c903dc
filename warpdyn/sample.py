"""Random parameters of the structures, drawn once and kept with the results."""

from __future__ import annotations

from collections.abc import Mapping

import numpy as np
from scipy.special import ndtri
from scipy.stats import qmc

from warpdyn.laws import LAWS
from warpdyn.scatter import Factor, Listed, Scatter, Value, correlation_factor
from warpdyn.structures import LinearSystem, ShearBuilding

SAMPLING = ("monte_carlo", "latin_hypercube", "sobol")


def _standard_normals(sampling: str, samples: int, dimensions: int, seed: int) -> np.ndarray:
    """Return independent standard normal values [sample, dimension]; Monte Carlo rows depend on seed and row alone."""
    generator = np.random.Generator(np.random.Philox(np.random.SeedSequence([seed, 0])))
    if sampling == "monte_carlo":
        uniform = generator.random((samples, dimensions))
    elif sampling == "latin_hypercube":
        uniform = qmc.LatinHypercube(dimensions, rng=generator).random(samples)
    else:
        engine = qmc.Sobol(dimensions, rng=generator)
        uniform = engine.random_base2(max(0, int(samples - 1).bit_length()))[:samples]
    return ndtri(np.clip(uniform, 2.0**-54, 1 - 2.0**-53))  # the normal value of exactly 0 would be infinite


def draw(
    structure: ShearBuilding | LinearSystem,
    scatter: Scatter,
    correlation: Mapping[tuple[str, str], float],
    sampling: str,
    samples: int,
    seed: int,
) -> dict[str, np.ndarray]:
    """Return the scattered parameters, one entry a structure, of shape [structure, storey] or [structure].

    Of a LinearSystem they are the factors on its matrices.

    Raises:
        ValueError: If a drawn value is out of its parameter's bounds; the message names the parameter and the place.
    """
    for name, spread in scatter.items():
        if isinstance(spread, Listed) and len(spread.values) != samples:
            raise ValueError(
                f"scatter[{name!r}] lists {len(spread.values)} structures, and samples={samples} are asked for: "
                "they must agree"
            )
    variables, factor = correlation_factor(structure, scatter, correlation)
    z = _standard_normals(sampling, samples, len(variables), seed) if variables else np.empty((samples, 0))
    # A sum in a fixed order, column by column: a matrix product's rounding depends on the number of rows.
    columns: dict[str, list[np.ndarray]] = {name: [] for name in scatter}
    for row, (name, _) in enumerate(variables):
        correlated = np.zeros(samples)
        for k in np.flatnonzero(factor[row]):
            correlated += factor[row, k] * z[:, k]
        columns[name].append(scatter[name].distribution.from_standard_normal(correlated))
    drawn = {name: _combined(structure, name, scatter[name], columns[name], samples) for name in scatter}
    axes = ("structure", "storey")
    for name, values in drawn.items():
        parameter = structure.parameter_table[name]
        problem = parameter.first_violation(f"the drawn {name}", values, axes[: values.ndim])
        if problem:
            raise ValueError(f"{problem}; narrow its scatter or use a distribution that stays within bounds")
    problem = LAWS[structure.law].problem({**structure.parameters, **drawn})
    if problem:
        raise ValueError(f"drawn: {problem}")
    return drawn


def central(structure: ShearBuilding | LinearSystem, scatter: Scatter) -> dict[str, np.ndarray]:
    """Return the scattered parameters at the middle of their distributions, of shape [storey] or []."""
    values = {}
    for name, spread in scatter.items():
        count = structure.dofs if isinstance(spread, Factor) and spread.per == "storey" else 1
        middle = [spread.distribution.from_standard_normal(np.zeros(1))] * count if isinstance(spread, Factor) else []
        combined = _combined(structure, name, spread, middle, 1)
        values[name] = np.median(combined, axis=0) if isinstance(spread, Listed) else combined[0]
    return values


def _combined(
    structure: ShearBuilding | LinearSystem,
    name: str,
    spread: Factor | Value | Listed | float,
    columns: list[np.ndarray],
    samples: int,
) -> np.ndarray:
    """Return a parameter's values [structure] or [structure, storey] from the draws of its distribution."""
    nominal = structure.parameters[name] if structure.family == "chain" else np.array(1.0)
    if isinstance(spread, Listed):
        values = spread.values.reshape(len(spread.values), -1) if nominal.ndim else spread.values
        return np.array(np.broadcast_to(values, (len(values), *nominal.shape)))
    if not isinstance(spread, Factor):
        return np.full((samples, *nominal.shape), float(spread))
    values = np.stack(columns, axis=1) if spread.per == "storey" else columns[0].reshape(-1, *(1,) * nominal.ndim)
    if type(spread) is Factor:
        return nominal * values
    return np.ascontiguousarray(np.broadcast_to(values, (samples, *nominal.shape)))
