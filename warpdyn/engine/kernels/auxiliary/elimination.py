"""The kernel that condenses the stiffness of many structures with the same frame, one structure per thread.

With NumPy the elimination is hundreds of short operations, for which the threads that prepare structures wait for each
other: 16 threads took longer than one.
"""

from __future__ import annotations

import functools
from typing import NamedTuple

import numpy as np
import warp as wp

from warpdyn.engine.device.processor import module_options
from warpdyn.engine.kernels.kernel_cache import loaded


class Elimination(NamedTuple):
    """Data that all structures share: entries of the stiffness from coefficients, and the order of the elimination.

    Args:
        constant: Part of each entry that is equal in all structures, shape [entry].
        starts: First term of each entry and, at the end, the number of terms, shape [entry + 1].
        places: Coefficient of each term, shape [term].
        factors: Its factor, shape [term].
        pivots: For each elimination its diagonal entry, its displacement, its first row and its first product; at the
            end the numbers of rows and products, shape [elimination + 1, 4].
        rows: Entry of the column, and the displacement that it acts on, for each row, shape [row, 2].
        products: The two entries of the column whose product over the diagonal changes the third entry, shape
            [product, 3].
    """

    constant: np.ndarray
    starts: np.ndarray
    places: np.ndarray
    factors: np.ndarray
    pivots: np.ndarray
    rows: np.ndarray
    products: np.ndarray


@functools.cache
def elimination_kernel() -> wp.Kernel:
    """Return the kernel that fills the entries of structures, and eliminates displacements one after the other."""

    @wp.kernel(module="unique", enable_backward=False, module_options=module_options(max_unroll=1))
    def eliminate(
        constant: wp.array(dtype=wp.float64),
        starts: wp.array(dtype=wp.int32),
        places: wp.array(dtype=wp.int32),
        factors: wp.array(dtype=wp.float64),
        pivots: wp.array2d(dtype=wp.int32),
        rows: wp.array2d(dtype=wp.int32),
        products: wp.array2d(dtype=wp.int32),
        coefficients: wp.array2d(dtype=wp.float64),
        forces: wp.array2d(dtype=wp.float64),
        entries: wp.array2d(dtype=wp.float64),
        is_stable: wp.array(dtype=wp.int32),
    ):
        s = wp.tid()
        for entry in range(constant.shape[0]):
            value = constant[entry]
            for term in range(starts[entry], starts[entry + 1]):
                value += factors[term] * coefficients[s, places[term]]
            entries[s, entry] = value
        stable = int(1)
        for pivot in range(pivots.shape[0] - 1):
            diagonal = entries[s, pivots[pivot, 0]]
            inverse = wp.float64(1.0) / diagonal
            stable = wp.where(diagonal > wp.float64(0.0), stable, 0)  # 0 also for NaN
            for product in range(pivots[pivot, 3], pivots[pivot + 1, 3]):
                share = entries[s, products[product, 1]] * inverse
                entries[s, products[product, 2]] -= entries[s, products[product, 0]] * share
            if forces.shape[1] > 0:
                moved = forces[s, pivots[pivot, 1]] * inverse
                for row in range(pivots[pivot, 2], pivots[pivot + 1, 2]):
                    forces[s, rows[row, 1]] -= entries[s, rows[row, 0]] * moved
        is_stable[s] = stable

    return eliminate


def eliminated(
    shared: Elimination, coefficients: np.ndarray, loads: np.ndarray
) -> tuple[np.ndarray, np.ndarray, np.ndarray]:
    """Return the entries and the forces of structures after the elimination, and whether all pivots are above 0.

    Several threads may call this function at the same time.

    Args:
        shared: Data that all structures share.
        coefficients: Coefficients of the members [N/m], [N] and [N m], shape [structure, coefficient].
        loads: Loads on all displacements [N] and [N m], shape [structure, displacement]; without displacements: none.
    """
    kernel = loaded(elimination_kernel())
    count = len(coefficients)
    entries, is_stable = np.empty((count, shared.constant.size)), np.empty(count, dtype=np.int32)
    forces = np.array(loads, dtype=np.float64, order="C")
    given = [*shared, np.ascontiguousarray(coefficients, dtype=np.float64), forces, entries, is_stable]
    inputs = [wp.array(each, dtype=wp.dtype_from_numpy(each.dtype), device="cpu", copy=False) for each in given]
    wp.launch(kernel, dim=count, inputs=inputs, device="cpu")
    return entries, forces, is_stable.astype(bool)
