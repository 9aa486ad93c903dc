"""Division of a run into blocks: ranges of structures that are integrated together and fit in memory."""

from __future__ import annotations

import math
from itertools import pairwise

import numpy as np

from warpdyn.campaigns.integration import packing
from warpdyn.campaigns.integration.run import Run
from warpdyn.campaigns.integration.stability_guard import structures_of_a_range
from warpdyn.campaigns.running.labels import Column, lengths
from warpdyn.engine.kernels.queues import BLOCKS_ON_A_GPU, free_memory

SHARE_OF_FREE_MEMORY = 0.25
# Number of samples in a block. With CPU_BLOCK samples, launches cost a negligible time. A GPU reaches its full speed
# only if a launch has several times as many samples as run in parallel (2^16 of 5 storeys): 2^18 samples of 1 to 3
# storeys take 25 % longer in four launches than in one. But the preparation of the first block and the collection of
# the last block do not overlap with kernels: 2^20 samples in two blocks take 10 % more kernel time than in one block,
# and 14 % less time in total.
CPU_BLOCK, GPU_BLOCK, LEAST_GPU_BLOCK, BLOCKS_PER_GPU = 2**20, 2**17, 2**18, 2
LARGEST_GPU_BLOCK, WORK_OF_A_GPU_BLOCK = 2**20, 2**33  # work of a block: samples times steps times storeys
# Samples in a block of frames whose joints are a grid. A few samples are run again after each block, and then again. On
# an H200 this takes 3 to 6 s for a frame with four storeys, and 2^18 histories take 7 s.
FRAMES_OF_A_GPU_BLOCK = 2**18
# If a GPU reduces all samples to statistics, the only loss is Python's time per block, so few blocks are better. But
# the GPU is idle while the first block is prepared and the last block is collected, so blocks must not be too large: a
# city of 1.84 million buildings took 5.6 s with 8 blocks (kernels 3.2 s), 5.6 s with 16 (3.5 s) and 5.9 s with 5 (3.1
# s) on one H100; on two, 4.3 s, 4.6 s and 4.2 s.
BLOCKS_OF_A_REDUCTION, LARGEST_OF_A_REDUCTION = 8, 2**20
LEAST_RANGES = 8  # least number of rerun ranges in a block, so that blocks of whole ranges have about equal sizes
BLOCKS_AHEAD = 4  # blocks that are prepared at the same time for each GPU
# Work of a block for each CPU thread (samples times steps times storeys): a few seconds to 30 s, depending on the law.
WORK_OF_A_BLOCK = 1e9
# Host memory of a sample in progress [bytes]: its inputs, in the types of the schedule and of the kernel and, for a
# GPU, in page-locked memory. Copies of a structure's parameters: drawn, combined, packed and, for a GPU, page-locked.
BYTES_PER_SAMPLE, COPIES_OF_A_STRUCTURE = 120, 4
MEMORY_OF_CHUNKS = 64 * 2**20  # bytes for eigenvalue problems, which are solved in parts, and for chunks of files


def divide(
    run: Run,
    columns: dict[str, Column],
    memory: int | None,
    region: range | None = None,
    *,
    is_reduced: bool = False,
) -> list[range]:
    """Return the blocks of a run (structures that are integrated together), each as a range of structure numbers.

    Args:
        run: The prepared run.
        columns: Variables of the run's dataset with one value for each sample, by name.
        memory: Bytes that all blocks in progress may use on the host, and on each device; None: the share
            SHARE_OF_FREE_MEMORY of the free memory.
        region: Range of structures to divide; None: all structures of the run.
        is_reduced: Whether a GPU reduces the samples to statistics, so that they are not copied to the host.

    Raises:
        ValueError: If `memory` is too small for a single structure.
    """
    is_gpu, devices = run.execution.is_gpu, run.execution.devices
    # Blocks in progress: on the devices, in preparation, and one block whose results are collected.
    under_way = BLOCKS_ON_A_GPU * len(devices) + blocks_ahead(run) + 1 if is_gpu else 1
    host, device = bytes_per_structure(run, columns)
    if memory is None:
        rooms = [SHARE_OF_FREE_MEMORY * free_memory("cpu") / (under_way * host)]
        if is_gpu:
            rooms.append(SHARE_OF_FREE_MEMORY * run.execution.free_on_devices / (BLOCKS_ON_A_GPU * device))
        room = max(1, int(min(rooms)))
    else:
        room = int(min((memory - MEMORY_OF_CHUNKS) / (under_way * host), memory / (BLOCKS_ON_A_GPU * device)))
        if room < 1:
            needed = max(MEMORY_OF_CHUNKS + under_way * host, BLOCKS_ON_A_GPU * device)
            raise ValueError(f"memory must be at least {int(needed)} bytes for this scene, got {memory}")
        room = max(1, room // 2)  # the other half is for the samples of the whole region
    region = range(run.structures) if region is None else region
    structures = len(region)
    samples = structures * (run.samples // run.structures)
    steps = float((run.model.timeline.intervals * run.model.timeline.substeps).mean())
    work = steps * run.model.plan.dofs  # of one sample
    most = CPU_BLOCK
    if is_gpu and is_reduced:
        most = int(np.clip(samples / BLOCKS_OF_A_REDUCTION, GPU_BLOCK, LARGEST_OF_A_REDUCTION))
    elif is_gpu:
        least = FRAMES_OF_A_GPU_BLOCK if run.model.plan.frame_storeys else GPU_BLOCK
        most = int(np.clip(WORK_OF_A_GPU_BLOCK / work, least, LARGEST_GPU_BLOCK))
    count = -(-samples // most)
    if is_gpu:
        count = max(count, min(BLOCKS_PER_GPU * len(devices), samples // LEAST_GPU_BLOCK))
    count = max(count, -(-structures // room))
    count = min(-(-count // len(devices)) * len(devices), structures)
    # Prefer blocks of whole rerun ranges (structures whose failed samples share one limit on reruns): such blocks need
    # no step counts of the samples that did not fail.
    together = structures_of_a_range(run.samples // run.structures)
    if min(structures // count, room) < LEAST_RANGES * together:
        together = 1
    units = -(-structures // together)
    count = max(count, -(-units // max(1, room // together)))
    size, larger = divmod(units, count)  # the first `larger` blocks have one more unit
    edges = [region.start + together * (place * size + min(place, larger)) for place in range(count + 1)]
    return [range(a, min(b, region.stop)) for a, b in pairwise(edges)]


def bytes_per_row(run: Run, columns: dict[str, Column]) -> int:
    """Return the number of bytes of one sample in the run's dataset."""
    return sum(column.dtype.itemsize * math.prod(lengths(run.model, column)) for column in columns.values())


def blocks_ahead(run: Run) -> int:
    """Return how many blocks are prepared on the host in parallel before a GPU is free for them; 0 on a CPU.

    One thread needs twice as long to prepare a block of short histories as a GPU needs to integrate it.
    """
    if not run.execution.is_gpu:
        return 0
    return len(run.execution.devices) * min(BLOCKS_AHEAD, max(1, run.execution.cores // 2))


def bytes_per_structure(run: Run, columns: dict[str, Column]) -> tuple[float, float]:
    """Return the bytes that one structure with all its samples needs in a block: (on the host, on a device)."""
    model = run.model
    width, real = model.plan.dofs, np.dtype(model.plan.dtype).itemsize
    row = bytes_per_row(run, columns)
    outputs = sum(real * width ** len(shape) for shape in model.shapes.values())
    drawn = run.first
    parameters = model.dynamics.parameters_of(drawn)
    steps = model.timeline.steps
    packed = packing.pack_structures(model, parameters, steps[:1], np.zeros((1, 2)))
    values = sum(array.size for array in packed.values())
    if model.needs_step:  # the parameters of a structure are packed once for each step
        values *= np.unique(steps).size
    drawn_values = sum(array.size for array in drawn.values())
    if len(run.samples_by_event) > 1:  # each sample of an event is a separate structure in the next event
        damaged = run.samples_by_event[-2] // run.structures
        values, drawn_values = values * damaged, drawn_values * damaged
        outputs *= 3  # copies: as read, merged with samples that were not run, and labelled
    elif not drawn:  # all samples share one structure
        values = 0
    samples = run.samples // run.structures
    host = samples * (row + outputs + BYTES_PER_SAMPLE) + 8 * COPIES_OF_A_STRUCTURE * (values + drawn_values)
    return host, samples * (2 * outputs + 8 * real) + 2 * real * values
