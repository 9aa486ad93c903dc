"""Eigenvalues and eigenvectors of many small symmetric matrices on a CPU.

Householder reflections make a matrix tridiagonal, and the QL algorithm with implicit shifts makes it diagonal (Bowdler,
Martin, Reinsch and Wilkinson 1968, The QR and QL algorithms for symmetric matrices, Numerische Mathematik 11, 293-306).
LAPACK handles one matrix after the other and takes 2.7 times as long for 10 rows (2 cores with 256-bit registers).
"""

from __future__ import annotations

import functools

import numpy as np
import warp as wp

from warpdyn.engine.device.processor import align_rows, module_options
from warpdyn.engine.kernels.build import CPU_LANES
from warpdyn.engine.kernels.kernel_cache import loaded

MOST_ROWS = 32  # LAPACK is faster for larger matrices
MOST_ITERATIONS = 60  # an eigenvalue needs about 2


@functools.cache
def eigenvalues_kernel() -> wp.Kernel:
    """Return the kernel; a thread computes as many matrices at once as there are lanes."""
    LANES = CPU_LANES
    double = wp.float64
    row = wp.types.vector(length=LANES, dtype=double)
    rounding = wp.constant(double(np.finfo(float).eps / 2))

    @wp.kernel(module="unique", enable_backward=False, module_options=module_options(max_unroll=1))
    def find_eigenvalues(
        matrices: wp.array3d(dtype=double),  # [matrix, row, column]
        a: wp.array2d(dtype=row),  # the matrices of the lanes; threads of a CPU launch run one after the other
        z: wp.array2d(dtype=row),  # their eigenvectors, [row, number]
        d: wp.array(dtype=row),  # diagonal, and at the end eigenvalues
        e: wp.array(dtype=row),  # off-diagonal entries of the tridiagonal matrix
        v: wp.array(dtype=row),  # vector of a reflection
        w: wp.array(dtype=row),
        values: wp.array2d(dtype=double),  # [matrix, number], increasing
        vectors: wp.array3d(dtype=double),  # [matrix, row, number]
    ):
        align_rows()
        first = wp.tid() * LANES
        last = matrices.shape[0] - 1  # lanes that are left over repeat the last matrix
        n = matrices.shape[1]
        one, two, zero = double(1.0), double(2.0), double(0.0)
        x = row()
        y = row()
        total = row()
        beta = row()
        c = row()
        s = row()
        p = row()
        g = row()
        end = row()
        for i in range(n):
            for k in range(n):
                for j in range(LANES):
                    x[j] = matrices[wp.min(first + j, last), i, k]
                    y[j] = wp.where(i == k, one, zero)
                a[i, k] = x
                z[i, k] = y
        for k in range(n - 1):
            d[k] = a[k, k]
            for j in range(LANES):
                total[j] = zero
            for i in range(k + 1, n):
                x = a[i, k]
                v[i] = x
                for j in range(LANES):
                    total[j] += x[j] * x[j]
            x = v[k + 1]
            for j in range(LANES):
                length = wp.sqrt(total[j])
                y[j] = wp.where(x[j] > zero, -length, length)
                square = two * (total[j] - x[j] * y[j])
                beta[j] = wp.where(square > zero, two / square, zero)
                x[j] -= y[j]
            e[k] = y
            v[k + 1] = x
            for j in range(LANES):
                c[j] = zero
            for i in range(k + 1, n):
                for j in range(LANES):
                    total[j] = zero
                for m in range(k + 1, n):
                    x = a[i, m]
                    y = v[m]
                    for j in range(LANES):
                        total[j] += x[j] * y[j]
                x = v[i]
                for j in range(LANES):
                    total[j] *= beta[j]
                    c[j] += total[j] * x[j]
                w[i] = total
            for i in range(k + 1, n):
                x = v[i]
                y = w[i]
                for j in range(LANES):
                    y[j] -= beta[j] / two * c[j] * x[j]
                w[i] = y
            for i in range(k + 1, n):
                x = v[i]
                y = w[i]
                for m in range(k + 1, n):
                    total = a[i, m]
                    s = v[m]
                    p = w[m]
                    for j in range(LANES):
                        total[j] -= x[j] * p[j] + y[j] * s[j]
                    a[i, m] = total
            for i in range(n):
                for j in range(LANES):
                    total[j] = zero
                for m in range(k + 1, n):
                    x = z[i, m]
                    y = v[m]
                    for j in range(LANES):
                        total[j] += x[j] * y[j]
                for m in range(k + 1, n):
                    x = z[i, m]
                    y = v[m]
                    for j in range(LANES):
                        x[j] -= beta[j] * total[j] * y[j]
                    z[i, m] = x
        d[n - 1] = a[n - 1, n - 1]
        for j in range(LANES):
            x[j] = zero
        e[n - 1] = x
        for least in range(n):
            going = double(1.0)
            iteration = int(0)
            while going > zero and iteration < MOST_ITERATIONS:
                iteration += 1
                # `end`: the first negligible off-diagonal entry of each lane from `least` on.
                for j in range(LANES):
                    end[j] = double(n - 1)
                for back in range(n - 1 - least):
                    i = n - 2 - back
                    x = d[i]
                    y = d[i + 1]
                    total = e[i]
                    for j in range(LANES):
                        is_small = wp.abs(total[j]) <= rounding * (wp.abs(x[j]) + wp.abs(y[j]))
                        end[j] = wp.where(is_small, double(i), end[j])
                going = zero
                highest = int(0)
                for j in range(LANES):
                    going += end[j] - double(least)
                    highest = wp.max(highest, int(end[j]))
                if going > zero:
                    x = d[least]
                    y = d[least + 1]
                    total = e[least]
                    for j in range(LANES):
                        # Wilkinson's shift
                        half = (y[j] - x[j]) / (two * wp.where(total[j] == zero, one, total[j]))
                        root = wp.sqrt(half * half + one)
                        g[j] = total[j] / (half + wp.where(half < zero, -root, root)) - x[j]
                        s[j] = one
                        c[j] = one
                        p[j] = zero
                    for i in range(least + 1, highest + 1):
                        x = d[i]
                        for j in range(LANES):
                            g[j] = wp.where(double(i) == end[j], g[j] + x[j], g[j])
                    for back in range(highest - least):
                        i = highest - 1 - back
                        lower = e[i]
                        upper = e[i + 1]
                        x = d[i]
                        y = d[i + 1]
                        for j in range(LANES):
                            is_on = double(i) < end[j]
                            f = s[j] * lower[j]
                            b = c[j] * lower[j]
                            size = wp.sqrt(f * f + g[j] * g[j])
                            divisor = wp.where(size > zero, size, one)
                            sine = f / divisor
                            cosine = wp.where(size > zero, g[j] / divisor, one)
                            rest = y[j] - p[j]
                            turned = (x[j] - rest) * sine + two * cosine * b
                            upper[j] = wp.where(is_on, wp.where(double(i + 1) < end[j], size, zero), upper[j])
                            y[j] = wp.where(is_on, rest + sine * turned, y[j])
                            p[j] = wp.where(is_on, sine * turned, p[j])
                            g[j] = wp.where(is_on, cosine * turned - b, g[j])
                            s[j] = wp.where(is_on, sine, s[j])
                            c[j] = wp.where(is_on, cosine, c[j])
                            total[j] = wp.where(is_on, sine, zero)
                            beta[j] = wp.where(is_on, cosine, one)
                        e[i + 1] = upper
                        d[i + 1] = y
                        for k in range(n):
                            x = z[k, i]
                            y = z[k, i + 1]
                            lower = x
                            for j in range(LANES):
                                x[j] = beta[j] * lower[j] - total[j] * y[j]
                                y[j] = total[j] * lower[j] + beta[j] * y[j]
                            z[k, i] = x
                            z[k, i + 1] = y
                    x = d[least]
                    y = e[least]
                    for j in range(LANES):
                        is_on = double(least) < end[j]
                        x[j] = wp.where(is_on, x[j] - p[j], x[j])
                        y[j] = wp.where(is_on, g[j], y[j])
                    d[least] = x
                    e[least] = y
        for i in range(n):
            x = d[i]
            for j in range(LANES):
                total[j] = zero
            for k in range(n):
                y = d[k]
                for j in range(LANES):
                    is_before = y[j] < x[j] or (y[j] == x[j] and k < i)
                    total[j] += wp.where(is_before, one, zero)
            for j in range(LANES):
                if first + j <= last:
                    number = int(total[j])
                    values[first + j, number] = x[j]
                    for k in range(n):
                        y = z[k, i]
                        vectors[first + j, k, number] = y[j]

    return find_eigenvalues


def eigenvectors(matrices: np.ndarray) -> tuple[np.ndarray, np.ndarray]:
    """Return the eigenvalues, increasing, and the eigenvectors of symmetric matrices, as np.linalg.eigh.

    Several threads may call this function at the same time. No bit of a result depends on the other matrices.

    Args:
        matrices: Finite symmetric matrices, shape [matrix, row, row].

    Returns:
        Eigenvalues, shape [matrix, number]; eigenvectors, shape [matrix, row, number].
    """
    if matrices.shape[1] > MOST_ROWS:
        return np.linalg.eigh(matrices)
    kernel, row = loaded(eigenvalues_kernel()), wp.types.vector(length=CPU_LANES, dtype=wp.float64)
    count, size = matrices.shape[:2]
    matrices = np.ascontiguousarray(matrices, dtype=np.float64)
    values, vectors = np.empty((count, size)), np.empty((count, size, size))
    work = [np.empty((*shape, CPU_LANES)) for shape in ((size, size), (size, size), (size,), (size,), (size,), (size,))]
    inputs = [wp.array(matrices, device="cpu", copy=False)]
    inputs += [wp.array(each, dtype=row, device="cpu", copy=False) for each in work]
    inputs += [wp.array(each, device="cpu", copy=False) for each in (values, vectors)]
    wp.launch(kernel, dim=-(-count // CPU_LANES), inputs=inputs, device="cpu")
    return values, vectors
