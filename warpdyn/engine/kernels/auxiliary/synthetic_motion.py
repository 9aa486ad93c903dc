"""The kernel of synthetic motions: white noise through a filter whose frequency changes with time, and modulated.

A thread generates one motion. The responses of the filter to LANES successive values of the noise are advanced
together, by a rotation per step, and end when they have decayed to 1e-6. All arithmetic is in float64, so that motions
of a CPU and of a GPU agree within rounding.

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
from warpdyn.engine.kernels.build import CPU_LANES, CPU_UNROLL
from warpdyn.engine.kernels.kernel_cache import THREADS_OF_A_BLOCK, loaded
from warpdyn.engine.kernels.queues import free_memory
from warpdyn.foundations.core.random_numbers import Purpose
from warpdyn.foundations.core.thread_pool import cores, in_parts

double = wp.float64
MOTIONS_AT_A_TIME = 16  # motions of a launch; each thread of the CPU takes the next launch
GPU_LANES = 16  # values of the noise at once; one H200 generates 1.6 times as many motions as with 8
# Samples of the motions that a GPU generates at the same time (8 GiB), and the share of its free memory for them. Fewer
# motions than about 100,000 do not occupy a large GPU.
MOST_SAMPLES_ON_A_GPU, SHARE_OF_MEMORY = 2**29, 0.25
BYTES_OF_A_SAMPLE = 16  # its acceleration and its variance
# The responses to a group of values of the noise end together, whatever the number of lanes is.
GROUP = wp.constant(16)
DECAYED = wp.constant(wp.float64(13.815510557964274))  # -ln 1e-6
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
def motion_kernel(lanes: int) -> wp.Kernel:
    """Return the kernel, which generates one motion per thread and advances `lanes` responses together."""
    LANES = lanes
    row = wp.types.vector(length=LANES, dtype=double)

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
        zeta = motions.damping_ratio[m]
        root = wp.sqrt((double(1.0) - zeta) * (double(1.0) + zeta))
        for i in range(samples):
            variance[first + wp.int64(i) * spacing] = double(0.0)
            acceleration[first + wp.int64(i) * spacing] = double(0.0)
        for block in range((samples + LANES - 1) // LANES):
            begin = block * LANES
            noise = row()
            size = row()
            cosine = row()
            sine = row()
            for pair in range(LANES // 2):
                counter = wp.uint32(begin // 2 + pair)
                drawn = normal_pair(key, motions.index[m], wp.static(int(Purpose.SYNTHETIC_NOISE)), counter)
                noise[2 * pair] = drawn[0]
                noise[2 * pair + 1] = drawn[1]
            for j in range(LANES):
                omega = frequency_at(motions, m, double(begin + j) * step, least_frequency)
                decay = wp.exp(-zeta * omega * step)
                size[j] = omega / root
                cosine[j] = decay * wp.cos(omega * root * step)
                sine[j] = decay * wp.sin(omega * root * step)
            group = begin // GROUP * GROUP
            omega = wp.min(
                frequency_at(motions, m, double(group) * step, least_frequency),
                frequency_at(motions, m, double(group + GROUP - 1) * step, least_frequency),
            )
            last = wp.ceil(DECAYED / (zeta * omega * step)) + double(GROUP - begin + group)
            last = wp.min(double(samples - begin), last)
            real = row()
            response = row()
            for k in range(int(last)):
                total = double(0.0)
                squares = double(0.0)
                for j in range(LANES):
                    old = real[j]
                    turned = cosine[j] * old - sine[j] * response[j]
                    response[j] = sine[j] * old + cosine[j] * response[j]
                    real[j] = wp.where(k == j, size[j], turned)  # a value of the noise acts at its time
                for j in range(LANES):
                    total += response[j] * noise[j]
                    squares += response[j] * response[j]
                at = first + wp.int64(begin + k) * spacing
                acceleration[at] += total
                variance[at] += squares

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

    Motions of similar lengths are generated together, in arrays of bounded size. The samples after the end of a motion
    are NaN.
    """
    most = int(min(MOST_SAMPLES_ON_A_GPU, SHARE_OF_MEMORY * free_memory(device) / BYTES_OF_A_SAMPLE))
    order = np.argsort(-motions["samples"], kind="stable")
    kernel, constants = motion_kernel(GPU_LANES), wp.array(high_pass, dtype=double, device=device)
    loaded(kernel, device)
    begin = 0
    while begin < order.size:
        longest = int(motions["samples"][order[begin]])
        chosen = order[begin : begin + max(1, most // longest)]
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


def _on_cpu(
    motions: Mapping[str, np.ndarray], high_pass: np.ndarray, step: float, least_frequency: float, key: int
) -> wp.array:
    """Return the accelerations of all motions, one motion after the other; arguments as `generated`."""
    samples = motions["samples"]
    ends = np.cumsum(samples)
    instance = _motions_on("cpu", motions, ends - samples)
    # NaN, so that a sample that the kernel does not write is noticed.
    variance, acceleration = (wp.full(int(ends[-1]), float("nan"), dtype=double, device="cpu") for _ in range(2))
    kernel = motion_kernel(CPU_LANES)
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
