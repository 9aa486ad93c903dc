"""Frames of equal storeys: column lines and beams between them, so that a storey is the work of a thread."""

from __future__ import annotations

import functools
from collections.abc import Iterable
from dataclasses import dataclass
from itertools import pairwise
from typing import TYPE_CHECKING

from warpdyn.engine.kernels.hinges.column_storeys import ColumnStoreys, column_storeys
from warpdyn.engine.kernels.hinges.layout import VALUES_OF_MEMBER, JointFrame, starts_of
from warpdyn.engine.kernels.lumped.pattern import ColumnLine

if TYPE_CHECKING:
    from warpdyn.engine.kernels.plan import Plan


@dataclass(frozen=True)
class FrameStoreys:
    """The storeys of a frame whose joints are a grid of floors and column lines; all ends of members have hinges.

    Members of a storey are its columns, from the first line to the last, then the beams of the floor above them.

    Args:
        line: The layout of the whole frame.
        joints: Row of the rotation of each joint, shape [storey][column line].
        members: (member, whether its start is the upper or the right end), shape [storey][member of a storey].
    """

    line: JointFrame
    joints: tuple[tuple[int, ...], ...]
    members: tuple[tuple[tuple[int, bool], ...], ...]
    half_beams = 0  # see `hinges/column_storeys.py`

    @property
    def count(self) -> int:
        """Number of storeys."""
        return len(self.joints)

    @property
    def lines(self) -> int:
        """Number of column lines."""
        return len(self.joints[0])

    def springs_of(self, thread: int, threads: int) -> list[int]:
        """Return the springs of one of the threads that share a frame: its storeys, then the hinges of its members."""
        own = self.count // threads
        found = list(range(thread * own, (thread + 1) * own))
        for members in self._floors_of(thread, threads):
            for member, is_turned in members:
                ends = self.line.springs[2 * member : 2 * member + 2]
                found += ends[::-1] if is_turned else ends
        return found

    def terms_of(self, thread: int, threads: int) -> list[int]:
        """Return the place of each value of a thread among the values of the frame; -1 for a value that is 0."""
        line, first = self.line, self.line.first
        floors = self._floors_of(thread, threads)
        members = [each for of_floor in floors for each in of_floor]
        found = []
        for member, is_turned in members:
            place = first("member") + VALUES_OF_MEMBER * member
            found += [place + kind for kind in ((2, 1, 0) if is_turned else (0, 1, 2))]
        if line.has_member_loads:
            for member, is_turned in members:
                found += [first("member_load") + 2 * member + end for end in ((1, 0) if is_turned else (0, 1))]
        starts = starts_of(line.chord_storeys)
        found += [first("chord_storey") + starts[member] for each in floors for member, _ in each[: self.lines]]
        of_thread = self.of_thread(threads)
        own = self.count // threads
        if of_thread.loads:
            rows = [row for storey in self.joints[thread * own : (thread + 1) * own] for row in storey]
            found += [first("load") + line.loads.index(row) if row in line.loads else -1 for row in rows]
        if of_thread.lengths["moment"]:
            for name in ("drift", "shear"):
                found += range(first(name) + thread * own, first(name) + (thread + 1) * own)
            found.append(first("moment"))
        hinges = self.springs_of(thread, threads)[own:]
        return found + [first("stiffness") + spring - self.count for spring in hinges]

    def of_thread(self, threads: int) -> JointFrame:
        """Return the layout of the storeys of one thread, with the indices of its joints, members and springs."""
        floors, lines, members = self.count // threads, self.lines, 2 * self.lines - 1
        support = floors * lines + 2 * floors * members
        ends: list[int] = []
        chord_storeys: list[tuple[int, ...]] = []
        for floor in range(floors):
            for place in range(lines):
                ends += [(floor - 1) * lines + place if floor else support, floor * lines + place]
            for beam in range(lines - 1):
                ends += [floor * lines + beam, floor * lines + beam + 1]
            chord_storeys += [(floor,)] * lines + [()] * (lines - 1)
        count = 2 * floors * members
        return JointFrame(
            storeys=floors,
            free=floors * lines,
            first_columns=tuple(range(floors * lines)),
            joints=tuple(ends),
            springs=tuple(range(floors, floors + count)),
            chords=((),) * (floors * members),
            chord_storeys=tuple(chord_storeys),
            loads=tuple(range(floors * lines)) if self.line.loads else (),
            has_member_loads=self.line.has_member_loads,
            springs_of_joints=tuple(
                floors + 2 * (floor * members + place) + 1 for floor in range(floors) for place in range(lines)
            ),
        )

    def _floors_of(self, thread: int, threads: int) -> tuple[tuple[tuple[int, bool], ...], ...]:
        own = self.count // threads
        return self.members[thread * own : (thread + 1) * own]


MOST_BITS = 31  # of the integers in which threads keep the branches of their hinges


def has_yielding_members(plan: Plan) -> bool:
    """Return whether a GPU finds the branches of bilinear hinges in each solution (see `yielding_members.py`).

    This needs several column lines, and a thread for each storey.
    """
    storeys = plan.frame_storeys
    if storeys is None or storeys.lines == 1 or plan.sections == 1 or str(plan.law) != "bilinear":
        return False
    return plan.line_of_thread.hinges <= MOST_BITS


def has_hinge_lines(plan: Plan) -> bool:
    """Return whether the kernel of grids keeps a line of its law for each hinge (see `hinge_lines.py`)."""
    return plan.frame_storeys is not None and not has_yielding_members(plan)


@functools.cache
def frame_storeys(line: JointFrame | ColumnLine) -> FrameStoreys | ColumnStoreys | None:
    """Return the storeys of a frame; None if its joints are not a grid or a member has an end without a law."""
    if isinstance(line, ColumnLine):
        return column_storeys(line)
    if any(line.chords) or line.between_rows or line.with_storeys or line.between_storeys or line.linear:
        return None
    if min(line.springs, default=-1) < 0 or line.storeys < 2 or line.free % line.storeys:
        return None
    columns: dict[int, tuple[int, int, int]] = {}  # member -> its joints and its storey
    beams: dict[frozenset[int], int] = {}
    for member, storeys in enumerate(line.chord_storeys):
        start, end = line.joints[2 * member : 2 * member + 2]
        if len(storeys) == 1:
            columns[member] = (start, end, storeys[0])
        elif not storeys and frozenset((start, end)) not in beams:
            beams[frozenset((start, end))] = member
        else:
            return None
    return _grid(line, columns, beams)


def _grid(
    line: JointFrame, columns: dict[int, tuple[int, int, int]], beams: dict[frozenset[int], int]
) -> FrameStoreys | None:
    """Return the storeys of a frame with these columns {member: (start, end, storey)} and beams {joints: member}."""
    lines = line.free // line.storeys
    if len(columns) != lines * line.storeys or len(beams) != (lines - 1) * line.storeys or lines < 2:
        return None
    below = [line.rows - 1] * lines  # supports
    order: list[int] | None = None
    joints, members = [], []
    for storey in range(line.storeys):
        of_storey = {member: ends for member, ends in columns.items() if ends[2] == storey}
        lower = set(below)
        found: dict[int, tuple[int, bool, int]] = {}  # upper joint -> column, whether it starts there, lower joint
        for member, (start, end, _) in of_storey.items():
            is_turned = end in lower
            upper, foot = (start, end) if is_turned else (end, start)
            if foot not in lower or upper in lower or upper in found:
                return None
            found[upper] = (member, is_turned, foot)
        if len(found) != lines:
            return None
        if order is None:
            order = _path(found, beams)
        else:
            by_foot = {foot: upper for upper, (_, _, foot) in found.items()}
            if len(by_foot) != lines:
                return None
            order = [by_foot[foot] for foot in below]
        if order is None:
            return None
        of_beams = []
        for left, right in pairwise(order):
            beam = beams.get(frozenset((left, right)))
            if beam is None:
                return None
            of_beams.append((beam, line.joints[2 * beam] != left))
        joints.append(tuple(order))
        members.append(tuple([(found[upper][0], found[upper][1]) for upper in order] + of_beams))
        below = order
    return FrameStoreys(line, tuple(joints), tuple(members))


def _path(joints: Iterable[int], beams: Iterable[frozenset[int]]) -> list[int] | None:
    """Return the joints of a floor in the order in which beams connect them; None if they are not a path."""
    neighbours: dict[int, list[int]] = {joint: [] for joint in joints}
    for ends in beams:
        if len(ends) == 2 and ends <= neighbours.keys():
            one, other = ends
            neighbours[one].append(other)
            neighbours[other].append(one)
    outer = sorted(joint for joint, near in neighbours.items() if len(near) == 1)
    if len(outer) != 2:
        return None
    found = [outer[0]]
    while len(found) < len(neighbours):
        near = [joint for joint in neighbours[found[-1]] if joint not in found]
        if len(near) != 1:
            return None
        found.append(near[0])
    return found
