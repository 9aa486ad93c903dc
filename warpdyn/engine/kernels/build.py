"""Build the kernel of a plan, and adapt the plan to a device.

A plan contains all properties of a scene that decide the source of its kernel. Adapting the plan to a device sets the
number of samples per thread (lanes), the unrolling of loops, and the number of GPU threads that share a sample.
"""

import functools
import threading
from dataclasses import replace

import warp as wp

from warpdyn.engine.device.processor import has_wide_registers
from warpdyn.engine.kernels.composing.source_text import name_of
from warpdyn.engine.kernels.composing.user_recorders import Recorder, users_of
from warpdyn.engine.kernels.composition import Composed, compose, kernel_of
from warpdyn.engine.kernels.hinges.column_storeys import has_joint_springs
from warpdyn.engine.kernels.hinges.frame_storeys import has_yielding_members
from warpdyn.engine.kernels.kernel_cache import THREADS_OF_A_BLOCK, loaded
from warpdyn.engine.kernels.lumped.division import can_share_frame, divided_storeys, sections_of_storeys
from warpdyn.engine.kernels.parts import straight_branches
from warpdyn.engine.kernels.pausing.paused_text import Pausing, pausing
from warpdyn.engine.kernels.plan import (
    DTYPES,
    Plan,
    has_few_values,
    has_joints,
    keeps_drifts,
    keeps_slopes,
    options,
    paused_struct,
    values_held,
)
from warpdyn.engine.kernels.registry import all_parts
from warpdyn.engine.kernels.skeletons.dense import integrate_dense
from warpdyn.engine.kernels.skeletons.explicit_chain import integrate_chain
from warpdyn.engine.kernels.skeletons.explicit_lumped import integrate_lumped
from warpdyn.engine.kernels.skeletons.implicit_chain import integrate_implicit_chain
from warpdyn.engine.kernels.skeletons.propagated import advance_linear
from warpdyn.engine.laws.spring import Spring
from warpdyn.engine.laws.springs import spring_row
from warpdyn.engine.methods.table import METHODS

# (family of the structure, kind of the method) -> skeleton of the kernel.
SKELETONS = {
    ("chain", "explicit"): integrate_chain,
    ("chain", "implicit"): integrate_implicit_chain,
    ("chain", "exact"): advance_linear,
    ("lumped", "explicit"): integrate_lumped,
    ("lumped", "implicit"): integrate_lumped,
    ("dense", "explicit"): integrate_dense,
    ("dense", "implicit"): advance_linear,
    ("dense", "exact"): advance_linear,
}


def composed(plan: Plan) -> Composed:
    """Return the source of a plan's kernel, and the constants, types and functions to which the names in it refer."""
    return pausing_of(plan).composed if plan.pauses else compose(SKELETONS[plan.family, plan.kind], plan)


@functools.cache
def pausing_of(plan: Plan) -> Pausing:
    """Return the source of a plan's kernel that can pause, and the variables that it loads and stores."""
    skeleton = SKELETONS[plan.family, plan.kind]
    parts = {name_of(part) for part in all_parts() if part.wanted(plan)} | {skeleton.__module__.rpartition(".")[2]}
    given = plan.lanes, DTYPES[plan.dtype], plan.sections
    return pausing(compose(skeleton, plan), parts, paused_struct(plan.dtype), *given)


@functools.cache
def _composed_kernel(plan: Plan, users: tuple[type[Recorder], ...]) -> wp.Kernel:
    return kernel_of(composed(plan), options(plan), _known_block(plan), is_lean=_is_lean(plan))


# Only one thread at a time builds a kernel, so that each plan has one kernel, and because Python 3.11 cannot parse in
# two threads at once (SystemError: AST constructor recursion depth mismatch).
BUILDING = threading.Lock()

# Measured with AVX-512 and AVX2: 16 lanes fill the vector registers (32 lanes for a single storey, where each operation
# waits for the last one). Storey loops may be unrolled if the loops over lanes are not. On a GPU a thread runs one
# sample with all loops unrolled, so that the state is in registers. If a chain needs more registers than a thread has,
# several threads share the chain.
CPU_LANES, CPU_LANES_OF_ONE_STOREY, CPU_UNROLL = 16, 32, 8
# Above 8 storeys, 8 samples fit in the L1 cache and fill 256-bit registers; 16 floats fill 512-bit registers. Measured
# for 10 and 20 storeys with peak drifts, 16 instead of 8 lanes: 1.5 to 1.7 times as fast on an Intel Xeon; on an AMD
# EPYC 1.5 times as fast (bilinear) to 1/7 slower (Bouc-Wen). Up to 12 storeys the storey loop is unrolled: elastic
# storeys run 1.5 times as fast and compile in 3 to 4 s instead of 2 s. The kernel of a law with straight branches
# contains the code of the law twice per storey and stage. Above 5 storeys the storey loop of such laws is not unrolled:
# they run 0.5 to 0.75 times as fast, but compile in 2 s instead of 20 s.
# Multistep methods: on an AMD EPYC with AVX-512, kernels of five storeys take 0.5 to 0.7 of the time if the storey loop
# is unrolled (laws with few values), and 0.9 to 1.1 (other laws; a kernel of pinching4 that LLVM does not vectorise
# otherwise: 0.16). In 256-bit registers the time is the same, so shorter code is preferred.
LONG_CHAIN, CPU_LONG_LANES, CPU_LONG_UNROLL, CPU_WIDE_UNROLL, CHAIN_OF_BRANCHES = 8, 8, 7, 12, 5
GPU_LANES, GPU_UNROLL = 1, 64
# Registers of a thread; registers that are not available to storeys, for each dtype; and words for the sums of
# energies. Measured with compiled kernels of 1 to 60 storeys. Laws that read only the accepted state leave more
# registers free.
GPU_REGISTERS, BESIDE_STOREYS, BESIDE_ENERGIES = 246, {"float32": 45, "float64": 60}, 10
REGISTERS_OF_A_SIMPLE_LAW = 264
# Above this size the n x n loops of the dense kernel would take 30 s and more to compile for a GPU. On a processor
# loops that are not unrolled run 1/4 faster to 1/3 slower, and compile in 0.5 s instead of up to 4 s.
GPU_UNROLLED_MATRIX = 8
# Largest number of springs and degrees of freedom for which a GPU's loops are unrolled. Compiled for an H100, with
# bilinear springs and peak deformations: 16 springs and 12 degrees of freedom fit in registers (80 bytes do not without
# unrolling), of 20 springs 72 bytes do not (304); of 32 springs 1,000 bytes do not in both cases.
UNROLLED_SPRINGS = 20
# Loops of frames with several bays. The stages of a method are not unrolled: each contains the search for massless
# rotations, which would compile in minutes.
FRAME_UNROLL = 3
# If the threads of a GPU's warp share a frame or a fish-bone, each has the loops of one storey, which are unrolled.
SHARED_UNROLL = 512
UNROLLED_SLOPES = 40  # methods that keep all slopes: largest storeys times stages for which loops are unrolled
# If the GPU's compiler knows the number of threads per block, it uses more registers and waits less: from 3 storeys on
# kernels run 2 to 6 % faster. Below 3 storeys they lose as much, because registers then limit how many threads run.
STOREYS_OF_KNOWN_BLOCKS = 3
# Frames with bilinear hinges and up to four column lines in float32: blocks that run at once on a multiprocessor. Four
# leave 128 registers for each thread. Measured on an H200 for 10,000 frames of ten storeys and three bays: 0.051 s with
# 128 registers, 0.054 s with 168, and 0.055 s with as many as the compiler wants (225). If peaks of hinges are
# recorded, 160 values of 4 bytes do not fit in 128 registers and are in local memory; without a limit, 24.
LINES_OF_FULL_BLOCKS, BLOCKS_OF_YIELDING_MEMBERS = 4, 4


def fitted(plan: Plan, is_gpu: bool) -> Plan:
    """Return the plan, adapted to a CPU or a GPU.

    The returned plan contains the number of samples per thread (lanes), the largest loop that is unrolled, and the
    number of threads that share the storeys of a sample (sections).
    """
    row = METHODS[plan.method]
    if plan.pattern is not None:
        return _fitted_lumped(plan, is_gpu)
    lanes, unroll, sections = (GPU_LANES, GPU_UNROLL, 1) if is_gpu else (CPU_LANES, CPU_UNROLL, 1)
    if plan.family == "dense" or SKELETONS[plan.family, row.kind] is advance_linear:
        unrolls = is_gpu and plan.dofs <= GPU_UNROLLED_MATRIX
    else:
        unrolls = row.kind != "explicit" or not keeps_slopes(row) or plan.dofs * row.stages <= UNROLLED_SLOPES
        if not is_gpu and row.kind == "explicit" and row.is_adaptive:
            unrolls = False  # unrolled loops run 1/3 faster, but compile in 5 s instead of 1 s
        if not is_gpu and row.kind == "implicit" and straight_branches.wanted(plan):
            # Unrolled loops run 1/5 faster to 1/5 slower, and compile in 5 to 8 s instead of 3 s.
            unrolls = False
        if row.kind == "explicit" and not keeps_slopes(row):
            spring = spring_row(plan.law)
            if is_gpu:
                sections = _sections(plan)
            elif plan.dofs == 1:
                lanes = CPU_LANES_OF_ONE_STOREY
            elif row.kind == "explicit" and keeps_drifts(plan):
                is_wide = plan.dtype == "float32" and has_wide_registers()
                longest = LONG_CHAIN if has_few_values(plan) else CHAIN_OF_BRANCHES
                unroll = CPU_UNROLL if is_wide and plan.dofs <= longest else 1
                if plan.dtype == "float64" and plan.dofs > LONG_CHAIN:
                    lanes = CPU_LONG_LANES
            elif spring.leaves_line is not None:
                unroll = CPU_UNROLL if plan.dofs <= CHAIN_OF_BRANCHES else CHAIN_OF_BRANCHES
            elif plan.dofs > LONG_CHAIN:
                is_wide = plan.dtype == "float32" and has_wide_registers()
                lanes = CPU_LANES if is_wide else CPU_LONG_LANES
                unroll = CPU_WIDE_UNROLL if is_wide and plan.dofs <= CPU_WIDE_UNROLL else CPU_LONG_UNROLL
    return replace(plan, lanes=lanes, max_unroll=unroll if unrolls else 1, sections=sections)


def _fitted_lumped(plan: Plan, is_gpu: bool) -> Plan:
    """Return the plan of a lumped structure with the number of lanes and the unrolling for a CPU or a GPU."""
    largest = max(plan.dofs, plan.pattern.springs if plan.pattern else 0)
    plan = replace(plan, sections=1, by_storey=False)
    if can_share_frame(plan):
        if is_gpu:
            return replace(plan, lanes=GPU_LANES, max_unroll=SHARED_UNROLL, sections=plan.dofs, by_storey=True)
        lanes = CPU_LANES if plan.dtype == "float32" else CPU_LONG_LANES
        return replace(plan, lanes=lanes, max_unroll=FRAME_UNROLL, by_storey=True)
    if plan.kind == "implicit":  # the search of one sample must not wait for others; its loops are long
        return replace(plan, lanes=1, max_unroll=1)
    if is_gpu:
        sections = sections_of_storeys(plan)
        if sections > 1:
            return replace(plan, lanes=GPU_LANES, max_unroll=GPU_UNROLL, sections=sections, by_storey=True)
    elif divided_storeys(plan) is not None:
        plan = replace(plan, by_storey=True)
    if is_gpu:
        unrolls = largest <= UNROLLED_SPRINGS and not has_joints(plan)
        # Compiled in 5 s for ten storeys. Stages of other methods would be unrolled, too (rk4: 14 s, otherwise 2 s).
        unrolls = unrolls or (has_joint_springs(plan) and keeps_drifts(plan) and plan.dofs <= UNROLLED_SPRINGS)
        return replace(plan, lanes=GPU_LANES, max_unroll=GPU_UNROLL if unrolls else 1)
    if has_joints(plan):
        return replace(plan, lanes=CPU_LANES if plan.dtype == "float32" else CPU_LONG_LANES, max_unroll=FRAME_UNROLL)
    is_small = largest <= LONG_CHAIN
    lanes = CPU_LANES if is_small or plan.dtype == "float32" else CPU_LONG_LANES
    return replace(plan, lanes=lanes, max_unroll=CPU_UNROLL if is_small else CPU_LONG_UNROLL)


def undivided(plan: Plan) -> Plan:
    """Return the plan for motions that were resampled to one value for each integration step.

    The kernel of this plan on a GPU has no loop over the steps between two values of a motion. Measured on an H100 for
    motions with two steps between two values: kernels of "stoermer" take 0.43 to 0.97 of the time (1 to 20 storeys),
    and kernels of "rk4" take 0.94 to 1.02. Other plans, such as those for a CPU, for other loads or for adaptive
    methods, are returned unchanged.
    """
    is_alone = (plan.lanes, plan.max_unroll) == (GPU_LANES, GPU_UNROLL)
    gains = SKELETONS[plan.family, plan.kind] is integrate_chain and not METHODS[plan.method].is_adaptive
    gains = gains or plan.storeys is not None or has_joint_springs(plan)
    return replace(plan, undivided=True) if is_alone and gains and plan.load == "base_acceleration" else plan


def as_in_live(plan: Plan, *, is_gpu: bool) -> Plan:
    """Return the plan of a run of `simulate` that has the bits of a live ensemble on the same device.

    On a GPU, the compiler fuses products and sums of laws with many rules in another way if the kernel can pause (peak
    drifts differed by up to 4e-4 in float32 and 4e-12 in float64). `simulate` then uses the kernel that can pause, too,
    which took 0.97 to 1.00 of the time on an H200. On a CPU this holds for fish-bones with springs of joints (2e-7 in
    float32; 1.03 of the time).
    """
    has_many_rules = spring_row(plan.law).leaves_line is not None
    is_live = plan.family == "chain" and plan.kind == "explicit" and plan.load == "base_acceleration"
    joins_hinges = has_joint_springs(plan) and plan.load == "base_acceleration"
    can_differ = has_many_rules and is_live if is_gpu else joins_hinges
    return replace(plan, pauses=True) if can_differ else plan


def _known_block(plan: Plan) -> int | tuple[int, int] | None:
    """Return what the GPU compiler may assume for a plan: threads per block, or these and the blocks to run at once.

    None: no assumption.
    """
    keeps_hinges = "spring" in plan.recorders  # with their values, 128 registers are too few
    if has_yielding_members(plan) and plan.dtype == "float32" and not keeps_hinges:
        if plan.frame_storeys.lines <= LINES_OF_FULL_BLOCKS:
            return THREADS_OF_A_BLOCK, BLOCKS_OF_YIELDING_MEMBERS
    return THREADS_OF_A_BLOCK if _is_alone_on_gpu(plan) and plan.dofs >= STOREYS_OF_KNOWN_BLOCKS else None


def _is_lean(plan: Plan) -> bool:
    """Return whether the kernel of a plan omits Warp's loop in which a GPU thread processes several samples.

    Measured on an H200 with RK4, peak drifts and 1 to 20 storeys: without the loop, kernels of simple laws run 2 %
    slower to 6 % faster; kernels of Bouc-Wen storeys run 2 to 3 % slower.
    """
    return _is_alone_on_gpu(plan) and _is_simple(spring_row(plan.law))


def _is_alone_on_gpu(plan: Plan) -> bool:
    """Return whether a plan is for a chain on a GPU with one thread per sample."""
    return plan.family == "chain" and (plan.lanes, plan.max_unroll, plan.sections) == (GPU_LANES, GPU_UNROLL, 1)


def _is_simple(spring: Spring) -> bool:
    """Return whether a storey law reads only the accepted state and remembers at most one value per storey."""
    return spring.rate is None and spring.memory <= 1


def _sections(plan: Plan) -> int:
    """Return the number of GPU threads that share the storeys of a chain, so that their values fit in registers."""
    if plan.control is not None:
        return 1  # sensors of all floors, and a controller
    if plan.damping == "modal":
        return 1  # modal damping: the damping force of each floor depends on all floors
    if plan.oscillators:
        return 1  # the oscillators of a floor are in local memory anyway
    words = 2 if plan.dtype == "float64" else 1
    storey = words * sum(values_held(plan).values()) / plan.dofs
    beside = BESIDE_STOREYS[plan.dtype] + words * BESIDE_ENERGIES * ("energy" in plan.recorders)
    spring = spring_row(plan.law)
    room = GPU_REGISTERS
    if _is_simple(spring) and "energy" not in plan.recorders:
        # In float64 other recorders or a collapse limit would move values from registers to memory.
        is_bare = plan.recorders == ("drift",) and not plan.collapses
        if plan.dtype == "float32" or (is_bare and plan.dofs * storey + beside <= REGISTERS_OF_A_SIMPLE_LAW):
            room = REGISTERS_OF_A_SIMPLE_LAW
    sections = 1
    while -(-plan.dofs // sections) * storey + beside > room and sections < 32:
        sections *= 2
    return sections


def build_kernel(plan: Plan) -> wp.Kernel:
    """Return the kernel of a plan, not yet compiled; equal plans share one kernel."""
    with BUILDING:
        return _composed_kernel(plan, users_of(plan.recorders))


def load_kernel(plan: Plan, device: str) -> wp.Kernel:
    """Return the kernel of a plan, compiled for a device and loaded; several threads may call this function at once."""
    return loaded(
        build_kernel(plan), device, f"{plan.family} {plan.dofs} {plan.law} {plan.method} {plan.dtype} for {device}"
    )


def history_plan(plan: Plan) -> Plan:
    """Return the plan of the kernel that records only response histories, for the samples of `plan`, one per thread."""
    # One thread has too few registers for a chain that several threads share, so its loops are not unrolled. On a CPU
    # only a few samples have histories: without unrolling, they take up to 1.5 times as long (some milliseconds more),
    # and the kernel compiles up to 2 s faster.
    unroll = GPU_UNROLL if plan.max_unroll == GPU_UNROLL and plan.sections == 1 else 1
    whole = replace(plan, pauses=False)
    return replace(whole, recorders=("history",), lanes=1, sections=1, max_unroll=unroll, by_storey=False)
