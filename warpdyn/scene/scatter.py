"""Scatter: what is random about the structures, as data: distributions, factors on parameters, correlations."""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import dataclass
from numbers import Real

import numpy as np
from numpy.typing import ArrayLike
from scipy.special import ndtr

from warpdyn.core.checks import finite_numbers, one_of, real_number, real_numbers
from warpdyn.structures.shear_building import BUILDING_PARAMETERS, LinearSystem, ShearBuilding


@dataclass(frozen=True)
class Normal:
    """A normal distribution.

    Args:
        mean: Mean.
        standard_deviation: Standard deviation, at least 0.
    """

    mean: float
    standard_deviation: float

    def __post_init__(self) -> None:
        real_number("Normal.mean", self.mean)
        real_number("Normal.standard_deviation", self.standard_deviation, least=0)

    def from_standard_normal(self, z: np.ndarray) -> np.ndarray:
        """Return the values at standard normal values z."""
        return self.mean + self.standard_deviation * z


@dataclass(frozen=True)
class Lognormal:
    """A lognormal distribution, by its median and dispersion.

    Args:
        median: Median, above 0.
        dispersion: Standard deviation of the natural logarithm, at least 0.
    """

    median: float
    dispersion: float

    def __post_init__(self) -> None:
        real_number("Lognormal.median", self.median, above=0)
        real_number("Lognormal.dispersion", self.dispersion, least=0)

    @classmethod
    def from_mean(cls, mean: float, cov: float) -> Lognormal:
        """Return the distribution of a given mean and coefficient of variation (standard deviation over mean)."""
        real_number("mean", mean, above=0)
        real_number("cov", cov, least=0)
        return cls(mean / float(np.sqrt(1 + cov**2)), float(np.sqrt(np.log1p(cov**2))))

    def from_standard_normal(self, z: np.ndarray) -> np.ndarray:
        """Return the values at standard normal values z."""
        return self.median * np.exp(self.dispersion * z)


@dataclass(frozen=True)
class Uniform:
    """A uniform distribution between two bounds.

    Args:
        low: Lower bound.
        high: Upper bound, above the lower.
    """

    low: float
    high: float

    def __post_init__(self) -> None:
        real_number("Uniform.high", self.high, above=real_number("Uniform.low", self.low))

    def from_standard_normal(self, z: np.ndarray) -> np.ndarray:
        """Return the values at standard normal values z."""
        return self.low + (self.high - self.low) * ndtr(z)


Distribution = Normal | Lognormal | Uniform


@dataclass(frozen=True)
class RandomFactor:
    """Scatter that multiplies the nominal value of a parameter.

    Args:
        distribution: Distribution of the factor.
        per: "building" (one draw for all storeys) or "storey" (one draw each).
        storey_correlation: Correlation between two storeys' draws, 0 to 1, for `per="storey"`.

    Raises:
        ValueError: If `per` is unknown or the correlation is out of range or has no storeys to join.
    """

    distribution: Distribution
    per: str = "building"
    storey_correlation: float = 0.0

    def __post_init__(self) -> None:
        if not isinstance(self.distribution, Distribution):
            raise TypeError(f"distribution must be Normal, Lognormal or Uniform, got {self.distribution!r}")
        one_of("per", self.per, ("building", "storey"))
        if real_number("storey_correlation", self.storey_correlation, least=0) > 1:
            raise ValueError(f"storey_correlation must be at most 1, got {self.storey_correlation}")
        if self.storey_correlation and self.per == "building":
            raise ValueError("storey_correlation needs per='storey': one draw for the building is common to all")


@dataclass(frozen=True)
class RandomValue(RandomFactor):
    """Scatter that replaces the nominal value of a parameter; arguments as for RandomFactor."""


@dataclass(frozen=True, eq=False)
class GivenValues:
    """Values that are given, one a structure, in place of random ones: a design of experiments, or one's own samples.

    Args:
        values: The parameter's values in its units, shape [structure] or, if it has one a storey, [structure, storey];
            of a LinearSystem the factors on its matrix, shape [structure]. A storey whose law does not take the
            parameter may have NaN throughout.

    Raises:
        ValueError: If a value is not finite or the shape is another.
    """

    values: ArrayLike

    def __post_init__(self) -> None:
        values = real_numbers("GivenValues.values", self.values)
        if values.ndim not in (1, 2) or not values.size:
            raise ValueError(
                f"GivenValues.values must have shape [structure] or [structure, storey], got {values.shape}"
            )
        left_out = np.isnan(values).all(axis=0) & (values.ndim == 2)
        finite_numbers("GivenValues.values", np.where(left_out, 0.0, values))
        values.flags.writeable = False
        object.__setattr__(self, "values", values)


Scatter = Mapping[str, RandomFactor | RandomValue | GivenValues | float]
SAMPLING = ("monte_carlo", "latin_hypercube", "sobol")


def check_scatter(
    structure: ShearBuilding | LinearSystem, scatter: Scatter, correlation: Mapping[tuple[str, str], float]
) -> None:
    """Raise an error that names the entry of a scatter or correlation that does not fit the structure."""
    for what, given in (("scatter", scatter), ("correlation", correlation)):
        if not isinstance(given, Mapping):
            raise TypeError(f"{what} must map names to values, got {given!r}")
    allowed = ", ".join(structure.parameter_table)
    for name, spread in scatter.items():
        if name not in structure.parameter_table:
            raise ValueError(f"scatter names unknown parameter {name!r}; {structure!r} has {allowed}")
        if isinstance(spread, Real) and not isinstance(spread, bool):
            problem = structure.parameter_table[name].first_violation(f"scatter[{name!r}]", np.array(float(spread)), ())
            if problem:
                raise ValueError(problem)
        elif isinstance(spread, GivenValues):
            by_storey = structure.family == "chain" and name not in BUILDING_PARAMETERS
            if spread.values.ndim == 2 and (not by_storey or spread.values.shape[1] != structure.dofs):
                wanted = f"[structure, {structure.dofs}] or [structure]" if by_storey else "[structure]"
                raise ValueError(f"scatter[{name!r}] lists values of shape {spread.values.shape}; it must be {wanted}")
            missing = np.isnan(spread.values).any(axis=0) & ~np.isnan(nominal_values(structure)[name])
            for storey in np.flatnonzero(missing):
                raise ValueError(f"scatter[{name!r}] lists nan at storey {storey + 1}, whose law takes {name}")
            continue
        elif not isinstance(spread, RandomFactor):
            raise TypeError(
                f"scatter[{name!r}] must be a RandomFactor, a RandomValue, GivenValues or a number, got {spread!r}"
            )
        elif spread.per == "storey" and (structure.family != "chain" or name in BUILDING_PARAMETERS):
            raise ValueError(f"scatter[{name!r}]: {name} has no values by storey; use per='building'")
        if structure.family == "dense" and type(spread) is not RandomFactor:
            raise ValueError(f"scatter[{name!r}]: a matrix can only be scaled, by a RandomFactor")
    for pair, value in correlation.items():
        if (
            not isinstance(pair, tuple)
            or len(pair) != 2
            or pair[0] == pair[1]
            or any(not isinstance(scatter.get(name), RandomFactor) for name in pair)
        ):
            raise ValueError(f"correlation names {pair}: it must be two different parameters with random scatter")
        if not abs(real_number(f"correlation of {pair}", value)) <= 1:
            raise ValueError(f"correlation of {pair} must be from -1 to 1, got {value}")
        if (pair[1], pair[0]) in correlation:
            raise ValueError(f"correlation of {pair} is given twice")
    correlation_factor(structure, scatter, correlation)


def correlation_factor(
    structure: ShearBuilding | LinearSystem, scatter: Scatter, correlation: Mapping[tuple[str, str], float]
) -> tuple[list[tuple[str, int]], np.ndarray]:
    """Return the random variables as (parameter, storey) and the lower factor L of their correlation matrix L L^T.

    Two parameters have their correlation at the same storey; at different storeys it is times the geometric mean of
    their storey correlations. A parameter drawn once for the building has it with every storey.
    """
    variables: list[tuple[str, int]] = []
    for name, spread in scatter.items():
        variables += [(name, i) for i in range(variables_of(structure, spread))]
    matrix = np.eye(len(variables))
    for row, (p, i) in enumerate(variables):
        for column, (q, j) in enumerate(variables[:row]):
            value = 1.0 if p == q else correlation.get((p, q), correlation.get((q, p), 0.0))
            if i != j and scatter[p].per == scatter[q].per == "storey":
                value *= np.sqrt(scatter[p].storey_correlation * scatter[q].storey_correlation)
            matrix[row, column] = matrix[column, row] = value
    if not variables:
        return variables, matrix
    eigenvalues, vectors = np.linalg.eigh(matrix)
    if eigenvalues[0] < -1e-10:
        raise ValueError(
            f"the correlations contradict each other: their matrix has eigenvalue {eigenvalues[0]:.3g}; "
            "lower a correlation between parameters, or raise a storey_correlation"
        )
    # QR of the symmetric root gives a triangular factor where Cholesky would fail: at correlations of exactly 1.
    factor = np.linalg.qr((vectors * np.sqrt(np.maximum(eigenvalues, 0))).T, mode="r").T
    factor *= np.where(np.diag(factor) < 0, -1.0, 1.0)
    factor[np.abs(factor) < 1e-14] = 0.0
    return variables, factor


def central(structure: ShearBuilding | LinearSystem, scatter: Scatter) -> dict[str, np.ndarray]:
    """Return the scattered parameters at the middle of their distributions, of shape [storey] or []."""
    middle = _at(structure, scatter, np.zeros(1))
    return {
        name: np.median(values, axis=0) if isinstance(scatter[name], GivenValues) else values[0]
        for name, values in middle.items()
    }


def representative(structure: ShearBuilding | LinearSystem, scatter: Scatter) -> dict[str, np.ndarray]:
    """Return values of the scattered parameters that are all alike only where all that can be drawn are.

    They are those at two places of each distribution, or all that are listed, of shape [value, storey] or [value].
    """
    return _at(structure, scatter, np.array([0.0, 1.0]))


def _at(structure: ShearBuilding | LinearSystem, scatter: Scatter, z: np.ndarray) -> dict[str, np.ndarray]:
    """Return the scattered parameters at some standard normal values of their distributions; all of those listed."""
    values, nominal = {}, nominal_values(structure)
    for name, spread in scatter.items():
        normals = np.broadcast_to(z, (variables_of(structure, spread), z.size))
        rows = np.arange(len(spread.values) if isinstance(spread, GivenValues) else z.size)
        values[name] = combined(nominal[name], spread, normals, rows).T
    return values


def nominal_values(structure: ShearBuilding | LinearSystem) -> Mapping[str, np.ndarray]:
    """Return what scatter multiplies or replaces, of shape [storey] or []; of a LinearSystem factors on matrices."""
    values = structure.parameters
    return values if structure.family == "chain" else dict.fromkeys(values, np.array(1.0))


def variables_of(
    structure: ShearBuilding | LinearSystem, spread: RandomFactor | RandomValue | GivenValues | float
) -> int:
    """Return how many random variables a parameter's scatter has."""
    if not isinstance(spread, RandomFactor):
        return 0
    return structure.dofs if spread.per == "storey" else 1


def combined(
    nominal: np.ndarray,
    spread: RandomFactor | RandomValue | GivenValues | float,
    normals: np.ndarray,
    structures: np.ndarray,
) -> np.ndarray:
    """Return a parameter's values [storey, structure] or [structure], of its normal values [variable, structure]."""
    shape = (*nominal.shape, structures.size)
    if isinstance(spread, GivenValues):
        values = np.broadcast_to(spread.values[structures].T, shape)
    elif not isinstance(spread, RandomFactor):
        values = np.full(shape, float(spread))
    else:
        values = spread.distribution.from_standard_normal(normals)
        if not nominal.ndim:
            values = values[0]
        values = nominal[..., None] * values if type(spread) is RandomFactor else np.broadcast_to(values, shape)
    taken = storeys_with(nominal)
    return values if taken is None else np.where(taken[:, None], values, np.nan)


def storeys_with(nominal: np.ndarray) -> np.ndarray | None:
    """Return at which storeys a nominal value is one: whose law takes the parameter; None if all do."""
    missing = np.isnan(nominal)
    return ~missing if missing.any() else None
