"""The pattern of a lumped structure: which entries of its matrices are not 0, and the kernel's text of their products.

A kernel contains a statement for each row of a matrix, with a term for each entry that is not 0. The pattern decides
the text; the values of the entries are arguments of the kernel, so that structures with other values share the kernel.
"""

from collections.abc import Callable
from dataclasses import dataclass, field, fields

import numpy as np

from warpdyn.engine.kernels.hinges.layout import JointFrame
from warpdyn.engine.laws.springs import StoreyRules, number_of_coefficients

TERMS_PER_STATEMENT = 3  # so that no line is longer than 120 columns
PAIR = 2  # components of a biaxial spring
# A matrix with more terms than this is stored with its zeros, unless more than 70 % of its entries are 0. Loops over it
# compile in seconds; statements for each of 64 rows with 64 terms take many minutes.
MOST_TERMS, FULL_SHARE = 200, 0.3
MOST_PER_ROW = 4  # terms in rows whose entries share values: drifts of a plan's edge have 4, rows of a chain 3
OF_ENERGIES = ("mass", "pull")  # the last tables of a pattern
UNIT = -1  # place of a value that is 1 in all structures


PLACES_OF_STOREY = 3  # ends of members of a storey of a column line that may have hinges
VALUES_OF_STOREY = 4  # stiffness of the column (own end, other end), of the half-beam [N m/rad], 1 / height [1/m]


@dataclass(frozen=True)
class Term:
    """One entry of a matrix that is not 0.

    Args:
        column: Its column.
        sign: Sign of its value: 1 or -1.
        place: Index of its absolute value among the values of the matrix; UNIT if this is 1.
    """

    column: int
    sign: int
    place: int


Rows = tuple[tuple[Term, ...], ...]


@dataclass(frozen=True)
class Table:
    """The entries of a matrix that are not 0.

    Args:
        rows: The terms of each row.
        values: Number of different values of the terms, without units.
        strides: Of a matrix that is stored with its zeros: distances of the values of successive rows and columns.
    """

    rows: Rows = ()
    values: int = 0
    strides: tuple[int, int] | None = None

    @property
    def is_empty(self) -> bool:
        """Whether all entries are 0."""
        return not any(self.rows)


@dataclass(frozen=True)
class ColumnLine:
    """The column line of a fish-bone frame, whose massless rotations a kernel finds in each stage.

    The rotations are rows of a matrix: those of the joints from the base to the roof, those of ends of members, and
    last a row that is always 0. If only half-beams and the base have hinges, the ends of columns rotate with their
    joints, so that only the ends of half-beams have rows.

    Args:
        springs: Of each storey the hinges at the lower and upper end of its column and at the start of the half-beam
            of the floor above it, as indices of springs; -1 for a rigid connection.
        is_fixed: Whether the base cannot rotate.
        linear: Springs that are linear.
    """

    springs: tuple[int, ...]
    is_fixed: bool
    linear: tuple[int, ...] = ()

    @property
    def storeys(self) -> int:
        """Number of storeys."""
        return len(self.springs) // PLACES_OF_STOREY

    @property
    def hinges(self) -> int:
        """Number of hinges, the linear ones included."""
        return sum(spring >= 0 for spring in self.springs)

    @property
    def values(self) -> int:
        """Number of values: stiffnesses and inverse heights, the stiffness of the base, and those of the hinges."""
        return VALUES_OF_STOREY * self.storeys + 1 + self.hinges

    @property
    def has_hinged_columns(self) -> bool:
        """Whether a column has a hinge in series with a joint that rotates."""
        first = 1 if self.is_fixed else 0
        ends = range(first, len(self.springs))
        return any(self.springs[end] >= 0 and end % PLACES_OF_STOREY < PLACES_OF_STOREY - 1 for end in ends)

    @property
    def base_hinge(self) -> int:
        """The spring between the ground and the first joint; -1 without one, or if columns have hinges."""
        return -1 if self.has_hinged_columns else self.springs[0]

    @property
    def ends_of_storey(self) -> int:
        """Number of rows of ends of members per storey."""
        return PLACES_OF_STOREY if self.has_hinged_columns else 1

    @property
    def rows(self) -> int:
        """Number of rows of rotations, with the last row of zeros."""
        return self.storeys + 1 + self.ends_of_storey * self.storeys + 1

    @property
    def springs_of_rows(self) -> list[int]:
        """Of each row the spring that a message names if its moment does not balance."""
        joints = [max(joint - 1, 0) for joint in range(self.storeys + 1)]
        found = joints + [end // self.ends_of_storey for end in range(self.ends_of_storey * self.storeys)]
        for spring in self.springs:
            if spring >= 0:
                found[self.rows_of(spring)[0]] = spring
        return found

    def rows_of(self, spring: int) -> tuple[int, int]:
        """Return the two rows whose difference is the rotation of a hinge."""
        place = self.springs.index(spring)
        storey, kind = divmod(place, PLACES_OF_STOREY)
        if spring == self.base_hinge:
            return 0, self.rows - 1
        end = place if self.has_hinged_columns else storey
        return self.storeys + 1 + end, storey + min(kind, 1)


@dataclass(frozen=True)
class Pattern:
    """The pattern of a lumped structure, part of a kernel's plan.

    Args:
        deformation: Deformations of the springs, from displacements of the degrees of freedom, [spring, dof].
        inverse_mass: Inverse mass matrix, [dof, dof].
        stiffness: Elastic stiffness minus geometric stiffness, without the springs, [dof, dof].
        damping: Damping matrix, without the dashpots of the springs, [dof, dof].
        drive: M^-1 times the load mass times the influence matrix, [dof, component].
        unmoved: Influence matrix minus `drive`, [dof, component]; empty if the load mass is the mass matrix.
        output: Outputs, from displacements of the degrees of freedom, [row, dof]: the first rows of all outputs, then
            the other rows of resultants.
        mass: Mass matrix, [dof, dof].
        pull: Load mass times influence matrix, [dof, component].
        components: Number of components of the base motion.
        has_dashpots: Whether a spring has a dashpot.
        pairs: Number of biaxial springs; the deformations of their components are the last rows of `deformation`.
        biaxial_law: Device functions of the biaxial springs; None without such springs.
        resultants: For each output the places of its other rows; () for an output that is not a resultant.
        line: The column line of a fish-bone frame with hinges, or the layout of another frame with hinges; None for
            other structures.
        storeys: For each storey the places of the springs whose deformations are its drift; () without storeys.
    """

    deformation: Table
    inverse_mass: Table
    stiffness: Table = field(default_factory=Table)
    damping: Table = field(default_factory=Table)
    drive: Table = field(default_factory=Table)
    unmoved: Table = field(default_factory=Table)
    output: Table = field(default_factory=Table)
    mass: Table = field(default_factory=Table)
    pull: Table = field(default_factory=Table)
    components: int = 1
    has_dashpots: bool = False
    pairs: int = 0
    biaxial_law: StoreyRules | None = None
    resultants: tuple[tuple[int, ...], ...] = ()
    line: ColumnLine | JointFrame | None = None
    storeys: tuple[tuple[int, ...], ...] = ()

    @property
    def springs(self) -> int:
        """Number of springs; a biaxial spring counts as two."""
        return len(self.deformation.rows)

    @property
    def single_springs(self) -> int:
        """Number of springs without the biaxial ones."""
        return self.springs - PAIR * self.pairs

    @property
    def tables(self) -> dict[str, Table]:
        """The tables by name."""
        found = {each.name: getattr(self, each.name) for each in fields(self)}
        return {name: table for name, table in found.items() if isinstance(table, Table)}

    @property
    def values(self) -> int:
        """Number of values of all tables except those that only energies need."""
        return sum(table.values for name, table in self.tables.items() if name not in OF_ENERGIES)

    @property
    def values_of_pairs(self) -> int:
        """Number of coefficients of the biaxial springs, which follow the values of dashpots."""
        return 0 if self.biaxial_law is None else self.pairs * number_of_coefficients(self.biaxial_law)

    @property
    def first_of_line(self) -> int:
        """Place of the first value of a column line, which follow those of biaxial springs."""
        return self.values + self.springs * self.has_dashpots + self.values_of_pairs

    @property
    def values_of_line(self) -> int:
        """Number of values of a column line."""
        return 0 if self.line is None else self.line.values

    @property
    def values_of_energies(self) -> int:
        """Number of values of the tables that only energies need, which follow the other values."""
        return sum(self.tables[name].values for name in OF_ENERGIES)


def table_of(
    matrices: np.ndarray, *, has_signs: bool = True, may_be_computed: bool = False, is_symmetric: bool = False
) -> Table:
    """Return the table of a matrix of some structures.

    Args:
        matrices: The matrix of each structure, shape [structure, row, column]. Entries whose absolute values are equal
            in all structures share a value.
        has_signs: Whether the terms contain the signs of the entries. False: the values do, so that structures whose
            entries have other signs share the kernel; entries share a value if they are equal.
        may_be_computed: Whether the entries may be results of a computation, such as a static condensation. Then
            rounding would decide which entries are equal, and each new structure would need another kernel. Therefore
            entries of rows with more than MOST_PER_ROW terms share a value only with their mirrored entries.
        is_symmetric: Whether mirrored entries are equal.
    """
    places: dict[bytes | tuple[int, int], int] = {}
    is_long = np.any(matrices, axis=0).sum(axis=1) > MOST_PER_ROW
    if is_symmetric:  # a row shares values with other rows
        is_long[:] = np.any(matrices, axis=0).sum() > MOST_PER_ROW * matrices.shape[1]
    rows: list[tuple[Term, ...]] = []
    for row in range(matrices.shape[1]):
        terms = []
        for column in np.flatnonzero(np.any(matrices[:, row], axis=0)):
            entry = matrices[:, row, column]
            sign = -1 if has_signs and (entry <= 0).all() else 1
            own = sign * entry
            key: bytes | tuple[int, int] = own.tobytes()
            if may_be_computed and is_long[row]:
                key = (min(row, column), max(row, column)) if is_symmetric else (row, column)
            place = UNIT if (own == 1).all() else places.setdefault(key, len(places))
            terms.append(Term(int(column), sign, place))
        rows.append(tuple(terms))
    count, columns = matrices.shape[1:]
    if sum(map(len, rows)) > max(MOST_TERMS, FULL_SHARE * count * columns):
        full = [tuple(Term(column, 1, row * columns + column) for column in range(columns)) for row in range(count)]
        return Table(tuple(full), count * columns, (columns, 1))
    return Table(tuple(rows), len(places))


def products(
    table: Table,
    name: str,
    factor: Callable[[int | str], str],
    target: Callable[[int | str], str],
    *,
    sign: int = 1,
    is_added: bool = False,
    first: int = 0,
) -> str:
    """Return statements that compute the product of a matrix and a vector for all lanes.

    Args:
        table: The matrix.
        name: Variable with its values, [value, lane].
        factor: Function from a column, or its variable, to the text of the vector's element.
        target: Function from a row, or its variable, to the text of the result's element.
        sign: Sign of the product: 1 or -1.
        is_added: Whether the product is added to the result; otherwise the result is set, also in rows without entries.
        first: Place of the first value of the matrix in the variable.
    """
    if table.strides is not None:
        return _loops(table, name, factor("k"), target("i"), sign, first, is_added=is_added)
    lines = []
    for row, terms in enumerate(table.rows):
        if not terms and not is_added:
            lines.append(f"{target(row)} = dtype(0.0)")
        for begin in range(0, len(terms), TERMS_PER_STATEMENT):
            is_first = begin == 0 and not is_added
            # A positive term is the first one, because a negation takes an instruction on a GPU.
            chosen = sorted(terms[begin : begin + TERMS_PER_STATEMENT], key=lambda term: -sign * term.sign)
            has_negative_sum = sign * chosen[0].sign < 0 and not is_first
            text = ""
            for term in chosen:
                value = factor(term.column)
                product = value if term.place == UNIT else f"{name}[{first + term.place}, j] * {value}"
                is_positive = sign * term.sign > 0 or has_negative_sum
                if text:
                    text += f" + {product}" if is_positive else f" - {product}"
                else:
                    text = product if is_positive else f"-{product}"
            word = "=" if is_first else "-=" if has_negative_sum else "+="
            lines.append(f"{target(row)} {word} {text}")
    return "\n    ".join(["for j in range(LANES):", *lines]) if lines else ""


def _loops(table: Table, name: str, factor: str, target: str, sign: int, first: int, *, is_added: bool) -> str:
    """Return the result of `products` for a matrix that is stored with its zeros."""
    assert table.strides is not None
    of_row, of_column = table.strides
    lines = [f"for i in range({len(table.rows)}):"]
    lines += [] if is_added else ["    for j in range(LANES):", f"        {target} = dtype(0.0)"]
    lines += [f"    for k in range({len(table.rows[0])}):", "        for j in range(LANES):"]
    place = f"{first} + {of_row} * i + {of_column} * k"
    return "\n".join([*lines, f"            {target} {'+' if sign > 0 else '-'}= {name}[{place}, j] * {factor}"])


def transposed(table: Table, columns: int) -> Table:
    """Return the transpose of a matrix with this number of columns."""
    rows: list[list[Term]] = [[] for _ in range(columns)]
    for row, terms in enumerate(table.rows):
        for term in terms:
            rows[term.column].append(Term(row, term.sign, term.place))
    strides = None if table.strides is None else (table.strides[1], table.strides[0])
    return Table(tuple(map(tuple, rows)), table.values, strides)


def values_in(table: Table, matrices: np.ndarray) -> np.ndarray:
    """Return the values of a table's terms, shape [value, structure].

    Args:
        table: The table, of structures with the same pattern.
        matrices: The matrix of each structure, shape [structure, row, column].
    """
    found = np.zeros((table.values, len(matrices)))
    for row, terms in enumerate(table.rows):
        for term in terms:
            if term.place != UNIT:
                found[term.place] = term.sign * matrices[:, row, term.column]
    return found
