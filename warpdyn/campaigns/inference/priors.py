"""The prior of a calibration: scattered parameters of a structure as functions of standard normal variables."""

from __future__ import annotations

from collections.abc import Callable, Mapping

import numpy as np
from scipy.special import ndtr

from warpdyn.engine.laws.parameter import Parameter
from warpdyn.model.scene.correlation import check_correlation, correlation_factor
from warpdyn.model.scene.distributions.distribution import Distribution
from warpdyn.model.scene.distributions.numerical import Empirical
from warpdyn.model.scene.scatter import (
    GivenValues,
    RandomFactor,
    RandomScatter,
    Scatter,
    check_scatter,
    combined,
)
from warpdyn.model.structures.physics import physics_problem
from warpdyn.model.structures.structure import Structure

# Largest probability of a prior outside of the bounds of its parameter. Above, the user must correct the prior; below,
# such candidates count as impossible.
MOST_OUTSIDE = 1e-6

Values = dict[str, np.ndarray]


class Prior:
    """The prior of the scattered parameters of a structure.

    Args:
        structure: The structure with the nominal values of all parameters.
        scatter: RandomFactor or RandomValue of each calibrated parameter.
        correlation: Correlation of pairs of scattered parameters [1].

    Raises:
        ValueError, TypeError: If no parameter is random, a parameter is unknown or given, its prior is discrete, or its
            prior exceeds the bounds of the parameter.
    """

    def __init__(self, structure: Structure, scatter: Scatter, correlation: Mapping[tuple[str, str], float]) -> None:
        check_scatter(structure, scatter)
        if not scatter:
            raise ValueError(
                "calibrate: no parameter has a prior. Give scatter= to the Scene, or priors={'stiffness': "
                "wd.Lognormal(3e7, 0.5), ...} for a law"
            )
        for name, spread in scatter.items():
            if not isinstance(spread, RandomScatter):
                raise TypeError(
                    f"calibrate: the scatter of {name} must be RandomFactor or RandomValue, which are its prior, got "
                    f"{spread!r}"
                )
            check_prior(name, spread.distribution)
            nominal = structure.nominal_values[name]
            factors = nominal[~np.isnan(nominal)] if isinstance(spread, RandomFactor) else np.ones(1)
            if isinstance(spread, RandomFactor) and not np.all(factors):
                raise ValueError(
                    f"calibrate: the nominal {name} is 0, which a RandomFactor does not change: give a RandomValue, "
                    f"or a nominal {name} other than 0"
                )
            for factor in np.unique(factors):
                check_bounds(name, spread.distribution, structure.parameter_table[name], float(factor))
        check_correlation(structure, scatter, correlation)
        self.structure, self.scatter = structure, scatter
        self._factor = correlation_factor(structure, scatter, correlation)[1]
        # Variables that a correlation of 1 or -1 determines have no column.
        self._factor = self._factor[:, np.abs(self._factor).max(axis=0) > 1e-7]

    @property
    def variables(self) -> int:
        """Number of independent standard normal variables."""
        return int(self._factor.shape[1])

    def values(self, normals: np.ndarray) -> Values:
        """Return the parameters as {name: values [candidate, storey] or [candidate]}, from [candidate, variable]."""
        of_variables, found, end = self._factor @ normals.T, {}, 0
        for name, spread in self.scatter.items():
            first, end = end, end + spread.variables(self.structure.length_of(name))
            nominal, varied = self.structure.nominal_values[name], spread.varied(name, self.structure)
            drawn = combined(nominal, spread, of_variables[first:end], slice(None), varied)
            found[name] = np.ascontiguousarray(self.structure.tied(name, drawn).T)
        return found

    def allowed(self, values: Values) -> np.ndarray:
        """Return which candidates have parameters within their bounds that do not contradict each other."""
        count = len(next(iter(values.values())))
        allowed = np.ones(count, bool)
        for name, each in values.items():
            outside = np.asarray(self.structure.parameter_table[name].violations(each))
            allowed &= ~(outside & ~np.isnan(each)).reshape(count, -1).any(axis=1)
        nominal = {name: value for name, value in self.structure.parameters.items() if name not in values}

        def fits(rows: np.ndarray) -> bool:
            everything = {**nominal, **{name: each[rows] for name, each in values.items()}}
            return not (self.structure.problem(everything) or physics_problem(everything))

        _exclude(allowed, np.flatnonzero(allowed), fits)
        return allowed

    def shown(self, values: Values) -> Values:
        """Return candidates for a dataset: a parameter that is equal in all storeys has the shape [candidate]."""
        found: Values = {}
        for name, each in values.items():
            spread = self.scatter[name]
            assert isinstance(spread, RandomScatter)
            is_one = each.ndim == 2 and spread.per == "building" and spread.only is None
            found[name] = each[:, 0] if is_one and bool(np.all(each == each[:, :1])) else each
        return found

    def as_scatter(self, values: Values) -> dict[str, GivenValues]:
        """Return candidates as the scatter of a scene; factors remain factors on the nominal values."""
        return {name: GivenValues(each) for name, each in values.items()}


def _exclude(allowed: np.ndarray, rows: np.ndarray, fits: Callable[[np.ndarray], bool]) -> None:
    """Set `allowed` to False for the rows that do not fit; a check of many rows names only the first of them."""
    if not rows.size or fits(rows):
        return
    if rows.size == 1:
        allowed[rows] = False
        return
    half = rows.size // 2
    _exclude(allowed, rows[:half], fits)
    _exclude(allowed, rows[half:], fits)


def check_prior(name: str, distribution: Distribution) -> None:
    """Raise a TypeError if a prior is discrete."""
    if isinstance(distribution, Empirical):
        raise TypeError(
            f"the prior of {name} is Empirical, whose values are discrete, so that candidates cannot move: give a "
            "continuous distribution, such as wd.Lognormal(median, dispersion)"
        )


def check_bounds(name: str, prior: Distribution, parameter: Parameter, factor: float = 1.0) -> None:
    """Raise a ValueError if a prior, times `factor`, is often outside of the bounds of its parameter."""
    low, high = sorted((parameter.low / factor, parameter.high / factor))
    below = float(ndtr(prior.to_standard_normal(low))) if np.isfinite(low) else 0.0
    above = float(ndtr(-prior.to_standard_normal(high))) if np.isfinite(high) else 0.0
    if prior.from_standard_normal(np.array([-40.0]))[0] >= low:
        below = 0.0  # the distribution ends at the bound
    if below + above <= MOST_OUTSIDE:
        return
    limits = f"low={low:g}" if below > above else f"high={high:g}"
    raise ValueError(
        f"the prior of {name}, {prior!r}, is outside of the bounds of {name} ({parameter.allowed}) with a "
        f"probability of {below + above:.2g}: give another prior, such as wd.Truncated({prior!r}, {limits})"
    )
