"""Find implausible yield moments of hinges and yield forces of braces, which are mostly in another unit than in SI."""

from __future__ import annotations

from typing import TYPE_CHECKING

import numpy as np

from warpdyn.foundations.core.plausibility import PlausibilityFindings
from warpdyn.model.structures.frames.column_line import ENDS

if TYPE_CHECKING:
    from warpdyn.model.structures.frames.hinges.hinged_structure import HingedStructure

# Members whose length is below this number of radii of gyration are rigid parts of joints or walls. Their hinges are
# not checked, because their yield rotations, which other members and springs determine, have no usual values.
LEAST_SLENDERNESS = 3.0
STRONG_ROTATION = 1e3  # rad; stronger hinges, such as with a yield_force of 1e12 N m, are meant to stay elastic
STRONG_STRAIN = 0.05  # the same for braces


def warn_of_implausible_hinges(structure: HingedStructure) -> None:
    """Give one warning of implausible yield rotations of member ends and yield strains of braces.

    The yield rotation of a member end is M_y L / (6 E I): its rotation if both ends have the yield moment M_y in double
    curvature. A frame with an elastic modulus of 1 is dimensionless, as frames of textbooks, and is not checked.
    """
    frame = structure.frame
    if (frame.nominal.modulus == 1.0).any():
        return
    by_name = {spring.name: spring for spring in structure.springs} | structure.given_braces
    members = {name: place for place, name in enumerate(frame.members)}
    rotations, strains = {}, {}
    for (member, end), name in zip(structure.hinges, structure.hinge_names, strict=True):
        strength = by_name[name].parameters.get("yield_force")
        if strength is None:  # an elastic hinge
            continue
        place = members[member]
        modulus, area = float(frame.nominal.modulus[place]), float(frame.nominal.area[place])
        inertia = float(frame.nominal.inertia[place])
        length = float(frame.geometry.length[place])
        if end not in ENDS:
            strains[name] = strength / (modulus * area)
        elif length >= LEAST_SLENDERNESS * np.sqrt(inertia / area):
            rotations[name] = strength * length / (6 * modulus * inertia)
    rotations = {name: each for name, each in rotations.items() if each < STRONG_ROTATION}
    strains = {name: each for name, each in strains.items() if each < STRONG_STRAIN}
    findings = PlausibilityFindings()
    for check, found in (("hinge_yield_rotation", rotations), ("brace_yield_strain", strains)):
        for name, value in found.items():
            findings.add(check, value, f" of {name!r}")
    findings.warn()
