"""Checks of names of degrees of freedom, and of matrices and vectors along them."""

from __future__ import annotations

from collections.abc import Collection, Mapping, Sequence

import numpy as np
from numpy.typing import ArrayLike

from warpdyn.foundations.core.checks import checked_text, finite_numbers, real_number, shortened
from warpdyn.foundations.core.frozen_values import FrozenMapping
from warpdyn.foundations.core.near_misses import did_you_mean

MOST_COMPONENTS = 6  # of the base motion
SYMMETRIC_WITHIN = 1e-9  # difference of two mirrored entries over the largest entry


def checked_coefficients(what: str, given: object) -> dict[str, float]:
    """Return {degree of freedom: coefficient}, or raise an error that names the argument."""
    if not isinstance(given, Mapping):
        raise TypeError(f"{what} must be a dictionary, such as {{'x': 1.0}}, got {shortened(given)}")
    return {checked_text(f"{what}: a name", dof): real_number(f"{what}[{dof!r}]", each) for dof, each in given.items()}


def check_known(what: str, given: Collection[str], dofs: Sequence[str]) -> None:
    """Raise a ValueError if one of the names is not that of a degree of freedom."""
    for name in given:
        if name not in dofs:
            listed = ", ".join(map(repr, dofs[:12])) + (" ..." if len(dofs) > 12 else "")
            raise ValueError(
                f"{what} names the unknown degree of freedom {name!r}{did_you_mean(name, list(dofs))}; there are "
                f"{listed}"
            )


Rows = tuple[Mapping[str, float], ...]  # of one output; an output with several rows is their resultant


def checked_outputs(given: object, dofs: Sequence[str], *, can_be_zero: bool = False) -> Mapping[str, Rows]:
    """Return the outputs of a structure, {name: rows}, or raise an error that names the output.

    Args:
        given: Outputs, {name: row or rows}.
        dofs: Names of the degrees of freedom.
        can_be_zero: Whether all coefficients of an output may be 0, because those of random structures are not.
    """
    if given is None:
        return FrozenMapping({})
    if not isinstance(given, Mapping):
        raise TypeError(f"outputs must be a dictionary, such as {{'corner': {{'x': 1.0}}}}, got {shortened(given)}")
    found = {}
    for name, rows in given.items():
        what = f"output {checked_text('outputs: a name', name)!r}"
        if isinstance(rows, list | tuple) and not rows:
            raise ValueError(f"{what} is an empty list: give one dictionary, or two for a resultant")
        listed = rows if isinstance(rows, list | tuple) else (rows,)
        found[name] = tuple(checked_coefficients(what, row) for row in listed)
        for row in found[name]:
            check_known(what, row, dofs)
            if not can_be_zero and not any(row.values()):
                raise ValueError(f"{what} depends on no degree of freedom: give a coefficient other than 0")
    return FrozenMapping(found)


def as_given(outputs: Mapping[str, Rows]) -> dict[str, dict[str, float] | list[dict[str, float]]]:
    """Return outputs as arguments: a dictionary for each linear combination, and a list for each resultant."""
    return {name: dict(rows[0]) if len(rows) == 1 else [dict(row) for row in rows] for name, rows in outputs.items()}


def row_of(given: Mapping[str, float], dofs: Sequence[str]) -> np.ndarray:
    """Return coefficients as a vector, shape [dof]."""
    return np.array([given.get(dof, 0.0) for dof in dofs])


def checked_matrix(name: str, given: ArrayLike, dofs: Sequence[str], units: str) -> np.ndarray:
    """Return a symmetric matrix over the degrees of freedom, or raise a ValueError."""
    matrix = finite_numbers(name, given, units)
    if matrix.shape != (len(dofs), len(dofs)):
        raise ValueError(
            f"{name} must have a row and a column for each of the {len(dofs)} degrees of freedom, shape "
            f"[{len(dofs)}, {len(dofs)}], got {list(matrix.shape)}"
        )
    gap = np.abs(matrix - matrix.T)
    if gap.max() > SYMMETRIC_WITHIN * np.abs(matrix).max():
        row, column = np.unravel_index(gap.argmax(), gap.shape)
        raise ValueError(
            f"{name} is not symmetric: [{dofs[row]!r}, {dofs[column]!r}] is {matrix[row, column]:g}, but "
            f"[{dofs[column]!r}, {dofs[row]!r}] is {matrix[column, row]:g}; both must be equal"
        )
    matrix = (matrix + matrix.T) / 2
    matrix.flags.writeable = False
    return matrix


def check_dissipates(matrix: np.ndarray, dofs: Sequence[str]) -> None:
    """Raise a ValueError if the damping matrix [N s/m] feeds a motion with energy."""
    values, shapes = np.linalg.eigh(matrix)
    if values[0] < -SYMMETRIC_WITHIN * np.abs(values).max():
        dof = dofs[int(np.abs(shapes[:, 0]).argmax())]
        raise ValueError(
            f"damping_matrix has the negative eigenvalue {values[0]:g} N s/m: it would feed a motion, mostly of degree "
            f"of freedom {dof!r}, with energy. Check the signs of its entries"
        )


def checked_influence(given: object, dofs: tuple[str, ...], directions: list[Mapping[str, float]]) -> np.ndarray:
    """Return the influence matrix, shape [dof, component]; `directions` are the coefficients of the springs."""
    if given is None and any(abs(each) not in (0, 1) for direction in directions for each in direction.values()):
        raise ValueError(
            "influence is missing: a spring has a coefficient other than 1 and -1, so that a degree of freedom may be "
            "a rotation, which the base motion does not move. Give influence=, such as {'x': 1.0} or "
            "[{'x': 1.0}, {'y': 1.0}]"
        )
    rows = [dict.fromkeys(dofs, 1.0)] if given is None else given
    rows = [rows] if isinstance(rows, Mapping) else rows
    if not isinstance(rows, list | tuple) or not 1 <= len(rows) <= MOST_COMPONENTS:
        raise TypeError(
            "influence must be a dictionary, such as {'x': 1.0}, or a list with one dictionary for each component "
            f"of the base motion (at most {MOST_COMPONENTS}), got {shortened(given)}"
        )
    columns = []
    for component, row in enumerate(rows):
        what = "influence" if len(rows) == 1 else f"influence[{component}]"
        values = checked_coefficients(what, row)
        check_known(what, values, dofs)
        columns.append(row_of(values, dofs))
    matrix = np.stack(columns, axis=1)
    matrix.flags.writeable = False
    return matrix
