"""The matrices of the floors of a frame whose threads on a GPU have one floor each.

Each thread has one element of a vector, and computes its row of the product of a matrix and this vector. If the matrix
couples neighbouring floors only (such as the geometric stiffness of a leaning column), the thread gets two elements of
its neighbours, otherwise the elements of all floors (such as for Rayleigh damping).
"""

from __future__ import annotations

import functools
from collections.abc import Callable, Sequence
from dataclasses import dataclass

from warpdyn.engine.kernels.lumped.pattern import OF_ENERGIES, UNIT, Pattern, Table, transposed
from warpdyn.engine.kernels.lumped.storeys import FIRST_CODE, ONE, Codes

OF_MOTION = ("drive", "unmoved")  # matrices whose columns are components of the motion
BELOW, OWN, ABOVE = -1, 0, 1  # the floor whose element of the vector an entry multiplies


@dataclass(frozen=True)
class Entry:
    """One entry of the rows of all threads.

    Args:
        where: BELOW, OWN or ABOVE, or, of a full matrix, the column.
        sign: Sign of its value.
        place: Index of its value in the list of a thread's values; UNIT if this is 1.
    """

    where: int
    sign: int
    place: int


@dataclass(frozen=True)
class Row:
    """A row of a matrix in all threads.

    Args:
        entries: Its entries.
        is_full: Whether `where` of an entry is a column.
    """

    entries: tuple[Entry, ...]
    is_full: bool


@dataclass(frozen=True)
class FloorMatrices:
    """The rows of all matrices of a frame by thread.

    Args:
        rows: {name of a matrix: rows of a thread}.
        codes: Codes of the values of each thread (see `lumped/storeys.py`), shape [value][thread].
    """

    rows: dict[str, tuple[Row, ...]]
    codes: tuple[Codes, ...]

    @property
    def count(self) -> int:
        """Number of values of a thread."""
        return len(self.codes)


@functools.cache
def floor_matrices(pattern: Pattern, threads: int) -> FloorMatrices:
    """Return the matrices of a frame whose floors are the degrees of freedom, one for each of the threads."""
    assert len(pattern.inverse_mass.rows) == threads, "each thread has one floor"
    places: dict[Codes, int] = {}
    rows, first = {}, 0
    for name, table in pattern.tables.items():
        if name in OF_ENERGIES:
            continue
        if name == "deformation":  # those of hinges do not follow from displacements
            table = Table(table.rows[:threads], table.values)
            rows["force"] = _divided_rows(transposed(table, threads), first, threads, places)
        columns_are_floors = name not in OF_MOTION
        rows[name] = _divided_rows(table, first, threads, places, columns_are_floors=columns_are_floors)
        first += table.values
    return FloorMatrices(rows, tuple(places))


def _divided_rows(
    table: Table, first: int, threads: int, places: dict[Codes, int], *, columns_are_floors: bool = True
) -> tuple[Row, ...]:
    """Return the rows of each thread: row r of the matrix belongs to thread r % threads."""
    if table.is_empty:
        return ()
    found = []
    for begin in range(0, len(table.rows), threads):
        entries: dict[int, dict[int, int]] = {}  # column -> thread -> code
        for thread, terms in enumerate(table.rows[begin : begin + threads]):
            for term in terms:
                code = term.sign * (ONE if term.place == UNIT else FIRST_CODE + first + term.place)
                entries.setdefault(term.column, {})[thread] = code
        distances = {column - thread for column, codes in entries.items() for thread in codes}
        is_banded = columns_are_floors and distances <= {BELOW, OWN, ABOVE}
        factors = []
        for where in sorted(distances if is_banded else entries):
            columns = [thread + where if is_banded else where for thread in range(threads)]
            codes = [entries.get(column, {}).get(thread, 0) for thread, column in enumerate(columns)]
            # The elements below the first floor and above the last one are those of idle threads, which are always 0.
            inside = [
                code for code, column in zip(codes, columns, strict=True) if not is_banded or 0 <= column < threads
            ]
            sign = next(1 if code > 0 else -1 for code in inside if code)
            normal = tuple(sign * code for code in codes)
            is_unit = set(inside) == {sign * ONE}
            factors.append(Entry(where, sign, UNIT if is_unit else places.setdefault(normal, len(places))))
        found.append(Row(tuple(factors), not is_banded))
    return tuple(found)


def row_product(row: Row, target: str, element: Callable[[Entry], str], *, sign: int = 1) -> list[str]:
    """Return statements that add the product of a thread's row and a vector to the target.

    Args:
        row: The row.
        target: Text of the element of the result.
        element: Function from an entry to the text of the vector's element.
        sign: Sign of the product: 1 or -1.
    """
    found = []
    for each in row.entries:
        value = element(each) if each.place == UNIT else f"terms[{each.place}, j] * {element(each)}"
        found.append(f"{target} {'+=' if sign * each.sign > 0 else '-='} {value}")
    return found


def statements_of(lines: Sequence[str]) -> str:
    """Return the statements for all lanes as a text of a kernel."""
    return "\n    ".join(["for j in range(LANES):", *lines]) if lines else "pass"
