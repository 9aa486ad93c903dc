"""Eigenvalues of damped structures whose undamped modes are known."""

from __future__ import annotations

import functools

import numpy as np
import warp as wp

from warpdyn.engine.device.processor import align_rows, module_options
from warpdyn.engine.kernels.build import CPU_LANES
from warpdyn.engine.kernels.kernel_cache import loaded
from warpdyn.engine.methods.state_matrices import state_eigenvalues
from warpdyn.engine.methods.undamped_modes import are_diagonal, squared_frequencies

ROUNDED = 1e-14  # change of an eigenvalue over its size, or damping between modes over that of modes
MOST_ITERATIONS = 12
MOST_IN_OTHERS = 0.5  # sum of the real and imaginary parts of amplitudes in other modes


@functools.cache
def coupled_modes_kernel() -> wp.Kernel:
    """Return the kernel for weakly coupled modes; a thread computes as many structures at once as there are lanes.

    The eigenvector of an underdamped mode is 1 in this mode and small in others. Its equations in the others give their
    amplitudes from the eigenvalue, and the equation in the mode gives the eigenvalue. Iteration converges by about the
    ratio of damping between modes to the difference of their frequencies. Eigenvectors with small amplitudes in other
    modes differ, so that no eigenvalue is found twice.
    """
    LANES = CPU_LANES
    double = wp.float64
    row = wp.types.vector(length=LANES, dtype=double)
    rounded = wp.constant(double(ROUNDED))
    most_in_others = wp.constant(double(MOST_IN_OTHERS))

    @wp.kernel(module="unique", enable_backward=False, module_options=module_options(max_unroll=1))
    def find_coupled_modes(
        squared: wp.array2d(dtype=double),  # [structure, mode]
        modal: wp.array3d(dtype=double),  # [structure, mode, mode]
        c: wp.array2d(dtype=row),  # modal damping of the lanes; threads of a CPU launch run one after the other
        real: wp.array(dtype=row),  # amplitudes in the modes
        imaginary: wp.array(dtype=row),
        eigenvalues: wp.array3d(dtype=double),  # [structure, mode, 2]; input: first estimates
        is_found: wp.array2d(dtype=wp.bool),  # [structure, mode]
    ):
        align_rows()
        first = wp.tid() * LANES
        last = squared.shape[0] - 1  # lanes that are left over repeat the last structure
        n = squared.shape[1]
        one, two, zero = double(1.0), double(2.0), double(0.0)
        x = row()
        y = row()
        p = row()
        q = row()
        w = row()
        found = row()
        going = row()
        others = row()
        for i in range(n):
            for k in range(n):
                for j in range(LANES):
                    w[j] = modal[wp.min(first + j, last), i, k]
                c[i, k] = w
        for mode in range(n):
            for j in range(LANES):
                x[j] = eigenvalues[wp.min(first + j, last), mode, 0]
                y[j] = eigenvalues[wp.min(first + j, last), mode, 1]
                going[j] = one
                found[j] = zero
            for k in range(n):
                for j in range(LANES):
                    p[j] = wp.where(k == mode, one, zero)
                    q[j] = zero
                real[k] = p
                imaginary[k] = q
            iteration = int(0)
            left = double(1.0)
            while left > zero and iteration < MOST_ITERATIONS:
                iteration += 1
                for j in range(LANES):
                    others[j] = zero
                for back in range(n):
                    k = wp.where(back < n - 1, wp.where(back < mode, back, back + 1), mode)  # the mode is the last one
                    for j in range(LANES):
                        p[j] = zero
                        q[j] = zero
                    for m in range(n):
                        if m != k:
                            w = c[m, k]
                            u = real[m]
                            v = imaginary[m]
                            for j in range(LANES):
                                p[j] += w[j] * u[j]
                                q[j] += w[j] * v[j]
                    w = c[k, k]
                    if k != mode:
                        u = real[k]
                        v = imaginary[k]
                        for j in range(LANES):
                            # -x / (x (x + c) + w^2), times the sum, with the eigenvalue x
                            square = squared[wp.min(first + j, last), k]
                            below = x[j] * (x[j] + w[j]) - y[j] * y[j] + square
                            beside = y[j] * (two * x[j] + w[j])
                            size = below * below + beside * beside
                            factor = -(x[j] * below + y[j] * beside) / size
                            turn = -(y[j] * below - x[j] * beside) / size
                            u[j] = factor * p[j] - turn * q[j]
                            v[j] = factor * q[j] + turn * p[j]
                            others[j] += wp.abs(u[j]) + wp.abs(v[j])
                        real[k] = u
                        imaginary[k] = v
                    else:
                        for j in range(LANES):
                            # x = -r + i sqrt(w^2 - r^2); r: half of the damping in the mode and of the others on it
                            rate = (w[j] + p[j]) / two
                            turn = q[j] / two
                            square = squared[wp.min(first + j, last), k] - rate * rate + turn * turn
                            beside = -two * rate * turn
                            size = wp.sqrt(square * square + beside * beside)
                            root = wp.sqrt((wp.abs(square) + size) / two)
                            other = wp.abs(beside) / (two * root)
                            towards = wp.where(square >= zero, root, other)
                            across = wp.where(beside < zero, -one, one) * wp.where(square >= zero, other, root)
                            new_x = -rate - across
                            new_y = towards - turn
                            moved_x, moved_y = new_x - x[j], new_y - y[j]
                            change = moved_x * moved_x + moved_y * moved_y
                            is_done = change <= rounded * rounded * (new_x * new_x + new_y * new_y)
                            is_small = others[j] < most_in_others
                            is_on = going[j] > zero
                            x[j] = wp.where(is_on, new_x, x[j])
                            y[j] = wp.where(is_on, new_y, y[j])
                            found[j] = wp.where(is_on and is_done and is_small, one, found[j])
                            going[j] = wp.where(is_done or not is_small, zero, going[j])
                left = zero
                for j in range(LANES):
                    left += going[j]
            for j in range(LANES):
                if first + j <= last:
                    eigenvalues[first + j, mode, 0] = x[j]
                    eigenvalues[first + j, mode, 1] = y[j]
                    is_found[first + j, mode] = found[j] > zero

    return find_coupled_modes


def damped_motions(
    mass: np.ndarray, damping: np.ndarray, stiffness: np.ndarray, squared: np.ndarray, shapes: np.ndarray
) -> tuple[np.ndarray, np.ndarray]:
    """Return the results of `state_eigenvalues` and `highest_damping_rate` for structures whose modes are known.

    Args:
        mass: Mass matrices [kg], shape [structure, dof, dof].
        damping: Damping matrices [N s/m], symmetric and not negative, shape [structure, dof, dof].
        stiffness: Stiffness matrices [N/m], shape [structure, dof, dof].
        squared: Squared circular frequencies w^2 without damping [rad2/s2], not negative, shape [structure, mode]; 0
            for a motion without resistance, or that grows.
        shapes: Modes of unit modal mass, shape [structure, dof, mode].
    """
    modal = shapes.transpose(0, 2, 1) @ damping @ shapes
    found, is_found = _of_modes(squared, modal)
    if not is_found.all():
        found[~is_found] = state_eigenvalues(*(each[~is_found] for each in (mass, damping, stiffness)))
    return found, damping_rate(mass, damping, modal)


def damping_rate(mass: np.ndarray, damping: np.ndarray, modal: np.ndarray | None = None) -> np.ndarray:
    """Return the result of `highest_damping_rate` for symmetric damping matrices.

    Args:
        mass: Mass matrices [kg], shape [structure, dof, dof].
        damping: Damping matrices [N s/m], symmetric and not negative, shape [structure, dof, dof].
        modal: Damping matrices in modes of unit modal mass [1/s]; None if the modes are not known.
    """
    rate = (np.einsum("sii->si", damping) / np.einsum("sii->si", mass)).max(axis=1)
    others = np.flatnonzero(~(are_diagonal(damping) & are_diagonal(mass)))
    if others.size and modal is None:
        rate[others] = squared_frequencies(mass[others], damping[others])[:, -1]
    elif others.size:
        rate[others] = np.linalg.eigvalsh(modal[others])[:, -1]
    return np.maximum(rate, 0.0)


def _of_modes(squared: np.ndarray, modal: np.ndarray) -> tuple[np.ndarray, np.ndarray]:
    """Return eigenvalues of damped modes [1/s], and in which structures they are all found.

    If damping does not couple modes, the eigenvalues of a mode are the roots of x^2 + c x + w^2. If it couples them
    weakly, they are the first estimates of the kernel.

    Args:
        squared: Squared circular frequencies w^2 without damping [rad2/s2], shape [structure, mode].
        modal: Modal damping matrices [1/s], shape [structure, mode, mode].
    """
    own = np.maximum(np.einsum("sii->si", modal), 0.0)
    between = np.abs(modal)
    np.einsum("sii->si", between)[...] = 0.0
    fast = -own / 2 - np.sqrt((own**2 / 4 - squared).astype(np.complex128))
    slow = np.divide(squared, fast, out=np.zeros_like(fast), where=fast != 0)
    is_found = (between.max(axis=(1, 2)) <= ROUNDED * own.max(axis=1)) & (squared > 0).all(axis=1)
    left = np.flatnonzero(~is_found & (own**2 < 4 * squared).all(axis=1))
    if left.size:
        slow[left], is_found[left] = _of_coupled_modes(squared[left], modal[left], slow[left])
        fast[left] = slow[left].conj()
    return np.concatenate([fast, slow], axis=1), is_found


def _of_coupled_modes(squared: np.ndarray, modal: np.ndarray, estimates: np.ndarray) -> tuple[np.ndarray, np.ndarray]:
    """Return the eigenvalues of weakly coupled modes [1/s], and in which structures they are all found.

    Args:
        squared: Squared circular frequencies without damping [rad2/s2], shape [structure, mode].
        modal: Modal damping matrices [1/s], shape [structure, mode, mode].
        estimates: First estimates of the eigenvalues with a positive imaginary part, shape [structure, mode].
    """
    kernel, row = loaded(coupled_modes_kernel()), wp.types.vector(length=CPU_LANES, dtype=wp.float64)
    count, size = squared.shape
    found = estimates.copy()
    is_found = np.empty((count, size), dtype=bool)
    given = [np.ascontiguousarray(each, dtype=np.float64) for each in (squared, modal)]
    work = [np.empty((*shape, CPU_LANES)) for shape in ((size, size), (size,), (size,))]
    inputs = [wp.array(each, device="cpu", copy=False) for each in given]
    inputs += [wp.array(each, dtype=row, device="cpu", copy=False) for each in work]
    inputs.append(wp.array(found.view(np.float64).reshape(count, size, 2), device="cpu", copy=False))
    inputs.append(wp.array(is_found, dtype=wp.bool, device="cpu", copy=False))
    wp.launch(kernel, dim=-(-count // CPU_LANES), inputs=inputs, device="cpu")
    return found, is_found.all(axis=1)
