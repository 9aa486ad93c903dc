"""Shear buildings, in SI units, checked when they are built."""

from __future__ import annotations

from collections.abc import Collection, Mapping, Sequence
from typing import Any

import numpy as np
import xarray as xr
from numpy.typing import ArrayLike

from warpdyn.engine.kernels.registry import recorders as known_recorders
from warpdyn.engine.laws import DEVICES, Device, Law, Parameter
from warpdyn.engine.laws.building_law import BuildingLaw, missing_at
from warpdyn.engine.laws.lookup import devices_and_values, laws_and_values
from warpdyn.engine.laws.parameter import names_of
from warpdyn.foundations.core.checks import one_of, real_numbers
from warpdyn.foundations.core.frozen_values import FrozenMapping
from warpdyn.foundations.core.messages import warn_caller
from warpdyn.foundations.core.near_misses import did_you_mean, with_suggestions
from warpdyn.foundations.core.output_variables import KIND_ATTRIBUTES, STOREY_KIND
from warpdyn.model.structures.calibration import CalibratedChain
from warpdyn.model.structures.damping import DAMPING
from warpdyn.model.structures.linear_system import LinearSystem
from warpdyn.model.structures.modal import chain_stiffness_matrix, modal_properties, natural_periods
from warpdyn.model.structures.physics import (
    COLLAPSE_DRIFT_RATIO_UNDER_GRAVITY,
    PHYSICS,
    capacities_of,
    effective_stiffness,
    physics_of,
    physics_problem,
)
from warpdyn.model.structures.protection import ProtectedChain
from warpdyn.model.structures.structure import MAXIMUM_STOREYS, Structure, count_along

__all__ = ["LinearSystem", "ShearBuilding"]

BUILDING_PARAMETERS = ("damping_ratio",)  # parameters with one value for the building; others have one per storey


@with_suggestions
class ShearBuilding(CalibratedChain, ProtectedChain, Structure):
    """A shear building: floor masses that move horizontally, connected by storey springs and dampers.

    `from_hazus`, `from_capacity` and `from_periods` make a ShearBuilding from properties of the whole building.

    P-Delta: if gravity loads are given, a storey of height h carries the sum W of the loads on the floors above it, and
    the P-Delta force is W / h times the storey drift. Modes, periods and the stable step are computed with the
    stiffness minus W / h. The recorded base shear and storey forces are the forces of the storey springs, i.e. the
    shears in the columns.

    Args:
        mass: Floor mass [kg], shape [storey], from the ground up; a single value is used for every storey.
        stiffness: Initial storey stiffness [N/m], shape [storey].
        height: Storey height [m], shape [storey].
        law: Storey law: one law for all storeys, or a list with one law per storey. A law is an object with its
            parameters, such as `Bilinear(yield_force=1e6, hardening_ratio=0.05)`, or a name, such as "bilinear" or
            OpenSees' "Steel01", with its parameters in `**parameters`. `warpdyn.laws.LAWS` lists all laws; the help of
            a law's class explains its parameters.
        devices: Dampers and stops parallel to the storeys' springs, by name or as objects: `FrictionDamper`,
            `ViscousDamper`, `Gap` (stops on both sides of the storey's drift) or `OneSidedGap` (a stop on the positive
            side).
        damping: Inherent damping:
            "none";
            "storey" (`damping_coefficient` per storey);
            "rayleigh" (`damping_ratio` in the two modes `damping_modes`; in proportion to mass and initial stiffness
            without P-Delta, as OpenSees' betaKinit; the frequencies of the modes include P-Delta, as in OpenSees after
            a gravity analysis);
            "rayleigh_tangent" (as "rayleigh", but with the tangent stiffness, as OpenSees' betaK: the damping decreases
            as storeys yield; on falling branches it is 0, whereas that of OpenSees is negative);
            "mass_proportional" or "stiffness_proportional" (initial stiffness; `damping_ratio` in the first mode);
            "modal" (`damping_ratio` in every mode).
        damping_modes: The two modes, counted from 1, in which Rayleigh damping has `damping_ratio`, in increasing
            order; None: 1 and 2.
        damped_storeys: First and last storey with Rayleigh damping, if other storeys are isolators or a tuned mass
            damper. The damping is then in proportion only to the stiffness of these storeys, with `damping_ratio` in
            their first mode on a fixed base, because damping in proportion to the mass would damp the displacement of
            the isolators (Ryan and Polanco 2008, Journal of Structural Engineering 134).
        gravity_load: Vertical load of each floor [N], shape [storey], such as 9.81 times its mass, for P-Delta; None:
            no P-Delta.
        drift_capacity: Storey drift at which the building collapses [m], shape [storey], as in OpenSees' MinMax; None:
            no capacity.
        drift_ratio_capacity: Storey drift ratio at which the building collapses [1], shape [storey]. If both
            capacities are given, the smaller drift counts in each storey.
        **parameters: Parameters of the damping, and of laws, dampers and stops that are given by name: one value or one
            per storey, such as `yield_force` [N] and `damping_ratio`. If laws differ, a value is used in the storeys
            whose law has the parameter; other storeys have NaN. If a storey has no friction damper, viscous damper or
            gap, give it 0 as `slip_force` [N], `damper_coefficient` [N (s/m)^a] or `contact_stiffness` [N/m].

    Raises:
        ValueError: If a value is out of bounds, lengths differ, a name is unknown, or a storey buckles under its load.
        TypeError: If `law` or `devices` is neither a name nor an object of the right class, nor a list of these.

    Example:
        >>> law = wd.laws.Bilinear(yield_force=[3e5, 2e5], hardening_ratio=0.05)
        >>> building = wd.ShearBuilding(1e5, [4e7, 3e7], 3.0, law=law, damping="rayleigh", damping_ratio=0.05)
        >>> building.dofs, round(building.fundamental_period, 3)
        (2, 0.532)
    """

    family = "chain"
    demand = "drift"

    def __init__(
        self,
        mass: ArrayLike,
        stiffness: ArrayLike,
        height: ArrayLike,
        *,
        law: str | Law | type[Law] | Sequence[str | Law] = "elastic",
        devices: Sequence[str | Device] = (),
        damping: str = "none",
        damping_modes: tuple[int, int] | None = None,
        damped_storeys: tuple[int, int] | None = None,
        gravity_load: ArrayLike | None = None,
        drift_capacity: ArrayLike | None = None,
        drift_ratio_capacity: ArrayLike | None = None,
        **parameters: ArrayLike,
    ) -> None:
        one_of("damping", damping, DAMPING)
        kind = DAMPING[damping]
        laws, of_laws = laws_and_values(law, parameters)
        kinds, of_devices = devices_and_values(devices, parameters, laws)
        parameters = {**parameters, **of_laws, **of_devices}
        self.storey_law = BuildingLaw(laws, kinds)
        self.storey_laws, self.devices = tuple(each.name for each in laws), tuple(each.name for each in kinds)
        law = self.law = self.storey_law.name
        self.damping = damping
        stiff = [each.name for each in kinds if not each.is_dashpot]
        if kind.follows_tangent and stiff:
            raise ValueError(
                f"damping {damping!r} cannot be used with a {stiff[0]}, whose tangent stiffness would add damping: use "
                "damping='rayleigh'"
            )
        given = {"mass": mass, "stiffness": stiffness, "height": height, **parameters}
        of_all = {"gravity_load": gravity_load, "drift_capacity": drift_capacity}
        of_all |= {"drift_ratio_capacity": drift_ratio_capacity}
        given |= {name: value for name, value in of_all.items() if value is not None}
        self.parameter_table: Mapping[str, Parameter] = FrozenMapping(
            {
                "mass": Parameter("kg", "floor mass", low=0.0, low_open=True),
                "stiffness": Parameter("N m-1", "initial storey stiffness", low=0.0, low_open=True),
                "height": Parameter("m", "storey height", low=0.0, low_open=True),
                **{name: row for each in physics_of(given) for name, row in PHYSICS[each].parameters.items()},
                **capacities_of(given),
                **{n: row for n, row in self.storey_law.parameters.items() if n in given or not row.optional},
                **kind.parameters,
            }
        )
        known = {**self.parameter_table, **self.storey_law.parameters}
        for name in given:
            if name not in self.parameter_table:
                others = [repr(other) for other, each in DAMPING.items() if name in each.parameters]
                if others:
                    raise ValueError(f"damping {damping!r} does not take {name}: give damping={' or '.join(others)}")
                takes, hint = ", ".join(self.parameter_table), did_you_mean(name, names_of(known))
                devices = [repr(device) for device, each in DEVICES.items() if name in each.parameters]
                if devices and not hint:
                    hint = f" (of a device: add devices=({devices[0]},))"
                raise ValueError(
                    f"unknown parameter {name!r}{hint}: a building with law {law!r} and damping {damping!r} takes "
                    f"{takes}"
                )
        arrays = {}
        for name, value in self._values(given, kind.parameters).items():
            arrays[name] = real_numbers(name, value, known[name].units)
            if arrays[name].ndim > 1:
                raise ValueError(f"{name} must be one value or one per storey, got shape {arrays[name].shape}")
            if not arrays[name].size:
                raise ValueError(f"{name} is empty: it must be one value or one per storey")
        several = len(self.storey_laws) if len(self.storey_laws) > 1 else 1
        lengths = {"law": several} | {n: array.size for n, array in arrays.items() if n not in BUILDING_PARAMETERS}
        longest = max(lengths, key=lambda name: lengths[name])
        self.storeys = lengths[longest]
        if several not in (1, self.storeys):
            raise ValueError(_unequal("law", several, longest, self.storeys))
        if not 1 <= self.storeys <= MAXIMUM_STOREYS:
            raise ValueError(
                f"a shear building has 1 to {MAXIMUM_STOREYS} storeys, got {self.storeys}: combine storeys"
            )
        for name, array in arrays.items():
            taken = None
            if name in BUILDING_PARAMETERS:
                if array.size != 1:
                    raise ValueError(f"{name} must be one value for the building, got {array.size}")
                arrays[name] = array.reshape(())
            elif array.ndim and array.size != self.storeys:
                raise ValueError(_unequal(name, array.size, longest, self.storeys))
            else:
                arrays[name] = np.array(np.broadcast_to(array, self.storeys))
                if several > 1:
                    arrays[name], taken = self._where_taken(name, arrays[name], is_given=name in given)
            axes = () if name in BUILDING_PARAMETERS else ("storey",)
            problem = self.parameter_table[name].first_violation(name, arrays[name], axes, taken=taken)
            if problem:
                raise ValueError(problem)
            arrays[name].flags.writeable = False
        problem = self.storey_law.problem(arrays) or physics_problem(arrays)
        if problem:
            raise ValueError(problem)
        if caution := self.storey_law.caution(arrays):
            warn_caller(caution)
        self.parameters: Mapping[str, np.ndarray] = FrozenMapping(arrays)
        self.own_storeys = np.ones(self.storeys, dtype=bool)  # False: isolators or a tuned mass damper
        self.inherent_damping = kind.checked(damping, self.storeys, damping_modes, damped_storeys)
        self.damping_modes, self.damped_storeys = self.inherent_damping.modes, self.inherent_damping.storeys

    def _values(self, given: Mapping[str, ArrayLike], of_damping: Collection[str]) -> dict[str, ArrayLike]:
        """Return the given value or the default of each parameter; a ValueError names all missing parameters."""
        several = len(self.storey_laws) > 1
        values: dict[str, ArrayLike] = {}
        missing = []
        for name, parameter in self.parameter_table.items():
            # If storeys have different laws, each law has a different default.
            by_law = several and any(name in each.parameters for each in self.storey_law.laws)
            value = given.get(name, np.nan if by_law else parameter.default)
            if value is None:
                missing.append(name)
            else:
                values[name] = value
        if not missing:
            return values
        needing = {f"law {self.law!r}": self.storey_law.parameters, f"damping {self.damping!r}": of_damping}
        who = [owner for owner, parameters in needing.items() if any(name in parameters for name in missing)]
        names = ", ".join(f"{name} ({self.parameter_table[name].long_name})" for name in missing)
        verb, them = ("is", "it") if len(missing) == 1 else ("are", "them")
        needs = "need" if len(who) > 1 else "needs"
        remedy = ", ".join(f"{name}=" for name in missing)
        raise ValueError(f"{names} {verb} missing: {' and '.join(who) or 'a building'} {needs} {them}. Give {remedy}")

    def _where_taken(self, name: str, values: np.ndarray, *, is_given: bool) -> tuple[np.ndarray, np.ndarray | None]:
        """Return the values of a parameter if storeys have different laws, and whether each storey has the parameter.

        Values are NaN in storeys whose law does not have the parameter. Both arrays have shape [storey]; the second is
        None if no law has the parameter, so that it belongs to the building or to dampers and stops.
        """
        laws = [law for law in self.storey_law.laws if name in law.parameters]
        if not laws:
            return values, None
        for law in laws if not is_given else ():
            default, own = law.parameters[name].default, self.storey_law.storeys_of(law)
            if default is None:
                raise ValueError(missing_at(name, own[0], law.name))
            values[own] = default
        takes = np.array([law in laws for law in self.storey_law.of_storeys])
        values[~takes] = np.nan
        return values, takes

    @property
    def dofs(self) -> int:
        """Number of degrees of freedom of the building, one per storey."""
        return self.storeys

    @property
    def nominal_values(self) -> Mapping[str, np.ndarray]:
        """Parameter name -> nominal values, which scatter multiplies or replaces, each of shape [storey] or []."""
        return self.parameters

    def is_by_storey(self, name: str) -> bool:
        """Return whether the parameter `name` has one value per storey; only the damping ratio has one per building."""
        return name not in BUILDING_PARAMETERS

    def varied(self, name: str, only: tuple[str, ...] | tuple[int, ...] | None) -> np.ndarray | None:
        """Return which values of a parameter a random scatter draws, shape [storey]; None: all; see Structure."""
        return None if only is None else np.isin(np.arange(1, self.length_of(name) + 1), only)

    def only_problem(self, name: str, only: tuple[str, ...] | tuple[int, ...]) -> str | None:
        """Return why scatter of a parameter cannot be restricted to these storeys; None if it can."""
        if not self.is_by_storey(name):
            return f"{name} has no value per storey: remove only="
        if isinstance(only[0], str):
            return (
                f"only= names {only[0]!r}, but a ShearBuilding has storeys with numbers: give numbers, such as "
                "only=range(1, 4), or convert the building by wd.lumped_chain(building)"
            )
        most = self.length_of(name)
        return f"only= contains storey {max(only)}, but the structure has {most} storeys" if max(only) > most else None

    def input_name(self, name: str) -> str:
        """Return the name of a parameter's random values in the dataset: the unchanged name of the parameter."""
        return name

    def chosen(self) -> dict[str, Any]:
        """Return the choices other than parameters, for the JSON of the scene.

        The choices are laws, dampers and stops, damping, and the numbers of the storeys that are isolators or a tuned
        mass damper.
        """
        found: dict[str, Any] = {"law": self.law, "damping": self.damping}
        found |= {"devices": list(self.devices)} if self.devices else {}
        added = np.flatnonzero(~self.own_storeys) + 1
        found |= {"added_storeys": added.tolist()} if added.size else {}
        of_damping = {"damping_modes": self.damping_modes, "damped_storeys": self.damped_storeys}
        found |= {name: list(numbers) for name, numbers in of_damping.items() if numbers}
        if texts := self.storey_law.written:
            found["written_laws"] = texts
        return found | ({"storey_laws": list(self.storey_laws)} if len(self.storey_laws) > 1 else {})

    def told(self) -> list[tuple[object, ...]]:
        """Return the rows of the table that notebooks show for the building: first three periods, and parameters."""
        periods = self._periods[:3]
        return [("first periods", "", periods, "s"), *super().told()]

    def numbered(self, recorders: tuple[str, ...]) -> dict[str, tuple]:
        """Return the coordinate `storey` and, if a recorder needs it, `floor`.

        If the building has isolators or a tuned mass damper, the kind of each storey is also returned.
        """
        of_kinds = {} if self.own_storeys.all() else {STOREY_KIND: ("storey", self.storey_kinds, KIND_ATTRIBUTES)}
        return numbered_storeys(self.storeys, recorders) | of_kinds

    @property
    def storey_kinds(self) -> np.ndarray:
        """Kind of each storey as an index into STOREY_KINDS (building, isolators, damper), shape [storey]."""
        place = np.arange(self.storeys)
        first = int(np.flatnonzero(self.own_storeys)[0])
        return np.where(self.own_storeys, 0, np.where(place < first, 1, 2)).astype(np.int8)

    def modal(self) -> xr.Dataset:
        """Return a dataset of the undamped modes: periods, shapes, participation factors and effective masses."""
        return modal_properties(*self._matrices)

    @property
    def _matrices(self) -> tuple[np.ndarray, np.ndarray]:
        """Masses [kg], shape [dof], and stiffness matrix [N/m]."""
        return self.parameters["mass"], chain_stiffness_matrix(effective_stiffness(self.parameters))

    @property
    def _periods(self) -> np.ndarray:
        """Periods of the undamped modes [s], longest first."""
        return natural_periods(*self._matrices)

    @property
    def default_collapse_drift_ratio(self) -> float | None:
        """Default collapse drift ratio [1]: 0.5 for a building with a gravity load and no drift capacities, or None."""
        is_pulled = "gravity_load" in self.parameters and not capacities_of(self.parameters)
        return COLLAPSE_DRIFT_RATIO_UNDER_GRAVITY if is_pulled else None

    @property
    def fundamental_period(self) -> float:
        """First period of the undamped building [s]."""
        return float(self._periods[0])

    def __repr__(self) -> str:
        return f"ShearBuilding({self.storeys} storeys, law={self.law!r}, damping={self.damping!r})"


def numbered_storeys(storeys: int, recorders: tuple[str, ...]) -> dict[str, tuple]:
    """Return the coordinate `storey` and, if a recorded variable has the dimension `floor`, the coordinate `floor`."""
    coordinates = {"storey": count_along("storey", storeys, "storey, from the ground up")}
    of_chains = known_recorders()["chain"]
    if any("floor" in variable.dims for name in recorders for variable in of_chains[name].values()):
        coordinates["floor"] = count_along("floor", storeys, "floor above the storey")
    return coordinates


def _unequal(name: str, values: int, other: str, others: int) -> str:
    """Return an error message about two arguments that have different numbers of values, one per storey."""
    return f"{name} has {values} values and {other} has {others}: lists with one value per storey must be equally long"
