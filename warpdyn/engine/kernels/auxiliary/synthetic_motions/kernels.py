"""The kernels of synthetic motions: white noise through a filter whose frequency changes with time, and modulated.

A thread sums up the responses to the noise of one motion, or of a part of it. The filter's response to a value of the
noise is a damped sine with the frequency w of its time, exp(c w s) with a complex constant c. Within a block, w
changes by at most CHANGE times the damping ratio, so that exp(c w s) is interpolated between POLES values of w
(Chebyshev nodes) for all s. Each node is a complex recursion, which the noise of the block enters with the
interpolation weights of its w, and which ends when it has decayed to 1e-7. The sum of the squares of the responses,
which is the variance of the process, is computed in the same way. The result differs from the sum over all values of
the noise by less than 1e-6 of the peak. All arithmetic is in float64, so that motions of a CPU and of a GPU agree
within rounding.

The samples of a motion are neighbours in the memory of a CPU. On a GPU, samples of the same time are neighbours,
because the threads of a warp read them together.
"""

import functools

import numpy as np
import warp as wp

from warpdyn.engine.device.processor import module_options
from warpdyn.engine.device.random_numbers import normal_pair
from warpdyn.engine.kernels.build import CPU_UNROLL
from warpdyn.foundations.core.random_numbers import Purpose

double = wp.float64
POLES = 8
# Largest change of the filter frequency in a block, over the frequency and the damping ratio.
CHANGE = wp.constant(double(0.6))
DECAYED = wp.constant(double(np.log(1e7)))
TWO_PI = wp.constant(wp.float64(2.0 * np.pi))


@wp.struct
class Motions:
    """Parameters of the motions; `warpdyn.model.ground_motions.synthetic.motions` computes them."""

    index: wp.array(dtype=wp.uint64)  # index of the motion, for its random numbers
    parts: wp.array(dtype=wp.int32)  # number of its parts; the first one has the number of the motion
    next_part: wp.array(dtype=wp.int32)  # number of its second part
    samples: wp.array(dtype=wp.int32)
    log_energy: wp.array(dtype=double)  # logarithm of the coefficient of the gamma density times the energy
    shape: wp.array(dtype=double)
    scale: wp.array(dtype=double)
    middle: wp.array(dtype=double)
    start: wp.array(dtype=double)  # the filter frequency changes between these times
    end: wp.array(dtype=double)
    frequency: wp.array(dtype=double)  # Hz
    slope: wp.array(dtype=double)  # Hz/s
    damping_ratio: wp.array(dtype=double)


@wp.struct
class Parts:
    """Successive parts of motions: the samples whose noise a thread processes. A part has its own arrays."""

    motion: wp.array(dtype=wp.int32)
    first: wp.array(dtype=wp.int64)  # position of sample 0 of the motion in the arrays
    begin: wp.array(dtype=wp.int32)  # first sample of the part
    until: wp.array(dtype=wp.int32)  # sample after the last one
    # The responses to its noise, and their squares, are in the arrays up to these samples (exclusive).
    end: wp.array(dtype=wp.int32)
    end_of_squares: wp.array(dtype=wp.int32)


@wp.func
def frequency_at(motions: Motions, m: int, time: double, least_frequency: double):
    """Return the circular frequency of the filter of a motion at a time [rad/s]."""
    changing = wp.min(wp.max(time, motions.start[m]), motions.end[m])
    hertz = motions.frequency[m] + motions.slope[m] * (changing - motions.middle[m])
    return TWO_PI * wp.max(hertz, least_frequency)


@functools.cache
def block_functions(poles: int) -> tuple[wp.Function, wp.Function]:
    """Return the device functions that add the responses to the noise of a block, and their squares.

    They have `poles` recursions.
    """
    POLES = poles
    Row = wp.types.vector(length=poles, dtype=double)
    chebyshev = np.cos(np.pi * (np.arange(poles) + 0.5) / poles)  # in -1 to 1
    products = [np.prod(node - np.delete(chebyshev, q)) for q, node in enumerate(chebyshev)]
    NODES, FACTORS = wp.constant(Row(*chebyshev)), wp.constant(Row(*(1.0 / np.array(products))))

    @wp.func
    def interpolation_weights(position: double):
        """Return Lagrange's interpolation weights of the nodes for a position in -1 to 1."""
        weights = FACTORS
        below = double(1.0)
        above = double(1.0)
        for q in range(POLES):
            weights[q] *= below
            below *= position - NODES[q]
        for r in range(POLES):
            weights[POLES - 1 - r] *= above
            above *= position - NODES[POLES - 1 - r]
        return weights

    @wp.func
    def add_responses(
        motions: Motions,
        m: int,
        first: wp.int64,
        begin: int,
        count: int,  # samples of the block
        end: int,  # sample at which its responses have decayed
        omega: double,  # filter frequency at its first and last sample
        last_omega: double,
        step: double,
        least_frequency: double,
        key: wp.uint64,
        spacing: wp.int64,
        written: int,  # samples before this one contain responses of earlier blocks
        acceleration: wp.array(dtype=double),
    ):
        zeta = motions.damping_ratio[m]
        root = wp.sqrt((double(1.0) - zeta) * (double(1.0) + zeta))
        middle = double(0.5) * (omega + last_omega)
        half = double(0.5) * wp.abs(last_omega - omega)
        of_position = wp.where(half > double(0.0), double(1.0) / half, double(0.0))
        cosine = Row()
        sine = Row()
        for q in range(POLES):
            at_node = middle + half * NODES[q]
            decay = wp.exp(-zeta * at_node * step)
            cosine[q] = decay * wp.cos(at_node * root * step)
            sine[q] = decay * wp.sin(at_node * root * step)
        real = Row()
        response = Row()
        drawn = wp.vec2d()
        for i in range(begin, end):
            total = double(0.0)
            for q in range(POLES):
                old = real[q]
                real[q] = cosine[q] * old - sine[q] * response[q]
                response[q] = sine[q] * old + cosine[q] * response[q]
                total += response[q]
            at = first + wp.int64(i) * spacing
            if i < written:
                total += acceleration[at]
            acceleration[at] = total
            if i < begin + count:
                if i == begin or i % 2 == 0:
                    purpose = wp.static(int(Purpose.SYNTHETIC_NOISE))
                    drawn = normal_pair(key, motions.index[m], purpose, wp.uint32(i // 2))
                noise = wp.where(i % 2 == 0, drawn[0], drawn[1])
                own = frequency_at(motions, m, double(i) * step, least_frequency)
                weights = interpolation_weights((own - middle) * of_position)
                size = own / root * noise
                for q in range(POLES):
                    real[q] += weights[q] * size

    @wp.func
    def add_squares(
        motions: Motions,
        m: int,
        first: wp.int64,
        begin: int,
        count: int,  # samples of the block
        end: int,  # sample at which its squares of responses have decayed
        omega: double,  # filter frequency at its first and last sample
        last_omega: double,
        step: double,
        least_frequency: double,
        spacing: wp.int64,
        written: int,  # samples before this one contain squares of responses of earlier blocks
        variance: wp.array(dtype=double),
    ):
        zeta = motions.damping_ratio[m]
        root = wp.sqrt((double(1.0) - zeta) * (double(1.0) + zeta))
        middle = double(0.5) * (omega + last_omega)
        half = double(0.5) * wp.abs(last_omega - omega)
        of_position = wp.where(half > double(0.0), double(1.0) / half, double(0.0))
        decay = Row()  # of a square, and its oscillation
        cosine = Row()
        sine = Row()
        for q in range(POLES):
            at_node = middle + half * NODES[q]
            decay[q] = wp.exp(double(-2.0) * zeta * at_node * step)
            cosine[q] = decay[q] * wp.cos(double(2.0) * at_node * root * step)
            sine[q] = decay[q] * wp.sin(double(2.0) * at_node * root * step)
        decaying = Row()  # the sum of the squares is (decaying - real part) / 2
        real = Row()
        response = Row()
        for i in range(begin, end):
            squares = double(0.0)
            for q in range(POLES):
                decaying[q] *= decay[q]
                old = real[q]
                real[q] = cosine[q] * old - sine[q] * response[q]
                response[q] = sine[q] * old + cosine[q] * response[q]
                squares += double(0.5) * (decaying[q] - real[q])
            at = first + wp.int64(i) * spacing
            if i < written:
                squares += variance[at]
            variance[at] = squares
            if i < begin + count:
                own = frequency_at(motions, m, double(i) * step, least_frequency)
                weights = interpolation_weights((own - middle) * of_position)
                size = own / root * own / root
                for q in range(POLES):
                    decaying[q] += weights[q] * size
                    real[q] += weights[q] * size

    return add_responses, add_squares


@wp.func
def samples_of_block(motions: Motions, m: int, begin: int, omega: double, step: double, least_frequency: double):
    """Return the number of samples from `begin` on in which the filter frequency stays near its first value `omega`."""
    left = motions.samples[m] - begin
    slope = motions.slope[m]
    count = left
    time = double(begin) * step
    is_lowest = slope < double(0.0) and omega <= TWO_PI * least_frequency
    if time < motions.end[m] and slope != double(0.0) and not is_lowest:
        change = CHANGE * motions.damping_ratio[m]
        lasting = omega * change / (double(1.0) + change) / (TWO_PI * wp.abs(slope))
        until = wp.max(time, motions.start[m]) + lasting
        if until < motions.end[m]:
            count = wp.min(left, wp.max(1, int(until / step) - begin))
        else:
            count = wp.min(left, int(wp.ceil(motions.end[m] / step)) - begin)
        if count > 1:
            count -= count % 2  # the noise is drawn in pairs
    return count


@functools.cache
def response_kernel() -> wp.Kernel:
    """Return the kernel that sums up the responses to the noise of a part of a motion, or their squares, per thread.

    The squares do not contain the noise.
    """
    add_responses, add_squares = block_functions(POLES)
    add_responses_of_one, add_squares_of_one = block_functions(1)

    @wp.kernel(module="unique", enable_backward=False, module_options=module_options(CPU_UNROLL))
    def respond(
        first_thread: int,
        motions: Motions,
        parts: Parts,
        step: double,
        least_frequency: double,
        key: wp.uint64,
        spacing: wp.int64,  # distance of two samples of a part in the arrays
        variance: wp.array(dtype=double),
        acceleration: wp.array(dtype=double),
    ):
        number = parts.motion.shape[0]
        thread = first_thread + wp.tid()
        part = thread % number
        m = parts.motion[part]
        first = parts.first[part]
        samples = motions.samples[m]
        begin = parts.begin[part]
        written = begin
        while begin < parts.until[part]:
            omega = frequency_at(motions, m, double(begin) * step, least_frequency)
            count = samples_of_block(motions, m, begin, omega, step, least_frequency)
            count = wp.min(count, parts.until[part] - begin)
            last_omega = frequency_at(motions, m, double(begin + count - 1) * step, least_frequency)
            decaying = DECAYED / (motions.damping_ratio[m] * wp.min(omega, last_omega) * step)
            if thread >= number:
                decaying *= double(0.5)  # squares decay twice as fast
            decaying = wp.min(decaying, double(samples))
            end = wp.min(begin + count + int(wp.ceil(decaying)), samples)
            if thread < number:
                if last_omega == omega:
                    add_responses_of_one(
                        motions, m, first, begin, count, end, omega, last_omega, step, least_frequency, key, spacing,
                        written, acceleration,
                    )  # fmt: skip
                else:
                    add_responses(
                        motions, m, first, begin, count, end, omega, last_omega, step, least_frequency, key, spacing,
                        written, acceleration,
                    )  # fmt: skip
            else:
                if last_omega == omega:
                    add_squares_of_one(
                        motions, m, first, begin, count, end, omega, last_omega, step, least_frequency, spacing,
                        written, variance,
                    )  # fmt: skip
                else:
                    add_squares(
                        motions, m, first, begin, count, end, omega, last_omega, step, least_frequency, spacing,
                        written, variance,
                    )  # fmt: skip
            written = wp.max(written, end)
            begin += count
        if thread < number:
            parts.end[part] = written
        else:
            parts.end_of_squares[part] = written

    return respond


@functools.cache
def modulation_kernel() -> wp.Kernel:
    """Return the kernel that adds the parts of a motion, modulates it and filters it, one motion per thread."""

    @wp.kernel(module="unique", enable_backward=False, module_options=module_options(CPU_UNROLL))
    def modulate(
        first_motion: int,
        motions: Motions,
        parts: Parts,
        high_pass: wp.array(dtype=double),
        step: double,
        spacing: wp.int64,
        variance: wp.array(dtype=double),
        acceleration: wp.array(dtype=double),
    ):
        m = first_motion + wp.tid()
        first = parts.first[m]
        samples = motions.samples[m]
        u = double(0.0)
        v = double(0.0)
        before = double(0.0)
        for i in range(samples):
            at = first + wp.int64(i) * spacing
            now = double(0.0)
            if i > 0:
                total = double(0.0)
                squares = double(0.0)
                for k in range(motions.parts[m]):
                    part = wp.where(k == 0, m, motions.next_part[m] + k - 1)
                    of_part = parts.first[part] + wp.int64(i) * spacing
                    if i >= parts.begin[part] and i < parts.end[part]:
                        total += acceleration[of_part]
                    if i >= parts.begin[part] and i < parts.end_of_squares[part]:
                        squares += variance[of_part]
                time = double(i) * step
                power = (
                    motions.log_energy[m] + (motions.shape[m] - double(1.0)) * wp.log(time) - time / motions.scale[m]
                )
                now = wp.exp(double(0.5) * power) * total / wp.sqrt(squares)
                old = u
                u = high_pass[0] * old + high_pass[2] * v + high_pass[4] * before + high_pass[6] * now
                v = high_pass[1] * old + high_pass[3] * v + high_pass[5] * before + high_pass[7] * now
            before = now
            acceleration[at] = now - high_pass[9] * v - high_pass[8] * u

    return modulate
