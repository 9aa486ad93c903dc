"""The storeys of a fish-bone frame: one column line and a half-beam on each floor."""

from __future__ import annotations

from dataclasses import dataclass
from typing import TYPE_CHECKING

from warpdyn.engine.kernels.hinges.layout import JointFrame
from warpdyn.engine.kernels.lumped.pattern import PLACES_OF_STOREY, VALUES_OF_STOREY, ColumnLine

if TYPE_CHECKING:
    from warpdyn.engine.kernels.plan import Plan

# Recorders of fish-bones with joint springs; others would need the memory of hinges.
OF_JOINT_SPRINGS = {"spring", "output", "displacement", "acceleration", "drift", "residual", "history"}


@dataclass(frozen=True)
class ColumnStoreys:
    """The storeys of a fish-bone frame with a fixed base and hinges at all ends of columns and at half-beams.

    Members of a thread are the columns of its storeys from the lowest to the highest, then the half-beams.

    Args:
        line: The column line.
    """

    line: ColumnLine
    lines = 1  # column lines

    @property
    def count(self) -> int:
        """Number of storeys."""
        return self.line.storeys

    @property
    def half_beams(self) -> int:
        """Number of half-beams: members with one hinge, whose other end rotates freely."""
        return self.count

    def springs_of(self, thread: int, threads: int) -> list[int]:
        """Return the springs of one of the threads: its storeys, the hinges of columns, and those of half-beams."""
        return [*self._storeys_of(thread, threads), *self._hinges_of(thread, threads)]

    def terms_of(self, thread: int, threads: int) -> list[int]:
        """Return the place of each value of a thread in those of the line; -1 for a value that is 0."""
        firsts = [VALUES_OF_STOREY * storey for storey in self._storeys_of(thread, threads)]
        columns = [place for first in firsts for place in (first, first + 1, first)]
        half_beams = [place for first in firsts for place in (first + 2, -1, -1)]
        hinges = VALUES_OF_STOREY * self.count + 1
        slopes = [hinges + spring - self.count for spring in self._hinges_of(thread, threads)]
        return columns + half_beams + [first + 3 for first in firsts] + slopes

    def of_thread(self, threads: int) -> JointFrame:
        """Return the layout of the storeys of one thread, with the indices of its joints, members and springs."""
        count = self.count // threads
        storeys = range(count)
        support, hinges = 5 * count, 3 * count
        ends = [row for storey in storeys for row in (storey - 1 if storey else support, storey)]
        springs = list(range(count, hinges))
        for storey in storeys:
            ends += [storey, support]
            springs += [hinges + storey, -1]
        return JointFrame(
            storeys=count,
            free=count,
            first_columns=tuple(storeys),
            joints=tuple(ends),
            springs=tuple(springs),
            chords=((),) * (2 * count),
            chord_storeys=(*((storey,) for storey in storeys), *((),) * count),
            springs_of_joints=tuple(count + 2 * storey + 1 for storey in storeys),
        )

    def _storeys_of(self, thread: int, threads: int) -> range:
        own = self.count // threads
        return range(thread * own, (thread + 1) * own)

    def _hinges_of(self, thread: int, threads: int) -> list[int]:
        """Return the hinges of a thread's columns from the lowest to the highest, then those of its half-beams."""
        firsts = [PLACES_OF_STOREY * storey for storey in self._storeys_of(thread, threads)]
        columns = [spring for place in firsts for spring in self.line.springs[place : place + 2]]
        return columns + [self.line.springs[place + 2] for place in firsts]


def column_storeys(line: ColumnLine) -> ColumnStoreys | None:
    """Return the storeys of a fish-bone frame; None if its base can rotate or an end has no hinge with a law."""
    is_hinged = not line.linear and min(line.springs) >= 0
    return ColumnStoreys(line) if is_hinged and line.is_fixed and line.storeys > 1 else None


def has_line(plan: Plan) -> bool:
    """Return whether the plan is of a frame or fish-bone with hinges, whose massless rotations the kernel finds."""
    return plan.pattern is not None and plan.pattern.line is not None


def seeks_hinges(plan: Plan) -> bool:
    """Return whether the kernel of any frame or fish-bone seeks the rotations of hinges and joints."""
    return has_line(plan) and plan.frame_storeys is None and not has_joint_springs(plan)


def has_joint_springs(plan: Plan) -> bool:
    """Return whether one bilinear spring per joint replaces the hinges of a fish-bone (see `joint_springs.py`).

    This needs elastic columns, hinges at all half-beams, and a base that cannot rotate or has a hinge.
    """
    line = None if plan.pattern is None else plan.pattern.line
    if not isinstance(line, ColumnLine) or plan.kind != "explicit" or str(plan.law) != "bilinear":
        return False
    if plan.resumes or plan.starts_displaced or plan.control is not None or not set(plan.recorders) <= OF_JOINT_SPRINGS:
        return False
    is_elastic = line.is_fixed and not line.has_hinged_columns and not line.linear
    return is_elastic and min(line.springs[PLACES_OF_STOREY - 1 :: PLACES_OF_STOREY]) >= 0
