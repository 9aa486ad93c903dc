"""Launches of the kernels of synthetic motions on a CPU or GPU."""

from collections.abc import Iterator, Mapping

import numpy as np
import warp as wp

from warpdyn.engine.kernels.arguments import as_field
from warpdyn.engine.kernels.auxiliary.synthetic_motions.kernels import (
    CHANGE,
    DECAYED,
    Motions,
    Parts,
    double,
    modulation_kernel,
    response_kernel,
)
from warpdyn.engine.kernels.kernel_cache import THREADS_OF_A_BLOCK, loaded
from warpdyn.engine.kernels.queues import free_memory
from warpdyn.foundations.core.thread_pool import cores, in_parts

# A motion whose responses decay slowly is divided into parts, so that a thread has at most about this number of steps.
STEPS_OF_A_PART, MOST_PARTS = 32_000, 1024
MOTIONS_AT_A_TIME = 16  # motions of a launch; each thread of the CPU takes the next launch
# Samples of motions that a GPU generates at the same time (32 GiB), and the share of its free memory for them. Fewer
# motions than about 100,000 do not occupy a large GPU.
MOST_SAMPLES_ON_A_GPU, SHARE_OF_MEMORY = 2**31 - 1, 0.25
BYTES_OF_A_SAMPLE = 16  # its acceleration and its variance


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
        motions: The arrays of `Motions` without `parts` and `next_part`: {field: array}.
        high_pass: Coefficients of the high-pass filter.
        step: Sampling step [s].
        least_frequency: Least frequency of the filter [Hz].
        key: Key of the random numbers.
        device: Warp device, such as "cpu" or "cuda:0".
    """
    common = high_pass, step, least_frequency, key
    if not wp.get_device(device).is_cuda:
        ends = np.cumsum(motions["samples"])
        values = _on_cpu(motions, *common).numpy()[: ends[-1]]
        return [row.copy() for row in np.split(values, ends[:-1])]
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

    Motions of similar cost are generated together, in arrays of bounded size. The samples after the end of a motion are
    NaN.
    """
    most = int(min(MOST_SAMPLES_ON_A_GPU, SHARE_OF_MEMORY * free_memory(device) / BYTES_OF_A_SAMPLE))
    count, cost = _number_of_parts(motions, step, least_frequency)
    order = np.lexsort((-motions["samples"], -np.floor(cost), -count))
    kernels, constants = (response_kernel(), modulation_kernel()), wp.array(high_pass, dtype=double, device=device)
    for kernel in kernels:
        loaded(kernel, device)
    columns = max(1, most // int(motions["samples"].max()))
    begin = 0
    while begin < order.size:
        fitting = int(np.searchsorted(np.cumsum(count[order[begin:]]), columns, side="right"))
        chosen = order[begin : begin + max(1, fitting)]
        begin += chosen.size
        part = {name: values[chosen] for name, values in motions.items()}
        longest, number = int(part["samples"].max()), int(count[chosen].sum())
        instance, parts = _structs_on(device, part, count[chosen], step, least_frequency, np.arange(number))
        # NaN, so that a sample that the kernel does not write is noticed.
        arrays = [wp.full((longest, number), float("nan"), dtype=double, device=device) for _ in range(2)]
        flat = [array.flatten() for array in arrays]
        inputs: list[object] = [0, instance, parts, step, least_frequency, key, number, *flat]
        wp.launch(kernels[0], dim=2 * number, inputs=inputs, device=device, block_dim=THREADS_OF_A_BLOCK)
        inputs = [0, instance, parts, constants, step, number, *flat]
        wp.launch(kernels[1], dim=chosen.size, inputs=inputs, device=device, block_dim=THREADS_OF_A_BLOCK)
        yield chosen, arrays[1][:, : chosen.size]
        del arrays, flat, inputs  # so that their memory is free for the next motions


def _number_of_parts(
    motions: Mapping[str, np.ndarray], step: float, least_frequency: float
) -> tuple[np.ndarray, np.ndarray]:
    """Return the number of parts of each motion, and the number of blocks of a part, each of shape [motion]."""
    hertz = _frequencies_at_ends(motions, least_frequency)
    change = float(CHANGE) * motions["damping_ratio"]
    blocks = np.abs(np.log(hertz[1] / hertz[0])) / np.log1p(change)
    decaying = float(DECAYED) / (2 * np.pi * motions["damping_ratio"] * hertz.mean(axis=0) * step)
    steps = blocks * np.minimum(decaying, 0.5 * motions["samples"])
    count = np.clip(np.ceil(steps / STEPS_OF_A_PART), 1, MOST_PARTS).astype(np.int64)
    return count, blocks / count


def _frequencies_at_ends(motions: Mapping[str, np.ndarray], least_frequency: float) -> np.ndarray:
    """Return the filter frequencies before and after their change [Hz], shape [2, motion]."""
    since = np.array([motions["start"], motions["end"]]) - motions["middle"]
    found: np.ndarray = np.maximum(motions["frequency"] + motions["slope"] * since, least_frequency)
    return found


def _on_cpu(
    motions: Mapping[str, np.ndarray], high_pass: np.ndarray, step: float, least_frequency: float, key: int
) -> wp.array:
    """Return the accelerations of all motions, one motion after the other; arguments as `generated`."""
    count, _ = _number_of_parts(motions, step, least_frequency)
    number = int(count.sum())
    lengths = np.concatenate([motions["samples"], np.repeat(motions["samples"], count - 1)])
    ends = np.cumsum(lengths)
    instance, parts = _structs_on("cpu", motions, count, step, least_frequency, ends - lengths)
    # NaN, so that a sample that the kernel does not write is noticed.
    arrays = [wp.full(int(ends[-1]), float("nan"), dtype=double, device="cpu") for _ in range(2)]
    both: tuple[tuple[wp.Kernel, int, list[object]], ...] = (
        (response_kernel(), 2 * number, [instance, parts, step, least_frequency, key, 1, *arrays]),
        (
            modulation_kernel(),
            count.size,
            [instance, parts, wp.array(high_pass, dtype=double, device="cpu"), step, 1, *arrays],
        ),
    )
    for kernel, size, arguments in both:
        loaded(kernel, "cpu")

        def run(part: slice, kernel: wp.Kernel = kernel, arguments: list[object] = arguments) -> None:
            wp.launch(kernel, dim=part.stop - part.start, inputs=[part.start, *arguments], device="cpu")

        in_parts(run, size, cores(), MOTIONS_AT_A_TIME)
    return arrays[1]


def _structs_on(
    device: str,
    motions: Mapping[str, np.ndarray],
    count: np.ndarray,
    step: float,
    least_frequency: float,
    first: np.ndarray,
) -> tuple[Motions, Parts]:
    """Return the structs with the arrays of motions and of their parts on a device.

    The frequency changes by the same factor in each part of a motion.

    Args:
        device: The device.
        motions: As in `generated`.
        count: Number of parts of each motion, shape [motion].
        step: Sampling step [s].
        least_frequency: Least frequency of the filter [Hz].
        first: Position of sample 0 of each part in the arrays, shape [part].
    """
    size = count.size
    next_part = size + np.cumsum(count - 1) - (count - 1)
    motion = np.concatenate([np.arange(size), np.repeat(np.arange(size), count - 1)])
    place = np.concatenate(
        [np.zeros(size, np.int64), 1 + np.arange(size, motion.size) - np.repeat(next_part, count - 1)]
    )
    own = {name: values[motion] for name, values in motions.items()}
    low, high = _frequencies_at_ends(own, least_frequency)
    edges = []
    for each in (place, place + 1):
        hertz = low * (high / low) ** (each / count[motion])
        slope = np.where(own["slope"] == 0, 1.0, own["slope"])
        time = np.clip(own["middle"] + (hertz - own["frequency"]) / slope, own["start"], own["end"])
        edge = 2 * np.ceil(time / (2 * step)).astype(np.int64)  # even, because the noise is drawn in pairs
        edge = np.where(each == 0, 0, np.where(each == count[motion], own["samples"], edge))
        edges.append(np.minimum(edge, own["samples"]))
    instance, parts = Motions(), Parts()
    for name, values in (*motions.items(), ("parts", count), ("next_part", next_part)):
        setattr(instance, name, wp.array(as_field(Motions, name, values), device=device))
    table = {"motion": motion, "first": first, "begin": edges[0], "until": edges[1]}
    table |= dict.fromkeys(("end", "end_of_squares"), np.zeros(motion.size))
    for name, values in table.items():
        setattr(parts, name, wp.array(as_field(Parts, name, values), device=device))
    return instance, parts
