"""Lumped structures of equal storeys: each spring connects degrees of freedom of one storey and of the storey below.

Examples are torsional buildings and shear buildings. A loop over the storeys then computes what would otherwise take a
statement for each spring and degree of freedom, and GPU threads that share a sample exchange only the state of the
floor below and the forces from the storey above. `storeys_of` finds the storeys from the pattern of the matrices, in
any order of the degrees of freedom and springs.
"""

from __future__ import annotations

import functools
from collections.abc import Callable
from dataclasses import dataclass

from warpdyn.engine.kernels.lumped.pattern import TERMS_PER_STATEMENT, UNIT, Pattern, Table

# A code contains the place of an entry's value: 0 for an entry that is 0, 1 for 1, and p + 2 for term p of the
# structure; negative for the negative value.
ONE, FIRST_CODE = 1, 2
Codes = tuple[int, ...]  # of one entry in all storeys


@dataclass(frozen=True)
class Entry:
    """An entry of a matrix of a storey.

    Args:
        column: Degree of freedom of the storey (of the floor above), or component of the motion.
        is_below: Whether the entry is that of the same degree of freedom of the floor below.
        sign: Sign of the entry, if its value is `place`.
        place: Index of its value: UNIT for 1; below the number of common values for a value that all storeys share.
    """

    column: int
    is_below: bool
    sign: int
    place: int


Rows = tuple[tuple[Entry, ...], ...]


@dataclass(frozen=True)
class Storeys:
    """The storeys of a lumped structure.

    Args:
        dofs: Degrees of freedom of each storey, from the ground up, shape [storey][dof of a storey].
        springs: Springs of each storey, shape [storey][spring of a storey].
        outputs: Outputs of each storey, shape [storey][output of a storey]; empty if outputs are not those of storeys.
        deformation: Deformations of the springs of a storey.
        inverse_mass: Inverse mass matrix of a floor.
        drive: Accelerations of the floor by the components of the base motion.
        output: Outputs of a storey.
        relative: Whether springs and outputs depend only on the difference of a degree of freedom to that of the floor
            below, shape [dof of a storey].
        common: Codes of the values that all storeys share.
        own: Codes of the other values, shape [value of a storey][storey].
    """

    dofs: tuple[tuple[int, ...], ...]
    springs: tuple[tuple[int, ...], ...]
    outputs: tuple[tuple[int, ...], ...]
    deformation: Rows
    inverse_mass: Rows
    drive: Rows
    output: Rows
    relative: tuple[bool, ...]
    common: Codes
    own: tuple[Codes, ...]

    @property
    def count(self) -> int:
        """Number of storeys."""
        return len(self.dofs)

    @property
    def width(self) -> int:
        """Number of degrees of freedom of a storey."""
        return len(self.dofs[0])


@functools.cache
def storeys_of(pattern: Pattern) -> Storeys | None:
    """Return the storeys of a lumped structure; None if it does not consist of equal storeys.

    Matrices between degrees of freedom, such as a geometric stiffness, biaxial springs and outputs that are resultants
    are not supported.
    """
    others = (pattern.stiffness, pattern.damping, pattern.unmoved)
    is_full = any(table.strides is not None for table in pattern.tables.values())
    if (
        pattern.pairs
        or pattern.line
        or is_full
        or any(pattern.resultants)
        or not all(table.is_empty for table in others)
    ):
        return None
    dofs = len(pattern.inverse_mass.rows)
    for width in (size for size in range(1, dofs // 2 + 1) if dofs % size == 0):
        count = dofs // width
        for of_storey in (
            [range(storey * width, storey * width + width) for storey in range(count)],
            [range(storey, dofs, count) for storey in range(count)],
        ):
            found = _divided(pattern, tuple(map(tuple, of_storey)))
            if found is not None:
                return found
    return None


def _divided(pattern: Pattern, dofs: tuple[tuple[int, ...], ...]) -> Storeys | None:
    """Return the storeys if these degrees of freedom are those of equal storeys; otherwise None."""
    count, width = len(dofs), len(dofs[0])
    place = {dof: (storey, at) for storey, row in enumerate(dofs) for at, dof in enumerate(row)}
    springs = _by_storey(pattern.deformation, place, count)
    if springs is None:
        return None
    first = dict.fromkeys(pattern.tables, 0)
    at = 0
    for name, table in pattern.tables.items():
        first[name] = at
        at += table.values
    codes = {"deformation": _codes(pattern.deformation, springs, place, first["deformation"])}
    codes["inverse_mass"] = _codes(pattern.inverse_mass, dofs, place, first["inverse_mass"])
    if any(is_below for row in codes["inverse_mass"] for _, is_below in row):
        return None
    if any(
        place[term.column][0] != place[row][0] for row, terms in enumerate(pattern.inverse_mass.rows) for term in terms
    ):
        return None
    codes["drive"] = [
        {
            (component, False): _of_column(pattern.drive, [row[at] for row in dofs], component, first["drive"])
            for component in range(pattern.components)
        }
        for at in range(width)
    ]
    outputs = _by_storey(pattern.output, place, count) or ()
    codes["output"] = _codes(pattern.output, outputs, place, first["output"]) if outputs else []
    relative = tuple(
        all(_is_opposite(row.get((at, False)), row.get((at, True))) for row in codes["deformation"] + codes["output"])
        for at in range(width)
    )
    common: dict[Codes, int] = {}
    own: dict[Codes, int] = {}
    for rows in codes.values():
        for row in rows:
            for (column, is_below), entry in row.items():
                if not (is_below and relative[column]):
                    _keep(entry, common, own)
    named = {
        name: tuple(
            tuple(
                _entry(column, is_below, entry, common, own)
                for (column, is_below), entry in sorted(row.items())
                if any(entry) and not (name in ("deformation", "output") and is_below and relative[column])
            )
            for row in rows
        )
        for name, rows in codes.items()
    }
    return Storeys(
        dofs=dofs,
        springs=springs,
        outputs=outputs,
        relative=relative,
        **named,
        common=tuple(each[0] for each in common),
        own=tuple(own),
    )


def _by_storey(table: Table, place: dict[int, tuple[int, int]], count: int) -> tuple[tuple[int, ...], ...] | None:
    """Return the rows of a matrix by storey: the highest one of their columns; None if storeys differ."""
    found: list[list[int]] = [[] for _ in range(count)]
    for row, terms in enumerate(table.rows):
        storeys = {place[term.column][0] for term in terms}
        if not storeys or max(storeys) - min(storeys) > 1:
            return None
        found[max(storeys)].append(row)
    sizes = set(map(len, found))
    return tuple(map(tuple, found)) if len(sizes) == 1 and sizes != {0} else None


Row = dict[tuple[int, bool], Codes]  # codes of the entries of a row, by column


def _codes(table: Table, rows: tuple[tuple[int, ...], ...], place: dict[int, tuple[int, int]], first: int) -> list[Row]:
    """Return the codes of all entries of a matrix, for each row of a storey."""
    found: list[Row] = []
    for at in range(len(rows[0])):
        entries: dict[tuple[int, bool], list[int]] = {}
        for storey, of_storey in enumerate(rows):
            for term in table.rows[of_storey[at]]:
                floor, column = place[term.column]
                entry = entries.setdefault((column, floor != storey), [0] * len(rows))
                entry[storey] = term.sign * (ONE if term.place == UNIT else FIRST_CODE + first + term.place)
        for (_, is_below), entry in entries.items():
            if is_below:  # the floor below the first storey does not move
                entry[0] = entry[1]
        found.append({column: tuple(entry) for column, entry in entries.items()})
    return found


def _of_column(table: Table, rows: list[int], column: int, first: int) -> Codes:
    """Return the codes of the entries of a matrix in a column, for some rows."""
    found = []
    for row in rows:
        code = 0
        for term in table.rows[row]:
            if term.column == column:
                code = term.sign * (ONE if term.place == UNIT else FIRST_CODE + first + term.place)
        found.append(code)
    return tuple(found)


def _is_opposite(own: Codes | None, below: Codes | None) -> bool:
    """Return whether the entry of the floor below is the negative of that of the floor, except in the first storey."""
    if own is None or below is None:
        return own is below
    return all(one == -other for one, other in zip(own[1:], below[1:], strict=True))


def _normal(entry: Codes) -> tuple[int, Codes]:
    """Return a sign and codes whose product is the entry; the first code that is not 0 is positive."""
    sign = next((1 if code > 0 else -1 for code in entry if code), 1)
    return sign, tuple(sign * code for code in entry)


def _keep(entry: Codes, common: dict[Codes, int], own: dict[Codes, int]) -> None:
    _, codes = _normal(entry)
    if set(codes) in ({ONE}, {0}):
        return
    kept = common if len(set(codes)) == 1 else own
    kept.setdefault(codes, len(kept))


def _entry(column: int, is_below: bool, entry: Codes, common: dict[Codes, int], own: dict[Codes, int]) -> Entry:
    sign, codes = _normal(entry)
    place = UNIT if set(codes) == {ONE} else common[codes] if codes in common else len(common) + own[codes]
    return Entry(column, is_below, sign, place)


def statements(
    rows: Rows,
    target: Callable[[int], str],
    factor: Callable[[Entry], str],
    value: Callable[[int], str],
    *,
    sign: int = 1,
) -> str:
    """Return statements that set the product of a storey's matrix and a vector.

    Args:
        rows: The matrix.
        target: Function from a row to the text of the result's element.
        factor: Function from an entry to the text of the vector's element.
        value: Function from the place of a value to its text.
        sign: Sign of the product: 1 or -1.
    """
    lines = []
    for row, entries in enumerate(rows):
        if not entries:
            lines.append(f"{target(row)} = dtype(0.0)")
        for begin in range(0, len(entries), TERMS_PER_STATEMENT):
            text = ""
            for entry in entries[begin : begin + TERMS_PER_STATEMENT]:
                part = factor(entry) if entry.place == UNIT else f"{value(entry.place)} * {factor(entry)}"
                is_positive = sign * entry.sign > 0
                if text:
                    text += f" + {part}" if is_positive else f" - {part}"
                else:
                    text = part if is_positive else f"-{part}"
            lines.append(f"{target(row)} {'=' if begin == 0 else '+='} {text}")
    return "\n".join(lines) or "pass"


def transposed(rows: Rows, width: int, *, is_below: bool) -> Rows:
    """Return the transpose of the part of a storey's matrix for its own floor, or for the floor below."""
    found: list[list[Entry]] = [[] for _ in range(width)]
    for row, entries in enumerate(rows):
        for entry in entries:
            if entry.is_below == is_below:
                found[entry.column].append(Entry(row, False, entry.sign, entry.place))
    return tuple(map(tuple, found))
