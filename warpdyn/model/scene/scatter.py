"""Scatter: random or given parameter values that differ between the structures of a scene."""

from __future__ import annotations

from abc import abstractmethod
from collections.abc import Mapping, Sequence
from dataclasses import dataclass
from typing import Any

import numpy as np

from warpdyn.foundations.core.checks import finite_numbers, one_of, real_number, real_numbers, shortened, whole_number
from warpdyn.foundations.core.frozen_values import FrozenArrays
from warpdyn.foundations.core.near_misses import did_you_mean, with_suggestions
from warpdyn.model.scene.distributions.distribution import Distribution
from warpdyn.model.scene.distributions.numerical import as_distribution
from warpdyn.model.scene.parameter_scatter import ParameterScatter, also_of_added_storeys
from warpdyn.model.structures.structure import Structure

# A draw applies to all storeys (springs, degrees of freedom, members) of a structure, or to one of them.
PER = ("building", "storey", "spring", "dof", "member")


@dataclass(frozen=True)
class RandomScatter(ParameterScatter):
    """Base class of RandomFactor and RandomValue: scatter of a parameter that is drawn from a distribution."""

    distribution: Distribution
    per: str = "building"
    storey_correlation: float = 0.0
    only: str | Sequence[str] | Sequence[int] | None = None

    def __post_init__(self) -> None:
        object.__setattr__(self, "distribution", as_distribution(self.distribution))
        one_of("per", self.per, PER)
        if real_number("storey_correlation", self.storey_correlation, least=0) > 1:
            raise ValueError(f"storey_correlation must be at most 1, got {self.storey_correlation}")
        if self.storey_correlation and self.per == "building":
            raise ValueError(
                "storey_correlation needs per='storey' (or 'spring', 'dof'): with per='building' one draw applies to "
                "all storeys. Give per='storey', or remove storey_correlation"
            )
        if self.only is not None:
            object.__setattr__(self, "only", _places(self.only))

    def description(self) -> dict[str, Any]:
        """Return the scatter as a dictionary, for the JSON of its scene."""
        told: dict[str, Any] = {"type": type(self).__name__, "distribution": self.distribution, "per": self.per}
        told |= {"storey_correlation": self.storey_correlation}
        return told if self.only is None else {**told, "only": self.only}

    def varied(self, name: str, structure: Structure) -> np.ndarray | None:
        """Return which values of a parameter are drawn, shape [place]; the others are nominal. None: all are drawn."""
        return structure.varied(name, self.only)  # type: ignore[arg-type] # a tuple after the check

    def variables(self, storeys: int) -> int:
        """Return the number of random variables: one per storey, or one for the building, according to `per`."""
        return 1 if self.per == "building" else storeys

    def problem(self, name: str, structure: Structure) -> str | None:
        """Return a message if the scatter does not fit the parameter `name` of the structure; None if it fits."""
        if self.only is not None and (problem := structure.only_problem(name, self.only)):  # type: ignore[arg-type]
            return f"scatter[{name!r}]: {problem}"
        if self.per == "building":
            return None
        if not structure.is_by_storey(name):
            return f"scatter[{name!r}]: {name} has one value for the building; use per='building'"
        if self.per != (dim := structure.dim_of(name)):
            return f"scatter[{name!r}]: {name} has one value per {dim}; use per={dim!r} or per='building'"
        return None

    def draw(self, nominal: np.ndarray, normals: np.ndarray, structures: np.ndarray | slice) -> np.ndarray:
        """Return the random values of the parameter, shape [storey, structure] or [structure]."""
        drawn = self.distribution.from_standard_normal(normals)
        return self.applied(nominal[..., None], drawn if nominal.ndim else drawn[0])

    @abstractmethod
    def applied(self, nominal: np.ndarray, drawn: np.ndarray) -> np.ndarray:
        """Return the parameter's values from its nominal value and its random numbers, whose shapes broadcast."""


def _places(only: object) -> tuple[str, ...] | tuple[int, ...]:
    """Return the argument `only` as a tuple of names or of storey numbers, or raise an error."""
    places = (only,) if isinstance(only, str | int) else only
    if isinstance(places, list | tuple | range | np.ndarray) and len(places):
        if all(isinstance(each, str) for each in places):
            return tuple(map(str, places))
        if not any(isinstance(each, str) for each in places):
            return tuple(whole_number("only", each, least=1) for each in places)
    raise TypeError(
        "only must be storeys, such as only=range(1, 5) for storeys 1 to 4, or names of springs, degrees of freedom or "
        f"groups, such as only=('soil',), got {shortened(only)}"
    )


@with_suggestions
@dataclass(frozen=True)
class RandomFactor(RandomScatter):
    """A random factor that multiplies the nominal value of a parameter.

    Args:
        distribution: Distribution of the factor [1]: Normal, Lognormal, Uniform, Truncated, Empirical, or a frozen
            continuous distribution of scipy.stats.
        per: "building" (one draw for all storeys, springs or degrees of freedom), "storey" (one draw per storey) or,
            of a LumpedStructure, "spring" or "dof", or of a reduced Frame "member".
        storey_correlation: Correlation between the draws of two storeys [1], 0 to 1; needs `per="storey"`.
        only: Storeys of a building whose values are drawn, such as `range(2, 6)` for storeys 2 to 5; or names of
            springs, degrees of freedom or groups of a LumpedStructure, or of members or sections of a reduced Frame.
            The others have their nominal values. None: all storeys, including those of isolators and of a tuned mass
            damper; of a LumpedStructure, all except those of the groups "equipment", "absorber", "soil" and
            "contact", unless only these have the parameter.

    Raises:
        TypeError, ValueError: If `distribution` or `per` is invalid, `only` is not in the structure, or
            `storey_correlation` is out of range or given with `per="building"`.

    Example:
        >>> own = wd.RandomFactor(wd.Lognormal(1.0, 0.2), per="storey", storey_correlation=0.5)
        >>> correlation = {("stiffness", "yield_force"): 0.7}
        >>> wd.Scene(building, stripes, {"stiffness": own, "yield_force": own}, correlation).sampling
        'sobol'
    """

    def applied(self, nominal: np.ndarray, drawn: np.ndarray) -> np.ndarray:
        """Return the nominal value of the parameter times the random factors `drawn`, broadcast to one shape."""
        return nominal * drawn


@with_suggestions
@dataclass(frozen=True)
class RandomValue(RandomScatter):
    """A random value that replaces the nominal value of a parameter.

    Args:
        distribution: Distribution of the value, in the parameter's units: Normal, Lognormal, Uniform, Truncated,
            Empirical, or a frozen continuous distribution of scipy.stats.
        per: "building" (one draw for all storeys, springs or degrees of freedom), "storey" (one draw per storey) or,
            of a LumpedStructure, "spring" or "dof", or of a reduced Frame "member".
        storey_correlation: Correlation between the draws of two storeys [1], 0 to 1; needs `per="storey"`.
        only: Storeys of a building whose values are drawn, such as `range(2, 6)` for storeys 2 to 5; or names of
            springs, degrees of freedom or groups of a LumpedStructure, or of members or sections of a reduced Frame.
            The others have their nominal values. None: all storeys, including those of isolators and of a tuned mass
            damper; of a LumpedStructure, all except those of the groups "equipment", "absorber", "soil" and
            "contact", unless only these have the parameter.

    Raises:
        TypeError, ValueError: If `distribution` or `per` is invalid, `only` is not in the structure, or
            `storey_correlation` is out of range or given with `per="building"`.

    Example:
        >>> wd.Scene(building, stripes, {"damping_ratio": wd.RandomValue(wd.Uniform(0.02, 0.08))}).sampling
        'sobol'
    """

    def problem(self, name: str, structure: Structure) -> str | None:
        """Return a message if the scatter does not fit the parameter `name` of the structure; None if it fits."""
        if structure.is_scaled:
            return f"scatter[{name!r}]: a matrix can only be scaled; give RandomFactor(...) instead of RandomValue(...)"
        if self.per == "building" and self.only is None and (also := also_of_added_storeys(name, structure)):
            return f"{also}: give only=, such as only=range(1, 4) or only='building', to RandomValue"
        return super().problem(name, structure)

    def applied(self, nominal: np.ndarray, drawn: np.ndarray) -> np.ndarray:
        """Return the random values `drawn`, broadcast with the shape of the nominal value of the parameter."""
        return np.broadcast_to(drawn, np.broadcast_shapes(nominal.shape, drawn.shape))


@with_suggestions
@dataclass(frozen=True, eq=False)
class GivenValues(FrozenArrays, ParameterScatter):
    """Given parameter values, one per structure, such as the values of a design of experiments.

    Args:
        values: Values in the parameter's units, shape [structure] or, if the parameter has one value per storey,
            [structure, storey]. For a LinearSystem: factors on its matrix, shape [structure]. If the law of a storey
            does not have the parameter, the storey's values may be NaN.

    Raises:
        ValueError: If a value is not finite or the shape is wrong.

    Example:
        >>> strengths = wd.GivenValues([[2.5e5, 2e5], [3e5, 2e5], [3.5e5, 2.5e5]])  # N, one row per structure
        >>> wd.Scene(building, stripes, {"yield_force": strengths}).structures_given
        3
    """

    def __repr__(self) -> str:
        return f"GivenValues(of {len(self.values)} structures)"

    values: Any  # an array after the constructor has checked the argument

    def __post_init__(self) -> None:
        kind = type(self).__name__
        values = real_numbers(f"{kind}.values", self.values)
        if values.ndim not in (1, 2) or not values.size:
            raise ValueError(f"{kind}.values must have shape [structure] or [structure, storey], got {values.shape}")
        left_out = np.isnan(values).all(axis=0) & (values.ndim == 2)
        finite_numbers(f"{kind}.values", np.where(left_out, 0.0, values))
        values.flags.writeable = False
        object.__setattr__(self, "values", values)

    def rows(self, count: int) -> slice:
        """Return a slice that selects all structures with given values; indices would copy the values."""
        return slice(None)

    def problem(self, name: str, structure: Structure) -> str | None:
        """Return a message if the values do not fit the parameter `name` of the structure; None if they fit."""
        if problem := self.shape_problem(name, structure):
            return problem
        if self.values.ndim == 1 and (also := also_of_added_storeys(name, structure)):
            shape = f"[structure, {structure.length_of(name)}], one value per {structure.dim_of(name)}"
            return f"{also}: give GivenValues of shape {shape}"
        return self.missing_problem(name, structure)

    def shape_problem(self, name: str, structure: Structure) -> str | None:
        """Return a message if the shape of the values is not that of the parameter `name`; None if it fits."""
        by_storey = structure.is_by_storey(name)
        if self.values.ndim == 2 and (not by_storey or self.values.shape[1] != structure.length_of(name)):
            wanted = f"[structure, {structure.length_of(name)}] or [structure]" if by_storey else "[structure]"
            return f"scatter[{name!r}] lists values of shape {self.values.shape}; it must be {wanted}"
        return None

    def missing_problem(self, name: str, structure: Structure) -> str | None:
        """Return a message if a storey whose law has the parameter `name` lacks a value; None if all have one."""
        missing = np.isnan(self.values).any(axis=0) & ~np.isnan(structure.nominal_values[name])
        for storey in np.flatnonzero(missing):
            return f"scatter[{name!r}] lists nan at storey {storey + 1}, whose law needs {name}"
        return None

    def draw(self, nominal: np.ndarray, normals: np.ndarray, structures: np.ndarray | slice) -> np.ndarray:
        """Return the given values of the parameter in the structures, shape [storey, structure] or [structure]."""
        return self.placed(self.values[structures], nominal)

    def in_structures(self, nominal: np.ndarray) -> np.ndarray:
        """Return the parameter's values in all structures, shape [structure] or [structure, storey], as given."""
        found: np.ndarray = self.values
        return found

    def placed(self, values: Any, nominal: np.ndarray) -> Any:
        """Return values [structure, ...] in the shape of a result of `draw`: [storey, structure] or [structure]."""
        return np.broadcast_to(values.T, (*nominal.shape, len(values)))


@with_suggestions
class GivenFactors(GivenValues):
    """Given factors on the nominal value of a parameter, one per structure, such as factors on a stiffness profile.

    Args:
        values: Factors [1], shape [structure] (one factor for all storeys, springs or degrees of freedom of a
            structure, which keep their profile) or, if the parameter has one value per storey, [structure, storey].

    Raises:
        ValueError: If a factor is not finite or the shape is wrong.

    Example:
        >>> factors = wd.GivenFactors([0.8, 1.0, 1.2])  # on the stiffnesses of both storeys of three structures
        >>> wd.Scene(building, stripes, {"stiffness": factors}).structures_given
        3
    """

    def __repr__(self) -> str:
        return f"GivenFactors(of {len(self.values)} structures)"

    def problem(self, name: str, structure: Structure) -> str | None:
        """Return a message if the factors do not fit the parameter `name` of the structure; None if they fit."""
        return self.shape_problem(name, structure) or self.missing_problem(name, structure)

    def in_structures(self, nominal: np.ndarray) -> np.ndarray:
        """Return the parameter's values in all structures, shape [structure] or [structure, storey]."""
        found: np.ndarray = self.placed(self.values, nominal).T
        return found

    def placed(self, values: Any, nominal: np.ndarray) -> Any:
        """Return nominal values times factors [structure, ...], shape [storey, structure] or [structure]."""
        return nominal[..., None] * values.T


class DrawnValues(GivenValues):
    """Values that were drawn for the buildings of a portfolio, also of parameters that users cannot give singly."""


Scatter = Mapping[str, RandomFactor | RandomValue | GivenValues | GivenFactors]
SAMPLING = ("monte_carlo", "latin_hypercube", "sobol")


def check_scatter(structure: Structure, scatter: Scatter) -> None:
    """Raise an error that names the first entry of `scatter` that does not fit the structure."""
    if not isinstance(scatter, Mapping):
        raise TypeError(
            "scatter must map names of parameters to random or given values, such as "
            f"{{'stiffness': wd.RandomFactor(wd.Lognormal(1.0, 0.2))}}, got {scatter!r}"
        )
    if scatter and structure.is_many:
        raise ValueError(
            f"scatter of {', '.join(scatter)}: a scene with a Portfolio has no scatter; give it to each archetype, "
            "Archetype(building, count, scatter)"
        )
    for name, spread in scatter.items():
        if name not in structure.parameter_table:
            possible = [
                each
                for each in structure.parameter_table
                if structure.scatter_problem(each, is_common_factor=False) is None
                or structure.scatter_problem(each, is_common_factor=True) is None
            ]
            hint, allowed = did_you_mean(name, possible), ", ".join(possible)
            raise ValueError(f"scatter names unknown parameter {name!r}{hint}; parameters of {structure!r}: {allowed}")
        if not isinstance(spread, ParameterScatter):
            raise TypeError(
                f"scatter[{name!r}] must be RandomFactor, RandomValue, GivenValues or GivenFactors, got {spread!r}: "
                f"give one value for all structures as {name}= of the structure, one value per structure as "
                f"GivenValues([...]), and a dispersion as RandomFactor(Lognormal(1.0, dispersion))"
            )
        is_of_one = isinstance(spread, RandomFactor) and spread.per == "building" and spread.only is None
        problem = None
        if not isinstance(spread, DrawnValues):
            problem = structure.scatter_problem(name, is_common_factor=is_of_one)
        problem = problem or spread.problem(name, structure)
        if problem:
            raise ValueError(problem if problem.startswith("scatter[") else f"scatter[{name!r}]: {problem}")


def central(structure: Structure, scatter: Scatter) -> dict[str, np.ndarray]:
    """Return the median of each scattered parameter, as name -> array of shape [storey] or []."""
    return {name: np.median(values, axis=0) for name, values in _at(structure, scatter, np.zeros(1)).items()}


def representative(structure: Structure, scatter: Scatter) -> dict[str, np.ndarray]:
    """Return two values of each random parameter and all values of GivenValues, shape [value, storey] or [value].

    Storeys that have equal values in the result have equal values in every sample.
    """
    return _at(structure, scatter, np.array([0.0, 1.0]))


def _at(structure: Structure, scatter: Scatter, z: np.ndarray) -> dict[str, np.ndarray]:
    """Return the values of the scattered parameters if their random variables are `z`; for GivenValues, all values."""
    values, nominal = {}, structure.nominal_values
    for name, spread in scatter.items():
        normals = np.broadcast_to(z, (spread.variables(structure.length_of(name)), z.size))
        varied = spread.varied(name, structure)
        values[name] = combined(nominal[name], spread, normals, spread.rows(z.size), varied).T
    return values


def combined(
    nominal: np.ndarray,
    spread: ParameterScatter,
    normals: np.ndarray,
    structures: np.ndarray | slice,
    varied: np.ndarray | None = None,
) -> np.ndarray:
    """Return the result of `ParameterScatter.draw`, with NaN in storeys whose law does not have the parameter.

    Places for which `varied` is False have their nominal values; None: all are drawn.
    """
    return only_at(storeys_with(nominal), only_varied(varied, spread.draw(nominal, normals, structures), nominal))


def only_varied(varied: np.ndarray | None, values: np.ndarray, nominal: np.ndarray) -> np.ndarray:
    """Return drawn values, shape [place, structure], with nominal values in places for which `varied` is False."""
    return values if varied is None else np.where(varied[:, None], values, nominal[:, None])


def only_at(taken: np.ndarray | None, values: np.ndarray) -> np.ndarray:
    """Return values [storey, structure], with NaN in storeys that lack the parameter.

    `taken` states for each storey whether it has the parameter; None: all storeys have it.
    """
    return values if taken is None else np.where(taken[:, None], values, np.nan)


def storeys_with(nominal: np.ndarray) -> np.ndarray | None:
    """Return whether each storey has the parameter (nominal value not NaN), shape [storey]; None: all have it."""
    missing = np.isnan(nominal)
    return ~missing if missing.any() else None
