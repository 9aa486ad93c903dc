"""Degrees of freedom of a frame: supports, rigid diaphragms, and rotations that no member resists."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from dataclasses import dataclass

import numpy as np
from scipy import sparse

from warpdyn.model.structures.frames.tables.columns import DIRECTIONS


@dataclass(frozen=True)
class Numbering:
    """The independent degrees of freedom of a frame.

    Attributes:
        names: Name of each: "node ux", "node uy", "node rz", or the name of a diaphragm.
        places: Number of the degree of freedom of each node and direction, shape [node, 3].
        of_members: Numbers of the degrees of freedom of each member's nodes, shape [member, 6].
        free: Numbers of those that are neither fixed nor unused, shape [free].
        springs: Stiffness of support springs [N/m] or [N m/rad], shape [dof].
        is_horizontal: Whether each is a horizontal displacement, shape [dof].
        is_vertical: Whether each is a vertical displacement, shape [dof].
    """

    names: tuple[str, ...]
    places: np.ndarray
    of_members: np.ndarray
    free: np.ndarray
    springs: np.ndarray
    is_horizontal: np.ndarray
    is_vertical: np.ndarray

    @property
    def free_names(self) -> tuple[str, ...]:
        """Names of the free degrees of freedom."""
        return tuple(self.names[place] for place in self.free)

    def assembled(self, matrices: np.ndarray, *, has_springs: bool = False) -> sparse.csc_array:
        """Return the sum of the members' matrices in the directions of the nodes, shape [member, 6, 6], as sparse."""
        rows = np.broadcast_to(self.of_members[:, :, None], matrices.shape)
        columns = np.broadcast_to(self.of_members[:, None, :], matrices.shape)
        shape = (len(self.names),) * 2
        found = sparse.coo_array((matrices.ravel(), (rows.ravel(), columns.ravel())), shape=shape).tocsc()
        return found + sparse.diags_array(self.springs).tocsc() if has_springs else found

    def assembled_of_many(self, matrices: np.ndarray, *, has_springs: bool = False) -> np.ndarray:
        """Return the matrices of many structures in the free degrees of freedom, shape [structure, free, free]."""
        number = np.full(len(self.names), -1)
        number[self.free] = np.arange(self.free.size)
        rows = np.broadcast_to(number[self.of_members[:, :, None]], matrices.shape[-3:]).ravel()
        columns = np.broadcast_to(number[self.of_members[:, None, :]], matrices.shape[-3:]).ravel()
        kept = (rows >= 0) & (columns >= 0)
        size = self.free.size
        values = matrices.reshape(-1, rows.size)[:, kept]
        target = rows[kept] * size + columns[kept]
        sums = sparse.coo_array((np.ones(target.size), (np.arange(target.size), target)), (target.size, size * size))
        found: np.ndarray = np.asarray(values @ sums.tocsr()).reshape(-1, size, size)
        return found + np.diag(self.springs[self.free]) if has_springs else found


def numbering_of(
    nodes: Sequence[str],
    ends: np.ndarray,
    resists: np.ndarray,
    supports: Mapping[str, Mapping[str, bool | float]],
    diaphragms: Mapping[str, Sequence[str]],
) -> Numbering:
    """Return the degrees of freedom of a frame.

    Args:
        nodes: Names of the nodes.
        ends: Indices of the start and end node of each member, shape [member, 2].
        resists: Whether each end of each member resists the rotation of its node, shape [member, 2].
        supports: {node: {direction: True or a stiffness}}.
        diaphragms: {name: nodes}.
    """
    index = {name: place for place, name in enumerate(nodes)}
    places = np.full((len(nodes), 3), -1)
    names: list[str] = []
    for name, listed in diaphragms.items():
        places[[index[node] for node in listed], 0] = len(names)
        names.append(name)
    for place, node in enumerate(nodes):
        for axis, direction in enumerate(DIRECTIONS):
            if places[place, axis] < 0:
                places[place, axis] = len(names)
                names.append(f"{node} {direction}")
    is_fixed, springs = np.zeros(len(names), bool), np.zeros(len(names))
    turns = np.zeros(len(nodes), bool)  # nodes whose rotation a member or a spring resists
    np.logical_or.at(turns, ends, resists)
    for node, support in supports.items():
        for direction, value in support.items():
            place = places[index[node], DIRECTIONS.index(direction)]
            if value is True:
                is_fixed[place] = True
            else:
                springs[place] += float(value)
                turns[index[node]] |= direction == "rz"
    unused = np.zeros(len(names), bool)
    unused[places[~turns, 2]] = True
    horizontal, vertical = np.zeros(len(names), bool), np.zeros(len(names), bool)
    horizontal[places[:, 0]], vertical[places[:, 1]] = True, True
    return Numbering(
        names=tuple(names),
        places=places,
        of_members=places[ends].reshape(len(ends), 6),
        free=np.flatnonzero(~is_fixed & ~unused),
        springs=springs,
        is_horizontal=horizontal,
        is_vertical=vertical,
    )
