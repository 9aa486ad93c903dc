"""The kernel that condenses the stiffness of many structures with the same frame, CPU_LANES structures per thread.

With NumPy the elimination is hundreds of short operations, for which the threads that prepare structures wait for each
other: 16 threads took longer than one.
"""

from __future__ import annotations

import functools
from typing import NamedTuple

import numpy as np
import warp as wp

from warpdyn.engine.device.processor import align_rows, module_options
from warpdyn.engine.kernels.build import CPU_LANES
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
    LANES = CPU_LANES
    double = wp.float64
    row = wp.types.vector(length=LANES, dtype=double)

    @wp.kernel(module="unique", enable_backward=False, module_options=module_options(max_unroll=1))
    def eliminate(
        constant: wp.array(dtype=double),
        starts: wp.array(dtype=wp.int32),
        places: wp.array(dtype=wp.int32),
        factors: wp.array(dtype=double),
        pivots: wp.array2d(dtype=wp.int32),
        rows: wp.array2d(dtype=wp.int32),
        products: wp.array2d(dtype=wp.int32),
        coefficients: wp.array2d(dtype=row),  # [group of structures, coefficient]
        forces: wp.array2d(dtype=row),  # [group of structures, displacement]; input: loads
        entries: wp.array2d(dtype=row),  # [group of structures, entry]
        is_stable: wp.array2d(dtype=wp.bool),  # [group of structures, lane]
    ):
        align_rows()
        group = wp.tid()
        value = row()
        inverse = row()
        share = row()
        stable = row()
        one, zero = double(1.0), double(0.0)
        for entry in range(constant.shape[0]):
            for j in range(LANES):
                value[j] = constant[entry]
            for term in range(starts[entry], starts[entry + 1]):
                factor = factors[term]
                share = coefficients[group, places[term]]
                for j in range(LANES):
                    value[j] += factor * share[j]
            entries[group, entry] = value
        for j in range(LANES):
            stable[j] = one
        for pivot in range(pivots.shape[0] - 1):
            value = entries[group, pivots[pivot, 0]]
            for j in range(LANES):
                inverse[j] = one / value[j]
                stable[j] = wp.where(value[j] > zero, stable[j], zero)  # 0 also for NaN
            for product in range(pivots[pivot, 3], pivots[pivot + 1, 3]):
                value = entries[group, products[product, 0]]
                share = entries[group, products[product, 1]]
                changed = entries[group, products[product, 2]]
                for j in range(LANES):
                    changed[j] -= value[j] * (share[j] * inverse[j])
                entries[group, products[product, 2]] = changed
            if forces.shape[1] > 0:
                share = forces[group, pivots[pivot, 1]]
                for index in range(pivots[pivot, 2], pivots[pivot + 1, 2]):
                    value = entries[group, rows[index, 0]]
                    changed = forces[group, rows[index, 1]]
                    for j in range(LANES):
                        changed[j] -= value[j] * (share[j] * inverse[j])
                    forces[group, rows[index, 1]] = changed
        for j in range(LANES):
            is_stable[group, j] = stable[j] > zero

    return eliminate


def eliminated(
    shared: Elimination, coefficients: np.ndarray, loads: np.ndarray, kept: np.ndarray, of_kept: np.ndarray
) -> tuple[np.ndarray, np.ndarray, np.ndarray]:
    """Return entries and forces of structures after the elimination, and whether all pivots are above 0.

    Several threads may call this function at the same time.

    Args:
        shared: Data that all structures share.
        coefficients: Coefficients of the members [N/m], [N] and [N m], shape [structure, coefficient].
        loads: Loads on all displacements [N] and [N m], shape [structure, displacement]; without displacements: none.
        kept: Displacements whose forces are returned, shape [kept].
        of_kept: Entries that are returned, shape [kept, kept].
    """
    kernel, row = loaded(elimination_kernel()), wp.types.vector(length=CPU_LANES, dtype=wp.float64)
    count = len(coefficients)
    groups = -(-count // CPU_LANES)
    entries, is_stable = np.empty((groups, shared.constant.size, CPU_LANES)), np.empty((groups, CPU_LANES), dtype=bool)
    rows, forces = _in_lanes(coefficients), _in_lanes(loads)
    inputs = [wp.array(each, dtype=wp.dtype_from_numpy(each.dtype), device="cpu", copy=False) for each in shared]
    inputs += [wp.array(each, dtype=row, device="cpu", copy=False) for each in (rows, forces, entries)]
    inputs.append(wp.array(is_stable, dtype=wp.bool, device="cpu", copy=False))
    wp.launch(kernel, dim=groups, inputs=inputs, device="cpu")

    def by_structure(values: np.ndarray) -> np.ndarray:
        return np.moveaxis(values, -1, 1).reshape(groups * CPU_LANES, *values.shape[1:-1])[:count]

    return (
        by_structure(entries[:, of_kept]),
        by_structure(forces[:, kept] if forces.size else forces),
        is_stable.ravel()[:count],
    )


def _in_lanes(values: np.ndarray) -> np.ndarray:
    """Return values, shape [structure, value], in the shape [group of structures, value, lane].

    Lanes that are left over in the last group repeat the last structure.
    """
    count, size = values.shape
    found = np.empty((-(-count // CPU_LANES), size, CPU_LANES))
    whole = count // CPU_LANES
    found[:whole] = values[: whole * CPU_LANES].T.reshape(size, whole, CPU_LANES).swapaxes(0, 1)
    if whole < len(found):
        found[whole] = values[np.minimum(np.arange(whole * CPU_LANES, (whole + 1) * CPU_LANES), count - 1)].T
    return found
