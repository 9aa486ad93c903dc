"""Collapse: a storey whose drift passes its capacity ends the sample, whose demands are those up to there.

A step that takes a storey from afar to far beyond its capacity is too long to say that it collapsed: the sample
diverges, and is run again at shorter steps.

The state stands still from then on, as that of a lane does whose run is over, and a thread ends with the last of its
samples. The capacity is the building's drift ratio or the storey's own drift, whichever is passed first.
"""

from typing import Any

import warp as wp

order = 10
FIELDS = {
    "Control": {"collapse_drift_ratio": "float"},
    "Structure": {"inverse_drift_capacity": "float[,]"},
    "Output": {"time_of_collapse": "float[]", "storey_of_collapse": "int32[]"},
}


@wp.func
def time_of_passing(index: int, step: Any, before: Any, after: Any):
    """Return when what grows from `before` to `after` within a step passes 1."""
    one = type(step)(1.0)
    return (type(step)(index) + wp.max(one - before, type(step)(0.0)) / (after - before)) * step


def wanted(plan):
    return plan.collapses


def names(plan):
    from warpdyn.kernels.plan import DTYPES

    # Of a storey's own drift or of its drift ratio, which reach the kernel as one.
    dtype = DTYPES[plan.dtype]
    # Of the capacity: where a step that tells a collapse may begin and end.
    near, beyond = wp.constant(dtype(1 / 3)), wp.constant(dtype(1.5))
    return {"HAS_CAPACITY": plan.has_drift_capacity, "near": near, "beyond": beyond}


def values_held(plan):
    return plan.dofs + 4


def declare():
    inverse_capacity = matrix()  # 0 where there is none
    over = row()  # the largest drift of the state over its capacity, and of the state before
    over_before = row()
    collapse_time = row()  # below 0 while the building stands
    collapse_storey = row()
    past = row()  # of the last step, the part that lies behind the collapse [s]
    stands = row()  # 1 until the lane collapses, then 0
    if PROPAGATED:
        earlier_drift = matrix()
    burst = row()  # 1 where the step was too long
    last_interval = indices()  # in which anything is seen


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
                    own = structures.inverse_drift_capacity[g, samples.structure[sample[j]]]
                    inverse_capacity[i, j] = larger(inverse_capacity[i, j], own)
            if not PROPAGATED:
                slot("accepted_drift")
                over[j] = larger(over[j], wp.abs(drift) * inverse_capacity[i, j])
    if not PROPAGATED:
        for j in range(LANES):
            if SECTIONS:
                over[j] = across(over[j], THREADS)
            if over[j] > dtype(1.0):
                collapse_time[j] = dtype(0.0)
                stands[j] = dtype(0.0)
                last_interval[j] = int(0)


def begin_interval():
    standing = int(0)
    for j in range(LANES):
        if interval <= last_interval[j]:
            standing = 1


def stop_lane():
    if collapse_time[j] >= dtype(0.0):
        h[j] = dtype(0.0)


def settle_lane():
    if PROPAGATED:
        if collapse_time[j] >= dtype(0.0):
            live[j] = dtype(0.0)


def see_drift():
    if DRIFT:
        # The last state is added at the end, as far as the collapse. Where a state is seen before it is known whether
        # the building stands in it, the peak is that of the state before.
        drift_seen = drift
        if IMPLICIT_CHAIN:
            drift_seen = drift_before
        if PROPAGATED:
            drift_seen = earlier_drift[i, j]
            earlier_drift[i, j] = drift
        peak_drift[i, j] = larger(peak_drift[i, j], wp.abs(drift_seen) * stands[j])
    if PROPAGATED:
        over[j] = larger(over[j], wp.abs(drift) * inverse_capacity[i, j])


def see_state():
    if PROPAGATED:
        for j in range(LANES):
            if over[j] > dtype(1.0):
                if collapse_time[j] < dtype(0.0):
                    collapse_time[j] = dtype(0.0)
                    if index > 0:
                        collapse_time[j] = time_of_passing(index - 1, step[j], over_before[j], over[j])
                        past[j] = dtype(index) * step[j] - collapse_time[j]
                    last_interval[j] = interval
                live[j] = dtype(0.0)
                stands[j] = dtype(0.0)
            over_before[j] = over[j]
            over[j] = dtype(0.0)


def end_step():
    if not PROPAGATED:
        for j in range(LANES):
            over_before[j] = over[j]
            over[j] = dtype(0.0)
        for i in range(N):
            for j in range(LANES):
                slot("accepted_drift")
                over[j] = larger(over[j], wp.abs(drift) * inverse_capacity[i, j])
        for j in range(LANES):
            if SECTIONS:
                over[j] = across(over[j], THREADS)
            if over[j] > dtype(1.0):
                if collapse_time[j] < dtype(0.0):
                    collapse_time[j] = time_of_passing(index, step[j], over_before[j], over[j])
                    past[j] = dtype(index + 1) * step[j] - collapse_time[j]
                    stands[j] = dtype(0.0)
                    last_interval[j] = interval + 1  # whose first step sees this state
                    if not ADAPTIVITY:  # whose steps are as short as they must be
                        if over_before[j] < near or over[j] > beyond:
                            burst[j] = dtype(1.0)
                h[j] = dtype(0.0)
                if ADAPTIVITY:
                    whole_step[j] = dtype(0.0)


def finish():
    over[j] = dtype(0.0)
    collapse_storey[j] = dtype(-1.0)


def finish_storey():
    if DRIFT:
        drift_of_end = dtype(0.0)
        rate_of_end = dtype(0.0)
        if PROPAGATED:
            drift_of_end = earlier_drift[i, j]
            for mode in range(N):
                of_end = shape[i * N + mode, j] if IS_COPIED else structures.mode_shape[i * N + mode, shaped[j]]
                rate_of_end += of_end * x[N + mode, j]
        else:
            drift_of_end = u[i, j]
            rate_of_end = v[i, j]
            if i > 0:
                drift_of_end -= u[i - 1, j]
                rate_of_end -= v[i - 1, j]
            elif SECTIONS:
                drift_of_end -= foot_u[j]
                rate_of_end -= foot_v[j]
        drift_reached = wp.abs(drift_of_end)
        capacity = dtype(1.0) / inverse_capacity[i, j]
        if collapse_time[j] > dtype(0.0) and drift_reached < capacity:
            drift_reached = wp.abs(drift_of_end - past[j] * rate_of_end)
        drift_reached = larger(peak_drift[i, j], drift_reached)
        if collapse_time[j] > dtype(0.0):  # adaptive methods see states within the step, as far as its end
            drift_reached = wp.min(drift_reached, capacity)
        peak_drift[i, j] = drift_reached
    if PROPAGATED:
        part_of_capacity = wp.abs(ratio_of_storey[i, j]) / inverse_height[i, j] * inverse_capacity[i, j]
        if part_of_capacity > over[j]:
            over[j] = part_of_capacity
            collapse_storey[j] = dtype(i + 1)


def finish_drift():
    part_of_capacity = wp.abs(drift) * inverse_capacity[i, j]
    if part_of_capacity > over[j]:
        over[j] = part_of_capacity
        collapse_storey[j] = dtype(g + 1)


def after_finish():
    if SECTIONS:
        most_over = across(over[j], THREADS)
        if over[j] < most_over:
            collapse_storey[j] = dtype(-1.0)
        collapse_storey[j] = across(collapse_storey[j], THREADS)


def judge_demand():
    if collapse_time[j] >= dtype(0.0):
        status = collapsed
        if burst[j] > dtype(0.0):
            status = diverged


def write():
    if status == collapsed:
        output.storey_of_collapse[o] = int(collapse_storey[j])
        if collapse_time[j] >= dtype(0.0):
            output.time_of_collapse[o] = collapse_time[j]
        if RESIDUAL:  # nothing comes to rest
            for unsettled in range(STOREYS):
                output.residual_drift_ratio[unsettled, o] = wp.sqrt(dtype(-1.0))
