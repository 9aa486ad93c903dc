"""Values of a frame with hinges for its kernel: stiffness without the hinges, gravity loads, state under gravity."""

from __future__ import annotations

from dataclasses import replace
from typing import TYPE_CHECKING, NamedTuple

import numpy as np
from scipy import sparse

from warpdyn.model.structures.frames.members.elements import (
    ROTATIONS,
    Geometry,
    Sections,
    beam_stiffness,
    end_conditions,
    stiffness_coefficients,
)
from warpdyn.model.structures.frames.static import load_vector, member_forces_fixed

if TYPE_CHECKING:
    from warpdyn.model.structures.frames.frame import Frame
    from warpdyn.model.structures.frames.hinges.joints import Joints
    from warpdyn.model.structures.frames.members.condensation import Condensation

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
    """

    bending: np.ndarray
    linear: np.ndarray
    member_loads: np.ndarray
    loads: np.ndarray


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


class Permanent(NamedTuple):
    """Loads and stiffness that are equal in all structures.

    Attributes:
        linear: Stiffness of supports plus geometric stiffness (tension positive) without that between floors, in
            unknowns and drifts.
        of_floors: Geometric stiffness between floors, also in unknowns and drifts.
        nodal: Gravity loads of nodes, shape [free].
        fixed: Forces on the fixed ends of members under their gravity loads, in local axes, shape [member, 6].
    """

    linear: np.ndarray
    of_floors: np.ndarray
    nodal: np.ndarray
    fixed: np.ndarray


def permanent_of(frame: Frame, joints: Joints, floors: np.ndarray, *, has_p_delta: bool) -> Permanent:
    """Return the permanent loads, the stiffness of supports and the softening.

    Args:
        frame: The frame.
        joints: Its unknowns.
        floors: Numbers of the floors among the free degrees of freedom.
        has_p_delta: Whether gravity loads soften the frame.
    """
    geometric = geometric_stiffness(frame) if has_p_delta else np.zeros((len(joints.to_free),) * 2)
    on_floors = np.zeros_like(geometric)
    on_floors[np.ix_(floors, floors)] = geometric[np.ix_(floors, floors)]
    free = frame.numbering.free
    linear = np.diag(frame.numbering.springs[free]) + geometric - on_floors
    nodal = load_vector(frame, {}, has_gravity=True)[free]
    return Permanent(
        joints.to_free.T @ linear @ joints.to_free,
        joints.to_free.T @ on_floors @ joints.to_free,
        nodal,
        member_forces_fixed(frame, (), has_gravity=True),
    )


def values_of(
    frame: Frame, joints: Joints, hinged: HingedMembers, permanent: Permanent, sections: Sections
) -> FrameValues:
    """Return the values of structures with these section properties, shape [structure, member].

    Args:
        frame: The frame.
        joints: Its unknowns.
        hinged: Its members with hinges.
        permanent: Its permanent loads.
        sections: Section properties.
    """
    members = hinged.members
    # The hinges are not a part of the members here: their ends are rigid, others keep their springs and releases.
    springs = frame.geometry.end_springs.copy()
    springs[members] = np.where(hinged.is_hinge, np.inf, springs[members])
    geometry = replace(frame.geometry, end_springs=springs)
    # Values of successive structures are contiguous in memory, here and in the results.
    others = np.moveaxis(stiffness_coefficients(geometry, sections), 0, -1)
    axial = np.flatnonzero(hinged.is_axial)
    braces = np.array(members)[axial]
    bending = others[np.array(members)[:, None, None], [[1, 2], [2, 3]]]
    bending[axial] = 0.0
    bending[axial, 0, 0] = ELASTIC_PART * others[braces, 0]
    others[members, 1:] = 0.0
    others[braces, 0] = 0.0
    if (others == others[..., :1]).all():
        others = others[..., :1]
    size = joints.to_free.shape[1]
    linear = np.moveaxis((joints.of_members @ others.reshape(-1, others.shape[-1])).reshape(size, size, -1), -1, 0)
    loads, member_loads = _gravity(frame, joints, members, permanent, geometry, sections)
    return FrameValues(np.moveaxis(bending, -1, 0), linear + permanent.linear, member_loads, loads)


def geometric_stiffness(frame: Frame) -> np.ndarray:
    """Return the geometric stiffness under gravity of the free degrees of freedom, shape [free, free]."""
    members = frame.in_nodes(frame.local_geometric(frame.gravity, None))
    found: np.ndarray = frame.numbering.assembled_of_many(members)[0]
    return found


def floors_under_gravity(
    frame: Frame, condensation: Condensation, softening: np.ndarray, permanent: Permanent, sections: Sections
) -> np.ndarray:
    """Return the displacements of floors under gravity [m], with the hinges' initial stiffness, [structure, floor].

    Args:
        frame: The frame.
        condensation: Condensation to the floors.
        softening: Geometric stiffness between floors that the condensation does not contain, tension positive.
        permanent: Permanent loads.
        sections: Section properties.
    """
    loaded, own = _end_forces(permanent, frame.geometry, sections)
    equivalent = _to_nodes(frame, loaded)[:, frame.numbering.free]
    loads = permanent.nodal - (sparse.csr_array(equivalent.T) @ own.reshape(len(own), 6 * loaded.size).T).T
    coefficients = stiffness_coefficients(frame.geometry, sections)
    stiffness, forces = condensation.with_loads(coefficients, loads)
    found: np.ndarray = np.linalg.solve(stiffness + softening, forces[..., None])[..., 0]
    return found


def _end_forces(permanent: Permanent, geometry: Geometry, sections: Sections) -> tuple[np.ndarray, np.ndarray]:
    """Return the members with gravity loads, and the forces on their ends if their nodes are fixed.

    The forces have the shape [structure, member, 6].
    """
    loaded = np.flatnonzero(permanent.fixed.any(axis=1))
    fixed, geometry = permanent.fixed[loaded], geometry.select(loaded)
    plain = beam_stiffness(geometry, sections.select(loaded))
    turned = np.zeros((*plain.shape[:-2], 6))
    turned[..., ROTATIONS] = np.einsum("smij,mj->smi", end_conditions(geometry, plain).relief, fixed[:, ROTATIONS])
    return loaded, fixed + np.einsum("smij,smj->smi", plain, turned)


def _to_nodes(frame: Frame, members: np.ndarray) -> np.ndarray:
    """Return the displacements of the members' ends per displacement of nodes, shape [member times 6, dof]."""
    found = np.zeros((len(members), 6, len(frame.numbering.names)))
    number, row = np.ogrid[: len(members), :6]
    places = np.broadcast_to(frame.numbering.of_members[members][:, None], (len(members), 6, 6))
    np.add.at(found, (number[..., None], row[..., None], places), frame.geometry.to_local[members])
    return found.reshape(6 * len(members), found.shape[2])


def _gravity(
    frame: Frame, joints: Joints, members: list[int], permanent: Permanent, geometry: Geometry, sections: Sections
) -> tuple[np.ndarray, np.ndarray]:
    """Return the gravity loads on unknowns and drifts, and the moments at the ends of members with hinges."""
    nodal = permanent.nodal @ joints.to_free
    if not permanent.fixed.any():
        return nodal[None], np.zeros((1, len(members), 2))
    loaded, own = _end_forces(permanent, geometry, sections)
    found = np.zeros((len(own), len(members), 2))
    # The moments of members with hinges and the shear forces that balance them are forces of the kernel's members.
    rows = np.flatnonzero(np.isin(loaded, members))
    moments = own[:, rows][..., ROTATIONS]
    shear = moments.sum(axis=-1) / geometry.length[loaded[rows]]
    own[:, rows, 1] -= shear
    own[:, rows, 4] += shear
    for place in ROTATIONS:
        own[:, rows, place] = 0.0
    found[:, np.searchsorted(members, loaded[rows])] = moments
    equivalent = _to_nodes(frame, loaded)[:, frame.numbering.free] @ joints.to_free
    return nodal - (sparse.csr_array(equivalent.T) @ own.reshape(len(own), 6 * loaded.size).T).T, found


def moments_under_gravity(
    joints: Joints, hinged: HingedMembers, values: FrameValues, permanent: Permanent
) -> np.ndarray:
    """Return the moments of hinged members' ends [N m] under gravity, with the hinges' initial stiffness.

    Args:
        joints: Unknowns of the frame.
        hinged: Its members with hinges.
        values: Values of one structure.
        permanent: Permanent loads and stiffness.

    Returns:
        Moments, shape [member, 2].
    """
    unknowns = joints.places.size
    turns = np.repeat(-joints.chords[:, None, :], 2, axis=1)  # of ends relative to chords per unknown and drift
    for member, rows in enumerate(joints.rotations):
        for end, row in enumerate(rows):
            if row < unknowns:
                turns[member, end, row] += 1.0
    bending = values.bending[0]
    with np.errstate(divide="ignore"):
        flexible = bending / hinged.stiffness[:, :, None]
    reduced = bending @ np.linalg.inv(np.eye(2) + flexible)
    eased = np.linalg.solve(np.eye(2) + np.swapaxes(flexible, -1, -2), values.member_loads[0, ..., None])[..., 0]
    stiffness = values.linear[0] + permanent.of_floors
    stiffness += np.einsum("mai,mab,mbj->ij", turns, reduced, turns, optimize=True)
    moved = np.linalg.solve(stiffness, values.loads[0] - np.einsum("mai,ma->i", turns, eased))
    found: np.ndarray = np.einsum("mab,mbj,j->ma", reduced, turns, moved, optimize=True) + eased
    return found
