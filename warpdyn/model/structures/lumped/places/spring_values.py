"""Springs of a lumped structure as a checked list, and the parameters of all of them as arrays."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from dataclasses import replace

import numpy as np

from warpdyn.engine.laws import Parameter
from warpdyn.engine.laws.building_law import BuildingLaw
from warpdyn.foundations.core.checks import shortened
from warpdyn.model.structures.damping import DAMPING_RATIO
from warpdyn.model.structures.lumped.biaxial_spring import BiaxialSpring, Component
from warpdyn.model.structures.lumped.matrices import INCIDENCE
from warpdyn.model.structures.lumped.names import check_known
from warpdyn.model.structures.lumped.spring import Spring

MOST_SPRINGS = 128


def checked_springs(given: object, dofs: Sequence[str], most: int = MOST_SPRINGS) -> tuple[Spring | Component, ...]:
    """Return the springs and then the components of biaxial springs, or raise an error that names a wrong one."""
    if not isinstance(given, list | tuple) or not all(isinstance(each, Spring | BiaxialSpring) for each in given):
        raise TypeError(f"springs must be a list of Springs, got {shortened(given)}")
    found: list[Spring | Component] = [each for each in given if isinstance(each, Spring)]
    found += [part for each in given if isinstance(each, BiaxialSpring) for part in each.components]
    if not 1 <= len(found) <= most:
        raise ValueError(f"a lumped structure has 1 to {most} springs, got {len(found)}")
    names: set[str] = set()
    for spring in found:
        if spring.name in names:
            raise ValueError(f"two springs have the name {spring.name!r}: give the springs different names")
        names.add(spring.name)
        check_known(f"spring {spring.name!r}", spring.direction, dofs)
    return tuple(found)


def spring_values(springs: Sequence[Spring | Component]) -> dict[str, np.ndarray]:
    """Return the parameters of all springs, shape [spring]; NaN where the law of a spring does not have them."""
    found = {"stiffness": np.array([spring.stiffness for spring in springs])}
    if any(spring.damping_coefficient for spring in springs):
        found["damping_coefficient"] = np.array([spring.damping_coefficient for spring in springs])
    if any(spring.deformation_capacity is not None for spring in springs):
        capacities = [spring.deformation_capacity for spring in springs]
        found["deformation_capacity"] = np.array([np.nan if each is None else each for each in capacities])
    for name in dict.fromkeys(name for spring in springs for name in spring.parameters):
        for spring in springs:
            if name in spring.law.parameters and name not in spring.parameters:
                raise ValueError(
                    f"spring {spring.name!r}: {name} is missing: give it in all springs of law {spring.law.name!r}, or "
                    "in none of them"
                )
        found[name] = np.array([spring.parameters.get(name, np.nan) for spring in springs])
    return found


def parameters_of_springs(law: BuildingLaw, arrays: Mapping[str, np.ndarray]) -> dict[str, Parameter]:
    """Return {name of a parameter: units and bounds}."""
    known = {
        "mass": Parameter("kg", "mass of the degree of freedom", low=0.0),
        "stiffness": Parameter("N m-1", "initial stiffness of the spring", low=0.0),
        "damping_coefficient": Parameter("N s m-1", "coefficient of the spring's dashpot", low=0.0),
        "deformation_capacity": Parameter("m", "deformation of the spring at collapse", low=0.0, low_open=True),
        "height": Parameter("m", "storey height", low=0.0, low_open=True),
        "damping_ratio": DAMPING_RATIO,
        INCIDENCE: Parameter("rad", "angle from the first component of the motion to the x axis of the structure"),
    }
    of_laws = {
        name: replace(each, long_name=each.long_name.replace("storey", "spring"))
        for name, each in law.parameters.items()
    }
    return {name: (known | of_laws)[name] for name in arrays}
