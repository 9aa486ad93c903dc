"""Checks of frames with hinges and several bays, and of the table of their hinges."""

from __future__ import annotations

from collections.abc import Collection, Mapping, Sequence
from typing import TYPE_CHECKING, Any

import numpy as np

from warpdyn.foundations.core.checks import shortened
from warpdyn.foundations.core.messages import warn_caller
from warpdyn.foundations.core.near_misses import did_you_mean
from warpdyn.model.structures.frames.column_line import ENDS
from warpdyn.model.structures.frames.reduction import gravity_on_supports

if TYPE_CHECKING:
    from warpdyn.model.structures.frames.frame import Frame
    from warpdyn.model.structures.lumped.biaxial_spring import Component
    from warpdyn.model.structures.lumped.spring import Spring

WHO = "HingedFrame"
AXIAL = "axial"  # place of the axial spring of a brace that yields, in the table of hinges
LAWS_OF_BRACES = ("bilinear", "elastic", "elastic_perfectly_plastic")
EXAMPLE = "{('C1', 'start'): {'law': 'bilinear', 'yield_force': 5e5, 'hardening_ratio': 0.02}}"


def check_frame(frame: Frame) -> None:
    """Raise an error if the kernel of frames with hinges cannot model the frame."""
    if frame.geometric_kind != "string":
        raise ValueError(f"{WHO}: give the frame geometric_stiffness='string': P-Delta acts on the chords of members")
    if not frame.diaphragms:
        raise ValueError(
            f"{WHO}: the frame has no rigid floors, whose displacements are integrated: give the frame diaphragms= "
            "with the nodes of each floor"
        )
    numbering = frame.numbering
    mass = frame.mass().diagonal()
    for place in numbering.free:
        name = numbering.names[place]
        if mass[place] > 0 and name not in frame.diaphragms:
            raise ValueError(
                f"{WHO}: {name!r} has the mass {mass[place]:g}, but only floors can move with a mass: rotations and "
                "vertical displacements are solved without inertia forces. Give masses={floor: kg} of diaphragms "
                "instead of masses of nodes, and no mass_per_length"
            )
        if mass[place] == 0 and name in frame.diaphragms:
            raise ValueError(f"{WHO}: floor {name!r} has no mass: give masses={{{name!r}: kg}}")
    drifts = [upper for upper, _, _ in frame.storey_drifts.values()]
    for name in frame.diaphragms:
        if numbering.names.index(name) in numbering.free and name not in drifts:
            raise ValueError(
                f"{WHO}: floor {name!r} is at the height of another floor or of the ground: give each storey one "
                "diaphragm"
            )


def check_gravity(frame: Frame) -> None:
    """Raise an error if a gravity load with P-Delta acts on a node that is supported vertically."""
    held = gravity_on_supports(frame)
    if held:
        raise ValueError(
            f"{WHO}: p_delta=True, but the gravity_load of node {held[0]!r} has no P-Delta effect, because the node is "
            "supported vertically: put the load on a leaning column, a line of members with kind='truss' from a "
            "pinned support to each floor"
        )


def checked_hinges(frame: Frame, given: object) -> dict[tuple[str, str], dict[str, Any]]:
    """Return {(member, end): parameters with the law}, or raise an error that names a wrong hinge."""
    if not isinstance(given, Mapping):
        raise TypeError(f"hinges must be a dictionary, such as {EXAMPLE}, got {shortened(given)}")
    if not given:
        raise ValueError(
            f"hinges is empty: give at least one hinge, such as {EXAMPLE}, or use Frame.lumped for a frame without "
            "hinges"
        )
    names = list(frame.members)
    found = {}
    for place, row in given.items():
        if not isinstance(place, tuple) or len(place) != 2:
            raise ValueError(
                f"hinges: {place!r} is not a pair such as ('C1', 'start'): give (member, 'start' or 'end')"
            )
        member, end = place
        if member not in names:
            raise ValueError(f"hinges: {member!r} of {place!r} is not a member{did_you_mean(str(member), names)}")
        if not isinstance(row, Mapping) or "law" not in row:
            raise ValueError(f"hinges: {place!r} needs a dictionary with 'law', got {shortened(row)}")
        if end == AXIAL:
            found[place] = _checked_brace(frame, member, row)
            continue
        if end not in ENDS:
            raise ValueError(
                f"hinges: {end!r} of {place!r} is not an end: give 'start', 'end' or, for a truss, 'axial'"
            )
        if frame.members[member]["kind"] == "truss":
            raise ValueError(
                f"hinges: member {member!r} has kind='truss' and no moments: remove its hinge {place!r}, or give "
                f"{(member, AXIAL)!r} if it yields in tension and compression"
            )
        stiffness = frame.geometry.end_springs[names.index(member), ENDS.index(end)]
        if stiffness == 0:
            raise ValueError(
                f"hinges: the end {place!r} is released and has no moment: remove its hinge, or the release"
            )
        if np.isinf(stiffness):
            raise ValueError(
                f"hinges: the end {place!r} has no spring: give member {member!r} spring_{end}= the initial "
                "stiffness of the hinge [N m/rad], a finite number"
            )
        if "stiffness" in row:
            raise ValueError(f"hinges: remove stiffness of {place!r}: it is spring_{end} of member {member!r}")
        found[place] = {str(name): value for name, value in row.items()}
    return found


def _checked_brace(frame: Frame, member: str, row: Mapping[str, Any]) -> dict[str, Any]:
    """Return the law and the parameters of a brace that yields, or raise an error."""
    place = (member, AXIAL)
    if frame.members[member]["kind"] != "truss":
        raise ValueError(f"hinges: {place!r} needs a member with kind='truss'; {member!r} is a beam or a column")
    law = row["law"]
    name = law if isinstance(law, str) else getattr(law, "name", law)
    if name not in LAWS_OF_BRACES:
        raise ValueError(
            f"hinges: {shortened(law)} is not a law of braces: choose one of {', '.join(LAWS_OF_BRACES)} for "
            f"{place!r}. Buckling is not modelled"
        )
    if "stiffness" in row:
        raise ValueError(f"hinges: remove stiffness of {place!r}: it is elastic_modulus * area / length of {member!r}")
    return {str(name): value for name, value in row.items()}


def warn_of_gravity_moments(
    hinges: Sequence[Spring | Component], moments: np.ndarray, implausible: Collection[str]
) -> None:
    """Warn if gravity alone makes hinges or braces yield.

    Args:
        hinges: The hinges.
        moments: Their absolute moments, or forces of braces, under gravity [N m or N], shape [hinge].
        implausible: Names of hinges whose yield_force has been warned of.
    """
    is_warned = np.array([each.name in implausible for each in hinges])
    strength = np.array([each.parameters.get("yield_force", np.inf) for each in hinges])
    strength = np.where(is_warned, np.inf, strength)
    over = np.flatnonzero(moments > strength)
    if over.size:
        worst = int(over[np.argmax(moments[over] / strength[over])])
        others = f" (and {over.size - 1} other hinges)" if over.size > 1 else ""
        quantity, unit = ("force", "N") if hinges[worst].name.endswith(f" {AXIAL}") else ("moment", "N m")
        warn_caller(
            f"{WHO}: gravity alone exceeds the yield {quantity} of hinge {hinges[worst].name!r}{others}: {quantity} "
            f"{moments[worst]:.4g} {unit}, yield_force {strength[worst]:.4g} {unit}. Check the units of gravity_load "
            f"[N] and yield_force [{unit}]; with correct values the frame has yielded before the motion"
        )
