"""Find implausible yield moments and rotations of hinges and yield forces of braces, mostly in another unit than SI."""

from __future__ import annotations

from collections.abc import Sequence
from typing import TYPE_CHECKING

import numpy as np

from warpdyn.foundations.core.plausibility import PlausibilityFindings
from warpdyn.model.structures.frames.column_line import ENDS

if TYPE_CHECKING:
    from warpdyn.model.structures.frames.frame import Frame
    from warpdyn.model.structures.frames.hinges.hinged_structure import HingedStructure

# Members whose length is below this number of radii of gyration are rigid parts of joints or walls. Their hinges are
# not checked, because their yield rotations, which other members and springs determine, have no usual values.
LEAST_SLENDERNESS = 3.0
STRONG_ROTATION = 1e3  # rad; stronger hinges, such as with a yield_force of 1e12 N m, are meant to stay elastic
STRONG_STRAIN = 0.05  # the same for braces
UNLIMITED_ROTATION = 100.0  # rad; hinges with larger plastic rotations are meant not to soften
STIFFNESS_CHECK = "hinge_stiffness"
# Parameter of hinges -> name of its check.
OF_PLASTIC_ROTATIONS = {
    "plastic_drift_to_capping": "hinge_plastic_rotation",
    "plastic_drift_to_capping_negative": "hinge_plastic_rotation",
    "post_capping_drift": "hinge_post_capping_rotation",
    "post_capping_drift_negative": "hinge_post_capping_rotation",
}


def bending_stiffness(frame: Frame, places: Sequence[int]) -> np.ndarray:
    """Return 6 E I / L of members, the moments of both ends per rotation in double curvature [N m/rad].

    Args:
        frame: The frame.
        places: Indices of the members.
    """
    nominal = frame.nominal
    found: np.ndarray = 6 * nominal.modulus[places] * nominal.inertia[places] / frame.geometry.length[places]
    return found


def _values_of_hinges(structure: HingedStructure) -> dict[str, dict[str, float]]:
    """Return yield rotations of member ends, yield strains of braces and stiffness ratios, {check: {hinge: value}}.

    The yield rotation of a member end is M_y L / (6 E I): its rotation if both ends have the yield moment M_y in double
    curvature. Members that are meant to be rigid, and yield moments of hinges that are meant to stay elastic, are left
    out. A frame with an elastic modulus of 1 is dimensionless, as frames of textbooks, and is not checked.
    """
    frame = structure.frame
    if (frame.nominal.modulus == 1.0).any():
        return {}
    by_name = {spring.name: spring for spring in structure.springs} | structure.given_braces
    members = {name: place for place, name in enumerate(frame.members)}
    rotations, strains, ratios = {}, {}, {}
    for (member, end), name in zip(structure.hinges, structure.hinge_names, strict=True):
        strength = by_name[name].parameters.get("yield_force", np.inf)  # of an elastic hinge: none
        place = members[member]
        modulus, area = float(frame.nominal.modulus[place]), float(frame.nominal.area[place])
        radius = np.sqrt(frame.nominal.inertia[place] / area)
        if end not in ENDS:
            strains[name] = strength / (modulus * area)
        elif frame.geometry.length[place] >= LEAST_SLENDERNESS * radius:
            [stiffness] = bending_stiffness(frame, [place])
            with np.errstate(divide="ignore"):
                rotations[name] = float(strength / stiffness)
                ratios[name] = float(frame.geometry.end_springs[place, ENDS.index(end)] / stiffness)
    rotations = {name: each for name, each in rotations.items() if each < STRONG_ROTATION}
    strains = {name: each for name, each in strains.items() if each < STRONG_STRAIN}
    return {"hinge_yield_rotation": rotations, "brace_yield_strain": strains, STIFFNESS_CHECK: ratios}


def warn_of_implausible_hinges(structure: HingedStructure) -> tuple[str, ...]:
    """Give one warning of implausible stiffnesses, yield and plastic rotations of hinges, and yield strains of braces.

    Returns the names of the hinges with an implausible yield_force. Later checks do not warn of these again.
    """
    findings = PlausibilityFindings()
    found = _values_of_hinges(structure)
    warned = tuple(
        name
        for check, of_hinges in found.items()
        for name, value in of_hinges.items()
        if findings.add(check, value, f" of {name!r}") and check != STIFFNESS_CHECK
    )
    rotating = [spring for spring in structure.springs if found and spring.name in structure.hinge_names]
    for spring in rotating:
        for parameter, check in OF_PLASTIC_ROTATIONS.items():
            rotation = spring.parameters.get(parameter, np.nan)
            findings.add(check, rotation if rotation < UNLIMITED_ROTATION else np.nan, f" {spring.name!r}")
    findings.warn()
    return warned
