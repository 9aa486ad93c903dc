"""Static equilibrium of a frame with hinges and several bays: floors, massless displacements, rotations of hinges."""

from __future__ import annotations

from typing import TYPE_CHECKING, NamedTuple

import numpy as np

from warpdyn.model.structures.lumped.matrices import StaticSystem

if TYPE_CHECKING:
    from warpdyn.model.structures.frames.hinges.hinged_frame import HingedFrame


class FrameStatics(NamedTuple):
    """Linear equations of a frame; coordinates are floors, massless displacements and rotations of hinges.

    Args:
        system: Storey drifts and rotations of hinges, stiffness without hinges, and gravity loads.
        shears: Storey shears of columns and braces without P-Delta [N], shape [storey, coordinate].
    """

    system: StaticSystem
    shears: np.ndarray


def frame_statics(structure: HingedFrame) -> FrameStatics:
    """Return the equations of a frame with its nominal sections."""
    joints, hinged = structure.joints, structure.hinged_members
    values = structure.frame_values
    floors, storeys, unknowns = structure.dofs, len(structure.frame.storey_drifts), joints.places.size
    places = structure.places_of_hinges
    size = floors + unknowns + len(places)
    unknown = np.arange(floors, floors + unknowns)
    rotation = {place: floors + unknowns + hinge for hinge, place in enumerate(places)}
    deformations = np.zeros((len(structure.springs), size))
    deformations[:storeys, :floors] = structure.directions[:storeys]
    deformations[np.arange(storeys, len(structure.springs)), floors + unknowns :] = np.eye(len(places))
    # Unknowns and storey drifts, to which `joints` and `values` refer.
    given = np.zeros((unknowns + storeys, size))
    given[np.arange(unknowns), unknown] = 1.0
    given[unknowns:] = deformations[:storeys]
    turns = np.zeros((len(hinged.members), 2, size))  # of the ends of members relative to their chords
    turns -= (joints.chords @ given)[:, None]
    for row, (member, of_joints) in enumerate(zip(hinged.members, joints.rotations, strict=True)):
        for end, joint in enumerate(of_joints):
            if joint < unknowns:
                turns[row, end, floors + joint] += 1.0
            if (member, end) in rotation:
                turns[row, end, rotation[member, end]] += 1.0
    bending, member_loads = values.bending[0], values.member_loads[0]
    stiffness = given.T @ values.linear[0] @ given
    stiffness += np.einsum("mai,mab,mbj->ij", turns, bending, turns, optimize=True)
    softening = structure.softening_of_storeys
    loads = values.loads[0] @ given - np.einsum("mai,ma->i", turns, member_loads)
    tilts = -joints.chords[:, unknowns:]  # of chords per storey drift
    shears = values.linear[0, unknowns:] @ given
    shears += np.einsum("ms,mab,mbj->sj", tilts, bending, turns, optimize=True)
    stiffness -= given[unknowns:].T @ softening @ given[unknowns:]
    return FrameStatics(StaticSystem(deformations, stiffness, loads), shears)
