"""The layout of a frame with several bays: which members have hinges, and what its massless displacements act on."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass

WIDEST_BAND = 8  # half bandwidth of matrices whose rows are written out in the text of the kernel
VALUES_OF_MEMBER = 3  # bending stiffness: start, between start and end, end [N m/rad]


@dataclass(frozen=True)
class JointFrame:
    """Indices of a frame whose massless displacements a kernel finds in each stage.

    Rows of displacements are the massless ones of nodes (rotations, and vertical displacements over a length), then the
    rotations of hinges at the start and end of each member (always 0 at ends without a hinge), and last a row for
    supports, which is always 0. The matrix is stored by rows, each from its first entry that is not 0 to the diagonal.
    Values of entries are arguments of the kernel.

    Args:
        storeys: Number of storeys.
        free: Number of massless displacements.
        first_columns: First column of each row of the matrix, shape [free].
        joints: Rows of the rotations of the nodes at the start and end of each member with hinges.
        springs: Springs of these hinges; -1 without a hinge.
        chords: Of each member, the rows of displacements that turn its chord.
        chord_storeys: Of each member, the storeys whose drift turns its chord.
        between_rows: (row, column) of linear stiffness between massless displacements, row >= column.
        with_storeys: (row, storey) of linear stiffness between massless displacements and drifts.
        between_storeys: (storey, storey) of linear stiffness between drifts, the first >= the second.
        loads: Rows on which gravity loads act.
        has_member_loads: Whether gravity loads act along members with hinges.
        linear: Springs that are linear.
        springs_of_joints: Of each massless displacement the spring that a message names.
    """

    storeys: int
    free: int
    first_columns: tuple[int, ...]
    joints: tuple[int, ...]
    springs: tuple[int, ...]
    chords: tuple[tuple[int, ...], ...]
    chord_storeys: tuple[tuple[int, ...], ...]
    between_rows: tuple[tuple[int, int], ...] = ()
    with_storeys: tuple[tuple[int, int], ...] = ()
    between_storeys: tuple[tuple[int, int], ...] = ()
    loads: tuple[int, ...] = ()
    has_member_loads: bool = False
    linear: tuple[int, ...] = ()
    springs_of_joints: tuple[int, ...] = ()

    @property
    def members(self) -> int:
        """Number of members with hinges."""
        return len(self.chords)

    @property
    def hinges(self) -> int:
        """Number of hinges, the linear ones included."""
        return sum(spring >= 0 for spring in self.springs)

    @property
    def rows(self) -> int:
        """Number of rows, with the row of supports."""
        return self.free + 2 * self.members + 1

    @property
    def bases(self) -> list[int]:
        """Place of column 0 of each row of the matrix, so that `bases[row] + column` is the place of an entry."""
        found, place = [], 0
        for row, first in enumerate(self.first_columns):
            found.append(place - first)
            place += row - first + 1
        return found

    @property
    def entries(self) -> int:
        """Number of stored entries of the matrix."""
        return sum(row - first + 1 for row, first in enumerate(self.first_columns))

    @property
    def band(self) -> int:
        """Half bandwidth of a matrix that is stored with a constant bandwidth; 0 for a matrix stored by profile."""
        widest = max((row - first for row, first in enumerate(self.first_columns)), default=0)
        return widest if widest <= WIDEST_BAND else 0

    @property
    def lengths(self) -> dict[str, int]:
        """Numbers of values by name, in the order of the kernel's arguments; the hinges' stiffnesses are the last."""
        has_loads = bool(self.loads) or self.has_member_loads
        return {
            "member": VALUES_OF_MEMBER * self.members,
            "member_load": 2 * self.members * self.has_member_loads,
            "chord": sum(map(len, self.chords)),
            "chord_storey": sum(map(len, self.chord_storeys)),
            "between_rows": len(self.between_rows),
            "with_storeys": len(self.with_storeys),
            "between_storeys": len(self.between_storeys),
            "load": len(self.loads),
            "drift": self.storeys * has_loads,
            "shear": self.storeys * has_loads,
            "moment": int(has_loads),
            "stiffness": self.hinges,
        }

    @property
    def values(self) -> int:
        """Number of values per structure."""
        return sum(self.lengths.values())

    def first(self, name: str) -> int:
        """Return the place of the first value of a kind among all values."""
        found = 0
        for other, length in self.lengths.items():
            if other == name:
                return found
            found += length
        raise KeyError(name)

    @property
    def springs_of_rows(self) -> list[int]:
        """Of each row the spring that a message names if its moment does not balance."""
        return [*self.springs_of_joints, *(max(spring, 0) for spring in self.springs), 0]

    def rows_of(self, spring: int) -> tuple[int, int]:
        """Return the two rows whose difference is the rotation of a hinge."""
        return self.free + self.springs.index(spring), self.rows - 1


def starts_of(lists: Sequence[Sequence[int]]) -> list[int]:
    """Return the place of the first element of each list in a concatenation of all, and the length of this."""
    found = [0]
    for each in lists:
        found.append(found[-1] + len(each))
    return found
