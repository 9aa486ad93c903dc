"""Find implausible values of lumped structures: of their springs, and of the buildings that builders make."""

from __future__ import annotations

from collections.abc import Mapping

import numpy as np

from warpdyn.foundations.core.plausibility import PlausibilityFindings
from warpdyn.foundations.core.units import STANDARD_GRAVITY
from warpdyn.model.structures.builders.flexural_shear_building import FlexuralShearBuilding
from warpdyn.model.structures.builders.torsional_building import TorsionalBuilding
from warpdyn.model.structures.lumped.structure import LumpedStructure

# Parameter of springs -> name of its check.
OF_SPRINGS = {
    "deformation_capacity": "spring_deformation_capacity",
    "clearance": "spring_clearance",
    "hertz_stiffness": "hertz_stiffness",
    "contact_stiffness": "spring_contact_stiffness",
    "radius": "spring_radius",
    "restitution": "restitution",
}


def add_lumped(
    findings: PlausibilityFindings, structure: LumpedStructure, values: Mapping[str, np.ndarray], where: str
) -> None:
    """Add implausible values of springs, heights and plans of a lumped structure to `findings`.

    Args:
        findings: Implausible values found so far.
        structure: The structure.
        values: Its parameters.
        where: Words that identify the structure, such as " of archetype 'old'", or "".
    """
    rotates = np.array(structure.kinds.rotating["spring"])
    names = structure.names_along("spring")

    def add(check: str, quantity: np.ndarray) -> None:
        found = quantity.tolist()
        findings.add_each(check, found, lambda place: f" of spring {names[place]!r}{where}")

    for name, check in OF_SPRINGS.items():
        if name in values:
            own = values[name] if name == "restitution" else np.where(rotates, np.nan, values[name])
            add(check, np.broadcast_to(own, rotates.shape))
    if "yield_force" in values:
        with np.errstate(divide="ignore", invalid="ignore"):
            yields = np.where(values["stiffness"] > 0, values["yield_force"] / values["stiffness"], np.nan)
        add("spring_yield_deformation", np.where(rotates, np.nan, yields))
        add("spring_yield_rotation", np.where(rotates, yields, np.nan))
        strength = np.nansum(np.where(rotates, np.nan, values["yield_force"]))
        moving = values["mass"][~np.array(structure.kinds.rotating["dof"])].sum()
        if strength > 0 and moving > 0:
            findings.add("springs_yield_over_weight", strength / (STANDARD_GRAVITY * moving), where)
    if isinstance(structure, FlexuralShearBuilding):
        heights = np.diff(structure.floor_heights, prepend=0.0)
        findings.add("storey_height", heights, where, along="storey")
        if heights.size > 1:
            ratio = structure.fundamental_period / structure.floor_heights[-1]
            findings.add("first_period_over_height", ratio, where)
    if isinstance(structure, TorsionalBuilding):
        findings.add("plan_side", np.diff(structure.plan, axis=1).ravel(), where)
