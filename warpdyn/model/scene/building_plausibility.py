"""Find implausible values of a shear building from derived quantities, such as the first period."""

from __future__ import annotations

from collections.abc import Mapping
from functools import cached_property

import numpy as np

from warpdyn.foundations.core.plausibility import PlausibilityFindings
from warpdyn.foundations.core.plausibility.check import LIGHTEST_PENTHOUSE
from warpdyn.foundations.core.plausibility.table import CHECKS
from warpdyn.foundations.core.units import STANDARD_GRAVITY
from warpdyn.model.structures.modal import chain_stiffness_matrix
from warpdyn.model.structures.physics import effective_stiffness, storey_weight_over_height
from warpdyn.model.structures.protection import CAPACITY_RATIO
from warpdyn.model.structures.shear_building import ShearBuilding

Values = Mapping[str, np.ndarray]


def add_building(
    findings: PlausibilityFindings, building: ShearBuilding, values: Values, where: str, *, is_shaken: bool
) -> float:
    """Add a building's implausible values to `findings`; return the longest first period [s], 0 if no row has a period.

    Args:
        findings: Implausible values found so far.
        building: The building.
        values: Parameter values of one or several buildings (rows), shape [row, storey] or [row].
        where: Words that identify the building in the warning, such as " of archetype 'old'", or "".
        is_shaken: Whether ground motions act on the building; without damping, such a building is implausible.
    """
    is_sound = _has_period(values)
    if not is_sound.any():  # the run itself raises an error for values that are out of bounds
        return 0.0
    view = BuildingView(building, {name: rows[is_sound] for name, rows in values.items()}, is_shaken=is_shaken)
    for name, check in CHECKS.items():
        try:
            if check.of_building:
                findings.add(name, check.of_building(view), where)
            elif check.of_storeys:
                findings.add(name, check.of_storeys(view), where, along="storey")
        except _Absent:
            continue
    return float(view.period.max())


class _Absent(Exception):
    """Error: a plausibility check reads a parameter that the building does not have; the check is then skipped."""


class BuildingView:
    """Quantities of one or several buildings (rows) that plausibility checks read, shape [row, storey] or [row].

    A quantity is NaN in storeys to which the plausibility check of this quantity does not apply.

    Args:
        building: The building.
        values: Parameter values, shape [row, storey] or [row].
        is_shaken: Whether ground motions act on the building.
    """

    def __init__(self, building: ShearBuilding, values: Values, *, is_shaken: bool) -> None:
        self.building, self.values, self.is_shaken = building, values, is_shaken
        self.own = building.own_storeys
        self.is_isolated = ~self.own
        self.is_isolated[1:] &= np.arange(1, self.own.size) < self.own.size - 1  # the last: a tuned mass damper
        self.mass_above = np.cumsum(values["mass"][:, ::-1], axis=1)[:, ::-1]
        self.weight_above = STANDARD_GRAVITY * self.mass_above

    def __getitem__(self, name: str) -> np.ndarray:
        if name not in self.values:
            raise _Absent(name)
        return self.values[name]

    def in_own(self, values: np.ndarray) -> np.ndarray:
        """Return the values [row, storey], with NaN in the storeys that are isolators or tuned mass dampers."""
        return np.where(self.own, values, np.nan)

    def in_isolators(self, values: np.ndarray) -> np.ndarray:
        """Return the values [row, storey], with NaN in all storeys except isolators."""
        return np.where(self.is_isolated, values, np.nan)

    @property
    def mass_over_neighbour(self) -> np.ndarray:
        """Ratio of the masses of neighbouring floors, shape [row, storey - 1]; NaN if the top floor is a penthouse."""
        found = self.over_neighbour("mass")
        mass = self["mass"]
        if found.shape[1]:
            is_penthouse = (mass[:, -1] < mass[:, -2]) & (found[:, -1] < LIGHTEST_PENTHOUSE)
            found[:, -1] = np.where(is_penthouse, np.nan, found[:, -1])
        return found

    def above_0(self, name: str) -> np.ndarray:
        """Return the values of a parameter [row, storey], with NaN instead of 0 (no such damper or stop)."""
        return np.where(self[name] > 0, self[name], np.nan)

    def over_neighbour(self, name: str) -> np.ndarray:
        """Return the ratio of the larger to the smaller value of neighbouring storeys, shape [row, storey - 1].

        The ratio is NaN next to isolators and tuned mass dampers.
        """
        values = self.in_own(self.above_0(name))
        return np.fmax(values[:, :-1] / values[:, 1:], values[:, 1:] / values[:, :-1])

    @cached_property
    def first_mode(self) -> tuple[np.ndarray, np.ndarray]:
        """First periods [s], shape [row] (infinite if a storey buckles), and first mode shapes, shape [row, storey]."""
        root = np.sqrt(self["mass"])
        matrix = chain_stiffness_matrix(effective_stiffness(self.values))
        squared, shapes = np.linalg.eigh(matrix / (root[:, :, None] * root[:, None, :]))
        with np.errstate(divide="ignore"):
            return 2 * np.pi / np.sqrt(np.maximum(squared[:, 0], 0.0)), shapes[:, :, 0] / root

    @property
    def period(self) -> np.ndarray:
        """First periods of the buildings [s], shape [row]."""
        return self.first_mode[0]

    @property
    def period_over_height(self) -> np.ndarray:
        """First periods divided by the height of the building [s/m], shape [row]; NaN for buildings with one storey."""
        height = np.where(self.own, self["height"], 0.0).sum(axis=1)
        return np.where(self.own.sum() > 1, self.period / height, np.nan)

    @property
    def displacement_capacity(self) -> np.ndarray:
        """Displacement capacities of isolators and tuned mass dampers [m], shape [row, storey]; NaN elsewhere."""
        return np.where(self.own, np.nan, self["height"] * CAPACITY_RATIO)

    @property
    def drift_ratio_capacity(self) -> np.ndarray:
        """Drift ratios at which storeys collapse [1], shape [row, storey]."""
        return (
            self["drift_capacity"] / self["height"] if "drift_capacity" in self.values else self["drift_ratio_capacity"]
        )

    @property
    def stability_coefficient(self) -> np.ndarray:
        """Largest P-Delta stability coefficient of each building's storeys, shape [row]; NaN without gravity loads."""
        if not self["gravity_load"].any():
            return np.full(1, np.nan)
        return (storey_weight_over_height(self.values) / self["stiffness"]).max(axis=1)

    @property
    def damping_ratio(self) -> np.ndarray:
        """Damping ratios of the first mode due to inherent damping [1], shape [row]; viscous dampers do not count."""
        if "damping_ratio" in self.values:
            return self["damping_ratio"]
        return self._damping(self["damping_coefficient"]) if "damping_coefficient" in self.values else np.zeros(1)

    @property
    def needs_damping(self) -> bool:
        """Whether a building without damping, dampers and stops is excited by ground motions."""
        is_plain = self.is_shaken and not self.building.devices and self.own.all()
        return bool(is_plain and not self.damping_ratio.any())

    def _damping(self, coefficient: np.ndarray) -> np.ndarray:
        """Return damping ratios of the first mode, shape [row], due to storey dashpots with `coefficient` [N s/m]."""
        period, shape = self.first_mode
        drift = np.diff(shape, axis=1, prepend=0.0)
        modal_mass = (self["mass"] * shape**2).sum(axis=1)
        return (coefficient * drift**2).sum(axis=1) * period / (4 * np.pi * modal_mass)

    @property
    def is_power_damper(self) -> np.ndarray:
        """Whether each storey has a nonlinear viscous damper (velocity exponent below 1), shape [row, storey]."""
        return (self["damper_coefficient"] > 0) & (self["velocity_exponent"] < 1)

    @property
    def damper_damping_ratio(self) -> np.ndarray:
        """Damping ratios that linear viscous dampers add to the first mode [1], shape [row].

        NaN for a building with isolators or a tuned mass damper, because its first mode hardly deforms the storeys that
        have viscous dampers.
        """
        is_linear = (self["velocity_exponent"] == 1) & self.own.all()
        ratio = self._damping(np.where(is_linear, self["damper_coefficient"], 0.0))
        return np.where(ratio > 0, ratio, np.nan)

    @property
    def damper_force(self) -> np.ndarray:
        """Forces of viscous dampers at a velocity of 1 m/s [N], shape [row, storey].

        NaN except for dampers in isolators and for nonlinear dampers in storeys. The force of a nonlinear damper is
        checked instead of its damping ratio, because the damping ratio depends on the amplitude.
        """
        is_checked = self.is_isolated | (self.own.all() & (self["velocity_exponent"] != 1))
        return np.where(is_checked, self.above_0("damper_coefficient"), np.nan)

    @property
    def isolated_period(self) -> np.ndarray:
        """Periods [s] of the building as a rigid mass on its isolators with their stiffness after yield."""
        after, absent = self["stiffness"], np.full(self["stiffness"].shape, np.nan)
        for stiffness in (
            self.values.get("post_yield_stiffness", absent),
            self.values.get("weight", absent) / self.values.get("radius", absent),
            self.values.get("hardening_ratio", absent) * self["stiffness"],
        ):
            after = np.where(np.isnan(stiffness), after, stiffness)  # NaN in storeys whose law lacks the parameter
        return self.in_isolators(2 * np.pi * np.sqrt(self.mass_above / np.where(after > 0, after, np.nan)))


def _has_period(values: Values) -> np.ndarray:
    """Return which rows have finite masses, stiffnesses and heights above 0, and therefore a period, shape [row]."""
    each = [np.isfinite(values[name]) & (values[name] > 0) for name in ("mass", "stiffness", "height")]
    return np.logical_and.reduce(each).all(axis=1)
