"""The kernel of synthetic motions: white noise through a filter whose frequency changes with time, and modulated.

A thread generates one motion. The filter's response to a value of the noise is a damped sine with the frequency w of
its time, exp(c w s) with a complex constant c. Within a block of samples, w changes by at most CHANGE times the damping
ratio, so that exp(c w s) is interpolated between POLES values of w (Chebyshev nodes) for all s. Each node is a complex
recursion, which the noise of the block enters with the interpolation weights of its w, and which ends when it has
decayed to 1e-7. The sum of the squares of the responses, which is the variance of the process, is computed in the same
way. The result differs from the sum over all values of the noise by less than 1e-6 of the peak. All arithmetic is in
float64, so that motions of a CPU and of a GPU agree within rounding.

The samples of a motion are neighbours in the memory of a CPU. On a GPU, samples of the same time are neighbours,
because the threads of a warp read them together.
"""

import functools
from collections.abc import Iterator, Mapping

import numpy as np
import warp as wp

from warpdyn.engine.device.processor import module_options
from warpdyn.engine.device.random_numbers import normal_pair
from warpdyn.engine.kernels.arguments import as_field
from warpdyn.engine.kernels.build import CPU_UNROLL
from warpdyn.engine.kernels.kernel_cache import THREADS_OF_A_BLOCK, loaded
from warpdyn.engine.kernels.queues import free_memory
from warpdyn.foundations.core.random_numbers import Purpose
from warpdyn.foundations.core.thread_pool import cores, in_parts

double = wp.float64
MOTIONS_AT_A_TIME = 16  # motions of a launch; each thread of the CPU takes the next launch
# Samples of the motions that a GPU generates at the same time (8 GiB), and the share of its free memory for them. Fewer
# motions than about 100,000 do not occupy a large GPU.
MOST_SAMPLES_ON_A_GPU, SHARE_OF_MEMORY = 2**29, 0.25
BYTES_OF_A_SAMPLE = 16  # its acceleration and its variance
POLES = 8
CHANGE = wp.constant(
    double(0.65)
)  # change of the filter frequency in a block, over the frequency and the damping ratio
DECAYED = wp.constant(double(np.log(1e7)))
TWO_PI = wp.constant(wp.float64(2.0 * np.pi))


@wp.struct
class Motions:
    """Parameters of the motions; `warpdyn.model.ground_motions.synthetic.motions` computes them."""

    index: wp.array(dtype=wp.uint64)  # index of the motion, for its random numbers
    first: wp.array(dtype=wp.int64)  # position of its first sample
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


@wp.func
def frequency_at(motions: Motions, m: int, time: double, least_frequency: double):
    """Return the circular frequency of the filter of a motion at a time [rad/s]."""
    changing = wp.min(wp.max(time, motions.start[m]), motions.end[m])
    hertz = motions.frequency[m] + motions.slope[m] * (changing - motions.middle[m])
    return TWO_PI * wp.max(hertz, least_frequency)


@functools.cache
def block_function(poles: int) -> wp.Function:
    """Return the device function that adds the responses to the noise of one block, with `poles` recursions."""
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
    def add_block(
        motions: Motions,
        m: int,
        begin: int,
        count: int,  # samples of the block
        end: int,  # sample at which its responses have decayed, and their squares
        end_of_squares: int,
        omega: double,  # filter frequency at its first and last sample
        last_omega: double,
        step: double,
        least_frequency: double,
        key: wp.uint64,
        spacing: wp.int64,
        written: int,  # samples before this one contain responses to earlier blocks, and their squares
        squares_written: int,
        variance: wp.array(dtype=double),
        acceleration: wp.array(dtype=double),
    ):
        first = motions.first[m]
        zeta = motions.damping_ratio[m]
        root = wp.sqrt((double(1.0) - zeta) * (double(1.0) + zeta))
        middle = double(0.5) * (omega + last_omega)
        half = double(0.5) * wp.abs(last_omega - omega)
        of_position = wp.where(half > double(0.0), double(1.0) / half, double(0.0))
        decay = Row()
        cosine = Row()
        sine = Row()
        for q in range(POLES):
            at_node = middle + half * NODES[q]
            decay[q] = wp.exp(-zeta * at_node * step)
            cosine[q] = decay[q] * wp.cos(at_node * root * step)
            sine[q] = decay[q] * wp.sin(at_node * root * step)
        real = Row()
        response = Row()
        decaying = Row()  # the sum of the squares is (decaying - real part) / 2
        square_real = Row()
        square_response = Row()
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
            if i < end_of_squares:
                squares = double(0.0)
                for q in range(POLES):
                    double_cosine = cosine[q] * cosine[q] - sine[q] * sine[q]
                    double_sine = double(2.0) * cosine[q] * sine[q]
                    decaying[q] *= decay[q] * decay[q]
                    old = square_real[q]
                    square_real[q] = double_cosine * old - double_sine * square_response[q]
                    square_response[q] = double_sine * old + double_cosine * square_response[q]
                    squares += double(0.5) * (decaying[q] - square_real[q])
                if i < squares_written:
                    squares += variance[at]
                variance[at] = squares
            if i < begin + count:
                if i == begin or i % 2 == 0:
                    purpose = wp.static(int(Purpose.SYNTHETIC_NOISE))
                    drawn = normal_pair(key, motions.index[m], purpose, wp.uint32(i // 2))
                noise = wp.where(i % 2 == 0, drawn[0], drawn[1])
                own = frequency_at(motions, m, double(i) * step, least_frequency)
                weights = interpolation_weights((own - middle) * of_position)
                size = own / root
                for q in range(POLES):
                    real[q] += weights[q] * size * noise
                    decaying[q] += weights[q] * size * size
                    square_real[q] += weights[q] * size * size

    return add_block


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
def motion_kernel() -> wp.Kernel:
    """Return the kernel, which generates one motion per thread."""
    add_block, add_block_of_one_frequency = block_function(POLES), block_function(1)

    @wp.kernel(module="unique", enable_backward=False, module_options=module_options(CPU_UNROLL))
    def generate(
        first_motion: int,
        motions: Motions,
        high_pass: wp.array(dtype=double),
        step: double,
        least_frequency: double,
        key: wp.uint64,
        spacing: wp.int64,  # distance of two samples of a motion in the arrays
        variance: wp.array(dtype=double),
        acceleration: wp.array(dtype=double),
    ):
        m = first_motion + wp.tid()
        first = motions.first[m]
        samples = motions.samples[m]
        begin = int(0)
        written = int(0)
        squares_written = int(0)
        while begin < samples:
            omega = frequency_at(motions, m, double(begin) * step, least_frequency)
            count = samples_of_block(motions, m, begin, omega, step, least_frequency)
            last_omega = frequency_at(motions, m, double(begin + count - 1) * step, least_frequency)
            slowest = wp.min(omega, last_omega)
            decaying = int(wp.ceil(wp.min(DECAYED / (motions.damping_ratio[m] * slowest * step), double(samples))))
            end = wp.min(begin + count + decaying, samples)
            end_of_squares = wp.min(begin + count + decaying / 2 + 1, samples)  # squares decay twice as fast
            if last_omega == omega:
                add_block_of_one_frequency(
                    motions, m, begin, count, end, end_of_squares, omega, last_omega, step, least_frequency, key,
                    spacing, written, squares_written, variance, acceleration,
                )  # fmt: skip
            else:
                add_block(
                    motions, m, begin, count, end, end_of_squares, omega, last_omega, step, least_frequency, key,
                    spacing, written, squares_written, variance, acceleration,
                )  # fmt: skip
            written = wp.max(written, end)
            squares_written = wp.max(squares_written, end_of_squares)
            begin += count

        u = double(0.0)
        v = double(0.0)
        before = double(0.0)
        for i in range(samples):
            at = first + wp.int64(i) * spacing
            now = double(0.0)
            if i > 0:
                time = double(i) * step
                power = (
                    motions.log_energy[m] + (motions.shape[m] - double(1.0)) * wp.log(time) - time / motions.scale[m]
                )
                now = wp.exp(double(0.5) * power) * acceleration[at] / wp.sqrt(variance[at])
                old = u
                u = high_pass[0] * old + high_pass[2] * v + high_pass[4] * before + high_pass[6] * now
                v = high_pass[1] * old + high_pass[3] * v + high_pass[5] * before + high_pass[7] * now
            before = now
            acceleration[at] = now - high_pass[9] * v - high_pass[8] * u

    return generate


def generated(
    motions: Mapping[str, np.ndarray],
    high_pass: np.ndarray,
    step: float,
    least_frequency: float,
    key: int,
    device: str = "cpu",
) -> list[np.ndarray]:
    """Return the accelerations of synthetic motions [m/s2], one array per motion.

    Args:
        motions: The arrays of `Motions` without `first`: {field: array}.
        high_pass: Coefficients of the high-pass filter.
        step: Sampling step [s].
        least_frequency: Least frequency of the filter [Hz].
        key: Key of the random numbers.
        device: Warp device, such as "cpu" or "cuda:0".
    """
    common = high_pass, step, least_frequency, key
    if not wp.get_device(device).is_cuda:
        ends = np.cumsum(motions["samples"])
        return [row.copy() for row in np.split(_on_cpu(motions, *common).numpy(), ends[:-1])]
    found: list[np.ndarray] = [np.empty(0)] * motions["samples"].size
    for chosen, values in generated_on_gpu(motions, *common, device):
        by_motion = np.ascontiguousarray(values.numpy().T)
        del values  # so that its memory is free for the next motions
        for place, row in zip(chosen, by_motion, strict=True):
            found[place] = row[: motions["samples"][place]].copy()
    return found


def generated_on_gpu(
    motions: Mapping[str, np.ndarray],
    high_pass: np.ndarray,
    step: float,
    least_frequency: float,
    key: int,
    device: str,
) -> Iterator[tuple[np.ndarray, wp.array]]:
    """Yield indices of motions and their accelerations on a GPU, shape [sample, motion]; arguments as `generated`.

    Motions of similar cost are generated together, the most expensive ones first, in arrays of bounded size. The
    samples after the end of a motion are NaN.
    """
    most = int(min(MOST_SAMPLES_ON_A_GPU, SHARE_OF_MEMORY * free_memory(device) / BYTES_OF_A_SAMPLE))
    order = _by_cost(motions, step, least_frequency)
    kernel, constants = motion_kernel(), wp.array(high_pass, dtype=double, device=device)
    loaded(kernel, device)
    begin = 0
    while begin < order.size:
        chosen = order[begin : begin + max(1, most // int(motions["samples"].max()))]
        longest = int(motions["samples"][chosen].max())
        begin += chosen.size
        part = {name: values[chosen] for name, values in motions.items()}
        instance = _motions_on(device, part, np.arange(chosen.size))
        # NaN, so that a sample that the kernel does not write is noticed.
        arrays = [wp.full((longest, chosen.size), float("nan"), dtype=double, device=device) for _ in range(2)]
        flat = [array.flatten() for array in arrays]
        inputs = [0, instance, constants, step, least_frequency, key, chosen.size, *flat]
        wp.launch(kernel, dim=chosen.size, inputs=inputs, device=device, block_dim=THREADS_OF_A_BLOCK)
        yield chosen, arrays[1]
        del arrays, flat, inputs  # so that their memory is free for the next motions


def _by_cost(motions: Mapping[str, np.ndarray], step: float, least_frequency: float) -> np.ndarray:
    """Return the indices of motions, ordered by the number of their blocks and steps, the largest numbers first."""
    ends = np.array([motions["start"], motions["end"]]) - motions["middle"]
    hertz = np.maximum(motions["frequency"] + motions["slope"] * ends, least_frequency)
    change = float(CHANGE) * motions["damping_ratio"]
    blocks = np.abs(np.log(hertz[1] / hertz[0])) / np.log1p(change)
    decaying = float(DECAYED) / (2 * np.pi * motions["damping_ratio"] * hertz.mean(axis=0) * step)
    steps = motions["samples"] + (1 + blocks) * np.minimum(decaying, motions["samples"])
    return np.lexsort((-steps, -np.floor(blocks)))


def _on_cpu(
    motions: Mapping[str, np.ndarray], high_pass: np.ndarray, step: float, least_frequency: float, key: int
) -> wp.array:
    """Return the accelerations of all motions, one motion after the other; arguments as `generated`."""
    samples = motions["samples"]
    ends = np.cumsum(samples)
    instance = _motions_on("cpu", motions, ends - samples)
    # NaN, so that a sample that the kernel does not write is noticed.
    variance, acceleration = (wp.full(int(ends[-1]), float("nan"), dtype=double, device="cpu") for _ in range(2))
    kernel = motion_kernel()
    loaded(kernel, "cpu")
    arguments = [instance, wp.array(high_pass, dtype=double, device="cpu"), step, least_frequency, key, 1]
    arguments += [variance, acceleration]

    def run(part: slice) -> None:
        wp.launch(kernel, dim=part.stop - part.start, inputs=[part.start, *arguments], device="cpu")

    in_parts(run, samples.size, cores(), MOTIONS_AT_A_TIME)
    return acceleration


def _motions_on(device: str, motions: Mapping[str, np.ndarray], first: np.ndarray) -> Motions:
    """Return the struct with the arrays of the motions on a device; `first`: position of each first sample."""
    instance = Motions()
    for name, values in (*motions.items(), ("first", first)):
        setattr(instance, name, wp.array(as_field(Motions, name, values), device=device))
    return instance
