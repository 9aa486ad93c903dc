"""Kernels by plan, their arguments as structs, and launches spread over a processor's threads."""

import os
from collections.abc import Callable
from concurrent.futures import ThreadPoolExecutor, as_completed
from dataclasses import replace
from itertools import pairwise

import numpy as np
import warp as wp

from warpdyn.kernels.chain import chain_kernel
from warpdyn.kernels.dense import dense_kernel
from warpdyn.kernels.implicit_chain import implicit_chain_kernel
from warpdyn.kernels.linear import linear_kernel
from warpdyn.kernels.plan import Plan, keeps_slopes, structs
from warpdyn.methods import METHODS
from warpdyn.recorders import DIVERGED

# (structure's family, method's kind) -> kernel factory.
FAMILIES = {
    ("chain", "explicit"): chain_kernel,
    ("chain", "implicit"): implicit_chain_kernel,
    ("chain", "exact"): linear_kernel,
    ("dense", "explicit"): dense_kernel,
    ("dense", "implicit"): linear_kernel,
    ("dense", "exact"): linear_kernel,
}

# Measured on AVX-512 and AVX2: rows of 16 samples fill the vector registers, and storey loops of up to 8 unroll well.
# A GPU runs one sample a thread, every loop unrolled, so that the whole state stands in registers.
CPU_LANES, CPU_UNROLL = 16, 8
GPU_LANES, GPU_UNROLL = 1, 64
# Beyond these sizes the dense kernel's n x n loops would take half a minute and more to compile.
CPU_UNROLLED_MATRIX, GPU_UNROLLED_MATRIX = 4, 8
UNROLLED_SLOPES = 40  # evaluations of storeys a step whose slopes are all kept
THREADS_OF_A_BLOCK = 128
SLICES_A_THREAD = 8  # short last slices keep all threads busy to the end


def lanes_and_unroll(family: str, dofs: int, method: str, is_gpu: bool) -> tuple[int, int]:
    """Return how many samples a thread carries, and how far loops are unrolled before the compiler sees them."""
    lanes, unroll, largest = (
        (GPU_LANES, GPU_UNROLL, GPU_UNROLLED_MATRIX) if is_gpu else (CPU_LANES, CPU_UNROLL, CPU_UNROLLED_MATRIX)
    )
    row = METHODS[method]
    if FAMILIES[family, row.kind] is linear_kernel:
        unrolls = is_gpu and dofs <= largest  # a processor gains nothing by it
    elif family == "dense":
        unrolls = dofs <= largest
    else:
        unrolls = row.kind != "explicit" or not keeps_slopes(row) or dofs * row.stages <= UNROLLED_SLOPES
    return lanes, unroll if unrolls else 1


def build_kernel(plan: Plan) -> wp.Kernel:
    """Return the kernel of a plan; the same plan gives the same kernel."""
    return FAMILIES[plan.family, METHODS[plan.method].kind](plan)


def load_kernel(plan: Plan, device: str) -> wp.Kernel:
    """Return the kernel of a plan, compiled for a device; threads may do so side by side."""
    kernel = build_kernel(plan)
    warp_device = wp.get_device(device)
    kernel.module.load(warp_device, block_dim=THREADS_OF_A_BLOCK if warp_device.is_cuda else 1)
    return kernel


def history_plan(plan: Plan) -> Plan:
    """Return the plan that keeps whole histories of the same samples, one a thread, and nothing else."""
    return replace(plan, recorders=("history",), lanes=1)


def checked_device(device: str | None) -> str:
    """Return the device asked for, or by default the first GPU, or the CPU where there is none.

    Raises:
        ValueError: If there is no such device; the message lists those there are.
    """
    available = ["cpu", *(f"cuda:{i}" for i in range(wp.get_cuda_device_count()))]
    if device is None:
        return available[1] if len(available) > 1 else "cpu"
    if device not in available:
        raise ValueError(f"no device {device!r} here; available: {', '.join(available)}")
    return device


def cores() -> int:
    """Return the number of processor cores that this process may use."""
    return len(os.sched_getaffinity(0)) if hasattr(os, "sched_getaffinity") else os.cpu_count() or 1


def device_name(device: str) -> str:
    """Return the device and its maker's name, as the dataset tells them."""
    return f"{device} ({wp.get_device(device).name})"


def free_memory(device: str) -> int:
    """Return the memory that is free on a device [bytes]."""
    if device != "cpu":
        return wp.get_device(device).free_memory
    try:
        return os.sysconf("SC_AVPHYS_PAGES") * os.sysconf("SC_PAGE_SIZE")
    except (AttributeError, ValueError, OSError):  # systems that do not tell: a modest guess
        return 2**30


def blank_output(shapes: dict[str, tuple[int, ...]], samples: int, dtype: str, device: str) -> object:
    """Return outputs that say nothing yet: NaN, -1, and the status diverged, so that a sample never run shows."""
    struct = structs(dtype).Output
    instance = struct()
    for name, shape in shapes.items():
        scalar = struct.vars[name].type.dtype
        fill = DIVERGED if name == "status" else -1 if scalar is wp.int32 else float("nan")
        setattr(instance, name, wp.full((*shape, samples), fill, dtype=scalar, device=device))
    return instance


def fill_struct(kind: str, arrays: dict[str, np.ndarray], dtype: str, device: str) -> object:
    """Return a struct of `structs` with these arrays copied to the device, each as the type its field has."""
    struct = getattr(structs(dtype), kind)
    instance = struct()
    for name, values in arrays.items():
        field = struct.vars[name].type
        values = np.ascontiguousarray(values, dtype=wp.dtype_to_numpy(field.dtype))
        setattr(instance, name, wp.array(values, dtype=field.dtype, device=device))
    return instance


def control(dtype: str, **values: float) -> object:
    """Return the scalars of a launch as the kernels take them."""
    instance = structs(dtype).Control()
    for name, value in values.items():
        setattr(instance, name, value)
    return instance


def read_array(instance: object, name: str) -> np.ndarray:
    """Return one of a struct's arrays as a NumPy array."""
    return getattr(instance, name).numpy()


def launch(
    plan: Plan,
    samples: int,
    arguments: list,
    device: str,
    threads: int,
    advance: Callable[[int], None],
) -> None:
    """Launch a kernel over blocks of samples and wait; on a CPU in slices over threads.

    Args:
        plan: The kernel's plan.
        samples: Samples in this launch.
        arguments: The kernel's arguments after `first_block`.
        device: Warp device.
        threads: Threads of a CPU launch.
        advance: Called with the number of samples done since its last call.
    """
    kernel = load_kernel(plan, device)  # before the threads, which would each compile it
    blocks = -(-samples // plan.lanes)
    if wp.get_device(device).is_cuda:
        wp.launch(kernel, dim=blocks, inputs=[0, *arguments], device=device, block_dim=THREADS_OF_A_BLOCK)
        wp.synchronize_device(device)
        advance(samples)
        return

    def run(first: int, last: int) -> int:
        wp.launch(kernel, dim=last - first, inputs=[first, *arguments], device=device)
        return min(last * plan.lanes, samples) - first * plan.lanes

    edges = np.unique(np.linspace(0, blocks, min(blocks, threads * SLICES_A_THREAD) + 1).astype(int))
    with ThreadPoolExecutor(threads) as pool:
        for done in as_completed([pool.submit(run, a, b) for a, b in pairwise(edges)]):
            advance(done.result())
