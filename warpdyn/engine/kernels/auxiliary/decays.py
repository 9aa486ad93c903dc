"""Slowest rate of decay of the free vibration of damped shear chains, whose dashpots may couple the undamped modes.

The state of a storey is sqrt(k) times its drift, and sqrt(m) times the velocity of its floor. The state matrix is then
skew-symmetric except for the dashpots, and its eigenvalues lose fewer digits than those of the matrix [[0, I], [-M^-1
K, -M^-1 C]]. Rotations reduce the state matrix to Hessenberg form. Francis' double shifts find its eigenvalues (Golub
and Van Loan 2013, Matrix Computations, section 7.5).
"""

import numpy as np
import warp as wp

from warpdyn.engine.device.processor import module_options
from warpdyn.engine.kernels.kernel_cache import block_size, loaded
from warpdyn.engine.tracing.arrays import is_traced
from warpdyn.engine.tracing.requests import DECAY, request

MOST_ITERATIONS = 100  # a pair of eigenvalues needs about 3
UNUSUAL_SHIFT_EVERY = 10  # iterations after which shifts that do not converge are replaced
NUMBERS_AT_A_TIME = 2**24  # largest total number of matrix elements of one kernel launch
# The distance in memory between the elements of a matrix is an odd multiple of LANES numbers. If it were a power of 2,
# the elements would displace each other in the cache of a CPU.
LANES = 32
EPSILON = float(np.finfo(float).eps)


@wp.func
def with_sign(size: wp.float64, of: wp.float64):
    return wp.where(of < wp.float64(0.0), -wp.abs(size), wp.abs(size))


@wp.func
def fill_state_matrix(
    a: wp.array3d(dtype=wp.float64),
    s: int,
    c: int,
    mass: wp.array2d(dtype=wp.float64),
    stiffness: wp.array2d(dtype=wp.float64),
    of_mass: wp.float64,
    dashpot: wp.array2d(dtype=wp.float64),
):
    """Write the state matrix of shear chain c into a[:, :, s]; rows: drift 1, velocity 1, drift 2, velocity 2, ..."""
    size = a.shape[0]
    for i in range(size):
        for j in range(size):
            a[i, j, s] = wp.float64(0.0)
    for storey in range(size / 2):
        drift = 2 * storey
        here = mass[storey, c]
        rate = wp.sqrt(stiffness[storey, c] / here)
        a[drift, drift + 1, s] = rate
        a[drift + 1, drift, s] = -rate
        a[drift + 1, drift + 1, s] = -of_mass - dashpot[storey, c] / here
        if storey > 0:
            below = mass[storey - 1, c]
            rate = wp.sqrt(stiffness[storey, c] / below)
            a[drift, drift - 1, s] = -rate
            a[drift - 1, drift, s] = rate
            coupling = dashpot[storey, c] / wp.sqrt(here * below)
            a[drift - 1, drift - 1, s] = a[drift - 1, drift - 1, s] - dashpot[storey, c] / below
            a[drift - 1, drift + 1, s] = coupling
            a[drift + 1, drift - 1, s] = coupling


@wp.func
def reduce_to_hessenberg(a: wp.array3d(dtype=wp.float64), s: int):
    """Reduce the matrix a[:, :, s] to Hessenberg form by rotations: entries below the first subdiagonal become zero."""
    size = a.shape[0]
    for column in range(size - 2):
        for back in range(size - 2 - column):
            row = size - 1 - back
            lower = a[row, column, s]
            if lower != wp.float64(0.0):
                upper = a[row - 1, column, s]
                length = wp.sqrt(upper * upper + lower * lower)
                cosine = upper / length
                sine = lower / length
                for j in range(column, size):
                    above = a[row - 1, j, s]  # separately: a pair would refer to the array
                    below = a[row, j, s]
                    a[row - 1, j, s] = cosine * above + sine * below
                    a[row, j, s] = cosine * below - sine * above
                for i in range(size):
                    left = a[i, row - 1, s]
                    right = a[i, row, s]
                    a[i, row - 1, s] = cosine * left + sine * right
                    a[i, row, s] = cosine * right - sine * left
                a[row, column, s] = wp.float64(0.0)


@wp.func
def start_of_block(a: wp.array3d(dtype=wp.float64), s: int, last: int):
    """Return the first row of the diagonal block of a[:, :, s] that ends at row `last`.

    Rows of a block are coupled by subdiagonal entries that are not negligible.
    """
    first = int(last)
    searching = bool(last > 0)
    while searching:
        around = wp.abs(a[first - 1, first - 1, s]) + wp.abs(a[first, first, s])
        if around == wp.float64(0.0):
            for k in range(last + 1):
                if k > 0:
                    around = wp.max(around, wp.abs(a[k, k - 1, s]))
        if wp.abs(a[first, first - 1, s]) <= wp.float64(EPSILON) * around:
            a[first, first - 1, s] = wp.float64(0.0)
            searching = False
        else:
            first -= 1
            searching = first > 0
    return first


@wp.func
def shift_twice(
    a: wp.array3d(dtype=wp.float64),
    s: int,
    first: int,
    last: int,
    x0: wp.float64,
    y0: wp.float64,
    w0: wp.float64,
):
    """Apply a double QR step to rows `first` to `last` of a[:, :, s].

    The two shifts are the eigenvalues of [[y0, w0], [1, x0]].
    """
    zero = wp.float64(0.0)
    p, q, r = wp.float64(0.0), wp.float64(0.0), wp.float64(0.0)
    m = int(last - 2)
    searching = bool(True)
    while searching:
        z = a[m, m, s]
        xz = x0 - z
        yz = y0 - z
        p = (xz * yz - w0) / a[m + 1, m, s] + a[m, m + 1, s]
        q = a[m + 1, m + 1, s] - z - xz - yz
        r = a[m + 2, m + 1, s]
        sum_of = wp.abs(p) + wp.abs(q) + wp.abs(r)
        p = p / sum_of
        q = q / sum_of
        r = r / sum_of
        searching = m > first
        if searching:
            u = wp.abs(a[m, m - 1, s]) * (wp.abs(q) + wp.abs(r))
            v = wp.abs(p) * (wp.abs(a[m - 1, m - 1, s]) + wp.abs(z) + wp.abs(a[m + 1, m + 1, s]))
            if u <= wp.float64(EPSILON) * v:
                searching = False
            else:
                m -= 1
    for i in range(m + 2, last + 1):
        a[i, i - 2, s] = zero
        if i > m + 2:
            a[i, i - 3, s] = zero
    for k in range(m, last):
        size = wp.float64(1.0)
        if k > m:
            p = a[k, k - 1, s]
            q = a[k + 1, k - 1, s]
            r = zero
            if k < last - 1:
                r = a[k + 2, k - 1, s]
            size = wp.abs(p) + wp.abs(q) + wp.abs(r)
            if size > zero:
                p = p / size
                q = q / size
                r = r / size
        length = with_sign(wp.sqrt(p * p + q * q + r * r), p)
        if size > zero and length != zero:
            if k > m:
                a[k, k - 1, s] = -length * size
            elif first < m:
                a[k, k - 1, s] = -a[k, k - 1, s]
            p = p + length
            x = p / length
            y = q / length
            z = r / length
            q = q / p
            r = r / p
            for j in range(k, last + 1):
                above = a[k, j, s] + q * a[k + 1, j, s]
                if k < last - 1:
                    above = above + r * a[k + 2, j, s]
                    a[k + 2, j, s] = a[k + 2, j, s] - above * z
                a[k + 1, j, s] = a[k + 1, j, s] - above * y
                a[k, j, s] = a[k, j, s] - above * x
            for i in range(first, wp.min(last, k + 3) + 1):
                left = x * a[i, k, s] + y * a[i, k + 1, s]
                if k < last - 1:
                    left = left + z * a[i, k + 2, s]
                    a[i, k + 2, s] = a[i, k + 2, s] - left * r
                a[i, k + 1, s] = a[i, k + 1, s] - left * q
                a[i, k, s] = a[i, k, s] - left


@wp.func
def largest_real_part(a: wp.array3d(dtype=wp.float64), s: int):
    """Return the largest real part of the eigenvalues of a[:, :, s] in Hessenberg form; NaN if they do not converge."""
    largest = wp.float64(-wp.inf)
    shifted = wp.float64(0.0)
    last = int(a.shape[0] - 1)
    iteration = int(0)
    while last >= 0:
        first = start_of_block(a, s, last)
        x = a[last, last, s]
        if first == last:
            largest = wp.max(largest, x + shifted)
            last -= 1
            iteration = 0
        else:
            y = a[last - 1, last - 1, s]
            w = a[last, last - 1, s] * a[last - 1, last, s]
            if first == last - 1:
                half = wp.float64(0.5) * (y - x)
                square = half * half + w
                real = x + shifted + half
                if square > wp.float64(0.0):
                    real = x + shifted + wp.max(half + wp.sqrt(square), half - wp.sqrt(square))
                largest = wp.max(largest, real)
                last -= 2
                iteration = 0
            elif iteration == wp.static(MOST_ITERATIONS):
                largest = wp.float64(wp.nan)
                last = -1
            else:
                iteration += 1
                if iteration % wp.static(UNUSUAL_SHIFT_EVERY) == 0:
                    shifted = shifted + x
                    for i in range(last + 1):
                        a[i, i, s] = a[i, i, s] - x
                    size = wp.abs(a[last, last - 1, s]) + wp.abs(a[last - 1, last - 2, s])
                    x = wp.float64(0.75) * size
                    y = x
                    w = wp.float64(-0.4375) * size * size
                shift_twice(a, s, first, last, x, y, w)
    return largest


@wp.kernel(module="unique", enable_backward=False, module_options=module_options(max_unroll=1))
def find_decays(
    begin: int,
    mass: wp.array2d(dtype=wp.float64),  # [storey, structure]
    stiffness: wp.array2d(dtype=wp.float64),
    of_mass: wp.array2d(dtype=wp.float64),  # [1, structure]
    dashpot: wp.array2d(dtype=wp.float64),
    matrix: wp.array3d(dtype=wp.float64),  # [2 storey, 2 storey, thread]
    decay: wp.array2d(dtype=wp.float64),  # [1, structure]
):
    s = wp.tid()
    c = begin + s
    fill_state_matrix(matrix, s, c, mass, stiffness, of_mass[0, c], dashpot)
    reduce_to_hessenberg(matrix, s)
    largest = largest_real_part(matrix, s)
    decay[0, c] = wp.where(wp.isnan(largest), largest, wp.max(-largest, wp.float64(0.0)))


def launch_decays(*arrays: wp.array, device: str) -> None:
    """Queue the kernel `find_decays` on the present stream of a device, for a limited number of structures at a time.

    Args:
        arrays: Arguments of the kernel: `mass`, `stiffness`, `of_mass`, `dashpot`, and the output `decay`.
        device: Device of the arrays.
    """
    (storeys, count), kernel = arrays[0].shape, loaded(find_decays, device)
    at_a_time = min(count, max(1, NUMBERS_AT_A_TIME // (2 * storeys) ** 2))
    length = (-(-at_a_time // LANES) | 1) * LANES
    matrix = wp.empty((2 * storeys, 2 * storeys, length), dtype=wp.float64, device=device)
    for begin in range(0, count, at_a_time):
        inputs = [begin, *arrays[:-1], matrix, arrays[-1]]
        threads = min(at_a_time, count - begin)
        wp.launch(kernel, dim=threads, inputs=inputs, device=device, block_dim=block_size(device))


def slowest_decays(mass: np.ndarray, stiffness: np.ndarray, of_mass: np.ndarray, dashpots: np.ndarray) -> np.ndarray:
    """Return the slowest rate of decay of free vibration of many damped shear chains [1/s], shape [structure].

    Args:
        mass: Floor masses [kg], above 0, shape [structure, storey].
        stiffness: Storey stiffness [N/m], above 0, shape [structure, storey].
        of_mass: Factor of the mass in the damping matrix [1/s], shape [structure].
        dashpots: Coefficients of the storeys' dashpots [N s/m], 0 or above, shape [structure, storey].
    """
    if is_traced(mass, stiffness, of_mass, dashpots):
        found = request(DECAY, 1, mass, stiffness, of_mass[:, None], dashpots)
        return found[:, 0]  # type: ignore[return-value] # used as an array
    given = mass, stiffness, of_mass[:, None], dashpots
    arrays = [wp.array(np.ascontiguousarray(each.T, np.float64), copy=False, device="cpu") for each in given]
    decay = np.empty((1, len(mass)))
    launch_decays(*arrays, wp.array(decay, copy=False, device="cpu"), device="cpu")
    return decay[0]
