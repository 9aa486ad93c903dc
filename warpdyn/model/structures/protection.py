"""Base isolation and tuned mass dampers, modelled as an additional storey at the base or on the roof."""

from __future__ import annotations

from collections.abc import Mapping
from typing import Any, Self

import numpy as np
import xarray as xr

from warpdyn.engine.laws import LAWS, Elastic, Law, Parameter, ViscousDamper
from warpdyn.engine.laws.building_law import BuildingLaw, missing_at
from warpdyn.engine.laws.lookup import laws_and_values
from warpdyn.foundations.core.checks import one_of, real_number
from warpdyn.foundations.core.plausibility import PlausibilityFindings
from warpdyn.foundations.core.units import STANDARD_GRAVITY

ISOLATORS = ("lead_rubber_bearing", "friction_pendulum", "elastic", "bilinear", "bouc_wen")
CAPACITY_RATIO = 0.1  # drift ratio of the additional storey (isolators or damper) at its displacement capacity
MASS_RATIO = Parameter(
    "1", "mass of the damper over that of the first mode", low=0.0, low_open=True, high=1.0, often_in_percent=True
)
STRENGTHS = ("slip_force", "contact_stiffness", "damper_coefficient")  # parameters of devices; 0: no device
DAMPINGS = ("none", "storey", "rayleigh", "stiffness_proportional")  # allowed kinds of inherent damping


class ProtectedChain:
    """Base class of ShearBuilding with the methods that add isolators or a tuned mass damper."""

    # Attributes that ShearBuilding sets.
    storeys: int
    storey_laws: tuple[str, ...]
    storey_law: BuildingLaw
    devices: tuple[str, ...]
    damping: str
    damped_storeys: tuple[int, int] | None
    parameters: Mapping[str, np.ndarray]

    own_storeys: np.ndarray  # whether each storey belongs to the building, not to isolators or a tuned mass damper

    def modal(self) -> xr.Dataset:
        """Return the properties of the undamped modes; ShearBuilding implements this method."""
        raise NotImplementedError

    def on_isolators(
        self,
        law: str | Law,
        base_mass: float,
        displacement_capacity: float,
        *,
        damper_coefficient: float = 0.0,
        **parameters: float,
    ) -> Self:
        """Return the building with base isolation: the isolators are an additional first storey below a base mass.

        Rayleigh damping and stiffness-proportional damping are replaced by damping that is proportional to the
        stiffness of the building's own storeys (`damped_storeys`), with the damping ratio in the first mode of these
        storeys on a fixed base. The isolators are damped only by their hysteresis and by `damper_coefficient`.

        Args:
            law: Law of the isolators, by name or as an object of its class: "lead_rubber_bearing" (`stiffness` before
                yield [N/m], `yield_force` [N], `post_yield_stiffness` [N/m]), "friction_pendulum" (`stiffness` before
                sliding [N/m], such as the friction force divided by 1 mm, `friction_coefficient`, `radius` [m];
                `weight` [N], by default the weight of building and base mass), or "elastic", "bilinear" or "bouc_wen".
            base_mass: Mass between the isolators and the first storey [kg].
            displacement_capacity: Displacement at which the isolators fail [m]. The height of the isolator storey is
                set to ten times this displacement, so that its drift ratio is 0.1 when the isolators fail: with
                `collapse_drift_ratio=0.1` in the Scene, failure of the isolators is a collapse. A run marks the
                isolator storey (`storey_kind`); fragility curves and damage shares exclude its drift ratio.
            damper_coefficient: Linear viscous damping across the isolators [N s/m].
            **parameters: Stiffness of the isolators, and the parameters of their law if it is a name.

        Raises:
            ValueError: If a value is out of bounds, a name is unknown, the damping is modal, mass-proportional or
                "rayleigh_tangent", or the building has a gravity load.

        Example:
            >>> bearings = wd.laws.LeadRubberBearing(yield_force=1.2e5, post_yield_stiffness=1.2e6)
            >>> isolated = building.on_isolators(bearings, base_mass=1e5, displacement_capacity=0.4, stiffness=1.2e7)
            >>> isolated.dofs
            3
        """
        values: dict[str, Any] = dict(parameters)
        if not isinstance(law, str):
            (kind,), own = laws_and_values(law, parameters)
            law, values = kind.name, own | parameters
        one_of("law of isolators", law, ISOLATORS)
        mass = real_number("base_mass [kg]", base_mass, above=0)
        capacity = real_number("displacement_capacity [m]", displacement_capacity, above=0)
        if "weight" in LAWS[law].parameters:
            weight = STANDARD_GRAVITY * (mass + self.parameters["mass"].sum())
            values = {"weight": weight} | values
        if "gravity_load" in self.parameters:
            raise ValueError(
                "a building with a gravity_load cannot have isolators: the isolator storey has no physical height, and "
                "the tested stiffness of isolators includes P-Delta. Remove gravity_load="
            )
        values = {"mass": mass, "height": capacity / CAPACITY_RATIO, **values}
        return self._with_storey(0, law, values, damper_coefficient)

    def with_tuned_mass_damper(
        self,
        mass_ratio: float,
        frequency_ratio: float | None = None,
        damping_ratio: float | None = None,
        *,
        displacement_capacity: float = 10.0,
    ) -> Self:
        """Return the building with a tuned mass damper on its roof: an additional elastic storey with a dashpot.

        The defaults are Den Hartog's optimum, which minimises the largest response of an undamped building to a
        harmonic force of any frequency. For the mass ratio mu, the frequency ratio is 1 / (1 + mu) and the damping
        ratio is sqrt(3 mu / (8 (1 + mu))) (Den Hartog, Mechanical Vibrations, 4th edition, section 3.3, where the
        damping ratio refers to the building's frequency; in warpdyn it refers to the damper's frequency). Rayleigh
        damping and stiffness-proportional damping are treated as in `on_isolators`.

        The damper is the last storey of the model. A random factor of the `stiffness` also multiplies its spring, so
        that it stays tuned. `RandomFactor(..., only=range(1, 9))` limits the factor to a building of eight storeys.

        Args:
            mass_ratio: Mass of the damper divided by the modal mass of the first mode (with shape 1 at the roof) [1];
                at most 1.
            frequency_ratio: Frequency of the damper divided by the building's first frequency [1]; None: optimum.
            damping_ratio: Damping ratio of the damper [1]; None: optimum.
            displacement_capacity: Largest displacement of the damper relative to the roof [m]. The height of the
                damper's storey is set to ten times this displacement, so that its drift ratio is then 0.1.

        Raises:
            ValueError: If a value is out of bounds, or the damping is modal, mass-proportional or "rayleigh_tangent".

        Example:
            >>> damped = building.with_tuned_mass_damper(mass_ratio=0.02)  # Den Hartog's optimum
            >>> damped.dofs
            3
        """
        ratio = real_number("mass_ratio", mass_ratio)
        problem = MASS_RATIO.first_violation("mass_ratio", np.array(ratio), ())
        if problem:
            raise ValueError(problem)
        if frequency_ratio is None:
            frequency_ratio = 1 / (1 + ratio)
        if damping_ratio is None:
            damping_ratio = np.sqrt(3 * ratio / (8 * (1 + ratio)))
        frequency_ratio = real_number("frequency_ratio", frequency_ratio, above=0)
        damping_ratio = real_number("damping_ratio", damping_ratio, least=0)
        capacity = real_number("displacement_capacity [m]", displacement_capacity, above=0)
        findings = PlausibilityFindings()
        findings.add("tuned_mass_ratio", ratio)
        findings.add("tuned_frequency_ratio", frequency_ratio)
        if damping_ratio > 0:
            findings.add("tuned_damping_ratio", damping_ratio)
        findings.warn()
        first = self.modal().isel(mode=0)
        shape = first["shape"].values / first["shape"].values[-1]
        mass = ratio * float(self.parameters["mass"] @ shape**2)
        omega = frequency_ratio * float(first["circular_frequency"])
        own = {"mass": mass, "stiffness": mass * omega**2, "height": capacity / CAPACITY_RATIO}
        return self._with_storey(self.storeys, Elastic.name, own, 2 * damping_ratio * omega * mass)

    def _with_storey(self, place: int, law: str, own: dict[str, float], dashpot: float) -> Self:
        """Return the building with a storey added at index `place`.

        Args:
            place: Index of the added storey, from the ground up.
            law: Name of its law.
            own: Parameter name -> value of the added storey.
            dashpot: Coefficient of the viscous damper in the added storey [N s/m].
        """
        if self.damping not in DAMPINGS:
            raise ValueError(
                f"a building with damping {self.damping!r} cannot have isolators or a tuned mass damper: this damping "
                f"would also act on them; use one of {', '.join(map(repr, DAMPINGS))}"
            )
        dashpot = real_number("damper_coefficient [N s/m]", dashpot, least=0)
        taken = {"mass", "stiffness", "height", *LAWS[law].parameters}
        for name in own:
            if name not in taken:
                raise ValueError(
                    f"unknown parameter {name!r}: isolators of law {law!r} take {', '.join(sorted(taken))}"
                )
        for name, value in own.items():
            real_number(f"{name} of the storey", value)
        for device in self.storey_law.devices:
            if not device.parameters.keys() & set(STRENGTHS):
                raise ValueError(
                    f"device {device.name!r} would also act in the added storey, because only devices of warpdyn have "
                    "a known parameter that is 0 without the device: write the added storey into ShearBuilding itself, "
                    "with law=[...] and the parameters of the device for each storey"
                )
        laws = self.storey_law.of_storeys * (1 if len(self.storey_laws) > 1 else self.storeys)
        added = {"damping_coefficient": 0.0, "damper_coefficient": dashpot, "velocity_exponent": 1.0}
        added["gravity_load"] = STANDARD_GRAVITY * own["mass"]
        # Devices of the building's storeys are given zero strength in the added storey.
        added |= {name: 0.0 for name in STRENGTHS if name not in added}
        devices: tuple[Any, ...] = self.storey_law.devices
        values = dict(self.parameters)
        ratio = values.pop("damping_ratio", None)
        if dashpot > 0 and ViscousDamper not in devices:
            devices = (*devices, ViscousDamper)
            values["damper_coefficient"] = np.zeros(self.storeys)
        for name in {*values, *own}:
            before = values.get(name, np.full(self.storeys, np.nan))
            new: Any = own.get(name, added.get(name))
            if new is None and name in LAWS[law].parameters:
                new = LAWS[law].parameters[name].default
            elif new is None and name not in ("stiffness", "mass", "height"):
                new = before[0]  # has no effect: it is a parameter of another law, or of a device of zero strength
            if new is None:
                raise ValueError(missing_at(name, place, law))
            values[name] = np.insert(before, place, new)
        if ratio is not None:
            values["damping_ratio"] = ratio
        damped, damping = None, self.damping
        if damping in ("rayleigh", "stiffness_proportional"):
            damping = "rayleigh"  # with damped_storeys: proportional to the stiffness of these storeys only
            first, last = self.damped_storeys or (1, self.storeys)
            damped = (first + (place == 0), last + (place == 0))
        laws = (*laws[:place], LAWS[law], *laws[place:])
        building: type[Any] = type(self)
        made: Any = building(law=laws, devices=devices, damping=damping, damped_storeys=damped, **values)
        made.own_storeys = np.insert(self.own_storeys, place, False)
        return made
