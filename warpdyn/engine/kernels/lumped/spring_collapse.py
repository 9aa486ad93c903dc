"""Collapse of a lumped structure: a sample ends when the deformation of a spring exceeds its capacity.

The capacity of a spring of a storey is the smaller of two deformations: its own capacity, and the limit of the drift
ratio times the storey height.

The instant of collapse, and the status if the deformation changes by more than half the capacity in the last step, are
those of `parts/collapse.py`. Peaks of deformations count up to the instant of collapse, other peaks up to the last
state before it.
"""

from warpdyn.engine.device.warp_exchange import across_warp
from warpdyn.engine.kernels.parts.collapse import share_beyond

order = 10

BORROWS = {"spring": ("peak_deformation",), "storey_members": ("first_of_frame", "is_idle")}
FIELDS = {
    "Structure": {"inverse_drift_capacity": "float[,]"},  # of the springs, [spring, structure]; 0: no capacity
    "Output": {"time_of_collapse": "float[]", "spring_of_collapse": "int32[]", "storey_of_collapse": "int32[]"},
}


def wanted(plan):
    return plan.collapses and plan.pattern is not None


def names(plan):
    import warp as wp

    from warpdyn.engine.device.warp_exchange import number_at
    from warpdyn.engine.kernels.plan import DTYPES

    pattern = plan.pattern
    storey_of = {spring: number for number, own in enumerate(pattern.storeys, start=1) for spring in own}
    rows = limited_springs(plan)
    listed = number_at([storey_of.get(spring, -1) for spring in range(pattern.springs)])
    return {
        "LIMITED": rows,
        "limited_rows": wp.types.matrix(shape=(rows, plan.lanes), dtype=DTYPES[plan.dtype]),
        "longest_move": wp.constant(DTYPES[plan.dtype](0.5)),
        "HAS_CAPACITY": plan.has_drift_capacity,
        "HAS_STOREYS": bool(pattern.storeys),
        "storey_of_spring": listed,  # counted from 1; -1: the spring belongs to no storey
    }


def values_held(plan):
    return 2 * limited_springs(plan) + 7


def limited_springs(plan):
    """Return the number of springs that are compared with a capacity, or whose deformation a recorder needs."""
    # Hinges of frames have no capacity, but the recorder of springs needs their deformations at the collapse.
    has_hinges = plan.pattern.line is not None and not plan.has_drift_capacity and "spring" not in plan.recorders
    return plan.storeys_of_thread if has_hinges else plan.springs_of_thread


def declare():
    inverse_capacity = limited_rows()  # 0: no capacity
    earlier_deformation = limited_rows()  # at the start of the step
    over = row()  # the largest ratio of deformation to capacity
    collapse_time = row()  # negative before the collapse
    collapse_spring = row()  # counted from 1
    past_share = row()  # share of the last step that follows the collapse
    largest_share = row()  # share of the present step after the first spring has passed its capacity
    first_spring = row()  # this spring, counted from 1; 0: no spring
    move = row()  # largest change of a deformation in that step over its capacity, among springs that passed it
    stands = row()  # 1; 0 once the lane has collapsed
    last_interval = indices()  # the last interval whose states are recorded


def read_spring_row():
    if HAS_CAPACITY:
        inverse_capacity[i, j] = structures.inverse_drift_capacity[number_of_spring, s]
    if HAS_STOREYS:
        if i < LIMITED:
            own_storey = storey_of_spring(number_of_spring)
            if own_storey > 0:
                of_ratio = structures.inverse_height[own_storey - 1, s] / control.collapse_drift_ratio
                inverse_capacity[i, j] = larger(inverse_capacity[i, j], of_ratio)


def start():
    for i in range(LIMITED):
        for j in range(LANES):
            ratio_at_start = wp.abs(deformation[i, j]) * inverse_capacity[i, j]
            if ratio_at_start > over[j]:
                over[j] = ratio_at_start
                collapse_spring[j] = dtype(number_of_spring + 1)
    for j in range(LANES):
        if THREADS > 1:
            ratio_of_thread = over[j]
            over[j] = over_frame(ratio_of_thread, first_of_frame, THREADS)
            named_at_start = wp.where(ratio_of_thread >= over[j], collapse_spring[j], dtype(0.0))
            collapse_spring[j] = over_frame(named_at_start, first_of_frame, THREADS)
        collapse_time[j] = wp.where(over[j] > dtype(1.0), dtype(0.0), dtype(-1.0))
        stands[j] = dtype(1.0)
        last_interval[j] = wp.where(over[j] > dtype(1.0), 0, live_intervals[j])
        if THREADS > 1:  # an idle thread waits for no frame
            last_interval[j] = wp.where(is_idle > 0, -1, last_interval[j])


def begin_interval():
    standing = int(0)
    for j in range(LANES):
        if interval <= last_interval[j]:
            standing = 1
    if THREADS > 1:  # threads of a warp exchange values
        standing = across_warp(standing)


def stop_lane():
    if collapse_time[j] >= dtype(0.0):
        h[j] = dtype(0.0)


def see_spring():
    if i < LIMITED:
        earlier_deformation[i, j] = drift


def end_step():
    some_pass = int(0)
    for j in range(LANES):
        over[j] = dtype(0.0)
        if collapse_time[j] >= dtype(0.0):
            stands[j] = dtype(0.0)
    for i in range(LIMITED):
        for j in range(LANES):
            over[j] = larger(over[j], wp.abs(deformation[i, j]) * inverse_capacity[i, j])
    for j in range(LANES):
        some_pass = some_pass | wp.where(over[j] * stands[j] > dtype(1.0), 1, 0)
    if THREADS > 1:
        some_pass = across_warp(some_pass)
    if some_pass > 0:
        for j in range(LANES):
            largest_share[j] = dtype(0.0)
            first_spring[j] = dtype(0.0)
            slot("find_first_to_pass")
            if THREADS > 1:
                slot("compare_sections")
            if over[j] * stands[j] > dtype(1.0):
                slot("collapse_here")


def find_first_to_pass():
    for i in range(LIMITED):
        share = share_beyond(earlier_deformation[i, j], deformation[i, j], inverse_capacity[i, j])
        change = wp.abs(deformation[i, j] - earlier_deformation[i, j]) * inverse_capacity[i, j]
        move[j] = larger(move[j], wp.where(share > dtype(0.0), change * stands[j], dtype(0.0)))
        if share > largest_share[j]:
            largest_share[j] = share
            first_spring[j] = dtype(number_of_spring + 1)


def compare_sections():
    over[j] = over_frame(over[j], first_of_frame, THREADS)
    move[j] = over_frame(move[j], first_of_frame, THREADS)
    share_of_thread = largest_share[j]
    largest_share[j] = over_frame(share_of_thread, first_of_frame, THREADS)
    first_spring[j] = wp.where(share_of_thread >= largest_share[j], first_spring[j], dtype(0.0))
    first_spring[j] = over_frame(first_spring[j], first_of_frame, THREADS)


def collapse_here():
    past_share[j] = largest_share[j]
    collapse_spring[j] = first_spring[j]
    if SPRING:
        for i in range(ROWS):
            change = deformation[i, j] - earlier_deformation[i, j]
            at_collapse = wp.abs(deformation[i, j] - past_share[j] * change)
            peak_deformation[i, j] = wp.max(peak_deformation[i, j], at_collapse)
    collapse_time[j] = dtype(index + 1) * step[j] - past_share[j] * h[j]
    stands[j] = dtype(0.0)
    last_interval[j] = interval + 1
    h[j] = dtype(0.0)


def judge_demand():
    if collapse_time[j] >= dtype(0.0):
        status = collapsed
        if move[j] > longest_move:
            status = unstable_step


def write():
    if collapse_time[j] >= dtype(0.0):
        output.time_of_collapse[o] = collapse_time[j]
    if status == collapsed:
        output.spring_of_collapse[o] = int(collapse_spring[j]) - 1
        if HAS_STOREYS:
            output.storey_of_collapse[o] = storey_of_spring(int(collapse_spring[j]) - 1)
        if RESIDUAL:  # NaN: a collapsed structure has no residual deformation
            for unsettled in range(ROWS):
                output.residual_deformation[unsettled, o] = wp.sqrt(dtype(-1.0))
