"""Massless displacements of a frame with hinges: their order and scale, and what turns the chords of its members."""

from __future__ import annotations

from typing import TYPE_CHECKING, NamedTuple

import numpy as np
from scipy import sparse
from scipy.sparse.csgraph import connected_components, reverse_cuthill_mckee

from warpdyn.model.structures.frames.members.condensation import coefficients_to_entries
from warpdyn.model.structures.frames.members.elements import ROTATIONS

if TYPE_CHECKING:
    from warpdyn.model.structures.frames.frame import Frame

WHO = "HingedFrame"
MOST_ROWS = 256  # massless displacements
MOST_ENTRIES = 4096  # stored entries of the matrix of massless displacements
START, END = 1, 4  # transverse displacements of a member's ends in local axes
AXIAL = (0, 3)  # axial displacements
NEGLIGIBLE = 1e-12  # coefficients relative to 1 / length


class Joints(NamedTuple):
    """The unknowns of a frame with hinges.

    Attributes:
        places: Number of each massless displacement among the free degrees of freedom, in the order of the unknowns.
        to_free: Displacements of all free degrees of freedom per unknown and per storey drift, shape [free, unknown +
            storey].
        chords: Rotation of the chord of each member with hinges per unknown and drift, of a brace that yields its
            elongation [m], shape [member, unknown + storey].
        rotations: Unknowns that are the rotations of the nodes at both ends of these members; the number of unknowns
            for a rotation that is fixed, shape [member, 2].
        of_members: Stiffness in unknowns and drifts per coefficient of all members, see `stiffness_coefficients`, shape
            [(unknown + storey) squared, member times 4].
    """

    places: np.ndarray
    to_free: np.ndarray
    chords: np.ndarray
    rotations: np.ndarray
    of_members: sparse.csr_array


def joints_of(frame: Frame, kept: np.ndarray, members: list[int], is_axial: np.ndarray) -> Joints:
    """Return the unknowns of a frame, or raise an error if they are too many.

    Args:
        frame: The frame; all masses are on rigid floors, which are its storeys.
        kept: Numbers of the floors among the free degrees of freedom.
        members: Indices of the members with hinges.
        is_axial: Whether they are braces that yield, shape [member].
    """
    numbering = frame.numbering
    free = numbering.free
    number = np.full(len(numbering.names), -1)
    number[free] = np.arange(free.size)
    of_members = number[numbering.of_members]
    moved = of_members[members]
    for place in ROTATIONS:
        moved[is_axial, place] = -1
    massless = _ordered(_coupled(frame), kept, np.setdiff1d(moved, [-1, *kept]))
    storeys = list(frame.storey_drifts.values())
    height = float(np.mean([height for _, _, height in storeys]))
    is_rotation = ~(numbering.is_horizontal | numbering.is_vertical)[free]
    count = massless.size
    to_free = np.zeros((free.size, count + len(storeys)))
    to_free[massless, np.arange(count)] = np.where(is_rotation[massless], 1.0, height)
    names = list(numbering.free_names)
    for storey, (upper, lower, _) in enumerate(storeys):
        row = to_free[names.index(upper)]
        row += 0.0 if lower is None else to_free[names.index(lower)]
        row[count + storey] = 1.0
    local, length = frame.geometry.to_local[members], frame.geometry.length[members]
    chord = (local[:, END] - local[:, START]) / length[:, None]
    chord[is_axial] = local[is_axial, AXIAL[1]] - local[is_axial, AXIAL[0]]
    padded = np.vstack([to_free, np.zeros(count + len(storeys))])  # the last row is that of fixed displacements
    chords = np.einsum("mi,mij->mj", chord, padded[of_members[members]])
    chords[np.abs(chords) < NEGLIGIBLE * np.abs(chords).max(initial=1.0)] = 0.0
    order = np.full(free.size + 1, count)
    order[massless] = np.arange(count)
    size = count + len(storeys)
    entries = np.arange(size * size).reshape(size, size)
    of_members = coefficients_to_entries(frame.deformations @ to_free, entries)
    return Joints(massless, to_free, chords, order[moved[:, ROTATIONS]], of_members)


def _coupled(frame: Frame) -> np.ndarray:
    """Return which free degrees of freedom are coupled by stiffness, shape [free, free]."""
    free = frame.numbering.free
    stiffness = frame.stiffness(frame.nominal)[free][:, free].toarray()
    size = np.sqrt(np.diagonal(stiffness))
    found: np.ndarray = np.abs(stiffness) > NEGLIGIBLE * np.outer(size, size)
    return found


def _ordered(coupled: np.ndarray, kept: np.ndarray, hinged: np.ndarray) -> np.ndarray:
    """Return the massless displacements in an order in which the matrix has few entries.

    Those that no stiffness couples to floors or members with hinges, such as the shortening of a leaning column, have
    no effect and are left out.

    Args:
        coupled: Which free degrees of freedom are coupled, shape [free, free].
        kept: Numbers of the floors.
        hinged: Numbers of the displacements of members with hinges, without floors.
    """
    massless = np.setdiff1d(np.arange(len(coupled)), kept)
    among = coupled[np.ix_(massless, massless)]
    _, group = connected_components(sparse.csr_array(among), directed=False)
    has_effect = np.isin(massless, hinged) | coupled[np.ix_(massless, kept)].any(axis=1)
    massless = massless[np.isin(group, group[has_effect])]
    if not massless.size:
        return massless
    pattern = coupled[np.ix_(massless, massless)]
    orders = [np.arange(massless.size), reverse_cuthill_mckee(sparse.csr_array(pattern), symmetric_mode=True)]
    count, order = min(
        (entries_of(first_columns_of(pattern[np.ix_(each, each)])), place) for place, each in enumerate(orders)
    )
    if massless.size > MOST_ROWS or count > MOST_ENTRIES:
        raise ValueError(
            f"{WHO}: the frame has {massless.size} massless displacements, whose matrix has {count} entries; at most "
            f"{MOST_ROWS} and {MOST_ENTRIES} are possible. Neglect the shortening of columns: support the joints by "
            "'roller', with gravity loads on a leaning column; or model fewer bays, or a fish-bone (wd.fishbone)"
        )
    found: np.ndarray = massless[orders[order]]
    return found


def first_columns_of(pattern: np.ndarray) -> np.ndarray:
    """Return the first column of each row of a symmetric matrix that is not 0, at most the diagonal."""
    found: np.ndarray = (pattern | np.eye(len(pattern), dtype=bool)).argmax(axis=1)
    return found


def entries_of(first_columns: np.ndarray) -> int:
    """Return the number of stored entries from the first column of each row to the diagonal."""
    return int((np.arange(len(first_columns)) - first_columns + 1).sum())
