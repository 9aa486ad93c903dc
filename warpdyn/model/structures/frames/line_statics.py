"""Static equilibrium of a fish-bone frame with hinges: floors, rotations of joints and of the ends of members."""

from __future__ import annotations

from typing import TYPE_CHECKING, NamedTuple

import numpy as np

from warpdyn.engine.kernels.lumped.pattern import PLACES_OF_STOREY, VALUES_OF_STOREY

if TYPE_CHECKING:
    from warpdyn.model.structures.frames.hinged_fishbone import HingedFishbone


class LineStatics(NamedTuple):
    """Linear equations of a fish-bone frame; coordinates are floors, joints and ends of members that have hinges.

    Args:
        deformations: Storey drifts and rotations of hinges, shape [spring, coordinate].
        stiffness: Stiffness of the members and of the base without hinges [N/m, N, N m], shape [coordinate,
            coordinate].
        shears: Storey shears of the columns [N], shape [storey, coordinate].
    """

    deformations: np.ndarray
    stiffness: np.ndarray
    shears: np.ndarray


def line_statics(structure: HingedFishbone) -> LineStatics:
    """Return the equations of a fish-bone frame with its nominal sections, without gravity."""
    line, drifts = structure.column_line, structure.directions
    storeys, floors = line.storeys, structure.dofs
    one = {name: values[None] for name, values in structure.parameters.items()}
    values = structure.values_of_line(one)[:, 0]
    of_storeys = values[: VALUES_OF_STOREY * storeys].reshape(storeys, VALUES_OF_STOREY)
    ground = values[VALUES_OF_STOREY * storeys]
    size = floors + storeys + 1 + line.hinges
    fixed = size  # column of rotations that are 0; it is removed at the end
    joints = floors + np.arange(storeys + 1)
    if line.is_fixed:
        joints[0] = fixed
    deformations, stiffness = np.zeros((len(structure.springs), size + 1)), np.zeros((size + 1, size + 1))
    shears = np.zeros((storeys, size + 1))
    deformations[:storeys, :floors] = drifts[:storeys]
    end = floors + storeys + 1
    turns = np.zeros((len(line.springs), size + 1))  # rotations of the ends of members
    for place, spring in enumerate(line.springs):
        storey, kind = divmod(place, PLACES_OF_STOREY)
        joint = joints[storey + min(kind, 1)]
        if spring < 0:
            turns[place, joint] = 1.0
            continue
        turns[place, end] = deformations[spring, end] = 1.0
        deformations[spring, joint] -= 1.0
        end += 1
    for storey, (own, other, beam, per_height) in enumerate(of_storeys):
        lower, upper, half_beam = turns[PLACES_OF_STOREY * storey :][:PLACES_OF_STOREY]
        slant = deformations[storey] * per_height
        bent = np.stack([lower - slant, upper - slant])
        moments = np.array([[own, other], [other, own]]) @ bent
        stiffness += bent.T @ moments + beam * np.outer(half_beam, half_beam)
        shears[storey] = -moments.sum(axis=0) * per_height
    stiffness[joints[0], joints[0]] += ground
    moving = np.arange(size + 1) != fixed
    if line.is_fixed:
        moving[floors] = False
    return LineStatics(deformations[:, moving], stiffness[np.ix_(moving, moving)], shears[:, moving])
