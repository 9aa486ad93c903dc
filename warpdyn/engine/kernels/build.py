"""Build the kernel of a plan; choose the lanes, the unrolling and the threads of a sample that suit a device."""

import functools
import gc
import threading
from collections.abc import Iterator
from contextlib import contextmanager
from dataclasses import replace

import warp as wp

from warpdyn.engine.device.processor import has_wide_registers
from warpdyn.engine.kernels.composing.user_recorders import Recorder, users_of
from warpdyn.engine.kernels.composition import Composed, compose, kernel_of
from warpdyn.engine.kernels.kernel_cache import THREADS_OF_A_BLOCK, loaded
from warpdyn.engine.kernels.parts import straight_branches
from warpdyn.engine.kernels.plan import Plan, keeps_slopes, options, values_held
from warpdyn.engine.kernels.skeletons.dense import integrate_dense
from warpdyn.engine.kernels.skeletons.explicit_chain import integrate_chain
from warpdyn.engine.kernels.skeletons.implicit_chain import integrate_implicit_chain
from warpdyn.engine.kernels.skeletons.propagated import advance_linear
from warpdyn.engine.laws.spring import Spring
from warpdyn.engine.laws.springs import spring_row
from warpdyn.engine.methods.table import METHODS

# (structure's family, method's kind) -> the skeleton that the kernel is composed from.
SKELETONS = {
    ("chain", "explicit"): integrate_chain,
    ("chain", "implicit"): integrate_implicit_chain,
    ("chain", "exact"): advance_linear,
    ("dense", "explicit"): integrate_dense,
    ("dense", "implicit"): advance_linear,
    ("dense", "exact"): advance_linear,
}


def composed(plan: Plan) -> Composed:
    """Return the text of a plan's kernel, with all that it names."""
    return compose(SKELETONS[plan.family, plan.kind], plan)


@functools.cache
def _composed_kernel(plan: Plan, users: tuple[type[Recorder], ...]) -> wp.Kernel:
    return kernel_of(composed(plan), options(plan), _threads_told(plan), is_lean=_is_lean(plan))


# Threads that load kernels side by side build them one after another: each plan has one kernel, and Python 3.11 cannot
# parse in two threads at once (SystemError: AST constructor recursion depth mismatch).
BUILDING = threading.Lock()

# Measured on AVX-512 and AVX2: rows of 16 samples fill the vector registers (32 where a single storey leaves them
# waiting for each other), and storey loops unroll well as long as those over lanes stay rolled.
# A GPU runs one sample a thread, every loop unrolled, so that the whole state stands in registers; where a chain needs
# more registers than there are, threads share it.
CPU_LANES, CPU_LANES_OF_ONE_STOREY, CPU_UNROLL = 16, 32, 8
# What 8 samples of a chain beyond 8 storeys hold stays in the first cache, and registers of 256 bits do for them. Rows
# of 16 floats are for registers of 512 bits. Measured at 10 and 20 storeys with peak drifts: on an Intel Xeon they run
# 1.5 to 1.7 times as fast; on an AMD EPYC between 1.5 times as fast (bilinear) and a seventh slower (Bouc-Wen). Up to
# 12 storeys their loop is unrolled, which makes elastic ones faster by half and compiles in 3 to 4 seconds, not in 2.
# A law of straight branches has its rules twice in every stage of every storey: beyond 5 storeys it runs half to three
# quarters as fast rolled, and compiles in 2 seconds, not in 20.
LONG_CHAIN, CPU_LONG_LANES, CPU_LONG_UNROLL, CPU_WIDE_UNROLL, CHAIN_OF_BRANCHES = 8, 8, 7, 12, 5
GPU_LANES, GPU_UNROLL = 1, 64
# Registers of a thread, by what compiled kernels of 1 to 60 storeys took; those beside the storeys' own, by dtype; and
# what sums of energies take [words]. Of laws that follow the accepted state alone the compiler finds room for more.
GPU_REGISTERS, BESIDE_STOREYS, BESIDE_ENERGIES = 246, {"float32": 45, "float64": 60}, 10
REGISTERS_OF_A_SIMPLE_LAW = 264
# Beyond this size the dense kernel's n x n loops would take half a minute and more to compile on a GPU. On a processor
# they run between a quarter faster and a third slower rolled, and compile in half a second where they took up to four.
GPU_UNROLLED_MATRIX = 8
UNROLLED_SLOPES = 40  # evaluations of storeys a step whose slopes are all kept
# A GPU's compiler that knows how many threads a block has orders instructions for fewer waits, with more registers: a
# gain of 2 to 6 % from three storeys on, and a loss of as much below, where the registers are what more threads lack.
STOREYS_OF_TOLD_THREADS = 3


def fitted(plan: Plan, is_gpu: bool) -> Plan:
    """Return a plan with the lanes of a thread, the unrolling and the threads of a sample that suit a device."""
    row = METHODS[plan.method]
    lanes, unroll, sections = (GPU_LANES, GPU_UNROLL, 1) if is_gpu else (CPU_LANES, CPU_UNROLL, 1)
    if plan.family == "dense" or SKELETONS[plan.family, row.kind] is advance_linear:
        unrolls = is_gpu and plan.dofs <= GPU_UNROLLED_MATRIX  # a processor gains little by it
    else:
        unrolls = row.kind != "explicit" or not keeps_slopes(row) or plan.dofs * row.stages <= UNROLLED_SLOPES
        if not is_gpu and row.kind == "explicit" and row.is_adaptive:
            unrolls = False  # it would run a third faster, and compile in five seconds instead of one
        if not is_gpu and row.kind == "implicit" and straight_branches.wanted(plan):
            # Unrolled it runs between a fifth faster and a fifth slower, and compiles in 5 to 8 seconds instead of 3.
            unrolls = False
        if row.kind == "explicit" and not keeps_slopes(row):
            spring = spring_row(plan.law)
            if is_gpu:
                sections = _sections(plan)
            elif plan.dofs == 1:
                lanes = CPU_LANES_OF_ONE_STOREY
            elif spring.leaves_line is not None:
                unroll = CPU_UNROLL if plan.dofs <= CHAIN_OF_BRANCHES else CHAIN_OF_BRANCHES
            elif plan.dofs > LONG_CHAIN:
                is_wide = plan.dtype == "float32" and has_wide_registers()
                lanes = CPU_LANES if is_wide else CPU_LONG_LANES
                unroll = CPU_WIDE_UNROLL if is_wide and plan.dofs <= CPU_WIDE_UNROLL else CPU_LONG_UNROLL
    return replace(plan, lanes=lanes, max_unroll=unroll if unrolls else 1, sections=sections)


def undivided(plan: Plan) -> Plan:
    """Return the plan for samples with one step in each interval of their motions.

    On a GPU their kernel has no loop over the steps of an interval, a tenth of its instructions for one storey.
    """
    is_alone = (plan.lanes, plan.max_unroll) == (GPU_LANES, GPU_UNROLL)
    gains = SKELETONS[plan.family, plan.kind] is integrate_chain and not METHODS[plan.method].is_adaptive
    return replace(plan, undivided=True) if is_alone and gains and plan.load == "base_acceleration" else plan


def _threads_told(plan: Plan) -> int | None:
    """Return the threads of a block that the compiler is told of; None if it had better not know."""
    return THREADS_OF_A_BLOCK if _is_alone_on_gpu(plan) and plan.dofs >= STOREYS_OF_TOLD_THREADS else None


def _is_lean(plan: Plan) -> bool:
    """Return whether a thread takes one row of a launch, without Warp's loop over further ones.

    Measured on an H200 with RK4 and peak drifts, of 1 to 20 storeys: with simple laws they run up to 6 % faster, and
    none more than 2 % slower; Bouc-Wen storeys lose 2 to 3 % by it.
    """
    return _is_alone_on_gpu(plan) and _is_simple(spring_row(plan.law))


def _is_alone_on_gpu(plan: Plan) -> bool:
    """Return whether a plan is for a chain on a GPU with one thread a sample."""
    return plan.family == "chain" and (plan.lanes, plan.max_unroll, plan.sections) == (GPU_LANES, GPU_UNROLL, 1)


def _is_simple(spring: Spring) -> bool:
    """Return whether a law follows the accepted state alone, with no more than one value of memory."""
    return spring.rate is None and spring.memory <= 1


def _sections(plan: Plan) -> int:
    """Return among how many threads a chain's storeys are shared so that all they hold stands in registers."""
    if plan.damping == "modal":
        return 1  # every floor feels every other one
    words = 2 if plan.dtype == "float64" else 1
    storey = words * sum(values_held(plan).values()) / plan.dofs
    beside = BESIDE_STOREYS[plan.dtype] + words * BESIDE_ENERGIES * ("energy" in plan.recorders)
    spring = spring_row(plan.law)
    room = GPU_REGISTERS
    if _is_simple(spring) and "energy" not in plan.recorders:
        # In float64 more threads, recorders or a collapse would make it keep some values in memory.
        is_bare = plan.recorders == ("drift",) and not plan.collapses
        if plan.dtype == "float32" or (is_bare and plan.dofs * storey + beside <= REGISTERS_OF_A_SIMPLE_LAW):
            room = REGISTERS_OF_A_SIMPLE_LAW
    sections = 1
    while -(-plan.dofs // sections) * storey + beside > room and sections < 32:
        sections *= 2
    return sections


def build_kernel(plan: Plan) -> wp.Kernel:
    """Return the kernel of a plan; the same plan gives the same kernel, in every thread."""
    with BUILDING, _without_collection():
        return _composed_kernel(plan, users_of(plan.recorders))


@contextmanager
def _without_collection() -> Iterator[None]:
    """Collect no garbage: syntax trees have no cycles, and the collector goes through all of them again and again."""
    was_enabled = gc.isenabled()
    gc.disable()
    try:
        yield
    finally:
        if was_enabled:
            gc.enable()


def load_kernel(plan: Plan, device: str) -> wp.Kernel:
    """Return the kernel of a plan, compiled for a device; threads may do so side by side."""
    return loaded(
        build_kernel(plan), device, f"{plan.family} {plan.dofs} {plan.law} {plan.method} {plan.dtype} for {device}"
    )


def history_plan(plan: Plan) -> Plan:
    """Return the plan that keeps whole histories of the same samples, one a thread, and nothing else."""
    # A thread alone has no registers for what several shared. On a processor histories are of a few samples: rolled,
    # they run up to half as long again, some milliseconds, and compile up to two seconds sooner.
    unroll = GPU_UNROLL if plan.max_unroll == GPU_UNROLL and plan.sections == 1 else 1
    return replace(plan, recorders=("history",), lanes=1, sections=1, max_unroll=unroll)
