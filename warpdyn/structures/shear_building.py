"""Shear buildings, in SI units, checked at construction."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from types import MappingProxyType

import numpy as np
import xarray as xr
from numpy.typing import ArrayLike

from warpdyn.core.checks import one_of, real_numbers, whole_number
from warpdyn.laws import DEVICES, LAWS, Parameter
from warpdyn.laws.building_law import law_of_storeys, missing_at, name_of, storeys_of
from warpdyn.structures.calibration import CalibratedChain
from warpdyn.structures.linear_system import LinearSystem
from warpdyn.structures.modal import chain_stiffness_matrix, modal_properties
from warpdyn.structures.p_delta import buckling_problem, stiffness_under_gravity
from warpdyn.structures.protection import ProtectedChain

__all__ = ["LinearSystem", "ShearBuilding"]

MAXIMUM_STOREYS = 60

DAMPING_RATIO = Parameter("1", "viscous damping ratio", low=0.0, high=1.0, high_open=True, often_in_percent=True)
# Each kind of damping with its parameters: one value for each storey, or one for the building.
DAMPING = {
    "none": {},
    "storey": {"damping_coefficient": Parameter("N s m-1", "viscous damping coefficient of the storey", low=0.0)},
    "rayleigh": {"damping_ratio": DAMPING_RATIO},
    "rayleigh_tangent": {"damping_ratio": DAMPING_RATIO},
    "mass_proportional": {"damping_ratio": DAMPING_RATIO},
    "stiffness_proportional": {"damping_ratio": DAMPING_RATIO},
    "modal": {"damping_ratio": DAMPING_RATIO},
}
GRAVITY_LOAD = Parameter("N", "vertical load of the floor that leans with the building", low=0.0)
BUILDING_PARAMETERS = ("damping_ratio",)  # the others have one value a storey


class ShearBuilding(CalibratedChain, ProtectedChain):
    """A chain of storeys: masses that move sideways, joined by storey springs and dampers.

    `from_hazus`, `from_capacity` and `from_periods` make one from properties of the whole building.

    Args:
        mass: Floor mass [kg], shape [storey], from the ground up; a single value serves every storey.
        stiffness: Initial storey stiffness [N/m], shape [storey].
        height: Storey height [m], shape [storey].
        law: Storey law, one for all storeys or one a storey, each a row of `warpdyn.laws.LAWS`: "elastic", "bilinear"
            (kinematic hardening), "elastic_perfectly_plastic", "trilinear", "quadrilinear", "menegotto_pinto"
            (Steel02), "bouc_wen", "baber_noori" (Bouc-Wen that degrades and pinches), "peak_oriented" (Clough),
            "takeda", "hysteretic" (trilinear, pinching, damaged), "pinching4" (four points, pinching, damaged), or with
            a capping point and cyclic deterioration "ibarra_medina_krawinkler_bilinear", "..._peak_oriented" or
            "..._pinching"; of isolators "lead_rubber_bearing" or "friction_pendulum". Each law's parameters are in its
            file of `warpdyn.laws`, beside OpenSees' names of them.
        devices: Devices that act in parallel to the storeys' springs: "friction_damper", "viscous_damper", "gap" (a
            stop on either side of the storey's drift) or "one_sided_gap" (a stop at positive drift).
        damping: "none"; "storey" (`damping_coefficient` a storey); "rayleigh" (`damping_ratio` at `damping_modes`, from
            mass and initial stiffness, without P-Delta); "rayleigh_tangent" (the same of mass and tangent stiffness,
            OpenSees' betaK: it fades as storeys yield, and is 0 on falling branches, where OpenSees' gives energy);
            "mass_proportional" or "stiffness_proportional" (initial stiffness; `damping_ratio` in the first mode); or
            "modal" (`damping_ratio` in every mode).
        damping_modes: The two modes, counted from 1, at which Rayleigh damping has its ratio; 1 and 2 by default.
        damped_storeys: First and last storey with Rayleigh damping, if the others are isolators or a tuned mass damper:
            the damping is then in proportion to their stiffness alone, with its ratio in the first mode that they would
            have on a fixed base. A mass-proportional part would damp the displacement of the isolators (Ryan and
            Polanco 2008, Journal of Structural Engineering 134).
        gravity_load: Vertical load of each floor [N], shape [storey], such as 9.81 times its mass, that leans with the
            building (P-Delta); None for no P-Delta.
        **parameters: Parameters of the law and the damping, one value or one for each storey: `yield_force` [N],
            `hardening_ratio`, `beta`, `gamma`, `exponent`; `damping_coefficient` [N s/m], `damping_ratio`. Where laws
            differ, a value is used in storeys whose law takes it, and is NaN in the others. Devices: `slip_force` [N],
            `brace_stiffness` [N/m]; `damper_coefficient` [N (s/m)^a], `velocity_exponent` a, at most 1,
            `linear_velocity` [m/s], below which the force is linear; `clearance` [m], `contact_stiffness` [N/m],
            `restitution`. A storey without a
            device has 0 for the first parameter of the device.

    The Bouc-Wen force is a k d + (1 - a) Fy z with a the hardening ratio, Fy the yield force, k the stiffness and
    (Fy / k) dz/dt = v - |z|^n (beta |v| sign z + gamma v), where -beta < gamma <= beta. Its z is bounded by
    (beta + gamma)^(-1/n), which is 1 at the defaults, beta = gamma = 0.5: elsewhere it yields at that multiple of Fy.

    With gravity loads each storey carries those of its floor and above, W, and its height h gives the P-Delta force
    W / h times its drift. Modes, periods and stable steps are those of the stiffness less W / h. The recorded
    base shear and storey forces are those of the springs alone: the shear in the columns.

    Raises:
        ValueError: If a value is out of bounds, lengths differ, a name is unknown, or a storey buckles under its load.
    """

    family = "chain"

    def __init__(
        self,
        mass: ArrayLike,
        stiffness: ArrayLike,
        height: ArrayLike,
        *,
        law: str | Sequence[str] = "elastic",
        devices: Sequence[str] = (),
        damping: str = "none",
        damping_modes: tuple[int, int] | None = None,
        damped_storeys: tuple[int, int] | None = None,
        gravity_load: ArrayLike | None = None,
        **parameters: ArrayLike,
    ) -> None:
        one_of("damping", damping, DAMPING)
        self.storey_laws, self.devices = _checked_laws(law), _checked_devices(devices)
        self.law, self.damping = name_of(self.storey_laws, self.devices), damping
        self.storey_law = law_of_storeys(LAWS, self.storey_laws, self.devices)
        law = self.law
        stiff = [device for device in self.devices if device != "viscous_damper"]
        if damping == "rayleigh_tangent" and stiff:
            raise ValueError(
                f"damping 'rayleigh_tangent' does not go with a {stiff[0]}: its stiffness would damp too; "
                "take 'rayleigh'"
            )
        self.parameter_table: Mapping[str, Parameter] = MappingProxyType(
            {
                "mass": Parameter("kg", "floor mass", low=0.0, low_open=True),
                "stiffness": Parameter("N m-1", "initial storey stiffness", low=0.0, low_open=True),
                "height": Parameter("m", "storey height", low=0.0, low_open=True),
                **({} if gravity_load is None else {"gravity_load": GRAVITY_LOAD}),
                **self.storey_law.parameters,
                **DAMPING[damping],
            }
        )
        given = {"mass": mass, "stiffness": stiffness, "height": height, **parameters}
        if gravity_load is not None:
            given["gravity_load"] = gravity_load
        for name in given:
            if name not in self.parameter_table:
                takes = ", ".join(self.parameter_table)
                raise ValueError(
                    f"unknown parameter {name!r}: a building of law {law!r} and damping {damping!r} takes {takes}"
                )
        arrays = {}
        for name, parameter in self.parameter_table.items():
            # Where laws differ, each law supplies its own default.
            by_law = len(self.storey_laws) > 1 and any(name in LAWS[each].parameters for each in self.storey_laws)
            value = given.get(name, np.nan if by_law else parameter.default)
            if value is None:
                raise ValueError(
                    f"{name} ({parameter.long_name}) is missing: law {law!r} and damping {damping!r} need it"
                )
            arrays[name] = real_numbers(name, value)
            if arrays[name].ndim > 1:
                raise ValueError(f"{name} must be one value or one a storey, got shape {arrays[name].shape}")
        several = len(self.storey_laws) if len(self.storey_laws) > 1 else 1
        lengths = {"law": several} | {n: array.size for n, array in arrays.items() if n not in BUILDING_PARAMETERS}
        longest = max(lengths, key=lambda name: lengths[name])
        self.storeys = lengths[longest]
        if several not in (1, self.storeys):
            raise ValueError(_unequal("law", several, longest, self.storeys))
        if not 1 <= self.storeys <= MAXIMUM_STOREYS:
            raise ValueError(f"a shear building has 1 to {MAXIMUM_STOREYS} storeys, got {self.storeys}")
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
        problem = self.storey_law.problem(arrays) or buckling_problem(arrays)
        if problem:
            raise ValueError(problem)
        self.parameters: Mapping[str, np.ndarray] = MappingProxyType(arrays)
        for what, modes in {"damping_modes": damping_modes, "damped_storeys": damped_storeys}.items():
            kinds = ("rayleigh", "rayleigh_tangent") if what == "damping_modes" else ("rayleigh",)
            if modes is not None and damping not in kinds:
                raise ValueError(f"{what} belong to damping {' or '.join(map(repr, kinds))}, not {damping!r}")
        if damping_modes is not None and damped_storeys is not None:
            raise ValueError(
                "damping_modes and damped_storeys exclude each other: of some storeys it is the first mode"
            )
        self.damped_storeys = None if damped_storeys is None else self._checked_storeys(damped_storeys)
        has_modes = damping in ("rayleigh", "rayleigh_tangent") and damped_storeys is None
        self.damping_modes = self._checked_modes(damping_modes) if has_modes else None

    def _where_taken(self, name: str, values: np.ndarray, *, is_given: bool) -> tuple[np.ndarray, np.ndarray | None]:
        """Return values of a parameter, NaN at storeys whose law does not take it, and which storeys take it."""
        laws = [law for law in dict.fromkeys(self.storey_laws) if name in LAWS[law].parameters]
        if not laws:
            return values, None
        for law in laws if not is_given else ():
            default, own = LAWS[law].parameters[name].default, storeys_of(self.storey_laws, law)
            if default is None:
                raise ValueError(missing_at(name, own[0], law))
            values[own] = default
        takes = np.isin(self.storey_laws, laws)
        values[~takes] = np.nan
        return values, takes

    def _checked_storeys(self, storeys: tuple[int, int]) -> tuple[int, int]:
        """Return the first and the last storey with Rayleigh damping."""
        if not isinstance(storeys, Sequence) or len(storeys) != 2:
            raise ValueError(f"damped_storeys must be the first and the last storey, such as (2, 6), got {storeys!r}")
        first, last = (whole_number(f"damped_storeys[{i}]", storey, 1) for i, storey in enumerate(storeys))
        if not first <= last <= self.storeys:
            raise ValueError(f"damped_storeys must be within 1 to {self.storeys}, first to last, got {storeys!r}")
        return first, last

    def _checked_modes(self, modes: tuple[int, int] | None) -> tuple[int, int]:
        """Return the two modes of Rayleigh damping; a one-storey building has its only mode twice."""
        if modes is None:
            return 1, min(2, self.storeys)
        if not isinstance(modes, Sequence) or len(modes) != 2:
            raise ValueError(f"damping_modes must be two modes, such as (1, 3), got {modes!r}")
        first, second = (whole_number(f"damping_modes[{i}]", mode, 1) for i, mode in enumerate(modes))
        if max(first, second) > self.storeys or (first >= second and self.storeys > 1):
            raise ValueError(f"damping_modes must be two different modes from 1 to {self.storeys}, got {modes!r}")
        return first, second

    @property
    def dofs(self) -> int:
        """Degrees of freedom: one for each storey."""
        return self.storeys

    def modal(self) -> xr.Dataset:
        """Return periods, shapes, participation factors and effective masses of the undamped building."""
        return modal_properties(
            self.parameters["mass"], chain_stiffness_matrix(stiffness_under_gravity(self.parameters))
        )

    @property
    def fundamental_period(self) -> float:
        """First period of the undamped building [s]."""
        return float(self.modal()["period"][0])

    def __repr__(self) -> str:
        return f"ShearBuilding({self.storeys} storeys, law={self.law!r}, damping={self.damping!r})"


def _unequal(name: str, values: int, other: str, others: int) -> str:
    """Return an error message on two parameters with values for different numbers of storeys."""
    return f"{name} has {values} values and {other} has {others}: lists of one value a storey must be of one length"


def _checked_laws(law: str | Sequence[str]) -> tuple[str, ...]:
    """Return the law of each storey, or the one law of all storeys."""
    laws = (law,) if isinstance(law, str) else tuple(law) if isinstance(law, list | tuple) else (law,)
    for name in laws or (None,):
        one_of("storey law", name, LAWS)
    return laws[:1] if len(set(laws)) == 1 and isinstance(law, str) else laws


def _checked_devices(devices: Sequence[str]) -> tuple[str, ...]:
    if isinstance(devices, str) or not isinstance(devices, list | tuple):
        raise TypeError(f"devices must be a tuple of names, such as ('friction_damper',), got {devices!r}")
    for name in devices:
        one_of("device", name, DEVICES)
    for place, name in enumerate(devices):
        for other in devices[:place]:
            shared = set(DEVICES[name].parameters) & set(DEVICES[other].parameters)
            if shared:
                raise ValueError(
                    f"devices {other!r} and {name!r} share the parameter {min(shared)!r}: a storey has one"
                )
    return tuple(devices)
