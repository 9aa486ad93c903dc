"""The layout of a frame with hinges for its kernel, and its values in the order of this layout."""

from __future__ import annotations

from collections.abc import Mapping, Sequence

import numpy as np

from warpdyn.engine.kernels.hinges.layout import JointFrame
from warpdyn.model.structures.frames.hinges.joints import Joints, first_columns_of
from warpdyn.model.structures.frames.hinges.values import FrameValues, HingedMembers

NEGLIGIBLE = 1e-12  # entries of a stiffness matrix relative to the diagonal of their row and column
LEAST_SHARE = 0.02  # of gravity load times height times storeys: unbalanced moments are compared at least with it


def layout_of(
    joints: Joints,
    hinged: HingedMembers,
    values: FrameValues,
    springs: Mapping[tuple[int, int], int],
    storeys: int,
    linear_springs: Sequence[int],
) -> JointFrame:
    """Return the layout of a frame with hinges.

    Args:
        joints: Unknowns of the frame.
        hinged: Its members with hinges.
        values: Values of a structure with unequal sections, so that no entry of a matrix is 0 by chance.
        springs: {(member, end): spring of the hinge}.
        storeys: Number of storeys.
        linear_springs: Springs that are linear.
    """
    free = joints.places.size
    size = np.sqrt(np.abs(np.einsum("ii->i", values.linear[0])))
    linear = np.abs(values.linear[0]) > NEGLIGIBLE * np.outer(size, size)
    chords = [tuple(np.flatnonzero(row[:free]).tolist()) for row in joints.chords]
    pattern = linear[:free, :free].copy()
    support = free + 2 * len(hinged.members)  # row of rotations that are fixed
    of_ends = []
    of_joints = [0] * free
    for member, rows, chord in zip(hinged.members, joints.rotations.tolist(), chords, strict=True):
        moved = [row for row in {*rows, *chord} if row < free]
        pattern[np.ix_(moved, moved)] = True
        for end, row in enumerate(rows):
            spring = springs.get((member, end), -1)
            of_ends.append(spring)
            if spring >= 0 and row < free:
                of_joints[row] = spring
    return JointFrame(
        storeys=storeys,
        free=free,
        first_columns=tuple(first_columns_of(pattern).tolist()),
        joints=tuple(np.where(joints.rotations < free, joints.rotations, support).ravel().tolist()),
        springs=tuple(of_ends),
        chords=tuple(chords),
        chord_storeys=tuple(tuple(np.flatnonzero(row[free:]).tolist()) for row in joints.chords),
        between_rows=_pairs(np.tril(linear[:free, :free])),
        with_storeys=_pairs(linear[:free, free:]),
        between_storeys=_pairs(np.tril(linear[free:, free:])),
        loads=tuple(np.flatnonzero(values.loads[0, :free]).tolist()),
        has_member_loads=bool(values.member_loads.any()),
        linear=tuple(linear_springs),
        springs_of_joints=tuple(of_joints),
    )


def _pairs(pattern: np.ndarray) -> tuple[tuple[int, int], ...]:
    return tuple((int(row), int(column)) for row, column in np.argwhere(pattern))


def packed(
    line: JointFrame, joints: Joints, values: FrameValues, drifts: np.ndarray, softening: np.ndarray
) -> np.ndarray:
    """Return all values but the stiffness of the hinges in the order of the kernel, shape [value, structure].

    Args:
        line: Layout.
        joints: Unknowns.
        values: Values of the structures.
        drifts: Drifts under gravity [m], shape [structure, storey].
        softening: Storey shear of P-Delta per drift [N/m], shape [storey, storey].
    """
    count, free = max(map(len, (*values, drifts))), line.free
    bending = np.moveaxis(values.bending, 0, -1)[:, [0, 0, 1], [0, 1, 1]]
    rows = [bending.reshape(-1, bending.shape[-1]).T]
    if line.has_member_loads:
        rows.append(values.member_loads.reshape(len(values.member_loads), -1))
    for first, places in ((0, line.chords), (free, line.chord_storeys)):
        members = np.repeat(np.arange(len(places)), [len(each) for each in places])
        turned = first + np.array([place for each in places for place in each], dtype=int)
        rows.append(joints.chords[members, turned][None])
    for pairs, row, column in (
        (line.between_rows, 0, 0),
        (line.with_storeys, 0, free),
        (line.between_storeys, free, free),
    ):
        upper, lower = np.array(pairs, int).reshape(-1, 2).T
        rows.append(np.moveaxis(values.linear, 0, -1)[row + upper, column + lower].T)
    if line.lengths["moment"]:
        of_members = np.abs(values.member_loads).max(axis=(1, 2))[:, None]
        largest = np.maximum(np.abs(values.loads).max(axis=1, keepdims=True), of_members)
        # One product for each structure, whose bits do not depend on the others.
        rows += [values.loads[:, list(line.loads)], drifts, (drifts[:, None] @ softening)[:, 0]]
        rows.append(LEAST_SHARE * line.storeys * largest)
    return np.concatenate([np.broadcast_to(each.T, (each.shape[1], count)) for each in rows])
