"""The springs that one frame, or one law, has in each storey, and the axial forces of storeys."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from typing import Any

import numpy as np
from numpy.typing import ArrayLike

from warpdyn.engine.laws.law import Law
from warpdyn.engine.laws.lookup import laws_and_values
from warpdyn.foundations.core.plausibility import PlausibilityFindings
from warpdyn.foundations.core.units import STANDARD_GRAVITY
from warpdyn.model.structures.lumped.places.storey_values import storey_values
from warpdyn.model.structures.lumped.spring import Spring

LawOfStoreys = str | Law | type[Law]


def storey_springs(
    what: str,
    names: Sequence[str],
    directions: Sequence[Mapping[str, float]],
    stiffness: np.ndarray,
    law: LawOfStoreys,
    parameters: Mapping[str, ArrayLike],
) -> list[Spring]:
    """Return one spring per storey, all with the same law.

    Args:
        what: Name of the frame or building, for messages.
        names: Name of each spring.
        directions: Direction of each spring.
        stiffness: Initial stiffness of each spring [N/m], shape [storey].
        law: The storey law.
        parameters: Parameters of the law, and `damping_coefficient` and `deformation_capacity`: one value each, or one
            per storey.
    """
    try:
        laws, own = laws_and_values(law, parameters)
    except ValueError as error:
        raise ValueError(f"{what}: {error}") from None
    if len(laws) != 1:
        raise ValueError(f"{what}: law must be one law for all storeys; give parameters with one value per storey")
    values = {
        name: storey_values(f"{what}: {name}", value, len(names), "", least=-np.inf)
        for name, value in {**parameters, **own}.items()
    }
    of_storeys: list[dict[str, Any]] = [
        {key: float(value[storey]) for key, value in values.items()} for storey in range(len(names))
    ]
    return [
        Spring(name, direction, law=laws[0], stiffness=own, **given)
        for name, direction, own, given in zip(names, directions, stiffness, of_storeys, strict=True)
    ]


def axial_forces(gravity_load: ArrayLike | str | None, floor_mass: np.ndarray) -> np.ndarray | None:
    """Return the axial force of each storey [N], shape [storey]; None: no P-Delta.

    Args:
        gravity_load: Vertical load of each floor [N], "weight" for the weight of the floor masses, or None.
        floor_mass: Floor masses [kg], shape [floor].
    """
    if gravity_load is None:
        return None
    if isinstance(gravity_load, str):
        if gravity_load != "weight":
            raise ValueError(
                f"gravity_load is {gravity_load!r}: give 'weight' (floor masses times {STANDARD_GRAVITY} m/s2), or the "
                "vertical load of each floor in N"
            )
        loads = floor_mass * STANDARD_GRAVITY
    else:
        loads = storey_values("gravity_load", gravity_load, floor_mass.size, "N", least=0.0)
        if loads.any():
            findings = PlausibilityFindings()
            findings.add("gravity_load_over_weight", loads.sum() / (floor_mass.sum() * STANDARD_GRAVITY))
            findings.warn()
    return np.cumsum(loads[::-1])[::-1]
