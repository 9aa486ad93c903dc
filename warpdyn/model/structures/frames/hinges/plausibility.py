"""Find implausible yield moments and rotations of hinges and yield forces of braces, mostly in another unit than SI."""

from __future__ import annotations

from typing import TYPE_CHECKING

import numpy as np

from warpdyn.foundations.core.plausibility import PlausibilityFindings
from warpdyn.model.structures.frames.column_line import ENDS
from warpdyn.model.structures.frames.tables.plausible_springs import (
    LEAST_SLENDERNESS,
    bending_stiffness,
    soft_ends,
    spring_ratios,
)

if TYPE_CHECKING:
    from warpdyn.model.structures.frames.hinges.hinged_structure import HingedStructure
    from warpdyn.model.structures.lumped.biaxial_spring import Component
    from warpdyn.model.structures.lumped.spring import Spring

STRONG_ROTATION = 1e3  # rad; stronger hinges, such as with a yield_force of 1e12 N m, are meant to stay elastic
STRONG_STRAIN = 0.05  # the same for braces
UNLIMITED_ROTATION = 100.0  # rad; hinges with larger plastic rotations are meant not to soften
STIFFNESS_CHECK = "hinge_stiffness"
# Parameter of one side of hinges -> name of its check.
OF_PLASTIC_ROTATIONS = {
    "plastic_drift_to_capping": "hinge_plastic_rotation",
    "post_capping_drift": "hinge_post_capping_rotation",
    "ultimate_drift": "hinge_ultimate_rotation",
}
OF_CAPPING = ("yield_force", "plastic_drift_to_capping", "ultimate_drift")
DETERIORATIONS = ("strength", "post_capping", "unloading")  # the first words of parameters in "deterioration_drift"
UNLIMITED_DETERIORATION = 1e3  # rad; hinges with larger deterioration drifts are meant not to deteriorate


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
    bending = bending_stiffness(frame)
    is_soft = soft_ends(frame, spring_ratios(frame))  # the constructor of the frame has warned of them
    for (member, end), name in zip(structure.hinges, structure.hinge_names, strict=True):
        strength = by_name[name].parameters.get("yield_force", np.inf)  # of an elastic hinge: none
        place = members[member]
        modulus, area = float(frame.nominal.modulus[place]), float(frame.nominal.area[place])
        radius = np.sqrt(frame.nominal.inertia[place] / area)
        if end not in ENDS:
            strains[name] = strength / (modulus * area)
        elif frame.geometry.length[place] >= LEAST_SLENDERNESS * radius:
            # Other members and springs determine the yield rotations of shorter members, which have no usual values.
            with np.errstate(divide="ignore"):
                rotations[name] = float(strength / bending[place])
            if not is_soft[place, ENDS.index(end)]:
                ratios[name] = float(frame.geometry.end_springs[place, ENDS.index(end)] / bending[place])
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
    for spring in structure.springs:
        if found and spring.name in structure.hinge_names:
            _add_rotations(findings, spring)
    findings.warn()
    return warned


def _add_rotations(findings: PlausibilityFindings, hinge: Spring | Component) -> None:
    """Add implausible plastic, post-capping, ultimate and deterioration rotations of a hinge to `findings`."""
    given = hinge.parameters

    def rotation(name: str, unlimited: float) -> float:
        """Return a parameter [rad]; NaN if the law lacks it, or if it is 0 or so large that it means "never"."""
        value = given.get(name, np.nan)
        return value if 0 < value < unlimited else np.nan

    for side in ("", "_negative"):
        is_wrong = False
        for name, check in OF_PLASTIC_ROTATIONS.items():
            where = f" {hinge.name!r}" + (f" ({name}{side})" if side else "")
            is_wrong |= findings.add(check, rotation(name + side, UNLIMITED_ROTATION), where)
        has_capping = "ultimate_drift" in given and any(name + side in given for name in OF_CAPPING)
        if is_wrong or not has_capping:
            continue
        strength, plastic, ultimate = (given.get(name + side, given[name]) for name in OF_CAPPING)
        if 0 < ultimate < UNLIMITED_ROTATION:
            capping = strength / hinge.stiffness + plastic
            values = f" ({ultimate:.4g} and {capping:.4g} rad) of {hinge.name!r}"
            findings.add("ultimate_over_capping_rotation", ultimate / capping, values)
    for mode in DETERIORATIONS:
        name = f"{mode}_deterioration_drift"
        where = f" ({name}) of the hinge {hinge.name!r}"
        findings.add("hinge_deterioration_rotation", rotation(name, UNLIMITED_DETERIORATION), where)
