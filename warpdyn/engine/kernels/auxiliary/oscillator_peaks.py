"""The kernel of response spectra: the largest displacements of oscillators under recorded base motions.

A thread integrates LANES oscillators under one record, with the exact solution from each point of the record to the
next. An interval between two points is searched for a larger displacement only if both of these bounds exceed the peak
so far:

- a bound of the displacement from the curvature, which is sharp for periods above the time step of the record;
- a bound of the displacement from the static response plus the envelope of the free vibration, which is sharp for
  shorter periods.

The kernel returns the largest displacement in continuous time, during and after the record, not only at its points.
"""

import functools
from concurrent.futures import ThreadPoolExecutor
from itertools import pairwise

import numpy as np
import warp as wp

from warpdyn.engine.device.processor import module_options
from warpdyn.engine.kernels.arguments import as_field
from warpdyn.engine.kernels.auxiliary.oscillator_extrema import angle_to_zero, double, searched
from warpdyn.engine.kernels.build import CPU_LANES, CPU_UNROLL, GPU_LANES, GPU_UNROLL
from warpdyn.engine.kernels.kernel_cache import THREADS_OF_A_BLOCK, loaded
from warpdyn.engine.kernels.queues import SLICES_PER_THREAD


@wp.struct
class Records:
    """Base accelerations of all records, one after the other in one array."""

    acceleration: wp.array(dtype=double)
    first: wp.array(dtype=wp.int32)  # index of the first value of each record, [record]
    intervals: wp.array(dtype=wp.int32)  # number of intervals between the points of a record, [record]
    step_index: wp.array(dtype=wp.int32)  # index in `step`, [record]
    step: wp.array(dtype=double)  # different time steps of the records, [step]


@wp.struct
class Oscillators:
    """Oscillators, and for each of them the coefficients of its integration step and of the bounds of its displacement.

    Increments of displacement u and velocity v over a step are linear in u, v and the base acceleration. For example,
    `u_by_v` is the coefficient of v in the increment of u.
    """

    frequency: wp.array(dtype=double)  # undamped circular frequency, [oscillator]
    damping_ratio: wp.array(dtype=double)  # [oscillator]
    pieces: wp.array2d(dtype=wp.int32)  # number of pieces of a searched interval, [step, oscillator] as all below
    u_by_u: wp.array2d(dtype=double)
    u_by_v: wp.array2d(dtype=double)
    v_by_u: wp.array2d(dtype=double)
    v_by_v: wp.array2d(dtype=double)
    u_by_start: wp.array2d(dtype=double)  # coefficients of the base acceleration at the start and end of the step
    u_by_end: wp.array2d(dtype=double)
    v_by_start: wp.array2d(dtype=double)
    v_by_end: wp.array2d(dtype=double)
    bend: wp.array2d(dtype=double)  # search only if end + bend * acceleration > share * peak
    share: wp.array2d(dtype=double)
    turn: wp.array2d(dtype=double)  # and if the sum of both speeds <= turn * acceleration + swing * peak
    swing: wp.array2d(dtype=double)
    flexibility: wp.array2d(dtype=double)  # static response: lag * change - flexibility * acceleration
    lag: wp.array2d(dtype=double)
    creep: wp.array2d(dtype=double)  # velocity of the static response: -creep * change of the acceleration
    sine_by_v: wp.array2d(dtype=double)  # sine amplitude of the free vibration, from its velocity and displacement
    sine_by_u: wp.array2d(dtype=double)


@functools.cache
def oscillator_kernel(lanes: int, unroll: int) -> wp.Kernel:
    """Return the kernel for `lanes` oscillators per thread, with loops of at most `unroll` iterations unrolled."""
    LANES = lanes
    row = wp.types.vector(length=lanes, dtype=double)
    indices = wp.types.vector(length=lanes, dtype=wp.int32)

    @wp.kernel(module="unique", enable_backward=False, module_options=module_options(unroll))
    def largest_displacement(
        first_block: int,
        blocks_of_a_record: int,
        records: Records,
        oscillators: Oscillators,
        spectral_displacement: wp.array2d(dtype=double),
    ):
        block = first_block + wp.tid()
        record = block // blocks_of_a_record
        s = records.step_index[record]
        step = records.step[s]
        first = records.first[record]
        index = indices()
        frequency = row()
        damping_ratio = row()
        u_by_u = row()
        u_by_v = row()
        v_by_u = row()
        v_by_v = row()
        u_by_start = row()
        u_by_end = row()
        v_by_start = row()
        v_by_end = row()
        bend = row()
        share = row()
        turn = row()
        swing = row()
        flexibility = row()
        lag = row()
        creep = row()
        sine_by_v = row()
        sine_by_u = row()
        for j in range(LANES):
            # Lanes past the last oscillator repeat it: they write the same values again.
            o = wp.min((block - record * blocks_of_a_record) * LANES + j, oscillators.frequency.shape[0] - 1)
            index[j] = o
            frequency[j] = oscillators.frequency[o]
            damping_ratio[j] = oscillators.damping_ratio[o]
            u_by_u[j] = oscillators.u_by_u[s, o]
            u_by_v[j] = oscillators.u_by_v[s, o]
            v_by_u[j] = oscillators.v_by_u[s, o]
            v_by_v[j] = oscillators.v_by_v[s, o]
            u_by_start[j] = oscillators.u_by_start[s, o]
            u_by_end[j] = oscillators.u_by_end[s, o]
            v_by_start[j] = oscillators.v_by_start[s, o]
            v_by_end[j] = oscillators.v_by_end[s, o]
            bend[j] = oscillators.bend[s, o]
            share[j] = oscillators.share[s, o]
            turn[j] = oscillators.turn[s, o]
            swing[j] = oscillators.swing[s, o]
            flexibility[j] = oscillators.flexibility[s, o]
            lag[j] = oscillators.lag[s, o]
            creep[j] = oscillators.creep[s, o]
            sine_by_v[j] = oscillators.sine_by_v[s, o]
            sine_by_u[j] = oscillators.sine_by_u[s, o]

        u = row()
        v = row()
        u_end = row()
        v_end = row()
        peak = row()
        may_pass = indices()  # 1 where the displacement may pass its peak between the samples
        a = records.acceleration[first]
        for interval in range(records.intervals[record]):
            a_end = records.acceleration[first + interval + 1]
            change = a_end - a
            size = wp.max(wp.abs(a), wp.abs(a_end))
            found = int(0)
            for j in range(LANES):
                x = u[j]
                y = v[j]
                x_end = x + (u_by_u[j] * x + u_by_v[j] * y + u_by_start[j] * a + u_by_end[j] * a_end)
                y_end = y + (v_by_u[j] * x + v_by_v[j] * y + v_by_start[j] * a + v_by_end[j] * a_end)
                u_end[j] = x_end
                v_end[j] = y_end
                end = wp.max(wp.abs(x), wp.abs(x_end))
                largest = wp.max(peak[j], end)
                peak[j] = largest
                curves = wp.where(end + bend[j] * size > share[j] * largest, 1, 0)
                rests = wp.where(wp.abs(y) + wp.abs(y_end) <= turn[j] * size + swing[j] * largest, 1, 0)
                # The free vibration about the static response starts with these parts of cosine and sine.
                follows = lag[j] * change - flexibility[j] * a
                cosine = x - follows
                sine = sine_by_v[j] * (y + creep[j] * change) + sine_by_u[j] * cosine
                left = largest - wp.max(wp.abs(follows), wp.abs(follows - flexibility[j] * change))
                room = wp.max(left, double(0.0))
                reaches = wp.where(cosine * cosine + sine * sine > room * room, 1, 0)
                may_pass[j] = curves * rests * reaches
                found += may_pass[j]
            if found > 0:
                for j in range(LANES):
                    if may_pass[j] > 0:
                        omega = frequency[j]
                        zeta = damping_ratio[j]
                        damped = omega * wp.sqrt((double(1.0) - zeta) * (double(1.0) + zeta))
                        pieces = oscillators.pieces[s, index[j]]
                        peak[j] = searched(
                            peak[j],
                            u[j],
                            v[j],
                            a,
                            change / step,
                            step / double(pieces),
                            pieces,
                            omega * omega,
                            double(2.0) * zeta * omega,
                            zeta * omega,
                            damped,
                        )
            for j in range(LANES):
                u[j] = u_end[j]
                v[j] = v_end[j]
            a = a_end

        for j in range(LANES):
            # After the record, the displacement is largest at the first instant of rest.
            omega = frequency[j]
            zeta = damping_ratio[j]
            root = wp.sqrt((double(1.0) - zeta) * (double(1.0) + zeta))
            x = u[j]
            y = v[j] / omega
            angle = angle_to_zero(y, -x - double(2.0) * zeta * y, zeta, root)
            energy = wp.max(x * x + (double(2.0) * zeta * x + y) * y, double(0.0))
            rest = wp.exp(-zeta / root * angle) * wp.sqrt(energy)
            spectral_displacement[record, index[j]] = wp.max(peak[j], rest)

    return largest_displacement


def largest_displacements(
    records: dict[str, np.ndarray], oscillators: dict[str, np.ndarray], device: str, threads: int
) -> np.ndarray:
    """Return the largest displacement of every oscillator under every record.

    Args:
        records: The arrays of `Records`: {field: array}. The longest record should come first, so that no thread starts
            it last.
        oscillators: The arrays of `Oscillators`: {field: array}.
        device: Warp device, such as "cpu" or "cuda:0".
        threads: Number of CPU threads.

    Returns:
        Largest displacement [m], shape [record, oscillator].
    """
    is_gpu = wp.get_device(device).is_cuda
    lanes, unroll = (GPU_LANES, GPU_UNROLL) if is_gpu else (CPU_LANES, CPU_UNROLL)
    kernel = oscillator_kernel(lanes, unroll)
    count, size = records["first"].size, oscillators["frequency"].size
    output = wp.full((count, size), float("nan"), dtype=double, device=device)
    blocks_of_a_record = -(-size // lanes)
    arguments = [
        blocks_of_a_record,
        _filled(Records, records, device),
        _filled(Oscillators, oscillators, device),
        output,
    ]
    blocks = count * blocks_of_a_record
    loaded(kernel, device)  # compile it before the threads start; otherwise each thread would compile it
    if is_gpu:
        wp.launch(kernel, dim=blocks, inputs=[0, *arguments], device=device, block_dim=THREADS_OF_A_BLOCK)
        return output.numpy()

    def run(edges: tuple[int, int]) -> None:
        wp.launch(kernel, dim=edges[1] - edges[0], inputs=[edges[0], *arguments], device=device)

    edges = np.unique(np.linspace(0, blocks, min(blocks, threads * SLICES_PER_THREAD) + 1).astype(int))
    with ThreadPoolExecutor(threads) as pool:
        list(pool.map(run, pairwise(edges)))  # the list waits for all results and raises errors of the threads
    return output.numpy()


def _filled(struct: type, arrays: dict[str, np.ndarray], device: str) -> object:
    """Copy arrays {field: array} to the device and return a struct that contains them, in the dtypes of its fields."""
    instance = struct()
    for name, values in arrays.items():
        setattr(instance, name, wp.array(as_field(struct, name, values), device=device))
    return instance
