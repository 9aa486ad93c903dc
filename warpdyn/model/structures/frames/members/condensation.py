"""Static condensation of the stiffness of many structures with the same frame, one displacement after the other.

Stiffness matrices are sums of fixed matrices of rank one or two, times the coefficients of `stiffness_coefficients`.
Only their entries that are not 0 are stored. `engine/kernels/auxiliary/elimination.py` contains the kernel.
"""

from __future__ import annotations

from typing import TYPE_CHECKING

import numpy as np
from scipy import sparse

if TYPE_CHECKING:
    from warpdyn.engine.kernels.auxiliary.elimination import Elimination

BUCKLES = (
    "p_delta=True: a part of the frame buckles under gravity between the kept degrees of freedom with these sections: "
    "reduce the scatter of elastic_modulus and second_moment, or the gravity loads"
)
NEARLY_A_MECHANISM = (
    "a part of the frame has nearly no stiffness between the kept degrees of freedom with these sections: check the "
    "values of elastic_modulus, area and second_moment (in Pa, m2 and m4) and their scatter"
)
PAIRS = ((0, 0), (1, 1), (1, 2), (2, 2))  # deformations of a member whose product each coefficient multiplies


def coefficients_to_entries(deformations: np.ndarray, place: np.ndarray) -> sparse.csr_array:
    """Return the matrix from the coefficients of all members to entries of the stiffness.

    Args:
        deformations: Elongation and rotations of both ends relative to the chord of each member per displacement,
            shape [member, 3, displacement].
        place: Number of each entry, -1 for entries that are left out, shape [displacement, displacement].
    """
    coefficients, targets, values = [], [], []
    for member, of_member in enumerate(deformations):
        moved = np.flatnonzero(of_member.any(axis=0))
        target = place[np.ix_(moved, moved)]
        for number, (first, second) in enumerate(PAIRS):
            outer = np.outer(of_member[first, moved], of_member[second, moved])
            outer = outer if first == second else outer + outer.T
            taken = (outer != 0) & (target >= 0)
            coefficients.append(np.full(np.count_nonzero(taken), len(PAIRS) * member + number))
            targets.append(target[taken])
            values.append(outer[taken])
    where = np.concatenate(targets), np.concatenate(coefficients)
    shape = place.max(initial=-1) + 1, len(PAIRS) * len(deformations)
    return sparse.coo_array((np.concatenate(values), where), shape).tocsr()


class UnstableSections(ValueError):
    """Error: the eliminated displacements of a frame with these sections are not stable."""


class Condensation:
    """Elimination of all displacements but the kept ones, in an order with few new entries.

    Args:
        deformations: Deformations of members per displacement, shape [member, 3, displacement].
        constant: Stiffness that is equal in all structures, such as that of supports, shape [displacement,
            displacement].
        kept: Numbers of the kept displacements.
        fault: Message of the error if the other displacements are not stable.
    """

    def __init__(
        self, deformations: np.ndarray, constant: np.ndarray, kept: np.ndarray, fault: str = NEARLY_A_MECHANISM
    ) -> None:
        self.fault = fault
        pattern = (constant != 0) | np.eye(len(constant), dtype=bool)
        for of_member in deformations:
            moved = np.flatnonzero(of_member.any(axis=0))
            pattern[np.ix_(moved, moved)] = True
        pattern[np.ix_(kept, kept)] = True
        order = _eliminated(pattern, kept)  # `pattern` now contains the new entries
        position = np.empty(len(pattern), int)
        position[[*order, *kept]] = np.arange(len(pattern))
        is_lower = position[:, None] >= position
        place = np.full(pattern.shape, -1)
        place[pattern & is_lower] = np.arange(np.count_nonzero(pattern & is_lower))
        self.kept = kept
        self.elimination = _elimination(order, position, place, constant, coefficients_to_entries(deformations, place))
        of_kept = place[np.ix_(kept, kept)]
        self.of_kept = np.where(of_kept >= 0, of_kept, of_kept.T)

    def condensed(self, coefficients: np.ndarray) -> np.ndarray:
        """Return the condensed stiffness of structures, shape [structure, kept, kept].

        Args:
            coefficients: Result of `stiffness_coefficients`, shape [structure, member, 4].

        Raises:
            UnstableSections: If the eliminated displacements are not stable, for example under gravity.
        """
        return self.with_loads(coefficients, np.zeros((len(coefficients), 0)))[0]

    def with_loads(self, coefficients: np.ndarray, loads: np.ndarray) -> tuple[np.ndarray, np.ndarray]:
        """Return the result of `condensed`, and loads with the same effect on kept displacements, [structure, kept].

        Args:
            coefficients: As in `condensed`.
            loads: Loads on all displacements, shape [structure, displacement]; without displacements: no loads.
        """
        from warpdyn.engine.kernels.auxiliary.elimination import eliminated

        stiffness, forces, is_stable = eliminated(
            self.elimination,
            coefficients.reshape(len(coefficients), -1),
            np.broadcast_to(loads, (len(coefficients), loads.shape[1])),
            self.kept,
            self.of_kept,
        )
        if not is_stable.all():
            raise UnstableSections(self.fault)
        return stiffness, forces


def _elimination(
    order: list[int], position: np.ndarray, place: np.ndarray, constant: np.ndarray, of_coefficients: sparse.csr_array
) -> Elimination:
    """Return the tables of the kernel.

    Args:
        order: Displacements in the order of their elimination.
        position: Position of each displacement in this order, the kept ones at the end, shape [displacement].
        place: Number of each entry, -1 for entries that are left out, shape [displacement, displacement].
        constant: Stiffness that is equal in all structures, shape [displacement, displacement].
        of_coefficients: Matrix from coefficients to entries.
    """
    from warpdyn.engine.kernels.auxiliary.elimination import Elimination

    fixed = np.zeros(place.max() + 1)
    fixed[place[place >= 0]] = constant[place >= 0]
    pivots: list[tuple[int, ...]] = []
    rows: list[tuple[int, ...]] = []
    products: list[tuple[int, ...]] = []
    for pivot in order:
        pivots.append((place[pivot, pivot], pivot, len(rows), len(products)))
        below = np.flatnonzero(place[:, pivot] >= 0)
        below = below[position[below] > position[pivot]]
        rows += [(place[row, pivot], row) for row in below]
        products += [
            (place[row, pivot], place[column, pivot], place[row, column])
            for row in below
            for column in below
            if place[row, column] >= 0
        ]
    pivots.append((0, 0, len(rows), len(products)))
    return Elimination(
        fixed,
        of_coefficients.indptr.astype(np.int32),
        of_coefficients.indices.astype(np.int32),
        of_coefficients.data,
        np.array(pivots, dtype=np.int32),
        np.array(rows, dtype=np.int32).reshape(-1, 2),
        np.array(products, dtype=np.int32).reshape(-1, 3),
    )


def _eliminated(pattern: np.ndarray, kept: np.ndarray) -> list[int]:
    """Return the other displacements in the order of fewest neighbours, and mark the new entries in the pattern."""
    left = np.ones(len(pattern), bool)
    waiting = set(range(len(pattern))) - set(kept.tolist())
    order = []
    while waiting:
        neighbours = (pattern & left).sum(axis=1)
        pivot = min(waiting, key=lambda each: (neighbours[each], each))
        waiting.remove(pivot)
        order.append(pivot)
        left[pivot] = False
        moved = np.flatnonzero(pattern[pivot] & left)
        pattern[np.ix_(moved, moved)] = True
    return order
