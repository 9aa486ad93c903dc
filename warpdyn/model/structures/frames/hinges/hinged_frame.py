"""A frame with several bays and nonlinear hinges, as a structure of scenes."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from functools import cached_property
from typing import Any

import numpy as np
from numpy.typing import ArrayLike

from warpdyn.engine.kernels.hinges.layout import JointFrame
from warpdyn.engine.laws.elastic.parameters import Elastic
from warpdyn.foundations.core.checks import check_kind
from warpdyn.foundations.core.near_misses import with_suggestions
from warpdyn.model.structures.frames.column_line import ENDS
from warpdyn.model.structures.frames.frame import Frame
from warpdyn.model.structures.frames.hinges import checks
from warpdyn.model.structures.frames.hinges.joints import Joints, first_columns_of, joints_of
from warpdyn.model.structures.frames.hinges.values import (
    LEAST_SHARE,
    FrameValues,
    HingedMembers,
    geometric_stiffness,
    values_of,
)
from warpdyn.model.structures.frames.hinged_fishbone import Hinge, HingedFishbone
from warpdyn.model.structures.frames.members.elements import Sections
from warpdyn.model.structures.frames.reduced_frame import MOST_VALUES, ReducedFrame
from warpdyn.model.structures.lumped.spring import Spring

NEGLIGIBLE = 1e-12  # entries of a stiffness matrix relative to the diagonal of their row and column


@with_suggestions
class HingedFrame(HingedFishbone):
    def __init__(
        self,
        frame: Frame,
        hinges: Mapping[tuple[str, str], Mapping[str, Any]],
        *,
        p_delta: bool = True,
        outputs: Sequence[str] = ("drift",),
        drift_capacity: float | None = None,
        damping: str = "none",
        damping_ratio: float | None = None,
        damping_modes: tuple[int, int] | None = None,
        damping_matrix: ArrayLike | None = None,
    ) -> None:
        check_kind("HingedFrame", "a Frame", frame, Frame, argument="frame")
        checks.check_frame(frame)
        self.hinges = checks.checked_hinges(frame, hinges)
        if p_delta is True:
            checks.check_gravity(frame)
        ReducedFrame.__init__(
            self,
            frame,
            dofs=None,
            reduction="static",
            modes=0,
            p_delta=p_delta,
            vertical=False,
            outputs=outputs,
            members=None,
            drift_capacity=drift_capacity,
            damping=damping,
            damping_ratio=damping_ratio,
            damping_modes=damping_modes,
            damping_matrix=damping_matrix,
        )

    def _gauges(self, names: Sequence[str]) -> tuple[list[Spring], list[float]]:
        found, heights = ReducedFrame._gauges(self, names)
        members = list(self.frame.members)
        stiffnesses = self.frame.geometry.end_springs
        for (member, end), row in self.hinges.items():
            stiffness = float(stiffnesses[members.index(member), ENDS.index(end)])
            row = dict(row)
            found.append(Hinge(f"{member} {end}", names[0], stiffness, row.pop("law"), **row))
        return found, heights

    @cached_property
    def hinged_members(self) -> HingedMembers:
        members = list(self.frame.members)
        used = sorted({members.index(member) for member, _ in self.hinges})
        is_hinge = np.array([[(members[m], end) in self.hinges for end in ENDS] for m in used])
        return HingedMembers(used, is_hinge, np.where(is_hinge, self.frame.geometry.end_springs[used], np.inf))

    @cached_property
    def joints(self) -> Joints:
        return joints_of(self.frame, self.kept, self.hinged_members.members)

    @cached_property
    def column_line(self) -> JointFrame:
        """Layout"""
        joints, hinged, storeys = self.joints, self.hinged_members, len(self.frame.storey_drifts)
        free = joints.places.size
        random = np.random.default_rng(0)
        varied = [each[None] * random.uniform(0.8, 1.2, each.shape) for each in self._nominal_sections]
        values = self._values(Sections(*varied))
        size = np.sqrt(np.abs(np.einsum("ii->i", values.linear[0])))
        linear = np.abs(values.linear[0]) > NEGLIGIBLE * np.outer(size, size)
        rows = joints.rotations
        chords = [np.flatnonzero(row[:free]).tolist() for row in joints.chords]
        pattern = linear[:free, :free].copy()
        for row, chord in zip(rows, chords, strict=True):
            all_rows = [place for place in {*row.tolist(), *chord} if place < free]
            pattern[np.ix_(all_rows, all_rows)] = True
        zero = free + len(self.hinges)
        places = {(member, end): place for place, (member, end) in enumerate(self.hinges)}
        names = list(self.frame.members)
        ends, springs = [], []
        springs_of_joints = [0] * free
        for m, joint_rows in zip(hinged.members, rows, strict=True):
            for side, end in enumerate(ENDS):
                place = places.get((names[m], end))
                ends.append(-1 if place is None else free + place)
                springs.append(-1 if place is None else storeys + place)
                if place is not None and joint_rows[side] < free:
                    springs_of_joints[joint_rows[side]] = storeys + place
        has_loads = np.abs(values.loads[0, :free]) > 0
        return JointFrame(
            storeys=storeys,
            free=free,
            first_columns=tuple(first_columns_of(pattern).tolist()),
            joints=tuple(np.where(rows < free, rows, zero).ravel().tolist()),
            ends=tuple(ends),
            springs=tuple(springs),
            chords=tuple(map(tuple, chords)),
            chord_storeys=tuple(tuple(np.flatnonzero(row[free:]).tolist()) for row in joints.chords),
            between_rows=_pairs(np.tril(linear[:free, :free])),
            with_storeys=_pairs(linear[:free, free:]),
            between_storeys=_pairs(np.tril(linear[free:, free:])),
            loads=tuple(np.flatnonzero(has_loads).tolist()),
            has_member_loads=bool(values.member_loads.any()),
            linear=tuple(place for place in springs if place >= 0 and self.springs[place].law is Elastic),
            springs_of_joints=tuple(springs_of_joints),
        )

    def _values(self, sections: Sections) -> FrameValues:
        return values_of(
            self.frame, self.joints, self.hinged_members, sections, has_p_delta=self.p_delta, floors=self.kept
        )

    def values_of_line(self, values: Mapping[str, np.ndarray]) -> np.ndarray:
        count = len(values["mass"])
        given = [np.atleast_2d(values.get(name, nominal)) for name, nominal in self._sections_by_name.items()]
        if all((each == each[:1]).all() for each in given):
            given = [each[:1] for each in given]
        most = max(map(len, given))
        sections = [np.broadcast_to(each, (most, each.shape[1])) for each in given]
        step = max(1, MOST_VALUES // self.frame.numbering.free.size ** 2)
        parts = [
            self._packed(self._values(Sections(*(each[first : first + step] for each in sections))))
            for first in range(0, most, step)
        ]
        found = np.concatenate(parts, axis=1)
        found = np.broadcast_to(found, (len(found), count))
        of_hinges = np.broadcast_to(values["stiffness"], (count, len(self.springs)))[:, self.column_line.storeys :]
        return np.concatenate([found, of_hinges.T])

    def _packed(self, values: FrameValues) -> np.ndarray:
        """Return all values but the hinges' stiffness in the order of the kernel, shape [value, structure]."""
        line, count = self.column_line, len(values.linear)
        free = line.free
        bending = values.bending[..., [0, 0, 1], [0, 1, 1]].reshape(count, -1)
        rows = [bending]
        if line.has_member_loads:
            rows.append(values.member_loads.reshape(len(values.member_loads), -1))
        chords = self.joints.chords
        rows.append(np.concatenate([chords[m, list(each)] for m, each in enumerate(line.chords)]))
        rows.append(np.concatenate([chords[m, free + np.array(each, int)] for m, each in enumerate(line.chord_storeys)]))
        for pairs, first, second in (
            (line.between_rows, 0, 0),
            (line.with_storeys, 0, free),
            (line.between_storeys, free, free),
        ):
            rows.append(
                np.stack([values.linear[:, first + a, second + b] for a, b in pairs], axis=1)
                if pairs
                else np.zeros((count, 0))
            )
        if line.lengths["moment"]:
            loads = values.loads[:, list(line.loads)]
            rows += [loads, values.drifts, values.drifts @ self._drift_softening]
            rows.append(LEAST_SHARE * line.storeys * np.abs(values.loads).max(axis=1, keepdims=True))
        return np.concatenate([np.broadcast_to(each, (count, each.shape[-1])).T for each in rows])

    @cached_property
    def _floor_softening(self) -> np.ndarray:
        kept = self.kept
        return geometric_stiffness(self.frame)[np.ix_(kept, kept)] if self.p_delta else np.zeros((kept.size,) * 2)

    @cached_property
    def _drift_softening(self) -> np.ndarray:
        """Storey shear of P-Delta per drift under gravity, negative of the geometric force; shape [storey, storey]."""
        to_floors = self.joints.to_free[self.kept][:, self.joints.places.size :]
        return -(to_floors.T @ self._floor_softening @ to_floors)

    def linear_matrices(self, values: Mapping[str, np.ndarray]) -> np.ndarray:
        """Return what to add to the geometric stiffness of the floors, so that the kernel has it without condensation."""
        if not self.p_delta:
            return np.zeros((1, self.dofs, self.dofs))
        return np.asarray(self.geometric_matrices(values) + self._floor_softening)


def _pairs(pattern: np.ndarray) -> tuple[tuple[int, int], ...]:
    return tuple((int(a), int(b)) for a, b in np.argwhere(pattern))
