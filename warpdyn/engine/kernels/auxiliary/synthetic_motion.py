"""The kernel of synthetic motions: white noise through a filter whose frequency changes with time, and modulated.

A thread generates one motion. The responses of the filter to LANES successive values of the noise are advanced
together, by a rotation per step, and end when they have decayed to 1e-6. All arithmetic is in float64.
"""

import functools

import numpy as np
import warp as wp

from warpdyn.engine.device.processor import module_options
from warpdyn.engine.device.random_numbers import normal_pair
from warpdyn.engine.kernels.arguments import as_field
from warpdyn.engine.kernels.build import CPU_LANES, CPU_UNROLL
from warpdyn.engine.kernels.kernel_cache import loaded
from warpdyn.foundations.core.random_numbers import Purpose
from warpdyn.foundations.core.thread_pool import cores, in_parts

double = wp.float64
MOTIONS_AT_A_TIME = 16  # motions of a launch; each thread of the CPU takes the next launch
DECAYED = wp.constant(wp.float64(13.815510557964274))  # -ln 1e-6
STEPS_OF_A_BLOCK = wp.constant(wp.float64(CPU_LANES))
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


@functools.cache
def motion_kernel() -> wp.Kernel:
    """Return the kernel, which generates one motion per thread."""
    LANES = CPU_LANES
    row = wp.types.vector(length=LANES, dtype=double)

    @wp.kernel(module="unique", enable_backward=False, module_options=module_options(CPU_UNROLL))
    def generate(
        first_motion: int,
        motions: Motions,
        high_pass: wp.array(dtype=double),
        step: double,
        least_frequency: double,
        key: wp.uint64,
        variance: wp.array(dtype=double),
        acceleration: wp.array(dtype=double),
    ):
        m = first_motion + wp.tid()
        first = motions.first[m]
        samples = motions.samples[m]
        zeta = motions.damping_ratio[m]
        root = wp.sqrt((double(1.0) - zeta) * (double(1.0) + zeta))
        for i in range(samples):
            variance[first + wp.int64(i)] = double(0.0)
            acceleration[first + wp.int64(i)] = double(0.0)
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
            slowest = double(1.0e300)
            for j in range(LANES):
                changing = wp.min(wp.max(double(begin + j) * step, motions.start[m]), motions.end[m])
                hertz = motions.frequency[m] + motions.slope[m] * (changing - motions.middle[m])
                omega = TWO_PI * wp.max(hertz, least_frequency)
                decay = wp.exp(-zeta * omega * step)
                size[j] = omega / root
                cosine[j] = decay * wp.cos(omega * root * step)
                sine[j] = decay * wp.sin(omega * root * step)
                slowest = wp.min(slowest, zeta * omega * step)
            last = wp.min(double(samples - begin), wp.ceil(DECAYED / slowest) + STEPS_OF_A_BLOCK)
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
                at = first + wp.int64(begin + k)
                acceleration[at] += total
                variance[at] += squares

        u = double(0.0)
        v = double(0.0)
        before = double(0.0)
        for i in range(samples):
            at = first + wp.int64(i)
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
    motions: dict[str, np.ndarray], high_pass: np.ndarray, step: float, least_frequency: float, key: int
) -> list[np.ndarray]:
    """Return the accelerations of synthetic motions [m/s2], one array per motion.

    Args:
        motions: The arrays of `Motions` without `first`: {field: array}.
        high_pass: Coefficients of the high-pass filter.
        step: Sampling step [s].
        least_frequency: Least frequency of the filter [Hz].
        key: Key of the random numbers.
    """
    samples = motions["samples"]
    ends = np.cumsum(samples)
    instance = Motions()
    for name, values in (motions | {"first": ends - samples}).items():
        setattr(instance, name, wp.array(as_field(Motions, name, values), device="cpu"))
    # NaN, so that a sample that the kernel does not write is noticed.
    variance, acceleration = (wp.full(int(ends[-1]), float("nan"), dtype=double, device="cpu") for _ in range(2))
    kernel = motion_kernel()
    loaded(kernel, "cpu")
    arguments = [instance, wp.array(high_pass, dtype=double, device="cpu"), step, least_frequency, key]
    arguments += [variance, acceleration]

    def run(part: slice) -> None:
        wp.launch(kernel, dim=part.stop - part.start, inputs=[part.start, *arguments], device="cpu")

    in_parts(run, samples.size, cores(), MOTIONS_AT_A_TIME)
    return [row.copy() for row in np.split(acceleration.numpy(), ends[:-1])]
