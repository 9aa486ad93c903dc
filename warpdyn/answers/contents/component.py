"""Components of a building: lognormal fragility by a demand of their storey, and repair costs of damage states."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass

import numpy as np
from numpy.typing import ArrayLike
from scipy.special import ndtr

from warpdyn.campaigns.reductions.limits import DRIFT
from warpdyn.foundations.core.checks import finite_numbers, one_of, real_number, shortened
from warpdyn.foundations.core.messages import warn_caller
from warpdyn.foundations.core.near_misses import with_suggestions

ACCELERATION = "peak_floor_acceleration"
SPECTRUM = "peak_floor_spectral_acceleration"
DEMANDS = (DRIFT, ACCELERATION, SPECTRUM, "residual_drift_ratio")
PLACES = ABOVE, BELOW = "floor_above", "floor_below"
LARGEST_DRIFT_RATIO = 0.3  # larger medians of drift ratios are probably in percent
LARGEST_DISPERSION = 1.5  # larger dispersions are probably in percent
SMALLEST_ACCELERATION = 1.5  # [m/s2]; if all medians are smaller, they are probably in g


@with_suggestions
@dataclass(frozen=True)
class RepairCost:
    """Mean repair cost per unit of a component, which falls with the quantity that is repaired.

    The cost is that of the small quantity up to this quantity, and that of the large quantity from this quantity on.
    Between them it is linear, as in FEMA P-58.

    Args:
        unit_costs: Costs per unit [currency] of a small and of a large quantity.
        quantities: The small and the large quantity [units], increasing.

    Raises:
        ValueError: If there are not two costs of at least 0 and two increasing quantities above 0.

    Example:
        >>> cost = wd.RepairCost(unit_costs=(16536, 10176), quantities=(5, 20))
        >>> cost.per_unit([1, 5, 12.5, 100]).tolist()
        [16536.0, 16536.0, 13356.0, 10176.0]
    """

    unit_costs: Sequence[float]
    quantities: Sequence[float]

    def __post_init__(self) -> None:
        costs = finite_numbers("RepairCost.unit_costs", self.unit_costs)
        quantities = finite_numbers("RepairCost.quantities", self.quantities)
        if costs.shape != (2,) or costs.min() < 0:
            raise ValueError(
                "RepairCost.unit_costs must be 2 costs of at least 0, of a small and of a large quantity, got "
                f"{shortened(self.unit_costs)}"
            )
        if quantities.shape != (2,) or not 0 < quantities[0] < quantities[1]:
            raise ValueError(
                f"RepairCost.quantities must be 2 increasing numbers above 0, got {shortened(self.quantities)}"
            )
        object.__setattr__(self, "unit_costs", tuple(costs.tolist()))
        object.__setattr__(self, "quantities", tuple(quantities.tolist()))

    def per_unit(self, quantity: ArrayLike) -> np.ndarray:
        """Return the cost per unit [currency] if this quantity [units] is repaired."""
        return np.interp(np.asarray(quantity, dtype=np.float64), self.quantities, self.unit_costs)


@with_suggestions
@dataclass(frozen=True)
class Component:
    """A kind of component that is damaged by a demand of its storey, such as partitions, ceilings or equipment.

    The probability that a unit exceeds a limit state at the demand x is Phi(ln(x / median) / dispersion). Where two
    limit states cross, the heavier one is at most as likely as the lighter one. If a limit state has several damage
    states, they exclude each other, and their weights are their probabilities.

    Args:
        demand: "peak_storey_drift_ratio" [1], "residual_drift_ratio" [1], "peak_floor_acceleration" [m/s2], or
            "peak_floor_spectral_acceleration" [m/s2] (with `period`).
        medians: Median capacities of the limit states [unit of the demand], increasing, shape [limit_state].
        dispersions: Logarithmic standard deviations of the capacities [1], shape [limit_state].
        costs: Mean repair cost of a unit in each damage state [currency], numbers or RepairCost objects, shape
            [damage_state]; None: 0.
        weights: Probabilities of the damage states of each limit state [1], one row for each limit state, with the sum
            1. None: one damage state for each limit state.
        place: Floor of the storey whose acceleration counts: "floor_above" (components that hang from it, such as
            ceilings and pipes) or "floor_below" (components fixed to it; in storey 1 this is the ground).
        period: Period of the component [s], one of the run's floor spectra; only for the floor spectrum.
        unit: Unit of the quantity, such as "30 m2".

    Raises:
        ValueError: If the demand or the place is unknown, numbers are out of their range, or rows have different
            lengths.

    Example:
        >>> partition = wd.Component("peak_storey_drift_ratio", [0.005, 0.01], [0.4, 0.3], costs=[2700.0, 6800.0])
        >>> partition.probabilities([0.005, 0.02]).round(2)  # [demand, damage_state]
        array([[0.49, 0.01],
               [0.01, 0.99]])
    """

    demand: str
    medians: Sequence[float]
    dispersions: Sequence[float]
    costs: Sequence[float | RepairCost] | None = None
    weights: Sequence[Sequence[float]] | None = None
    place: str = ABOVE
    period: float | None = None
    unit: str = "1"

    def __post_init__(self) -> None:
        one_of("demand of a Component", self.demand, DEMANDS)
        one_of("place of a Component", self.place, PLACES)
        medians = np.atleast_1d(finite_numbers("Component.medians", self.medians))
        dispersions = np.atleast_1d(finite_numbers("Component.dispersions", self.dispersions))
        if medians.ndim != 1 or not medians.size or medians.min() <= 0 or np.any(np.diff(medians) < 0):
            raise ValueError(f"Component.medians must be increasing numbers above 0, got {shortened(self.medians)}")
        if dispersions.shape != medians.shape or dispersions.min() <= 0:
            raise ValueError(
                f"Component.dispersions must be {medians.size} numbers above 0, one for each limit state, got "
                f"{shortened(self.dispersions)}"
            )
        if (self.period is None) == (self.demand == SPECTRUM):
            raise ValueError(
                f"Component: the demand {SPECTRUM!r} needs period=, and other demands have none: give period= [s] only "
                "for the floor spectrum"
            )
        if self.period is not None:
            object.__setattr__(self, "period", real_number("Component.period [s]", self.period, above=0))
        rows = [[1.0]] * medians.size
        try:
            rows = rows if self.weights is None else [list(row) for row in self.weights]
        except TypeError:  # not a row of rows
            rows = []
        if len(rows) != medians.size:
            raise ValueError(
                f"Component.weights must have one row for each of the {medians.size} limit states, such as "
                f"{[[1.0]] * medians.size}, got {shortened(self.weights)}"
            )
        weights = tuple(tuple(finite_numbers("Component.weights", row).tolist()) for row in rows)
        for row in weights:
            if not row or min(row) < 0 or abs(sum(row) - 1) > 1e-3:
                raise ValueError(f"Component.weights: each row must have the sum 1, got {row}")
        states = sum(map(len, weights))
        costs = [0.0] * states if self.costs is None else list(np.atleast_1d(np.asarray(self.costs, dtype=object)))
        if len(costs) != states:
            raise ValueError(f"Component.costs must be {states} costs, one for each damage state, got {len(costs)}")
        checked = [
            each if isinstance(each, RepairCost) else real_number("Component.costs", each, least=0) for each in costs
        ]
        if self.demand in (DRIFT, "residual_drift_ratio") and medians[-1] > LARGEST_DRIFT_RATIO:
            warn_caller(f"Component: a median drift ratio of {medians[-1]:g} is implausible: 2 % is 0.02")
        if self.demand in (ACCELERATION, SPECTRUM) and medians[-1] < SMALLEST_ACCELERATION:
            warn_caller(
                f"Component: the largest median acceleration is {medians[-1]:g} m/s2: if medians are in g, multiply "
                "them by 9.80665"
            )
        if dispersions.max() > LARGEST_DISPERSION:
            warn_caller(f"Component: a dispersion of {dispersions.max():g} is implausible: 40 % is 0.4")
        for name, value in (("medians", medians), ("dispersions", dispersions)):
            object.__setattr__(self, name, tuple(value.tolist()))
        object.__setattr__(self, "weights", weights)
        object.__setattr__(self, "costs", tuple(checked))

    @property
    def by_floor(self) -> bool:
        """Whether the demand has values at floors; otherwise at storeys."""
        return self.demand not in (DRIFT, "residual_drift_ratio")

    @property
    def recorder(self) -> str:
        """Name of the recorder of the demand."""
        recorders = {DRIFT: "drift", ACCELERATION: "acceleration", SPECTRUM: "floor_spectra"}
        return recorders.get(self.demand, "residual")

    def exceedance(self, demand: ArrayLike) -> np.ndarray:
        """Return the probabilities that a unit exceeds each limit state, shape [..., limit_state].

        Args:
            demand: Demands [unit of the demand], of any shape.
        """
        x = np.asarray(demand, dtype=np.float64)[..., None]
        with np.errstate(divide="ignore"):
            found = ndtr(np.log(x / np.array(self.medians)) / np.array(self.dispersions))
        return np.minimum.accumulate(found, axis=-1)

    def probabilities(self, demand: ArrayLike) -> np.ndarray:
        """Return the probabilities of being in exactly each damage state, shape [..., damage_state].

        Args:
            demand: Demands [unit of the demand], of any shape.
        """
        exceeding = self.exceedance(demand)
        inside = exceeding - np.append(exceeding[..., 1:], np.zeros((*exceeding.shape[:-1], 1)), axis=-1)
        rows: Sequence[Sequence[float]] = self.weights or ()
        shares = [weight * inside[..., place] for place, row in enumerate(rows) for weight in row]
        return np.stack(shares, axis=-1)

    def costs_of(self, quantities: np.ndarray) -> np.ndarray:
        """Return the mean cost per unit in each damage state [currency], of the shape of `quantities`.

        Args:
            quantities: Quantity that is repaired in each damage state [units], shape [..., damage_state].
        """
        found = np.empty(quantities.shape)
        for place, cost in enumerate(self.costs or ()):
            found[..., place] = cost.per_unit(quantities[..., place]) if isinstance(cost, RepairCost) else cost
        return found
