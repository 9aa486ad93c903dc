"""Kernels by plan: which factory builds one, how many samples a thread carries, how far loops are unrolled."""

from dataclasses import replace

import warp as wp

from warpdyn.kernels.chain import chain_kernel
from warpdyn.kernels.dense import dense_kernel
from warpdyn.kernels.implicit_chain import implicit_chain_kernel
from warpdyn.kernels.linear import linear_kernel
from warpdyn.kernels.plan import Plan, keeps_slopes
from warpdyn.methods import METHODS

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
