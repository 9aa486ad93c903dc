"""Recorder of the largest absolute acceleration of every floor (or degree of freedom)."""

from warpdyn.foundations.core.output_variables import Variable

order = 20
VARIABLES = {
    "chain": {"peak_floor_acceleration": Variable(("floor",), "m s-2", "peak absolute floor acceleration")},
    "lumped": {"peak_acceleration": Variable(("dof",), "m s-2", "peak absolute acceleration")},
    "dense": {"peak_acceleration": Variable(("dof",), "m s-2", "peak absolute acceleration")},
}


def wanted(plan):
    return "acceleration" in plan.recorders


def values_held(plan):
    return 2 * plan.dofs if plan.collapses and plan.kind == "exact" else plan.dofs


def declare():
    peak_acceleration = matrix()
    lives = row()  # 1, or 0 for a lane that has finished
    seen = row()  # 1, or 0 for a lane whose last state was recorded
    if PROPAGATED and COLLAPSE:
        # Value of the previous state; whether the building collapses in this state is not known yet.
        earlier_size = matrix()


def settle_lane():
    # The acceleration of a lane that has finished stays constant and changes no peak, unless it is loaded.
    if HAS_ADD_LOAD and not IMPLICIT_CHAIN:
        lives[j] = dtype(0.0)
        seen[j] = dtype(0.0)
        if interval < live_intervals[j]:
            lives[j] = dtype(1.0)
        if interval <= live_intervals[j]:
            seen[j] = dtype(1.0)


def begin_walk():
    if HAS_ADD_LOAD and IMPLICIT_CHAIN:
        seen[j] = dtype(0.0)
        if h_last[j] + h[j] > dtype(0.0):
            seen[j] = dtype(1.0)


def see_forces():
    size = wp.abs(ai)
    if HAS_BEFORE_FORCE_ENDS:
        slot("before_force_ends")
        size = larger(size, wp.abs(before_end))
    if HAS_ADD_LOAD:
        size = size * seen[j]
    if COLLAPSE or SPRING_COLLAPSE:
        if PROPAGATED:
            present_size = size
            size = earlier_size[i, j]
            earlier_size[i, j] = present_size
        size = size * stands[j]
    peak_acceleration[i, j] = larger(peak_acceleration[i, j], size)


def restart_recorders():
    for i in range(N):
        peak_acceleration[i, j] = dtype(0.0)
        if PROPAGATED and COLLAPSE:
            earlier_size[i, j] = dtype(0.0)


def end_step():
    if HAS_ADD_LOAD and not IMPLICIT_CHAIN:
        for j in range(LANES):
            seen[j] = lives[j]


def finish_storey():
    if PROPAGATED and COLLAPSE:
        peak_acceleration[i, j] = larger(peak_acceleration[i, j], earlier_size[i, j] * stands[j])
    if IS_CHAIN:
        output.peak_floor_acceleration[g, o] = peak_acceleration[i, j]
    else:
        output.peak_acceleration[g, o] = peak_acceleration[i, j]
