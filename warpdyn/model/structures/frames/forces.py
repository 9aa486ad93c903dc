"""Forces at the ends of members: linear combinations of displacements, envelopes and demand-capacity ratios."""

from __future__ import annotations

from collections.abc import Sequence
from typing import TYPE_CHECKING

import numpy as np

from warpdyn.model.structures.frames.elements import Sections

if TYPE_CHECKING:
    from warpdyn.model.structures.frames.frame import Frame

ENDS = ("start", "end")
FORCES_OF_OUTPUTS = {"axial": 3, "shear start": 1, "shear end": 4, "moment start": 2, "moment end": 5}


def force_names(members: Sequence[str]) -> list[str]:
    """Return the names of the outputs of members, such as "beam moment start"; the axial force is a tension."""
    return [f"{member} {force}" for member in members for force in FORCES_OF_OUTPUTS]


def force_rows(frame: Frame, members: Sequence[str], shapes: np.ndarray, sections: Sections) -> np.ndarray:
    """Return forces per unit displacement of the kept degrees of freedom, in the order of `force_names`.

    Args:
        frame: The frame.
        members: Names of the members.
        shapes: Displacements of the free degrees of freedom per kept one, shape [structure, free, dof].
        sections: Section properties, shape [structure, member] or [member].

    Returns:
        Coefficients [N/m] or [N m/m], shape [structure, force, dof].
    """
    number = {name: place for place, name in enumerate(frame.members)}
    places = np.array([number[name] for name in members], dtype=int)
    local, conditions = frame.bent(sections)
    of_joints = (local @ conditions.ends @ frame.geometry.to_local)[..., places, :, :]
    everywhere = np.zeros((len(shapes), len(frame.numbering.names), shapes.shape[2]))
    everywhere[:, frame.numbering.free] = shapes
    joints = everywhere[:, frame.numbering.of_members[places]]  # [structure, member, 6, dof]
    found = (of_joints @ joints)[:, :, list(FORCES_OF_OUTPUTS.values())]
    result: np.ndarray = found.reshape(len(shapes), -1, shapes.shape[2])
    return result
