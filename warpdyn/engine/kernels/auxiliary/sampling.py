"""Kernels that draw the random numbers of structures: uniform numbers, and correlated normal numbers."""

import functools

import numpy as np
import warp as wp

from warpdyn.engine.device.processor import align_rows, module_options
from warpdyn.engine.device.random_numbers import normal_of, uniform_pair
from warpdyn.engine.kernels.build import CPU_LANES
from warpdyn.engine.kernels.kernel_cache import loaded
from warpdyn.foundations.core.random_numbers import Purpose, key_of


@functools.cache
def uniforms_kernel(lanes: int) -> wp.Kernel:
    """Return the kernel that draws uniform random numbers, for `lanes` structures per thread."""
    LANES = lanes
    row = wp.types.vector(length=LANES, dtype=wp.float64)
    Numbers = wp.types.vector(length=LANES, dtype=wp.uint64)

    @wp.kernel(module="unique", enable_backward=False, module_options=module_options(max_unroll=1))
    def draw_uniforms(
        key: wp.uint64,
        purpose: int,
        number: wp.array(dtype=wp.uint64),  # index of each structure
        values: wp.array2d(dtype=wp.float64),  # [variable, structure]
    ):
        align_rows()
        first = wp.tid() * LANES
        numbers = Numbers()
        ones = row()
        others = row()
        for j in range(LANES):
            numbers[j] = number[first + j]
        variables = values.shape[0]
        for pair in range((variables + 1) // 2):
            for j in range(LANES):
                drawn = uniform_pair(key, numbers[j], purpose, wp.uint32(pair))
                ones[j] = drawn[0]
                others[j] = drawn[1]
            for j in range(LANES):
                values[2 * pair, first + j] = ones[j]
            if 2 * pair + 1 < variables:
                for j in range(LANES):
                    values[2 * pair + 1, first + j] = others[j]

    return draw_uniforms


@functools.cache
def normals_kernel(lanes: int) -> wp.Kernel:
    """Return the kernel that converts uniform into correlated normal numbers, for `lanes` structures per thread."""
    LANES = lanes
    row = wp.types.vector(length=LANES, dtype=wp.float64)

    @wp.kernel(module="unique", enable_backward=False, module_options=module_options(max_unroll=1))
    def make_normals(
        # Lower triangular factor of the correlation matrix: first entry of each row, and columns and values of entries.
        starts: wp.array(dtype=wp.int32),
        columns: wp.array(dtype=wp.int32),
        factor: wp.array(dtype=wp.float64),
        values: wp.array2d(dtype=row),  # [variable, group of structures]
    ):
        align_rows()
        group = wp.tid()
        total = row()
        variables = values.shape[0]
        for variable in range(variables):
            normal = values[variable, group]
            for j in range(LANES):
                normal[j] = normal_of(normal[j])
            values[variable, group] = normal
        # Each variable is a sum over the earlier ones, so the last one is replaced first.
        for back in range(variables):
            variable = variables - 1 - back
            for j in range(LANES):
                total[j] = wp.float64(0.0)
            for entry in range(starts[variable], starts[variable + 1]):
                share = factor[entry]
                one = values[columns[entry], group]
                for j in range(LANES):
                    total[j] += share * one[j]
            values[variable, group] = total

    return make_normals


def fill_uniforms(values: np.ndarray, seed: int, numbers: np.ndarray) -> None:
    """Draw uniform random numbers of structures, equal to those of `warpdyn.foundations.core.random_numbers`.

    Args:
        values: Output: numbers in (0, 1), shape [variable, structure]; an array from `lane_rows`.
        seed: Seed of the run.
        numbers: Indices of the structures in the run, shape [structure].
    """
    padded = np.zeros(values.shape[1], np.uint64)
    padded[: numbers.size] = numbers
    number, into = (wp.array(array, copy=False, device="cpu") for array in (padded, values))
    arguments = [key_of(seed), int(Purpose.STRUCTURE), number, into]
    wp.launch(loaded(uniforms_kernel(CPU_LANES)), dim=into.shape[1] // CPU_LANES, inputs=arguments, device="cpu")


def entries_of(factor: np.ndarray) -> tuple[np.ndarray, ...]:
    """Return the entries of a matrix that are not 0, row by row.

    Returns:
        First entry of each row and, at the end, the number of entries; columns of the entries; their values.
    """
    rows, columns = np.nonzero(factor)
    starts = np.searchsorted(rows, np.arange(len(factor) + 1))
    return starts.astype(np.int32), columns.astype(np.int32), factor[rows, columns]


def correlate_normals(values: np.ndarray, factor: tuple[np.ndarray, ...]) -> None:
    """Replace uniform by correlated standard normal random numbers, by the inverse of the distribution function.

    Args:
        values: Input: independent numbers in (0, 1). Output: normal numbers. Shape [variable, structure]; an array from
            `lane_rows`.
        factor: Result of `entries_of` for the lower triangular factor of the correlation matrix.
    """
    arrays = [wp.array(array, copy=False, device="cpu") for array in factor]
    groups, row = values.reshape(len(values), -1, CPU_LANES), wp.types.vector(length=CPU_LANES, dtype=wp.float64)
    arrays.append(wp.array(groups, dtype=row, copy=False, device="cpu"))
    wp.launch(loaded(normals_kernel(CPU_LANES)), dim=groups.shape[1], inputs=arrays, device="cpu")
