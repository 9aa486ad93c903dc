"""Values of a frame with hinges for its kernel: stiffness without the hinges, gravity loads, state under gravity."""

from __future__ import annotations

from dataclasses import replace
from typing import TYPE_CHECKING, NamedTuple

import numpy as np

from warpdyn.model.structures.frames.members.elements import (
    ROTATIONS,
    EndConditions,
    Sections,
    beam_stiffness,
    end_conditions,
)
from warpdyn.model.structures.frames.static import load_vector, member_forces_fixed

if TYPE_CHECKING:
    from warpdyn.model.structures.frames.frame import Frame
    from warpdyn.model.structures.frames.hinges.joints import Joints

# Stiffness of the elastic part of a brace that yields, relative to that of the whole brace. Forces are differences of
# displacements of the two parts, whose last digits float32 keeps up to about this ratio.
ELASTIC_PART = 100.0


class FrameValues(NamedTuple):
    """Matrices and vectors of structures; the first dimension is structure, or 1 if they are equal.

    Attributes:
        bending: Stiffness of the members with hinges between their ends [N m/rad], shape [structure, member, 2, 2].
        linear: Stiffness of all else in the unknowns and drifts, shape [structure, unknown + storey, same].
        member_loads: Moments at the ends of members with hinges under their gravity loads [N m], shape [structure,
            member, 2].
        loads: Gravity loads on unknowns and drifts, shape [structure, unknown + storey].
        drifts: Drifts under gravity [m], shape [structure, storey].
        moments: Moments of the hinged ends under gravity [N m], shape [structure, member, 2].
    """

    bending: np.ndarray
    linear: np.ndarray
    member_loads: np.ndarray
    loads: np.ndarray
    drifts: np.ndarray
    moments: np.ndarray


class HingedMembers(NamedTuple):
    """The members with hinges.

    Attributes:
        members: Their indices in the frame.
        is_hinge: Whether their ends have hinges, shape [member, 2].
        stiffness: Initial stiffness of the hinges [N m/rad], infinite at other ends, shape [member, 2].
        is_axial: Whether they are braces, shape [member]. A brace is an elastic and a yielding part in series. The
            yielding part is the "hinge" at its start, whose chord turns by the elongation [m].
    """

    members: list[int]
    is_hinge: np.ndarray
    stiffness: np.ndarray
    is_axial: np.ndarray


def values_of(
    frame: Frame, joints: Joints, hinged: HingedMembers, sections: Sections, *, has_p_delta: bool, floors: np.ndarray
) -> FrameValues:
    """Return the values of structures with these section properties, shape [structure, member].

    Args:
        frame: The frame.
        joints: Its unknowns.
        hinged: Its members with hinges.
        sections: Section properties.
        has_p_delta: Whether gravity loads soften the frame.
        floors: Numbers of the floors among the free degrees of freedom.
    """
    members = hinged.members
    # The hinges are not a part of the members here: their ends are rigid, others keep their springs and releases.
    springs = frame.geometry.end_springs.copy()
    springs[members] = np.where(hinged.is_hinge, np.inf, springs[members])
    geometry = replace(frame.geometry, end_springs=springs)
    plain = beam_stiffness(geometry, sections)
    conditions = end_conditions(geometry, plain)
    local = plain @ conditions.ends
    local = (local + np.swapaxes(local, -1, -2)) / 2
    bending = local[..., members, :, :][..., ROTATIONS, :][..., :, ROTATIONS]
    axial = np.flatnonzero(hinged.is_axial)
    bending[..., axial, :, :] = 0.0
    braces = np.array(members)[axial]
    bending[..., axial, 0, 0] = ELASTIC_PART * local[..., braces, 0, 0]
    linear = local.copy()
    for place in (0, 3):
        linear[..., braces, place, :] = 0.0
        linear[..., braces, :, place] = 0.0
    for place in (1, 2, 4, 5):
        linear[..., members, place, :] = 0.0
        linear[..., members, :, place] = 0.0
    numbering = frame.numbering
    matrix = numbering.assembled_of_many(frame.in_nodes(linear), has_springs=True)
    total = joints.to_free.T @ matrix @ joints.to_free
    of_floors = np.zeros_like(total[:1])
    if has_p_delta:
        geometric = geometric_stiffness(frame)
        on_floors = np.zeros_like(geometric)
        on_floors[np.ix_(floors, floors)] = geometric[np.ix_(floors, floors)]
        total = total + joints.to_free.T @ (geometric - on_floors) @ joints.to_free
        of_floors = (joints.to_free.T @ on_floors @ joints.to_free)[None]
    loads, member_loads = _gravity(frame, joints, members, plain, conditions)
    drifts, moments = _under_gravity(joints, hinged, bending, total + of_floors, loads, member_loads)
    return FrameValues(bending, total, member_loads, loads, drifts, moments)


def geometric_stiffness(frame: Frame) -> np.ndarray:
    """Return the geometric stiffness under gravity of the free degrees of freedom, shape [free, free]."""
    members = frame.in_nodes(frame.local_geometric(frame.gravity, None))
    found: np.ndarray = frame.numbering.assembled_of_many(members)[0]
    return found


def _gravity(
    frame: Frame, joints: Joints, members: list[int], plain: np.ndarray, conditions: EndConditions
) -> tuple[np.ndarray, np.ndarray]:
    """Return the gravity loads on unknowns and drifts, and the moments at the ends of members with hinges."""
    numbering = frame.numbering
    nodal = load_vector(frame, {}, has_gravity=True)
    fixed = member_forces_fixed(frame, (), has_gravity=True)
    turned = np.zeros((*plain.shape[:-2], 6))
    turned[..., ROTATIONS] = np.einsum("...mij,mj->...mi", conditions.relief, fixed[:, ROTATIONS])
    own = fixed + np.einsum("...mij,...mj->...mi", plain, turned)
    moments = own[..., members, :][..., ROTATIONS]
    # The moments of these members and the shear forces that balance them are forces of the kernel's members.
    others = own.copy()
    shear = moments.sum(axis=-1) / frame.geometry.length[members]
    others[..., members, 1] -= shear
    others[..., members, 4] += shear
    for place in ROTATIONS:
        others[..., members, place] = 0.0
    in_nodes = np.einsum("mji,...mj->...mi", frame.geometry.to_local, others)
    flat = in_nodes.reshape(len(in_nodes), -1)
    equivalent = np.zeros((len(flat), len(numbering.names)))
    for structure in range(len(flat)):
        np.add.at(equivalent[structure], numbering.of_members.ravel(), flat[structure])
    forces = (nodal - equivalent)[:, numbering.free]
    return forces @ joints.to_free, moments


def _under_gravity(
    joints: Joints,
    hinged: HingedMembers,
    bending: np.ndarray,
    linear: np.ndarray,
    loads: np.ndarray,
    member_loads: np.ndarray,
) -> tuple[np.ndarray, np.ndarray]:
    """Return drifts [m] and moments of hinged members' ends [N m] under gravity, with the hinges' initial stiffness."""
    unknowns, count = joints.places.size, joints.to_free.shape[1]
    turns = np.repeat(-joints.chords[:, None, :], 2, axis=1)  # of ends relative to chords per unknown and drift
    for member, rows in enumerate(joints.rotations):
        for end, row in enumerate(rows):
            if row < unknowns:
                turns[member, end, row] += 1.0
    with np.errstate(divide="ignore"):
        flexible = bending / hinged.stiffness[:, :, None]
    reduced = bending @ np.linalg.inv(np.eye(2) + flexible)
    eased = np.linalg.solve(np.eye(2) + np.swapaxes(flexible, -1, -2), member_loads[..., None])[..., 0]
    stiffness = linear + np.einsum("mai,smab,mbj->sij", turns, reduced, turns, optimize=True)
    right = loads - np.einsum("mai,sma->si", turns, eased)
    found = np.linalg.solve(stiffness, np.broadcast_to(right, (len(stiffness), count))[..., None])[..., 0]
    moments = np.einsum("smab,mbj,sj->sma", reduced, turns, found, optimize=True) + eased
    return found[:, unknowns:], moments
