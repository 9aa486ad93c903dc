"""How the storeys of a lumped structure are divided among the threads of a GPU."""

from __future__ import annotations

from collections.abc import Iterable

from warpdyn.engine.kernels.hinges.column_storeys import has_line
from warpdyn.engine.kernels.hinges.frame_storeys import frame_storeys
from warpdyn.engine.kernels.hinges.layout import JointFrame
from warpdyn.engine.kernels.loads import LOADS
from warpdyn.engine.kernels.lumped.pattern import ColumnLine
from warpdyn.engine.kernels.lumped.storeys import Storeys, storeys_of
from warpdyn.engine.kernels.plan import WARP, Plan, keeps_drifts, values_held
from warpdyn.engine.laws.springs import is_mixed

# Recorders whose values belong to a storey; others sum up values of all storeys, or record histories of few samples.
OF_STOREYS = {"spring", "output", "displacement", "acceleration", "residual", "drift"}
# Recorders of frames with hinges whose members are divided among threads.
OF_FRAMES = {"spring", "output", "displacement", "acceleration", "drift"}
# Values that a thread holds at most, so that its storeys, its other values and its temporary ones fit in registers.
MOST_VALUES = {"float32": 130, "float64": 60}
SHARED_WORK = 0.5  # work of a thread besides its storeys, relative to the work of a storey


def divided_storeys(plan: Plan) -> Storeys | None:
    """Return the storeys of a structure that several threads can share; None if one thread computes a sample."""
    if (
        plan.pattern is None
        or plan.kind != "explicit"
        or plan.control is not None
        or not set(plan.recorders) <= OF_STOREYS
    ):
        return None
    if plan.collapses or plan.resumes or plan.starts_displaced or not LOADS[plan.load].is_base:
        return None
    storeys = storeys_of(plan.pattern)
    return None if storeys is None or ("output" in plan.recorders and not storeys.outputs) else storeys


def has_grid_kernel(line: object, recorders: Iterable[str]) -> bool:
    """Return whether the kernel of grids supports the joints and members of a frame with hinges, and the recorders."""
    if not isinstance(line, JointFrame | ColumnLine) or not set(recorders) <= OF_FRAMES:
        return False
    storeys = frame_storeys(line)
    return storeys is not None and storeys.count <= WARP


def can_share_frame(plan: Plan) -> bool:
    """Return whether the kernel of grids supports a plan; on a GPU the threads of a warp then share a frame."""
    if not has_line(plan) or not keeps_drifts(plan) or plan.control is not None or is_mixed(plan.law):
        return False
    if plan.pauses or plan.resumes or plan.starts_displaced:
        return False
    return has_grid_kernel(plan.pattern.line, plan.recorders)


def sections_of_storeys(plan: Plan) -> int:
    """Return the number of threads that share a sample; 1 if one thread computes all storeys.

    Threads have as many storeys as fit in registers, because each thread has the work of reading the motion and of
    exchanging values once; but most threads of a warp should have storeys.
    """
    storeys = divided_storeys(plan)
    if storeys is None or "drift" in plan.recorders:  # one thread compares all springs of a sample
        return 1
    held = sum(values_held(plan).values()) / storeys.count
    best, least = 1, float("inf")
    for sections in range(2, min(storeys.count, WARP) + 1):
        if storeys.count % sections:
            continue
        of_thread = storeys.count // sections
        if of_thread > 1 and of_thread * held > MOST_VALUES[plan.dtype]:
            continue
        cost = (of_thread + SHARED_WORK) / (WARP // sections)
        if cost < least:
            best, least = sections, cost
    return best
