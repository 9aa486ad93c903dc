"""A spring of a lumped structure: its direction, its law and the parameters of the law."""

from __future__ import annotations

from collections.abc import Mapping

import numpy as np

from warpdyn.engine.laws import CONTACTS, DEVICES, LAWS
from warpdyn.engine.laws.building_law import BuildingLaw
from warpdyn.engine.laws.contacts.contact import Contact
from warpdyn.engine.laws.law import Device, StoreyElement
from warpdyn.engine.laws.lookup import class_and_values, devices_and_values, laws_and_values
from warpdyn.foundations.core.checks import checked_text, real_number, real_numbers, shortened, true_or_false
from warpdyn.foundations.core.near_misses import did_you_mean, with_suggestions
from warpdyn.model.structures.lumped.names import checked_coefficients


@with_suggestions
class Spring:
    """A spring between degrees of freedom of a LumpedStructure, or between degrees of freedom and the ground.

    Its deformation is the sum of the displacements of the degrees of freedom times the coefficients in `direction`.
    With a single coefficient of 1 the spring connects the degree of freedom to the ground; with 1 and -1 it connects
    two degrees of freedom.

    Args:
        name: Name of the spring in messages and datasets.
        direction: Coefficients of the deformation, {degree of freedom: coefficient}: [1] for a translation, [m] for a
            rotation in rad.
        law: A storey law, a contact, or one of the devices "gap", "one_sided_gap" and "friction_damper": its name, its
            class, or an object with its parameters. See `warpdyn.laws.LAWS` and `warpdyn.laws.CONTACTS`.
        stiffness: Initial stiffness of the law [N/m]; None: 0 for a device or a contact, or for a spring that is
            only a dashpot.
        damping_coefficient: Coefficient of a linear dashpot parallel to the spring [N s/m].
        deformation_capacity: Deformation at which the structure collapses [m]; None: no capacity.
        rotational: Whether the deformation is a rotation [rad] and the force a moment [N m]; None: yes if all
            coefficients are 1 or -1 and belong to rotations.
        **parameters: Parameters of the law, one value each, such as `yield_force` [N].

    Raises:
        ValueError: If no coefficient differs from 0, a value is out of its bounds, or a parameter is missing or
            unknown.
        TypeError: If a name is not text, or `direction` is not a dictionary.

    Example:
        >>> wd.Spring("frame", {"x": 1.0, "theta": -4.0}, law="bilinear", stiffness=6e7, yield_force=9e5,
        ...           hardening_ratio=0.05)
        Spring('frame', {'x': 1.0, 'theta': -4.0}, law='bilinear', stiffness=60000000.0)
    """

    def __init__(
        self,
        name: str,
        direction: Mapping[str, float],
        *,
        law: str | StoreyElement | type[StoreyElement] = "elastic",
        stiffness: float | None = None,
        damping_coefficient: float = 0.0,
        deformation_capacity: float | None = None,
        rotational: bool | None = None,
        **parameters: float,
    ) -> None:
        self.name = checked_text("Spring: name", name)
        where = f"spring {self.name!r}"
        self.direction = checked_coefficients(f"{where}: direction", direction)
        if not any(self.direction.values()):
            raise ValueError(
                f"{where} is connected to no degree of freedom: give a coefficient other than 0 in direction, such as "
                "{'x': 1.0}"
            )
        self.law, own = _law_of(where, law, parameters)
        self.damping_coefficient = real_number(f"{where}: damping_coefficient [N s/m]", damping_coefficient, least=0)
        if stiffness is None and not (self.law.is_device or (self.law.is_linear and self.damping_coefficient > 0)):
            raise ValueError(f"{where}: stiffness is missing: law {self.law.name!r} needs it [N/m]")
        self.stiffness = 0.0
        if stiffness is not None:
            if self.law.is_device:
                raise ValueError(
                    f"{where}: {self.law.name!r} takes no stiffness: remove stiffness=, or add a spring parallel to it"
                )
            self.stiffness = real_number(f"{where}: stiffness [N/m]", stiffness, above=0)
        self.deformation_capacity = deformation_capacity
        if deformation_capacity is not None:
            self.deformation_capacity = real_number(f"{where}: deformation_capacity [m]", deformation_capacity, above=0)
        self.rotational = None if rotational is None else true_or_false(f"{where}: rotational", rotational)
        self.parameters = checked_parameters(where, self.law, {**parameters, **own})
        check_law(where, self.law, self.stiffness, self.parameters)

    def description(self) -> dict[str, object]:
        """Return the spring as a dictionary, for the JSON of its scene."""
        said: dict[str, object] = {"name": self.name, "direction": self.direction, "law": self.law.name}
        said |= {} if self.law.is_device or not self.stiffness else {"stiffness": self.stiffness}
        said |= {"damping_coefficient": self.damping_coefficient} if self.damping_coefficient else {}
        if self.deformation_capacity is not None:
            said["deformation_capacity"] = self.deformation_capacity
        said |= {} if self.rotational is None else {"rotational": self.rotational}
        return said | self.parameters

    def __repr__(self) -> str:
        stiffness = f", stiffness={self.stiffness!r}" if self.stiffness else ""
        return f"Spring({self.name!r}, {self.direction}, law={self.law.name!r}{stiffness})"


class Gauge(Spring):
    """A spring without stiffness, whose deformation is a storey drift or the displacement of a degree of freedom."""

    def __init__(self, name: str, direction: Mapping[str, float], capacity: float | None = None) -> None:
        super().__init__(name, direction, stiffness=1.0, deformation_capacity=capacity)
        self.stiffness = 0.0

    def description(self) -> dict[str, object]:
        """Return the gauge as a dictionary, for the JSON of its scene."""
        said: dict[str, object] = {"name": self.name, "direction": self.direction, "is_gauge": True}
        return said if self.deformation_capacity is None else said | {"capacity": self.deformation_capacity}


def _law_of(where: str, law: object, parameters: Mapping[str, float]) -> tuple[type[StoreyElement], dict]:
    """Return the class of a spring's law, device or contact, and the parameters of an object."""
    given = law if isinstance(law, type) else type(law)
    is_contact = law in CONTACTS if isinstance(law, str) else issubclass(given, Contact)
    is_device = law in DEVICES if isinstance(law, str) else issubclass(given, Device)
    try:
        if is_contact:
            return class_and_values("contact", law, CONTACTS, parameters)
        if is_device and not (isinstance(law, str) and law in LAWS):
            kinds, own = devices_and_values((law,), parameters)  # type: ignore[arg-type] # it refuses other classes
        else:
            laws, own = laws_and_values(law, parameters)  # type: ignore[arg-type]
            return laws[0], own
    except ValueError as error:
        raise ValueError(f"{where}: {error}") from None
    if kinds[0].is_dashpot:
        raise ValueError(f"{where}: {kinds[0].name!r} is a dashpot: give damping_coefficient= instead of a law")
    return kinds[0], own


def checked_parameters(where: str, law: type[StoreyElement], given: Mapping[str, object]) -> dict[str, float]:
    """Return the parameters of a law with their defaults, checked."""
    for name in given:
        if name not in law.parameters:
            takes = ", ".join(law.parameters) or "no parameter"
            hint = did_you_mean(name, list(law.parameters))
            raise ValueError(f"{where}: unknown parameter {name!r}{hint}; law {law.name!r} takes {takes}")
    found = {}
    for name, parameter in law.parameters.items():
        value = given.get(name, parameter.default)
        if value is None:
            if parameter.optional:
                continue
            raise ValueError(f"{where}: {name} ({parameter.long_name}) is missing: law {law.name!r} needs it")
        number = real_numbers(f"{where}: {name}", value, parameter.units)  # type: ignore[arg-type]
        if number.ndim:
            raise ValueError(f"{where}: {name} must be one value, got {shortened(value)}")
        problem = parameter.first_violation(f"{where}: {name}", number, ())
        if problem:
            raise ValueError(problem)
        found[name] = float(number)
    return found


def check_law(where: str, law: type[StoreyElement], stiffness: float, parameters: Mapping[str, float]) -> None:
    """Raise a ValueError that names the spring if the parameters of its law contradict each other."""
    values = {name: np.array([[value]]) for name, value in {**parameters, "stiffness": stiffness}.items()}
    problem = BuildingLaw([law]).problem(values)
    if problem:
        raise ValueError(f"{where}: {problem.replace(' (structure 0, storey 1)', '').replace(' (storey 1)', '')}")
