"""Collapse: a sample ends when the drift of a storey exceeds its capacity; peaks are recorded up to this instant.

The instant of collapse is the earliest instant at which a storey drift reaches its capacity, by linear interpolation
between the drifts at the start and end of the step (with an adaptive method: of the part of a step). The capacity of a
storey is the smaller of two drifts: the limit of the drift ratio of the building times the storey height, and the drift
capacity of the storey. After a collapse the state of the sample remains constant until all samples of its thread have
finished.

If the drift changes by more than half the capacity in the step that exceeds the capacity, the cause may be an unstable
integration instead of a collapse. Then the status is unstable_step, and the sample is run again with shorter steps. An
unstable oscillation changes its sign at each step, so its drift changes by more than the capacity, even if the
oscillation grows slowly. If an unstable drift grows to one side by a factor above 2 per step, it changes by more than
half the capacity. A real collapse would need a drift velocity above 10 m/s (capacity 0.1 m, step 5 ms).
"""

from typing import Any

import warp as wp

order = 10

BORROWS = {"drift": ("peak_drift",), "adaptivity": ("done", "part", "whole_step")}
FIELDS = {
    "Control": {"collapse_drift_ratio": "float"},
    "Structure": {"inverse_drift_capacity": "float[,]"},
    "Output": {"time_of_collapse": "float[]", "storey_of_collapse": "int32[]"},
}


@wp.func
def share_beyond(before: Any, after: Any, inverse_capacity: Any):
    """Return the fraction of a step that remains when a drift reaches its capacity, by linear interpolation.

    The result is 0 if the drift does not exceed its capacity at the end of the step.

    Args:
        before: Drift at the start of the step [m].
        after: Drift at the end of the step [m].
        inverse_capacity: 1 / capacity [1/m]; 0: no capacity.
    """
    share = type(after)(0.0)
    one = type(after)(1.0)
    outward = wp.sign(after)
    reached = outward * after * inverse_capacity
    if reached > one:
        share = wp.min((reached - one) / (reached - outward * before * inverse_capacity), one)
    return share


def wanted(plan):
    return plan.collapses and plan.pattern is None


def names(plan):
    from warpdyn.engine.kernels.plan import DTYPES

    # Capacities are given as storey drifts or as drift ratios; the kernel uses both as drifts.
    half = wp.constant(DTYPES[plan.dtype](0.5))
    return {"HAS_CAPACITY": plan.has_drift_capacity, "longest_move": half}


def values_held(plan):
    return (3 if plan.kind == "exact" else 2) * plan.dofs + 6


def declare():
    inverse_capacity = matrix()  # 0: no capacity
    earlier_drift = matrix()  # drift at the start of the step
    if PROPAGATED:
        present_drift = matrix()
    over = row()  # the largest ratio of drift to capacity
    peak_while_standing = matrix()
    collapse_time = row()  # negative before the collapse
    collapse_storey = row()
    past_share = row()  # share of the last step that follows the collapse
    # Largest (change of drift in that step) / (drift capacity), among the storeys that passed their capacity.
    move = row()
    farthest_ratio = row()  # largest drift ratio of these storeys
    stands = row()  # 1; 0 if the lane has collapsed and its last state before the collapse was recorded
    last_interval = indices()  # the last interval whose states are recorded


def start():
    for j in range(LANES):
        collapse_time[j] = dtype(-1.0)
        stands[j] = dtype(1.0)
        last_interval[j] = live_intervals[j]
    for i in range(N):
        for j in range(LANES):
            slot("number_storey")
            if not HAS_PADS or g < STOREYS:
                inverse_capacity[i, j] = inverse_height[i, j] / control.collapse_drift_ratio
                if HAS_CAPACITY:
                    own = structures.inverse_drift_capacity[g, samples.structure[samples.order[sample[j]]]]
                    inverse_capacity[i, j] = larger(inverse_capacity[i, j], own)
    if not PROPAGATED:
        for j in range(LANES):
            slot("find_first_to_pass")
            slot("compare_sections")
            if past_share[j] > dtype(0.0):
                collapse_time[j] = dtype(0.0)
                last_interval[j] = int(0)
                if EXPLICIT_CHAIN and HOLDS_STEP:
                    intervals = int(0)
            move[j] = dtype(0.0)  # the storey was beyond its capacity at the start
            farthest_ratio[j] = dtype(0.0)


def begin_interval():
    if not (EXPLICIT_CHAIN and HOLDS_STEP):
        standing = int(0)
        for j in range(LANES):
            if interval <= last_interval[j]:
                standing = 1


def stop_lane():
    if not (EXPLICIT_CHAIN and HOLDS_STEP):  # in that kernel the only sample of the thread leaves the loop
        h[j] = updated(collapse_time[j] >= dtype(0.0), dtype(0.0), h[j])


def settle_lane():
    if PROPAGATED:
        if collapse_time[j] >= dtype(0.0):
            live[j] = dtype(0.0)


def see_drift():
    if PROPAGATED:
        present_drift[i, j] = drift
        over[j] = larger(over[j], wp.abs(drift) * inverse_capacity[i, j])
    else:
        drift_seen = drift
        if IMPLICIT_CHAIN:
            drift_seen = drift_before
        earlier_drift[i, j] = drift_seen
        if DRIFT:
            if EXPLICIT_CHAIN and HOLDS_STEP:
                # In the loop the building has not collapsed; its last drift is recorded after the loop.
                peak_drift[i, j] = larger(peak_drift[i, j], wp.abs(drift_seen))
            else:
                peak_drift[i, j] = larger(peak_drift[i, j], wp.abs(drift_seen) * stands[j])


def see_state():
    if PROPAGATED:
        for j in range(LANES):
            if collapse_time[j] >= dtype(0.0):
                stands[j] = dtype(0.0)
            elif over[j] > dtype(1.0):
                slot("find_first_to_pass")
                collapse_time[j] = dtype(0.0)
                if index > 0:
                    collapse_time[j] = (dtype(index) - past_share[j]) * step[j]
                    slot("see_drifts_at_collapse")
                    stands[j] = dtype(0.0)
                live[j] = dtype(0.0)
                last_interval[j] = interval
            over[j] = dtype(0.0)
        for i in range(N):
            for j in range(LANES):
                earlier_drift[i, j] = present_drift[i, j]
                if DRIFT:
                    peak_drift[i, j] = larger(peak_drift[i, j], wp.abs(present_drift[i, j]) * stands[j])


def end_part():
    if ADAPTIVITY:
        slot("watch_drifts")


def end_step():
    if not (PROPAGATED or ADAPTIVITY or COLLAPSE_GROUPS):
        slot("watch_drifts")


def watch_drifts():
    for j in range(LANES):
        over[j] = dtype(0.0)
        if not (EXPLICIT_CHAIN and HOLDS_STEP):
            stands[j] = updated(collapse_time[j] >= dtype(0.0), dtype(0.0), stands[j])
    for i in range(N):
        for j in range(LANES):
            slot("accepted_drift")
            over[j] = larger(over[j], wp.abs(drift) * inverse_capacity[i, j])
    if EXPLICIT_CHAIN and HOLDS_STEP:
        for j in range(LANES):
            if over[j] > dtype(1.0):
                stands[j] = dtype(0.0)  # the sample leaves the loop; time and storey are found after it
    else:
        slot("watch_lanes")


def end_steps():
    for j in range(LANES):
        if stands[j] == dtype(0.0):
            slot("find_first_to_pass")
            slot("collapse_here")
    if DRIFT:
        for i in range(N):
            for j in range(LANES):
                peak_while_standing[i, j] = peak_drift[i, j]


def see_last():
    # Other parts record the end of the step in which the building collapses, but peaks end at the collapse.
    if DRIFT:
        for j in range(LANES):
            if stands[j] == dtype(0.0):
                for i in range(N):
                    peak_drift[i, j] = peak_while_standing[i, j]


def watch_lanes():
    if SECTIONS:  # the threads of a sample compare their storeys
        for j in range(LANES):
            if over[j] * stands[j] > dtype(1.0):
                slot("find_first_to_pass")
            slot("compare_sections")
            if past_share[j] * stands[j] > dtype(0.0):
                slot("collapse_here")
    else:
        # In nearly all steps no lane collapses. On a processor, testing all lanes at once takes a few vector
        # instructions; testing each lane takes a branch.
        some_pass = int(0)
        for j in range(LANES):
            some_pass = some_pass | wp.where(over[j] * stands[j] > dtype(1.0), 1, 0)
        if some_pass > 0:
            for j in range(LANES):
                if over[j] * stands[j] > dtype(1.0):
                    slot("find_first_to_pass")
                    slot("collapse_here")


def collapse_here():
    slot("see_drifts_at_collapse")
    collapse_time[j] = dtype(index + 1) * step[j] - past_share[j] * h[j]
    if ADAPTIVITY:
        collapse_time[j] = (dtype(index) + done[j]) * step[j] - past_share[j] * h[j]
        whole_step[j] = dtype(0.0)
        part[j] = dtype(0.0)
    stands[j] = dtype(0.0)
    last_interval[j] = interval + 1  # the first step of the next interval records this state
    h[j] = dtype(0.0)


def find_first_to_pass():
    collapse_storey[j] = dtype(-1.0)
    for i in range(N):
        slot("number_storey")
        if PROPAGATED:
            drift = present_drift[i, j]
        else:
            slot("accepted_drift")
        share = share_beyond(earlier_drift[i, j], drift, inverse_capacity[i, j])
        if share > dtype(0.0):
            change = wp.abs(drift - earlier_drift[i, j]) * inverse_capacity[i, j]
            move[j] = wp.max(move[j], change)
            farthest_ratio[j] = wp.max(farthest_ratio[j], wp.abs(drift) * inverse_height[i, j])
        if share > past_share[j]:
            past_share[j] = share
            collapse_storey[j] = dtype(g + 1)


def compare_sections():
    if SECTIONS:
        first_to_pass = across(past_share[j], THREADS)
        if past_share[j] < first_to_pass:
            collapse_storey[j] = dtype(-1.0)
        past_share[j] = first_to_pass


def see_drifts_at_collapse():
    if DRIFT:
        for i in range(N):
            if PROPAGATED:
                drift = present_drift[i, j]
            else:
                slot("accepted_drift")
            at_collapse = wp.abs(drift - past_share[j] * (drift - earlier_drift[i, j]))
            peak_drift[i, j] = wp.max(peak_drift[i, j], at_collapse)


def after_finish():
    if SECTIONS:
        collapse_storey[j] = across(collapse_storey[j], THREADS)
        move[j] = across(move[j], THREADS)
        farthest_ratio[j] = across(farthest_ratio[j], THREADS)


def judge_demand():
    if collapse_time[j] >= dtype(0.0):
        status = collapsed
        if not PROPAGATED:  # the exact method cannot blow up
            if move[j] > longest_move:
                status = unstable_step
            if farthest_ratio[j] > blown_up:
                status = diverged


def write():
    if collapse_time[j] >= dtype(0.0):
        output.time_of_collapse[o] = collapse_time[j]
    if status == collapsed:
        output.storey_of_collapse[o] = int(collapse_storey[j])
        if RESIDUAL:  # NaN: a collapsed building has no residual drift
            for unsettled in range(STOREYS):
                output.residual_drift_ratio[unsettled, o] = wp.sqrt(dtype(-1.0))
