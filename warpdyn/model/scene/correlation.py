"""Correlation between the random parameters of a scene: check of the values, and factor of the correlation matrix."""

from __future__ import annotations

from collections.abc import Mapping

import numpy as np

from warpdyn.foundations.core.checks import real_number
from warpdyn.model.scene.scatter import RandomScatter, Scatter
from warpdyn.model.structures.structure import Structure

Correlation = Mapping[tuple[str, str], float]


def check_correlation(structure: Structure, scatter: Scatter, correlation: Correlation) -> None:
    """Raise an error that names the first pair of parameters whose correlation is invalid, and the reason."""
    if not isinstance(correlation, Mapping):
        raise TypeError(
            f"correlation must map pairs of names to values, such as {{('mass', 'stiffness'): 0.5}}, got "
            f"{correlation!r}"
        )
    if correlation and structure.is_many:
        raise ValueError(
            f"correlation of {', '.join(map(str, correlation))}: a scene with a Portfolio has no correlation; give it "
            "to each archetype, Archetype(building, count, scatter, correlation)"
        )
    for pair, value in correlation.items():
        if (
            not isinstance(pair, tuple)
            or len(pair) != 2
            or pair[0] == pair[1]
            or any(not isinstance(scatter.get(name), RandomScatter) for name in pair)
        ):
            raise ValueError(
                f"correlation names {pair}: each key must name two different parameters with random scatter (a "
                "RandomFactor or RandomValue in scatter=)"
            )
        first, second = (scatter[name] for name in pair)
        dims = [structure.dim_of(name) for name in pair]
        assert isinstance(first, RandomScatter)
        assert isinstance(second, RandomScatter)
        if dims[0] != dims[1] and "building" not in (first.per, second.per):
            raise ValueError(
                f"correlation names {pair}: {pair[0]} has one draw per {dims[0]} and {pair[1]} one per {dims[1]}, so "
                f"that no value of one belongs to a value of the other: give one of them per='building', or remove the "
                "correlation"
            )
        if not abs(real_number(f"correlation of {pair}", value)) <= 1:
            raise ValueError(f"correlation of {pair} must be from -1 to 1, got {value}")
        if (pair[1], pair[0]) in correlation:
            raise ValueError(f"correlation of {pair} is given twice, in both orders: remove one of the two entries")
    correlation_factor(structure, scatter, correlation)


def correlation_factor(
    structure: Structure, scatter: Scatter, correlation: Correlation
) -> tuple[list[tuple[str, int]], np.ndarray]:
    """Return the random variables as (parameter, storey), and the factor L of their correlation matrix L L^T.

    L is lower triangular. A given correlation of two parameters applies to their values in the same storey. Between
    different storeys, it is multiplied by the geometric mean of the storey correlations of the two parameters. If one
    parameter has a single value for the building, the given correlation applies to every storey of the other parameter.
    """
    random = {name: spread for name, spread in scatter.items() if isinstance(spread, RandomScatter)}
    variables = [
        (name, i) for name, spread in random.items() for i in range(spread.variables(structure.length_of(name)))
    ]
    matrix = np.eye(len(variables))
    if not correlation and not any(spread.storey_correlation for spread in random.values()):
        return variables, matrix
    for row, (p, i) in enumerate(variables):
        for column, (q, j) in enumerate(variables[:row]):
            value = 1.0 if p == q else correlation.get((p, q), correlation.get((q, p), 0.0))
            if i != j and random[p].per == random[q].per != "building":
                value *= np.sqrt(random[p].storey_correlation * random[q].storey_correlation)
            matrix[row, column] = matrix[column, row] = value
    if not variables:
        return variables, matrix
    eigenvalues, vectors = np.linalg.eigh(matrix)
    if eigenvalues[0] < -1e-10:
        raise ValueError(
            f"the correlations contradict each other: their matrix has eigenvalue {eigenvalues[0]:.3g}; "
            "reduce a correlation between parameters, or increase a storey_correlation"
        )
    # The QR decomposition of the symmetric root gives a triangular factor, even if a correlation is exactly 1 and the
    # Cholesky decomposition fails.
    factor = np.asarray(np.linalg.qr((vectors * np.sqrt(np.maximum(eigenvalues, 0))).T, mode="r")).T
    factor *= np.where(np.diag(factor) < 0, -1.0, 1.0)
    factor[np.abs(factor) < 1e-14] = 0.0
    return variables, factor
