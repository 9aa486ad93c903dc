"""Undamped natural circular frequencies of shear chains; even the lowest frequency is accurate to the last digits.

M^-1/2 K M^-1/2 is factored as U U^T with a bidiagonal U: u_ii^2 = k_i / m_i and u_i,i+1^2 = k_i+1 / m_i. The algorithm
does not subtract one stiffness from another. The differential quotient-difference algorithm with shifts keeps this
accuracy (Fernando and Parlett 1994, Accurate singular values and differential qd algorithms, Numerische Mathematik 67,
191-229); its shifts are Laguerre's lower bounds of the least eigenvalue (von Matt 1997, The orthogonal qd-algorithm,
SIAM Journal on Scientific Computing 18, 1163-1186).
"""

import functools

import numpy as np
import warp as wp

from warpdyn.engine.device.processor import align_rows, module_options
from warpdyn.engine.kernels.arguments import lane_rows
from warpdyn.engine.kernels.kernel_cache import block_size, loaded
from warpdyn.engine.tracing.arrays import is_traced
from warpdyn.engine.tracing.requests import FREQUENCIES, request

# Number of chains per CPU thread (lanes). Each division waits for the result of the last one; more lanes than fit in
# the registers were measured to be faster.
LANES_OF_CHAINS = 64
MOST_ITERATIONS = 200  # an eigenvalue needs about 3, and a few more if several eigenvalues are nearly equal
# Kernels are compiled for at most 4, 16, 64, ... storeys, not for each number of storeys: a city may contain buildings
# with ten different numbers of storeys, and each kernel needs 0.5 s to compile.
FEWEST_STOREYS, STOREYS_GROW_BY = 4, 4


def most_storeys(storeys: int) -> int:
    """Return the largest number of storeys of the kernel that is used for chains of `storeys` storeys."""
    most = FEWEST_STOREYS
    while most < storeys:
        most *= STOREYS_GROW_BY
    return most


@functools.cache
def frequencies_kernel(most: int, lanes: int) -> wp.Kernel:
    """Return the kernel for natural frequencies of chains of at most `most` storeys, with `lanes` chains per thread."""
    LANES = lanes
    double = wp.float64
    matrix = wp.types.matrix(shape=(most, LANES), dtype=double)
    row = wp.types.vector(length=LANES, dtype=double)
    # Three constants: the coupling of two eigenvalues, relative to their size, that is neglected; the least value of a
    # divisor, relative to the eigenvalue; and the fraction of a bound that shifts omit because of rounding.
    left = wp.constant(double(np.finfo(float).eps ** 2 / 16))
    least = wp.constant(double(1e-30))
    rounding = wp.constant(double(8 * np.finfo(float).eps))

    @wp.kernel(module="unique", enable_backward=False, module_options=module_options(max_unroll=1))
    def find_frequencies(
        storeys: int,
        mass: wp.array2d(dtype=double),  # [storey, structure]; as many structures as threads have lanes
        stiffness: wp.array2d(dtype=double),
        frequency: wp.array2d(dtype=double),  # [mode, structure]
    ):
        align_rows()
        first = wp.tid() * LANES
        q = matrix()  # squares of U's diagonal, and of the entries above it
        e = matrix()
        shifted = row()  # sum of the shifts so far
        goes_on = row()
        u = row()
        w = row()
        s1 = row()
        s2 = row()
        d = row()
        shift = row()
        floor = row()
        one, two, zero = double(1.0), double(2.0), double(0.0)
        short = one - rounding * double(storeys)
        for i in range(storeys):
            for j in range(LANES):
                inverse = one / mass[i, first + j]
                q[i, j] = stiffness[i, first + j] * inverse
                if i < storeys - 1:
                    e[i, j] = stiffness[i + 1, first + j] * inverse
        last = storeys - 1
        iteration = int(0)
        while last > 0:
            going = double(0.0)
            for j in range(LANES):
                size = shifted[j] + q[last, j]
                rest = e[last - 1, j]
                goes_on[j] = wp.where(rest * (rest + q[last, j]) > left * size * size, one, zero)
                going += goes_on[j]
            iteration += 1
            if going == zero or iteration == MOST_ITERATIONS:
                for j in range(LANES):
                    q[last, j] = wp.where(goes_on[j] > zero, double(wp.nan), shifted[j] + q[last, j])
                last -= 1
                iteration = int(0)
            else:
                # Sums of the inverse eigenvalues and of their squares, as derivatives of the determinant's pivots.
                for j in range(LANES):
                    u[j] = one
                    w[j] = zero
                    d[j] = one / q[last, j]
                    s1[j] = d[j]
                    s2[j] = d[j] * d[j]
                for back in range(last):
                    i = last - 1 - back
                    for j in range(LANES):
                        ratio = e[i, j] * d[j]
                        w[j] = ratio * (w[j] + two * u[j] * u[j] * d[j])
                        u[j] = one + ratio * u[j]
                        d[j] = one / q[i, j]
                        term = u[j] * d[j]
                        s1[j] += term
                        s2[j] += term * term + w[j] * d[j]
                n = double(last + 1)
                for j in range(LANES):
                    spread = wp.max((n - one) * (n * s2[j] - s1[j] * s1[j]), zero)
                    shift[j] = short * n / (s1[j] + wp.sqrt(spread))
                    floor[j] = least * (shifted[j] + shift[j])
                    d[j] = wp.max(q[0, j] - shift[j], floor[j])
                    # Each lane stops its own iteration, so that the result of a chain does not depend on the others.
                    shifted[j] += goes_on[j] * shift[j]
                for i in range(last):
                    for j in range(LANES):
                        new = d[j] + e[i, j]
                        ratio = q[i + 1, j] / new
                        d[j] = wp.max(d[j] * ratio - shift[j], floor[j])
                        e[i, j] = wp.where(goes_on[j] > zero, e[i, j] * ratio, e[i, j])
                        q[i, j] = wp.where(goes_on[j] > zero, new, q[i, j])
                for j in range(LANES):
                    q[last, j] = wp.where(goes_on[j] > zero, d[j], q[last, j])
        for j in range(LANES):
            q[0, j] += shifted[j]
        # The least eigenvalue was found first, except for eigenvalues that were never coupled with the others.
        for sorted in range(storeys - 1):
            for i in range(storeys - 1 - sorted):
                for j in range(LANES):
                    lower = wp.min(q[i, j], q[i + 1, j])
                    q[i, j] = wp.max(q[i, j], q[i + 1, j])
                    q[i + 1, j] = lower
        for i in range(storeys):
            for j in range(LANES):
                frequency[i, first + j] = wp.sqrt(q[storeys - 1 - i, j])

    return find_frequencies


def launch_frequencies(mass: wp.array, stiffness: wp.array, frequency: wp.array, device: str) -> None:
    """Queue the kernel for natural frequencies on the present stream of a device, with one chain per thread.

    Args:
        mass: Floor masses [kg], shape [storey, structure].
        stiffness: Storey stiffness [N/m], shape [storey, structure].
        frequency: Output: circular frequencies [rad/s], ascending, shape [mode, structure].
        device: Device of the arrays.
    """
    storeys, count = mass.shape
    kernel = loaded(frequencies_kernel(most_storeys(storeys), 1), device)
    inputs = [storeys, mass, stiffness, frequency]
    wp.launch(kernel, dim=count, inputs=inputs, device=device, block_dim=block_size(device))


def circular_frequencies(mass: np.ndarray, stiffness: np.ndarray) -> np.ndarray:
    """Return the natural circular frequencies of many shear chains.

    Args:
        mass: Floor masses [kg], above 0, shape [structure, storey].
        stiffness: Storey stiffness [N/m], above 0, shape [structure, storey].

    Returns:
        Circular frequencies [rad/s], ascending, shape [structure, mode], in Fortran order.
    """
    if is_traced(mass, stiffness):
        return request(FREQUENCIES, mass.shape[1], mass, stiffness)  # type: ignore[return-value] # used as an array
    structures, storeys = mass.shape
    arrays = [lane_rows(storeys, structures, LANES_OF_CHAINS, 1.0) for _ in range(3)]
    for array, values in zip(arrays, (mass, stiffness), strict=False):
        array[:, :structures] = values.T
    inputs = [wp.array(array, copy=False, device="cpu") for array in arrays]
    kernel, threads = frequencies_kernel(most_storeys(storeys), LANES_OF_CHAINS), -(-structures // LANES_OF_CHAINS)
    wp.launch(loaded(kernel), dim=threads, inputs=[storeys, *inputs], device="cpu")
    return arrays[2][:, :structures].T
