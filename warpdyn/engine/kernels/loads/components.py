"""Several components of a recorded base motion, which act together on a lumped structure."""

from warpdyn.engine.kernels.loads import LOADS, at_ends

FIELDS = {
    # Values of all motions in one array [time x component], index of the first sample of each, number of its intervals.
    "Load": {"values": "float[]", "first": "int32[]", "intervals": "int32[]"},
}


def wanted(plan):
    return plan.pattern is not None and plan.pattern.components > 1 and LOADS[plan.load].is_base


def values_held(plan):
    return 3 * plan.pattern.components


def names(plan):
    import warp as wp

    from warpdyn.engine.device.processor import ELEMENT
    from warpdyn.engine.kernels.plan import DTYPES

    shape = plan.pattern.components, plan.lanes
    return {
        "MOTIONS": plan.pattern.components,
        "components": wp.types.matrix(shape=shape, dtype=DTYPES[plan.dtype]),
        "element": ELEMENT[plan.dtype],
    }


def declare():
    ground_begin = components()  # base acceleration at the start of the interval, and its change over the interval
    ground_change = components()
    ground_end = components()  # at the end of the interval
    sampled_value = components()
    next_value = indices()  # position of the sample at the end of the first interval
    last_value = indices()
    silent_from = indices()  # interval from which the motion is zero; a run that ends with it uses its last sample
    gain = row()  # the scale, or 0 after the last sample
    differing_motions = int(0)
    ground = components()
    ground_last = components()  # at the end of the last step
    momentum_along = components()  # of the load mass, along each component


def read_sample():
    last = loads.intervals[motion[j]]
    next_value[j] = loads.first[motion[j]] + 1
    last_value[j] = loads.first[motion[j]] + last
    silent_from[j] = wp.where(last < live_intervals[j], last, 2147483647)
    gain[j] = scale[j]
    for k in range(MOTIONS):
        ground_end[k, j] = loads.values[(next_value[j] - 1) * MOTIONS + k] * scale[j]
    differing_motions += wp.where(motion[j] != motion[0], 1, 0)


def in_interval():
    # Lanes that share a motion read it once.
    if differing_motions == 0:
        for k in range(MOTIONS):
            shared = element(loads.values, wp.min(next_value[0] + interval, last_value[0]) * MOTIONS + k)
            for j in range(LANES):
                sampled_value[k, j] = shared
    else:
        for k in range(MOTIONS):
            for j in range(LANES):
                sampled_here = element(loads.values, wp.min(next_value[j] + interval, last_value[j]) * MOTIONS + k)
                sampled_value[k, j] = sampled_here
    for j in range(LANES):
        factor = gain[j]
        for k in range(MOTIONS):
            begin, end, factor = at_ends(ground_end[k, j], sampled_value[k, j], gain[j], interval == silent_from[j])
            ground_begin[k, j] = begin
            ground_change[k, j] = end - begin
            ground_end[k, j] = end
        gain[j] = factor


def add_supply_of_walk():
    for k in range(MOTIONS):
        if TRAPEZOIDAL:
            # If the motion jumps, a step may end with another value than the next one starts with.
            if stage == 0:
                impulse = dtype(0.5) * (h_last[j] * ground_last[k, j] + h[j] * ground[k, j])
                energy_in[j] -= impulse * momentum_along[k, j]
        else:
            power_in[j] -= ground[k, j] * momentum_along[k, j]


def keep_end_of_step():
    for k in range(MOTIONS):
        ground_last[k, j] = ground_begin[k, j] + dtype(substep + 1) * inverse_substeps * ground_change[k, j]


def begin_walk():
    if UNDIVIDED and STAGES == 1:  # the only stage is at the start of the interval
        for k in range(MOTIONS):
            ground[k, j] = ground_begin[k, j]
    else:
        slot("position_of_stage")
        for k in range(MOTIONS):
            ground[k, j] = ground_begin[k, j] + at * ground_change[k, j]
