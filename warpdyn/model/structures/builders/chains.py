"""Shear buildings as lumped structures, to which other degrees of freedom can be added."""

from __future__ import annotations

from typing import Any

import numpy as np

from warpdyn.foundations.core.checks import check_kind
from warpdyn.foundations.core.near_misses import suggests_names
from warpdyn.model.structures.builders.gravity import geometric_stiffness
from warpdyn.model.structures.lumped.damping import DAMPINGS
from warpdyn.model.structures.lumped.spring import Spring
from warpdyn.model.structures.lumped.structure import LumpedStructure
from warpdyn.model.structures.shear_building import ShearBuilding

NOT_OF_LAWS = ("mass", "stiffness", "height", "gravity_load", "drift_capacity", "drift_ratio_capacity", "damping_ratio")


@suggests_names
def lumped_chain(building: ShearBuilding) -> LumpedStructure:
    """Return a shear building as a lumped structure, with the same response.

    A ShearBuilding is faster, but only a lumped structure can have equipment and absorbers with inerters
    (`wd.with_equipment`, `wd.with_absorber`).

    Degrees of freedom: "u1", "u2" and so on; springs: "storey 1", "storey 2" and so on.

    Args:
        building: The building, without devices; its damping must not be "rayleigh_tangent" or of some storeys only.

    Returns:
        The lumped structure.

    Raises:
        ValueError: If the building has devices, or damping that a lumped structure cannot have.
        TypeError: If `building` is not a ShearBuilding.

    Example:
        >>> wd.lumped_chain(building)
        LumpedStructure(2 degrees of freedom, 2 springs, law='bilinear', damping='rayleigh')
    """
    check_kind("lumped_chain", "a ShearBuilding", building, ShearBuilding)
    if building.devices:
        raise ValueError(
            f"lumped_chain(): the building has devices ({', '.join(building.devices)}): make it without devices=, and "
            "give a wd.LumpedStructure springs with these laws"
        )
    if building.damping not in (*DAMPINGS, "storey") or building.damped_storeys:
        given = "damped_storeys=" if building.damped_storeys else f"damping={building.damping!r}"
        raise ValueError(
            f"lumped_chain(): a lumped structure cannot have {given}: give the building damping='rayleigh' without "
            "damped_storeys="
        )
    values = building.parameters
    heights = values["height"]
    capacities = [values[name] for name in ("drift_capacity",) if name in values]
    capacities += [values["drift_ratio_capacity"] * heights] if "drift_ratio_capacity" in values else []
    floors = [f"u{floor}" for floor in range(1, building.storeys + 1)]
    springs = []
    for storey, floor in enumerate(floors):
        parameters: dict[str, Any] = {
            name: float(value[storey])
            for name, value in values.items()
            if name not in NOT_OF_LAWS and np.isfinite(value[storey])
        }
        if capacities:
            parameters["deformation_capacity"] = float(np.min([each[storey] for each in capacities]))
        direction = {floor: 1.0} | ({floors[storey - 1]: -1.0} if storey else {})
        law = building.storey_law.of_storeys[storey if len(building.storey_laws) > 1 else 0]
        stiffness = float(values["stiffness"][storey])
        springs.append(Spring(f"storey {storey + 1}", direction, law=law, stiffness=stiffness, **parameters))
    loads = values.get("gravity_load")
    is_storey = building.damping == "storey"
    return LumpedStructure(
        dict(zip(floors, values["mass"].tolist(), strict=True)),
        springs,
        geometric_stiffness=None if loads is None else geometric_stiffness(loads, heights),
        damping="none" if is_storey else building.damping,
        damping_ratio=float(values["damping_ratio"]) if "damping_ratio" in values else None,
        damping_modes=building.damping_modes if building.damping == "rayleigh" else None,
        storey_height=heights,
        storey_springs=[spring.name for spring in springs],
    )
